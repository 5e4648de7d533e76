//! The contact frames of one session: what is kept from step to step, and where a step is worked on.

use std::sync::Arc;

use softgrasp_protocol::{ContactAnswer, ContactFrame, ModelHash};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use crate::answer::{CarriedSeat, PosedContact, PressedSeat};
use crate::clock::StageClock;
use crate::refusal::Refusal;
use crate::resources::Resources;
use crate::workers::{Asker, EndedAbnormally, Turn};

/// A step that takes longer is not worked on among frames, where others would wait for it: it is begun anew in a
/// lane, and the next one of the session goes there at once.
///
/// Units: ms.
const FRAME_MS_MAX: f64 = 50.0;
/// A step that takes so many times its cost in a lane is begun anew as one of that cost, …
const TIMES_COST: f64 = 5.0;
/// … up to those that go to the lane of the longest work.
///
/// Units: ms.
const LONG_MS: f64 = 5000.0;

/// What a session keeps from one contact frame to the next.
pub(crate) struct ContactSteps {
    /// The object that this session presses at large deformation.
    pressed: PressedSeat,
    /// What a step of each object of this session leaves for the next.
    carried: CarriedSeat,
    /// One permit, of the step that is worked on: one that was cancelled puts back what it took before the next
    /// one looks for it, which waits without a thread.
    working: Arc<Semaphore>,
    /// Time that the newest step took, ms; `None` before the first.
    newest_ms: Option<f64>,
}

impl Default for ContactSteps {
    /// Nothing, before the first contact frame.
    fn default() -> Self {
        Self {
            pressed: PressedSeat::default(),
            carried: CarriedSeat::default(),
            working: Arc::new(Semaphore::new(1)),
            newest_ms: None,
        }
    }
}

impl ContactSteps {
    /// Forgets what was kept of a model, and the object at large deformation.
    pub fn forget(&mut self, model: ModelHash) {
        self.pressed.with(|pressed| *pressed = None);
        self.carried.with(|carried| carried.retain(|(of, _)| *of != model));
    }

    /// Answers a contact frame: among frames if its columns are cached and it is short, else in the lane of
    /// its predicted cost.
    ///
    /// # Errors
    /// [`Refusal`].
    pub async fn answer(
        &mut self,
        resources: &Arc<Resources>,
        asker: Asker,
        frame: ContactFrame,
        clock: impl FnOnce() -> StageClock + Send + 'static,
    ) -> Result<ContactAnswer, Refusal> {
        // Never closed: then as if nothing else were worked on.
        let alone = Arc::clone(&self.working).acquire_owned().await.ok();
        let workers = &resources.workers;
        let shared = Arc::clone(resources);
        let seats = (Arc::clone(&self.pressed), Arc::clone(&self.carried));
        let newest_ms = self.newest_ms;
        let is_short = newest_ms.is_none_or(|ms| ms <= FRAME_MS_MAX);
        let among_frames = move || {
            let frame = match PosedContact::new(&shared, frame, seats) {
                Err(refusal) => return Ok(Err(refusal)),
                Ok(frame) => frame,
            };
            let clock = clock();
            if !(is_short && frame.is_prepared()) {
                return Err((Box::new(frame), Box::new(clock), alone));
            }
            let answered = frame.answer_within(&shared, clock.clone(), FRAME_MS_MAX);
            answered.map_err(|frame| (frame, Box::new(clock), alone))
        };
        let answered = match workers.run_frame(among_frames).await? {
            Ok(answered) => answered,
            Err((frame, clock, alone)) => {
                let expected_ms = newest_ms.unwrap_or(0.0).max(FRAME_MS_MAX);
                in_lanes(resources, (asker, expected_ms), frame, (clock, alone)).await?
            }
        };
        if let Ok(answer) = &answered {
            self.newest_ms = Some(answer.answer.report.stage_ms.solve);
        }
        answered
    }
}

/// Answers a contact frame in the lane of its predicted cost; where that was too low, in one of longer work.
///
/// Units: ms.
async fn in_lanes(
    resources: &Arc<Resources>,
    (asker, expected_ms): (Asker, f64),
    mut frame: Box<PosedContact>,
    (clock, mut alone): (Box<StageClock>, Option<OwnedSemaphorePermit>),
) -> Result<Result<ContactAnswer, Refusal>, EndedAbnormally> {
    let mut cost_ms = frame.predicted_ms(resources) + expected_ms;
    loop {
        let (shared, clock) = (Arc::clone(resources), (*clock).clone());
        let slice_ms = if cost_ms > LONG_MS { f64::INFINITY } else { TIMES_COST * cost_ms };
        let work = move || {
            let answered = frame.answer_within(&shared, clock, slice_ms);
            answered.map_err(|frame| (frame, alone))
        };
        match resources.workers.run(Turn { asker, cost_ms }, work).await? {
            Ok(answered) => return Ok(answered),
            Err((again, still_alone)) => (frame, alone) = (again, still_alone),
        }
        // Above the limit of a lane, not at it.
        cost_ms = 1.01 * slice_ms;
    }
}
