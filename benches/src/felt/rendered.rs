//! The forces that a hand feels of answers that come late, unevenly, or never: energy and error.

use nalgebra::{Isometry3, Point3, Vector3};
use softgrasp_force::rendering::Moment;
use softgrasp_force::safeguard::RISE_SECONDS;
use softgrasp_force::{DeviceLimits, LocalModel, Rendering, SmallSystem};

use super::served::{STEP_TICKS, ServedPath, ServedStep};
use crate::random::Random;

/// How answers are rendered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum How {
    /// The force of the newest answer, held.
    Server,
    /// The force of the newest answer and the spring of the coupling from there.
    Coupling,
    /// The contact problem of the small system, without the controller of passivity.
    Model,
    /// All of what a run renders.
    Whole,
}

impl How {
    pub const ALL: [Self; 4] = [Self::Server, Self::Coupling, Self::Model, Self::Whole];

    pub const fn name(self) -> &'static str {
        match self {
            Self::Server => "server's force",
            Self::Coupling => "coupling",
            Self::Model => "local model",
            Self::Whole => "local model, passivity",
        }
    }
}

/// How answers come.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Wire {
    /// Time from the hand to the answer, ms.
    pub delay_ms: usize,
    /// Most that an answer is later than that, ms.
    pub jitter_ms: usize,
    /// Share of the answers that never come.
    pub loss: f64,
}

/// What a hand has felt.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Felt {
    /// Energy that the hand has given on the whole path, J; negative where it was given some.
    pub given: f64,
    /// Most energy that was created beyond what the device's damping took, J.
    pub created: f64,
    /// Root of the mean square of the force's error, N, and the largest.
    pub error_rms: f64,
    pub error_max: f64,
    /// Root of the mean square of the server's force, N.
    pub force_rms: f64,
}

/// The renderer of one way.
enum Renderer {
    Held { force: Vector3<f64>, at: Vector3<f64>, stiffness: f64 },
    Model(Box<LocalModel>, f64),
    Whole(Box<Rendering>, f64),
}

impl Renderer {
    fn new(how: How, limits: DeviceLimits) -> Self {
        let (zero, stiffness) = (Vector3::zeros(), limits.stiffness_max());
        match how {
            How::Server => Self::Held { force: zero, at: zero, stiffness: 0.0 },
            How::Coupling => Self::Held { force: zero, at: zero, stiffness },
            How::Model => {
                Self::Model(Box::new(LocalModel::new(SmallSystem::empty(), stiffness)), stiffness)
            }
            How::Whole => Self::Whole(Box::new(Rendering::new(limits)), 0.0),
        }
    }

    fn take(&mut self, step: &ServedStep, place: &Vector3<f64>, now_s: f64) {
        match self {
            Self::Held { force, at, .. } => (*force, *at) = (-step.force, *place),
            Self::Model(model, stiffness) => {
                **model = LocalModel::new(step.system.clone(), *stiffness);
            }
            Self::Whole(rendering, answer_s) => {
                rendering.take(step.system.clone());
                *answer_s = now_s;
            }
        }
    }

    /// Force on a hand at a place, N.
    fn force(&mut self, place: &Vector3<f64>, now_s: f64) -> Vector3<f64> {
        let pose = Isometry3::from_parts((*place).into(), Default::default());
        match self {
            Self::Held { force, .. } if force.norm() == 0.0 => Vector3::zeros(),
            Self::Held { force, at, stiffness } => *force + *stiffness * (*at - place),
            Self::Model(model, _) => {
                let contacts = model.system().contacts();
                let places: Vec<Point3<f64>> = contacts
                    .iter()
                    .map(|c| if c.port.is_some() { c.place_at(&pose) } else { c.place })
                    .collect();
                let is_felt: Vec<bool> = contacts.iter().map(|c| c.port.is_some()).collect();
                let found = model.forces_at(&places);
                let felt = found.forces.iter().zip(is_felt).filter(|(_, is_felt)| *is_felt);
                -felt.map(|(force, _)| force).sum::<Vector3<f64>>()
            }
            Self::Whole(rendering, answer_s) => {
                let bodies = [Isometry3::identity(), pose];
                let moment = Moment {
                    now_s,
                    answer_s: Some(*answer_s),
                    // The table's contacts stay where they are in any case.
                    world_from_bodies: &bodies[..],
                    hand_s: now_s,
                    device: Some(*place),
                    fault: None,
                };
                rendering.tick(&moment).forces[0]
            }
        }
    }
}

/// Plays a path of the hand against answers that come by a wire.
///
/// A step is asked for when the one before has come, as in a run. The forces have risen before the path
/// begins. The error of a force is its difference from what the server answers, later, to the hand of that
/// moment.
pub(super) fn feel(path: &ServedPath, how: How, wire: Wire, limits: DeviceLimits) -> Felt {
    let mut random = Random(7 + wire.delay_ms as u64 + 1000 * wire.jitter_ms as u64);
    let mut renderer = Renderer::new(how, limits);
    let mut under_way: Option<(usize, usize, bool)> = None;
    let mut felt = Felt::default();
    let (mut balance, mut held, mut measured) = (0.0, Vector3::zeros(), 0usize);
    let rest = 1000 * RISE_SECONDS as usize + 10;
    for tick in 0..rest {
        renderer.force(&path.places[0], 1e-3 * tick as f64);
    }
    for (tick, place) in path.places.iter().enumerate() {
        let now_s = 1e-3 * (rest + tick) as f64;
        if tick > 0 {
            let way = place - path.places[tick - 1];
            let work = -held.dot(&way);
            felt.given += work;
            balance += work + limits.damping * way.norm_squared() / limits.period;
            felt.created = felt.created.max(-balance);
        }
        if let Some((due, step, is_lost)) = under_way
            && due <= tick
        {
            if !is_lost {
                let step = &path.steps[step];
                renderer.take(step, &path.places[step.tick], now_s);
            }
            under_way = None;
        }
        if tick.is_multiple_of(STEP_TICKS) && under_way.is_none() {
            let late = (random.share() * (wire.jitter_ms + 1) as f64) as usize;
            let is_lost = random.share() < wire.loss;
            let due = tick + wire.delay_ms + late;
            under_way = Some((due, tick / STEP_TICKS, is_lost));
        }
        held = renderer.force(place, now_s);
        if tick.is_multiple_of(STEP_TICKS)
            && let Some(step) = path.steps.get(tick / STEP_TICKS)
        {
            let error = (held + step.force).norm();
            felt.error_rms += error * error;
            felt.error_max = felt.error_max.max(error);
            felt.force_rms += step.force.norm_squared();
            measured += 1;
        }
    }
    let count = measured.max(1) as f64;
    felt.error_rms = (felt.error_rms / count).sqrt();
    felt.force_rms = (felt.force_rms / count).sqrt();
    felt
}
