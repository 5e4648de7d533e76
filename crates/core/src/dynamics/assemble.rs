//! The contact problem of a step, linearised about one configuration: `W`, `b`, and the frames of points.

use nalgebra::{DMatrix, Matrix3, Vector3};

use super::configuration::{Configuration, Scene};
use super::features::{Gap, MaterialPoint};
use super::rigid_motion::Wrench;
use super::rolling::Rolling;
use crate::contact::coulomb::{
    ContactProblem, Delassus, FrictionCone, PointForce, PointLaw, PointPlace, ProblemError, Slide,
};
use crate::rigid_body::Barycentric;
use crate::solve::condensed::{FreeBody, HeldCompliance, Relief, Response};

/// A point in the problem.
pub(super) struct ProblemPoint {
    pub point: MaterialPoint,
    pub gap: Gap,
    /// Normal and two tangents as columns, in the object's frame.
    pub frame: Matrix3<f64>,
    /// From the centre of mass, in the object's frame.
    arm: Vector3<f64>,
    relief: Relief,
}

impl ProblemPoint {
    pub fn new(scene: &Scene<'_>, response: &Response<'_>, point: MaterialPoint, gap: Gap) -> Self {
        let normal = gap.normal.into_inner();
        let tangent = tangent_of(&normal);
        Self {
            point,
            gap,
            frame: Matrix3::from_columns(&[normal, tangent, normal.cross(&tangent)]),
            arm: gap.place - scene.rigid.mass.centre,
            relief: response.relief_of(&point.nodes, &point.weights),
        }
    }

    /// Where the point is from where it would be if it stuck to the body, m, in the object's frame.
    fn slip(
        &self,
        scene: &Scene<'_>,
        response: &Response<'_>,
        about: &Configuration,
    ) -> Vector3<f64> {
        self.gap.place - scene.stuck(response, &about.configured(), &self.point)
    }

    /// What Coulomb's law allows the body that the point touches.
    fn cone(&self, scene: &Scene<'_>) -> FrictionCone {
        FrictionCone { friction: scene.bodies[usize::from(self.point.body)].friction }
    }

    /// Adds the point's held displacement under a share of the forces at the node of some columns, m/N.
    fn add_held(&self, columns: &HeldCompliance<'_>, share: f64, held: &mut Matrix3<f64>) {
        for (node, weight) in self.point.weighted() {
            *held += share * weight * columns.at(node);
        }
    }

    /// How far the point goes by a unit force along its normal, m/N, of its held displacement.
    fn own_compliance(&self, scene: &Scene<'_>, held: Matrix3<f64>) -> f64 {
        let elastic = held + FreeBody::relieved(&self.relief, &self.relief);
        let yields = scene.bodies[usize::from(self.point.body)].compliance * Matrix3::identity();
        let own = scene.answered() * elastic + scene.rigid.compliance(&self.arm) + yields;
        let normal = self.frame.column(0);
        normal.dot(&(own * normal))
    }

    /// A force in the object's frame as normal and tangential parts.
    pub fn local(&self, force: &Vector3<f64>) -> PointForce {
        self.frame.transpose() * force
    }
}

/// A unit vector across another: from the axis that it is least along.
fn tangent_of(normal: &Vector3<f64>) -> Vector3<f64> {
    let mut axis = Vector3::zeros();
    axis[normal.iamin()] = 1.0;
    normal.cross(&axis).normalize()
}

/// `W` and `b` of some points about a configuration, and of the springs by which their forces move.
///
/// Shapes: `unpressed` the displacement of the response's rows if nothing pressed, m. The springs are
/// points of the problem behind the others, with their normal alone.
///
/// # Errors
/// [`ProblemError`] where a number is not finite.
pub(super) fn problem(
    scene: &Scene<'_>,
    response: &Response<'_>,
    (about, unpressed): (&Configuration, &[Vector3<f64>]),
    (points, rollings): (&[ProblemPoint], &[Rolling]),
) -> Result<ContactProblem, ProblemError> {
    let all: Vec<&ProblemPoint> = points.iter().collect();
    let w = operator(scene, response, about, (&all, rollings))?;
    let change = FreeChange::new(scene, response, (about, unpressed));
    let mut b = Vec::with_capacity(3 * (points.len() + rollings.len()));
    b.extend(
        points.iter().flat_map(|point| change.of_point(point, point.slip(scene, response, about))),
    );
    b.extend(rollings.iter().flat_map(|r| [change.of_rolling(&points[r.position], r), 0.0, 0.0]));
    let cones = points.iter().map(|point| PointLaw::Contact(point.cone(scene)));
    let springs = rollings.iter().map(|r| PointLaw::Spring { stiffness: r.stiffness });
    ContactProblem::between_corners(w, b, cones.chain(springs).collect())
}

