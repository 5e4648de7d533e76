//! The contact problem of a step, linearised about one configuration: `W`, `b`, and the frames of points.

use nalgebra::{DMatrix, Matrix3, Vector3};

use super::configuration::{Configuration, Scene};
use super::features::{Gap, MaterialPoint};
use super::rigid_motion::Wrench;
use crate::contact::coulomb::{ContactProblem, FrictionCone, PointForce, ProblemError};
use crate::solve::condensed::{Relief, Response};

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
            relief: response.body().relief_of(&point.nodes, &point.weights),
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
/// # Errors
/// [`ProblemError`] where a number is not finite.
pub(super) fn problem(
    scene: &Scene<'_>,
    response: &Response<'_>,
    about: &Configuration,
    points: &[ProblemPoint],
) -> Result<ContactProblem, ProblemError> {
    let w = operator(scene, response, points);
    let b = free_motion(scene, response, about, points);
    let friction = |p: &ProblemPoint| scene.bodies[usize::from(p.point.body)].friction;
    let cones = points.iter().map(|p| FrictionCone { friction: friction(p) }).collect();
    ContactProblem::try_new(w, b, cones)
}

/// `W`: place of every point per force at every point.
fn operator(scene: &Scene<'_>, response: &Response<'_>, points: &[ProblemPoint]) -> DMatrix<f64> {
    let n = points.len();
    let answered = scene.answered();
    let mut w = DMatrix::zeros(3 * n, 3 * n);
    let mut moved = vec![Matrix3::zeros(); response.rows().len()];
    let rows: Vec<[Option<usize>; 3]> =
        points.iter().map(|p| p.point.nodes.map(|node| response.row_of(node))).collect();
    for (j, force) in points.iter().enumerate() {
        // Held displacement of all rows under the force of this point.
        moved.fill(Matrix3::zeros());
        for (&node, &weight) in force.point.nodes.iter().zip(&force.point.weights) {
            if weight != 0.0 {
                for (moved, block) in moved.iter_mut().zip(response.held(node)) {
                    *moved += weight * block;
                }
            }
        }
        // Symmetric: what lies above the diagonal is what lies below.
        for i in j..n {
            let point = &points[i];
            let mut elastic = response.body().relieved(&point.relief, &force.relief);
            for (row, &weight) in rows[i].iter().zip(&point.point.weights) {
                if let Some(row) = row {
                    elastic += weight * moved[*row];
                }
            }
            let mut rigid = scene.rigid.compliance(&point.arm, &force.arm);
            if point.point.body == force.point.body {
                let yields = scene.bodies[usize::from(force.point.body)].compliance;
                rigid += yields * Matrix3::identity();
            }
            let block = point.frame.transpose() * (answered * elastic + rigid) * force.frame;
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

/// `b`: gap and slip of every point if no contact pressed, to first order about the configuration.
fn free_motion(
    scene: &Scene<'_>,
    response: &Response<'_>,
    about: &Configuration,
    points: &[ProblemPoint],
) -> Vec<f64> {
    let at = about.configured();
    let turn = at.world_from_object.rotation;
    let free = scene.rigid.motion(&Wrench::default(), &turn);
    let h = scene.rigid.seconds;
    let shift = turn.inverse() * (h * (free.velocity - about.motion.velocity));
    let angle = turn.inverse() * (h * (free.angular_velocity - about.motion.angular_velocity));
    let unpressed = response.displacement(&scene.elastic_forces(&[]));
    let mut b = Vec::with_capacity(3 * points.len());
    for p in points {
        let point = &p.point;
        let elastic = scene.place(response, &unpressed, &point.nodes, &point.weights)
            - scene.place(response, &about.displacement, &point.nodes, &point.weights);
        let body = usize::from(point.body);
        let pushed = scene.bodies[body].compliance * about.body_forces[body];
        let change = shift + angle.cross(&p.arm) + elastic - pushed;
        let slip = p.gap.place - scene.stuck(response, &at, point);
        let normal = p.frame.column(0);
        let moved = p.frame.transpose() * (slip + change);
        b.extend([p.gap.distance + normal.dot(&change), moved.y, moved.z]);
    }
    b
}
