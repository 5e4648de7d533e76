//! Why no equilibrium was found: what the last shape and the tangent there say.

use super::descent::Lost;
use super::goal::Goal;
use super::inverse::FactorError;
use super::outcome::NoEquilibrium;
use super::path::Path;

/// Poisson's ratio from which on volume that cannot change is what stops a motion.
const POISSON_INCOMPRESSIBLE: f64 = 0.48;
/// Compression of an element beyond which surfaces crease.
const CREASE_STRETCH: f64 = 0.6;
/// Stretch beyond which forces pull a body apart rather than press it.
const DRAWN_STRETCH: f64 = 3.0;

/// The cause, from a path at the last shape that was in balance.
pub(super) fn of(path: &mut Path, goal: &Goal<'_>, lost: Lost) -> NoEquilibrium {
    let (share, residual_rel) = match lost {
        Lost::OutOfMemory { bytes } => return FactorError::OutOfMemory { bytes }.into(),
        Lost::Singular => return NoEquilibrium::Singular,
        Lost::Flattened { share } => (share, None),
        Lost::NoMinimum { share, residual_rel } | Lost::Spent { share, residual_rel } => {
            (share, Some(residual_rel))
        }
    };
    let summary = path.elements.summary(&path.q);
    let is_loaded = goal.forces.iter().any(|f| *f != 0.0);
    let poisson = path.elements.poisson_max();
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
