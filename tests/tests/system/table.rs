//! Two objects lie on one table: a hand lifts one of them, and the other lies there as if it were alone.

use std::sync::Arc;

use fea_server::RunningServer;
use glove_client::ask::link::Link;
use glove_client::ask::solve_settings::SolveSettings;
use glove_client::pace::Pace;
use glove_client::pace::tick_budget::Priority;
use glove_client::run::contact_grasp::ContactScene;
use glove_client::run::grasp_loop::GraspLoop;
use glove_client::run::table_object::FurtherObject;
use glove_client::run::tick_outcome::TickOutcome;
use nalgebra::{Isometry3, Vector3};
use softgrasp_core::mesh::{BuiltIn, TetMesh};
use softgrasp_grasp::grasp::{Grasp, StateName};
use softgrasp_grasp::object::{ContactModel, SoftObject};
use softgrasp_hand::hand_reader::HandReader;
use softgrasp_hand::hand_setup::HandSetup;
use softgrasp_hand::mouse::{Digits, MouseInput};
use softgrasp_hand::scripted::{PlanRequest, ScriptName, ScriptedHand, Seen};
use softgrasp_hand::sent::WhichHand;
use softgrasp_window::view::control::Control;
use softgrasp_window::view::object_skin::Look;

use crate::controlled::Controlled;
use crate::lift::{Lift, object};
use crate::mouse::{arrive, wish};
use crate::settings::{linear_settings, sized};
use crate::start::server;

/// Run in lockstep with two objects on a table.
struct Table {
    grasp_loop: GraspLoop,
    hand: ScriptedHand,
    seen: Seen,
    tick: u64,
    _server: RunningServer,
}

/// Place of the second object's origin beside that of the first, m.
const SECOND_X: f64 = 0.16;

fn fruit() -> TetMesh {
    object(BuiltIn::Strawberry, 400, 0.08)
}

fn cube() -> TetMesh {
    object(BuiltIn::Cube, 343, 0.05)
}

/// Volume of a mesh, m³.
fn volume(mesh: &TetMesh) -> f64 {
    (0..mesh.tets().len()).map(|tet| mesh.signed_volume(tet)).sum()
}

impl Table {
    /// A strawberry with a cube beside it; the hand goes to the strawberry.
    fn new() -> Self {
        Self::of([fruit(), cube()], "cube", 0)
    }

    /// Two objects, of which the second has this name; the hand goes to that of the number `aim`.
    fn of(meshes: [TetMesh; 2], second: &str, aim: usize) -> Self {
        let server = server(1);
        let [first, beside] = meshes.map(|mesh| SoftObject::try_new(mesh).unwrap());
        let setup = HandSetup::default();
        let contact = ContactModel::Friction;
        let rest = Arc::clone([&first, &beside][aim].rest_shape());
        let plan = PlanRequest::new(rest, setup.clone(), contact).grip().unwrap();
        let hand = ScriptedHand::following(ScriptName::Lift, setup.clone(), plan).holding(contact);
        let settings = SolveSettings { contact, ..linear_settings() };
        let grasp = |home| Grasp::try_new(home, Grasp::RELEASE_MARGIN_M).unwrap();
        let link = || Link::start(server.address().to_string(), Priority::Ordinary).unwrap();
        let table_y = first.rest_shape().bottom();
        let scene = ContactScene { table_y: Some(table_y), ..ContactScene::default() };
        let home = Isometry3::translation(SECOND_X, table_y - beside.rest_shape().bottom(), 0.0);
        let (reader, at_origin) = (HandReader::new(setup), grasp(Isometry3::identity()));
        let mut grasp_loop =
            GraspLoop::try_new(reader, first, at_origin, link(), settings.clone(), Pace::Lockstep)
                .unwrap();
        grasp_loop.grasp_with_friction(scene);
        grasp_loop
            .lay_beside(FurtherObject {
                name: second.to_owned(),
                look: Look::Cube,
                object: beside,
                grasp: grasp(home),
                link: link(),
                settings,
                scene,
            })
            .unwrap();
        WhichHand::ALL.into_iter().for_each(|which| grasp_loop.aim(which, aim));
        Self { grasp_loop, hand, seen: Seen::default(), tick: 0, _server: server }
    }

