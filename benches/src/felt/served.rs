//! A soft ball that one finger presses on a closed path, and the answers of a server to it.

use nalgebra::{Isometry3, Vector3};
use softgrasp_core::dynamics::{MovingBody, ObjectState, StepSettings};
use softgrasp_core::rigid_body::RigidShape;
use softgrasp_force::{SmallContact, SmallSystem};

use crate::ball::{Ball, SIZE, as_a_run};
use crate::report::ReportError;

/// Radius of the fingertip, m, and the coefficient of friction.
const TIP: f64 = 0.008;
const FRICTION: f64 = 0.8;
/// How far the finger begins above the ball, and how deep and how far aside it goes, m.
const ABOVE: f64 = 0.001;
const DEPTH: f64 = 0.007;
const ASIDE: f64 = 0.002;
/// Ticks of a millisecond from step to step.
pub(super) const STEP_TICKS: usize = 16;
/// Steps in which the ball settles on the table before the path begins.
const SETTLE: usize = 30;

/// One answer of a server: what was asked and what came.
#[derive(Clone, Debug)]
pub(super) struct ServedStep {
    /// Tick at which the hand was where the step ended.
    pub tick: usize,
    /// The small system of the step.
    pub system: SmallSystem,
    /// Force of the finger on the ball, N.
    pub force: Vector3<f64>,
}

/// A path of the finger, a place for each millisecond, and the answers along it.
pub(super) struct ServedPath {
    /// Place of the finger at each tick, m.
    pub places: Vec<Vector3<f64>>,
    /// Answers, one for every sixteen ticks.
    pub steps: Vec<ServedStep>,
}

/// The ball under the finger.
pub(super) struct Served(Ball);

impl Served {
    pub fn try_new(nodes: usize) -> Result<Self, ReportError> {
        Ok(Self(Ball::try_new(nodes)?))
    }

    /// Number of nodes.
    pub fn node_count(&self) -> usize {
        self.0.node_count()
    }

    /// Plays cycles of a frequency with a finger of a compliance (m/N).
    pub fn play(
        &self,
        frequency: f64,
        cycles: usize,
        compliance: f64,
    ) -> Result<ServedPath, ReportError> {
        let per_cycle = (1e3 / frequency).round() as usize;
        let ticks = cycles * per_cycle;
        let places: Vec<Vector3<f64>> = (0..=ticks).map(|k| place(k, per_cycle)).collect();
        let mut state = ObjectState::at_rest(Isometry3::identity());
        for _ in 0..SETTLE {
            state = self.step(&state, (&places[0], &places[0]), compliance)?.0;
        }
        let mut steps = Vec::with_capacity(ticks / STEP_TICKS + 1);
        let mut before = places[0];
        for tick in (0..=ticks).step_by(STEP_TICKS) {
            let (next, served) = self.step(&state, (&before, &places[tick]), compliance)?;
            let force = served.contacts().iter().filter(|c| c.port.is_some()).map(|c| c.force);
            let force = force.sum();
            steps.push(ServedStep { tick, system: served, force });
            (state, before) = (next, places[tick]);
        }
        Ok(ServedPath { places, steps })
    }

    /// One step of the ball while the finger goes from one place to another.
    fn step(
        &self,
        state: &ObjectState,
        (from, to): (&Vector3<f64>, &Vector3<f64>),
        compliance: f64,
    ) -> Result<(ObjectState, SmallSystem), ReportError> {
        let bodies = bodies(from, to, compliance);
        let seconds = 1e-3 * STEP_TICKS as f64;
        let settings = StepSettings { small_system: true, ..as_a_run(seconds, 1e-6) };
        let found = self.0.with_step(state, &bodies, settings, |step| step.advance(state, &[]))?;
        let none = || ReportError::Failed { rows: vec!["a step without its small system".into()] };
        let system = found.small_system.as_ref().ok_or_else(none)?;
        let contact = |contact: &softgrasp_core::dynamics::BodyContact| {
            let pose = &bodies[usize::from(contact.body)].world_from_body_end;
            SmallContact {
                body: u32::from(contact.body),
                port: (contact.body == 1).then_some(0),
                place_in_body: pose.inverse_transform_point(&contact.place),
                place: contact.place,
                normal: contact.normal,
                force: contact.force,
                friction: contact.friction,
            }
        };
        let contacts = system.contacts.iter().map(contact).collect();
        let made = SmallSystem::try_new(contacts, system.compliance.clone());
        let made = made.map_err(|error| ReportError::Failed { rows: vec![error.to_string()] })?;
        Ok((found.state, made))
    }
}

/// The table and the finger.
fn bodies(from: &Vector3<f64>, to: &Vector3<f64>, compliance: f64) -> [MovingBody; 2] {
    let at = |place: &Vector3<f64>| Isometry3::from_parts((*place).into(), Default::default());
    [
        MovingBody::resting(
            RigidShape::Plane { normal: Vector3::y_axis() },
            Isometry3::translation(0.0, -0.5 * SIZE, 0.0),
            FRICTION,
        ),
        MovingBody {
            shape: RigidShape::Sphere { radius: TIP },
            world_from_body_start: at(from),
            world_from_body_end: at(to),
            friction: FRICTION,
            compliance,
        },
    ]
}

/// Place of the finger: down into the ball and a little aside, and back.
fn place(tick: usize, per_cycle: usize) -> Vector3<f64> {
    let angle = std::f64::consts::TAU * tick as f64 / per_cycle as f64;
    let down = 0.5 * (ABOVE + DEPTH) * (1.0 - angle.cos());
    Vector3::new(ASIDE * angle.sin(), 0.5 * SIZE + TIP + ABOVE - down, 0.0)
}
