//! The contact problem of a step, made anew about where it ended, until gaps and forces agree.

use std::collections::BTreeSet;

use nalgebra::{Isometry3, Vector3};

use super::assemble::{ProblemPoint, problem, residual};
use super::configuration::{Configuration, Configured, Scene};
use super::features::{Candidate, MaterialPoint, Pool, force_at};
use super::rolling::{Rolling, freedoms, rolled, rollings};
use super::settings::{StepError, StepSettings};
use super::state::{HeldContact, StepOutcome, mix};
use crate::contact::coulomb::{PointForce, Solution, SolveBudget};
use crate::solve::condensed::Response;

/// Points nearer to a body than this share of the object's size are in the problem from the start.
const MARGIN: f64 = 2e-3;
/// Share of a round's residual that its solution may leave.
const INEXACT: f64 = 1e-3;
/// Attempts of Newton's method in a round.
const ATTEMPTS: usize = 8;

/// Where the rounds have ended.
pub(super) struct Found {
    pub end: Configuration,
    /// Points that press, and their forces in the object's frame.
    pub pressing: Vec<(ProblemPoint, Vector3<f64>)>,
    /// Directions in which these forces move through their triangles.
    pub rollings: Vec<Rolling>,
    pub penetration: f64,
    pub residual: f64,
    /// Whether a force acts elsewhere than where the problem was made.
    pub has_moved: bool,
    pub is_converged: bool,
    /// Whether it was late before the law was met.
    pub is_late: bool,
    pub rounds: usize,
    pub sweeps: usize,
    pub newton_steps: usize,
}

/// What a step has taken so far.
#[derive(Clone, Copy, Default)]
pub(super) struct Effort {
    pub shapes: usize,
    rounds: usize,
    sweeps: usize,
    newton_steps: usize,
}

impl Effort {
    pub fn see(&mut self, found: &Found) {
        self.shapes += 1;
        self.rounds += found.rounds;
        self.sweeps += found.sweeps;
        self.newton_steps += found.newton_steps;
    }

    pub fn told(self, outcome: StepOutcome) -> StepOutcome {
        let Self { shapes, rounds, sweeps, newton_steps } = self;
        StepOutcome { shapes, rounds, sweeps, newton_steps, ..outcome }
    }
}

/// The contact problem, made anew about where it ended.
pub(super) struct Rounds<'s, 'r> {
    pub settings: &'s StepSettings,
    /// Size of the object, m.
    pub size: f64,
    pub scene: &'s Scene<'s>,
    pub response: &'r mut Response<'s>,
    /// Displacement of the response's rows at the end of the step if nothing pressed, m.
    pub unpressed: &'r [Vector3<f64>],
    /// Asked between rounds: whether the best that there is will do.
    pub is_late: &'r (dyn Fn() -> bool + Sync),
}

/// The points of a contact problem, and how well the configuration that it is about answers it.
struct Round {
    points: Vec<ProblemPoint>,
    /// Forces of the configuration it is about.
    lambda: Vec<f64>,
    /// Directions in which the forces move through their triangles.
    rollings: Vec<Rolling>,
    residual: f64,
    penetration: f64,
    /// Whether a force acts elsewhere than in the configuration that the problem is about.
    has_moved: bool,
}

