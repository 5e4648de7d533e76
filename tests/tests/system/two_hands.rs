//! A left and a right hand act on one object at once: lift it between their palms, pass it over, pull it.

use fea_server::RunningServer;
use glove_client::ask::link::Link;
use glove_client::ask::solve_settings::SolveSettings;
use glove_client::pace::Pace;
use glove_client::pace::tick_budget::Priority;
use glove_client::run::contact_grasp::ContactScene;
use glove_client::run::grasp_loop::GraspLoop;
use glove_client::run::tick_outcome::TickOutcome;
use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};
use softgrasp_core::mesh::{BuiltIn, TetMesh};
use softgrasp_grasp::grasp::{Grasp, StateName};
use softgrasp_grasp::hand::{HandDimensions, Handedness, JointAngles};
use softgrasp_grasp::object::{ContactModel, SoftObject};
use softgrasp_hand::hand_reader::HandReader;
use softgrasp_hand::hand_readers::HandReaders;
use softgrasp_hand::hand_setup::HandSetup;
use softgrasp_hand::joints::record_of_hand;
use softgrasp_hand::sent::{Arrival, Device, Sent, WhichHand};

use crate::lift::{Lift, object};
use crate::settings::{linear_settings, sized};
use crate::start::server;

/// Posture and palm of a hand in the world.
#[derive(Clone, Copy)]
struct Held {
    angles: JointAngles,
    world_from_palm: Isometry3<f64>,
}

impl Held {
    fn moved(&self, way: Vector3<f64>) -> Self {
        let world_from_palm = Translation3::from(way) * self.world_from_palm;
        Self { world_from_palm, ..*self }
    }

    /// The hand opened by a share, from 0 to 1.
    fn opened(&self, share: f64) -> Self {
        Self { angles: self.angles.lerp(&JointAngles::flat(), share), ..*self }
    }

    /// The mirror image across the plane x = 0 of the world: a hand of the other side.
    fn mirrored(&self) -> Self {
        Self { world_from_palm: mirrored(&self.world_from_palm), ..*self }
    }
}

/// Mirror image of a pose across the plane x = 0, of a frame that is mirrored across its own.
fn mirrored(pose: &Isometry3<f64>) -> Isometry3<f64> {
    let across = Matrix3::from_diagonal(&Vector3::new(-1.0, 1.0, 1.0));
    let turn = across * pose.rotation.to_rotation_matrix().matrix() * across;
    let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(turn));
    Isometry3::from_parts(Translation3::from(across * pose.translation.vector), turn)
}

/// The mirror image of a mesh across the plane x = 0, with the numbers of its nodes.
fn mirrored_mesh(mesh: &TetMesh) -> TetMesh {
    let vertices = mesh.vertices().iter().map(|p| Point3::new(-p.x, p.y, p.z)).collect();
    let tets = mesh.tets().iter().map(|[a, b, c, d]| [*a, *c, *b, *d]).collect();
    TetMesh::try_new(vertices, tets, mesh.regions().to_vec()).unwrap()
}

