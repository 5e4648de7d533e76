//! Finds the equilibrium of one request: follows its motion, and where that is lost goes downhill in
//! energy, along other courses too.

use nalgebra::{Matrix3, Point3, Rotation3, Vector3};

use super::cause::{self, Lost};
use super::descent::{Descended, Descent};
use super::follow::{Patience, follow};
use super::followed::{Followed, Snapshot};
use super::goal::{Goal, Wish};
use super::outcome::{Equilibrium, NoEquilibrium};
use super::shape::Shape;

/// Pieces of the motion that may fail before energy is minimised instead.
const FAILED_PIECES_MAX: u32 = 6;
/// Operations that may be spent on factors of descents: a few seconds.
const OPERATIONS_MAX: f64 = 6e10;
/// Operations of a tangent for each node, about.
const OPERATIONS_OF_A_NODE: f64 = 5e4;
/// Factors of descents at least and at most.
const FACTORS: [f64; 2] = [30.0, 1000.0];
/// Poisson's ratio from which on small pieces are tried at last.
const POISSON_OF_SMALL_PIECES: f64 = 0.48;
/// Solves and operations that may go into them.
const SOLVES_OF_SMALL_PIECES: u32 = 1500;
const OPERATIONS_OF_SMALL_PIECES: f64 = 1e10;
/// Operations of a correction for each node, about.
const OPERATIONS_OF_A_CORRECTION: f64 = 2e4;
/// Estimated error of the first of two parts.
const PART_ERROR_REL: f64 = 1e-3;
/// Pieces up to which a motion that was followed has not left the stable branch.
const PIECES_EASY: u32 = 2;

/// Goes from rest to a goal: follows the motion of all that is known, and where that is lost minimises
/// the energy. A large turn is made first, as a rigid motion.
pub(super) fn find(
    at: &mut Followed,
    goal: &Goal<'_>,
    wish: &Wish<'_>,
) -> Result<Equilibrium, NoEquilibrium> {
    let before = at.snapshot();
    let nodes = at.shape.pattern.node_count() as f64;
    let operations = at.shape.operations_of_inverse() + OPERATIONS_OF_A_NODE * nodes;
    let factors = (OPERATIONS_MAX / operations).clamp(FACTORS[0], FACTORS[1]) as u32;
    Search { at, goal, wish, factors }.run(&before)
}

/// A search for the equilibrium of one request.
struct Search<'a> {
    at: &'a mut Followed,
    goal: &'a Goal<'a>,
    wish: &'a Wish<'a>,
    /// Factors that descents may still make.
    factors: u32,
}

