//! Newton's method for the forces of all points together, once sweeps have told who sticks and slips.

use nalgebra::{DMatrix, DVector, Matrix2, Vector2};

use super::problem::{ContactProblem, at};

/// Share of the mean compliance added to the diagonal, so that forces which the body does not tell
/// apart (more points than it has motions) get one answer.
const SHIFT: f64 = 1e-13;

/// The forces after one step of the semismooth Newton method; `None` where the step has none.
///
/// Shapes: `lambda` and `motion` 3n. Units: N, m.
///
/// Source: Alart and Curnier (1991).
pub(super) fn step(problem: &ContactProblem, lambda: &[f64], motion: &[f64]) -> Option<Vec<f64>> {
    let pressed: Vec<usize> = (0..problem.point_count())
        .filter(|&i| lambda[3 * i] - problem.rho[i] * motion[3 * i] > 0.0)
        .collect();
    let mut next = vec![0.0; lambda.len()];
    if pressed.is_empty() {
        return Some(next);
    }
    let rows = 3 * pressed.len();
    let row_of = |k: usize| 3 * pressed[k / 3] + k % 3;
    let mut w = DMatrix::from_fn(rows, rows, |r, c| problem.w[(row_of(r), row_of(c))]);
    let shift = SHIFT * w.trace() / rows as f64;
    (0..rows).for_each(|r| w[(r, r)] += shift);
    // What points that open now have pressed with is taken away.
    let free = motion_without_opening(problem, lambda, motion, &pressed);
    let now = DVector::from_fn(rows, |r, _| lambda[row_of(r)]);
    // Unknown is the change of the forces; sticking points and gaps: W δ = −u.
    let mut jacobian = w.clone();
    let mut right = DVector::from_fn(rows, |r, _| -free[row_of(r)]);
    for (k, &point) in pressed.iter().enumerate() {
        let (force, slip) = (at(lambda, point), at(&free, point));
        let (mu, rho) = (problem.cones[point].friction, problem.rho[point]);
        let trial: Vector2<f64> = force.yz() - rho * slip.yz();
        let size = trial.norm();
        let radius = mu * (force.x - rho * slip.x).max(0.0);
        if size <= radius {
            continue;
        }
        let slip = Slip { force: force.yz(), normal: force.x, trial, radius, mu, rho };
        slip_rows(&mut jacobian, &mut right, &w, k, &slip);
    }
    let change = jacobian.lu().solve(&right)?;
    for r in 0..rows {
        next[row_of(r)] = now[r] + change[r];
    }
    next.iter().all(|x| x.is_finite()).then_some(next)
}

/// A slipping point: what its two tangential rows are made of.
struct Slip {
    force: Vector2<f64>,
    normal: f64,
    trial: Vector2<f64>,
    radius: f64,
    mu: f64,
    rho: f64,
}

/// Rows `δ_t − μ d δ_n − r (I − d dᵀ)/‖a‖ (δ_t − ρ W_t δ) = μ λ_n d − λ_t` of a slip in the direction
/// d = a/‖a‖ of its trial force a, whose cone has the radius r there.
fn slip_rows(
    jacobian: &mut DMatrix<f64>,
    right: &mut DVector<f64>,
    w: &DMatrix<f64>,
    k: usize,
    slip: &Slip,
) {
    let size = slip.trial.norm();
    let direction = slip.trial / size;
    let turned = (Matrix2::identity() - direction * direction.transpose()) * (slip.radius / size);
    // With the normal force itself instead of its trial value the row stays regular far from the
    // solution; both agree where the gap is closed.
    let radius = slip.mu * slip.normal.max(0.0);
    for c in 0..jacobian.ncols() {
        let tangential = Vector2::new(w[(3 * k + 1, c)], w[(3 * k + 2, c)]);
        let row = slip.rho * (turned * tangential);
        jacobian[(3 * k + 1, c)] = row.x;
        jacobian[(3 * k + 2, c)] = row.y;
    }
    for axis in 0..2 {
        let row = 3 * k + 1 + axis;
        jacobian[(row, row)] += 1.0;
        for other in 0..2 {
            jacobian[(row, 3 * k + 1 + other)] -= turned[(axis, other)];
        }
        jacobian[(row, 3 * k)] -= slip.mu * direction[axis];
        right[row] = radius * direction[axis] - slip.force[axis];
    }
}

/// Gaps and slips once the points that are not pressed have given up their forces, m.
fn motion_without_opening(
    problem: &ContactProblem,
    lambda: &[f64],
    motion: &[f64],
    pressed: &[usize],
) -> Vec<f64> {
    let mut free = motion.to_vec();
    let mut is_pressed = vec![false; problem.point_count()];
    pressed.iter().for_each(|&point| is_pressed[point] = true);
    for point in (0..problem.point_count()).filter(|&point| !is_pressed[point]) {
        for axis in 0..3 {
            let force = lambda[3 * point + axis];
            if force != 0.0 {
                let w = problem.w.column(3 * point + axis);
                free.iter_mut().zip(w.iter()).for_each(|(u, w)| *u -= w * force);
            }
        }
    }
    free
}
