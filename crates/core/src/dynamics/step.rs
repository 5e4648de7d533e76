//! One step of an object among rigid bodies: contact solved about where the step ends, until it is met.

use std::collections::BTreeSet;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

use super::assemble::ProblemPoint;
use super::bodies::MovingBody;
use super::carried::Carried;
use super::checks::{check, check_names, check_nodes, mass_of};
use super::configuration::{Configuration, Configured, Scene, sums_by_body};
use super::features::{Candidate, merged};
use super::near::{Around, NearCandidates, NodeField};
use super::resultants::small_system;
use super::rigid_motion::{MassProperties, RigidStep};
use super::rounds::{Effort, Found, Rounds};
use super::settings::{StepError, StepSettings};
use super::state::{BodyLoad, HeldContact, ObjectState, PointContact, StepOutcome, at_nodes};
use crate::contact::coulomb::{FrictionCone, state_of};
use crate::solve::condensed::{Elasticity, Response};

/// An object, the bodies around it, and how long the step is.
#[derive(Clone, Copy)]
pub struct ContactStep<'a> {
    /// Places of all nodes at rest, in the object's frame.
    pub vertices: &'a [Point3<f64>],
    /// Triangles of the boundary surface.
    pub triangles: &'a [[u32; 3]],
    /// The elastic part.
    pub elasticity: Elasticity<'a>,
    /// Rigid bodies around the object.
    pub bodies: &'a [MovingBody],
    /// Pairs of triangle and body that can touch in this step.
    pub candidates: &'a [Candidate],
    /// How the step is made.
    pub settings: StepSettings,
    /// Asked between rounds, steps of Newton's method and some sweeps: whether the step ends at the best that was
    /// found.
    pub is_late: &'a (dyn Fn() -> bool + Sync),
}

