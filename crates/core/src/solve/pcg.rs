//! Preconditioned conjugate gradients, which stop at a given residual and estimated error.

use super::vectors::{add_scaled, dot, norm, subtract};

/// Residual and error at which conjugate gradients stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PcgParams {
    /// `‖b − A x‖ / ‖b‖` to reach.
    pub residual_rel: f64,
    /// Estimate of `‖error‖ / ‖x‖` to reach as well; infinite where it does not matter.
    pub error_rel: f64,
    /// Steps at most.
    pub steps_max: u32,
}

/// Residual and error that conjugate gradients have reached.
pub(super) struct PcgOutcome {
    /// `b − A x`.
    pub residual: Vec<f64>,
    /// Steps of conjugate gradients.
    pub steps: u32,
    /// Estimate of `‖error‖ / ‖x‖`.
    pub error_estimate_rel: f64,
}

/// The error is `A⁻¹ r`; a preconditioner close to `A` gives `M⁻¹ r` instead, which is as large to
/// within a factor that this is meant to cover.
const ESTIMATE_SAFETY: f64 = 2.0;

/// Improves `x` until residual and estimated error are small enough, the residual falls no more, or
/// the steps are used up.
///
/// `apply` is `A`, symmetric positive definite; `precondition` an approximation of `A⁻¹`, also
/// symmetric positive definite. The direction is kept conjugate in the flexible way
/// (Polak–Ribière), because a single-precision factor is not exactly a linear operator.
///
/// Source: Hestenes and Stiefel 1952; the flexible form after Golub and Ye 1999.
pub(super) fn solve(
    apply: &dyn Fn(&[f64]) -> Vec<f64>,
    precondition: &dyn Fn(&[f64]) -> Vec<f64>,
    b: &[f64],
    x: &mut [f64],
    params: PcgParams,
) -> PcgOutcome {
    let target = params.residual_rel * norm(b);
    let mut r = subtract(b, &apply(x));
    let mut direction = precondition(&r);
    let mut rho = dot(&r, &direction);
    let mut best =
        Best { size: norm(&r), error: estimate(&direction, x), x: x.to_vec(), r: r.clone() };
    let mut steps = 0;
    let mut stale = 0;
    let reached = |best: &Best| best.size <= target && best.error <= params.error_rel;
    while !reached(&best) && steps < params.steps_max && stale < STALE_MAX {
        let a_direction = apply(&direction);
        let curvature = dot(&direction, &a_direction);
        if curvature.is_nan() || curvature <= 0.0 || rho.is_nan() {
            break;
        }
        let step = rho / curvature;
        add_scaled(x, step, &direction);
        let mut r_next = r.clone();
        add_scaled(&mut r_next, -step, &a_direction);
        steps += 1;
        let z = precondition(&r_next);
        let rho_next = dot(&r_next, &z);
        let beta = (rho_next - dot(&r, &z)) / rho;
        for (d, z) in direction.iter_mut().zip(&z) {
            *d = z + beta * *d;
        }
        (r, rho) = (r_next, rho_next);
        // The recurrence drifts from the true residual; only the true one may end the loop.
        if norm(&r) <= target.max(0.1 * best.size) || steps % TRUE_EVERY == 0 {
            r = subtract(b, &apply(x));
            let size = norm(&r);
            stale = if size < 0.5 * best.size { 0 } else { stale + 1 };
            if size < best.size {
                best = Best { size, error: estimate(&z, x), x: x.to_vec(), r: r.clone() };
            }
        }
    }
    x.copy_from_slice(&best.x);
    PcgOutcome { residual: best.r, steps, error_estimate_rel: best.error }
}

/// The iterate with the smallest true residual so far.
struct Best {
    size: f64,
    error: f64,
    x: Vec<f64>,
    r: Vec<f64>,
}

/// Estimate of `‖error‖ / ‖x‖` from the preconditioned residual.
fn estimate(z: &[f64], x: &[f64]) -> f64 {
    match norm(z) {
        0.0 => 0.0,
        size => ESTIMATE_SAFETY * size / norm(x),
    }
}

/// Checks of the true residual without halving it before the end is taken for reached.
const STALE_MAX: u32 = 3;
/// The true residual is looked at least this often.
const TRUE_EVERY: u32 = 20;

#[cfg(test)]
mod tests {
    use super::*;

    /// Tridiagonal `2, −1` of the string; its condition grows with the square of its length.
    fn string(x: &[f64]) -> Vec<f64> {
        let at = |i: usize| x.get(i).copied().unwrap_or(0.0);
        (0..x.len()).map(|i| 2.0 * x[i] - at(i + 1) - if i > 0 { x[i - 1] } else { 0.0 }).collect()
    }

    /// Without a residual to reach, the estimated error ends the loop; with a preconditioner near
    /// the matrix it is above the true one, and not by much.
    #[test]
    fn estimated_error_is_reached_and_covers_the_true_one() {
        let n = 40;
        let exact: Vec<f64> = (0..n).map(|i| (0.3 * i as f64).cos()).collect();
        // 2.5 on the diagonal: solved by Jacobi sweeps, as a good but inexact preconditioner.
        let apply =
            |x: &[f64]| -> Vec<f64> { string(x).iter().zip(x).map(|(s, x)| s + 0.5 * x).collect() };
        let precondition = |r: &[f64]| -> Vec<f64> {
            let mut z = vec![0.0; n];
            for _ in 0..8 {
                let az = apply(&z);
                z.iter_mut().zip(r.iter().zip(&az)).for_each(|(z, (r, az))| *z += (r - az) / 2.5);
            }
            z
        };
        let b = apply(&exact);
        for error_rel in [1e-2, 1e-5, 1e-9] {
            let mut x = vec![0.0; n];
            let params = PcgParams { residual_rel: 1.0, error_rel, steps_max: 50 };
            let outcome = solve(&apply, &precondition, &b, &mut x, params);
            let error = norm(&subtract(&x, &exact)) / norm(&x);
            let estimate = outcome.error_estimate_rel;
            assert!(estimate <= error_rel && error <= estimate, "{error:e} {estimate:e}");
            assert!(estimate <= 10.0 * error + 1e-14, "{error:e} {estimate:e}");
        }
    }

    #[test]
    fn stated_residual_is_reached_and_not_much_more() {
        let b: Vec<f64> = (0..60).map(|i| (i as f64).sin()).collect();
        for residual_rel in [1e-3, 1e-8, 1e-12] {
            let mut x = vec![0.0; 60];
            let params = PcgParams { residual_rel, error_rel: f64::INFINITY, steps_max: 200 };
            let outcome = solve(&string, &|r| r.to_vec(), &b, &mut x, params);
            let (r, steps) = (outcome.residual, outcome.steps);
            assert!(norm(&r) <= residual_rel * norm(&b), "{residual_rel:e} after {steps} steps");
            assert!((norm(&subtract(&b, &string(&x))) - norm(&r)).abs() <= 1e-15 * norm(&b));
        }
    }

    #[test]
    fn wrong_sign_ends_with_the_best_so_far_and_not_with_nan() {
        let mut x = vec![0.0; 3];
        let negative = |v: &[f64]| v.iter().map(|v| -v).collect::<Vec<_>>();
        let params = PcgParams { residual_rel: 1e-10, error_rel: 1e-10, steps_max: 50 };
        let PcgOutcome { residual: r, .. } =
            solve(&negative, &|r| r.to_vec(), &[1.0, 2.0, 3.0], &mut x, params);
        assert!(x.iter().chain(&r).all(|v| v.is_finite()));
    }
}
