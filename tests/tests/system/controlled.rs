//! Run in lockstep that a test controls as a person would, by wishes between the ticks.

use std::time::Duration;

use fea_server::RunningServer;
use glove_client::ask::link::Link;
use glove_client::ask::solve_settings::SolveSettings;
use glove_client::pace::tick_budget::Priority;
use glove_client::pace::{Due, Pace};
use glove_client::run::contact_grasp::ContactScene;
use glove_client::run::grasp_loop::GraspLoop;
use glove_client::run::run_report::RunReport;
use glove_client::run::session::Session;
use glove_client::run::table_object::FurtherObject;
use glove_client::run::tick_outcome::TickOutcome;
use nalgebra::Isometry3;
use softgrasp_core::mesh::TetMesh;
use softgrasp_grasp::grasp::{Grasp, StateName};
use softgrasp_grasp::object::{ContactModel, SoftObject, lying};
use softgrasp_hand::hand_reader::HandReader;
use softgrasp_hand::hand_setup::HandSetup;
use softgrasp_hand::hand_source::HandSource;
use softgrasp_hand::loaded_object::ObjectSummary;
use softgrasp_hand::mouse::MouseHand;
use softgrasp_hand::notice::{Notice, NoticeKind};
use softgrasp_hand::scripted::{Planner, ScriptName, ScriptedHand};
use softgrasp_protocol::Material;
use softgrasp_window::view::control::Control;
use softgrasp_window::view::object_skin::Look;

use crate::settings::linear_settings;
use crate::start::server;

/// Material of the objects in these tests.
pub const MATERIAL: Material = Material { young: 2.0e4, poisson: 0.4 };
/// Number of ticks after which a test gives up waiting.
const TICKS_MAX: usize = 3000;

/// Run with its server, and the sentences that were told.
pub struct Controlled {
    pub session: Session,
    pub notices: Vec<Notice>,
    tick: u64,
    _server: RunningServer,
}

/// Settings of the solves.
fn settings() -> SolveSettings {
    SolveSettings { material: MATERIAL, ..linear_settings() }
}

/// Summary of an object for the report.
pub fn summary(object: &SoftObject) -> ObjectSummary {
    ObjectSummary {
        name: "an object".to_owned(),
        nodes: object.shape().len(),
        tets: object.rest().tets().len(),
        size_m: object.rest().size(),
        notes: Vec::new(),
    }
}

impl Controlled {
    /// Run with a mouse hand before an object.
    pub fn by_mouse(mesh: TetMesh) -> Self {
        let mouse = MouseHand::new(HandSetup::default(), Planner::waited(), 1.0 / 60.0);
        Self::new(SoftObject::try_new(mesh).unwrap(), mouse.into())
    }

    /// Run with a mouse hand before an object that is on a table and is grasped by contact with friction.
    pub fn by_mouse_with_friction(mesh: TetMesh) -> Self {
        let object = SoftObject::try_new(lying(&mesh).unwrap().0).unwrap();
        let mouse = MouseHand::new(HandSetup::default(), Planner::waited(), 1.0 / 60.0)
            .holding(ContactModel::Friction);
        let table_y = Some(object.rest_shape().bottom());
        let settings = SolveSettings { contact: ContactModel::Friction, ..settings() };
        Self::begin(object, mouse.into(), settings, |grasp_loop, _| {
            grasp_loop.grasp_with_friction(ContactScene { table_y, ..ContactScene::default() });
        })
    }

