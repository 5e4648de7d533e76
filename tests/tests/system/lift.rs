//! Objects are picked up from a table by contact with friction, held, and put down again.

use std::sync::Arc;

use fea_server::RunningServer;
use glove_client::ask::link::Link;
use glove_client::ask::solve_settings::SolveSettings;
use glove_client::ask::unanswered::Unanswered;
use glove_client::pace::Pace;
use glove_client::pace::tick_budget::Priority;
use glove_client::run::contact_grasp::ContactScene;
use glove_client::run::grasp_loop::GraspLoop;
use glove_client::run::tick_outcome::TickOutcome;
use nalgebra::Isometry3;
use softgrasp_core::mesh::{BuiltIn, TetMesh};
use softgrasp_grasp::grasp::{Command, Grasp, StateName};
use softgrasp_grasp::hand::{clearance, hand_bodies, pose_of_segments};
use softgrasp_grasp::object::{ContactModel, SoftObject, lying};
use softgrasp_hand::hand_reader::HandReader;
use softgrasp_hand::hand_setup::HandSetup;
use softgrasp_hand::scripted::{PlanRequest, ScriptName, ScriptedHand, Seen};
use softgrasp_hand::sent::Sent;

use crate::settings::{linear_settings, sized};
use crate::start::server;

/// Run in lockstep whose hand pinches, lifts and puts down.
pub struct Lift {
    pub grasp_loop: GraspLoop,
    pub hand: ScriptedHand,
    seen: Seen,
    pub tick: u64,
    server: Option<RunningServer>,
}

pub fn object(shape: BuiltIn, nodes: usize, size_m: f64) -> TetMesh {
    lying(&sized(shape, nodes, size_m)).unwrap().0
}

impl Lift {
    pub fn of(mesh: TetMesh, scene: ContactScene) -> Self {
        let server = server(1);
        let object = SoftObject::try_new(mesh).unwrap();
        let setup = HandSetup::default();
        let contact = ContactModel::Friction;
        let rest = Arc::clone(object.rest_shape());
        let plan = PlanRequest::new(rest, setup.clone(), contact).grip().unwrap();
        let hand = ScriptedHand::following(ScriptName::Lift, setup.clone(), plan).holding(contact);
        let settings = SolveSettings { contact, ..linear_settings() };
        let grasp = Grasp::try_new(Isometry3::identity(), Grasp::RELEASE_MARGIN_M).unwrap();
        let link = Link::start(server.address().to_string(), Priority::Ordinary).unwrap();
        let table_y = Some(object.rest_shape().bottom());
        let reader = HandReader::new(setup);
        let mut grasp_loop =
            GraspLoop::try_new(reader, object, grasp, link, settings, Pace::Lockstep).unwrap();
        grasp_loop.grasp_with_friction(ContactScene { table_y, ..scene });
        Self { grasp_loop, hand, seen: Seen::default(), tick: 0, server: Some(server) }
    }

    /// Plays one tick; `None` when the script is over.
    pub fn tick(&mut self) -> Option<TickOutcome> {
        let sent = self.hand.next(&self.seen, self.grasp_loop.object());
        (!sent.over).then(|| self.send(&sent))
    }

    fn send(&mut self, sent: &Sent) -> TickOutcome {
        let outcome = self.grasp_loop.tick(self.tick, self.tick as f64 / 60.0, sent).unwrap();
        self.seen = outcome.seen;
        self.tick += 1;
        outcome
    }

    /// Height of the object above its first position, m.
    pub fn height(&self) -> f64 {
        self.grasp_loop.world_from_object().translation.y
    }

    /// Height of the lowest point of the shown object above the table, m.
    pub fn above_table(&self) -> f64 {
        let (grasp_loop, object) = (&self.grasp_loop, self.grasp_loop.object());
        let heights = object
            .surface()
            .nodes
            .iter()
            .map(|&node| (grasp_loop.world_from_object() * object.shape()[node as usize]).y);
        let table_y = grasp_loop.contact_grasp().and_then(|contact| contact.scene().table_y);
        heights.fold(f64::INFINITY, f64::min) - table_y.unwrap()
    }

    /// Penetration of the shown hand into the shown object, m.
    fn shown_depth(&self) -> f64 {
        let (grasp_loop, Some(hand)) = (&self.grasp_loop, self.grasp_loop.hand()) else {
            return 0.0;
        };
        let dimensions = grasp_loop.reader().setup().dimensions;
        let shown =
            pose_of_segments(&dimensions, hand.world_from_palm, grasp_loop.shown_segments());
        let bodies = hand_bodies(&dimensions, &shown);
        let object = grasp_loop.object();
        let nodes = object.surface().nodes.iter();
        let surface =
            nodes.map(|&node| grasp_loop.world_from_object() * object.shape()[node as usize]);
        (-clearance(&bodies, surface)).max(0.0)
    }
}