/// Gentle way from 0 to 1, between two ticks.
fn share(tick: u64, from: u64, to: u64) -> f64 {
    let t = (tick.saturating_sub(from) as f64 / (to - from) as f64).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Run in lockstep whose hands come as joints, in one stream.
struct Hands {
    grasp_loop: GraspLoop,
    tick: u64,
    _server: RunningServer,
}

impl Hands {
    fn around(mesh: TetMesh, scene: ContactScene) -> Self {
        let server = server(1);
        let object = SoftObject::try_new(mesh).unwrap();
        let settings = SolveSettings { contact: ContactModel::Friction, ..linear_settings() };
        let grasp = Grasp::try_new(Isometry3::identity(), Grasp::RELEASE_MARGIN_M).unwrap();
        let link = Link::start(server.address().to_string(), Priority::Ordinary).unwrap();
        let table_y = Some(object.rest_shape().bottom());
        let reader = || HandReader::of_devices(HandSetup::default(), Some(Isometry3::identity()));
        let readers = HandReaders::of_stream(reader(), reader());
        let mut grasp_loop =
            GraspLoop::try_new(readers, object, grasp, link, settings, Pace::Lockstep).unwrap();
        grasp_loop.grasp_with_friction(ContactScene { table_y, ..scene });
        Self { grasp_loop, tick: 0, _server: server }
    }

    /// Plays a tick in which these hands are seen; one that is `None` is out of sight.
    fn see(&mut self, right: Option<Held>, left: Option<Held>) -> TickOutcome {
        let sides = [(right, Handedness::Right), (left, Handedness::Left)];
        let arrival = |(held, side): (Option<Held>, Handedness)| {
            let Held { angles, world_from_palm } = held?;
            let hand = HandDimensions::default().with_handedness(side);
            let line = record_of_hand(&hand, &angles, &world_from_palm).to_line();
            let arrival = Arrival::with_tick(Device::Joints, line.into_bytes());
            Some(Arrival { is_datagram: true, ..arrival })
        };
        let arrivals = sides.into_iter().filter_map(arrival).collect();
        let sent = Sent { arrivals, ..Sent::default() };
        let outcome = self.grasp_loop.tick(self.tick, self.tick as f64 / 60.0, &sent).unwrap();
        self.tick += 1;
        outcome
    }

    fn place(&self) -> Vector3<f64> {
        self.grasp_loop.world_from_object().translation.vector
    }

    /// Force of all fingers of a hand on the object, N; that of the palm is not among them.
    fn force(&self, which: WhichHand) -> f64 {
        let contact = self.grasp_loop.contact_grasp().unwrap();
        contact.hand(which).finger_forces().iter().map(Vector3::norm).sum()
    }

    /// Longest extent of the shown shape along x of the object, m.
    fn extent_x(&self) -> f64 {
        let xs = || self.grasp_loop.object().shape().iter().map(|p| p.x);
        xs().fold(f64::MIN, f64::max) - xs().fold(f64::MAX, f64::min)
    }
}

/// Flat right hand, upright beside an object at the origin, its palm toward the object; `x` is the place of
/// the middle of the hand's thickness.
fn flat_hand(x: f64, y: f64) -> Held {
    // Fingers forward, out of the palm to the left, thumb up.
    let columns = Matrix3::from_columns(&[-Vector3::y(), -Vector3::z(), Vector3::x()]);
    let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(columns));
    let place = Translation3::new(x, y, 0.085);
    Held { angles: JointAngles::flat(), world_from_palm: Isometry3::from_parts(place, turn) }
}

/// Edge of the cube, m, and half the thickness of a hand beside the knuckles, m.
const EDGE_M: f64 = 0.06;
const HALF_HAND_M: f64 = 0.011;
/// Distance by which each palm presses into the cube, m.
const PRESS_M: f64 = 0.008;

/// Hands that press a cube between their palms, raised by `height`, m, and `apart` from it.
fn palms(apart: f64, height: f64) -> Held {
    // The little finger stays above the table.
    flat_hand(0.5 * EDGE_M + HALF_HAND_M - PRESS_M + apart, 0.035 + height)
}

fn cube() -> TetMesh {
    sized(BuiltIn::Cube, 343, EDGE_M)
}

/// Lets two palms lift the cube; returns the run, in whose last tick they hold it still.
fn lifted_between_palms() -> Hands {
    let mut hands = Hands::around(cube(), ContactScene::default());
    for tick in 0..240 {
        let right = palms(0.05 * (1.0 - share(tick, 40, 100)), 0.06 * share(tick, 110, 190));
        hands.see(Some(right), Some(right.mirrored()));
    }
    hands
}

#[test]
fn two_palms_lift_a_cube_that_falls_when_one_of_them_lets_go() {
    let mut hands = lifted_between_palms();
    let height = hands.place().y;
    assert!((height - 0.06).abs() < 5e-3, "lifted by {height} m");
    assert!(hands.place().x.abs() < 2e-3, "it stays in the middle: {}", hands.place());
    let contact = hands.grasp_loop.contact_grasp().unwrap();
    assert_eq!(contact.table_force().norm(), 0.0, "the table carries nothing");
    let record = contact.record(0, 0.0);
    let second = record.second_hand.unwrap();
    let of_first = record.palm_force_n + record.finger_force_n.iter().sum::<f64>();
    let of_second = second.palm_force_n + second.finger_force_n.iter().sum::<f64>();
    assert!(of_first > 0.8 && (of_first / of_second - 1.0).abs() < 0.25, "{of_first}, {of_second}");
    // Each hand is shown where the cube lets it be.
    for which in WhichHand::ALL {
        assert!(hands.grasp_loop.shown_hand(which).is_some());
        assert!(contact.hand(which).is_touching());
    }
    for tick in 0..60 {
        let right = palms(0.05 * share(tick, 0, 30), 0.06);
        hands.see(Some(right), Some(palms(0.0, 0.06).mirrored()));
    }
    assert!(hands.place().y < 0.02, "it fell: {}", hands.place());
}

