//! A hand that mouse and keyboard drive, and that knows by itself where an object is grasped well.

use std::collections::VecDeque;
use std::sync::Arc;

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};
use softgrasp_grasp::grasp::StateName;
use softgrasp_grasp::object::{ContactModel, SoftObject};

use super::glide::{Glide, Station};
use super::grip::Grip;
use super::input::{Digits, MouseInput};
use super::speed::limited;
use crate::hand_setup::HandSetup;
use crate::notice::Notice;
use crate::scripted::{GraspPlan, PalmPath, PlanRequest, Planner, Posture, Seen, angles};
use crate::sent::Sent;

/// The mouse hand.
///
/// It begins with an errand: to aim at the object.
pub struct MouseHand {
    setup: HandSetup,
    contact: ContactModel,
    planner: Planner,
    tick_s: f64,
    plan: Option<Planned>,
    /// Number of the rest shape for which a plan is being made, and the turn of the object.
    planning_for: Option<(u64, UnitQuaternion<f64>)>,
    errand: Option<Errand>,
    /// Ways still to go, the first one begun.
    ways: VecDeque<Glide>,
    world_from_palm: Isometry3<f64>,
    /// Pose of the palm in the world to which the mouse moves it.
    wished: Isometry3<f64>,
    /// Speed of the palm on its way there, m/s.
    speed: f64,
    posture: Posture,
    grip: Grip,
    notices: Vec<Notice>,
}

/// A plan, the rest shape it was made for and how that was turned then.
///
/// Frame: that of the object turned so, as if it were the world's; for fingertips that hold it the turn
/// is none, and the plan turns with the object.
#[derive(Clone, Copy)]
struct Planned {
    plan: GraspPlan,
    rest_shape: u64,
    turn: UnitQuaternion<f64>,
}

/// Motion that the hand makes by itself.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Errand {
    Aim { elsewhere: bool },
    Reach,
    Retreat,
}

/// How far off the hand stays while it aims, and while it goes around the object, m.
const AIM_OFF: f64 = 0.10;
const AROUND_OFF: f64 = 0.22;
/// A hand that has to turn further than this, rad, goes around the object.
const TURNS: f64 = 0.2;
/// An object that has rolled by more than this, rad, is grasped by another plan.
const ROLLED: f64 = 0.1;
/// A hand that is further than this from where it aims, sideways, m, aims before it reaches.
const ASIDE: f64 = 0.04;
/// The palm stays within this distance of the world's origin, m: the tracker stands at 0.6 m.
const REACH_MAX: f64 = 0.45;
/// The person sees no more than so much of what the hand did at once, s: after a stop of the ticks
/// it goes on from where it was.
const STEP_MAX_S: f64 = 1.0 / 30.0;
/// Centre of the object in the palm frame for a hand without a plan, m.
const BEFORE_THE_PALM: Vector3<f64> = Vector3::new(0.0, 0.10, -0.05);

impl MouseHand {
    /// A hand that is on its way to the object. It plans by `planner`; ticks follow each other after
    /// `tick_s`.
    ///
    /// Units: s.
    pub fn new(setup: HandSetup, planner: Planner, tick_s: f64) -> Self {
        let start =
            PalmPath { world_from_palm_rotation: palm_down(), object_in_palm: BEFORE_THE_PALM };
        let world_from_palm = start.backed_off(AROUND_OFF).world_from_palm(Point3::origin());
        Self {
            setup,
            contact: ContactModel::default(),
            planner,
            tick_s,
            plan: None,
            planning_for: None,
            errand: Some(Errand::Aim { elsewhere: false }),
            ways: VecDeque::new(),
            world_from_palm,
            wished: world_from_palm,
            speed: 0.0,
            posture: Posture::OPEN,
            grip: Grip::default(),
            notices: Vec::new(),
        }
    }

    /// Sets what a fingertip holds, for the plans of the approaches.
    #[must_use]
    pub fn holding(self, contact: ContactModel) -> Self {
        Self { contact, ..self }
    }

    /// Lets the hand begin where another hand was.
    ///
    /// Frame: world.
    #[must_use]
    pub fn taking_over_at(self, world_from_palm: Isometry3<f64>) -> Self {
        Self { world_from_palm, wished: world_from_palm, ..self }
    }