    /// Plays one tick; `None` when the script is over.
    fn tick(&mut self) -> Option<TickOutcome> {
        self.seen.world_from_object = *self.grasp_loop.aimed(WhichHand::First).1;
        let aimed = self.grasp_loop.aimed(WhichHand::First).0;
        let sent = self.hand.next(&self.seen, aimed);
        if sent.over {
            return None;
        }
        let outcome = self.grasp_loop.tick(self.tick, self.tick as f64 / 60.0, &sent).unwrap();
        self.seen = outcome.seen;
        self.tick += 1;
        Some(outcome)
    }

    fn pose(&self, number: usize) -> Isometry3<f64> {
        *self.grasp_loop.object_at(number).1
    }
}

#[test]
fn object_that_nobody_touches_bears_its_own_weight_on_the_table_while_the_first_is_lifted() {
    let mut table = Table::new();
    let lay = table.pose(1);
    let (mut highest, mut moved) = (0.0f64, 0.0f64);
    let mut last_step = None;
    while let Some(outcome) = table.tick() {
        highest = highest.max(table.pose(0).translation.y);
        moved = moved.max((table.pose(1).translation.vector - lay.translation.vector).norm());
        let part = outcome.part(1);
        assert_ne!(part.state, Some(StateName::Deforming), "tick {}", table.tick);
        assert_eq!(outcome.touched, 0);
        last_step = part.steps.last().copied().or(last_step);
    }
    assert!(highest > 0.05, "the fruit was lifted by {highest} m");
    // It sinks by what its own weight presses it together, and stays.
    assert!(moved < 1e-3, "the cube has moved by {moved} m");
    let weight = ContactScene::default().density * 9.81 * volume(&cube());
    let step = last_step.expect("the cube was asked about");
    let relative = (step.table_force_n / weight - 1.0).abs();
    assert!(relative < 1e-3, "the table bears {} N of {weight} N", step.table_force_n);
    assert_eq!((step.finger_force_n, step.palm_force_n), ([0.0; 5], 0.0));
}

#[test]
fn first_object_moves_by_the_same_bits_with_another_beside_it_and_without() {
    let (mut alone, mut table) = (Lift::of(fruit(), ContactScene::default()), Table::new());
    for tick in 0..160 {
        let (one, two) = (alone.tick(), table.tick());
        assert_eq!(one.is_some(), two.is_some());
        let bits = |pose: &Isometry3<f64>| {
            let (t, q) = (pose.translation.vector, pose.rotation.coords);
            (t.map(f64::to_bits), q.map(f64::to_bits))
        };
        let pose = alone.grasp_loop.world_from_object();
        assert_eq!(bits(pose), bits(&table.pose(0)), "tick {tick}");
        let displacements =
            [&alone.grasp_loop, &table.grasp_loop].map(|of| of.object().displacement());
        assert!(displacements[0] == displacements[1], "tick {tick}");
    }
}

