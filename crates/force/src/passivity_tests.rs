//! Passivity of what is rendered: hands on closed paths, from slow to as fast as the ticks see, get no
//! energy, however late the answers come and however many are lost.

use nalgebra::{DMatrix, Isometry3, Matrix3, Point3, Vector3};

use crate::limits::DeviceLimits;
use crate::rendering::{Moment, Rendering};
use crate::safeguard::RISE_SECONDS;
use crate::{LocalModel, SmallContact, SmallSystem};

/// Energy that rounding may create, J.
const ROUNDING: f64 = 1e-9;
/// Frequencies of the paths, Hz; the last is Nyquist's.
const FREQUENCIES: [f64; 9] = [0.5, 1.0, 2.0, 5.0, 12.0, 33.0, 90.0, 240.0, 500.0];
/// Time from answer to answer, in ticks.
const ANSWER_EVERY: usize = 16;

/// An object that a server answers for: three springs of different stiffness, with friction.
struct Served {
    truth: LocalModel,
    compliance: DMatrix<f64>,
    friction: f64,
}

impl Served {
    /// The contact begins at the origin; the object is below.
    fn new(stiffness: [f64; 3], friction: f64) -> Self {
        let turn = nalgebra::Rotation3::from_euler_angles(0.3, -0.2, 0.5).into_inner();
        let springs = Matrix3::from_diagonal(&Vector3::from(stiffness.map(f64::recip)));
        let compliance = turn * springs * turn.transpose();
        let compliance = DMatrix::from_fn(3, 3, |r, c| compliance[(r, c)]);
        let light = contact(Point3::origin(), -Vector3::z() * 1e-9, friction);
        let system = SmallSystem::try_new(vec![light], compliance.clone()).unwrap();
        Self { truth: LocalModel::new(system, f64::INFINITY), compliance, friction }
    }

    /// Direction of the largest stiffness, away from the object.
    fn top(&self) -> Vector3<f64> {
        let eigen = self.compliance.clone().symmetric_eigen();
        let least = eigen.eigenvalues.imin();
        let top = Vector3::from_iterator(eigen.eigenvectors.column(least).iter().copied());
        if top.z > 0.0 { top } else { -top }
    }

    /// The answer to a hand at a place.
    fn answer(&mut self, place: &Vector3<f64>) -> SmallSystem {
        let force = self.truth.forces_at(&[Point3::from(*place)]).forces[0];
        if force.norm() == 0.0 {
            return SmallSystem::empty();
        }
        let pressing = contact(Point3::from(*place), force, self.friction);
        SmallSystem::try_new(vec![pressing], self.compliance.clone()).unwrap()
    }
}

fn contact(place: Point3<f64>, force: Vector3<f64>, friction: f64) -> SmallContact {
    SmallContact {
        body: 0,
        port: Some(0),
        place_in_body: Point3::origin(),
        place,
        normal: -Vector3::z(),
        force,
        friction,
    }
}

/// How answers come: so many ticks late, and one in so many is lost; 0 for none.
#[derive(Clone, Copy, Debug)]
struct Way {
    delay_ticks: usize,
    lost_one_in: usize,
}

const WAYS: [Way; 6] = [
    Way { delay_ticks: 0, lost_one_in: 0 },
    Way { delay_ticks: 1, lost_one_in: 0 },
    Way { delay_ticks: 10, lost_one_in: 100 },
    Way { delay_ticks: 20, lost_one_in: 20 },
    Way { delay_ticks: 50, lost_one_in: 0 },
    Way { delay_ticks: 50, lost_one_in: 20 },
];

/// A closed path from rest: into the object and back, at a frequency, along a direction.
fn path(frequency: f64, amplitude: f64, direction: Vector3<f64>) -> Vec<Vector3<f64>> {
    let per_cycle = (1e3 / frequency).round() as usize;
    let cycles = (2000 / per_cycle).max(2);
    (0..=cycles * per_cycle)
        .map(|k| {
            let angle = std::f64::consts::TAU * k as f64 / per_cycle as f64;
            direction * (amplitude * 0.5 * (angle.cos() - 1.0))
        })
        .collect()
}

/// What a renderer makes of the newest answer and the place of the hand.
trait Render {
    fn take(&mut self, system: SmallSystem, now_s: f64);
    /// Force on the hand, N.
    fn force(&mut self, place: &Vector3<f64>, now_s: f64) -> Vector3<f64>;
}

/// The local model and the coupling, without the controller of passivity.
struct ModelAlone {
    model: LocalModel,
    stiffness_max: f64,
}

impl Render for ModelAlone {
    fn take(&mut self, system: SmallSystem, _: f64) {
        self.model = LocalModel::new(system, self.stiffness_max);
    }

    fn force(&mut self, place: &Vector3<f64>, _: f64) -> Vector3<f64> {
        let found = self.model.forces_at(&[Point3::from(*place)]);
        -found.forces.iter().sum::<Vector3<f64>>()
    }
}

/// The force of the answer as it is.
struct ServerForce(Vector3<f64>);

impl Render for ServerForce {
    fn take(&mut self, system: SmallSystem, _: f64) {
        self.0 = -system.contacts().iter().map(|c| c.force).sum::<Vector3<f64>>();
    }

    fn force(&mut self, _: &Vector3<f64>, _: f64) -> Vector3<f64> {
        self.0
    }
}

/// The whole of what a run renders.
struct Whole {
    rendering: Rendering,
    answer_s: f64,
}

impl Render for Whole {
    fn take(&mut self, system: SmallSystem, now_s: f64) {
        self.rendering.take(system);
        self.answer_s = now_s;
    }

