//! Makes contact frames: the deformed surface, the bodies near it, and the triangles that can touch them.

use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion};
use softgrasp_core::dynamics::{self, Candidate, MovingBody, near_triangles};
use softgrasp_protocol::{
    BodyMotion, BodyShape, ContactAsk, ContactFrame, FieldSet, ModelHash, NodeChoice, ObjectState,
    Pose, Precision,
};

/// Rigid body of a step: for the search of triangles, and as it travels.
#[derive(Clone, Debug)]
pub struct StepBody {
    /// Shape and poses of the body, for the search.
    pub moving: MovingBody,
    /// Shape of the body on the wire.
    pub shape: BodyShape,
}

/// Object whose steps are asked for.
pub struct StepObject<'a> {
    /// Name of the kept model.
    pub model: ModelHash,
    /// Positions of all nodes at rest, m, in the object's frame.
    pub vertices: &'a [Point3<f64>],
    /// Triangles of the boundary surface.
    pub triangles: &'a [[u32; 3]],
    /// Displacement of every node, m, in the object's frame; zero where it is not known.
    pub displacement: &'a [[f64; 3]],
    /// Nodes whose displacements are wanted.
    pub nodes: NodeChoice,
}

impl StepObject<'_> {
    /// Contact frame of one step from a state; triangles that can touch are found among all.
    pub fn frame(&self, state: ObjectState, bodies: &[StepBody], ask: ContactAsk) -> ContactFrame {
        let places: Vec<Point3<f64>> = self
            .vertices
            .iter()
            .zip(self.displacement)
            .map(|(rest, u)| Point3::new(rest.x + u[0], rest.y + u[1], rest.z + u[2]))
            .collect();
        let moving: Vec<MovingBody> = bodies.iter().map(|body| body.moving.clone()).collect();
        let world_from_object = isometry_of(&state.pose);
        let margin = reach_of_step(extent(self.vertices), &state, &moving, &ask);
        let near = near_triangles(&places, self.triangles, &world_from_object, &moving, margin);
        self.frame_among(state, bodies, ask, &near)
    }

    /// Contact frame of one step in which only the `near` triangles can touch bodies.
    pub fn frame_among(
        &self,
        state: ObjectState,
        bodies: &[StepBody],
        ask: ContactAsk,
        near: &[Candidate],
    ) -> ContactFrame {
        let motion = |body: &StepBody| BodyMotion {
            shape: body.shape.clone(),
            start: pose_of(&body.moving.world_from_body_start),
            end: pose_of(&body.moving.world_from_body_end),
            friction: body.moving.friction,
            compliance: body.moving.compliance,
        };
        ContactFrame {
            model: self.model,
            ask,
            state,
            bodies: bodies.iter().map(motion).collect(),
            triangles: near.iter().map(|c| self.triangles[c.triangle as usize]).collect(),
            triangle_bodies: near.iter().map(|c| u32::from(c.body)).collect(),
            nodes: self.nodes.clone(),
            precision: Precision::F64,
            fields: FieldSet::NONE,
        }
    }
}

/// Distance from a body within which a triangle may touch it in a step.
///
/// Units: m.
pub fn reach_of_step(
    extent: f64,
    state: &ObjectState,
    bodies: &[MovingBody],
    ask: &ContactAsk,
) -> f64 {
    let norm = |v: &[f64; 3]| v[0].hypot(v[1]).hypot(v[2]);
    let speed = norm(&state.velocity) + norm(&ask.gravity) * ask.seconds;
    let turning = norm(&state.angular_velocity);
    dynamics::reach_of_step(extent, bodies, ask.seconds, (speed, turning))
}

/// Largest distance of a node from the first one, m.
pub fn extent(vertices: &[Point3<f64>]) -> f64 {
    let Some(first) = vertices.first() else { return 0.0 };
    vertices.iter().map(|v| (v - first).norm()).fold(0.0, f64::max)
}

/// Pose as it travels.
pub fn pose_of(pose: &Isometry3<f64>) -> Pose {
    let (place, turn) = (pose.translation.vector, pose.rotation);
    [place.x, place.y, place.z, turn.w, turn.i, turn.j, turn.k]
}

/// Isometry of a pose that has travelled.
pub fn isometry_of(pose: &Pose) -> Isometry3<f64> {
    let [x, y, z, w, i, j, k] = *pose;
    let turn = UnitQuaternion::new_normalize(Quaternion::new(w, i, j, k));
    Isometry3::from_parts(Translation3::new(x, y, z), turn)
}
