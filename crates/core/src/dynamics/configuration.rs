//! Where object and bodies are at the end of a step, for one guess of the contact forces.

use nalgebra::{Isometry3, Point3, Vector3};

use super::bodies::MovingBody;
use super::features::{Candidate, Gap, MaterialPoint, Triangle};
use super::rigid_motion::{RigidMotion, RigidStep, Wrench};
use super::state::{HeldContact, at_nodes, mix, summed};
use crate::solve::condensed::{NodeForce, Response};

/// What does not change while a step is solved.
pub(super) struct Scene<'a> {
    pub vertices: &'a [Point3<f64>],
    pub triangles: &'a [[u32; 3]],
    pub bodies: &'a [MovingBody],
    pub candidates: &'a [Candidate],
    pub rigid: RigidStep<'a>,
    /// Seconds in which the shape forgets a force, Kelvin and Voigt.
    pub viscosity: f64,
    /// Displacement of the response's rows when the step begins.
    pub begun: Vec<Vector3<f64>>,
    /// The bodies when the step begins, pushed back by the forces of that moment.
    pub world_from_bodies_begun: Vec<Isometry3<f64>>,
}

/// One guess: contact forces, and what they do to pose and shape.
pub(super) struct Configuration {
    pub contacts: Vec<HeldContact>,
    pub motion: RigidMotion,
    /// Forces whose elastic response is the shape.
    pub forces: Vec<NodeForce>,
    /// Displacement of the response's rows.
    pub displacement: Vec<Vector3<f64>>,
    /// Sum of the forces of every body on the object, N, in the object's frame.
    pub body_forces: Vec<Vector3<f64>>,
}

