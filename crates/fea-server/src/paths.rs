//! The equilibria at large deformation that one session follows, one path for each model.

use std::sync::Arc;

use softgrasp_core::fem::hyperelastic::Law;
use softgrasp_core::solve::equilibrium::{FactorError, Path, Renewed};
use softgrasp_protocol::ModelHash;

use crate::budget::Reservation;
use crate::lock::Lock;
use crate::refusal::Refusal;

/// Place where a session keeps the path of one model; empty before the first frame question and while one
/// is worked on.
pub(crate) type Seat = Arc<Lock<Option<Seated>>>;

/// Content of a seat between two frame questions.
pub(crate) enum Seated {
    /// A path that is ready.
    Path(Box<ModelPath>),
    /// A path that is made in the background; linear elasticity answers meanwhile.
    Coming(Coming),
}

/// Place for a path that is being made; its clones are the same place.
#[derive(Clone, Default)]
pub(crate) struct Coming(Arc<Lock<Option<MadePath>>>);

/// A path that was made, or the reason why there is none.
type MadePath = Result<Box<ModelPath>, Refusal>;

impl Coming {
    /// Puts the path, or the refusal, into the place.
    pub fn arrive(&self, made: MadePath) {
        self.0.with(|place| *place = Some(made));
    }

    /// Takes the path, if it has been made.
    pub fn take(&self) -> Option<MadePath> {
        self.0.with(Option::take)
    }

    /// Whether nobody else holds the place: the maker or the session has given it up.
    pub fn is_alone(&self) -> bool {
        Arc::strong_count(&self.0) == 1
    }
}

/// Path of the equilibria of one model, with its factor under way, between two frame questions.
pub(crate) struct ModelPath {
    pub law: Law,
    pub yield_stress: Option<f64>,
    pub path: Path,
    /// Memory reserved for the path, given back with it.
    pub reservation: Reservation,
    /// Factor that is being made in the background.
    pub under_way: Option<UnderWay>,
    /// Time that the last factor made in the background took, ms.
    pub factor_ms: Option<f64>,
    /// Time that computing rotation and stretches took last, ms.
    pub summary_ms: Option<f64>,
}

/// Factor that is being made in the background.
pub(crate) struct UnderWay {
    /// Place for the factor, with the time that it took, ms.
    pub made: Arc<Lock<Option<MadeFactor>>>,
    /// Number of frame questions since the factor was begun.
    pub frames: u32,
}

/// Factor that was made in the background, and the time that it took, ms.
pub(crate) type MadeFactor = (Result<Renewed, FactorError>, f64);

/// The paths of one session.
#[derive(Default)]
pub(crate) struct Paths {
    /// Seat of each model, in the order of last use.
    seats: Vec<(ModelHash, Seat)>,
}

/// Largest number of paths that a session follows; the one unused for longest is dropped.
const PATHS_MAX: usize = 4;

impl Paths {
    /// Seat of a model; a new one if the session has none.
    pub fn seat(&mut self, model: ModelHash) -> Seat {
        let seat = match self.seats.iter().position(|(of, _)| *of == model) {
            Some(at) => self.seats.remove(at).1,
            None => Seat::default(),
        };
        if self.seats.len() == PATHS_MAX {
            self.seats.remove(0);
        }
        self.seats.push((model, Arc::clone(&seat)));
        seat
    }

    /// Leaves the path of a model: its next frame question begins at rest.
    pub fn leave(&mut self, model: ModelHash) {
        self.seats.retain(|(of, _)| *of != model);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_path_unused_for_longest_goes_first() {
        let hash = |i: u8| ModelHash([i; 32]);
        let mut paths = Paths::default();
        let first = paths.seat(hash(1));
        for i in 2..=4 {
            paths.seat(hash(i));
        }
        assert!(Arc::ptr_eq(&first, &paths.seat(hash(1))));
        paths.seat(hash(5));
        assert!(Arc::ptr_eq(&first, &paths.seat(hash(1))), "2 was unused for longest");
        assert_eq!(paths.seats.len(), PATHS_MAX);
        paths.leave(hash(1));
        assert!(!Arc::ptr_eq(&first, &paths.seat(hash(1))));
    }
}
