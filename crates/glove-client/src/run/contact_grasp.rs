//! A grasp by contact with friction: the free object among the rigid bodies of one hand or two and above
//! a table, in steps of time.

use std::time::Instant;

use nalgebra::{Isometry3, Vector3};
use softgrasp_core::dynamics::{Candidate, MovingBody};
use softgrasp_core::rigid_body::RigidShape;
use softgrasp_force::ForceReport;
use softgrasp_grasp::grasp::StateName;
use softgrasp_grasp::hand::HAND_BODIES;
use softgrasp_grasp::object::SoftObject;
use softgrasp_grasp::sphere_tree::{SearchedSurface, triangles_near};
use softgrasp_hand::sent::WhichHand;
use softgrasp_protocol::{
    BodyLoad, BodyShape, ContactAsk, ContactFrame, ContactReport, Deformation, ModelHash,
    NodeChoice, ObjectState, PathChoice,
};

use crate::ask::contact_frame::{
    StepBody, StepObject, extent, isometry_of, pose_of, reach_of_step,
};
use crate::ask::link::ReachedStep;
use crate::ask::solve_settings::Elasticity;
use crate::run::contact_ledger::StepRecord;
pub use crate::run::contact_scene::ContactScene;
use crate::run::felt::FeltHand;
use crate::run::grasping_hand::{BodyPoses, BothHands, GraspingHand};
use crate::run::kept_grip::{KeptGrip, pressing_on};

/// State of a grasp by contact with friction.
pub struct ContactGrasp {
    scene: ContactScene,
    /// Home pose, to which the object returns.
    world_from_home: Isometry3<f64>,
    /// State of the object after the last answer.
    state: ObjectState,
    /// Both hands; the second is not there in a run of one.
    hands: [GraspingHand; 2],
    /// End of the last answered step on the client's clock, s.
    time_s: Option<f64>,
    /// Step that was asked for and not answered yet.
    asked: Option<Asked>,
    /// Force and torque of the table on the object in the last answer.
    table_load: Option<BodyLoad>,
    /// How well the last step meets the law of contact.
    report: ContactReport,
    /// Whether the server's last step is not the one that the state comes from.
    strayed: bool,
    /// Number of steps in a row in which nothing has moved.
    still_steps: u32,
    /// Number of steps in a row with motion too slow to be seen.
    slow_steps: u32,
    /// State that was reported last.
    told: Option<StateName>,
    /// Force that the first hand feels.
    felt: Option<FeltHand>,
}

/// What became of the answer to a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TakenStep {
    /// The answer is the object's state now.
    Taken,
    /// The answer is not to the step that is awaited.
    NotAsked,
    /// The step was not solved; the object keeps its position.
    Lost,
}

/// Wishes for a step beside its hand and object.
pub struct StepWish {
    /// Nodes whose displacements are wanted.
    pub nodes: NodeChoice,
    /// Equations of the elastic part, law, and yield stress.
    pub elasticity: Elasticity,
    /// Where the shape is found: at the end of the session's last step, unless that was given up.
    pub path: PathChoice,
}

struct Asked {
    tick: u64,
    at: Instant,
    /// End of the step, s.
    time_s: f64,
    /// Poses of both hands at the end of the step.
    hands: [Option<BodyPoses>; 2],
    /// Extent of the object at rest, m ([`extent`]).
    extent: f64,
}