    /// Takes a wish of the person. Moving or turning ends what the hand does by itself.
    pub fn take(&mut self, input: MouseInput) {
        if !input.is_finite() {
            return;
        }
        match input {
            MouseInput::Move(by) => {
                self.stop();
                let moved = (self.wished.translation.vector + by).cap_magnitude(REACH_MAX);
                self.wished.translation = Translation3::from(moved);
            }
            MouseInput::Turn(by) => {
                self.stop();
                let pivot = self.wished * Point3::from(self.grasp_centre_in_palm());
                let about = Translation3::from(pivot.coords);
                self.wished = about * by * about.inverse() * self.wished;
                self.wished.rotation.renormalize();
            }
            // An errand that waits for the open hand keeps it open.
            MouseInput::CloseBy(..) | MouseInput::CloseTo(..) if self.errand.is_some() => {}
            MouseInput::CloseBy(digits, by) => self.grip.close_by(digits, by),
            MouseInput::CloseTo(digits, to) => self.grip.close_to(digits, to),
            MouseInput::Aim => self.begin(Errand::Aim { elsewhere: false }),
            MouseInput::AimElsewhere => self.begin(Errand::Aim { elsewhere: true }),
            MouseInput::Reach => self.begin(Errand::Reach),
            MouseInput::Retreat => self.begin(Errand::Retreat),
        }
    }

    /// The object has been replaced: plans are void, and the hand aims anew.
    pub fn meet_new_object(&mut self) {
        self.forget_plan();
        self.begin(Errand::Aim { elsewhere: false });
    }

    /// The hand goes to another object of several: plans are void.
    pub fn turn_to_another_object(&mut self) {
        self.forget_plan();
    }

    /// Point before the palm, where an object would lie that is to be grasped, m, in the world frame.
    pub fn looks_at(&self) -> Point3<f64> {
        self.world_from_palm * Point3::from(BEFORE_THE_PALM)
    }

    /// Moves on by the time of so many ticks and returns what the devices send then.
    pub fn next_after(&mut self, ticks: u64, seen: &Seen, object: &SoftObject) -> Sent {
        let seconds = (ticks as f64 * self.tick_s).min(STEP_MAX_S);
        self.go_on(seen, object);
        match self.ways.front_mut() {
            Some(way) => {
                let arrived = way.advance(seconds);
                (self.world_from_palm, self.posture) = (way.world_from_palm(), way.posture());
                (self.wished, self.speed) = (self.world_from_palm, 0.0);
                if arrived {
                    self.ways.pop_front();
                }
            }
            None => {
                let (from, to) = (&self.world_from_palm, &self.wished);
                self.world_from_palm = limited(from, to, &mut self.speed, seconds);
            }
        }
        self.grip.advance(seconds, self.plan.as_ref().map(|planned| &planned.plan));
        let joint_angles = angles(self.grip.closure(), self.posture);
        let arrivals = self.setup.arrivals_of(&joint_angles, &self.world_from_palm);
        Sent { arrivals, ..Sent::default() }
    }

    /// Closing of each finger that is wished for, thumb first, for the slider of the window.
    pub fn closing(&self) -> [f64; 5] {
        self.grip.wished()
    }

    /// Plan of the hand to grasp the object, once it has one. Frame: that of the object, as if it were
    /// the world's.
    pub fn plan(&self) -> Option<GraspPlan> {
        self.plan.as_ref().map(|planned| planned.plan)
    }

    /// Whether a plan is being made.
    pub fn is_planning(&self) -> bool {
        self.planning_for.is_some()
    }

    /// Whether the hand does something by itself, planning included.
    pub fn is_on_its_way(&self) -> bool {
        self.errand.is_some() || !self.ways.is_empty()
    }

    /// The hand's notices to the person since the last call.
    pub fn take_notices(&mut self) -> Vec<Notice> {
        std::mem::take(&mut self.notices)
    }

    fn begin(&mut self, errand: Errand) {
        self.stop();
        self.grip.close_to(Digits::All, 0.0);
        self.errand = Some(errand);
    }

    fn stop(&mut self) {
        if self.is_on_its_way() {
            self.errand = None;
            self.ways.clear();
            self.wished = self.world_from_palm;
        }
    }

    fn forget_plan(&mut self) {
        self.planner.abandon();
        (self.plan, self.planning_for) = (None, None);
    }

    fn grasp_centre_in_palm(&self) -> Vector3<f64> {
        self.plan.map_or(BEFORE_THE_PALM, |planned| planned.plan.path.object_in_palm)
    }

    /// Begins an errand as soon as the hand is open, has let go, and knows where to go.
    fn go_on(&mut self, seen: &Seen, object: &SoftObject) {
        let Some(errand) = self.errand else { return };
        let holds = matches!(seen.state, Some(StateName::Attached | StateName::Deforming));
        if !self.grip.is_open() || holds || seen.keeping || !self.plans(errand, seen, object) {
            return;
        }
        self.errand = None;
        let Some(planned) = self.plan else {
            return self.notices.push(Notice::refused(match self.contact {
                ContactModel::Friction => {
                    "the hand found no place from which thumb and fingers can pinch this object; \
                     move and turn it yourself"
                }
                ContactModel::Vertex | ContactModel::Patch | ContactModel::Mask => {
                    "the hand found no place from which all five fingertips reach this object; \
                     move and turn it yourself"
                }
            }));
        };
        let centre = seen.world_from_object * object.rest_shape().centre();
        let turned_since = seen.world_from_object.rotation * planned.turn.inverse();
        self.ways = self.ways_to(errand, &planned.plan, turned_since, centre);
    }

