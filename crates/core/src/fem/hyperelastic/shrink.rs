//! `J^−2/3 − 1` from `J − 1`, to the last digits at small strain too.

use pulp::{Scalar, Simd};

use super::lanes::Lanes;

/// Largest change of volume that the series is for.
const SERIES_MAX: f64 = 0.5;

/// `J^−2/3 − 1`.
///
/// Units: 1. `j_minus_one` above −1.
#[inline]
pub(super) fn shrink(j_minus_one: f64) -> f64 {
    if j_minus_one.abs() <= SERIES_MAX {
        series(Lanes::all(Scalar, j_minus_one)).numbers()[0]
    } else {
        far(j_minus_one)
    }
}

/// `J^(−2/3)` and its kin for a group of elements, with the bits of one element at a time.
#[inline(always)]
pub(super) fn shrink_lanes<S: Simd>(j_minus_one: Lanes<S>) -> Lanes<S> {
    let changes = j_minus_one.numbers();
    let mut is_far = false;
    for lane in 0..S::F64_LANES {
        is_far |= changes[lane].abs() > SERIES_MAX || changes[lane].is_nan();
    }
    let shrunk = series(j_minus_one);
    if !is_far {
        return shrunk;
    }
    let mut each = shrunk.numbers();
    for lane in 0..S::F64_LANES {
        if changes[lane].abs() > SERIES_MAX || changes[lane].is_nan() {
            each[lane] = far(changes[lane]);
        }
    }
    Lanes::of(j_minus_one.simd(), &each)
}

/// Not inlined: vectors must not be kept across it where it is not called.
#[cold]
#[inline(never)]
fn far(j_minus_one: f64) -> f64 {
    (-2.0 / 3.0 * j_minus_one.ln_1p()).exp_m1()
}

/// `z = J^−1/3 − 1` from Padé's approximation, corrected twice: with `ρ = J (1 + z)³ − 1` the right
/// value is `(1 + z)(1 + ρ)^−1/3`, and three terms of that series leave an error of order ρ⁴.
#[inline(always)]
fn series<S: Simd>(x: Lanes<S>) -> Lanes<S> {
    let (one, three) = (x.like(1.0), x.like(3.0));
    let mut z = (x * (-1.0 / 3.0)).over(one + x * (2.0 / 3.0));
    for _ in 0..2 {
        let cubed = z * (three + z * (three + z));
        let rho = x + (one + x) * cubed;
        let tail = x.like(2.0 / 9.0) - rho * (14.0 / 81.0);
        z = z + (one + z) * rho * (rho * tail - x.like(1.0 / 3.0));
    }
    z * (x.like(2.0) + z)
}

#[cfg(test)]
mod tests {
    use super::super::lanes::LANES_MAX;
    use super::*;
    use proptest::prelude::*;
    use pulp::{Arch, WithSimd};

    proptest! {
        #[test]
        fn shrink_agrees_with_logarithm_and_exponential(
            x in prop_oneof![-0.999..3.0f64, -0.5..0.5f64, -1e-6..1e-6f64, -1e-12..1e-12f64],
        ) {
            let (ours, libm) = (shrink(x), far(x));
            prop_assert!((ours - libm).abs() <= 1e-15 * libm.abs(), "{x:e}: {ours:e} {libm:e}");
        }

        #[test]
        fn groups_have_the_bits_of_one_element(x in prop::array::uniform8(-0.99..1.5f64)) {
            let together = Arch::new().dispatch(Together(x));
            for (x, together) in x.iter().zip(&together) {
                prop_assert_eq!(shrink(*x).to_bits(), together.to_bits());
            }
        }
    }

    struct Together([f64; LANES_MAX]);

    impl WithSimd for Together {
        type Output = Vec<f64>;

        fn with_simd<S: Simd>(self, simd: S) -> Vec<f64> {
            shrink_lanes(Lanes::of(simd, &self.0)).numbers()[..S::F64_LANES].to_vec()
        }
    }

    #[test]
    fn no_change_of_volume_shrinks_nothing() {
        assert_eq!(shrink(0.0), 0.0);
        assert!(shrink(f64::NAN).is_nan());
        assert!(Arch::new().dispatch(Together([f64::NAN; LANES_MAX]))[0].is_nan());
    }
}