    fn force(&mut self, place: &Vector3<f64>, now_s: f64) -> Vector3<f64> {
        let pose = [Isometry3::from_parts((*place).into(), Default::default())];
        let moment = Moment {
            now_s,
            answer_s: Some(self.answer_s),
            world_from_bodies: &pose,
            hand_s: now_s,
            device: Some(*place),
            fault: None,
        };
        self.rendering.tick(&moment).forces[0]
    }
}

/// Energy that the hand gives on a path, damping included, and the least of it on the way, J.
fn energy(
    render: &mut impl Render,
    served: &mut Served,
    way: Way,
    damping: f64,
    path: &[Vector3<f64>],
) -> (f64, f64) {
    let rest = (1000.0 * RISE_SECONDS) as usize + 10;
    let at = |tick: usize| if tick < rest { path[0] } else { path[tick - rest] };
    let mut under_way: Vec<(usize, SmallSystem)> = Vec::new();
    let (mut balance, mut least, mut held, mut asked) = (0.0f64, 0.0f64, Vector3::zeros(), 0);
    for tick in 0..rest + path.len() {
        let (place, now_s) = (at(tick), tick as f64 * 1e-3);
        if tick > 0 {
            let moved: Vector3<f64> = place - at(tick - 1);
            balance += -held.dot(&moved) + damping * moved.norm_squared() / 1e-3;
            least = least.min(balance);
        }
        if tick % ANSWER_EVERY == 0 {
            asked += 1;
            if way.lost_one_in == 0 || asked % way.lost_one_in != 0 {
                under_way.push((tick + way.delay_ticks, served.answer(&place)));
            }
        }
        while under_way.first().is_some_and(|(due, _)| *due <= tick) {
            render.take(under_way.remove(0).1, now_s);
        }
        held = render.force(&place, now_s);
    }
    (balance, least)
}

/// Limits of a device that answers at once, so that positions and forces meet in time.
fn limits() -> DeviceLimits {
    DeviceLimits { delay: 0.0, ..DeviceLimits::desktop() }
}

#[test]
fn a_spring_creates_no_energy_on_any_closed_path_without_a_controller() {
    for stiffness in [[300.0, 500.0, 900.0], [800.0, 1200.0, 4000.0]] {
        for way in WAYS {
            for frequency in FREQUENCIES {
                // So much friction that everything sticks: the whole of K acts.
                let mut served = Served::new(stiffness, 10.0);
                for direction in [Vector3::z(), served.top()] {
                    let stiffness_max = limits().stiffness_max();
                    let model = LocalModel::new(SmallSystem::empty(), stiffness_max);
                    let mut render = ModelAlone { model, stiffness_max };
                    let path = path(frequency, 2e-3, direction);
                    // Contact that is met between two answers is met late: that part is the controller's.
                    let start = direction * -2e-3;
                    let inside: Vec<Vector3<f64>> = path.iter().map(|p| p + start).collect();
                    let damping = limits().damping;
                    let (balance, _) = energy(&mut render, &mut served, way, damping, &inside);
                    assert!(
                        balance >= -ROUNDING,
                        "{balance:e} J at {frequency} Hz, {way:?}, {stiffness:?}, {direction}"
                    );
                }
            }
        }
    }
}

#[test]
fn what_is_rendered_never_gives_more_than_its_reserve() {
    for (stiffness, friction) in [([300.0, 500.0, 900.0], 0.8), ([800.0, 1200.0, 4000.0], 0.3)] {
        for way in WAYS {
            for frequency in FREQUENCIES {
                let mut served = Served::new(stiffness, friction);
                let directions = [Vector3::z(), served.top(), Vector3::new(0.8, 0.0, 0.6)];
                for direction in directions {
                    let rendering = Rendering::new(limits());
                    let mut render = Whole { rendering, answer_s: 0.0 };
                    let path = path(frequency, 3e-3, direction);
                    let damping = limits().damping;
                    let (_, least) = energy(&mut render, &mut served, way, damping, &path);
                    let reserve = limits().reserve;
                    assert!(
                        least >= -reserve - ROUNDING,
                        "{least:e} J at {frequency} Hz, {way:?}, {stiffness:?}, {direction}"
                    );
                    let told = render.rendering.ledgers()[0].created();
                    assert!((told - (-least).max(0.0)).abs() < ROUNDING, "{told:e} {least:e}");
                }
            }
        }
    }
}

#[test]
fn the_force_of_a_late_server_creates_energy_so_that_these_tests_can_fail() {
    let way = Way { delay_ticks: 20, lost_one_in: 0 };
    let mut served = Served::new([300.0, 500.0, 900.0], 0.0);
    let path = path(5.0, 3e-3, Vector3::z());
    let inside: Vec<Vector3<f64>> = path.iter().map(|p| p - Vector3::z() * 3e-3).collect();
    let mut render = ServerForce(Vector3::zeros());
    let (balance, _) = energy(&mut render, &mut served, way, limits().damping, &inside);
    assert!(balance < -5e-3, "{balance}");
}

#[test]
fn a_slow_press_feels_the_whole_spring() {
    let way = Way { delay_ticks: 10, lost_one_in: 0 };
    let mut served = Served::new([200.0; 3], 0.5);
    let mut render = Whole { rendering: Rendering::new(limits()), answer_s: 0.0 };
    let mut path = path(0.5, 5e-3, Vector3::z());
    // Half a cycle: it ends where the hand is deepest.
    path.truncate(1001);
    energy(&mut render, &mut served, way, limits().damping, &path);
    let deepest = render.rendering.ledgers()[0].held();
    assert!((deepest - Vector3::z() * 1.0).norm() < 0.01, "{deepest}");
    assert!(render.rendering.guard().releases().is_empty());
}
