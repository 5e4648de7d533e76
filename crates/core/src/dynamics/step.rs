//! One step of an object among rigid bodies: contact solved about where the step ends, until it is met.

use std::collections::BTreeSet;

use nalgebra::{Isometry3, Point3, Vector3};

use super::assemble::{ProblemPoint, problem};
use super::bodies::MovingBody;
use super::configuration::{Configuration, Configured, Scene, sums_by_body};
use super::features::{Candidate, MaterialPoint};
use super::outcome::{BodyLoad, PointContact, StepOutcome};
use super::pool::{Pool, force_at, merged};
use super::rigid_motion::{MassProperties, RigidStep};
use super::state::{HeldContact, ObjectState, at_nodes};
use crate::contact::coulomb::{ContactProblem, ProblemError, SolveBudget};
use crate::solve::condensed::{CondensedError, Elasticity, Response};

/// How a step is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepSettings {
    /// Length of the step, s.
    pub seconds: f64,
    /// Acceleration of free fall, m/s², world.
    pub gravity: Vector3<f64>,
    /// Density of the object, kg/m³.
    pub density: f64,
    /// Time in which the shape forgets a force (Kelvin and Voigt), s.
    pub viscosity: f64,
    /// Penetration that is small enough, as a share of the object's size.
    pub penetration_rel: f64,
    /// Residual of the contact law that is small enough, as a share of the largest force.
    pub residual_rel: f64,
    /// Most times that the contact problem is made anew.
    pub rounds_max: usize,
    /// Steps of Newton's method after which no further round is begun.
    pub newton_max: usize,
}

impl Default for StepSettings {
    fn default() -> Self {
        Self {
            seconds: 0.01,
            gravity: Vector3::new(0.0, 0.0, -9.81),
            density: 1000.0,
            viscosity: 0.0,
            penetration_rel: 1e-6,
            residual_rel: 1e-9,
            rounds_max: 16,
            newton_max: 400,
        }
    }
}

/// An object, the bodies around it, and how long the step is.
pub struct ContactStep<'a> {
    /// Places of all nodes at rest, in the object's frame.
    pub vertices: &'a [Point3<f64>],
    /// Triangles of the boundary surface.
    pub triangles: &'a [[u32; 3]],
    /// The elastic part.
    pub elasticity: Elasticity<'a>,
    /// The bodies.
    pub bodies: &'a [MovingBody],
    /// Pairs of triangle and body that can touch in this step.
    pub candidates: &'a [Candidate],
    /// How the step is made.
    pub settings: StepSettings,
}

