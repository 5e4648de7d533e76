//! The equilibria at large deformation that one session follows, one path for each model.

use std::sync::Arc;

use softgrasp_core::fem::hyperelastic::Law;
use softgrasp_core::solve::equilibrium::{FactorError, Path, Renewed};
use softgrasp_protocol::ModelHash;

use crate::budget::Reservation;
use crate::lock::Lock;
use crate::refusal::Refusal;

/// Where a session keeps the path of one model; empty before the first frame and while a frame is
/// worked on.
pub(crate) type Seat = Arc<Lock<Option<Seated>>>;

/// What a session keeps of a path between two frames.
pub(crate) enum Seated {
    /// The path.
    Path(Box<ModelPath>),
    /// A path that is being made beside the frames, which linear elasticity answers meanwhile.
    Coming(Coming),
}

/// Where a path will lie that is being made; its clones are the same place.
#[derive(Clone, Default)]
pub(crate) struct Coming(Arc<Lock<Option<MadePath>>>);

/// A path that was made, or why there is none.
type MadePath = Result<Box<ModelPath>, Refusal>;

impl Coming {
    /// The path is there, or it is refused.
    pub fn arrive(&self, made: MadePath) {
        self.0.with(|place| *place = Some(made));
    }

    /// The path, once it is there.
    pub fn take(&self) -> Option<MadePath> {
        self.0.with(Option::take)
    }

    /// Whether nobody else holds the place: it is made no more, or waited for no more.
    pub fn is_alone(&self) -> bool {
        Arc::strong_count(&self.0) == 1
    }
}

/// A path with all that belongs to it between two frames.
pub(crate) struct ModelPath {
    pub law: Law,
    pub yield_stress: Option<f64>,
    pub path: Path,
    /// Memory of the path, given back with it.
    pub reservation: Reservation,
    /// A factor that is being made beside the frames.
    pub under_way: Option<UnderWay>,
    /// How long the last factor made beside the frames took, ms.
    pub factor_ms: Option<f64>,
    /// How long rotation and stretches took to work out last, ms.
    pub summary_ms: Option<f64>,
}

/// A factor that is being made beside the frames.
pub(crate) struct UnderWay {
    /// Where it will lie, with how long it took, ms.
    pub made: Arc<Lock<Option<MadeFactor>>>,
    /// Frames since it was begun.
    pub frames: u32,
}

/// A factor that was made beside the frames, and how long it took, ms.
pub(crate) type MadeFactor = (Result<Renewed, FactorError>, f64);

/// The paths of one session.
#[derive(Default)]
pub(crate) struct Paths {
    /// The one used last stands last.
    seats: Vec<(ModelHash, Seat)>,
}

/// Paths that a session may follow; the one unused for longest goes.
const PATHS_MAX: usize = 4;

impl Paths {
    /// The seat of a model, new where the session has none.
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

    /// Leaves the path of a model: the next frame begins at rest.
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
