//! Turns the rigid bodies and the state of a contact frame into what the core takes.

use std::sync::Arc;

use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion, Vector3};
use softgrasp_core::dynamics::{HeldContact, MovingBody, ObjectState, StepSettings};
use softgrasp_core::rigid_body::{RigidMesh, RigidShape};
use softgrasp_protocol::{
    BodyMotion, BodyShape, ContactAsk, HeldContact as HeldMessage, ObjectState as StateMessage,
    Pose,
};

use crate::refusal::Refusal;

/// Rigid bodies of a contact frame, as the core takes them.
///
/// # Errors
/// [`Refusal::Body`] with the position of the body.
pub(crate) fn bodies_of(bodies: Vec<BodyMotion>) -> Result<Vec<MovingBody>, Refusal> {
    bodies.into_iter().enumerate().map(|(at, body)| body_of(at, body)).collect()
}

fn body_of(at: usize, body: BodyMotion) -> Result<MovingBody, Refusal> {
    let refuse = |reason: String| Refusal::Body { body: at, reason };
    Ok(MovingBody {
        shape: shape_of(body.shape).map_err(refuse)?,
        world_from_body_start: pose_of(&body.start).ok_or_else(|| refuse(NO_POSE.to_owned()))?,
        world_from_body_end: pose_of(&body.end).ok_or_else(|| refuse(NO_POSE.to_owned()))?,
        friction: body.friction,
        compliance: body.compliance,
    })
}

const NO_POSE: &str =
    "a pose must be seven finite numbers, the last four a quaternion that is not zero";

fn shape_of(shape: BodyShape) -> Result<RigidShape, String> {
    let made = match shape {
        BodyShape::Sphere { radius } => RigidShape::sphere(radius),
        BodyShape::Capsule { radius, length } => RigidShape::capsule(radius, length),
        BodyShape::Plane { normal } => RigidShape::plane(Vector3::from(normal)),
        BodyShape::Box { half } => RigidShape::cuboid(Vector3::from(half)),
        BodyShape::RoundedBox { half, radius } => {
            RigidShape::rounded_cuboid(Vector3::from(half), radius)
        }
        BodyShape::Mesh { vertices, triangles } => return mesh_of(vertices, &triangles, 0.0),
        BodyShape::RoundedMesh { vertices, triangles, radius } => {
            return mesh_of(vertices, &triangles, radius);
        }
    };
    made.map_err(|error| error.to_string())
}

/// A closed surface of triangles with all points within a radius of it, m.
fn mesh_of(
    vertices: Vec<[f64; 3]>,
    triangles: &[[u32; 3]],
    radius: f64,
) -> Result<RigidShape, String> {
    let vertices: Vec<Point3<f64>> = vertices.into_iter().map(Point3::from).collect();
    let mesh = RigidMesh::try_new(&vertices, triangles).and_then(|mesh| mesh.with_radius(radius));
    mesh.map(|mesh| RigidShape::Mesh(Arc::new(mesh))).map_err(|error| error.to_string())
}

/// Pose with its quaternion normalised; `None` if it is no pose.
fn pose_of(pose: &Pose) -> Option<Isometry3<f64>> {
    let [x, y, z, w, i, j, k] = *pose;
    let quaternion = Quaternion::new(w, i, j, k);
    let is_sound = pose.iter().all(|x| x.is_finite()) && quaternion.norm() > 0.0;
    is_sound.then(|| {
        let turn = UnitQuaternion::new_normalize(quaternion);
        Isometry3::from_parts(Translation3::new(x, y, z), turn)
    })
}

/// State of the object as the core takes it.
///
/// # Errors
/// [`Refusal::Body`] if the pose is none.
pub(crate) fn state_of(state: StateMessage) -> Result<ObjectState, Refusal> {
    let no_pose = Refusal::ObjectPose { reason: NO_POSE };
    let forces = state.force_nodes.into_iter().zip(state.forces);
    let held = |contact: HeldMessage| HeldContact {
        // A body that the wire can name and core cannot is none of the frame's.
        body: u16::try_from(contact.body).unwrap_or(u16::MAX),
        nodes: contact.nodes,
        weights: contact.weights,
        force: Vector3::from(contact.force),
    };
    Ok(ObjectState {
        world_from_object: pose_of(&state.pose).ok_or(no_pose)?,
        velocity: Vector3::from(state.velocity),
        angular_velocity: Vector3::from(state.angular_velocity),
        forces: forces.map(|(node, force)| (node, Vector3::from(force))).collect(),
        contacts: state.contacts.into_iter().map(held).collect(),
    })
}

/// State of the object as a message.
pub(crate) fn state_message(state: &ObjectState) -> StateMessage {
    let held = |contact: &HeldContact| HeldMessage {
        body: u32::from(contact.body),
        nodes: contact.nodes,
        weights: contact.weights,
        force: contact.force.into(),
    };
    StateMessage {
        pose: pose_message(&state.world_from_object),
        velocity: state.velocity.into(),
        angular_velocity: state.angular_velocity.into(),
        force_nodes: state.forces.iter().map(|(node, _)| *node).collect(),
        forces: state.forces.iter().map(|(_, force)| (*force).into()).collect(),
        contacts: state.contacts.iter().map(held).collect(),
    }
}

fn pose_message(pose: &Isometry3<f64>) -> Pose {
    let (place, turn) = (pose.translation.vector, pose.rotation);
    [place.x, place.y, place.z, turn.w, turn.i, turn.j, turn.k]
}

/// Settings of a step by the client's wishes, within the server's limits.
pub(crate) fn settings_of(ask: &ContactAsk) -> StepSettings {
    let most = |asked: u32, most: u32| asked.min(most) as usize;
    StepSettings {
        seconds: ask.seconds,
        gravity: Vector3::from(ask.gravity),
        density: ask.density,
        viscosity: ask.viscosity,
        penetration_rel: ask.penetration_rel,
        residual_rel: ask.residual_rel,
        rounds_max: most(ask.rounds_max, ROUNDS_MAX),
        newton_max: most(ask.newton_max, NEWTON_MAX),
        points_max: StepSettings::POINTS_USUAL,
        small_system: ask.small_system,
    }
}

/// Largest numbers of rounds and of steps of Newton's method in one contact frame.
const ROUNDS_MAX: u32 = 64;
const NEWTON_MAX: u32 = 4000;
