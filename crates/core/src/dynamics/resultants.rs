//! Makes the small system of a step from the points that press at its end.
//!
//! A body that presses holds its points: where it goes by δx, each point that it presses on goes by δx,
//! so that `W δλ = S δx` with S from the bodies to their points, and the resultants change by
//! `δF = Sᵀ δλ = K δx` with `K = Sᵀ W⁻¹ S`. The compliance is `C = K⁻¹`. W is the operator of the step,
//! with viscosity, the object's mass and the compliances of the bodies in it, and with the springs by which
//! forces move through triangles that tilt. K says how the forces of this
//! step follow the places at which its bodies end if all points that press stick to their bodies; how far
//! steps are from that is in the tests.

use faer::linalg::solvers::{Llt, Solve};
use faer::{Mat, Side};
use nalgebra::{DMatrix, Matrix3, Point3, Vector3};

use super::assemble::{ProblemPoint, operator};
use super::configuration::Scene;
use super::rolling::Rolling;
use super::rounds::Found;
use super::small_system::{BodyContact, SmallSystem};
use crate::solve::condensed::Response;

/// Points of a small system: the factor of its operator grows with the cube.
const POINTS_MAX: usize = 200;
/// Share of its own compliance that is added to each point: points that say nearly the same leave the
/// operator without an inverse.
const ADDED: f64 = 1e-7;

/// The small system of the points that press at the end of a step; `None` where there are too many, or
/// they have no inverse.
pub(super) fn small_system(
    scene: &Scene<'_>,
    response: &Response<'_>,
    found: &Found,
) -> Option<SmallSystem> {
    let points: Vec<&ProblemPoint> = found.pressing.iter().map(|(point, _)| point).collect();
    if points.len() > POINTS_MAX {
        return None;
    }
    let turn = found.end.motion.world_from_object.rotation;
    let bodies = pressing_bodies(found);
    let contacts =
        bodies.iter().map(|&body| contact(scene, found, body)).collect::<Option<Vec<_>>>()?;
    if contacts.is_empty() {
        return Some(SmallSystem { contacts, compliance: DMatrix::zeros(0, 0) });
    }
    let w = compliance_of_points(scene, response, found, &points)?;
    let rows = w.nrows();
    let entry = |r: usize, c: usize| w[(r, c)] * if r == c { 1.0 + ADDED } else { 1.0 };
    let factor = Llt::new(Mat::from_fn(rows, rows, entry).as_ref(), Side::Lower).ok()?;
    let mut moved = Mat::zeros(rows, 3 * bodies.len());
    for (i, point) in points.iter().enumerate() {
        let at = bodies.binary_search(&point.point.body).ok()?;
        let world_from_point: Matrix3<f64> = turn.to_rotation_matrix().matrix() * point.frame;
        for r in 0..3 {
            for c in 0..3 {
                moved[(3 * i + r, 3 * at + c)] = world_from_point[(c, r)];
            }
        }
    }
    let forces = factor.solve(&moved);
    let stiffness = moved.transpose() * forces;
    let size = 3 * bodies.len();
    let stiffness =
        DMatrix::from_fn(size, size, |r, c| 0.5 * (stiffness[(r, c)] + stiffness[(c, r)]));
    let compliance = stiffness.cholesky()?.inverse();
    let compliance = 0.5 * (&compliance + compliance.transpose());
    let is_finite = compliance.iter().all(|c| c.is_finite());
    is_finite.then_some(SmallSystem { contacts, compliance })
}

/// Place of every point per force at every point, if the forces move through their triangles as these tilt.
///
/// Shapes: 3n × 3n, m/N, symmetric: of a force that moves, its part along the normal is counted.
fn compliance_of_points(
    scene: &Scene<'_>,
    response: &Response<'_>,
    found: &Found,
    points: &[&ProblemPoint],
) -> Option<DMatrix<f64>> {
    // A point that sticks to its body does not slide along it: the triangle's own rise is left.
    let stuck = |rolling: &Rolling| Rolling { falls: Vector3::zeros(), ..rolling.clone() };
    let rollings: Vec<Rolling> = found.rollings.iter().map(stuck).collect();
    let w = operator(scene, response, &found.end, (points, &rollings)).ok()?.to_matrix();
    let (n, springs) = (3 * points.len(), rollings.len());
    let spring = |k: usize| n + 3 * k;
    let stiffness = |k: usize| rollings[k].stiffness.x;
    let between = DMatrix::from_fn(n, springs, |r, k| w[(r, spring(k))]);
    let own = DMatrix::from_fn(springs, springs, |j, k| {
        let yields = if j == k { 1.0 / stiffness(k) } else { 0.0 };
        yields + w[(spring(j), spring(k))]
    });
    let relieved = own.cholesky()?.solve(&between.transpose());
    Some(w.view((0, 0), (n, n)) - &between * relieved)
}

/// Bodies with a point that presses, ascending.
fn pressing_bodies(found: &Found) -> Vec<u16> {
    let mut bodies: Vec<u16> = found.pressing.iter().map(|(point, _)| point.point.body).collect();
    bodies.sort_unstable();
    bodies.dedup();
    bodies
}

/// The points of a body as one contact; `None` where the normals cancel.
fn contact(scene: &Scene<'_>, found: &Found, body: u16) -> Option<BodyContact> {
    let world_from_object = found.end.motion.world_from_object;
    let (mut force, mut normal) = (Vector3::zeros(), Vector3::zeros());
    let (mut place, mut weight) = (Vector3::zeros(), 0.0);
    for (point, of_point) in found.pressing.iter().filter(|(p, _)| p.point.body == body) {
        let pressing = point.local(of_point).x;
        force += of_point;
        normal += pressing * point.gap.normal.into_inner();
        place += pressing * point.gap.place.coords;
        weight += pressing;
    }
    let normal = normal.try_normalize(1e-6 * weight)?;
    Some(BodyContact {
        body,
        place: world_from_object * Point3::from(place / weight),
        normal: world_from_object.rotation * normal,
        force: world_from_object.rotation * force,
        friction: scene.bodies[usize::from(body)].friction,
    })
}
