//! One step at large deformation: contact about a shape to first order, then that shape again.

use std::sync::Arc;

use nalgebra::{Isometry3, Vector3};

use super::checks::mass_of;
use super::configuration::{Configured, Scene};
use super::large_body::{LargeBody, Shape};
use super::rigid_motion::MassProperties;
use super::rounds::{Effort, Found, Rounds};
use super::settings::{StepError, StepSettings};
use super::state::{HeldContact, ObjectState, StepOutcome, at_nodes};
use super::step::ContactStep;
use crate::solve::condensed::{Elasticity, FreeTangent, Response, ShapeResponse};

/// Shapes that a step is solved about, one after the other.
const SHAPES_MAX: usize = 24;
/// A factor that leaves more than this of the residual is made anew.
const LEFT_BY_FACTOR: f64 = 0.2;
/// Residual that is expected of the shape that a step begins with.
const LEFT_AT_FIRST: f64 = 0.5;
/// Least residual of the elastic part that can be asked for.
const RESIDUAL_MIN: f64 = 1e-10;
/// How often a step that finds no end is cut into halves.
const HALVINGS: usize = 2;
/// Residual of either part above which halves of the step may do better.
const LOST: f64 = 1e-3;
/// Shapes in a row that are no nearer to what is asked for than the best, after which the step ends.
const NO_NEARER_MAX: usize = 3;
/// Contact about a shape that is off is solved no better than this share of how far that is.
const INEXACT: f64 = 1e-3;

/// An end of a step: the contacts, and the shape as it is to first order about another one.
struct End {
    found: Found,
    displacement: Vec<f64>,
    tangent: Arc<FreeTangent>,
    offset: Vec<f64>,
    /// Forces out of balance over those that made the shape …
    residual_rel: f64,
    /// … and over those that are told.
    told: f64,
    /// How far it is from what is asked for: at most 1 where it is met.
    far: f64,
}

/// A step at large deformation: the elastic part is in balance in its deformed shape. The body keeps the
/// shape and a factor from step to step.
pub struct LargeStep<'a, 'b> {
    /// Object, bodies and settings of the step.
    pub step: ContactStep<'a>,
    /// The body in the shape that it has when the step begins.
    pub body: &'b mut LargeBody,
}

impl LargeStep<'_, '_> {
    /// Makes the step, in parts where a body moves so far that it could pass through the surface.
    ///
    /// Shapes: `wanted` nodes whose displacements are asked for.
    ///
    /// # Errors
    /// [`StepError`]; a step that does not meet the law of contact or is out of balance is no error, it
    /// says so.
    pub fn advance(self, state: &ObjectState, wanted: &[u32]) -> Result<StepOutcome, StepError> {
        let Self { step, body } = self;
        let mass = step.checked(state)?;
        body.take_shape_of(step.elasticity, &state.forces)?;
        let parts = step.parts(state, &mass);
        let before = body.shape().clone();
        let made = step.in_parts(parts, state, wanted, &mut |part, begun, wanted| {
            LargeStep { step: *part, body }.advance_or_halve(begun, wanted, HALVINGS)
        });
        // Parts before the one that failed are taken back, with what has flowed in them.
        made.inspect_err(|_| drop(body.put(before)))
    }

    /// Makes the step at once, or in halves where it finds no end.
    fn advance_or_halve(
        &mut self,
        state: &ObjectState,
        wanted: &[u32],
        halvings: usize,
    ) -> Result<StepOutcome, StepError> {
        let before = self.body.shape().clone();
        let whole = self.advance_shape(state, wanted);
        let is_lost = match &whole {
            Ok(whole) => whole.residual_rel > LOST || whole.contact_residual_rel > LOST,
            Err(error) => matches!(error, StepError::InsideOut | StepError::Problem(_)),
        };
        if halvings == 0 || !is_lost {
            return whole.inspect(|_| self.body.flow());
        }
        if (self.step.is_late)() {
            return whole.inspect(|_| self.body.flow()).map(StepOutcome::ended_early);
        }
        let after = self.body.put(before);
        let body = &mut *self.body;
        let halves = self.step.in_parts(2, state, wanted, &mut |half, begun, wanted| {
            LargeStep { step: *half, body }.advance_or_halve(begun, wanted, halvings - 1)
        });
        match (halves, &whole) {
            (Ok(halves), Err(_)) => Ok(halves),
            (Ok(halves), Ok(whole)) if halves.is_nearer_than(whole) => Ok(halves),
            (halves, _) => {
                self.body.put(after);
                // Halves that had the time might have been better.
                let were_late = halves.is_ok_and(|halves| halves.is_late);
                let whole = whole.inspect(|_| self.body.flow());
                if were_late { whole.map(StepOutcome::ended_early) } else { whole }
            }
        }
    }

