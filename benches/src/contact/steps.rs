//! Steps of an object that five fingers pinch, lift and hold by friction: time by phase, and the residual
//! of the law of contact.

use std::sync::Arc;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use softgrasp_core::dynamics::{
    Carried, LargeBody, LargeStep, MovingBody, ObjectState, StepOutcome,
};
use softgrasp_core::fem::hyperelastic::Law;
use softgrasp_core::rigid_body::RigidShape;

use crate::ball::{Ball, SIZE, as_a_run};
use crate::report::{ReportError, check, progress};
use crate::sample::timed_ms;
use crate::table::{Cell, Table};
use crate::tail::Tail;
use crate::threads::{pool, processors};

/// Radius of a fingertip, m, depth of its press, and height of the lift.
const TIP: f64 = 0.008;
const DEPTH: f64 = 0.008;
const LIFT: f64 = 0.04;
const FRICTION: f64 = 0.8;
/// Steps per second, as in a run.
const RATE_HZ: f64 = 60.0;
/// Steps of each phase: the ball settles, is pinched, lifted, and held.
const SETTLE: u32 = 30;
const PINCH: u32 = 60;
const RAISE: u32 = 60;
const HOLD: u32 = 300;
/// Largest relative difference between the sum of the forces on the held ball and its weight.
const BALANCE_ALLOWED: f64 = 1e-3;

/// The equations of a step, and the relative residual that is asked for.
#[derive(Clone, Copy, PartialEq)]
struct Way {
    is_large: bool,
    residual_rel: f64,
}

/// Ways of a step: as a run asks, with less accuracy, and at large deformation.
const WAYS: [Way; 4] = [
    Way { is_large: false, residual_rel: 1e-6 },
    Way { is_large: false, residual_rel: 1e-4 },
    Way { is_large: true, residual_rel: 1e-6 },
    Way { is_large: true, residual_rel: 1e-4 },
];
/// Number of nodes above which a step at large deformation takes seconds.
const LARGE_NODES_MAX: usize = 4000;

/// Times of the steps of a phase, and how well they met the law of contact.
#[derive(Default)]
struct Phase {
    times_ms: Vec<f64>,
    points_most: usize,
    converged: usize,
    penetration_max: f64,
    residual_rel_max: f64,
    elastic_residual_rel_max: f64,
    factors: usize,
}

/// A ball, and a body of it at large deformation.
struct Pinched(Ball);

impl Pinched {
    /// Ball at large deformation, at rest.
    fn large(&self) -> Result<LargeBody, ReportError> {
        let model = &self.0.model;
        let elements = Arc::new(model.hyperelastic(Law::NeoHookean)?);
        Ok(LargeBody::at_rest(elements, Arc::clone(model.stiffness().pattern())))
    }

    /// Makes a step; its time is measured without the search for triangles near the fingers.
    fn step(
        &self,
        state: &ObjectState,
        bodies: &[MovingBody],
        (way, large, carried): (Way, &mut LargeBody, &mut Carried),
    ) -> Result<(f64, StepOutcome), ReportError> {
        let settings = as_a_run(1.0 / RATE_HZ, way.residual_rel);
        let wanted = &self.0.surface.nodes;
        let (ms, found) = self.0.with_step(state, bodies, settings, |step| {
            timed_ms(|| match way.is_large {
                true => LargeStep { step, body: large }.advance(state, wanted),
                false => step.advance_from(state, wanted, carried),
            })
        });
        Ok((ms, found?))
    }

    /// Bodies of a step: the table and five fingertips, a thumb opposite four fingers.
    fn bodies(step: u32) -> Vec<MovingBody> {
        let share = |step: u32, from: u32, lasts: u32| {
            let t = (f64::from(step) - f64::from(from)) / f64::from(lasts);
            let t = t.clamp(0.0, 1.0);
            t * t * (3.0 - 2.0 * t)
        };
        let centre = |step: u32, around: f64, along: f64| {
            let closed = share(step, SETTLE, PINCH);
            let radius = 0.5 * SIZE + TIP + 0.003 - closed * (0.003 + DEPTH);
            let lifted = LIFT * share(step, SETTLE + PINCH, RAISE);
            let place = Vector3::new(
                radius * around.cos() * along.cos(),
                radius * along.sin() + lifted,
                radius * around.sin() * along.cos(),
            );
            Isometry3::from_parts(Translation3::from(place), UnitQuaternion::identity())
        };
        let mut bodies = vec![MovingBody::resting(
            RigidShape::Plane { normal: Vector3::y_axis() },
            Isometry3::translation(0.0, -0.5 * SIZE, 0.0),
            FRICTION,
        )];
        let half_turn = std::f64::consts::PI;
        for around in [half_turn, -0.6, -0.2, 0.2, 0.6] {
            bodies.push(MovingBody {
                shape: RigidShape::Sphere { radius: TIP },
                world_from_body_start: centre(step, around, 0.0),
                world_from_body_end: centre(step + 1, around, 0.0),
                friction: FRICTION,
                compliance: 1e-3,
            });
        }
        bodies
    }
}

impl Phase {
    fn add(&mut self, ms: f64, found: &StepOutcome) {
        self.times_ms.push(ms);
        self.points_most = self.points_most.max(found.contacts.len());
        self.converged += usize::from(found.is_converged);
        self.penetration_max = self.penetration_max.max(found.penetration_max);
        self.residual_rel_max = self.residual_rel_max.max(found.contact_residual_rel);
        self.elastic_residual_rel_max = self.elastic_residual_rel_max.max(found.residual_rel);
    }