/// A corner of the surface as one body presses on it.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Corner {
    body: u16,
    node: u32,
}

/// `W`: place of every point per force at every point, by the compliance between the corners around them;
/// behind them the same of the springs.
///
/// # Errors
/// [`ProblemError::NotFinite`].
pub(super) fn operator(
    scene: &Scene<'_>,
    response: &Response<'_>,
    about: &Configuration,
    (points, rollings): (&[&ProblemPoint], &[Rolling]),
) -> Result<Delassus, ProblemError> {
    let of = |p: &&ProblemPoint| {
        let body = p.point.body;
        p.point.weighted().map(move |(node, _)| Corner { body, node })
    };
    let mut corners: Vec<Corner> = points.iter().flat_map(of).collect();
    corners.sort_unstable();
    corners.dedup();
    let place = |p: &ProblemPoint, weights: Barycentric, slide: Option<Slide>| {
        let MaterialPoint { body, nodes, .. } = p.point;
        let corner = |node: u32| corners.binary_search(&Corner { body, node }).unwrap_or(0) as u32;
        PointPlace { corners: nodes.map(corner), weights, frame: p.frame, slide }
    };
    let of_points = points.iter().map(|p| place(p, p.point.weights, None));
    let of_rollings = rollings.iter().map(|r| {
        let point = points[r.position];
        let falls = point.local(&r.falls);
        let slide = Slide { weights: point.point.weights, share: [falls.y, falls.z] };
        place(point, r.weights, Some(slide))
    });
    let places = of_points.chain(of_rollings).collect();
    Delassus::try_new(compliance(scene, response, about, &corners), places)
}

/// Compliance between corners: the elastic one, the object's mass and inertia, and the bodies' own.
fn compliance(
    scene: &Scene<'_>,
    response: &Response<'_>,
    about: &Configuration,
    corners: &[Corner],
) -> DMatrix<f64> {
    let mut k = relief_and_inertia(scene, response, about, corners);
    let answered = scene.answered();
    for (j, force) in corners.iter().enumerate() {
        let columns = response.held(force.node);
        for (i, corner) in corners.iter().enumerate().skip(j) {
            let mut block = answered * columns.at(corner.node);
            if corner.body == force.body {
                let yields = scene.bodies[usize::from(force.body)].compliance;
                (0..3).for_each(|axis| block[(axis, axis)] += yields);
            }
            block += k.fixed_view::<3, 3>(3 * i, 3 * j);
            if i == j {
                block.fill_upper_triangle_with_lower_triangle();
            }
            k.fixed_view_mut::<3, 3>(3 * i, 3 * j).copy_from(&block);
            // Symmetric: what lies above the diagonal is what lies below.
            k.fixed_view_mut::<3, 3>(3 * j, 3 * i).copy_from(&block.transpose());
        }
    }
    k
}

/// The parts of the compliance between corners that come from the motions of the whole object: what
/// inertia relieves, and how mass and inertia yield. A product of two factors of eighteen columns.
fn relief_and_inertia(
    scene: &Scene<'_>,
    response: &Response<'_>,
    about: &Configuration,
    corners: &[Corner],
) -> DMatrix<f64> {
    const PARTS: usize = 18;
    let rows = 3 * corners.len();
    let (mut left, mut right) = (DMatrix::zeros(rows, PARTS), DMatrix::zeros(PARTS, rows));
    let (answered, rigid) = (scene.answered(), &scene.rigid);
    for (i, corner) in corners.iter().enumerate() {
        let (nodes, weights) = ([corner.node; 3], [1.0, 0.0, 0.0]);
        let relief = response.relief_of(&nodes, &weights);
        let arm = scene.place(response, &about.displacement, &nodes, &weights) - rigid.mass.centre;
        let ([first, second], [to_first, to_second]) = (relief.rows(), relief.columns());
        left.fixed_view_mut::<3, 6>(3 * i, 0).copy_from(&(answered * first));
        left.fixed_view_mut::<3, 6>(3 * i, 6).copy_from(&(answered * second));
        left.fixed_view_mut::<3, 6>(3 * i, 12).copy_from(&rigid.moved(&arm));
        right.fixed_view_mut::<6, 3>(0, 3 * i).copy_from(&to_first);
        right.fixed_view_mut::<6, 3>(6, 3 * i).copy_from(&to_second);
        right.fixed_view_mut::<6, 3>(12, 3 * i).copy_from(&rigid.arms(&arm));
    }
    left * right
}