/// Number of bodies before those of the hands: the table.
const TABLE: usize = 1;
/// Longest step, s: a run with longer ticks plays in slow motion.
const STEP_MAX_S: f64 = 1.0 / 60.0;
/// Shortest step, s; a shorter one is left to the next tick.
const STEP_MIN_S: f64 = 2e-4;
/// Distance, m, at which a hand that was inside the object counts as outside.
const CLEAR_M: f64 = 2e-3;
/// Speed below which an object is at rest, m/s and (times its extent) rad/s.
const STILL_SPEED: f64 = 1e-4;
/// Number of slow steps in a row after which it is at rest.
const STILL_STEPS: u32 = 20;
/// Speed below which motion cannot be seen, m/s.
const SLOW_SPEED: f64 = 3e-3;
/// Number of such steps in a row after which the object counts as still.
const SLOW_STEPS: u32 = 12;
/// Penetration, and motion of the object, relative to its extent, above which a step that was not solved
/// is not taken.
const LOST_DEPTH: f64 = 0.1;
const LOST_WAY: f64 = 0.5;
/// Largest number of rounds of a step in a run: a later tick asks again anyway.
pub const ROUNDS_MAX: u32 = 12;
/// Steps of Newton's method after which no further round of a step in a run is begun.
pub const NEWTON_MAX: u32 = 160;
/// Penetration that is small enough to see and feel; the report of every step tells what was reached.
const PENETRATION_REL: f64 = 1e-6;
const RESIDUAL_REL: f64 = 1e-6;
const RESIDUAL_REL_OF_LARGE: f64 = 1e-4;

impl ContactGrasp {
    /// Grasp of an object that is at rest at its home. A hand that begins inside the object must leave it
    /// first.
    pub fn new(scene: ContactScene, world_from_home: Isometry3<f64>) -> Self {
        Self {
            scene,
            world_from_home,
            state: ObjectState::at_rest(pose_of(&world_from_home)),
            hands: [GraspingHand::new(), GraspingHand::new()],
            time_s: None,
            asked: None,
            table_load: None,
            report: ContactReport::default(),
            strayed: true,
            still_steps: 0,
            slow_steps: 0,
            told: None,
            felt: None,
        }
    }

    /// Constants of object and hand.
    pub fn scene(&self) -> &ContactScene {
        &self.scene
    }

    /// Pose of the object in the world.
    pub fn world_from_object(&self) -> Isometry3<f64> {
        isometry_of(&self.state.pose)
    }

    /// Sets another home and puts the object there; a table stays as far below it as it was.
    pub fn set_home(&mut self, world_from_home: Isometry3<f64>) {
        let raised = world_from_home.translation.y - self.world_from_home.translation.y;
        self.scene.table_y = self.scene.table_y.map(|table_y| table_y + raised);
        self.world_from_home = world_from_home;
        self.return_home();
    }

    /// Sets another home on the table as it stands, and puts the object there.
    pub fn lie_at(&mut self, world_from_home: Isometry3<f64>) {
        self.world_from_home = world_from_home;
        self.return_home();
    }

    /// Puts the object, at rest and undeformed, at its home.
    pub fn return_home(&mut self) {
        self.put(self.world_from_home);
    }

    /// Puts the object, at rest and undeformed, at a pose.
    pub fn put(&mut self, world_from_object: Isometry3<f64>) {
        self.state = ObjectState::at_rest(pose_of(&world_from_object));
        self.table_load = None;
        self.hands.iter_mut().for_each(|hand| hand.press(&[]));
        self.felt.iter_mut().for_each(FeltHand::let_go);
        self.let_go();
        (self.asked, self.still_steps, self.strayed) = (None, 0, true);
    }

    /// Releases the object: each hand must leave it before it can touch it again.
    pub fn let_go(&mut self) {
        self.hands.iter_mut().for_each(|hand| hand.is_apart = true);
        self.still_steps = 0;
    }

    /// The grip of the hands in the last answer, on an object in its present shape.
    pub(crate) fn grip(&self, object: &SoftObject) -> KeptGrip {
        let loads = self.hands.iter().flat_map(GraspingHand::every_load);
        let forces = loads.map(|load| Vector3::from(load.force));
        let of_hands = self.state.contacts.iter().filter(|c| c.body as usize >= TABLE);
        let up = self.world_from_object().inverse() * -self.scene.gravity;
        KeptGrip::new((&self.scene, up), forces, of_hands, object)
    }

    /// Makes the present shape the rest shape, except for a share of its displacement that goes on pressing;
    /// the object keeps its pose.
    pub(crate) fn meet_new_shape(&mut self, share_left: f64) {
        self.state = pressing_on(&self.state, share_left);
        self.felt.iter_mut().for_each(FeltHand::let_go);
        (self.asked, self.still_steps, self.strayed) = (None, 0, true);
    }

