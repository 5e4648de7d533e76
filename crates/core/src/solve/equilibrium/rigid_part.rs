//! The rigid motion that comes nearest to what is asked of known nodes and masks.

use nalgebra::{Matrix3, Point3, Rotation3, Vector3};

use super::goal::Goal;
use super::shape::Shape;

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