#[test]
fn hand_out_of_sight_is_held_where_it_was_and_the_other_goes_on() {
    let mut hands = lifted_between_palms();
    let held = palms(0.0, 0.06);
    let mut said = Vec::new();
    let mut hear = |outcome: &TickOutcome| {
        said.extend(outcome.events.iter().map(|event| event.kind_and_words().1));
    };
    for _ in 0..60 {
        hear(&hands.see(Some(held), None));
    }
    let silent = "the left hand's sender of joints is silent: the hand is held where it was";
    assert_eq!(said.iter().filter(|words| *words == silent).count(), 1, "{said:?}");
    assert!(!said.iter().any(|words| words.contains("right hand's")), "{said:?}");
    assert!((hands.place().y - 0.06).abs() < 5e-3, "it is still held: {}", hands.place());
    // The hand that is seen is followed: it lets go.
    for tick in 0..60 {
        hands.see(Some(palms(0.05 * share(tick, 0, 30), 0.06)), None);
    }
    assert!(hands.place().y < 0.02, "it fell: {}", hands.place());
    let outcome = hands.see(None, Some(held.mirrored()));
    let back = outcome.events.iter().map(|event| event.kind_and_words().1);
    let back: Vec<String> = back.filter(|words| words.contains("speaks again")).collect();
    assert_eq!(back, ["the left hand's sender of joints speaks again"]);
}

/// Way of a scripted right hand that has lifted an object, tick by tick.
struct Lifted {
    way: Vec<Held>,
    /// Number of ticks before the object left the table.
    gripped: usize,
    world_from_object: Isometry3<f64>,
}

fn scripted_lift(mesh: TetMesh) -> Lifted {
    let mut lift = Lift::of(mesh, ContactScene::default());
    let (mut way, mut gripped) = (Vec::new(), 0);
    loop {
        let world_from_object = *lift.grasp_loop.world_from_object();
        if world_from_object.translation.y > 0.05 {
            return Lifted { way, gripped, world_from_object };
        }
        assert!(lift.tick().is_some(), "never lifted");
        let now_s = lift.tick as f64 / 60.0;
        let (angles, world_from_palm) = lift.grasp_loop.reader().measured(now_s).unwrap();
        way.push(Held { angles, world_from_palm });
        if world_from_object.translation.y < 1e-3 {
            gripped = way.len();
        }
    }
}

#[test]
fn ball_is_passed_from_the_right_hand_to_the_left_and_follows_it() {
    let ball = object(BuiltIn::Sphere, 300, 0.06);
    let Lifted { way, gripped, .. } = scripted_lift(ball.clone());
    let (far, held) = (way[0], way[way.len() - 1]);
    let palm = |held: &Held| held.world_from_palm.translation.vector;
    let raised = palm(&held) - palm(&way[gripped - 1]);
    let mut hands = Hands::around(ball, ContactScene::default());
    // The right hand grips, lifts and holds still.
    let rest = |held: Held| std::iter::repeat_n(held, 20);
    for right in way.iter().copied().chain(rest(held)) {
        hands.see(Some(right), Some(far.mirrored()));
    }
    let place = hands.place();
    let force = hands.force(WhichHand::First);
    assert!(place.y > 0.04 && force > 0.3, "in the right hand at {place}, {force} N");
    // The left one grips the ball as the right one did, from the other side.
    let left_way: Vec<Held> =
        way[..gripped].iter().map(|right| right.mirrored().moved(place)).collect();
    let left_held = left_way[gripped - 1];
    for left in left_way.into_iter().chain(rest(left_held)) {
        hands.see(Some(held), Some(left));
    }
    let in_both = WhichHand::ALL.map(|which| hands.force(which));
    assert!(in_both.iter().all(|force| *force > 0.2), "in both hands: {in_both:?} N");
    // The right hand opens and goes back the way it came.
    for right in way[..gripped].iter().rev() {
        hands.see(Some(right.moved(raised)), Some(left_held));
    }
    let forces = WhichHand::ALL.map(|which| hands.force(which));
    assert!(forces[0] == 0.0 && forces[1] > 0.2, "in the left hand: {forces:?} N");
    let taken = hands.place();
    assert!((taken - place).norm() < 0.01, "it stays in the air: {taken} after {place}");
    for tick in 0..100 {
        let aside = Vector3::new(-0.08 * share(tick, 0, 80), 0.0, 0.0);
        hands.see(Some(far.moved(raised)), Some(left_held.moved(aside)));
    }
    let off = hands.place() - taken - Vector3::new(-0.08, 0.0, 0.0);
    assert!(off.norm() < 5e-3, "it went with the left hand, but for {off}");
}

