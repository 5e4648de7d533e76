//! Plans the approaches of the scripted hand, beside the ticks or while a tick waits.

use std::sync::Arc;

use nalgebra::Vector3;

use super::plan::{GraspPlan, plan_grasp};
use crate::beside::Beside;
use crate::hand_reader::HandSetup;
use crate::rest_shape::RestShape;

/// An approach that is to be planned.
#[derive(Clone)]
pub struct PlanRequest {
    /// The object as it stands before the hand.
    pub object: Arc<RestShape>,
    /// The hand.
    pub setup: HandSetup,
    /// Direction of an earlier grasp, to be avoided where another one is possible.
    pub avoid_gaze: Option<Vector3<f64>>,
}

impl PlanRequest {
    /// The best plan; one that does not avoid the gaze where no other is found; `None` where the
    /// object cannot be grasped. Takes up to seconds.
    pub fn plan(&self) -> Option<GraspPlan> {
        let depth = press_depth(&self.object);
        let planned = plan_grasp(&self.object, &self.setup, depth, self.avoid_gaze);
        planned.or_else(|| {
            self.avoid_gaze?;
            plan_grasp(&self.object, &self.setup, depth, None)
        })
    }
}

/// Plans approaches one at a time.
pub enum Planner {
    /// While the tick waits: the plan is there in the tick that asks for it.
    Waited(Option<Option<GraspPlan>>),
    /// On a thread of its own: the ticks go on.
    Beside(Beside<PlanRequest, Option<GraspPlan>>),
}

impl Planner {
    /// A planner that lets the ticks wait.
    pub const fn waited() -> Self {
        Self::Waited(None)
    }

    /// A planner beside the ticks.
    ///
    /// # Errors
    /// The system's, when it gives no thread.
    pub fn beside() -> std::io::Result<Self> {
        Self::beside_by(|request: PlanRequest| request.plan())
    }

    /// The same with another way to plan.
    ///
    /// # Errors
    /// The system's, when it gives no thread.
    pub fn beside_by(
        plan: impl FnMut(PlanRequest) -> Option<GraspPlan> + Send + 'static,
    ) -> std::io::Result<Self> {
        Ok(Self::Beside(Beside::start("planner", plan)?))
    }

    /// Asks for a plan.
    pub(super) fn ask(&mut self, request: PlanRequest) {
        match self {
            Self::Waited(planned) => *planned = Some(request.plan()),
            Self::Beside(beside) => beside.begin(request),
        }
    }

    /// The plan that was asked for, once it is there; its inner `None` says that there is none.
    pub(super) fn take(&mut self) -> Option<Option<GraspPlan>> {
        match self {
            Self::Waited(planned) => planned.take(),
            Self::Beside(beside) => match beside.take() {
                Some(planned) => Some(planned),
                None if beside.is_busy() => None,
                // The thread is gone; the hand goes on as it would without another way to grasp.
                None => Some(None),
            },
        }
    }
}

/// A squeeze presses this share of the object's extent …
const PRESS_SHARE: f64 = 0.05;
/// … but not more than this share of the spacing of its nodes: one node pushed past its
/// neighbours would turn elements inside out.
const PRESS_SPACING_SHARE: f64 = 0.45;

/// How far a squeeze presses, m.
fn press_depth(object: &RestShape) -> f64 {
    let mesh = object.mesh();
    let edges = mesh.tets().iter().map(|t| {
        let (a, b) = (mesh.vertices()[t[0] as usize], mesh.vertices()[t[1] as usize]);
        (a - b).norm()
    });
    let spacing = edges.sum::<f64>() / mesh.tets().len() as f64;
    (PRESS_SHARE * mesh.size()).min(PRESS_SPACING_SHARE * spacing)
}
