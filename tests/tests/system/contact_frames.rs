//! Contact frames over real sockets: same bits, nothing kept, and no number that breaks the session.

use fea_server::RunningServer;
use glove_client::ask::connection::ServerConnection;
use softgrasp_core::mesh::{BuiltIn, Surface, TetMesh};
use softgrasp_protocol::{
    BodyMotion, BodyShape, ContactAnswer, ContactAsk, ContactFrame, Deformation, Field, FieldSet,
    ModelHash, NodeChoice, ObjectState, Precision, Reply, Request,
};
use softgrasp_tests::questions::{object, upload};

use crate::start::{client, refusal, server};

pub const STILL: [f64; 7] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0];

/// Object above a table, and a finger that comes down on it.
pub struct Scene {
    mesh: TetMesh,
    surface: Surface,
    model: ModelHash,
    pub deformation: Option<Deformation>,
    fields: FieldSet,
}

impl Scene {
    pub fn new(connection: &mut ServerConnection) -> Self {
        scene_of(connection, object(BuiltIn::Strawberry, 300), None)
    }

    pub fn mesh(&self) -> &TetMesh {
        &self.mesh
    }

    pub fn frame(&self, state: ObjectState, step: u32) -> ContactFrame {
        let (low, high) = self.mesh.bounds();
        let size = self.mesh.size();
        let at = |y: f64| {
            let middle = nalgebra::center(&low, &high);
            [middle.x, y, middle.z, 1.0, 0.0, 0.0, 0.0]
        };
        let height = |step: u32| high.y + 0.12 * size - 0.01 * size * f64::from(step.min(9));
        let body =
            |shape, start, end| BodyMotion { shape, start, end, friction: 0.6, compliance: 0.0 };
        let plane = BodyShape::Plane { normal: [0.0, 1.0, 0.0] };
        let tip = BodyShape::Sphere { radius: 0.1 * size };
        let triangles = self.surface.triangles.clone();
        let triangles: Vec<[u32; 3]> = triangles.iter().chain(&triangles).copied().collect();
        let half = triangles.len() / 2;
        ContactFrame {
            model: self.model,
            ask: ContactAsk {
                seconds: 0.01,
                gravity: [0.0, -9.81, 0.0],
                density: 1000.0,
                viscosity: 0.005,
                penetration_rel: 1e-6,
                residual_rel: 1e-6,
                rounds_max: 12,
                newton_max: 60,
                deformation: self.deformation,
                ..ContactAsk::default()
            },
            state,
            bodies: vec![
                body(plane, at(low.y), at(low.y)),
                body(tip, at(height(step)), at(height(step + 1))),
            ],
            triangle_bodies: (0..triangles.len()).map(|t| u32::from(t >= half)).collect(),
            triangles,
            nodes: NodeChoice::Nodes(self.surface.nodes.clone()),
            precision: Precision::F64,
            fields: self.fields,
        }
    }
}

/// The scene with a mesh of this kind, in metres.
pub fn scene_of(
    connection: &mut ServerConnection,
    mesh: TetMesh,
    deformation: Option<Deformation>,
) -> Scene {
    let surface = Surface::from_mesh(&mesh);
    let model = match connection.ask(&Request::UploadModel(upload(&mesh))) {
        Ok(Reply::ModelReady(ready)) => ready.model,
        other => panic!("the upload got {other:?}"),
    };
    Scene { mesh, surface, model, deformation, fields: FieldSet::NONE }
}

pub fn advance(connection: &mut ServerConnection, frame: ContactFrame) -> ContactAnswer {
    match connection.ask(&Request::ContactFrame(Box::new(frame))) {
        Ok(Reply::ContactAnswer(answer)) => *answer,
        other => panic!("a contact frame got {other:?}"),
    }
}

/// Answer as text, without times and memory.
pub fn bits(mut answer: ContactAnswer) -> String {
    answer.answer.report = Default::default();
    answer.contact.columns_computed = 0;
    format!("{answer:?}")
}

