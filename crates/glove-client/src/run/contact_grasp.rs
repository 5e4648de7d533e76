//! A grasp by contact with friction: the free object among the rigid bodies of the hand and above a
//! table, in steps of time.

use std::time::Instant;

use nalgebra::{Isometry3, Vector3};
use softgrasp_core::dynamics::{Candidate, MovingBody};
use softgrasp_core::rigid_body::RigidShape;
use softgrasp_force::ForceReport;
use softgrasp_grasp::grasp::StateName;
use softgrasp_grasp::hand::{HAND_BODIES, HandBody};
use softgrasp_grasp::object::SoftObject;
use softgrasp_grasp::sphere_tree::{SearchedSurface, triangles_near};
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
use crate::run::felt::FeltHand;

/// Constants of an object and of the hand that grasps it with friction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactScene {
    /// Coefficient of friction between hand and object, and between table and object.
    pub friction: f64,
    /// Displacement of a finger for each unit of force on it, m/N: the measured finger may close further
    /// than the shown one, which presses by their distance over this.
    pub finger_compliance: f64,
    /// Density of the object, kg/m³.
    pub density: f64,
    /// Time constant with which the shape forgets a force (Kelvin and Voigt), s.
    pub viscosity: f64,
    /// Acceleration of free fall, m/s², in the world frame; −y is down.
    pub gravity: Vector3<f64>,
    /// Height of the table (y in the world frame), m; `None` without a table.
    pub table_y: Option<f64>,
}

impl Default for ContactScene {
    fn default() -> Self {
        Self {
            friction: 0.8,
            finger_compliance: 1e-3,
            density: 1000.0,
            viscosity: 0.02,
            gravity: Vector3::new(0.0, -9.81, 0.0),
            table_y: None,
        }
    }
}

/// State of a grasp by contact with friction.
pub struct ContactGrasp {
    scene: ContactScene,
    /// Home pose, to which the object returns.
    world_from_home: Isometry3<f64>,
    /// State of the object after the last answer.
    state: ObjectState,
    /// Time and pose of the hand at the end of the last answered step.
    hand: Option<HandMoment>,
    /// Step that was asked for and not answered yet.
    asked: Option<Asked>,
    /// Force and torque of each body on the object in the last answer: the table, then the hand.
    loads: Vec<BodyLoad>,
    /// How well the last step meets the law of contact.
    report: ContactReport,
    /// Whether the server's last step is not the one that the state comes from.
    strayed: bool,
    /// Whether the hand must leave the object before it can touch it.
    is_apart: bool,
    /// Number of steps in a row in which nothing has moved.
    still_steps: u32,
    /// Number of steps in a row with motion too slow to be seen.
    slow_steps: u32,
    /// State that was reported last.
    told: Option<StateName>,
    /// Force that the hand feels.
    felt: Option<FeltHand>,
}

/// Poses of the bodies of a hand at a time, s.
#[derive(Clone, Debug)]
struct HandMoment {
    time_s: f64,
    world_from_bodies: [Isometry3<f64>; HAND_BODIES],
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
    hand: HandMoment,
    /// Extent of the object at rest, m ([`extent`]).
    extent: f64,
}