    /// Takes another object, with a table of its own height.
    pub fn meet_new_object(&mut self, table_y: Option<f64>) {
        self.scene.table_y = table_y;
        self.return_home();
    }

    /// Contact frame of a tick: the step from the last answer to now. `None` if a step is under way, or
    /// if the object is still and no hand is near.
    ///
    /// Units: `now_s` s on the client's clock.
    pub fn step(
        &mut self,
        tick: u64,
        now_s: f64,
        hands: &BothHands,
        object: &SoftObject,
        wish: StepWish,
    ) -> Option<ContactFrame> {
        let poses = [0, 1].map(|which| hands[which].as_ref().map(GraspingHand::poses));
        if let (Some(felt), Some(_)) = (&self.felt, &poses[0]) {
            felt.hand(self.body_poses(&poses));
        }
        if self.asked.is_some() {
            return None;
        }
        let begun_s = *self.time_s.get_or_insert(now_s);
        for (hand, now) in self.hands.iter_mut().zip(&poses) {
            now.iter().for_each(|now| hand.meet(now));
        }
        let seconds = match now_s - begun_s {
            0.0 if tick == 0 => STEP_MAX_S,
            seconds if seconds < STEP_MIN_S => return None,
            seconds => seconds.min(STEP_MAX_S),
        };
        for (hand, now) in self.hands.iter_mut().zip(&poses) {
            now.iter().for_each(|now| hand.follow(now));
        }
        let bodies = self.bodies(hands);
        let ask = self.ask(seconds, &wish);
        let extent = extent(object.rest().vertices());
        let near = self.candidates(hands, &bodies, object, extent, &ask);
        let is_touchable = near.iter().any(|candidate| usize::from(candidate.body) >= TABLE);
        if self.still_steps >= STILL_STEPS && !is_touchable {
            self.end_at(now_s, poses);
            return None;
        }
        let step_object = StepObject {
            // The link names the model.
            model: ModelHash([0; 32]),
            vertices: object.rest().vertices(),
            triangles: &object.surface().triangles,
            displacement: object.displacement(),
            nodes: wish.nodes,
        };
        self.asked = Some(Asked { tick, at: Instant::now(), time_s: now_s, hands: poses, extent });
        Some(step_object.frame_among(self.state.clone(), &bodies, ask, &near))
    }

    /// Ends a step at a time, s, with the hands at these poses.
    fn end_at(&mut self, time_s: f64, hands: [Option<BodyPoses>; 2]) {
        self.time_s = Some(time_s);
        self.hands.iter_mut().zip(hands).for_each(|(hand, now)| hand.end(now));
    }

    /// Poses of all bodies of a step: the table, then those of the hands that are there.
    fn body_poses(&self, hands: &[Option<BodyPoses>; 2]) -> Vec<Isometry3<f64>> {
        let of_hands = hands.iter().flatten().flatten().copied();
        std::iter::once(self.world_from_table()).chain(of_hands).collect()
    }

    /// Lets the first hand feel the object from now on.
    pub(crate) fn feel(&mut self, felt: FeltHand) {
        self.felt = Some(felt);
    }

    /// Says whether the server that the force comes from is there.
    pub(crate) fn feel_server(&self, is_lost: bool) {
        self.felt.iter().for_each(|felt| felt.server(is_lost));
    }

    /// Ends the force and tells of it.
    pub(crate) fn end_force(&mut self) -> Option<ForceReport> {
        self.felt.take().map(FeltHand::finish)
    }

    /// Pose of the table; without one a plane far below stands for it: the places of the others stay.
    fn world_from_table(&self) -> Isometry3<f64> {
        Isometry3::translation(0.0, self.scene.table_y.unwrap_or(-1e3), 0.0)
    }

