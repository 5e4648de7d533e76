//! Plans the approaches of the scripted hand, beside the ticks or while a tick waits.

use std::sync::Arc;

use nalgebra::{UnitQuaternion, Vector3};
use softgrasp_grasp::object::{ContactModel, RestShape};
use softgrasp_os::Beside;

use super::grasp_plan::GraspPlan;
use super::plan::{GraspWish, plan_grasp};
use crate::hand_setup::HandSetup;

/// An approach that is to be planned.
#[derive(Clone)]
pub struct PlanRequest {
    /// The object as it stands before the hand.
    pub object: Arc<RestShape>,
    /// Set-up of the hand that is to grasp.
    pub setup: HandSetup,
    /// What a fingertip holds: how deep it may press.
    pub contact: ContactModel,
    /// Direction of an earlier grasp, to be avoided where another one is possible.
    pub avoid_gaze: Option<Vector3<f64>>,
    /// How the object has been turned since it was at home, for fingertips that press with friction: the
    /// plan is then for the turned object, and above the table that it lies on.
    pub turn: UnitQuaternion<f64>,
    /// Whether the object has slipped out of an earlier grasp: another way is looked for first.
    pub has_slipped: bool,
}

/// Why the hand has no plan to grasp the object.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NoGrasp {
    /// No palm pose that was tried lets the fingertips grasp the object.
    #[error(
        "the scripted hand found no palm pose from which all five fingertips reach this object \
         ({extent_m:.3} m long); try another --object-size"
    )]
    OutOfReach {
        /// Longest extent of the object, m.
        extent_m: f64,
    },
    /// No palm pose above the table that was tried lets the fingertips grasp the object that lies there.
    #[error(
        "the scripted hand found no palm pose above the table from which its fingertips reach this object \
         ({extent_m:.3} m long); try another --object-size, or --grasp thesis, which has no table"
    )]
    OutOfReachAboveTable {
        /// Longest extent of the object, m.
        extent_m: f64,
    },
    /// Five tips need five nodes.
    #[error("the object has {nodes} surface nodes; five fingertips need five different ones")]
    TooFewNodes {
        /// Number of nodes on the object's surface.
        nodes: usize,
    },
}

impl PlanRequest {
    /// An approach to an object at home, from wherever is best.
    pub fn new(object: Arc<RestShape>, setup: HandSetup, contact: ContactModel) -> Self {
        Self {
            object,
            setup,
            contact,
            avoid_gaze: None,
            turn: UnitQuaternion::identity(),
            has_slipped: false,
        }
    }

    /// The best plan; one that does not avoid the gaze where no other is found; `None` where the
    /// object cannot be grasped. Takes up to seconds.
    pub fn plan(&self) -> Option<GraspPlan> {
        let by_friction = self.contact == ContactModel::Friction;
        let turned = match by_friction && self.turn.angle() > TURN_MIN {
            true => Some(turned(&self.object, &self.turn)?),
            false => None,
        };
        let object = turned.as_ref().unwrap_or(&self.object);
        let wish = GraspWish {
            press_depth: press_depth(object, self.contact),
            avoid_gaze: self.avoid_gaze,
            table_y: by_friction.then(|| object.bottom()),
            holds_well: by_friction,
            pinches_first: by_friction && self.has_slipped,
        };
        let planned = plan_grasp(object, &self.setup, &wish).or_else(|| {
            self.avoid_gaze?;
            plan_grasp(object, &self.setup, &GraspWish { avoid_gaze: None, ..wish })
        });
        // The middle of the turned box is not the turned middle of the box.
        let shift = self.object.centre() - object.centre();
        let is_thick = self.rises_above_thumb(object);
        planned.map(|plan| {
            let holds_by_friction = plan.holds_by_friction && is_thick;
            GraspPlan { holds_by_friction, ..plan }.about(shift)
        })
    }

    /// Whether an object that lies on a table rises above a thumb that lies beside it: tips of fingers without
    /// nails come under nothing that is flatter.
    fn rises_above_thumb(&self, object: &RestShape) -> bool {
        let (low, high) = object.mesh().bounds();
        high.y - low.y > THICK * 2.0 * self.setup.dimensions.thumb.tip_radius
    }

    /// Plan of a grasp, or the reason why the object cannot be grasped.
    ///
    /// # Errors
    /// [`NoGrasp`].
    pub fn grip(&self) -> Result<GraspPlan, NoGrasp> {
        let extent_m = self.object.mesh().size();
        self.plan().ok_or_else(|| match (self.object.surface().nodes.len(), self.contact) {
            (nodes @ ..5, _) => NoGrasp::TooFewNodes { nodes },
            (_, ContactModel::Friction) => NoGrasp::OutOfReachAboveTable { extent_m },
            _ => NoGrasp::OutOfReach { extent_m },
        })
    }
}

/// Plans approaches one at a time.
pub struct Planner {
    way: Way,
    /// A plan was asked for and has not been taken.
    asked: bool,
    /// Plans under way that nobody wants any more.
    abandoned: usize,
}

/// Whether the planning is done in the tick or on a thread beside it.
enum Way {
    /// While the tick waits: the plan is there in the tick that asks for it.
    Waited(Option<Option<GraspPlan>>),
    /// On a thread of its own: the ticks go on.
    Beside(Beside<PlanRequest, Option<GraspPlan>>),
}

