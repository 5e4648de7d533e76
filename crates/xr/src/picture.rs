//! Picture of one moment, in the numbers that go to the pages.

use std::sync::Arc;

use softgrasp_window::view::hand_skin::BONE_COUNT;

use crate::quantised::QuantisedBox;

/// One moment of the run; shared by all pages.
///
/// Shapes: `numbers` and `normals` one per vertex of the object, `shares` too or empty.
pub struct Picture {
    /// Number of the tick.
    pub tick: u64,
    /// Unmoving part of the object.
    pub object: Arc<ObjectMesh>,
    /// Unmoving part of each hand, and the motion of its bones.
    pub hands: [Option<PosedHand>; 2],
    /// Newest number that the headset gave to a record of joints which a hand follows.
    pub record: Option<u32>,
    /// Pose of the object in the world: translation in m, then quaternion x, y, z, w.
    pub world_from_object: [f32; 7],
    /// Height of the ground, m.
    pub ground_y: f32,
    /// Capsules that darken the ground: start and radius, end and 0; m, in the world frame.
    pub capsules: Vec<[f32; 8]>,
    /// Box in whose steps the vertices are counted.
    pub space: QuantisedBox,
    /// Position of each vertex, in counts of the box.
    pub numbers: Vec<[u16; 3]>,
    /// Normal of each vertex, folded into two numbers.
    pub normals: Vec<[i16; 2]>,
    /// Colour of each vertex, as a share of the legend's range; empty without colours.
    pub shares: Vec<u8>,
    /// Status text beside the picture, as JSON.
    pub status: Arc<str>,
}

/// Unmoving part of the hand, and the motion of its bones as dual quaternions.
pub type PosedHand = (Arc<HandMesh>, [[f32; 8]; BONE_COUNT]);

impl Picture {
    /// Whether a page that has drawn `before` needs only the differences.
    pub fn goes_on_from(&self, before: &Self) -> bool {
        self.object.version == before.object.version
            && self.space == before.space
            && self.numbers.len() == before.numbers.len()
            && self.normals.len() == before.normals.len()
            && self.shares.len() == before.shares.len()
    }
}

/// Message that brings the unmoving part of an object to a page.
pub struct ObjectMesh {
    /// Version of the object; another number means another object.
    pub version: u32,
    /// Bytes of the message.
    pub message: Vec<u8>,
}

/// Message that brings the unmoving part of a hand to a page.
pub struct HandMesh {
    /// Version of the hand; another number means another hand.
    pub version: u32,
    /// Bytes of the message.
    pub message: Vec<u8>,
}
