//! The contact frames of one session: what is kept from step to step, and where a step is worked on.

use std::sync::Arc;

use softgrasp_protocol::{ContactAnswer, ContactFrame, ModelHash};
use tokio::sync::Mutex;

use crate::answer::{CarriedSeat, PosedContact, PressedSeat};
use crate::clock::StageClock;
use crate::refusal::Refusal;
use crate::resources::Resources;
use crate::workers::{Asker, Turn};

/// A step that took longer is not worked on among frames the next time: others would wait for it.
///
/// Units: ms.
const FRAME_MS_MAX: f64 = 50.0;

/// What a session keeps from one contact frame to the next.
#[derive(Default)]
pub(crate) struct ContactSteps {
    /// The object that this session presses at large deformation.
    pressed: PressedSeat,
    /// What a step of each object of this session leaves for the next.
    carried: CarriedSeat,
    /// Held by the step that is worked on: one that was cancelled puts back what it took before the next one
    /// looks for it.
    working: Arc<Mutex<()>>,
    /// Time that the newest step took, ms; `None` before the first.
    newest_ms: Option<f64>,
}

impl ContactSteps {
    /// Forgets what was kept of a model, and the object at large deformation.
    pub fn forget(&mut self, model: ModelHash) {
        self.pressed.with(|pressed| *pressed = None);
        self.carried.with(|carried| carried.retain(|(of, _)| *of != model));
    }

    /// Answers a contact frame: among frames if its columns are cached and it is expected to be short, else
    /// in the lane of its predicted cost.
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
        let alone = Arc::clone(&self.working).lock_owned().await;
        let workers = &resources.workers;
        let shared = Arc::clone(resources);
        let seats = (Arc::clone(&self.pressed), Arc::clone(&self.carried));
        let newest_ms = self.newest_ms;
        let is_short = move |frame: &PosedContact| match newest_ms {
            Some(ms) => ms <= FRAME_MS_MAX,
            None => !frame.may_have_many_points(),
        };
        let among_frames = move || match PosedContact::new(&shared, frame, seats) {
            Err(refusal) => Ok(Err(refusal)),
            Ok(frame) if frame.is_prepared() && is_short(&frame) => {
                Ok(frame.answer(&shared, clock()))
            }
            Ok(frame) => Err((Box::new(frame), clock, alone)),
        };
        let answered = match workers.run_frame(among_frames).await? {
            Ok(answered) => answered,
            Err((frame, clock, alone)) => {
                let cost_ms = frame.predicted_ms(resources) + newest_ms.unwrap_or(0.0);
                let shared = Arc::clone(resources);
                let work = move || {
                    let _alone = alone;
                    frame.answer(&shared, clock())
                };
                workers.run(Turn { asker, cost_ms }, work).await?
            }
        };
        if let Ok(answer) = &answered {
            self.newest_ms = Some(answer.answer.report.stage_ms.solve);
        }
        answered
    }
}
