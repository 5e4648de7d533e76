//! The two precisions of a factor: double and single.

use std::ops::{AddAssign, Div, Mul, Neg, SubAssign};

use pulp::{Simd, bytemuck};

mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

/// Precision of a factor: `f64`, or `f32` at half the time and memory for use with refinement.
pub trait Real:
    bytemuck::Pod
    + Default
    + PartialOrd
    + AddAssign
    + SubAssign
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + Send
    + Sync
    + sealed::Sealed
{
    /// The number 0.
    const ZERO: Self;
    /// The number 1.
    const ONE: Self;
    /// Rows of a slab: one column of a slab is 192 bytes, three vectors of 512 bits.
    const SLAB: usize;

    /// As many numbers as the processor computes with at once.
    type Vector<S: Simd>: Copy;

    /// Nearest number of this precision.
    fn from_f64(value: f64) -> Self;

    /// The number in double precision, exactly.
    fn to_f64(self) -> f64;

    /// Square root of the number.
    fn root(self) -> Self;

    /// Whether a pivot can be divided by: positive and finite.
    fn is_pivot(self) -> bool;

    /// Whole vectors of a list.
    fn vectors<S: Simd>(values: &[Self]) -> &[Self::Vector<S>];

    /// Whole vectors of a list, to be changed.
    fn vectors_mut<S: Simd>(values: &mut [Self]) -> &mut [Self::Vector<S>];

    /// A vector of one number.
    fn splat<S: Simd>(simd: S, value: Self) -> Self::Vector<S>;

    /// `a b + c`, rounded once.
    fn mul_add<S: Simd>(
        simd: S,
        a: Self::Vector<S>,
        b: Self::Vector<S>,
        c: Self::Vector<S>,
    ) -> Self::Vector<S>;

    /// `a − b`.
    fn sub<S: Simd>(simd: S, a: Self::Vector<S>, b: Self::Vector<S>) -> Self::Vector<S>;

    /// Sum of the numbers of a vector.
    fn sum<S: Simd>(simd: S, a: Self::Vector<S>) -> Self;

    /// Adds a short list of numbers to another.
    fn add_onto<S: Simd>(simd: S, into: &mut [Self], values: &[Self]);
}

macro_rules! precision {
    ($real:ty, $slab:expr, $vector:ident, $as:ident, $as_mut:ident, $splat:ident, $mul_add:ident,
     $sub:ident, $sum:ident, $add:ident, $load:ident, $store:ident) => {
        impl Real for $real {
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            const SLAB: usize = $slab;

            type Vector<S: Simd> = S::$vector;

            #[inline(always)]
            fn from_f64(value: f64) -> Self {
                value as Self
            }

            #[inline(always)]
            fn to_f64(self) -> f64 {
                f64::from(self)
            }

            #[inline(always)]
            fn root(self) -> Self {
                self.sqrt()
            }

            #[inline(always)]
            fn is_pivot(self) -> bool {
                self > 0.0 && self.is_finite()
            }

            #[inline(always)]
            fn vectors<S: Simd>(values: &[Self]) -> &[S::$vector] {
                S::$as(values).0
            }

            #[inline(always)]
            fn vectors_mut<S: Simd>(values: &mut [Self]) -> &mut [S::$vector] {
                S::$as_mut(values).0
            }

            #[inline(always)]
            fn splat<S: Simd>(simd: S, value: Self) -> S::$vector {
                simd.$splat(value)
            }

            #[inline(always)]
            fn mul_add<S: Simd>(
                simd: S,
                a: S::$vector,
                b: S::$vector,
                c: S::$vector,
            ) -> S::$vector {
                simd.$mul_add(a, b, c)
            }

            #[inline(always)]
            fn sub<S: Simd>(simd: S, a: S::$vector, b: S::$vector) -> S::$vector {
                simd.$sub(a, b)
            }

            #[inline(always)]
            fn sum<S: Simd>(simd: S, a: S::$vector) -> Self {
                simd.$sum(a)
            }

            #[inline(always)]
            fn add_onto<S: Simd>(simd: S, into: &mut [Self], values: &[Self]) {
                let (into, into_tail) = S::$as_mut(into);
                let (values, values_tail) = S::$as(values);
                for (into, value) in into.iter_mut().zip(values) {
                    *into = simd.$add(*into, *value);
                }
                if !into_tail.is_empty() {
                    let sum = simd.$add(simd.$load(into_tail), simd.$load(values_tail));
                    simd.$store(into_tail, sum);
                }
            }
        }
    };
}

precision!(
    f64,
    24,
    f64s,
    as_simd_f64s,
    as_mut_simd_f64s,
    splat_f64s,
    mul_add_e_f64s,
    sub_f64s,
    reduce_sum_f64s,
    add_f64s,
    partial_load_f64s,
    partial_store_f64s
);
precision!(
    f32,
    48,
    f32s,
    as_simd_f32s,
    as_mut_simd_f32s,
    splat_f32s,
    mul_add_e_f32s,
    sub_f32s,
    reduce_sum_f32s,
    add_f32s,
    partial_load_f32s,
    partial_store_f32s
);