fn played(server: &RunningServer, steps: u32) -> Vec<ContactAnswer> {
    played_by(server, steps, None)
}

fn played_by(
    server: &RunningServer,
    steps: u32,
    deformation: Option<Deformation>,
) -> Vec<ContactAnswer> {
    played_with(server, steps, deformation, FieldSet::NONE)
}

fn played_with(
    server: &RunningServer,
    steps: u32,
    deformation: Option<Deformation>,
    fields: FieldSet,
) -> Vec<ContactAnswer> {
    let mut connection = client(server);
    let scene = Scene { deformation, fields, ..Scene::new(&mut connection) };
    played_in(&mut connection, &scene, steps)
}

/// Steps of the scene with another mesh.
pub fn played_of(server: &RunningServer, mesh: &TetMesh, steps: u32) -> Vec<ContactAnswer> {
    let mut connection = client(server);
    let scene = scene_of(&mut connection, mesh.clone(), None);
    played_in(&mut connection, &scene, steps)
}

/// Steps of a scene from rest.
pub fn played_in(
    connection: &mut ServerConnection,
    scene: &Scene,
    steps: u32,
) -> Vec<ContactAnswer> {
    let mut state = ObjectState::at_rest(STILL);
    let mut answers = Vec::new();
    for step in 0..steps {
        let answer = advance(connection, scene.frame(state, step));
        state = answer.state.clone();
        answers.push(answer);
    }
    answers
}

#[test]
fn contact_frames_have_the_same_bits_for_any_number_of_threads() {
    let mut first: Option<Vec<String>> = None;
    for threads in [1, 2, 4, 7] {
        let found: Vec<String> = played(&server(threads), 14).into_iter().map(bits).collect();
        match &first {
            None => first = Some(found),
            Some(first) => assert!(*first == found, "{threads} threads"),
        }
    }
}

#[test]
fn finger_presses_the_object_onto_the_table_and_the_answers_say_how_well() {
    let answers = played(&server(2), 30);
    for (step, answer) in answers.iter().enumerate() {
        assert!(answer.contact.penetration_max < 1e-5, "step {step}: {:?}", answer.contact);
        assert!(answer.contact.residual_rel < 0.05, "step {step}: {:?}", answer.contact);
        assert!(answer.answer.report.residual_rel < 1e-9);
    }
    let last = answers.last().unwrap();
    assert!(last.loads[1].force[1] < 0.0 && last.loads[0].force[1] > -last.loads[1].force[1]);
    assert!(last.points.iter().all(|point| point.force.iter().all(|f| f.is_finite())));
}

#[test]
fn another_server_goes_on_with_the_state_that_one_has_given() {
    let (one, other) = (server(2), server(2));
    let whole = played(&one, 12);
    let mut connection = client(&other);
    let scene = Scene::new(&mut connection);
    let mut state = whole[5].state.clone();
    for (step, expected) in (6..).zip(&whole[6..]) {
        let answer = advance(&mut connection, scene.frame(state, step));
        assert!(bits(answer.clone()) == bits(expected.clone()), "step {step}");
        state = answer.state;
    }
}

#[test]
fn large_frames_have_the_same_bits_for_any_number_of_threads() {
    let mut first: Option<Vec<String>> = None;
    for threads in [1, 3] {
        let answers = played_by(&server(threads), 12, Some(Deformation::Large));
        let last = answers.last().unwrap();
        assert!(last.contact.is_large);
        assert!(last.loads[1].normal_force > 0.0, "{:?}", last.loads);
        let found: Vec<String> = answers.into_iter().map(bits).collect();
        match &first {
            None => first = Some(found),
            Some(first) => assert!(*first == found, "{threads} threads"),
        }
    }
}

