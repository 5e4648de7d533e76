//! Makes contact frames: the surface as it is, the bodies near it, and what can touch in a step.

use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion};
use softgrasp_core::dynamics::{self, Candidate, MovingBody, near_triangles};
use softgrasp_protocol::{
    BodyMotion, BodyShape, ContactAsk, ContactFrame, FieldSet, ModelHash, NodeChoice, ObjectState,
    Pose, Precision,
};

/// A body of a step, as core takes it for the search and as it travels.
#[derive(Clone, Debug)]
pub struct StepBody {
    /// For the search.
    pub moving: MovingBody,
    /// Its shape on the wire.
    pub shape: BodyShape,
}

/// An object whose steps are asked for.
pub struct StepObject<'a> {
    /// The kept model.
    pub model: ModelHash,
    /// Places of all nodes at rest, in the object's frame.
    pub vertices: &'a [Point3<f64>],
    /// Triangles of the boundary surface.
    pub triangles: &'a [[u32; 3]],
    /// Displacement of every node, in the object's frame; zero where it is not known.
    pub displacement: &'a [[f64; 3]],
    /// Nodes whose displacements are wanted.
    pub nodes: NodeChoice,
}

impl StepObject<'_> {
    /// The frame of one step from a state; what can touch is found by looking at all triangles.
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

    /// The frame of one step in which these triangles can touch these bodies.
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

/// How near a triangle must be to be able to touch in a step that is asked for.
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

/// A pose as it travels.
pub fn pose_of(pose: &Isometry3<f64>) -> Pose {
    let (place, turn) = (pose.translation.vector, pose.rotation);
    [place.x, place.y, place.z, turn.w, turn.i, turn.j, turn.k]
}

/// A pose that has travelled.
pub fn isometry_of(pose: &Pose) -> Isometry3<f64> {
    let [x, y, z, w, i, j, k] = *pose;
    let turn = UnitQuaternion::new_normalize(Quaternion::new(w, i, j, k));
    Isometry3::from_parts(Translation3::new(x, y, z), turn)
}
