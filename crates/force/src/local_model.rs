//! The grasp between two answers: the contact problem of the small system, solved anew each millisecond.

use nalgebra::{DMatrix, DVector, Matrix3, Point3, Vector3};
use softgrasp_core::contact::coulomb::{ContactProblem, FrictionCone, Solution, SolveBudget};

use crate::coupling::Coupled;
use crate::small_system::SmallSystem;

/// Forces of a few contacts as functions of where their bodies are, with unilateral contact and
/// Coulomb's friction.
///
/// The gaps and slips of the contacts are `C (F − F_s) − (x − x_s)` in their frames, less what has
/// slipped since the answer. Where all stick the forces on the hand are `f_s + K (x_s − x)`, K = C⁻¹.
#[derive(Clone, Debug)]
pub struct LocalModel {
    system: SmallSystem,
    coupled: Coupled,
    /// Normal and two tangents of each contact as columns, world.
    frames: Vec<Matrix3<f64>>,
    cones: Vec<FrictionCone>,
    /// Compliance in the frames of the contacts, m/N.
    w: DMatrix<f64>,
    /// Way that each contact has slipped since the answer, in its frame, m; none along the normal.
    slipped: Vec<Vector3<f64>>,
    /// Forces of the last tick in the frames of the contacts, N.
    lambda: Vec<f64>,
}

/// Forces of a tick.
#[derive(Clone, Debug, PartialEq)]
pub struct LocalForces {
    /// Force of each contact on the object, N, world.
    pub forces: Vec<Vector3<f64>>,
    /// Energy that each contact stores, J: `½ F·(C F)`.
    pub stored: Vec<f64>,
    /// Residual of the law of contact, N.
    pub residual: f64,
    /// Whether the law is met within the budget.
    pub is_converged: bool,
}

/// Residual of the law that is small enough, over the largest force: Newton's last step goes there anyway.
const RESIDUAL_REL: f64 = 1e-10;
/// Attempts of Newton's method and of the splitting: a few contacts take one.
const ATTEMPTS: usize = 2;

impl LocalModel {
    /// Model of an answer, no port of which is stiffer than `stiffness_max`, N/m.
    pub fn new(system: SmallSystem, stiffness_max: f64) -> Self {
        let coupled = Coupled::new(&system, stiffness_max);
        let frames: Vec<Matrix3<f64>> =
            system.contacts().iter().map(|contact| frame_of(&contact.normal)).collect();
        let count = frames.len();
        let mut w = DMatrix::zeros(3 * count, 3 * count);
        for (i, of_row) in frames.iter().enumerate() {
            for (j, of_column) in frames.iter().enumerate() {
                let block = coupled.compliance.fixed_view::<3, 3>(3 * i, 3 * j);
                let turned = of_row.transpose() * block * of_column;
                w.fixed_view_mut::<3, 3>(3 * i, 3 * j).copy_from(&turned);
            }
        }
        let in_frame = |i: usize| frames[i].transpose() * system.contacts()[i].force;
        let lambda: Vec<f64> = (0..count).flat_map(|i| <[f64; 3]>::from(in_frame(i))).collect();
        let cone = |i: usize| {
            // The resultant of points on a round finger can lean more than any of its points may.
            let force = in_frame(i);
            let leans = if force.x > 0.0 { force.yz().norm() / force.x } else { 0.0 };
            FrictionCone { friction: system.contacts()[i].friction.max(leans) }
        };
        let cones = (0..count).map(cone).collect();
        Self { coupled, frames, cones, w, slipped: vec![Vector3::zeros(); count], lambda, system }
    }

    /// The answer that the model is about.
    pub fn system(&self) -> &SmallSystem {
        &self.system
    }

    /// Largest share of a port's stiffness that the coupling has taken.
    pub fn softened(&self) -> f64 {
        self.coupled.softened
    }

    /// Forces where the bodies are now.
    ///
    /// Shapes: `places` one for each contact, m, world.
    pub fn forces_at(&mut self, places: &[Point3<f64>]) -> LocalForces {
        let count = self.frames.len();
        if count == 0 || places.len() != count {
            return LocalForces {
                forces: vec![],
                stored: vec![],
                residual: 0.0,
                is_converged: true,
            };
        }
        let free = self.free_motion(places);
        let problem = ContactProblem::try_new(self.w.clone(), free, self.cones.clone());
        let Ok(problem) = problem else { return self.unsolved() };
        let budget = SolveBudget {
            residual_rel: RESIDUAL_REL,
            attempts_max: ATTEMPTS,
            ..SolveBudget::default()
        };
        let solution = Solution::of(&problem, &self.lambda, budget);
        self.lambda.clone_from(&solution.lambda);
        for (slipped, motion) in self.slipped.iter_mut().zip(solution.motion.chunks_exact(3)) {
            *slipped += Vector3::new(0.0, motion[1], motion[2]);
        }
        let of_contact =
            |i: usize| self.frames[i] * Vector3::from_column_slice(&self.lambda[3 * i..3 * i + 3]);
        let forces: Vec<Vector3<f64>> = (0..count).map(of_contact).collect();
        let all =
            DVector::from_iterator(3 * count, forces.iter().flat_map(|f| <[f64; 3]>::from(*f)));
        let moved = &self.coupled.compliance * &all;
        let stored = (0..count).map(|i| 0.5 * all.rows(3 * i, 3).dot(&moved.rows(3 * i, 3)));
        LocalForces {
            stored: stored.collect(),
            forces,
            residual: solution.residual,
            is_converged: solution.is_converged,
        }
    }

    /// Gaps and slips of the contacts without forces, 3m, m, in their frames.
    fn free_motion(&self, places: &[Point3<f64>]) -> Vec<f64> {
        let contacts = self.system.contacts().iter().zip(places).enumerate();
        let of_contact = |(i, (contact, place)): (usize, (&crate::SmallContact, &Point3<f64>))| {
            let pressed = self.coupled.pressed.fixed_rows::<3>(3 * i);
            let moved = self.frames[i].transpose() * (pressed + (place - contact.place));
            <[f64; 3]>::from(-moved - self.slipped[i])
        };
        contacts.flat_map(of_contact).collect()
    }

    /// What is told where the numbers make no problem: no finite force, so that the force is released.
    fn unsolved(&self) -> LocalForces {
        let count = self.frames.len();
        LocalForces {
            forces: vec![Vector3::repeat(f64::NAN); count],
            stored: vec![0.0; count],
            residual: f64::INFINITY,
            is_converged: false,
        }
    }
}

/// Normal and two tangents as columns.
fn frame_of(normal: &Vector3<f64>) -> Matrix3<f64> {
    let mut axis = Vector3::zeros();
    axis[normal.iamin()] = 1.0;
    let tangent = normal.cross(&axis).normalize();
    Matrix3::from_columns(&[*normal, tangent, normal.cross(&tangent)])
}
