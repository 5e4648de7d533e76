//! Digests of numbers, so that two runs can be compared bit by bit.

use nalgebra::Isometry3;
use softgrasp_protocol::{ContactFrame, NodeChoice, ObjectState, Question};

/// BLAKE3 hash over the exact bits of numbers, of which 128 bits are used.
#[derive(Default)]
pub struct Digest(blake3::Hasher);

impl Digest {
    /// Adds a count to the hash.
    pub fn count(&mut self, count: u64) {
        self.0.update(&count.to_le_bytes());
    }

    /// Adds the bits of numbers to the hash.
    pub fn numbers(&mut self, numbers: &[f64]) {
        for number in numbers {
            self.0.update(&number.to_le_bytes());
        }
    }

    /// Adds a text to the hash.
    pub fn text(&mut self, text: &str) {
        self.count(text.len() as u64);
        self.0.update(text.as_bytes());
    }

    /// Adds a pose to the hash: translation, then quaternion.
    pub fn isometry(&mut self, pose: &Isometry3<f64>) {
        self.numbers(pose.translation.vector.as_slice());
        self.numbers(pose.rotation.coords.as_slice());
    }

    /// Digest as 32 hexadecimal digits.
    pub fn end(self) -> String {
        self.0.finalize().to_hex()[..32].to_owned()
    }
}

/// Digest of a question: known displacements and the partition that follows from them.
pub fn request_digest(question: &Question) -> String {
    let mut digest = Digest::default();
    for known in &question.known {
        digest.count(u64::from(known.dof));
        digest.numbers(&[known.value]);
    }
    digest.count(question.masks.len() as u64);
    for (nodes, weights) in question.masks.iter() {
        digest.count(nodes.len() as u64);
        nodes.iter().for_each(|node| digest.count(u64::from(*node)));
        digest.numbers(weights);
    }
    question.mask_displacements.iter().for_each(|u| digest.numbers(u));
    match &question.want.nodes {
        NodeChoice::All => digest.text("all"),
        NodeChoice::Nodes(nodes) => digest.count(nodes.len() as u64),
    }
    digest.end()
}

/// Digest of a contact frame: state, motions of the bodies, triangles that can touch.
pub fn step_digest(frame: &ContactFrame) -> String {
    let mut digest = Digest::default();
    digest.numbers(&[frame.ask.seconds]);
    let ObjectState { pose, velocity, angular_velocity, force_nodes, forces, contacts } =
        &frame.state;
    digest.numbers(pose);
    digest.numbers(velocity);
    digest.numbers(angular_velocity);
    force_nodes.iter().for_each(|node| digest.count(u64::from(*node)));
    forces.iter().for_each(|force| digest.numbers(force));
    for contact in contacts {
        digest.count(u64::from(contact.body));
        digest.numbers(&contact.weights);
        digest.numbers(&contact.force);
    }
    for body in &frame.bodies {
        digest.numbers(&body.start);
        digest.numbers(&body.end);
    }
    for (nodes, body) in frame.triangles.iter().zip(&frame.triangle_bodies) {
        nodes.iter().for_each(|node| digest.count(u64::from(*node)));
        digest.count(u64::from(*body));
    }
    digest.end()
}