#[test]
fn hand_lifts_the_second_object_whose_shape_is_kept_while_the_first_lies_still() {
    let mut table = Table::of([cube(), fruit()], "strawberry", 1);
    let lay = table.pose(0);
    let home_y = table.pose(1).translation.y;
    let (mut highest, mut moved) = (0.0f64, 0.0f64);
    let (mut pressed, mut events) = (0.0f64, Vec::new());
    while let Some(outcome) = table.tick() {
        highest = highest.max(table.pose(1).translation.y - home_y);
        moved = moved.max((table.pose(0).translation.vector - lay.translation.vector).norm());
        let forces = outcome.part(1).steps.iter().flat_map(|step| step.finger_force_n);
        pressed = forces.fold(pressed, f64::max);
        events.extend(outcome.events.iter().map(|event| event.kind_and_words().1));
        assert!(outcome.part(1).events.is_empty(), "news are among those of the run");
    }
    assert!(highest > 0.05, "the fruit was lifted by {highest} m");
    assert!(pressed > 0.1, "pressed with {pressed} N");
    assert!(moved < 1e-3, "the cube has moved by {moved} m");
    let shapes = [0, 1].map(|number| table.grasp_loop.object_at(number).0.rest_shapes());
    assert_eq!(shapes, [1, 2], "the shape of the fruit alone is kept");
    assert!(
        events.iter().any(|what| what == "entered Deforming (object 2, strawberry)"),
        "{events:?}"
    );
}

#[test]
fn object_of_several_that_has_no_room_is_refused_by_name_and_returns_home_on_the_same_table() {
    let mut table = Table::new();
    let wide = SoftObject::try_new(object(BuiltIn::Cube, 125, 0.3)).unwrap();
    let refused = table.grasp_loop.replace_object(Arc::clone(wide.rest_shape()), "wide block");
    let said = refused.unwrap_err().text;
    assert!(said.contains("wide block") && said.contains("object 2, cube"), "{said}");
    // A smaller one lies as high as the table is, which stays where it is for the others.
    let small = SoftObject::try_new(object(BuiltIn::Cube, 125, 0.03)).unwrap();
    table.grasp_loop.replace_object(Arc::clone(small.rest_shape()), "small block").unwrap();
    for _ in 0..3 {
        table.tick();
    }
    let table_y = |grasp_loop: &GraspLoop| grasp_loop.contact_grasp().unwrap().scene().table_y;
    let now = table_y(&table.grasp_loop).unwrap();
    let fruit = SoftObject::try_new(fruit()).unwrap();
    assert_eq!(now, fruit.rest_shape().bottom());
    let lowest = table.pose(0).translation.y + small.rest_shape().bottom();
    assert!((lowest - now).abs() < 1e-4, "{lowest} m instead of {now} m");
}

#[test]
fn mouse_hand_reaches_for_the_object_that_it_is_over_and_the_menu_keeps_its_shape() {
    let meshes = [sized(BuiltIn::Cube, 125, 0.05), sized(BuiltIn::Strawberry, 400, 0.08)];
    let mut run = Controlled::by_mouse_before_two(meshes, 0.18);
    let pose = |run: &Controlled, number| *run.session.grasp_loop().object_at(number).1;
    arrive(&mut run);
    let lay = [pose(&run, 0), pose(&run, 1)];
    wish(&mut run, MouseInput::Move(Vector3::new(0.18, 0.0, 0.0)));
    (0..60).for_each(|_| drop(run.tick()));
    wish(&mut run, MouseInput::Reach);
    arrive(&mut run);
    wish(&mut run, MouseInput::CloseTo(Digits::All, 2.0));
    let is_pressed = |outcome: &TickOutcome| outcome.part(1).state == Some(StateName::Deforming);
    run.until("the fruit is pressed", |_, outcome| is_pressed(outcome));
    (0..90).for_each(|_| drop(run.tick()));
    wish(&mut run, MouseInput::Move(Vector3::new(0.0, 0.06, 0.0)));
    (0..90).for_each(|_| drop(run.tick()));
    let raised = [0, 1].map(|number| pose(&run, number).translation.y - lay[number].translation.y);
    assert!(raised[0].abs() < 1e-3 && raised[1] > 0.05, "raised by {raised:?} m");
    run.ask(Control::KeepShape);
    let shapes = |run: &Controlled| {
        [0, 1].map(|number| run.session.grasp_loop().object_at(number).0.rest_shapes())
    };
    run.until("the shape of the fruit is kept", |run, _| shapes(run) == [1, 2]);
}