/// The shape is not part of the state: another server finds it again from the forces.
#[test]
fn another_server_goes_on_at_large_deformation_with_the_state_that_one_has_given() {
    let (one, other) = (server(2), server(2));
    let large = Some(Deformation::Large);
    let whole = played_by(&one, 12, large);
    let mut connection = client(&other);
    let scene = Scene { deformation: large, ..Scene::new(&mut connection) };
    let mut state = whole[5].state.clone();
    let size = scene.mesh.size();
    for (step, expected) in (6..).zip(&whole[6..]) {
        let answer = advance(&mut connection, scene.frame(state, step));
        let (ours, theirs) = (&answer.answer.displacements, &expected.answer.displacements);
        let pairs = ours.clone().into_f64().into_iter().zip(theirs.clone().into_f64());
        let off = pairs.flat_map(|(a, b)| (0..3).map(move |k| (a[k] - b[k]).abs()));
        let off = off.fold(0.0, f64::max);
        assert!(off < 1e-5 * size, "step {step}: {off:e} m of {size} m");
        state = answer.state;
    }
}

#[test]
fn auto_is_linear_for_a_touch_and_large_for_a_press() {
    let server = server(2);
    let mut connection = client(&server);
    let scene = Scene { deformation: Some(Deformation::Auto), ..Scene::new(&mut connection) };
    let mut state = ObjectState::at_rest(STILL);
    let mut answers = Vec::new();
    for step in 0..12 {
        let mut frame = scene.frame(state, step);
        // Its weight alone would strain it by more than linear elasticity is taken for.
        frame.ask.gravity = [0.0; 3];
        let answer = advance(&mut connection, frame);
        state = answer.state.clone();
        answers.push(answer);
    }
    let linear = answers.iter().take_while(|a| !a.contact.is_large);
    assert!((1..12).contains(&linear.count()), "always the same");
    for answer in &answers {
        let report = &answer.answer.report;
        let turned = report.max_rotation_deg.to_radians() + report.max_strain;
        let is_linear = !answer.contact.is_large;
        assert!(!is_linear || turned <= 2e-3, "{report:?}");
    }
}

/// Change that makes a contact frame invalid.
type Damage = fn(&mut ContactFrame);

#[test]
fn frames_that_make_no_sense_are_refused_and_the_session_lives() {
    let server = server(2);
    let mut connection = client(&server);
    let scene = Scene::new(&mut connection);
    let sound = || scene.frame(ObjectState::at_rest(STILL), 0);
    let damages: [(&str, Damage); 13] = [
        ("names node", |f| f.triangles[3][1] = 1_000_000),
        ("names node", |f| f.nodes = NodeChoice::Nodes(vec![77_777])),
        ("names triangle", |f| f.triangle_bodies[0] = 9),
        ("radius", |f| f.bodies[1].shape = BodyShape::Sphere { radius: -1.0 }),
        ("normal", |f| f.bodies[0].shape = BodyShape::Plane { normal: [0.0; 3] }),
        ("pose", |f| f.bodies[1].end = [f64::NAN; 7]),
        ("pose", |f| f.state.pose[3..].fill(0.0)),
        ("length of the step", |f| f.ask.seconds = 0.0),
        ("density", |f| f.ask.density = f64::INFINITY),
        ("friction", |f| f.bodies[0].friction = -0.5),
        ("viscosity", |f| f.ask.viscosity = f64::NAN),
        ("not finite", |f| f.state.velocity[1] = f64::INFINITY),
        ("not closed", |f| {
            let vertices = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
            f.bodies[1].shape = BodyShape::Mesh { vertices, triangles: vec![[0, 1, 2]] };
        }),
    ];
    for (expected, damage) in damages {
        let mut frame = sound();
        damage(&mut frame);
        let (_, told) = refusal(&mut connection, &Request::ContactFrame(Box::new(frame)));
        assert!(told.contains(expected), "{expected}: {told}");
    }
    advance(&mut connection, sound());
}

