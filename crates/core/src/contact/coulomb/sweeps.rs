//! Sweeps over all points: each obeys the law exactly while the forces of the others stand still.

use super::local::PointProblem;
use super::problem::{ContactProblem, at};

/// Block Gauss–Seidel on a contact problem.
///
/// Source: Jourdan, Alart and Jean (1998), the nonlinear Gauss–Seidel method.
pub(super) struct Sweeps<'a> {
    problem: &'a ContactProblem,
    points: Vec<PointProblem>,
}

impl<'a> Sweeps<'a> {
    pub fn new(problem: &'a ContactProblem) -> Self {
        let points = (0..problem.point_count())
            .map(|i| {
                let own = problem.w.fixed_view::<3, 3>(3 * i, 3 * i).into_owned();
                PointProblem::new(own, problem.cones[i].friction)
            })
            .collect();
        Self { problem, points }
    }

    /// One sweep over all points in their order; `motion` stays `W λ + b`.
    pub fn sweep(&self, lambda: &mut [f64], motion: &mut [f64]) {
        for (i, point) in self.points.iter().enumerate() {
            let old = at(lambda, i);
            let without = at(motion, i) - point.w * old;
            let new = point.solve(without);
            let change = new - old;
            if change.iter().all(|c| *c == 0.0) {
                continue;
            }
            for axis in 0..3 {
                lambda[3 * i + axis] = new[axis];
                if change[axis] != 0.0 {
                    let w = self.problem.w.column(3 * i + axis);
                    motion.iter_mut().zip(w.iter()).for_each(|(u, w)| *u += w * change[axis]);
                }
            }
        }
    }
}