impl Planner {
    /// A planner that lets the ticks wait.
    pub const fn waited() -> Self {
        Self { way: Way::Waited(None), asked: false, abandoned: 0 }
    }

    /// A planner beside the ticks.
    ///
    /// # Errors
    /// The error of the operating system, when it starts no thread.
    pub fn beside() -> std::io::Result<Self> {
        Self::beside_by(|request: PlanRequest| request.plan())
    }

    /// A planner on a thread of its own that plans by `plan`.
    ///
    /// # Errors
    /// The error of the operating system, when it starts no thread.
    pub fn beside_by(
        plan: impl FnMut(PlanRequest) -> Option<GraspPlan> + Send + 'static,
    ) -> std::io::Result<Self> {
        let way = Way::Beside(Beside::start("planner", plan)?);
        Ok(Self { way, asked: false, abandoned: 0 })
    }

    /// Asks for a plan.
    pub fn ask(&mut self, request: PlanRequest) {
        self.asked = true;
        match &mut self.way {
            Way::Waited(planned) => *planned = Some(request.plan()),
            Way::Beside(beside) => beside.begin(request),
        }
    }

    /// Discards the plan that was asked for.
    pub fn abandon(&mut self) {
        self.abandoned += usize::from(self.asked);
        self.asked = false;
    }

    /// The plan that was asked for, once it is there; its inner `None` says that there is none.
    pub fn take(&mut self) -> Option<Option<GraspPlan>> {
        let taken = match &mut self.way {
            Way::Waited(planned) => {
                // A newer plan has replaced those that were abandoned.
                self.abandoned = 0;
                planned.take()
            }
            Way::Beside(beside) => loop {
                match beside.take() {
                    Some(_) if self.abandoned > 0 => self.abandoned -= 1,
                    Some(planned) => break Some(planned),
                    None if beside.is_busy() => break None,
                    // The thread is gone; the hand goes on as it would without another way to
                    // grasp.
                    None => break Some(None),
                }
            },
        };
        self.asked &= taken.is_none();
        taken
    }
}

/// A squeeze presses this share of the object's extent where a tip holds a part of the surface: deep
/// enough to be seen, and not so deep that a kept shape has elements that are inside out …
const PRESS_SHARE: f64 = 0.08;
/// … and this share where it holds a single node, but not more than …
const VERTEX_PRESS_SHARE: f64 = 0.05;
/// … this share of the spacing of its nodes: one node pushed past its neighbours would turn elements
/// inside out.
const VERTEX_PRESS_SPACING_SHARE: f64 = 0.45;

/// A pinch that is to lift closes by this share of the object's smallest extent beyond the first touch: part
/// of it dents the object, part of it pushes the fingers back.
const PINCH_SHARE: f64 = 0.12;

/// What friction is to hold is thicker than the tip of the thumb by this factor.
const THICK: f64 = 1.3;

/// An object that is turned by less than this is taken as it was, rad.
const TURN_MIN: f64 = 1e-3;

/// The object turned about the middle of its box.
fn turned(object: &RestShape, turn: &UnitQuaternion<f64>) -> Option<RestShape> {
    let centre = object.centre();
    let turned = object.mesh().vertices().iter().map(|vertex| centre + turn * (vertex - centre));
    let mesh = object.mesh().with_vertices(turned.collect()).ok()?;
    RestShape::try_new(mesh).ok()
}

/// How far a squeeze presses, m.
fn press_depth(object: &RestShape, contact: ContactModel) -> f64 {
    let mesh = object.mesh();
    match contact {
        ContactModel::Patch | ContactModel::Mask => PRESS_SHARE * mesh.size(),
        ContactModel::Friction => {
            let (low, high) = mesh.bounds();
            PINCH_SHARE * (high - low).min()
        }
        ContactModel::Vertex => {
            let edges = mesh.tets().iter().map(|t| {
                let (a, b) = (mesh.vertices()[t[0] as usize], mesh.vertices()[t[1] as usize]);
                (a - b).norm()
            });
            let spacing = edges.sum::<f64>() / mesh.tets().len() as f64;
            (VERTEX_PRESS_SHARE * mesh.size()).min(VERTEX_PRESS_SPACING_SHARE * spacing)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use softgrasp_core::mesh::{BuiltIn, generate};
    use softgrasp_grasp::object::SoftObject;

    #[test]
    fn abandoned_plan_is_never_taken() {
        let cube = SoftObject::try_new(generate(BuiltIn::Cube, 64).unwrap()).unwrap();
        let request = |avoid_gaze| PlanRequest {
            object: Arc::clone(cube.rest_shape()),
            setup: HandSetup::default(),
            contact: ContactModel::default(),
            avoid_gaze,
            turn: UnitQuaternion::identity(),
            has_slipped: false,
        };
        // Plans are told apart by whether there is one; a real plan is made once.
        let plan = request(None).plan();
        assert!(plan.is_some());
        let mut planner =
            Planner::beside_by(move |asked: PlanRequest| asked.avoid_gaze.and(plan)).unwrap();
        planner.ask(request(None));
        planner.abandon();
        planner.ask(request(Some(Vector3::x())));
        let taken = loop {
            if let Some(taken) = planner.take() {
                break taken;
            }
            std::thread::yield_now();
        };
        assert_eq!(taken, plan);
        planner.abandon();
        assert_eq!(planner.take(), Some(None), "nothing is under way");
    }
}