#[test]
fn huge_numbers_give_an_answer_of_finite_numbers_or_a_refusal() {
    let server = server(2);
    let mut connection = client(&server);
    let scene = Scene::new(&mut connection);
    let damages: [Damage; 7] = [
        |f| f.state.velocity = [0.0, -1e308, 0.0],
        |f| f.state.angular_velocity = [1e200, 0.0, 0.0],
        |f| f.ask.gravity = [0.0, -1e300, 0.0],
        |f| f.ask.density = 1e-300,
        |f| f.ask.seconds = 1e200,
        |f| f.bodies[1].compliance = 1e300,
        |f| (f.state.force_nodes, f.state.forces) = (vec![0], vec![[1e300, 0.0, 0.0]]),
    ];
    for (which, damage) in damages.into_iter().enumerate() {
        let mut frame = scene.frame(ObjectState::at_rest(STILL), 5);
        damage(&mut frame);
        match connection.ask(&Request::ContactFrame(Box::new(frame))) {
            Ok(Reply::ContactAnswer(answer)) => {
                let u = answer.answer.displacements.into_f64();
                assert!(u.iter().flatten().all(|u| u.is_finite()), "damage {which}");
            }
            Err(glove_client::ask::connection::LinkError::Rejected(_)) => {}
            other => panic!("damage {which}: {other:?}"),
        }
    }
    advance(&mut connection, scene.frame(ObjectState::at_rest(STILL), 0));
}

#[test]
fn fields_of_contact_frames_are_those_of_their_forces_and_change_nothing() {
    let fields: FieldSet = Field::ALL.into_iter().collect();
    for deformation in [None, Some(Deformation::Large)] {
        let mut first: Option<Vec<String>> = None;
        for threads in [1, 3] {
            let server = server(threads);
            let plain = played_by(&server, 12, deformation);
            let found = played_with(&server, 12, deformation, fields);
            for (plain, found) in plain.iter().zip(&found) {
                assert!(plain.answer.fields.is_empty());
                assert_eq!(plain.answer.displacements, found.answer.displacements);
                assert_eq!(plain.state, found.state);
                check_fields(found);
            }
            let found: Vec<String> = found.into_iter().map(bits).collect();
            match &first {
                None => first = Some(found),
                Some(first) => assert!(*first == found, "{threads} threads"),
            }
        }
    }
}

/// Checks that forces at nodes add up to those of the bodies, and that pressure is only where they are.
fn check_fields(step: &ContactAnswer) {
    let [fields] = &step.answer.fields[..] else { panic!("{} fields", step.answer.fields.len()) };
    let [_, _, _, w, x, y, z] = step.state.pose;
    let turn = nalgebra::UnitQuaternion::new_normalize(nalgebra::Quaternion::new(w, x, y, z));
    let forces = fields.get(Field::ContactForce).unwrap().as_chunks::<3>().0;
    let sum: nalgebra::Vector3<f64> = forces.iter().map(|f| nalgebra::Vector3::from(*f)).sum();
    let of_bodies: nalgebra::Vector3<f64> =
        step.loads.iter().map(|load| nalgebra::Vector3::from(load.force)).sum();
    let most = step.loads.iter().map(|load| load.normal_force).sum::<f64>();
    assert!((turn * sum - of_bodies).norm() <= 1e-9 * most, "{sum} for {of_bodies}");
    let pressure = fields.get(Field::ContactPressure).unwrap();
    let touched = |force: &[f64; 3]| force.iter().any(|f| *f != 0.0);
    assert!(forces.iter().zip(pressure).all(|(force, p)| touched(force) == (*p != 0.0)));
    assert!(most == 0.0 || pressure.iter().any(|p| *p > 0.0));
    assert!(fields.energy >= 0.0 && (most == 0.0 || fields.energy > 0.0));
    let energies: f64 = fields.get(Field::ElementEnergy).unwrap().iter().sum();
    assert!((energies - fields.energy).abs() <= 1e-12 * fields.energy);
}
