//! One number for each of several elements, in a vector of the processor.
//!
//! Everything here is inlined into a function that is compiled for the processor's vectors, so there
//! are no closures: the compiler would keep them apart.

use std::ops::{Add, Mul, Sub};

use pulp::{Simd, bytemuck};

/// Most elements that any processor's vector takes.
pub(super) const LANES_MAX: usize = 8;

/// One number for each element of a group.
#[derive(Clone, Copy)]
pub(super) struct Lanes<S: Simd> {
    simd: S,
    numbers: S::f64s,
}

/// Matrices 3 × 3 of a group: `m[row][column]`.
pub(super) type LaneMatrix<S> = [[Lanes<S>; 3]; 3];

impl<S: Simd> Lanes<S> {
    #[inline(always)]
    pub fn all(simd: S, x: f64) -> Self {
        Self { simd, numbers: simd.splat_f64s(x) }
    }

    /// The first numbers of an array, as many as the vector takes.
    #[inline(always)]
    pub fn of(simd: S, numbers: &[f64; LANES_MAX]) -> Self {
        let mut lanes = Self::all(simd, 0.0);
        let to: &mut [f64] = bytemuck::cast_slice_mut(std::slice::from_mut(&mut lanes.numbers));
        to.copy_from_slice(&numbers[..S::F64_LANES]);
        lanes
    }

    /// The numbers; those beyond the vector are zero.
    #[inline(always)]
    pub fn numbers(self) -> [f64; LANES_MAX] {
        let mut numbers = [0.0; LANES_MAX];
        let from: &[f64] = bytemuck::cast_slice(std::slice::from_ref(&self.numbers));
        numbers[..S::F64_LANES].copy_from_slice(from);
        numbers
    }

    /// `a / b`.
    #[inline(always)]
    pub fn over(self, other: Self) -> Self {
        Self { numbers: self.simd.div_f64s(self.numbers, other.numbers), ..self }
    }

    /// The vectors of the processor.
    #[inline(always)]
    pub fn simd(self) -> S {
        self.simd
    }

    /// One number in every lane.
    #[inline(always)]
    pub fn like(self, x: f64) -> Self {
        Self::all(self.simd, x)
    }
}

impl<S: Simd> Add for Lanes<S> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self { numbers: self.simd.add_f64s(self.numbers, other.numbers), ..self }
    }
}

impl<S: Simd> Sub for Lanes<S> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self { numbers: self.simd.sub_f64s(self.numbers, other.numbers), ..self }
    }
}

impl<S: Simd> Mul for Lanes<S> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self { numbers: self.simd.mul_f64s(self.numbers, other.numbers), ..self }
    }
}

impl<S: Simd> Mul<f64> for Lanes<S> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        self * self.like(factor)
    }
}

#[inline(always)]
pub(super) fn trace<S: Simd>(m: &LaneMatrix<S>) -> Lanes<S> {
    m[0][0] + m[1][1] + m[2][2]
}

/// Products `a b` of a group's matrices.
#[inline(always)]
pub(super) fn product<S: Simd>(a: &LaneMatrix<S>, b: &LaneMatrix<S>) -> LaneMatrix<S> {
    let mut c = *a;
    for i in 0..3 {
        for j in 0..3 {
            c[i][j] = a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j];
        }
    }
    c
}

/// Every entry times one number.
#[inline(always)]
pub(super) fn scaled<S: Simd>(a: &LaneMatrix<S>, by: Lanes<S>) -> LaneMatrix<S> {
    let mut scaled = *a;
    for i in 0..3 {
        for j in 0..3 {
            scaled[i][j] = a[i][j] * by;
        }
    }
    scaled
}

/// Cofactor matrix: `det(m) m⁻ᵀ`.
#[inline(always)]
pub(super) fn cofactor<S: Simd>(m: &LaneMatrix<S>) -> LaneMatrix<S> {
    let mut cofactor = *m;
    for i in 0..3 {
        for j in 0..3 {
            let [r, s] = [(i + 1) % 3, (i + 2) % 3];
            let [c, d] = [(j + 1) % 3, (j + 2) % 3];
            cofactor[i][j] = m[r][c] * m[s][d] - m[r][d] * m[s][c];
        }
    }
    cofactor
}

/// Sum of the products of all entries.
#[inline(always)]
pub(super) fn dot<S: Simd>(a: &LaneMatrix<S>, b: &LaneMatrix<S>) -> Lanes<S> {
    let mut sum = a[0][0] * b[0][0];
    for i in 0..3 {
        for j in 0..3 {
            if i + j > 0 {
                sum = sum + a[i][j] * b[i][j];
            }
        }
    }
    sum
}

/// Determinant, from the cofactors.
#[inline(always)]
pub(super) fn determinant<S: Simd>(m: &LaneMatrix<S>, cofactor: &LaneMatrix<S>) -> Lanes<S> {
    m[0][0] * cofactor[0][0] + m[0][1] * cofactor[0][1] + m[0][2] * cofactor[0][2]
}