impl Search<'_> {
    fn run(mut self, before: &Snapshot) -> Result<Equilibrium, NoEquilibrium> {
        let (goal, wish) = (self.goal, self.wish);
        if let Some(rigid) = RigidPart::of(&self.at.shape, goal) {
            self.at.shape.q = rigid.displacements(self.at.shape.pattern.places());
            self.at.q_before.clone_from(&self.at.shape.q);
        }
        let patience = Patience { failed_pieces: FAILED_PIECES_MAX, solves: u32::MAX };
        let error = match follow(self.at, goal, wish, patience) {
            Ok(found) => return self.checked(found),
            Err(error) => error,
        };
        // What flowed on the way is not undone by a lower energy; and time that is up stays so.
        let is_hopeless =
            matches!(error, NoEquilibrium::Factor(super::FactorError::OutOfMemory { .. }));
        if self.at.shape.elements.is_plastic() || (wish.is_late)() || is_hopeless {
            return Err(error);
        }
        let lost = match self.descent().descend(goal, wish) {
            Ok(descended) => return Ok(descended.equilibrium(self.at, goal)),
            Err(lost) => lost,
        };
        if let Some(found) = self.by_other_courses(before) {
            return Ok(found);
        }
        Err(cause::of(&self.at.shape, goal, lost))
    }

    fn descent(&mut self) -> Descent<'_> {
        Descent { at: self.at, factors: &mut self.factors }
    }

    /// Tries forces and known displacements one after the other, and small pieces; the shape is the
    /// one that the search was lost at if they lead nowhere.
    fn by_other_courses(&mut self, before: &Snapshot) -> Option<Equilibrium> {
        let goal = self.goal;
        let (lost_at, counts) = (self.at.snapshot(), self.at.corrections.counts);
        if goal.forces.iter().any(|f| *f != 0.0) {
            for forces_first in [false, true] {
                self.at.restore(before.clone());
                self.at.corrections.counts = counts;
                if let Ok(descended) = self.one_after_the_other(forces_first) {
                    return Some(descended.equilibrium(self.at, goal));
                }
            }
        }
        // Where volume hardly changes, many small pieces sometimes lead further than energy does.
        if self.at.shape.elements.poisson_max() >= POISSON_OF_SMALL_PIECES {
            self.at.restore(before.clone());
            self.at.corrections.counts = counts;
            let nodes = self.at.shape.pattern.node_count() as f64;
            let more = (OPERATIONS_OF_SMALL_PIECES / (OPERATIONS_OF_A_CORRECTION * nodes)) as u32;
            let solves = counts.linear_solves + more.min(SOLVES_OF_SMALL_PIECES);
            let patience = Patience { failed_pieces: 40, solves };
            if let Ok(found) = follow(self.at, goal, self.wish, patience)
                && self.is_stable()
            {
                return Some(found);
            }
        }
        self.at.restore(lost_at);
        None
    }

    fn is_stable(&mut self) -> bool {
        self.descent().is_stable().is_ok_and(|is_stable| is_stable)
    }

    /// Known displacements first and then forces, or the other way round.
    fn one_after_the_other(&mut self, forces_first: bool) -> Result<Descended, Lost> {
        let (goal, wish, shape) = (self.goal, self.wish, &self.at.shape);
        let known: Vec<f64> = shape.hold.dofs().iter().map(|&dof| shape.q[dof as usize]).collect();
        let means = shape.hold.means(&shape.q);
        let forces = vec![0.0; goal.forces.len()];
        let half = match forces_first {
            true => Goal { q_known: &known, mask_q: &means, forces: goal.forces },
            false => Goal { forces: &forces, ..*goal },
        };
        let mut descent = self.descent();
        descent.descend(&half, &Wish { error_rel: Some(PART_ERROR_REL), ..*wish })?;
        let descended = descent.descend(goal, wish)?;
        // Not the branch that a motion in proportion leads along, as far as anybody knows.
        Ok(descended.jumped())
    }

    /// An equilibrium that was followed in many pieces, if it is stable; else the one downhill of it.
    fn checked(mut self, found: Equilibrium) -> Result<Equilibrium, NoEquilibrium> {
        let was_easy = found.substeps <= PIECES_EASY && !found.jumped;
        if was_easy || (self.wish.is_late)() || self.at.shape.elements.is_plastic() {
            return Ok(found);
        }
        let reached = self.at.snapshot();
        if self.is_stable() {
            self.at.restore(reached);
            return Ok(found);
        }
        let (goal, wish) = (self.goal, self.wish);
        match self.descent().descend(goal, wish) {
            Ok(descended) => Ok(descended.jumped().equilibrium(self.at, goal)),
            Err(lost) => Err(cause::of(&self.at.shape, goal, lost)),
        }
    }
}

/// A rotation about a centre and a translation.
pub(super) struct RigidPart {
    turn: Rotation3<f64>,
    from: Point3<f64>,
    to: Point3<f64>,
}

/// Angle from which on a body is turned before it is deformed, rad: straight lines of known nodes
/// press it together by the cosine of half of it.
const TURN_MIN: f64 = 0.7;
/// Share of the spread of the known nodes' places that they have in their second direction at least,
/// so that a rotation is determined.
const SPREAD_MIN: f64 = 1e-3;
/// Share of the motion's square that is left without its rigid part at most.
const LEFT_MAX: f64 = 0.5;

