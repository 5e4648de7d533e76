//! The two precisions of a factor: double and single.

use std::ops::AddAssign;

mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

/// Precision of a factor: `f64`, or `f32` at half the time and memory for use with refinement.
pub trait Real:
    faer::traits::RealField + Copy + Default + PartialOrd + AddAssign + sealed::Sealed
{
    /// Zero.
    const ZERO: Self;
    /// Minus one.
    const MINUS_ONE: Self;

    /// Nearest number of this precision.
    fn from_f64(value: f64) -> Self;

    /// Exact value.
    fn to_f64(self) -> f64;

    /// Whether a pivot can be divided by: positive and finite.
    fn is_pivot(self) -> bool;
}

impl Real for f64 {
    const ZERO: Self = 0.0;
    const MINUS_ONE: Self = -1.0;

    #[inline]
    fn from_f64(value: f64) -> Self {
        value
    }

    #[inline]
    fn to_f64(self) -> f64 {
        self
    }

    #[inline]
    fn is_pivot(self) -> bool {
        self > 0.0 && self.is_finite()
    }
}

impl Real for f32 {
    const ZERO: Self = 0.0;
    const MINUS_ONE: Self = -1.0;

    #[inline]
    fn from_f64(value: f64) -> Self {
        value as Self
    }

    #[inline]
    fn to_f64(self) -> f64 {
        f64::from(self)
    }

    #[inline]
    fn is_pivot(self) -> bool {
        self > 0.0 && self.is_finite()
    }
}