#[test]
fn objects_are_picked_up_from_the_table_held_still_and_put_down() {
    for (shape, nodes, size_m) in
        [(BuiltIn::Strawberry, 400, 0.08), (BuiltIn::Sphere, 300, 0.07), (BuiltIn::Cube, 343, 0.05)]
    {
        let mut lift = Lift::of(object(shape, nodes, size_m), ContactScene::default());
        let (mut heights, mut depth) = (Vec::new(), 0.0f64);
        let mut states = Vec::new();
        while let Some(outcome) = lift.tick() {
            heights.push(lift.height());
            depth = depth.max(lift.shown_depth());
            states.extend(outcome.state.filter(|state| states.last() != Some(state)));
        }
        let highest = heights.iter().copied().fold(0.0, f64::max);
        assert!(highest > 0.05, "{shape}: lifted by {highest} m");
        let above = lift.above_table();
        assert!(above.abs() < 1e-3, "{shape}: {above} m above the table at the end");
        assert!(depth < 1e-4, "{shape}: the shown hand is {depth} m deep in the object");
        let expected = [StateName::Free, StateName::Deforming, StateName::Free];
        assert!(states.ends_with(&expected), "{shape}: {states:?}");
    }
}

#[test]
fn held_object_does_not_creep() {
    let mut lift = Lift::of(object(BuiltIn::Sphere, 300, 0.07), ContactScene::default());
    while lift.height() < 0.055 {
        assert!(lift.tick().is_some(), "never lifted");
    }
    // The hand stands still from here on.
    let mut sent = None;
    for _ in 0..30 {
        sent = Some(lift.hand.next(&lift.seen, lift.grasp_loop.object()));
        if lift.hand.script() == ScriptName::Lift && lift.height() > 0.0595 {
            break;
        }
        lift.send(sent.as_ref().unwrap());
    }
    let still = Sent { command: None, ..sent.unwrap() };
    (0..60).for_each(|_| drop(lift.send(&still)));
    let begun = *lift.grasp_loop.world_from_object();
    (0..240).for_each(|_| drop(lift.send(&still)));
    let ended = *lift.grasp_loop.world_from_object();
    let crept = (ended.translation.vector - begun.translation.vector).norm();
    assert!(crept < 1e-6, "crept by {crept} m in 4 s");
    assert_eq!(lift.grasp_loop.state(), StateName::Deforming);
}

#[test]
fn slippery_object_stays_on_the_table() {
    let scene = ContactScene { friction: 0.02, ..ContactScene::default() };
    let mut lift = Lift::of(object(BuiltIn::Sphere, 300, 0.07), scene);
    let mut highest = 0.0f64;
    while lift.tick().is_some() {
        highest = highest.max(lift.height());
    }
    assert!(highest < 0.03, "lifted by {highest} m");
}

#[test]
fn kept_shape_stays_in_the_hand_and_the_object_returns_home_when_asked() {
    let mut lift = Lift::of(object(BuiltIn::Sphere, 300, 0.07), ContactScene::default());
    let mut kept_at = None;
    while let Some(outcome) = lift.tick() {
        if kept_at.is_none() && lift.grasp_loop.object().rest_shapes() > 1 {
            kept_at = Some(lift.height());
            assert_eq!(outcome.state, Some(StateName::Deforming));
        }
    }
    let height = kept_at.expect("the shape was never kept");
    assert!(height > 0.04, "kept at {height} m");
    let sent = lift.hand.next(&lift.seen, lift.grasp_loop.object());
    let home = lift.send(&Sent { command: Some(Command::ReturnHome), ..sent });
    assert!(home.events.iter().any(|event| event.kind_and_words().1 == "returned home"));
    // In the tick that puts it there, it begins to sag under its weight.
    let height = lift.height();
    assert!(height.abs() < 2e-3, "{height} m above its home");
}

/// An asked step stayed asked for when the server went, so that every later tick waited for its answer.
#[test]
fn lost_server_is_not_said_to_answer_late_when_the_hand_grasps_by_contact() {
    let mut lift = Lift::of(object(BuiltIn::Sphere, 300, 0.07), ContactScene::default());
    while lift.height() < 0.02 {
        assert!(lift.tick().is_some(), "never lifted");
    }
    drop(lift.server.take());
    let mut lost = 0;
    for _ in 0..20 {
        let outcome = lift.tick().expect("it is in the air");
        assert_eq!(outcome.state, Some(StateName::Deforming));
        for (tick, why) in outcome.unanswered {
            assert_eq!(why, Unanswered::ServerLost, "tick {tick}");
            lost += 1;
        }
    }
    assert!(lost >= 15, "{lost} of 20 ticks");
}