    /// Run with a mouse hand before two objects on a table, the second so far to the right of the first.
    ///
    /// Units: m.
    pub fn by_mouse_before_two(meshes: [TetMesh; 2], x: f64) -> Self {
        let lying = |mesh: &TetMesh| SoftObject::try_new(lying(mesh).unwrap().0).unwrap();
        let [object, second] = meshes.each_ref().map(lying);
        let mouse = MouseHand::new(HandSetup::default(), Planner::waited(), 1.0 / 60.0)
            .holding(ContactModel::Friction);
        let table_y = object.rest_shape().bottom();
        let scene = ContactScene { table_y: Some(table_y), ..ContactScene::default() };
        let settings = SolveSettings { contact: ContactModel::Friction, ..settings() };
        let home = Isometry3::translation(x, table_y - second.rest_shape().bottom(), 0.0);
        Self::begin(object, mouse.into(), settings.clone(), |grasp_loop, server| {
            grasp_loop.grasp_with_friction(scene);
            let address = server.address().to_string();
            grasp_loop
                .lay_beside(FurtherObject {
                    name: "strawberry".to_owned(),
                    look: Look::Strawberry,
                    object: second,
                    grasp: Grasp::try_new(home, Grasp::RELEASE_MARGIN_M).unwrap(),
                    link: Link::start(address, Priority::Ordinary).unwrap(),
                    settings,
                    scene,
                })
                .unwrap();
        })
    }

    /// Run with a script before an object.
    pub fn by_script(mesh: TetMesh, script: ScriptName) -> Self {
        let object = SoftObject::try_new(mesh).unwrap();
        let hand = ScriptedHand::try_new(script, HandSetup::default(), &object).unwrap();
        Self::new(object, hand.into())
    }

    fn new(object: SoftObject, hand: HandSource) -> Self {
        Self::begin(object, hand, settings(), |_, _| {})
    }

    fn begin(
        object: SoftObject,
        hand: HandSource,
        settings: SolveSettings,
        set_up: impl FnOnce(&mut GraspLoop, &RunningServer),
    ) -> Self {
        let server = server(1);
        let report = RunReport::new(
            summary(&object),
            hand.name(),
            "embedded".to_owned(),
            Pace::Lockstep,
            settings.contact,
        );
        let grasp = Grasp::try_new(Isometry3::identity(), Grasp::RELEASE_MARGIN_M).unwrap();
        let link = Link::start(server.address().to_string(), Priority::Ordinary).unwrap();
        let reader = HandReader::new(HandSetup::default());
        let mut grasp_loop =
            GraspLoop::try_new(reader, object, grasp, link, settings, Pace::Lockstep).unwrap();
        set_up(&mut grasp_loop, &server);
        let session = Session::new(grasp_loop, hand, report, Priority::Ordinary, false);
        session.wait_idle(Duration::from_secs(60));
        Self { session, notices: Vec::new(), tick: 0, _server: server }
    }

    /// Plays one tick.
    pub fn tick(&mut self) -> TickOutcome {
        let due = Due { tick: self.tick, skipped: 0 };
        self.tick += 1;
        let outcome = self.session.play(due, due.tick as f64 / 60.0).unwrap().unwrap();
        self.notices.extend(self.session.take_notices());
        outcome
    }

    /// Sends a control and plays a tick.
    pub fn ask(&mut self, control: Control) -> TickOutcome {
        self.session.apply(control);
        self.tick()
    }

    /// Plays until `done` holds.
    pub fn until(&mut self, what: &str, done: impl Fn(&Self, &TickOutcome) -> bool) {
        for _ in 0..TICKS_MAX {
            let outcome = self.tick();
            if done(self, &outcome) {
                return;
            }
        }
        panic!("never came: {what}; told: {:?}", self.notices);
    }

    /// Plays until the grasp is in a state.
    pub fn until_state(&mut self, state: StateName) {
        self.until(&format!("{state}"), |_, outcome| outcome.state == Some(state));
    }

    /// Plays until the object has been deformed for `ticks` ticks.
    pub fn deform(&mut self, ticks: usize) {
        self.until_state(StateName::Deforming);
        for _ in 0..ticks {
            assert_eq!(self.tick().state, Some(StateName::Deforming));
        }
    }

    /// Object in its present shape.
    pub fn object(&self) -> &SoftObject {
        self.session.grasp_loop().object()
    }

    /// Checks that the last sentence is of this kind and contains these words.
    pub fn assert_told(&self, kind: NoticeKind, words: &str) {
        let last = self.notices.last().expect("nothing was told");
        assert!(last.kind == kind && last.text.contains(words), "{:?}", self.notices);
    }

    /// Ends the run; its report.
    pub fn finish(self) -> RunReport {
        self.session.finish(false).unwrap()
    }
}