/// Why a step cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StepError {
    /// A setting out of range.
    #[error("{what} is {value}; it must be {expected}")]
    Setting {
        /// Which one.
        what: &'static str,
        /// What it is.
        value: f64,
        /// What it must be.
        expected: &'static str,
    },
    /// A candidate that names what is not there.
    #[error(
        "candidate {candidate} names triangle {triangle} of {triangles} and body {body} of {bodies}"
    )]
    Candidate {
        /// Position in the list.
        candidate: usize,
        /// Triangle named.
        triangle: u32,
        /// Triangles there are.
        triangles: usize,
        /// Body named.
        body: u16,
        /// Bodies there are.
        bodies: usize,
    },
    /// A node of the state that is not there.
    #[error("the state names node {node}, but the mesh has {node_count} nodes (0-based)")]
    Node {
        /// The node.
        node: u32,
        /// Nodes of the mesh.
        node_count: usize,
    },
    /// State or pose that is not finite.
    #[error("a number of the object's state or of a body's pose is not finite")]
    NotFinite,
    /// The elastic part failed.
    #[error(transparent)]
    Elastic(#[from] CondensedError),
    /// The contact problem could not be made.
    #[error(transparent)]
    Problem(#[from] ProblemError),
}

/// Points nearer to a body than this share of the object's size are in the problem from the start.
const MARGIN: f64 = 2e-3;
/// Share of a round's residual that its solution may leave.
const INEXACT: f64 = 1e-3;
/// Attempts of Newton's method in a round.
const ATTEMPTS: usize = 8;

impl ContactStep<'_> {
    /// Makes the step.
    ///
    /// Shapes: `wanted` nodes whose displacements are asked for.
    ///
    /// # Errors
    /// [`StepError`]; a step that does not meet the law of contact is no error, it says so.
    pub fn advance(&self, state: &ObjectState, wanted: &[u32]) -> Result<StepOutcome, StepError> {
        let mass = self.check(state)?;
        let mut response = self.response(state);
        response.need(state.forces.iter().map(|(node, _)| *node))?;
        response.need(at_nodes(&state.contacts).iter().map(|(node, _)| *node))?;
        let settings = &self.settings;
        let (seconds, gravity) = (settings.seconds, settings.gravity);
        let scene = Scene {
            vertices: self.vertices,
            triangles: self.triangles,
            bodies: self.bodies,
            candidates: self.candidates,
            rigid: RigidStep { state, mass, gravity, seconds },
            viscosity: settings.viscosity,
            begun: response.displacement(&state.forces),
            world_from_bodies_begun: self.bodies_begun(state),
        };
        let mut rounds = Rounds { step: self, scene: &scene, response: &mut response };
        let found = rounds.play(state)?;
        Ok(self.outcome(&scene, &response, &found, wanted))
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
    fn size(&self) -> f64 {
        let (mut low, mut high) =
            (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
        for vertex in self.vertices {
            (low, high) = (low.inf(&vertex.coords), high.sup(&vertex.coords));
        }
        (high - low).norm()
    }

    fn check(&self, state: &ObjectState) -> Result<MassProperties, StepError> {
        let settings = &self.settings;
        let setting = |what, value, expected| Err(StepError::Setting { what, value, expected });
        if !(settings.seconds > 0.0 && settings.seconds.is_finite()) {
            return setting(
                "the length of the step",
                settings.seconds,
                "a positive number of seconds",
            );
        }
        if !(settings.viscosity >= 0.0 && settings.viscosity.is_finite()) {
            return setting("the viscosity", settings.viscosity, "a number of seconds, at least 0");
        }
        for body in self.bodies {
            if !(body.friction >= 0.0 && body.friction.is_finite()) {
                return setting("the friction of a body", body.friction, "a number, at least 0");
            }
            if !(body.compliance >= 0.0 && body.compliance.is_finite()) {
                return setting("the compliance of a body", body.compliance, "m/N, at least 0");
            }
        }
        let poses =
            self.bodies.iter().flat_map(|b| [b.world_from_body_start, b.world_from_body_end]);
        let poses_are_finite = poses.into_iter().all(|pose| {
            pose.translation.vector.iter().chain(pose.rotation.coords.iter()).all(|x| x.is_finite())
        });
        if !state.is_finite()
            || !poses_are_finite
            || !settings.gravity.iter().all(|x| x.is_finite())
        {
            return Err(StepError::NotFinite);
        }
        for (candidate, named) in self.candidates.iter().enumerate() {
            let Candidate { triangle, body } = *named;
            let (triangles, bodies) = (self.triangles.len(), self.bodies.len());
            if triangle as usize >= triangles || usize::from(body) >= bodies {
                return Err(StepError::Candidate { candidate, triangle, triangles, body, bodies });
            }
        }
        let node_count = self.vertices.len();
        let held = state.contacts.iter().flat_map(|contact| contact.nodes);
        let mut named = state.forces.iter().map(|(node, _)| *node).chain(held);
        if let Some(node) = named.find(|node| *node as usize >= node_count) {
            return Err(StepError::Node { node, node_count });
        }
        MassProperties::of(self.elasticity.body, settings.density).map_or_else(
            || setting("the density", settings.density, "a positive number of kg/m³"),
            Ok,
        )
    }

    /// The response of all nodes that the step can meet.
    fn response(&self, state: &ObjectState) -> Response<'_> {
        let near = self.candidates.iter().flat_map(|c| self.triangles[c.triangle as usize]);
        let forced = state.forces.iter().map(|(node, _)| *node);
        let held = state.contacts.iter().flat_map(|contact| contact.nodes);
        let mut rows: Vec<u32> = near.chain(forced).chain(held).collect();
        rows.sort_unstable();
        rows.dedup();
        Response::new(self.elasticity, rows)
    }

    fn outcome(
        &self,
        scene: &Scene<'_>,
        response: &Response<'_>,
        found: &Found,
        wanted: &[u32],
    ) -> StepOutcome {
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
                state: crate::contact::coulomb::state_of(&local, body.friction),
            });
        }
        let force_max = contacts.iter().map(|c| c.force.norm()).fold(0.0, f64::max);
        let relative = if force_max > 0.0 { found.residual / force_max } else { 0.0 };
        let violation = |(point, force): &(ProblemPoint, Vector3<f64>)| {
            let friction = self.bodies[usize::from(point.point.body)].friction;
            crate::contact::coulomb::FrictionCone { friction }.violation(point.local(force))
        };
        StepOutcome {
            state: ObjectState {
                world_from_object,
                velocity: end.motion.velocity,
                angular_velocity: end.motion.settled_angular_velocity(&scene.rigid.mass),
                forces: end.forces.clone(),
                contacts: merged(&end.contacts),
            },
            displacements: response.displacement_of(wanted, &end.forces),
            slip_max: contacts.iter().map(|c| c.slip.norm()).fold(0.0, f64::max),
            contacts,
            loads,
            penetration_max: found.penetration,
            contact_residual: found.residual,
            contact_residual_rel: relative,
            cone_violation: found.pressing.iter().map(violation).fold(0.0, f64::max),
            residual_rel: response.residual_rel(&end.forces),
            is_converged: found.is_converged,
            rounds: found.rounds,
            sweeps: found.sweeps,
            newton_steps: found.newton_steps,
        }
    }
}