/// Number of bodies before those of the hand: the table.
const TABLE: usize = 1;
/// Longest step, s: a run with longer ticks plays in slow motion.
const STEP_MAX_S: f64 = 1.0 / 60.0;
/// Shortest step, s; a shorter one is left to the next tick.
const STEP_MIN_S: f64 = 2e-4;
/// Distance, m, by which a hand was not followed if it moves farther in one step: it must leave the
/// object first.
const LEAP_M: f64 = 0.15;
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
const ROUNDS_MAX: u32 = 12;
const NEWTON_MAX: u32 = 80;
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
            hand: None,
            asked: None,
            loads: Vec::new(),
            report: ContactReport::default(),
            strayed: true,
            is_apart: true,
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

    /// Puts the object, at rest and undeformed, at its home.
    pub fn return_home(&mut self) {
        self.put(self.world_from_home);
    }

    /// Puts the object, at rest and undeformed, at a pose.
    pub fn put(&mut self, world_from_object: Isometry3<f64>) {
        self.state = ObjectState::at_rest(pose_of(&world_from_object));
        self.loads.clear();
        self.felt.iter_mut().for_each(FeltHand::let_go);
        self.let_go();
        (self.asked, self.still_steps, self.strayed) = (None, 0, true);
    }

    /// Releases the object: the hand must leave it before it can touch it again.
    pub fn let_go(&mut self) {
        self.is_apart = true;
        self.still_steps = 0;
    }

    /// Makes the present shape the rest shape; the object keeps its pose.
    pub fn meet_new_shape(&mut self) {
        self.state = ObjectState::at_rest(self.state.pose);
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
        hand: &[HandBody; HAND_BODIES],
        object: &SoftObject,
        wish: StepWish,
    ) -> Option<ContactFrame> {
        let world_from_bodies = std::array::from_fn(|i| hand[i].world_from_body);
        if let Some(felt) = &self.felt {
            felt.hand(self.world_from_table(), &world_from_bodies);
        }
        if self.asked.is_some() {
            return None;
        }
        let moment = HandMoment { time_s: now_s, world_from_bodies };
        let before = self.hand.get_or_insert_with(|| moment.clone());
        let seconds = match now_s - before.time_s {
            0.0 if tick == 0 => STEP_MAX_S,
            seconds if seconds < STEP_MIN_S => return None,
            seconds => seconds.min(STEP_MAX_S),
        };
        let leap = (0..HAND_BODIES).map(|i| {
            let (a, b) = (&before.world_from_bodies[i], &moment.world_from_bodies[i]);
            (a.translation.vector - b.translation.vector).norm()
        });
        let leapt = leap.fold(0.0, f64::max) > LEAP_M;
        if leapt {
            before.world_from_bodies = moment.world_from_bodies;
            self.is_apart = true;
        }
        let bodies = self.bodies(hand);
        let ask = self.ask(seconds, &wish);
        let extent = extent(object.rest().vertices());
        let near = self.candidates(&bodies, object, extent, &ask);
        let is_touchable = near.iter().any(|candidate| usize::from(candidate.body) >= TABLE);
        if self.still_steps >= STILL_STEPS && !is_touchable {
            self.hand = Some(moment);
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
        self.asked = Some(Asked { tick, at: Instant::now(), hand: moment, extent });
        Some(step_object.frame_among(self.state.clone(), &bodies, ask, &near))
    }

    /// Lets the hand feel the object from now on.
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
        }
    }

    /// Bodies of a step, each with its motion since the last answer: the table, then the hand.
    fn bodies(&self, hand: &[HandBody; HAND_BODIES]) -> Vec<StepBody> {
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
        let of_hand = hand.iter().enumerate().map(|(i, body)| {
            let start = self.hand.as_ref().map_or(body.world_from_body, |h| h.world_from_bodies[i]);
            StepBody {
                moving: MovingBody {
                    shape: body.shape(),
                    world_from_body_start: start,
                    world_from_body_end: body.world_from_body,
                    friction,
                    compliance: self.scene.finger_compliance,
                },
                shape: BodyShape::Capsule { radius: body.radius, length: body.length },
            }
        });
        std::iter::once(table).chain(of_hand).collect()
    }

    /// Triangles that can touch a body; none for a hand that must leave the object first.
    ///
    /// Units: `extent` of the object m.
    fn candidates(
        &mut self,
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
        let moving: Vec<MovingBody> = bodies.iter().map(|body| body.moving.clone()).collect();
        let world_from_object = self.world_from_object();
        if self.is_apart {
            let hand = &moving[TABLE..];
            self.is_apart = !triangles_near(&surface, &world_from_object, hand, CLEAR_M).is_empty();
        }
        let touching = if self.is_apart { &moving[..TABLE] } else { &moving[..] };
        let margin = reach_of_step(extent, &self.state, touching, ask);
        triangles_near(&surface, &world_from_object, touching, margin)
    }

    /// Takes the answer to the step of a tick. A step that was not solved and would throw the object away
    /// is not taken: the object stays where it was, undeformed, and the hand must leave it.
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
            self.hand = Some(asked.hand);
            return TakenStep::Lost;
        }
        let norm = |v: &[f64; 3]| v[0].hypot(v[1]).hypot(v[2]);
        let world_from_table = self.world_from_table();
        if let Some(felt) = &mut self.felt {
            felt.answer(&small_system, world_from_table, &asked.hand.world_from_bodies, asked.at);
        }
        let speed = norm(&state.velocity).max(norm(&state.angular_velocity) * extent);
        let is_still = speed < STILL_SPEED;
        self.still_steps = if is_still { self.still_steps.saturating_add(1) } else { 0 };
        self.slow_steps = if speed < SLOW_SPEED { self.slow_steps.saturating_add(1) } else { 0 };
        (self.state, self.loads, self.report) = (state, loads, contact);
        self.strayed = false;
        self.hand = Some(asked.hand);
        TakenStep::Taken
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

    /// Whether each finger presses on the object, thumb first.
    pub fn touching(&self) -> [bool; 5] {
        std::array::from_fn(|digit| self.loads_of(digit).iter().any(|load| load.contacts > 0))
    }

    /// Force of each finger on the object, N, in the world frame, thumb first; zero without contact.
    pub fn finger_forces(&self) -> [Vector3<f64>; 5] {
        std::array::from_fn(|digit| {
            self.loads_of(digit).iter().map(|load| Vector3::from(load.force)).sum()
        })
    }

    /// Force of the table on the object, N, in the world frame; zero without contact.
    pub fn table_force(&self) -> Vector3<f64> {
        self.loads.first().map_or(Vector3::zeros(), |load| Vector3::from(load.force))
    }

    /// Loads of the segments of a finger; empty before the first answer.
    fn loads_of(&self, digit: usize) -> &[BodyLoad] {
        let first = TABLE + 3 * digit;
        self.loads.get(first..first + 3).unwrap_or_default()
    }

    /// Record of the last step: its forces, and how well it meets the law of contact.
    pub fn record(&self, tick: u64, round_trip_ms: f64) -> StepRecord {
        let table = self.loads.get(..TABLE).unwrap_or_default();
        let palm = self.loads.get(TABLE + 15..).unwrap_or_default();
        let fingers = std::array::from_fn(|digit| self.loads_of(digit));
        StepRecord::new(tick, round_trip_ms, &self.report, (table, fingers, palm))
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

    /// State of the grasp: `Detached` while the hand must leave the object, `Deforming` from the first
    /// touch on.
    pub fn state_name(&self) -> StateName {
        let of_hand = self.loads.get(TABLE..).unwrap_or_default();
        match self.is_apart {
            true => StateName::Detached,
            false if of_hand.iter().any(|load| load.contacts > 0) => StateName::Deforming,
            false => StateName::Free,
        }
    }

    /// Displacement of the shown hand from the measured one, m, in the world frame: each segment of a
    /// finger gives way to the force on it.
    pub fn pushed_back(&self) -> [[Vector3<f64>; 3]; 5] {
        let compliance = self.scene.finger_compliance;
        std::array::from_fn(|digit| {
            let loads = self.loads_of(digit);
            std::array::from_fn(|i| {
                loads
                    .get(i)
                    .map_or(Vector3::zeros(), |load| -compliance * Vector3::from(load.force))
            })
        })
    }
}