    /// Makes the whole step at once.
    fn advance_shape(
        &mut self,
        state: &ObjectState,
        wanted: &[u32],
    ) -> Result<StepOutcome, StepError> {
        let step = self.step;
        let rows = step.rows(state);
        let begun = at_rows(&rows, self.body.displacement());
        let scene = step.scene(state, self.mass_of_shape()?, begun);
        let mut progress = Progress {
            held: step.held(state),
            world_from_object: state.world_from_object,
            body_forces: Vec::new(),
            about: self.body.displacement().to_vec(),
            best: None,
            no_nearer: 0,
            left: LEFT_AT_FIRST,
            is_stale: self.body.tangent().is_none(),
            is_late: false,
            effort: Effort::default(),
        };
        while progress.effort.shapes < SHAPES_MAX && progress.no_nearer < NO_NEARER_MAX {
            if progress.best.is_some() && (step.is_late)() {
                progress.is_late = true;
                break;
            }
            let end = match self.next_end(&scene, &rows, &mut progress) {
                Err(StepError::Problem(_)) if progress.best.is_some() => break,
                end => end?,
            };
            if self.take(&scene, end, &mut progress) {
                break;
            }
        }
        let is_sound = |end: &End| end.residual_rel.is_finite() && end.told.is_finite();
        let Some(end) = progress.best.filter(is_sound) else { return Err(StepError::InsideOut) };
        let outcome = self.finished(&scene, (rows, end), wanted)?;
        let is_late = !outcome.is_converged && (outcome.is_late || progress.is_late);
        Ok(StepOutcome { is_late, ..progress.effort.told(outcome) })
    }

    /// Solves contact about the shape that was reached.
    fn next_end(
        &mut self,
        scene: &Scene<'_>,
        rows: &[u32],
        progress: &mut Progress,
    ) -> Result<End, StepError> {
        let tangent = match self.body.tangent().filter(|_| !progress.is_stale) {
            Some(kept) => kept,
            None => self.body.factor_at(self.step.elasticity, &progress.about, false)?,
        };
        let start_rows = at_rows(rows, &progress.about);
        let start = Configured {
            world_from_object: progress.world_from_object,
            displacement: &start_rows,
            body_forces: &progress.body_forces,
        };
        let held = std::mem::take(&mut progress.held);
        let (about, exactness) = (progress.about.as_slice(), INEXACT * progress.left);
        let asked = (held.clone(), &start);
        let end = match self.end_about(scene, (about, &tangent, rows), asked, exactness) {
            // The shape would give way by itself: a node goes against the force on it, and contact has no answer.
            Err(StepError::Problem(_)) if !tangent.takes_energy() => {
                let steady = self.body.factor_at(self.step.elasticity, about, true)?;
                self.end_about(scene, (about, &steady, rows), (held, &start), exactness)?
            }
            end => end?,
        };
        progress.effort.see(&end.found);
        Ok(end)
    }

    /// Goes on to an end, as far as its elements keep their volume; says whether it is the last.
    fn take(&self, scene: &Scene<'_>, end: End, progress: &mut Progress) -> bool {
        let Progress { about, best, no_nearer, left, .. } = progress;
        let step: Vec<f64> =
            end.displacement.iter().zip(about.iter()).map(|(new, old)| new - old).collect();
        let share = self.body.share_of_step(about, &step);
        let is_whole = share >= 1.0 && end.residual_rel.is_finite();
        if is_whole {
            about.clone_from(&end.displacement);
        } else if share > 0.0 {
            let share = share.min(0.5);
            about.iter_mut().zip(&step).for_each(|(u, d)| *u += share * d);
        }
        progress.held.clone_from(&end.found.end.contacts);
        progress.world_from_object = end.found.end.motion.world_from_object;
        progress.body_forces.clone_from(&end.found.end.body_forces);
        let (now, is_met) = (end.residual_rel, end.far <= 1.0);
        let is_best = best.as_ref().is_none_or(|best| end.far < best.far);
        *no_nearer = if is_best || !is_whole { 0 } else { *no_nearer + 1 };
        if is_best {
            *best = Some(end);
        }
        // Where contact alone is not met, another factor would not help.
        let is_off = now > self.tolerance() && now > LEFT_BY_FACTOR * *left;
        progress.is_stale = !is_whole || is_off;
        *left = if now.is_finite() { now.min(LEFT_AT_FIRST) } else { LEFT_AT_FIRST };
        let is_unloaded = progress.held.is_empty() && scene.elastic_forces(&[]).is_empty();
        if is_unloaded && !self.body.elements().is_plastic() {
            // Nothing presses: the shape is that of rest.
            progress.is_stale |= progress.about.iter().any(|u| *u != 0.0);
            progress.about.fill(0.0);
        }
        is_met || share.is_nan()
    }

    /// Residual of the elastic part that is small enough, over its forces.
    fn tolerance(&self) -> f64 {
        self.step.settings.residual_rel.max(RESIDUAL_MIN)
    }