    fn ask(&self, seconds: f64, wish: &StepWish) -> ContactAsk {
        let Elasticity { deformation, law, yield_stress } = wish.elasticity;
        let is_linear = deformation == Deformation::Linear;
        ContactAsk {
            seconds,
            gravity: self.scene.gravity.into(),
            density: self.scene.density,
            viscosity: self.scene.viscosity,
            penetration_rel: PENETRATION_REL,
            residual_rel: if is_linear { RESIDUAL_REL } else { RESIDUAL_REL_OF_LARGE },
            rounds_max: ROUNDS_MAX,
            newton_max: NEWTON_MAX,
            deformation: (!is_linear).then_some(deformation),
            law,
            yield_stress,
            path: if self.strayed { PathChoice::FromRest } else { wish.path },
            small_system: self.felt.is_some(),
            deadline_ms: None,
        }
    }

    /// Bodies of a step, each with its motion since the last answer: the table, then the hands that are
    /// there.
    fn bodies(&self, hands: &BothHands) -> Vec<StepBody> {
        let friction = self.scene.friction;
        let up = Vector3::y_axis();
        let table = StepBody {
            moving: MovingBody::resting(
                RigidShape::Plane { normal: up },
                self.world_from_table(),
                friction,
            ),
            shape: BodyShape::Plane { normal: up.into_inner().into() },
        };
        let mut bodies = vec![table];
        for (hand, of_hand) in self.hands.iter().zip(hands) {
            let compliance = self.scene.finger_compliance;
            let of_hand = of_hand.iter();
            bodies.extend(of_hand.flat_map(|of| hand.step_bodies(of, friction, compliance)));
        }
        bodies
    }

    /// Triangles that can touch a body; none for a hand that must leave the object first.
    ///
    /// Units: `extent` of the object m.
    fn candidates(
        &mut self,
        hands: &BothHands,
        bodies: &[StepBody],
        object: &SoftObject,
        extent: f64,
        ask: &ContactAsk,
    ) -> Vec<Candidate> {
        let surface = SearchedSurface {
            tree: object.tree(),
            stars: object.rest_shape().stars(),
            triangles: &object.surface().triangles,
            places: object.shape(),
        };
        let world_from_object = self.world_from_object();
        let moving = |at: usize| bodies[at].moving.clone();
        let mut places: Vec<usize> = (0..TABLE).collect();
        let mut first = TABLE;
        for (hand, _) in self.hands.iter_mut().zip(hands).filter(|(_, bodies)| bodies.is_some()) {
            let of_hand = first..first + HAND_BODIES;
            first = of_hand.end;
            if hand.is_apart {
                let bodies: Vec<MovingBody> = of_hand.clone().map(moving).collect();
                let near = triangles_near(&surface, &world_from_object, &bodies, CLEAR_M);
                hand.is_apart = !near.is_empty();
            }
            if !hand.is_apart {
                places.extend(of_hand);
            }
        }
        let touching: Vec<MovingBody> = places.iter().copied().map(moving).collect();
        let margin = reach_of_step(extent, &self.state, &touching, ask);
        let mut near = triangles_near(&surface, &world_from_object, &touching, margin);
        // Bodies were counted among those that may touch.
        for candidate in &mut near {
            let place = places[usize::from(candidate.body)];
            candidate.body = u16::try_from(place).unwrap_or(candidate.body);
        }
        near
    }