    /// Whether there is a plan for the errand, or it is known that there is none.
    fn plans(&mut self, errand: Errand, seen: &Seen, object: &SoftObject) -> bool {
        let rest_shape = object.rest_shapes();
        if self.planning_for.is_some_and(|(planned_for, _)| planned_for != rest_shape) {
            self.planner.abandon();
            self.planning_for = None;
        }
        // An object that rolls on a table is grasped another way when it lies otherwise.
        let turn = match self.contact {
            ContactModel::Friction => seen.world_from_object.rotation,
            _ => UnitQuaternion::identity(),
        };
        let lies_so = |planned: &Planned| {
            self.contact != ContactModel::Friction || planned.turn.angle_to(&turn) < ROLLED
        };
        let known = self.plan.filter(|p| p.rest_shape == rest_shape && lies_so(p));
        let elsewhere = errand == Errand::Aim { elsewhere: true };
        if self.planning_for.is_none() {
            if known.is_some() && !elsewhere {
                return true;
            }
            // Frame: the object's; the side last grasped from is another side of a new shape too.
            let last = self.plan.filter(|_| elsewhere).map(|planned| planned.plan.path.gaze());
            self.planner.ask(PlanRequest {
                object: Arc::clone(object.rest_shape()),
                setup: self.setup.clone(),
                contact: self.contact,
                avoid_gaze: last,
                turn,
                has_slipped: false,
            });
            self.planning_for = Some((rest_shape, turn));
        }
        let Some(made) = self.planner.take() else { return false };
        let turn = self.planning_for.take().map_or(turn, |(_, turn)| turn);
        self.plan = made.map(|plan| Planned { plan, rest_shape, turn });
        // The plan is there: what is left is to go.
        self.errand = Some(if elsewhere { Errand::Aim { elsewhere: false } } else { errand });
        true
    }

    /// The ways of an errand from where the palm is.
    fn ways_to(
        &self,
        errand: Errand,
        plan: &GraspPlan,
        turned_since: UnitQuaternion<f64>,
        centre: Point3<f64>,
    ) -> VecDeque<Glide> {
        let here = self.path_from_here(centre);
        let grasp = PalmPath {
            world_from_palm_rotation: turned_since * plan.path.world_from_palm_rotation,
            object_in_palm: plan.path.object_in_palm,
        };
        let turns = here.world_from_palm_rotation.angle_to(&grasp.world_from_palm_rotation) > TURNS;
        let aside = (here.object_in_palm - grasp.object_in_palm).xy().norm() > ASIDE;
        // From the side of the object's far end the hand first goes back until it can turn.
        let back = |path: &PalmPath, off: f64| {
            let mut path = *path;
            path.object_in_palm.z = path.object_in_palm.z.min(grasp.object_in_palm.z - off);
            path
        };
        let mut paths = Vec::new();
        if turns {
            paths.extend([back(&here, AROUND_OFF), grasp.backed_off(AROUND_OFF)]);
        } else if aside {
            paths.push(back(&here, AIM_OFF));
        }
        match errand {
            Errand::Aim { .. } => paths.push(grasp.backed_off(AIM_OFF)),
            Errand::Reach if turns || aside => paths.extend([grasp.backed_off(AIM_OFF), grasp]),
            Errand::Reach => paths.push(grasp),
            Errand::Retreat => paths = vec![back(&here, AROUND_OFF)],
        }
        let set = if errand == Errand::Retreat { Posture::OPEN } else { plan.posture };
        let mut at = Station { path: here, posture: self.posture };
        let ways = paths.into_iter().map(|path| {
            let from = std::mem::replace(&mut at, Station { path, posture: set });
            Glide::new(from, at, centre)
        });
        ways.collect()
    }

    /// Path of the palm that begins at its pose now: how it sees the object.
    fn path_from_here(&self, centre: Point3<f64>) -> PalmPath {
        PalmPath {
            world_from_palm_rotation: self.world_from_palm.rotation,
            object_in_palm: (self.world_from_palm.inverse() * centre).coords,
        }
    }
}

/// Rotation of a palm that faces down with its fingers away from the viewer (`docs/frames.md`).
fn palm_down() -> UnitQuaternion<f64> {
    let world_from_palm = Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(world_from_palm))
}
