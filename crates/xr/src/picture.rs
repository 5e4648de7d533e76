//! What there is to see at one moment, in the numbers that go to the pages.

use std::sync::Arc;

use softgrasp_window::view::hand_skin::BONE_COUNT;

use crate::quantised::QuantisedBox;

/// One moment; shared by all pages that look.
///
/// Shapes: `numbers` and `normals` one per vertex of the object, `shares` too or empty.
pub struct Picture {
    /// Number of the tick.
    pub tick: u64,
    /// The object.
    pub object: Arc<ObjectMesh>,
    /// The hand, and how its bones move.
    pub hand: Option<PosedHand>,
    /// Number that a headset gave the record which the hand follows.
    pub record: Option<u32>,
    /// Where the object is: translation in m, then x, y, z, w of the turn.
    pub world_from_object: [f32; 7],
    /// Height of the ground, m.
    pub ground_y: f32,
    /// What darkens the ground: begin and radius, end and nothing, m, world.
    pub capsules: Vec<[f32; 8]>,
    /// The box that vertices are counted in.
    pub space: QuantisedBox,
    /// Where the vertices are.
    pub numbers: Vec<[u16; 3]>,
    /// Where they look to.
    pub normals: Vec<[i16; 2]>,
    /// Colours: shares of the legend's range.
    pub shares: Vec<u8>,
    /// What is told beside it.
    pub status: Arc<str>,
}

/// A hand, and how its bones move, as dual quaternions.
pub type PosedHand = (Arc<HandMesh>, [[f32; 8]; BONE_COUNT]);

impl Picture {
    /// Whether a page that has drawn the other one needs only what differs.
    pub fn goes_on_from(&self, before: &Self) -> bool {
        self.object.version == before.object.version
            && self.space == before.space
            && self.numbers.len() == before.numbers.len()
            && self.normals.len() == before.normals.len()
            && self.shares.len() == before.shares.len()
    }
}

/// The message that brings the unmoving part of an object to a page.
pub struct ObjectMesh {
    /// Another number is another object.
    pub version: u32,
    /// The message.
    pub message: Vec<u8>,
}

/// The message that brings the unmoving part of a hand to a page.
pub struct HandMesh {
    /// Another number is another hand.
    pub version: u32,
    /// The message.
    pub message: Vec<u8>,
}