/// Where the rounds have ended.
struct Found {
    end: Configuration,
    pressing: Vec<(ProblemPoint, Vector3<f64>)>,
    penetration: f64,
    residual: f64,
    is_converged: bool,
    rounds: usize,
    sweeps: usize,
    newton_steps: usize,
}

/// The contact problem, made anew about where it ended.
struct Rounds<'s, 'r, 'a> {
    step: &'s ContactStep<'a>,
    scene: &'s Scene<'s>,
    response: &'r mut Response<'s>,
}

/// A contact problem and what it begins with.
struct Round {
    points: Vec<ProblemPoint>,
    problem: ContactProblem,
    /// Forces of the configuration it is about.
    lambda: Vec<f64>,
    residual: f64,
    penetration: f64,
}

impl Rounds<'_, '_, '_> {
    fn play(&mut self, state: &ObjectState) -> Result<Found, StepError> {
        let settings = &self.step.settings;
        let size = self.step.size();
        let allowed = settings.penetration_rel * size;
        let start = Configured {
            world_from_object: state.world_from_object,
            displacement: &self.scene.begun,
            body_forces: &[],
        };
        let is_known = |c: &&HeldContact| usize::from(c.body) < self.step.bodies.len();
        let held: Vec<HeldContact> = state.contacts.iter().filter(is_known).copied().collect();
        let mut pool = self.corners();
        held.iter().for_each(|contact| pool.add(contact.into(), &[]));
        let mut about = self.scene.configuration(self.response, held, &start);
        let (mut rounds, mut sweeps, mut newton_steps) = (0, 0, 0);
        let mut best: Option<(f64, Configuration, Round)> = None;
        loop {
            let round = self.round(&about, &mut pool, (MARGIN * size, allowed))?;
            let force_max =
                about.contacts.iter().map(|contact| contact.force.norm()).fold(0.0, f64::max);
            // How far the round is from what is asked for: at most 1 where it is met.
            let allowed_residual = settings.residual_rel * force_max;
            let far = (round.penetration / allowed).max(match allowed_residual > 0.0 {
                true => round.residual / allowed_residual,
                false if round.residual == 0.0 => 0.0,
                false => f64::INFINITY,
            });
            let is_converged = far <= 1.0;
            let is_last = rounds >= settings.rounds_max || newton_steps >= settings.newton_max;
            if is_converged || is_last {
                let is_best = best.as_ref().is_none_or(|(best_far, ..)| far <= *best_far);
                let (end, round) = match (is_best, best) {
                    (false, Some((_, end, round))) => (end, round),
                    _ => (about, round),
                };
                let (penetration, residual) = (round.penetration, round.residual);
                let pressing = round.into_pressing();
                return Ok(Found {
                    end,
                    pressing,
                    penetration,
                    residual,
                    is_converged,
                    rounds,
                    sweeps,
                    newton_steps,
                });
            }
            // A problem that will be made anew is solved no better than that is worth.
            let budget = SolveBudget {
                residual_rel: 0.1 * settings.residual_rel,
                residual: INEXACT * round.residual,
                attempts_max: ATTEMPTS,
            };
            let solution = round.problem.solve(&round.lambda, budget);
            rounds += 1;
            sweeps += solution.sweeps;
            newton_steps += solution.newton_steps;
            let contacts = pressing(&round.points, &solution.lambda);
            let next = self.scene.configuration(self.response, contacts, &about.configured());
            let about_now = std::mem::replace(&mut about, next);
            if best.as_ref().is_none_or(|(best_far, ..)| far < *best_far) {
                best = Some((far, about_now, round));
            }
        }
    }

    /// The corners of all candidates.
    fn corners(&self) -> Pool {
        let corner =
            |c: &Candidate| self.step.triangles[c.triangle as usize].map(|node| (c.body, node));
        let corners: BTreeSet<(u16, u32)> = self.step.candidates.iter().flat_map(corner).collect();
        let corner = |(body, node)| MaterialPoint::corner(body, node);
        Pool { corners: corners.into_iter().map(corner).collect(), inside: Vec::new() }
    }

    /// The contact problem about a configuration, and how well the configuration answers it. Points
    /// that are missing join the pool.
    fn round(
        &mut self,
        about: &Configuration,
        pool: &mut Pool,
        (margin, allowed): (f64, f64),
    ) -> Result<Round, StepError> {
        let (scene, at) = (self.scene, about.configured());
        let bodies = scene.object_from_bodies(&at);
        let mut penetration: f64 = 0.0;
        for (point, distance) in scene.deepest_points(self.response, &at, &bodies) {
            penetration = penetration.max(-distance);
            if distance < -0.5 * allowed {
                pool.add(point, &about.contacts);
            }
        }
        let force_of = |point: &MaterialPoint| force_at(&about.contacts, point);
        let mut chosen = Vec::new();
        for point in pool.iter() {
            let gap = scene.gap(self.response, &at, &bodies, point);
            let force = force_of(point);
            if gap.distance < margin || force.is_some() {
                penetration = penetration.max(-gap.distance);
                chosen.push((*point, gap, force.unwrap_or_default()));
            }
        }
        self.response.need(chosen.iter().flat_map(|(p, ..)| p.weighted()).map(|(n, _)| n))?;
        let mut points = Vec::with_capacity(chosen.len());
        let mut lambda = Vec::with_capacity(3 * chosen.len());
        for (point, gap, force) in chosen {
            let point = ProblemPoint::new(scene, self.response, point, gap);
            lambda.extend(point.local(&force).iter());
            points.push(point);
        }
        let problem = problem(scene, self.response, about, &points)?;
        let residual = problem.residual_of(&lambda, &problem.motion(&lambda));
        Ok(Round { points, problem, lambda, residual, penetration })
    }
}

impl Round {
    /// The points that press, and their forces in the object's frame.
    fn into_pressing(self) -> Vec<(ProblemPoint, Vector3<f64>)> {
        let forces = self.lambda.chunks_exact(3).map(Vector3::from_column_slice);
        let pressing = self.points.into_iter().zip(forces).filter(|(_, local)| local.x > 0.0);
        pressing
            .map(|(point, local)| {
                let force = point.frame * local;
                (point, force)
            })
            .collect()
    }
}

/// The contacts that press.
fn pressing(points: &[ProblemPoint], lambda: &[f64]) -> Vec<HeldContact> {
    let forces = lambda.chunks_exact(3).map(Vector3::from_column_slice);
    points
        .iter()
        .zip(forces)
        .filter(|(_, local)| local.x > 0.0)
        .map(|(point, local)| HeldContact {
            body: point.point.body,
            nodes: point.point.nodes,
            weights: point.point.weights,
            force: point.frame * local,
        })
        .collect()
}