impl Scene<'_> {
    /// Share of a force that the shape has answered at the end of the step.
    pub fn answered(&self) -> f64 {
        self.rigid.seconds / (self.rigid.seconds + self.viscosity)
    }

    /// Forces whose elastic response is the shape at the end, under some contact forces.
    pub fn elastic_forces(&self, contacts: &[NodeForce]) -> Vec<NodeForce> {
        let answered = self.answered();
        let new = contacts.iter().map(|(node, force)| (*node, answered * force));
        let left = 1.0 - answered;
        // What is left of a force after it has been forgotten to rounding is dropped.
        let largest = self.rigid.state.forces.iter().map(|(_, f)| f.norm()).fold(0.0, f64::max);
        let remembered = self.rigid.state.forces.iter().filter(|(_, f)| f.norm() > 1e-14 * largest);
        let old = remembered.map(|(node, force)| (*node, left * force));
        match self.viscosity > 0.0 {
            true => summed(new.chain(old).collect()),
            false => contacts.to_vec(),
        }
    }

    /// The configuration that contact forces in the frame of a turned object lead to.
    ///
    /// The columns of all nodes with a force have been asked for. `unpressed` is the displacement of the
    /// response's rows if nothing pressed.
    pub fn configuration(
        &self,
        (response, unpressed): (&Response<'_>, &[Vector3<f64>]),
        contacts: Vec<HeldContact>,
        at: &Configured<'_>,
    ) -> Configuration {
        let mut wrench = Wrench::default();
        let body_forces = sums_by_body(&contacts, self.bodies.len());
        for contact in &contacts {
            let place = self.place(response, at.displacement, &contact.nodes, &contact.weights);
            wrench.force += contact.force;
            wrench.torque += (place - self.rigid.mass.centre).cross(&contact.force);
        }
        let motion = self.rigid.motion(&wrench, &at.world_from_object.rotation);
        let pressing = at_nodes(&contacts);
        let answered = self.answered();
        let new: Vec<NodeForce> =
            pressing.iter().map(|(node, force)| (*node, answered * force)).collect();
        let mut displacement = response.moved(&new);
        displacement.iter_mut().zip(unpressed).for_each(|(u, unpressed)| *u += unpressed);
        let forces = self.elastic_forces(&pressing);
        Configuration { contacts, motion, forces, displacement, body_forces }
    }

    /// Where a point of the surface is in the object's frame.
    pub fn place(
        &self,
        response: &Response<'_>,
        displacement: &[Vector3<f64>],
        nodes: &[u32; 3],
        weights: &[f64; 3],
    ) -> Point3<f64> {
        mix(&self.corners(response, displacement, nodes), weights)
    }

    /// Where the nodes of a triangle are in the object's frame.
    pub fn corners(
        &self,
        response: &Response<'_>,
        displacement: &[Vector3<f64>],
        nodes: &[u32; 3],
    ) -> [Vector3<f64>; 3] {
        nodes.map(|node| {
            let moved = response.row_of(node).map_or(Vector3::zeros(), |row| displacement[row]);
            self.vertices[node as usize].coords + moved
        })
    }

    /// The bodies at the end of the step, pushed back by the forces of the configuration.
    fn world_from_bodies(&self, at: &Configured<'_>) -> Vec<Isometry3<f64>> {
        let turn = at.world_from_object.rotation;
        let pushed = |(body, force): (&MovingBody, &Vector3<f64>)| {
            body.pushed_back(&body.world_from_body_end, &(turn * force))
        };
        self.bodies.iter().zip(at.body_forces).map(pushed).collect()
    }

    /// Poses of the rigid bodies in the object's frame.
    pub fn object_from_bodies(&self, at: &Configured<'_>) -> Vec<Isometry3<f64>> {
        let object_from_world = at.world_from_object.inverse();
        self.world_from_bodies(at).iter().map(|body| object_from_world * body).collect()
    }

    /// Where a body is from a point of the surface.
    pub fn gap(
        &self,
        response: &Response<'_>,
        at: &Configured<'_>,
        object_from_bodies: &[Isometry3<f64>],
        point: &MaterialPoint,
    ) -> Gap {
        let place = self.place(response, at.displacement, &point.nodes, &point.weights);
        let body = usize::from(point.body);
        let object_from_body = &object_from_bodies[body];
        let in_body = object_from_body.inverse_transform_point(&place);
        let signed = self.bodies[body].shape.distance(&in_body);
        let normal = object_from_body.rotation * signed.normal;
        Gap { place, distance: signed.distance, normal }
    }

    /// The deepest point of each candidate that is on the outer side of its triangle, and how far from
    /// the body it is.
    pub fn deepest_points(
        &self,
        response: &Response<'_>,
        at: &Configured<'_>,
        object_from_bodies: &[Isometry3<f64>],
    ) -> Vec<(MaterialPoint, f64)> {
        let of_candidate = |candidate: &Candidate| {
            let nodes = self.triangles[candidate.triangle as usize];
            let body = usize::from(candidate.body);
            let corners = self.corners(response, at.displacement, &nodes);
            let triangle = Triangle::new(corners.map(Point3::from));
            let found = triangle.deepest(&self.bodies[body].shape, &object_from_bodies[body])?;
            let point = MaterialPoint::new(candidate.body, nodes, found.weights);
            Some((point, found.distance.distance))
        };
        self.candidates.iter().filter_map(of_candidate).collect()
    }

    /// Where the material point of a contact would be at the end if it stuck to the body, in the
    /// object's frame at the end.
    pub fn stuck(
        &self,
        response: &Response<'_>,
        at: &Configured<'_>,
        point: &MaterialPoint,
    ) -> Point3<f64> {
        let begun = self.place(response, &self.begun, &point.nodes, &point.weights);
        let in_world = self.rigid.state.world_from_object * begun;
        let body = usize::from(point.body);
        let in_body = self.world_from_bodies_begun[body].inverse_transform_point(&in_world);
        let turn = at.world_from_object.rotation;
        let of_body = &self.bodies[body];
        let world_from_body =
            of_body.pushed_back(&of_body.world_from_body_end, &(turn * at.body_forces[body]));
        at.world_from_object.inverse_transform_point(&(world_from_body * in_body))
    }
}

/// Pose and shape of a configuration, which the next one is linearised about.
pub(super) struct Configured<'a> {
    pub world_from_object: Isometry3<f64>,
    pub displacement: &'a [Vector3<f64>],
    pub body_forces: &'a [Vector3<f64>],
}

/// Sum of the forces of every body in some contacts.
pub(super) fn sums_by_body(contacts: &[HeldContact], bodies: usize) -> Vec<Vector3<f64>> {
    let mut sums = vec![Vector3::zeros(); bodies];
    for contact in contacts {
        if let Some(sum) = sums.get_mut(usize::from(contact.body)) {
            *sum += contact.force;
        }
    }
    sums
}

impl Configuration {
    pub fn configured(&self) -> Configured<'_> {
        Configured {
            world_from_object: self.motion.world_from_object,
            displacement: &self.displacement,
            body_forces: &self.body_forces,
        }
    }
}
