//! Newton's method for the forces of all points together.
//!
//! More points than a patch of surface has motions leave their forces undetermined, and Newton's matrix
//! has no inverse. So a step is made on a problem with a little compliance at each point, counted from
//! the forces it begins with (proximal point method): its matrix has an inverse, and forces that it does
//! not change any more are those of the problem itself.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::lu::partial_pivoting::factor::{lu_in_place, lu_in_place_scratch};
use faer::linalg::lu::partial_pivoting::solve::{
    solve_in_place as lu_solve, solve_in_place_scratch as lu_solve_scratch,
};
use faer::prelude::*;
use faer::{MatMut, Par, Spec};
use nalgebra::{DMatrix, Matrix2, Matrix3, Vector2};

use super::cone::{PointForce, at};
use super::law::PointLaw;
use super::problem::ContactProblem;

/// A problem with a little compliance at every point, counted from given forces.
pub(super) struct Proximal<'a> {
    problem: &'a ContactProblem,
    /// Compliance added to each point, m/N.
    added: Vec<f64>,
    /// Forces that the added compliance is unloaded at, N.
    from: &'a [f64],
}

/// Forces that Newton's method has found, and how well they solve the proximal problem.
pub(super) struct Step {
    pub lambda: Vec<f64>,
    /// Residual of the proximal problem, N.
    pub residual: f64,
    pub steps: usize,
}

/// When Newton's method ends without a solution.
pub(super) struct NewtonLimits {
    /// Most steps.
    pub steps: usize,
    /// Steps without a better residual after which no better one is expected.
    pub straying: usize,
    /// Over the best residual, one from which it does not come back. One step may lead far away from a residual that
    /// is small already, and the next ones back.
    pub runaway: f64,
}

impl<'a> Proximal<'a> {
    /// `share` of every point's own compliance is added to it; a spring has its own.
    pub fn new(problem: &'a ContactProblem, from: &'a [f64], share: f64) -> Self {
        let of_point =
            |(rho, law): (&f64, &PointLaw)| if law.is_spring() { 0.0 } else { share / rho };
        let added = problem.rho.iter().zip(&problem.laws).map(of_point).collect();
        Self { problem, added, from }
    }

    /// Takes steps of the semismooth Newton method until the residual is small enough, or it is late.
    ///
    /// Units: `tolerance` N.
    ///
    /// Source: Alart and Curnier (1991); Rockafellar (1976) for the proximal point.
    pub fn solve(&self, limits: &NewtonLimits, tolerance: f64, is_late: &dyn Fn() -> bool) -> Step {
        let mut lambda = self.from.to_vec();
        let mut best_at = 0;
        let mut best = Step { lambda: self.from.to_vec(), residual: f64::INFINITY, steps: 0 };
        for steps in 0..=limits.steps {
            let inside = self.problem.projected(&lambda);
            let residual = self.problem.residual_of(&inside, &self.motion(&inside));
            best.steps = steps;
            if residual < best.residual {
                (best.lambda, best.residual, best_at) = (inside, residual, steps);
            }
            let strays =
                steps >= best_at + limits.straying || residual > limits.runaway * best.residual;
            if best.residual <= tolerance || steps == limits.steps || strays || is_late() {
                break;
            }
            match self.step(&lambda) {
                Some(next) => lambda = next,
                None => break,
            }
        }
        best
    }

    fn motion(&self, lambda: &[f64]) -> Vec<f64> {
        let mut motion = self.problem.motion(lambda);
        for (k, u) in motion.iter_mut().enumerate() {
            *u += self.added[k / 3] * (lambda[k] - self.from[k]);
        }
        motion
    }

    /// One step; `None` where it has none.
    ///
    /// Every pressed point answers a motion by a force, `δ = g − H (W δ)` with a block H of its own, so that
    /// the motions `v = K B δ` of the corners obey `(I + K B H Bᵀ) v = K B g`: the size of the system is
    /// that of the corners, however many points lie between them.
    fn step(&self, lambda: &[f64]) -> Option<Vec<f64>> {
        let problem = self.problem;
        let motion = self.motion(lambda);
        let pressed: Vec<usize> = (0..problem.point_count())
            .filter(|&i| {
                let presses = lambda[3 * i] - problem.rho[i] * motion[3 * i] > 0.0;
                presses || problem.laws[i].is_spring()
            })
            .collect();
        let mut next = vec![0.0; lambda.len()];
        if pressed.is_empty() {
            return Some(next);
        }
        // Points that are not pressed give up their forces.
        let mut kept = vec![0.0; lambda.len()];
        for &point in &pressed {
            kept[3 * point..3 * point + 3].copy_from_slice(&lambda[3 * point..3 * point + 3]);
        }
        let free = self.motion(&kept);
        let answer = |&point: &usize| {
            let (rho, added) = (problem.rho[point], self.added[point]);
            let force = at(lambda, point);
            let cone = match problem.laws[point] {
                PointLaw::Contact(cone) => cone,
                PointLaw::Spring { stiffness } => {
                    return Answer::spring(&stiffness, force, at(&free, point).x);
                }
            };
            match Slip::new(cone.friction, rho, &force, &at(&motion, point)) {
                Some(slip) => slip.answer(added, at(&free, point).x),
                None => Answer::sticking(added, at(&free, point)),
            }
        };
        let answers: Vec<Answer> = pressed.iter().map(answer).collect();
        let part = (pressed.len() < problem.point_count()).then(|| problem.w.of_points(&pressed));
        let w = part.as_ref().unwrap_or(&problem.w);
        let given: Vec<f64> = answers.iter().flat_map(|a| <[f64; 3]>::from(a.given)).collect();
        let blocks: Vec<Matrix3<f64>> = answers.iter().map(|a| a.per_motion).collect();
        let mut v = w.moved_corners(&given);
        solve_in_place(w.coupled(&blocks), &mut v);
        for (k, (&point, answer)) in pressed.iter().zip(&answers).enumerate() {
            let change = answer.given - answer.per_motion * w.motion_of(k, &v);
            let force = at(&kept, point) + change;
            next[3 * point..3 * point + 3].copy_from_slice(force.as_slice());
        }
        next.iter().all(|x| x.is_finite()).then_some(next)
    }
}