/// Makes one part of a step, from where the part before it has ended.
pub(super) type MakePart<'m> =
    dyn FnMut(&ContactStep<'_>, &ObjectState, &[u32]) -> Result<StepOutcome, StepError> + 'm;

/// Share of its thickness that a body moves in one part of a step at most.
const WAY_OF_THICKNESS: f64 = 0.5;
/// Most parts of a step.
const PARTS_MAX: f64 = 32.0;
/// Triangles nearer to a body than this share of the object's size are in the rounds from the start.
const NEAR: f64 = 8e-3;
/// Times that the rounds are played with more candidates before all of them are taken.
const PLAYS_MAX: usize = 3;

/// What the rounds of a step begin with.
struct Start {
    held: Vec<HeldContact>,
    world_from_object: Isometry3<f64>,
    /// Displacement of the nodes; that of the step's beginning where there is none.
    shape: Option<NodeField>,
}

impl Start {
    /// Where other rounds have ended.
    fn at(end: Configuration, shape: NodeField) -> Self {
        let world_from_object = end.motion.world_from_object;
        Self { held: end.contacts, world_from_object, shape: Some(shape) }
    }
}

impl ContactStep<'_> {
    /// Makes the step, in parts where a body moves so far that it could pass through the surface.
    ///
    /// Shapes: `wanted` nodes whose displacements are asked for.
    ///
    /// # Errors
    /// [`StepError`]; a step that does not meet the law of contact is no error, it says so.
    pub fn advance(&self, state: &ObjectState, wanted: &[u32]) -> Result<StepOutcome, StepError> {
        self.advance_from(state, wanted, &mut Carried::default())
    }

    /// Makes the step as [`ContactStep::advance`] does, to the bit, and quicker where it goes on from the
    /// state that another step has ended with. Carries what the next step begins with.
    ///
    /// # Errors
    /// [`StepError`]; nothing is carried then.
    pub fn advance_from(
        &self,
        state: &ObjectState,
        wanted: &[u32],
        carried: &mut Carried,
    ) -> Result<StepOutcome, StepError> {
        let mass = self.checked(state)?;
        let parts = self.parts(state, &mass);
        self.in_parts(parts, state, wanted, &mut |part, begun, wanted| {
            part.advance_whole((begun, mass), wanted, carried)
        })
    }

    /// Mass of the object, once step and state are seen to name what is there, in numbers.
    ///
    /// # Errors
    /// [`StepError`].
    pub(super) fn checked(&self, state: &ObjectState) -> Result<MassProperties, StepError> {
        check(&self.settings, self.bodies, state)?;
        check_names(self.candidates, (self.triangles.len(), self.bodies.len()))?;
        check_nodes(state, self.vertices.len())?;
        mass_of(self.elasticity.body, &self.settings)
    }

    /// Makes equal parts of the step one after the other.
    pub(super) fn in_parts(
        &self,
        parts: usize,
        state: &ObjectState,
        wanted: &[u32],
        make: &mut MakePart<'_>,
    ) -> Result<StepOutcome, StepError> {
        let share = |part: usize| part as f64 / parts as f64;
        let mut made: Option<StepOutcome> = None;
        for part in 0..parts {
            let bodies: Vec<MovingBody> =
                self.bodies.iter().map(|body| body.part(share(part), share(part + 1))).collect();
            let seconds = self.settings.seconds / parts as f64;
            let settings = StepSettings { seconds, ..self.settings };
            let of_part = ContactStep { bodies: &bodies, settings, ..*self };
            let begun = made.as_ref().map_or(state, |made| &made.state);
            // Displacements are of no use before the last part.
            let wanted = if part + 1 == parts { wanted } else { &[] };
            let next = make(&of_part, begun, wanted)?;
            made = Some(match made {
                Some(before) => next.after(&before),
                None => next,
            });
        }
        Ok(made.expect("a step has at least one part"))
    }

    /// Number of parts in none of which a body that can touch moves by more than a share of its
    /// thickness, seen from an object that goes on as it does: one that is carried along is still.
    pub(super) fn parts(&self, state: &ObjectState, mass: &MassProperties) -> usize {
        let before = &state.world_from_object;
        let after = drifted(state, mass, self.settings.seconds);
        let touching: BTreeSet<u16> = self.candidates.iter().map(|c| c.body).collect();
        let needed = |body: &u16| {
            let body = &self.bodies[usize::from(*body)];
            let way = body.way_between(before, &after);
            way / (WAY_OF_THICKNESS * body.shape.thickness())
        };
        let most = touching.iter().map(needed).fold(1.0, f64::max);
        most.ceil().min(PARTS_MAX) as usize
    }

    /// Makes the whole step at once.
    fn advance_whole(
        &self,
        (state, mass): (&ObjectState, MassProperties),
        wanted: &[u32],
        carried: &mut Carried,
    ) -> Result<StepOutcome, StepError> {
        let mut columns = Response::new(self.elasticity, Vec::new());
        let (held, size) = (self.held(state), self.size());
        columns.need(state.forces.iter().map(|(node, _)| *node))?;
        let (nodes, node_count) = (self.with_rows(state, wanted), self.vertices.len());
        let begun = carried.begin(&columns, state, &nodes);
        let begun = NodeField::new(&nodes, begun, node_count);
        let drifted = drifted(state, &mass, self.settings.seconds);
        let mut near =
            NearCandidates::choose(self.around(), (state, &drifted), &begun, NEAR * size);
        let mut start = Start { held, world_from_object: state.world_from_object, shape: None };
        let mut effort = Effort::default();
        loop {
            let candidates = near.chosen();
            let step = ContactStep { candidates: &candidates, ..*self };
            let mut response = columns.of_rows(step.rows(state));
            response.need(at_nodes(&start.held).iter().map(|(node, _)| *node))?;
            let scene = step.scene(state, mass, begun.of(response.rows()));
            let found = step.play((&scene, size), &mut response, start)?;
            effort.see(&found);
            let ended = response.displacement_of(&nodes, &found.end.forces);
            let ended = NodeField::new(&nodes, ended, node_count);
            let bodies = scene.object_from_bodies(&found.end.configured());
            let allowed = 0.5 * self.settings.penetration_rel * size;
            if !near.add_missed(&bodies, &ended, allowed) {
                let displacements = ended.values[..wanted.len()].to_vec();
                let outcome = self.outcome(&scene, &response, &found, displacements);
                carried.end(&outcome.state, nodes, ended.values);
                return Ok(StepOutcome { shapes: 1, ..effort.told(outcome) });
            }
            if effort.shapes >= PLAYS_MAX {
                near.add_all();
            }
            start = Start::at(found.end, ended);
        }
    }

    /// What can touch in the step.
    fn around(&self) -> Around<'_> {
        let Self { vertices, triangles, bodies, candidates, .. } = *self;
        Around { vertices, triangles, bodies, candidates }
    }

    /// Some nodes, and behind them the nodes that the step can meet besides.
    fn with_rows(&self, state: &ObjectState, wanted: &[u32]) -> Vec<u32> {
        let mut is_named = vec![false; self.vertices.len()];
        let mut nodes = wanted.to_vec();
        wanted.iter().for_each(|&node| is_named[node as usize] = true);
        let is_new = |node: &u32| !std::mem::replace(&mut is_named[*node as usize], true);
        nodes.extend(self.met(state).filter(is_new));
        nodes
    }

    /// Plays the rounds from where they start.
    fn play<'s>(
        &'s self,
        (scene, size): (&'s Scene<'s>, f64),
        response: &mut Response<'s>,
        start: Start,
    ) -> Result<Found, StepError> {
        // What is left of the shape that the step began with: the response is linear.
        let left = 1.0 - scene.answered();
        let unpressed: Vec<Vector3<f64>> = scene.begun.iter().map(|u| left * u).collect();
        let displacement = start.shape.map_or(scene.begun.clone(), |u| u.of(response.rows()));
        let configured = Configured {
            world_from_object: start.world_from_object,
            displacement: &displacement,
            body_forces: &[],
        };
        let settings = &self.settings;
        let (unpressed, is_late) = (&unpressed, self.is_late);
        let mut rounds = Rounds { settings, size, scene, response, unpressed, is_late };
        rounds.play(start.held, &configured)
    }

    /// Contacts of a state with bodies that are still there.
    pub(super) fn held(&self, state: &ObjectState) -> Vec<HeldContact> {
        let is_known = |c: &&HeldContact| usize::from(c.body) < self.bodies.len();
        state.contacts.iter().filter(is_known).copied().collect()
    }

    /// What does not change while the step is solved.
    pub(super) fn scene<'s>(
        &'s self,
        state: &'s ObjectState,
        mass: MassProperties,
        begun: Vec<Vector3<f64>>,
    ) -> Scene<'s> {
        let StepSettings { seconds, gravity, viscosity, .. } = self.settings;
        Scene {
            vertices: self.vertices,
            triangles: self.triangles,
            bodies: self.bodies,
            candidates: self.candidates,
            rigid: RigidStep { state, mass, gravity, seconds },
            viscosity,
            begun,
            world_from_bodies_begun: self.bodies_begun(state),
        }
    }

    /// The bodies when the step begins, pushed back by the forces of that moment.
    fn bodies_begun(&self, state: &ObjectState) -> Vec<Isometry3<f64>> {
        let turn = state.world_from_object.rotation;
        let forces = sums_by_body(&state.contacts, self.bodies.len());
        let pushed = |(body, force): (&MovingBody, &Vector3<f64>)| {
            body.pushed_back(&body.world_from_body_start, &(turn * force))
        };
        self.bodies.iter().zip(&forces).map(pushed).collect()
    }

    /// Size of the object: the diagonal of its bounding box, m.
    pub(super) fn size(&self) -> f64 {
        let (mut low, mut high) =
            (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
        for vertex in self.vertices {
            (low, high) = (low.inf(&vertex.coords), high.sup(&vertex.coords));
        }
        (high - low).norm()
    }

    /// Nodes that the step can meet, in any order and more than once.
    fn met<'s>(&'s self, state: &'s ObjectState) -> impl Iterator<Item = u32> + use<'s> {
        let near = self.candidates.iter().flat_map(|c| self.triangles[c.triangle as usize]);
        let forced = state.forces.iter().map(|(node, _)| *node);
        let held = state.contacts.iter().flat_map(|contact| contact.nodes);
        near.chain(forced).chain(held)
    }

    /// All nodes that the step can meet, ascending.
    pub(super) fn rows(&self, state: &ObjectState) -> Vec<u32> {
        let mut rows: Vec<u32> = self.met(state).collect();
        rows.sort_unstable();
        rows.dedup();
        rows
    }

    /// The points that press, and the sum of each body's forces.
    fn contacts_and_loads(
        &self,
        scene: &Scene<'_>,
        response: &Response<'_>,
        found: &Found,
    ) -> (Vec<PointContact>, Vec<BodyLoad>) {
        let end = &found.end;
        let world_from_object = end.motion.world_from_object;
        let mut loads = vec![BodyLoad::default(); self.bodies.len()];
        let mut contacts = Vec::new();
        for (point, force) in &found.pressing {
            let body = &self.bodies[usize::from(point.point.body)];
            let place = world_from_object * point.gap.place;
            let normal_in_object = point.gap.normal.into_inner();
            let normal = world_from_object.rotation * normal_in_object;
            let away = point.gap.place - scene.stuck(response, &end.configured(), &point.point);
            let slip = away - normal_in_object * normal_in_object.dot(&away);
            let local = point.local(force);
            let force = world_from_object.rotation * force;
            let load = &mut loads[usize::from(point.point.body)];
            let arm = place.coords - body.world_from_body_end.translation.vector;
            load.force += force;
            load.torque += arm.cross(&force);
            load.normal_force += local.x;
            load.contacts += 1;
            contacts.push(PointContact {
                body: point.point.body,
                nodes: point.point.nodes,
                weights: point.point.weights,
                place,
                normal,
                force,
                slip: world_from_object.rotation * slip,
                state: state_of(&local, body.friction),
            });
        }
        (contacts, loads)
    }

    /// What is told of where the rounds have ended.
    pub(super) fn outcome(
        &self,
        scene: &Scene<'_>,
        response: &Response<'_>,
        found: &Found,
        displacements: Vec<[f64; 3]>,
    ) -> StepOutcome {
        let end = &found.end;
        let world_from_object = end.motion.world_from_object;
        let (contacts, loads) = self.contacts_and_loads(scene, response, found);
        let force_max = contacts.iter().map(|c| c.force.norm()).fold(0.0, f64::max);
        let relative = if force_max > 0.0 { found.residual / force_max } else { 0.0 };
        let violation = |(point, force): &(ProblemPoint, Vector3<f64>)| {
            let friction = self.bodies[usize::from(point.point.body)].friction;
            FrictionCone { friction }.violation(point.local(force))
        };
        let small_system = match self.settings.small_system {
            true => small_system(scene, response, found),
            false => None,
        };
        StepOutcome {
            state: ObjectState {
                world_from_object,
                velocity: end.motion.velocity,
                angular_velocity: end.motion.settled_angular_velocity(&scene.rigid.mass),
                forces: end.forces.clone(),
                contacts: merged(&end.contacts),
            },
            displacements,
            slip_max: contacts.iter().map(|c| c.slip.norm()).fold(0.0, f64::max),
            contacts,
            loads,
            penetration_max: found.penetration,
            contact_residual: found.residual,
            contact_residual_rel: relative,
            cone_violation: found.pressing.iter().map(violation).fold(0.0, f64::max),
            residual_rel: response.residual_rel(&end.forces),
            is_converged: found.is_converged,
            is_late: found.is_late,
            rounds: found.rounds,
            sweeps: found.sweeps,
            newton_steps: found.newton_steps,
            shapes: 1,
            small_system,
        }
    }
}

/// Where the object would be after some seconds if nothing acted on it.
fn drifted(state: &ObjectState, mass: &MassProperties, seconds: f64) -> Isometry3<f64> {
    let centre = state.world_from_object * mass.centre;
    let turn = UnitQuaternion::from_scaled_axis(seconds * state.angular_velocity);
    let shift = Translation3::from(centre.coords + seconds * state.velocity);
    shift * turn * Translation3::from(-centre.coords) * state.world_from_object
}
