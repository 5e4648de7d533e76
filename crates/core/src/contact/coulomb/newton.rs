//! Newton's method for the forces of all points together.
//!
//! More points than a patch of surface has motions leave their forces undetermined, and Newton's matrix
//! has no inverse. So a step is made on a problem with a little compliance at each point, counted from
//! the forces it begins with (proximal point method): its matrix has an inverse, and forces that it does
//! not change any more are those of the problem itself.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::lu::partial_pivoting::factor::{lu_in_place, lu_in_place_scratch};
use faer::linalg::lu::partial_pivoting::solve::{solve_in_place, solve_in_place_scratch};
use faer::prelude::*;
use faer::{MatMut, Par, Spec};
use nalgebra::{DMatrix, DVector, Matrix2, Vector2};

use super::cone::PointForce;
use super::problem::{ContactProblem, at};

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

/// Steps without a better residual after which no better one is expected.
const STRAYING: usize = 4;

impl<'a> Proximal<'a> {
    /// `share` of every point's own compliance is added to it.
    pub fn new(problem: &'a ContactProblem, from: &'a [f64], share: f64) -> Self {
        let added = problem.rho.iter().map(|rho| share / rho).collect();
        Self { problem, added, from }
    }

    /// Takes steps of the semismooth Newton method until the residual is small enough.
    ///
    /// Units: `tolerance` N.
    ///
    /// Source: Alart and Curnier (1991); Rockafellar (1976) for the proximal point.
    pub fn solve(&self, steps_max: usize, tolerance: f64) -> Step {
        let mut lambda = self.from.to_vec();
        let mut best_at = 0;
        let mut best = Step { lambda: self.from.to_vec(), residual: f64::INFINITY, steps: 0 };
        for steps in 0..=steps_max {
            let inside = self.problem.projected(&lambda);
            let residual = self.problem.residual_of(&inside, &self.motion(&inside));
            best.steps = steps;
            if residual < best.residual {
                (best.lambda, best.residual, best_at) = (inside, residual, steps);
            }
            let strays = steps >= best_at + STRAYING;
            if best.residual <= tolerance || steps == steps_max || strays {
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
    fn step(&self, lambda: &[f64]) -> Option<Vec<f64>> {
        let problem = self.problem;
        let motion = self.motion(lambda);
        let pressed: Vec<usize> = (0..problem.point_count())
            .filter(|&i| lambda[3 * i] - problem.rho[i] * motion[3 * i] > 0.0)
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
        let rows = 3 * pressed.len();
        let row_of = |k: usize| 3 * pressed[k / 3] + k % 3;
        let mut w = DMatrix::from_fn(rows, rows, |r, c| problem.w[(row_of(r), row_of(c))]);
        (0..rows).for_each(|r| w[(r, r)] += self.added[pressed[r / 3]]);
        let mut jacobian = w.clone();
        let mut right = DVector::from_fn(rows, |r, _| -free[row_of(r)]);
        for (k, &point) in pressed.iter().enumerate() {
            let rho = problem.rho[point];
            let slip = Slip::new(
                problem.cones[point].friction,
                rho,
                &at(lambda, point),
                &at(&motion, point),
            );
            match slip {
                Some(slip) => slip.fill(&mut jacobian, &mut right, &w, k),
                None => continue,
            }
        }
        let change = solved(jacobian, right);
        for r in 0..rows {
            next[row_of(r)] = kept[row_of(r)] + change[r];
        }
        next.iter().all(|x| x.is_finite()).then_some(next)
    }
}

/// The solution of a square system, by elimination with row exchanges on one thread: the same bits however
/// many there are. Numbers that are not finite where it has none.
fn solved(mut matrix: DMatrix<f64>, right: DVector<f64>) -> Vec<f64> {
    let n = right.len();
    let mut solution: Vec<f64> = right.data.into();
    let (mut rows, mut places) = (vec![0usize; n], vec![0usize; n]);
    let need = lu_in_place_scratch::<usize, f64>(n, n, Par::Seq, Spec::default())
        .or(solve_in_place_scratch::<usize, f64>(n, 1, Par::Seq));
    let mut memory = MemBuffer::new(need);
    let stack = MemStack::new(&mut memory);
    let mut lu = MatMut::from_column_major_slice_mut(matrix.as_mut_slice(), n, n);
    let (_, order) =
        lu_in_place(lu.rb_mut(), &mut rows, &mut places, Par::Seq, stack, Spec::default());
    let column = MatMut::from_column_major_slice_mut(&mut solution, n, 1);
    solve_in_place(lu.rb(), lu.rb(), order, column, Par::Seq, stack);
    solution
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

    /// Rows `δ_t − μ d δ_n − r/‖a‖ (I − d dᵀ) (δ_t − ρ W_t δ) = μ λ_n d − λ_t`.
    fn fill(
        &self,
        jacobian: &mut DMatrix<f64>,
        right: &mut DVector<f64>,
        w: &DMatrix<f64>,
        k: usize,
    ) {
        let d = self.direction;
        let turned = (Matrix2::identity() - d * d.transpose()) * self.share;
        for c in 0..jacobian.ncols() {
            let tangential = Vector2::new(w[(3 * k + 1, c)], w[(3 * k + 2, c)]);
            let row = self.rho * (turned * tangential);
            jacobian[(3 * k + 1, c)] = row.x;
            jacobian[(3 * k + 2, c)] = row.y;
        }
        let missing = self.friction * self.force.x.max(0.0) * d - self.force.yz();
        for axis in 0..2 {
            let row = 3 * k + 1 + axis;
            jacobian[(row, row)] += 1.0;
            for other in 0..2 {
                jacobian[(row, 3 * k + 1 + other)] -= turned[(axis, other)];
            }
            jacobian[(row, 3 * k)] -= self.friction * d[axis];
            right[row] = missing[axis];
        }
    }
}
