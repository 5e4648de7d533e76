//! Sweeps over all points, the oracle of the solution: each point obeys the law exactly while the forces of
//! the others stand still.

use super::problem::ContactProblem;
use nalgebra::{DMatrix, Matrix3, Vector2};

use super::cone::{PointForce, at};

/// One point whose neighbours' forces are given: `u = W λ + b` with three rows.
#[derive(Clone, Copy, Debug)]
pub(super) struct PointProblem {
    pub w: Matrix3<f64>,
    /// Inverse of `w`; `None` where it has none.
    pub inverse: Option<Matrix3<f64>>,
    pub friction: f64,
}

/// Directions in which a slip is looked for where Newton's steps do not find it.
const DIRECTIONS: usize = 24;
/// Steps of Newton's method and of bisection: both end at rounding long before.
const STEPS: usize = 60;

impl PointProblem {
    pub fn new(w: Matrix3<f64>, friction: f64) -> Self {
        Self { w, inverse: w.try_inverse(), friction }
    }

    /// The force that obeys the law of Signorini and Coulomb; the nearest that was found where the
    /// point is so stiff along friction that the law has no solution.
    ///
    /// Units: `b` m; result N.
    pub fn solve(&self, b: PointForce) -> PointForce {
        if b.x >= 0.0 {
            return PointForce::zeros();
        }
        if self.friction == 0.0 {
            return PointForce::new(-b.x / self.w[(0, 0)], 0.0, 0.0);
        }
        let sticking = self.inverse.map(|inverse| -(inverse * b));
        if let Some(force) = sticking
            && force.x >= 0.0
            && force.yz().norm() <= self.friction * force.x
        {
            return force;
        }
        let start = sticking.map_or(-b.yz(), |force| force.yz());
        self.slipping(b, start)
    }

    /// The force of a slip: on the cone, opposite to the slip, and the gap is closed.
    fn slipping(&self, b: PointForce, start: Vector2<f64>) -> PointForce {
        let angle = start.y.atan2(start.x);
        // The sign of the turn changes at the root; it is bracketed around the start, ever wider.
        let mut best = (f64::INFINITY, PointForce::new(-b.x / self.w[(0, 0)], 0.0, 0.0));
        let step = std::f64::consts::TAU / DIRECTIONS as f64;
        let consider = |angle: f64, found: &mut (f64, PointForce)| {
            let (turn, along, force) = self.at(angle, b)?;
            // Where the slip goes along friction the law is broken: not a root.
            if along <= 0.0 && turn.abs() < found.0 {
                *found = (turn.abs(), force);
            }
            Some((turn, along))
        };
        for k in 0..=DIRECTIONS / 2 {
            for side in [1.0, -1.0] {
                let (near, far) =
                    (angle + side * step * k as f64, angle + side * step * (k + 1) as f64);
                let (Some(a), Some(c)) = (consider(near, &mut best), consider(far, &mut best))
                else {
                    continue;
                };
                if a.0 * c.0 > 0.0 || (a.1 > 0.0 && c.1 > 0.0) {
                    continue;
                }
                if let Some(force) = self.root((near, a.0), (far, c.0), b) {
                    return force;
                }
            }
        }
        best.1
    }

    /// Turn of the slip against friction's direction, slip along it, and the force, for friction at
    /// an angle; `None` where the normal force would have to pull.
    fn at(&self, angle: f64, b: PointForce) -> Option<(f64, f64, PointForce)> {
        let (sin, cos) = angle.sin_cos();
        let direction = PointForce::new(1.0, self.friction * cos, self.friction * sin);
        let moved = self.w * direction;
        let normal = -b.x / moved.x;
        // Written so that a NaN is refused too.
        let presses = normal > 0.0 && moved.x > 0.0;
        if !presses {
            return None;
        }
        let slip = normal * moved + b;
        let turn = cos * slip.z - sin * slip.y;
        Some((turn, cos * slip.y + sin * slip.z, normal * direction))
    }

    /// The root between two angles by false position (Illinois), with a bisection now and then.
    fn root(&self, mut low: (f64, f64), mut high: (f64, f64), b: PointForce) -> Option<PointForce> {
        let mut found = None;
        for step in 0..STEPS {
            let chord = low.0 - low.1 * (high.0 - low.0) / (high.1 - low.1);
            let middle = 0.5 * (low.0 + high.0);
            let angle = if step % 4 == 3 || !chord.is_finite() { middle } else { chord };
            let (turn, along, force) = self.at(angle, b)?;
            found = (along <= 0.0).then_some(force);
            if turn == 0.0 || (high.0 - low.0).abs() < 4.0 * f64::EPSILON {
                break;
            }
            match turn * low.1 > 0.0 {
                true => (low, high.1) = ((angle, turn), 0.5 * high.1),
                false => (high, low.1) = ((angle, turn), 0.5 * low.1),
            }
        }
        found
    }
}

/// Block Gauss–Seidel on a contact problem.
///
/// Source: Jourdan, Alart and Jean (1998), the nonlinear Gauss–Seidel method.
pub(super) struct Sweeps {
    w: DMatrix<f64>,
    points: Vec<PointProblem>,
}

impl Sweeps {
    pub fn new(problem: &ContactProblem) -> Self {
        let w = problem.w.to_matrix();
        let points = (0..problem.point_count())
            .map(|i| {
                let own = w.fixed_view::<3, 3>(3 * i, 3 * i).into_owned();
                PointProblem::new(own, problem.laws[i].friction())
            })
            .collect();
        Self { w, points }
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
                    let w = self.w.column(3 * i + axis);
                    motion.iter_mut().zip(w.iter()).for_each(|(u, w)| *u += w * change[axis]);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;
    use proptest::prelude::*;

    use super::super::cone::FrictionCone;
    use super::*;

    proptest! {
        #[test]
        fn one_point_obeys_the_law(
            a in prop::array::uniform9(-1.0..1.0f64),
            b in prop::array::uniform3(-1.0..1.0f64),
            friction in 0.0..1.2f64,
        ) {
            let a: Matrix3<f64> = Matrix3::from_column_slice(&a);
            let w: Matrix3<f64> = a * a.transpose() + 0.3 * Matrix3::identity();
            // Above this friction a point of this shape may have no solution or several.
            let coupling = w[(0, 1)].hypot(w[(0, 2)]);
            prop_assume!(friction * coupling < 0.8 * w[(0, 0)]);
            let problem = PointProblem::new(w, friction);
            let b = Vector3::from(b);
            let force = problem.solve(b);
            let residual =
                FrictionCone { friction }.residual(force, w * force + b, 1.0 / w[(0, 0)]);
            prop_assert!(residual < 1e-9 * (1.0 + force.norm()), "{residual:e} {force}");
        }
    }
}
