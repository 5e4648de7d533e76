//! The contact problem of a step, linearised about one configuration: `W`, `b`, and the frames of points.

use nalgebra::{DMatrix, Matrix3, Vector3};

use super::configuration::{Configuration, Scene};
use super::features::{Gap, MaterialPoint};
use super::rigid_motion::Wrench;
use crate::contact::coulomb::{ContactProblem, FrictionCone, PointForce, ProblemError};
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

/// `W` and `b` of some points about a configuration.
///
/// Shapes: `unpressed` the displacement of the response's rows if nothing pressed, m.
///
/// # Errors
/// [`ProblemError`] where a number is not finite.
pub(super) fn problem(
    scene: &Scene<'_>,
    response: &Response<'_>,
    (about, unpressed): (&Configuration, &[Vector3<f64>]),
    points: &[ProblemPoint],
) -> Result<ContactProblem, ProblemError> {
    let all: Vec<&ProblemPoint> = points.iter().collect();
    let w = operator(scene, response, &all);
    let b = free_motion(scene, response, (about, unpressed), points);
    let cones = points.iter().map(|point| point.cone(scene)).collect();
    ContactProblem::try_new(w, b, cones)
}

/// `W`: place of every point per force at every point.
pub(super) fn operator(
    scene: &Scene<'_>,
    response: &Response<'_>,
    points: &[&ProblemPoint],
) -> DMatrix<f64> {
    let n = points.len();
    let mut w = DMatrix::zeros(3 * n, 3 * n);
    // Held displacement of every point under the force of one.
    let mut moved = vec![Matrix3::zeros(); n];
    for (j, force) in points.iter().enumerate() {
        moved[j..].fill(Matrix3::zeros());
        for (node, of_force) in force.point.weighted() {
            let columns = response.held(node);
            for (moved, point) in moved[j..].iter_mut().zip(&points[j..]) {
                point.add_held(&columns, of_force, moved);
            }
        }
        // Symmetric: what lies above the diagonal is what lies below.
        for i in j..n {
            let block = block(scene, points[i], force, &moved[i]);
            w.fixed_view_mut::<3, 3>(3 * i, 3 * j).copy_from(&block);
            if i != j {
                w.fixed_view_mut::<3, 3>(3 * j, 3 * i).copy_from(&block.transpose());
            }
        }
        let own = w.fixed_view::<3, 3>(3 * j, 3 * j).into_owned();
        let symmetric = 0.5 * (own + own.transpose());
        w.fixed_view_mut::<3, 3>(3 * j, 3 * j).copy_from(&symmetric);
    }
    w
}

/// One block of `W`, in the frames of its points, from the held displacement of the first.
fn block(
    scene: &Scene<'_>,
    point: &ProblemPoint,
    force: &ProblemPoint,
    held: &Matrix3<f64>,
) -> Matrix3<f64> {
    let elastic = held + FreeBody::relieved(&point.relief, &force.relief);
    let mut rigid = scene.rigid.compliance(&point.arm, &force.arm);
    if point.point.body == force.point.body {
        let yields = scene.bodies[usize::from(force.point.body)].compliance;
        rigid += yields * Matrix3::identity();
    }
    point.frame.transpose() * (scene.answered() * elastic + rigid) * force.frame
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
        let own = block(scene, point, point, &held);
        let slip = point.frame.transpose() * point.slip(scene, response, about);
        let motion = PointForce::new(point.gap.distance, slip.y, slip.z);
        let force = PointForce::from_column_slice(force);
        point.cone(scene).residual(force, motion, 1.0 / own[(0, 0)])
    };
    let residuals = points.iter().zip(lambda.chunks_exact(3)).map(of_point);
    // A maximum passes over what is no number; here it must not.
    residuals.fold(0.0, |most, r| if r.is_nan() { f64::INFINITY } else { r.max(most) })
}

/// `b`: gap and slip of every point if no contact pressed, to first order about the configuration.
fn free_motion(
    scene: &Scene<'_>,
    response: &Response<'_>,
    (about, unpressed): (&Configuration, &[Vector3<f64>]),
    points: &[ProblemPoint],
) -> Vec<f64> {
    let at = about.configured();
    let turn = at.world_from_object.rotation;
    let free = scene.rigid.motion(&Wrench::default(), &turn);
    let h = scene.rigid.seconds;
    let shift = turn.inverse() * (h * (free.velocity - about.motion.velocity));
    let angle = turn.inverse() * (h * (free.angular_velocity - about.motion.angular_velocity));
    let mut b = Vec::with_capacity(3 * points.len());
    for p in points {
        let point = &p.point;
        let elastic = scene.place(response, unpressed, &point.nodes, &point.weights)
            - scene.place(response, &about.displacement, &point.nodes, &point.weights);
        let body = usize::from(point.body);
        let pushed = scene.bodies[body].compliance * about.body_forces[body];
        let change = shift + angle.cross(&p.arm) + elastic - pushed;
        let normal = p.frame.column(0);
        let moved = p.frame.transpose() * (p.slip(scene, response, about) + change);
        b.extend([p.gap.distance + normal.dot(&change), moved.y, moved.z]);
    }
    b
}
