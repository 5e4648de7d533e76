//! Splitting of a contact problem: forces obey their cones one by one, and the compliance all together,
//! in turn, until both agree.
//!
//! Slow to the last digits, but it finds which points stick, slip and open where Newton's method goes in
//! circles: points that say nearly the same leave the compliance without an inverse, and none is needed
//! here.

use faer::linalg::matmul::matmul;
use faer::linalg::solvers::{DenseSolveCore, Llt};
use faer::{Accum, Mat, MatMut, MatRef, Par, Side};

use super::cone::PointForce;
use super::problem::{ContactProblem, at};

/// A state of the alternating direction method of multipliers on a contact problem.
///
/// Source: Boyd et al. (2011), section 3; for Coulomb's law with De Saxcé's correction: Carpentier,
/// Montaut and Le Lidec (2024).
pub(super) struct Splitting<'a> {
    problem: &'a ContactProblem,
    /// Forces less what their motions push them by; the forces are their projections. 3n, N.
    pushed: Vec<f64>,
    /// Compliance added at each point, m/N: it turns motions into forces.
    added: Vec<f64>,
    /// Inverse of `W` with the added compliance, 3n × 3n, N/m.
    inverse: Mat<f64>,
}

/// Over-relaxation: so far is gone towards agreement, and beyond.
const RELAXATION: f64 = 1.6;

impl<'a> Splitting<'a> {
    /// Begins at some forces, with a share of every point's own compliance added to it: a large share
    /// goes far, a small one is exact in soft directions. `None` where `W` is that of no body.
    ///
    /// Shapes: `lambda` 3n, N.
    pub fn new(problem: &'a ContactProblem, lambda: &[f64], share: f64) -> Option<Self> {
        let (added, inverse) = added_and_inverse(problem, share)?;
        let mut splitting = Self { problem, pushed: Vec::new(), added, inverse };
        splitting.begin_at(lambda);
        Some(splitting)
    }

    /// Begins anew at some forces, 3n, N.
    pub fn begin_at(&mut self, lambda: &[f64]) {
        let motion = self.problem.motion(lambda);
        let pushed = self.added.iter().enumerate().flat_map(|(point, added)| {
            let mut motion = at(&motion, point);
            motion.x += self.correction(point, &motion);
            <[f64; 3]>::from(at(lambda, point) - motion / *added)
        });
        self.pushed = pushed.collect();
    }

    /// Goes on with another share of every point's own compliance; as it is where that has no inverse.
    pub fn change_share(&mut self, share: f64) {
        let Some((added, inverse)) = added_and_inverse(self.problem, share) else { return };
        let inside = self.problem.projected(&self.pushed);
        for (k, (pushed, inside)) in self.pushed.iter_mut().zip(&inside).enumerate() {
            *pushed = inside + (*pushed - inside) * self.added[k / 3] / added[k / 3];
        }
        (self.added, self.inverse) = (added, inverse);
    }

    /// Goes on for some sweeps; the forces then, each in its cone, 3n, N.
    pub fn advance(&mut self, sweeps: usize) -> Vec<f64> {
        let rows = self.pushed.len();
        let (mut right, mut agreed) = (vec![0.0; rows], vec![0.0; rows]);
        for _ in 0..sweeps {
            let inside = self.problem.projected(&self.pushed);
            for (point, &added) in self.added.iter().enumerate() {
                let force = at(&inside, point);
                // What a force was pushed by is the motion, corrected already.
                let motion = added * (force - at(&self.pushed, point));
                let mut free = at(&self.problem.b, point);
                free.x += self.correction(point, &motion);
                let wanted = added * force + motion - free;
                right[3 * point..3 * point + 3].copy_from_slice(wanted.as_slice());
            }
            matmul(
                MatMut::from_column_major_slice_mut(&mut agreed, rows, 1),
                Accum::Replace,
                self.inverse.as_ref(),
                MatRef::from_column_major_slice(&right, rows, 1),
                1.0,
                Par::Seq,
            );
            for ((pushed, agreed), inside) in self.pushed.iter_mut().zip(&agreed).zip(&inside) {
                *pushed += RELAXATION * (agreed - inside);
            }
        }
        self.problem.projected(&self.pushed)
    }

    /// De Saxcé's correction of a gap, m: with it a slip is complementary to the force that opposes it.
    fn correction(&self, point: usize, motion: &PointForce) -> f64 {
        self.problem.cones[point].friction * motion.yz().norm()
    }
}

fn added_and_inverse(problem: &ContactProblem, share: f64) -> Option<(Vec<f64>, Mat<f64>)> {
    let added: Vec<f64> = problem.rho.iter().map(|rho| share / rho).collect();
    let (rows, w) = (problem.w.nrows(), &problem.w);
    let entry = |r, c| w[(r, c)] + if r == c { added[r / 3] } else { 0.0 };
    let inverse = Llt::new(Mat::from_fn(rows, rows, entry).as_ref(), Side::Lower).ok()?.inverse();
    Some((added, inverse))
}