    /// Contact about a shape to first order, and how well the shape that it leads to is in balance.
    fn end_about(
        &self,
        scene: &Scene<'_>,
        (about, tangent, rows): (&[f64], &Arc<FreeTangent>, &[u32]),
        (held, start): (Vec<HeldContact>, &Configured<'_>),
        exactness: f64,
    ) -> Result<End, StepError> {
        let Elasticity { base, body, .. } = self.step.elasticity;
        let holding = self.body.elements().evaluate(about).forces;
        let held_up = tangent.apply(base, body, &holding);
        let offset: Vec<f64> = about.iter().zip(&held_up).map(|(u, c)| u - c).collect();
        let shape = ShapeResponse { base, body, tangent, offset: &offset };
        let mut response = Response::about(shape, rows.to_vec());
        response.need(scene.elastic_forces(&[]).iter().map(|(node, _)| *node))?;
        response.need(held.iter().flat_map(|contact| contact.nodes))?;
        let asked = self.step.settings;
        let settings = StepSettings {
            residual_rel: asked.residual_rel.max(exactness),
            penetration_rel: asked.penetration_rel.max(INEXACT * exactness),
            ..asked
        };
        let size = self.step.size();
        let unpressed = &response.displacement(&scene.elastic_forces(&[]));
        let mut rounds = Rounds {
            settings: &settings,
            size,
            scene,
            response: &mut response,
            unpressed,
            is_late: self.step.is_late,
        };
        let found = rounds.play(held, start)?;
        let all: Vec<u32> = (0..self.step.vertices.len() as u32).collect();
        let mut displacement: Vec<f64> =
            response.displacement_of(&all, &found.end.forces).into_flattened();
        if found.end.forces.is_empty() && displacement.iter().all(|u| u.abs() < 1e-12 * size) {
            displacement.fill(0.0);
        }
        let residual_rel =
            self.body.balance(self.step.elasticity, &displacement, &found.end.forces).residual_rel;
        // A force that has moved since acts on the shape that it had made before: that is told.
        let told = match found.has_moved {
            false => residual_rel,
            true => {
                let forces = scene.elastic_forces(&at_nodes(&found.end.contacts));
                self.body.balance(self.step.elasticity, &displacement, &forces).residual_rel
            }
        };
        let force_max = found.end.contacts.iter().map(|c| c.force.norm()).fold(0.0, f64::max);
        let share = |off: f64, allowed: f64| if off > 0.0 { off / allowed } else { 0.0 };
        let far = share(found.penetration, asked.penetration_rel * size)
            .max(share(found.residual, asked.residual_rel * force_max))
            .max(share(told, self.tolerance()));
        let far = if found.has_moved { far.max(2.0) } else { far };
        let tangent = Arc::clone(tangent);
        Ok(End { found, displacement, tangent, offset, residual_rel, told, far })
    }

    /// Leaves the body in the shape of an end, and says what it is like.
    fn finished(
        &mut self,
        scene: &Scene<'_>,
        (rows, end): (Vec<u32>, End),
        wanted: &[u32],
    ) -> Result<StepOutcome, StepError> {
        let Elasticity { base, body, .. } = self.step.elasticity;
        let End { found, displacement, tangent, offset, told, far, .. } = end;
        let shape = ShapeResponse { base, body, tangent: &tangent, offset: &offset };
        let mut response = Response::about(shape, rows);
        if self.step.settings.small_system {
            let pressing = found.pressing.iter().flat_map(|(p, _)| p.point.weighted());
            response.need(pressing.map(|(node, _)| node))?;
        }
        let of_node = |&node: &u32| {
            let at = 3 * node as usize;
            [displacement[at], displacement[at + 1], displacement[at + 2]]
        };
        let displacements = wanted.iter().map(of_node).collect();
        let outcome = self.step.outcome(scene, &response, &found, displacements);
        let (elements, forces) = (Arc::clone(self.body.elements()), found.end.forces);
        self.body.put(Shape { elements, displacement, forces });
        let is_converged = far <= 1.0;
        Ok(StepOutcome { residual_rel: told, is_converged, ..outcome })
    }

    /// Mass and inertia of the body in its shape.
    fn mass_of_shape(&self) -> Result<MassProperties, StepError> {
        let ContactStep { elasticity: Elasticity { body, .. }, settings, .. } = self.step;
        let mass = mass_of(body, &settings)?;
        let inertia = body.inertia_of(self.body.displacement());
        Ok(mass.with_inertia(settings.density * inertia).unwrap_or(mass))
    }
}

/// The state of a step between two shapes.
struct Progress {
    /// Contacts of the last end, with the pose and the forces that it has.
    held: Vec<HeldContact>,
    world_from_object: Isometry3<f64>,
    body_forces: Vec<Vector3<f64>>,
    /// The shape that was reached, 3N, m.
    about: Vec<f64>,
    best: Option<End>,
    /// Ends in a row that were no nearer to what is asked for than the best.
    no_nearer: usize,
    /// Residual of the last shape, over the forces.
    left: f64,
    /// Whether the factor is to be made anew.
    is_stale: bool,
    /// Whether it ended with shapes left to try, because it was late.
    is_late: bool,
    effort: Effort,
}

/// Displacement of some nodes.
fn at_rows(rows: &[u32], displacement: &[f64]) -> Vec<Vector3<f64>> {
    let of = |&node: &u32| {
        let at = 3 * node as usize;
        Vector3::from_column_slice(&displacement[at..at + 3])
    };
    rows.iter().map(of).collect()
}