    /// Takes the answer to the step of a tick. A step that was not solved and would throw the object away
    /// is not taken: the object stays where it was, undeformed, and the hands must leave it.
    pub fn take(&mut self, tick: u64, reached: ReachedStep) -> TakenStep {
        let Some(asked) = self.asked.take_if(|asked| asked.tick == tick) else {
            return TakenStep::NotAsked;
        };
        let ReachedStep { contact, state, loads, small_system } = reached;
        let extent = asked.extent;
        let moved = Vector3::from_fn(|axis, _| state.pose[axis] - self.state.pose[axis]).norm();
        let is_far = contact.penetration_max > LOST_DEPTH * extent || moved > LOST_WAY * extent;
        if !contact.is_converged && is_far {
            self.put(self.world_from_object());
            self.end_at(asked.time_s, asked.hands);
            return TakenStep::Lost;
        }
        let norm = |v: &[f64; 3]| v[0].hypot(v[1]).hypot(v[2]);
        let poses = self.body_poses(&asked.hands);
        match (&mut self.felt, &asked.hands[0]) {
            (Some(felt), Some(_)) => felt.answer(&small_system, &poses, asked.at),
            // What the other hand presses with is not felt.
            (Some(felt), None) => felt.let_go(),
            (None, _) => {}
        }
        let speed = norm(&state.velocity).max(norm(&state.angular_velocity) * extent);
        let is_still = speed < STILL_SPEED;
        self.still_steps = if is_still { self.still_steps.saturating_add(1) } else { 0 };
        self.slow_steps = if speed < SLOW_SPEED { self.slow_steps.saturating_add(1) } else { 0 };
        self.press(&asked.hands, &loads);
        (self.state, self.report) = (state, contact);
        self.strayed = false;
        self.end_at(asked.time_s, asked.hands);
        TakenStep::Taken
    }

    /// Hands the loads of an answer to the table and to the hands that were there.
    fn press(&mut self, hands: &[Option<BodyPoses>; 2], loads: &[BodyLoad]) {
        self.table_load = loads.first().copied();
        let mut first = TABLE;
        for (hand, was_there) in self.hands.iter_mut().zip(hands) {
            let of_hand = first..first + if was_there.is_some() { HAND_BODIES } else { 0 };
            first = of_hand.end;
            hand.press(loads.get(of_hand).unwrap_or_default());
        }
    }

    /// Gives up the step of a tick, so that the next tick asks again; returns whether it was awaited.
    pub fn give_up(&mut self, tick: u64) -> bool {
        let is_awaited = self.asked.take_if(|asked| asked.tick == tick).is_some();
        self.strayed |= is_awaited;
        is_awaited
    }

    /// Gives up any awaited step; returns whether there was one.
    pub fn give_up_any(&mut self) -> bool {
        let is_awaited = self.asked.take().is_some();
        self.strayed |= is_awaited;
        is_awaited
    }

    /// What one of the hands presses with.
    pub fn hand(&self, which: WhichHand) -> &GraspingHand {
        &self.hands[which.index()]
    }

    /// Force of the table on the object, N, in the world frame; zero without contact.
    pub fn table_force(&self) -> Vector3<f64> {
        self.table_load.map_or(Vector3::zeros(), |load| Vector3::from(load.force))
    }

    /// Record of the last step: its forces, and how well it meets the law of contact.
    pub fn record(&self, tick: u64, round_trip_ms: f64) -> StepRecord {
        let [first, second] = &self.hands;
        let loads = (first.loads(), second.was_there().then(|| second.loads()));
        StepRecord::new(tick, round_trip_ms, &self.report, self.table_load.as_slice(), loads)
    }

    /// Whether the state differs from the one at the last call.
    pub fn enters(&mut self, state: StateName) -> bool {
        self.told.replace(state) != Some(state)
    }

    /// Whether a step that was asked for before a tick is still not answered.
    pub fn is_late(&self, tick: u64) -> bool {
        self.asked.as_ref().is_some_and(|asked| asked.tick < tick)
    }

    /// Whether the object is at rest or held still.
    pub fn is_still(&self) -> bool {
        self.slow_steps >= SLOW_STEPS
    }

    /// State of the grasp: `Detached` while the hands must leave the object, `Deforming` from the first
    /// touch of one of them on.
    pub fn state_name(&self) -> StateName {
        match &self.hands {
            hands if hands.iter().any(GraspingHand::is_touching) => StateName::Deforming,
            hands if hands.iter().all(|hand| hand.is_apart) => StateName::Detached,
            _ => StateName::Free,
        }
    }

    /// Displacement of a shown hand from the measured one, m, in the world frame: each segment of a
    /// finger gives way to the force on it.
    pub fn pushed_back(&self, which: WhichHand) -> [[Vector3<f64>; 3]; 5] {
        self.hands[which.index()].pushed_back(self.scene.finger_compliance)
    }
}