/// How far the forces of a configuration are from obeying the law there, N: the largest residual of the
/// natural map.
///
/// Shapes: `lambda` 3n, N, of the points.
pub(super) fn residual(
    scene: &Scene<'_>,
    response: &Response<'_>,
    about: &Configuration,
    (points, lambda): (&[ProblemPoint], &[f64]),
) -> f64 {
    let of_point = |(point, force): (&ProblemPoint, &[f64])| {
        let mut held = Matrix3::zeros();
        for (node, of_force) in point.point.weighted() {
            point.add_held(&response.held(node), of_force, &mut held);
        }
        let own = point.own_compliance(scene, held);
        let slip = point.frame.transpose() * point.slip(scene, response, about);
        let motion = PointForce::new(point.gap.distance, slip.y, slip.z);
        let force = PointForce::from_column_slice(force);
        point.cone(scene).residual(force, motion, 1.0 / own)
    };
    let residuals = points.iter().zip(lambda.chunks_exact(3)).map(of_point);
    // A maximum passes over what is no number; here it must not.
    residuals.fold(0.0, |most, r| if r.is_nan() { f64::INFINITY } else { r.max(most) })
}

/// What changes about a configuration if no contact pressed, to first order: `b` of a problem.
struct FreeChange<'a> {
    scene: &'a Scene<'a>,
    response: &'a Response<'a>,
    about: &'a Configuration,
    unpressed: &'a [Vector3<f64>],
    /// Of the object's place, m, and of its turn, rad, in its own frame.
    shift: Vector3<f64>,
    angle: Vector3<f64>,
}

impl<'a> FreeChange<'a> {
    fn new(
        scene: &'a Scene<'a>,
        response: &'a Response<'a>,
        (about, unpressed): (&'a Configuration, &'a [Vector3<f64>]),
    ) -> Self {
        let turn = about.configured().world_from_object.rotation;
        let free = scene.rigid.motion(&Wrench::default(), &turn);
        let h = scene.rigid.seconds;
        let shift = turn.inverse() * (h * (free.velocity - about.motion.velocity));
        let angle = turn.inverse() * (h * (free.angular_velocity - about.motion.angular_velocity));
        Self { scene, response, about, unpressed, shift, angle }
    }

    /// Elastic change of a sum of nodes, m.
    fn elastic(&self, nodes: &[u32; 3], weights: &Barycentric) -> Vector3<f64> {
        let Self { scene, response, about, unpressed, .. } = self;
        scene.place(response, unpressed, nodes, weights)
            - scene.place(response, &about.displacement, nodes, weights)
    }

    /// How far a point goes from its body, m, in the object's frame.
    fn way(&self, point: &ProblemPoint) -> Vector3<f64> {
        let body = usize::from(point.point.body);
        let elastic = self.elastic(&point.point.nodes, &point.point.weights);
        let pushed = self.scene.bodies[body].compliance * self.about.body_forces[body];
        self.shift + self.angle.cross(&point.arm) + elastic - pushed
    }

    /// Gap and slip of a point, m.
    fn of_point(&self, point: &ProblemPoint, slip: Vector3<f64>) -> [f64; 3] {
        let change = self.way(point);
        let moved = point.frame.transpose() * (slip + change);
        [point.gap.distance + point.frame.column(0).dot(&change), moved.y, moved.z]
    }

    /// Rise of the triangle over the way of a rolling point, m.
    fn of_rolling(&self, point: &ProblemPoint, rolling: &Rolling) -> f64 {
        let elastic = self.elastic(&point.point.nodes, &rolling.weights);
        let along = rolling.along + self.angle.cross(&rolling.along) + elastic;
        point.frame.column(0).dot(&along) + rolling.falls.dot(&self.way(point))
    }
}