impl RigidPart {
    /// The rigid part of a motion from rest to a goal, if it is a large turn and most of the motion.
    ///
    /// Source: Kabsch, Acta Cryst. A32 (1976) 922.
    pub fn of(shape: &Shape, goal: &Goal<'_>) -> Option<Self> {
        let pairs = led_points(shape, goal);
        let count = pairs.len() as f64;
        if pairs.len() < 3 {
            return None;
        }
        let mean = |of: fn(&[Point3<f64>; 2]) -> Point3<f64>| {
            Point3::from(pairs.iter().map(|p| of(p).coords).sum::<Vector3<f64>>() / count)
        };
        let (from, to) = (mean(|p| p[0]), mean(|p| p[1]));
        let (mut moment, mut spread) = (Matrix3::zeros(), Matrix3::zeros());
        for [a, b] in &pairs {
            moment += (b - to) * (a - from).transpose();
            spread += (a - from) * (a - from).transpose();
        }
        let mut sizes: Vec<f64> = spread.symmetric_eigenvalues().iter().copied().collect();
        sizes.sort_by(f64::total_cmp);
        if !moment.iter().all(|x| x.is_finite()) || sizes[1] <= SPREAD_MIN * sizes[2] {
            return None;
        }
        let svd = moment.svd(true, true);
        let (u, v_t) = (svd.u?, svd.v_t?);
        let mut signs = Vector3::repeat(1.0);
        let least = svd.singular_values.imin();
        signs[least] = (u * v_t).determinant().signum();
        let turn = Rotation3::from_matrix_unchecked(u * Matrix3::from_diagonal(&signs) * v_t);
        let rigid = Self { turn, from, to };
        let square = |left: fn(&Self, &[Point3<f64>; 2]) -> f64| -> f64 {
            pairs.iter().map(|p| left(&rigid, p)).sum()
        };
        let whole = square(|r, [a, b]| ((b - a) - (r.to - r.from)).norm_squared());
        let left = square(|r, [a, b]| (b - r.moved(a)).norm_squared());
        let is_large = rigid.turn.angle() > TURN_MIN && left < LEFT_MAX * whole;
        is_large.then_some(rigid)
    }

    /// Displacements of the whole body, 3N, m.
    pub fn displacements(&self, places: &[Point3<f64>]) -> Vec<f64> {
        places.iter().flat_map(|p| <[f64; 3]>::from(self.moved(p) - p)).collect()
    }

    fn moved(&self, place: &Point3<f64>) -> Point3<f64> {
        self.to + self.turn * (place - self.from)
    }
}

/// Places at rest and where they are asked to go: nodes known along all axes, and means of masks.
fn led_points(shape: &Shape, goal: &Goal<'_>) -> Vec<[Point3<f64>; 2]> {
    let places = shape.pattern.places();
    let dofs = shape.hold.dofs();
    let known = dofs.windows(3).zip(goal.q_known.windows(3));
    let nodes = known.filter(|(d, _)| d[0] % 3 == 0 && d[2] == d[0] + 2).map(|(d, q)| {
        let place = places[d[0] as usize / 3];
        [place, place + Vector3::new(q[0], q[1], q[2])]
    });
    // The mean of a mask's places is what its weights make of the places' coordinates.
    let coordinates: Vec<f64> = places.iter().flat_map(|p| [p.x, p.y, p.z]).collect();
    let means = shape.hold.means(&coordinates);
    let masks = means.chunks(3).zip(goal.mask_q.chunks(3)).map(|(c, q)| {
        let place = Point3::new(c[0], c[1], c[2]);
        [place, place + Vector3::new(q[0], q[1], q[2])]
    });
    nodes.chain(masks).collect()
}
