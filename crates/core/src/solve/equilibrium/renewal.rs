//! A factor of the newest shape, made anywhere while the path goes on with an older one.

use std::sync::Arc;

use super::hold::Hold;
use super::inverse::{Factor, FactorError, Inverse};
use crate::fem::StiffnessPattern;
use crate::fem::hyperelastic::{Curvature, Elements};

/// A factor to be made of the shape that a path has now, anywhere.
pub struct Renewal {
    pub(super) elements: Arc<Elements>,
    pub(super) pattern: Arc<StiffnessPattern>,
    pub(super) hold: Arc<Hold>,
    pub(super) q: Vec<f64>,
    pub(super) is_single: bool,
}

/// A factor that was made for a path.
pub struct Renewed {
    pub(super) hold: Arc<Hold>,
    pub(super) inverse: Inverse,
}

/// How far from the tangent to its positive part a factor is looked for. Masks hold a body in ways
/// that a factor does not know of, so the tangent of a pressed body often has none; the less is added
/// to it, the better is its inverse.
const POSITIVE_SHARES: [f64; 4] = [0.0, 0.1, 0.35, 1.0];

impl Renewal {
    /// Makes the factor: of the tangent as it is, or of its positive part where that has none.
    ///
    /// # Errors
    /// [`FactorError`] if neither has one.
    pub fn make(self) -> Result<Renewed, FactorError> {
        let Self { elements, pattern, hold, q, is_single } = self;
        let mut refused = FactorError::NotPositive;
        let mut positive = None;
        for share in POSITIVE_SHARES {
            let mut tangent = elements.tangent(&pattern, &q, Curvature::AsItIs);
            if share > 0.0 {
                let part = || elements.tangent(&pattern, &q, Curvature::PositivePart);
                tangent.blend(positive.get_or_insert_with(part), share);
            }
            let springs = hold.add_springs(&mut tangent);
            match Factor::try_new(&hold, &tangent, is_single) {
                Ok(factor) => {
                    let inverse = Inverse::new(&hold, factor, springs);
                    return Ok(Renewed { hold, inverse });
                }
                Err(FactorError::NotPositive) => {}
                Err(error) => {
                    refused = error;
                    break;
                }
            }
        }
        Err(refused)
    }
}