    fn row(
        self,
        (nodes, way, columns): (usize, Way, &str),
        name: &str,
        drift_m: Option<f64>,
        balance: Option<f64>,
    ) -> Vec<Cell> {
        let steps = self.times_ms.len();
        let Tail { p50, p99, max, .. } = Tail::of(self.times_ms);
        vec![
            nodes.into(),
            if way.is_large { "large" } else { "linear" }.into(),
            way.residual_rel.into(),
            columns.into(),
            name.into(),
            steps.into(),
            self.points_most.into(),
            p50.into(),
            p99.into(),
            max.into(),
            self.converged.into(),
            self.penetration_max.into(),
            self.residual_rel_max.into(),
            self.elastic_residual_rel_max.into(),
            self.factors.into(),
            drift_m.into(),
            balance.into(),
        ]
    }
}

/// Measures the table of steps.
///
/// # Errors
/// [`ReportError`], also for a ball that is not lifted, or whose forces do not balance its weight.
pub(super) fn table(is_quick: bool) -> Result<Table, ReportError> {
    let sizes: &[usize] = if is_quick { &[300] } else { &[1000, 4000, 10_648] };
    let title = "Steps of a ball that five fingers pinch, lift and hold by friction";
    // As in the server, where a thread of the pool makes the step.
    let pool = pool(processors())?;
    let mut table = Table::new("contact-steps", title, &COLUMNS);
    for &nodes in sizes {
        let ball = Pinched(Ball::try_new(nodes)?);
        let nodes = ball.0.node_count();
        for way in WAYS.into_iter().filter(|way| !way.is_large || nodes <= LARGE_NODES_MAX) {
            let what = if way.is_large { "large" } else { "linear" };
            progress("contact", &format!("pinch, lift and hold, {nodes} nodes, {what}"));
            // Columns of contacts that nobody asked about before are made in the first round.
            let rounds: &[&str] = if way == WAYS[0] { &["cold", "warm"] } else { &["warm"] };
            for columns in rounds {
                pool.install(|| play(&ball, (way, columns), &mut table))?;
            }
        }
    }
    Ok(table)
}

/// Adds a row for each phase of one ball, whose columns are warm or cold.
fn play(ball: &Pinched, (way, columns): (Way, &str), table: &mut Table) -> Result<(), ReportError> {
    let (nodes, weight) = (ball.0.node_count(), ball.0.weight());
    let mut large = ball.large()?;
    let mut state = ObjectState::at_rest(Isometry3::identity());
    let mut carried = Carried::default();
    let mut step = 0;
    for (name, lasts) in [("settle", SETTLE), ("pinch", PINCH), ("lift", RAISE), ("hold", HOLD)] {
        let mut phase = Phase::default();
        let mut heights = Vec::new();
        let mut balance = 0.0f64;
        let factors = large.factors();
        for _ in 0..lasts {
            let (ms, found) =
                ball.step(&state, &Pinched::bodies(step), (way, &mut large, &mut carried))?;
            step += 1;
            phase.add(ms, &found);
            let sum: Vector3<f64> = found.loads.iter().map(|load| load.force).sum();
            balance = (sum - weight * Vector3::y()).norm() / weight;
            heights.push(found.state.world_from_object.translation.y);
            state = found.state;
        }
        phase.factors = large.factors() - factors;
        // Drift: of the last four seconds, after the swing of the lift has died away.
        let is_held = name == "hold";
        let drift = heights.last().zip(heights.get(60)).map(|(end, begin)| (end - begin).abs());
        if is_held {
            let lifted = heights.last().copied().unwrap_or_default();
            check(|| format!("{nodes} nodes: lifted"), LIFT - lifted, 0.2 * LIFT)?;
            check(|| format!("{nodes} nodes: forces and weight"), balance, BALANCE_ALLOWED)?;
        }
        let (drift, balance) = (drift.filter(|_| is_held), is_held.then_some(balance));
        table.push(phase.row((nodes, way, columns), name, drift, balance));
    }
    Ok(())
}

const COLUMNS: [&str; 17] = [
    "nodes",
    "equations",
    "asked_rel",
    "columns",
    "phase",
    "steps",
    "points_most",
    "p50_ms",
    "p99_ms",
    "slowest_ms",
    "steps_converged",
    "penetration_max_m",
    "residual_rel_max",
    "elastic_residual_rel_max",
    "factors",
    "drift_m",
    "balance_error_rel",
];

/// Text below the table.
pub(super) const TEXT: &str = "\
The steps are those of `run --grasp contact`, sixty a second: a ball of 70 mm (50 kPa, Poisson's ratio 0.4, \
1000 kg/m³) settles on a table, is pinched by a thumb and four fingers opposite, which close 8 mm beyond the \
touch (spheres of 8 mm, friction 0.8, 1000 N/m), lifted by 40 mm and held for five seconds. The time is that of \
the contact problem in the server, without the search for triangles near the fingers and without the wire. \
Where `columns` are cold, new contacts pay for their columns of the compliance; warm ones are those of the same \
motion played before, as a run's hints prefetch them. `points_most` is the most points that press at once. A \
step is `converged` where penetration is below 1e-6 of the object and the residual of the law of Signorini \
and Coulomb below `asked_rel` of the largest force (at large deformation the forces out of balance too, over \
the forces), within 160 steps of Newton's method; what was reached is in `penetration_max_m`, \
`residual_rel_max` and `elastic_residual_rel_max`. A run asks for 1e-6 by linear elasticity. `factors` are those \
of tangents that were made in the phase. Before times are told the ball must have been lifted, and the \
forces on it must add up to its weight within 1e-3; `drift_m` is how far it sinks in the last four seconds.";