#[test]
fn bar_that_both_hands_pull_grows_longer_and_springs_back() {
    const PIECE_M: f64 = 0.03;
    const LENGTH_M: f64 = 0.18;
    let piece = object(BuiltIn::Cube, 64, PIECE_M);
    let Lifted { way, world_from_object, .. } = scripted_lift(piece);
    let home = way[way.len() - 1].moved(-world_from_object.translation.vector);
    // Fingers and thumb close across the bar.
    let cube = sized(BuiltIn::Cube, 1000, PIECE_M);
    let along = cube.vertices().iter().map(|p| Point3::new(p.x * LENGTH_M / PIECE_M, p.y, p.z));
    let bar = cube.with_vertices(along.collect()).unwrap();
    let right_home = home.moved(Vector3::new(0.06, 0.0, 0.0));
    let mut hands = Hands::around(bar, ContactScene::default());
    let mut lengths = Vec::new();
    for tick in 0..300 {
        let pull = 0.004 * (share(tick, 130, 190) - share(tick, 220, 280));
        let right =
            right_home.opened(1.0 - share(tick, 40, 110)).moved(Vector3::new(pull, 0.0, 0.0));
        hands.see(Some(right), Some(right.mirrored()));
        lengths.push(hands.extent_x());
    }
    let (before, pulled, after) = (lengths[125], lengths[215], lengths[295]);
    assert!(hands.force(WhichHand::First) > 0.3 && hands.force(WhichHand::Second) > 0.3);
    assert!(pulled - before > 2e-3, "pulled from {before} to {pulled} m");
    assert!((after - before).abs() < 0.25 * (pulled - before), "back at {after} m of {before} m");
}

/// A right hand pushes a cube over the table, and the left one its mirror image: every number of one is the
/// mirror image of the other's, up to the tolerance of the contact.
#[test]
fn left_hand_does_with_a_mirrored_object_what_the_right_one_does_with_the_object() {
    let push = |mesh: TetMesh, is_left: bool| {
        let mut hands = Hands::around(mesh, ContactScene::default());
        let mut states = Vec::new();
        for tick in 0..160 {
            let right = palms(0.05 * (1.0 - share(tick, 30, 140)) - 0.01, 0.0);
            let outcome = match is_left {
                false => hands.see(Some(right), None),
                true => hands.see(None, Some(right.mirrored())),
            };
            states.push(outcome.state);
        }
        (hands, states)
    };
    let (right, states) = push(cube(), false);
    let (left, other_states) = push(mirrored_mesh(&cube()), true);
    assert_eq!(states, other_states);
    assert!(states.contains(&Some(StateName::Deforming)), "it is touched");
    assert_eq!(left.grasp_loop.reader().side(), Some(Handedness::Left));
    let (a, b) = (right.grasp_loop.world_from_object(), left.grasp_loop.world_from_object());
    assert!(a.translation.x < -2e-3, "pushed to {}", a.translation.x);
    let off = mirrored(a).inverse() * b;
    assert!(off.translation.vector.norm() < 1e-6, "{} m off", off.translation.vector.norm());
    assert!(off.rotation.angle() < 1e-5, "{} rad off", off.rotation.angle());
    let shapes = right.grasp_loop.object().displacement().iter();
    for (u, v) in shapes.zip(left.grasp_loop.object().displacement()) {
        let off = Vector3::new(u[0] + v[0], u[1] - v[1], u[2] - v[2]);
        assert!(off.norm() < 1e-6, "{u:?} and {v:?}");
    }
}

/// The second hand keeps the bits of a run of the first alone as long as it does not come.
#[test]
fn reader_of_a_second_hand_that_never_comes_changes_no_bit() {
    let run = |readers: HandReaders| {
        let server = server(1);
        let object = SoftObject::try_new(cube()).unwrap();
        let table_y = Some(object.rest_shape().bottom());
        let settings = SolveSettings { contact: ContactModel::Friction, ..linear_settings() };
        let grasp = Grasp::try_new(Isometry3::identity(), Grasp::RELEASE_MARGIN_M).unwrap();
        let link = Link::start(server.address().to_string(), Priority::Ordinary).unwrap();
        let grasp_loop = GraspLoop::try_new(readers, object, grasp, link, settings, Pace::Lockstep);
        let mut grasp_loop = grasp_loop.unwrap();
        grasp_loop.grasp_with_friction(ContactScene { table_y, ..ContactScene::default() });
        let mut hands = Hands { grasp_loop, tick: 0, _server: server };
        for tick in 0..120 {
            hands.see(Some(palms(0.05 * (1.0 - share(tick, 10, 100)) - 0.01, 0.0)), None);
        }
        let pose = *hands.grasp_loop.world_from_object();
        (pose, hands.grasp_loop.object().displacement().to_vec())
    };
    let reader = || HandReader::of_devices(HandSetup::default(), Some(Isometry3::identity()));
    let alone = run(reader().into());
    assert!(alone.0.translation.x < -1e-3, "pushed to {}", alone.0.translation.x);
    assert_eq!(alone, run(HandReaders::of_stream(reader(), reader())));
    assert_eq!(alone, run(HandReaders::of_two(reader(), reader())));
}
