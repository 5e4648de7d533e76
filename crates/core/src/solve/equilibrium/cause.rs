//! Why no equilibrium was found: what the last shape and the tangent there say.

use super::goal::Goal;
use super::inverse::FactorError;
use super::outcome::NoEquilibrium;
use super::shape::Shape;

/// Why a descent did not get to where it should.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Lost {
    /// Elements at what is moved would turn inside out, however small the step.
    Flattened { share: f64 },
    /// The descent found no minimum of the energy.
    NoMinimum { share: f64, residual_rel: f64 },
    /// Neither the tangent nor its positive part has a factor.
    Singular,
    /// What was allowed to be spent is.
    Spent { share: f64, residual_rel: f64 },
    /// No memory for a factor.
    OutOfMemory { bytes: usize },
}

impl Lost {
    /// With the share of the motion that was done before.
    pub fn after(self, done: f64) -> Self {
        match self {
            Self::Flattened { .. } => Self::Flattened { share: done },
            Self::NoMinimum { residual_rel, .. } => Self::NoMinimum { share: done, residual_rel },
            Self::Spent { residual_rel, .. } => Self::Spent { share: done, residual_rel },
            other => other,
        }
    }

    /// With the residual that was left.
    pub fn with(self, residual_rel: f64) -> Self {
        match self {
            Self::Spent { share, .. } => Self::Spent { share, residual_rel },
            other => other,
        }
    }
}

/// Poisson's ratio from which on volume that cannot change is what stops a motion.
const POISSON_INCOMPRESSIBLE: f64 = 0.48;
/// Compression of an element beyond which surfaces crease.
const CREASE_STRETCH: f64 = 0.6;
/// Stretch beyond which forces pull a body apart rather than press it.
const DRAWN_STRETCH: f64 = 3.0;

/// The cause, from the last shape that was in balance.
pub(super) fn of(shape: &Shape, goal: &Goal<'_>, lost: Lost) -> NoEquilibrium {
    let (share, residual_rel) = match lost {
        Lost::OutOfMemory { bytes } => return FactorError::OutOfMemory { bytes }.into(),
        Lost::Singular => return NoEquilibrium::Singular,
        Lost::Flattened { share } => (share, None),
        Lost::NoMinimum { share, residual_rel } | Lost::Spent { share, residual_rel } => {
            (share, Some(residual_rel))
        }
    };
    let summary = shape.elements.summary(&shape.q);
    let is_loaded = goal.forces.iter().any(|f| *f != 0.0);
    let poisson = shape.elements.poisson_max();
    if is_loaded && summary.stretch_max > DRAWN_STRETCH && residual_rel.is_some() {
        return NoEquilibrium::Overloaded { share, stretch: summary.stretch_max };
    }
    if poisson >= POISSON_INCOMPRESSIBLE {
        return NoEquilibrium::Incompressible { share, poisson };
    }
    // Drawn out bodies grow thin as well, but less than they grow long.
    let is_pressed = summary.stretch_max < 1.0 / summary.stretch_min;
    if summary.stretch_min < CREASE_STRETCH && is_pressed {
        return NoEquilibrium::Creased { share, stretch: summary.stretch_min };
    }
    match residual_rel {
        Some(residual_rel) => NoEquilibrium::BranchEnded { share, residual_rel },
        None => NoEquilibrium::InsideOut { share },
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::fem::hyperelastic::Law;
    use crate::fem::{Element, Material};
    use crate::mesh::{BuiltIn, generate};
    use crate::model::Model;

    /// The cause that a cube is told which was stretched so far, along z and along x and y.
    fn told(poisson: f64, stretches: [f64; 2], force: f64, lost: Lost) -> NoEquilibrium {
        let mesh = generate(BuiltIn::Cube, 27).unwrap();
        let material = Material::try_new(2.0e4, poisson).unwrap();
        let model = Model::try_new(mesh, Element::Tet4, &[material], vec![], &mut |_| {}).unwrap();
        let [along, across] = stretches.map(|stretch| stretch - 1.0);
        let places = model.mesh().vertices().iter();
        let q = places.flat_map(|p| [across * p.x, across * p.y, along * p.z]).collect();
        let held: Vec<u32> = (0..12).collect();
        let hold = model.hold(&held, vec![], None).unwrap();
        let elements = Arc::new(model.hyperelastic(Law::NeoHookean).unwrap());
        let shape = Shape::new(elements, model.stiffness(), Arc::new(hold), q, false);
        let forces = vec![force; 3 * model.system_node_count()];
        of(&shape, &Goal { q_known: &[0.0; 12], mask_q: &[], forces: &forces }, lost)
    }

    #[test]
    fn each_cause_has_a_sentence_of_its_own() {
        let spent = Lost::Spent { share: 0.5, residual_rel: 0.1 };
        let flat = Lost::Flattened { share: 0.5 };
        let pulled = [4.0, 0.5];
        for (poisson, stretches, force, lost, sentence) in [
            (0.3, [0.9, 1.0], 0.0, spent, "the branch of equilibria ends"),
            (0.3, pulled, 0.0, spent, "the branch of equilibria ends"),
            (0.3, pulled, 1.0, spent, "the forces draw the body to 4.0 times"),
            (0.3, [0.9, 1.0], 0.0, flat, "an element would turn inside out"),
            (0.3, [0.5, 1.0], 0.0, flat, "surfaces crease from about 60 % on"),
            (0.49, [0.5, 1.0], 0.0, flat, "a Poisson's ratio of 0.49 hardly allows"),
            (0.3, [1.0, 1.0], 0.0, Lost::Singular, "the tangent stiffness is singular"),
            (0.3, [1.0, 1.0], 0.0, Lost::OutOfMemory { bytes: 1 << 40 }, "memory"),
        ] {
            let said = told(poisson, stretches, force, lost).to_string();
            assert!(said.contains(sentence), "{poisson} {stretches:?} {force} {lost:?}: {said}");
        }
    }
}