impl Rounds<'_, '_> {
    /// Plays them from some contacts on, which act on an object that is placed and shaped so.
    pub fn play(
        &mut self,
        held: Vec<HeldContact>,
        start: &Configured<'_>,
    ) -> Result<Found, StepError> {
        let (settings, size) = (self.settings, self.size);
        let allowed = settings.penetration_rel * size;
        let mut pool = self.corners();
        for contact in &held {
            pool.add(contact.into(), &mut []);
        }
        let mut about = self.configuration(held, start);
        let (mut rounds, mut sweeps, mut newton_steps) = (0, 0, 0);
        let mut best: Option<(f64, Configuration, Round)> = None;
        loop {
            let round = self.round(&mut about, &mut pool, (MARGIN * size, allowed))?;
            let force_max =
                about.contacts.iter().map(|contact| contact.force.norm()).fold(0.0, f64::max);
            let far = round.far(allowed, settings.residual_rel * force_max);
            let is_converged = far <= 1.0 && !round.has_moved;
            let is_last = rounds >= settings.rounds_max || newton_steps >= settings.newton_max;
            // The last round's solution too may have ended for that.
            let is_late = !is_converged && (self.is_late)();
            if is_converged || is_last || is_late {
                let is_best = best.as_ref().is_none_or(|(best_far, ..)| far <= *best_far);
                let (end, round) = match (is_best, best) {
                    (false, Some((_, end, round))) => (end, round),
                    _ => (about, round),
                };
                let (penetration, residual) = (round.penetration, round.residual);
                let has_moved = round.has_moved;
                let (pressing, rollings) = round.into_pressing();
                return Ok(Found {
                    end,
                    pressing,
                    rollings,
                    penetration,
                    residual,
                    has_moved,
                    is_converged,
                    is_late,
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
                is_late: self.is_late,
            };
            let about_now = (&about, self.unpressed);
            let what = (round.points.as_slice(), round.rollings.as_slice());
            let problem = problem(self.scene, self.response, about_now, what)?;
            let solution = Solution::of(&problem, &round.warm(), budget);
            rounds += 1;
            sweeps += solution.sweeps;
            newton_steps += solution.newton_steps;
            let contacts = round.pressing(&solution, &mut pool);
            let next = self.configuration(contacts, &about.configured());
            let about_now = std::mem::replace(&mut about, next);
            if best.as_ref().is_none_or(|(best_far, ..)| far < *best_far) {
                best = Some((far, about_now, round));
            }
        }
    }

    /// The configuration that contact forces lead to. Their columns have been asked for.
    fn configuration(&mut self, contacts: Vec<HeldContact>, at: &Configured<'_>) -> Configuration {
        self.scene.configuration((&*self.response, self.unpressed), contacts, at)
    }

    /// Material points at the corners of all candidates.
    fn corners(&self) -> Pool {
        let corner =
            |c: &Candidate| self.scene.triangles[c.triangle as usize].map(|node| (c.body, node));
        let corners: BTreeSet<(u16, u32)> = self.scene.candidates.iter().flat_map(corner).collect();
        let corner = |(body, node)| MaterialPoint::corner(body, node);
        Pool { corners: corners.into_iter().map(corner).collect(), inside: Vec::new() }
    }

    /// The points of the contact problem about a configuration, and how well the configuration answers
    /// it. Points that are missing join the pool.
    fn round(
        &mut self,
        about: &mut Configuration,
        pool: &mut Pool,
        (margin, allowed): (f64, f64),
    ) -> Result<Round, StepError> {
        let scene = self.scene;
        let bodies = scene.object_from_bodies(&about.configured());
        let (mut penetration, mut has_moved): (f64, bool) = (0.0, false);
        let deepest = scene.deepest_points(self.response, &about.configured(), &bodies);
        for (point, distance) in deepest {
            penetration = penetration.max(-distance);
            if distance < -0.5 * allowed && !self.rolls_there(about, (&*pool, &bodies), &point) {
                has_moved |= pool.add(point, &mut about.contacts);
            }
        }
        let about = &*about;
        let at = about.configured();
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
        let (points, max) = (chosen.len(), self.settings.points_max);
        if points > max {
            return Err(StepError::TooManyPoints { points, max });
        }
        self.response.need(chosen.iter().flat_map(|(p, ..)| p.weighted()).map(|(n, _)| n))?;
        let mut points = Vec::with_capacity(chosen.len());
        let mut lambda = Vec::with_capacity(3 * chosen.len());
        for (point, gap, force) in chosen {
            let point = ProblemPoint::new(scene, self.response, point, gap);
            lambda.extend(point.local(&force).iter());
            points.push(point);
        }
        let residual = residual(scene, self.response, about, (&points, &lambda));
        let rollings = self.rollings(about, &bodies, (&points, &lambda));
        Ok(Round { points, lambda, rollings, residual, penetration, has_moved })
    }

    /// Directions in which a force at a point moves; none where its body is not round.
    fn rollings_of(
        &self,
        (about, bodies): (&Configuration, &[Isometry3<f64>]),
        point: &MaterialPoint,
        (position, force): (usize, PointForce),
    ) -> Vec<Rolling> {
        let (scene, body) = (self.scene, usize::from(point.body));
        let corners = scene.corners(self.response, &about.displacement, &point.nodes);
        let in_body = bodies[body].inverse_transform_point(&mix(&corners, &point.weights));
        let Some(curvature) = scene.bodies[body].shape.curvature(&in_body) else {
            return Vec::new();
        };
        let turn = bodies[body].rotation.to_rotation_matrix();
        let curvature = turn.matrix() * curvature * turn.matrix().transpose();
        rollings((point, &corners), &curvature, (position, force))
    }

    /// Directions in which the points with a force move.
    fn rollings(
        &self,
        about: &Configuration,
        bodies: &[Isometry3<f64>],
        (points, lambda): (&[ProblemPoint], &[f64]),
    ) -> Vec<Rolling> {
        let mut found = Vec::new();
        for (position, point) in points.iter().enumerate() {
            let force = PointForce::from_column_slice(&lambda[3 * position..3 * position + 3]);
            if force.x > 0.0 && freedoms(&point.point) > 0 {
                found.extend(self.rollings_of((about, bodies), &point.point, (position, force)));
            }
        }
        found
    }

    /// Whether a force of the same edge or triangle moves to a deepest point by itself.
    fn rolls_there(
        &self,
        about: &Configuration,
        (pool, bodies): (&Pool, &[Isometry3<f64>]),
        deepest: &MaterialPoint,
    ) -> bool {
        let is_beside = |p: &&MaterialPoint| p.body == deepest.body && p.nodes == deepest.nodes;
        let freedoms = freedoms(deepest);
        let rolls = |point: &MaterialPoint| {
            self.rollings_of((about, bodies), point, (0, PointForce::x())).len() == freedoms
        };
        let mut beside = pool.inside.iter().filter(is_beside);
        freedoms > 0 && beside.any(|p| force_at(&about.contacts, p).is_some() && rolls(p))
    }
}

impl Round {
    /// How far the round is from an allowed penetration and residual: at most 1 where they are met.
    fn far(&self, allowed: f64, allowed_residual: f64) -> f64 {
        (self.penetration / allowed).max(match allowed_residual > 0.0 {
            true => self.residual / allowed_residual,
            false if self.residual == 0.0 => 0.0,
            false => f64::INFINITY,
        })
    }

    /// Forces to begin with: those of the configuration, and those of the springs there.
    fn warm(&self) -> Vec<f64> {
        let of_spring = |r: &Rolling| {
            let rise = self.points[r.position].frame.column(0).dot(&r.along);
            <[f64; 3]>::from(-rise * r.stiffness)
        };
        let springs = self.rollings.iter().flat_map(of_spring);
        self.lambda.iter().copied().chain(springs).collect()
    }

    /// Contacts with a force along the normal, where the forces have moved to; the pool's points move with
    /// them.
    fn pressing(&self, solution: &Solution, pool: &mut Pool) -> Vec<HeldContact> {
        let mut contacts: Vec<HeldContact> = Vec::with_capacity(self.points.len());
        let mut rollings = (self.points.len()..).zip(&self.rollings).peekable();
        for (position, point) in self.points.iter().enumerate() {
            let mut moved = Vec::new();
            while let Some((spring, rolling)) = rollings.next_if(|(_, r)| r.position == position) {
                moved.push((rolling, solution.motion[3 * spring]));
            }
            let local = solution.force(position);
            if local.x <= 0.0 {
                continue;
            }
            let to = rolled(&point.point, moved.into_iter());
            pool.roll(&point.point, to);
            let force = point.frame * local;
            match contacts.iter_mut().find(|held| to.is_same(&(&**held).into())) {
                Some(held) => held.force += force,
                None => contacts.push(HeldContact {
                    body: to.body,
                    nodes: to.nodes,
                    weights: to.weights,
                    force,
                }),
            }
        }
        contacts
    }

    /// The points that press with their forces in the object's frame, and the directions in which these move.
    fn into_pressing(self) -> (Vec<(ProblemPoint, Vector3<f64>)>, Vec<Rolling>) {
        let mut rollings = self.rollings.into_iter().peekable();
        let (mut pressing, mut rolling) = (Vec::new(), Vec::new());
        for (position, (point, local)) in
            self.points.into_iter().zip(self.lambda.chunks_exact(3)).enumerate()
        {
            let local = Vector3::from_column_slice(local);
            while let Some(of_point) = rollings.next_if(|rolling| rolling.position == position) {
                rolling.push(Rolling { position: pressing.len(), ..of_point });
            }
            if local.x > 0.0 {
                let force = point.frame * local;
                pressing.push((point, force));
            }
        }
        (pressing, rolling)
    }
}