/// Solves a square system for right sides one after another, by elimination with row exchanges on one
/// thread: the same bits however many there are. Numbers that are not finite where it has no solution.
pub(super) fn solve_in_place(mut matrix: DMatrix<f64>, right: &mut [f64]) {
    let n = matrix.nrows();
    if n == 0 {
        return;
    }
    let sides = right.len() / n;
    let (mut rows, mut places) = (vec![0usize; n], vec![0usize; n]);
    let need = lu_in_place_scratch::<usize, f64>(n, n, Par::Seq, Spec::default())
        .or(lu_solve_scratch::<usize, f64>(n, sides, Par::Seq));
    let mut memory = MemBuffer::new(need);
    let stack = MemStack::new(&mut memory);
    let mut lu = MatMut::from_column_major_slice_mut(matrix.as_mut_slice(), n, n);
    let (_, order) =
        lu_in_place(lu.rb_mut(), &mut rows, &mut places, Par::Seq, stack, Spec::default());
    let right = MatMut::from_column_major_slice_mut(right, n, sides);
    lu_solve(lu.rb(), lu.rb(), order, right, Par::Seq, stack);
}

/// How a point answers its motion u: a change of its force by `given − per_motion u`.
struct Answer {
    given: PointForce,
    /// 3 × 3, N/m.
    per_motion: Matrix3<f64>,
}

impl Answer {
    /// A point that sticks: `added δ + W δ = −free`.
    fn sticking(added: f64, free: PointForce) -> Self {
        Self { given: -free / added, per_motion: Matrix3::identity() / added }
    }

    /// A spring: `δ = −(λ + k free) − k (W δ)_n`.
    ///
    /// Units: `stiffness` N/m, `force` N, `free` m.
    fn spring(stiffness: &PointForce, force: PointForce, free: f64) -> Self {
        let mut per_motion = Matrix3::zeros();
        per_motion.set_column(0, stiffness);
        Self { given: -force - stiffness * free, per_motion }
    }
}

/// A slipping point: what its two tangential rows are made of.
struct Slip {
    force: PointForce,
    /// Direction of the trial force `λ_t − ρ u_t`.
    direction: Vector2<f64>,
    /// Radius of the cone over the size of the trial force.
    share: f64,
    friction: f64,
    rho: f64,
}

impl Slip {
    /// `None` where the trial force lies in the cone: the point sticks.
    fn new(friction: f64, rho: f64, force: &PointForce, motion: &PointForce) -> Option<Self> {
        let trial: Vector2<f64> = force.yz() - rho * motion.yz();
        let (size, radius) = (trial.norm(), friction * force.x.max(0.0));
        let slips = size > radius;
        slips.then(|| Self {
            force: *force,
            direction: trial / size,
            share: radius / size,
            friction,
            rho,
        })
    }

    /// Of `added δ_n + (W δ)_n = −free_n` and, with `T = r/‖a‖ (I − d dᵀ)`,
    /// `δ_t − μ d δ_n − T (δ_t − ρ (added δ_t + (W δ)_t)) = μ λ_n d − λ_t`.
    ///
    /// Units: `added` m/N, `free` m, the normal motion without a change.
    fn answer(&self, added: f64, free: f64) -> Answer {
        let Self { direction: d, share, friction, rho, .. } = *self;
        let along = d * d.transpose();
        let across = Matrix2::identity() - along;
        let inverse = along + across / (1.0 - share * (1.0 - rho * added));
        let normal = -free / added;
        let missing = friction * self.force.x.max(0.0) * d - self.force.yz();
        let tangential = inverse * (missing + friction * normal * d);
        let mut per_motion = Matrix3::zeros();
        per_motion[(0, 0)] = 1.0 / added;
        per_motion.fixed_view_mut::<2, 1>(1, 0).copy_from(&(inverse * (friction / added * d)));
        per_motion.fixed_view_mut::<2, 2>(1, 1).copy_from(&(inverse * (rho * share * across)));
        Answer { given: PointForce::new(normal, tangential.x, tangential.y), per_motion }
    }
}
