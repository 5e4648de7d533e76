//! Splitting of a contact problem: forces obey their cones one by one, and the compliance all together,
//! in turn, until both agree.
//!
//! Slow to the last digits, but it finds which points stick, slip and open where Newton's method goes in
//! circles: points that say nearly the same leave the compliance without an inverse, and none is needed
//! here.

use nalgebra::{DMatrix, Matrix3};

use super::cone::{PointForce, at};
use super::law::PointLaw;
use super::newton::solve_in_place;
use super::problem::ContactProblem;

/// A state of the alternating direction method of multipliers on a contact problem.
///
/// Source: Boyd et al. (2011), section 3; for Coulomb's law with De Saxcé's correction: Carpentier,
/// Montaut and Le Lidec (2024).
pub(super) struct Splitting<'a> {
    problem: &'a ContactProblem,
    /// Forces less what their motions push them by; the forces are their projections. 3n, N.
    pushed: Vec<f64>,
    /// The shares that it was made with, and which of them it goes on with.
    softened: Vec<Softened>,
    at: usize,
}

/// The points as they yield with a share of their own compliance added to each.
struct Softened {
    share: f64,
    /// Compliance added at each point, m/N: it turns motions into forces.
    added: Vec<f64>,
    /// Compliance of the corners if every point yields by what is added to it, 3m × 3m, m/N.
    compliance: DMatrix<f64>,
}

/// Over-relaxation: so far is gone towards agreement, and beyond.
const RELAXATION: f64 = 1.6;

impl<'a> Splitting<'a> {
    /// Begins at some forces, with a share of every point's own compliance added to it: a large share
    /// goes far, a small one is exact in soft directions. `None` where `W` is that of no body.
    ///
    /// Shapes: forces 3n, N, and their motions 3n, m.
    pub fn new(
        problem: &'a ContactProblem,
        (lambda, motion): (&[f64], &[f64]),
        share: f64,
    ) -> Option<Self> {
        let softened = vec![Softened::new(problem, share)?];
        let mut splitting = Self { problem, pushed: Vec::new(), softened, at: 0 };
        splitting.begin_at(lambda, motion);
        Some(splitting)
    }

    /// Begins anew at some forces, 3n, N, and their motions, 3n, m.
    pub fn begin_at(&mut self, lambda: &[f64], motion: &[f64]) {
        let pushed = self.added().iter().enumerate().flat_map(|(point, added)| {
            let mut motion = at(motion, point);
            motion.x += self.correction(point, &motion);
            <[f64; 3]>::from(at(lambda, point) - motion / *added)
        });
        self.pushed = pushed.collect();
    }

    /// Goes on with another share of every point's own compliance; as it is where that has no inverse.
    pub fn change_share(&mut self, share: f64) {
        let next = match self.softened.iter().position(|softened| softened.share == share) {
            Some(next) => next,
            None => {
                let Some(softened) = Softened::new(self.problem, share) else { return };
                self.softened.push(softened);
                self.softened.len() - 1
            }
        };
        let inside = self.inside();
        let (added, next_added) = (&self.softened[self.at].added, &self.softened[next].added);
        for (k, (pushed, inside)) in self.pushed.iter_mut().zip(&inside).enumerate() {
            *pushed = inside + (*pushed - inside) * added[k / 3] / next_added[k / 3];
        }
        self.at = next;
    }

    fn added(&self) -> &[f64] {
        &self.softened[self.at].added
    }

    /// Goes on for some sweeps; the forces then, each in its cone, 3n, N.
    pub fn advance(&mut self, sweeps: usize) -> Vec<f64> {
        let mut wanted = vec![0.0; self.pushed.len()];
        for _ in 0..sweeps {
            let inside = self.inside();
            for (point, &added) in self.added().iter().enumerate() {
                let force = at(&inside, point);
                // What a force was pushed by is the motion, corrected already.
                let motion = added * (force - at(&self.pushed, point));
                let mut free = at(&self.problem.b, point);
                free.x += self.correction(point, &motion);
                let force = force + (motion - free) / added;
                wanted[3 * point..3 * point + 3].copy_from_slice(force.as_slice());
            }
            self.yield_to_compliance(&mut wanted);
            for ((pushed, agreed), inside) in self.pushed.iter_mut().zip(&wanted).zip(&inside) {
                *pushed += RELAXATION * (agreed - inside);
            }
        }
        self.inside()
    }

    /// The forces that obey their laws one by one, 3n, N.
    fn inside(&self) -> Vec<f64> {
        let points = self.problem.laws.iter().zip(self.added()).enumerate();
        let of_point = |(point, (law, &added)): (usize, (&PointLaw, &f64))| {
            <[f64; 3]>::from(law.yielding(at(&self.pushed, point), added))
        };
        points.flat_map(of_point).collect()
    }

    /// Of forces the added compliances alone would have, those that W with the added compliances has:
    /// `(W + D)⁻¹ D λ = λ − D⁻¹ Bᵀ N B λ`, N the compliance of the corners.
    fn yield_to_compliance(&self, lambda: &mut [f64]) {
        let w = &self.problem.w;
        let moved = w.moved_by(&self.softened[self.at].compliance, lambda);
        for (point, added) in self.added().iter().enumerate() {
            let less = w.motion_of(point, &moved) / *added;
            (0..3).for_each(|axis| lambda[3 * point + axis] -= less[axis]);
        }
    }

    /// De Saxcé's correction of a gap, m: with it a slip is complementary to the force that opposes it.
    fn correction(&self, point: usize, motion: &PointForce) -> f64 {
        self.problem.laws[point].friction() * motion.yz().norm()
    }
}

impl Softened {
    /// What a share adds to each point, and the compliance `(I + K B D⁻¹ Bᵀ)⁻¹ K` of the corners with it; `None`
    /// where that has no inverse.
    fn new(problem: &ContactProblem, share: f64) -> Option<Self> {
        let added: Vec<f64> = problem.rho.iter().map(|rho| share / rho).collect();
        let blocks: Vec<Matrix3<f64>> = added.iter().map(|a| Matrix3::identity() / *a).collect();
        let mut compliance = problem.w.compliance().clone();
        solve_in_place(problem.w.coupled(&blocks), compliance.as_mut_slice());
        let is_finite = compliance.iter().all(|x| x.is_finite());
        is_finite.then_some(Self { share, added, compliance })
    }
}
