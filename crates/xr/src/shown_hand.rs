//! The hand as pages draw it: its skin goes over once, then only how its bones move.

use std::sync::Arc;

use softgrasp_grasp::hand::HandDimensions;
use softgrasp_window::view::frame::HandView;
use softgrasp_window::view::hand_skin::{BONE_COUNT, HandSkin};
use softgrasp_window::view::texture::Texture;

use crate::picture::HandMesh;
use crate::textures::Textures;
use crate::to_page::{HandVertex, hand_message};

/// Skin of one hand.
pub struct ShownHand {
    dimensions: HandDimensions,
    skin: HandSkin,
    /// Message that a page needs once.
    pub mesh: Arc<HandMesh>,
}

/// Number of bones that a vertex follows on a page; the others have too little weight to be seen.
pub const BONES_A_VERTEX: usize = 4;

impl ShownHand {
    /// Makes the skin of a hand.
    pub fn new(version: u32, hand: &HandView, texture: u32) -> Self {
        let skin = HandSkin::new(&hand.dimensions);
        let vertices: Vec<HandVertex> =
            (0..skin.places().len()).map(|i| vertex(&skin, i)).collect();
        let message = hand_message(version, texture, &vertices, skin.triangles());
        let mesh = Arc::new(HandMesh { version, message });
        Self { dimensions: hand.dimensions, skin, mesh }
    }

    /// Packs the texture of every hand's skin; returns its number.
    pub fn texture(textures: &Textures) -> u32 {
        let texture: Texture = HandSkin::texture();
        textures.add(&texture)
    }

    /// Whether the skin belongs to a hand of this size.
    pub fn fits(&self, hand: &HandView) -> bool {
        self.dimensions == hand.dimensions
    }

    /// Motion of the bones, as dual quaternions.
    pub fn bones(&self, hand: &HandView) -> [[f32; 8]; BONE_COUNT] {
        self.skin.bones(&hand.world_from_palm, &hand.world_from_segment)
    }
}

fn vertex(skin: &HandSkin, at: usize) -> HandVertex {
    let mut bones = [0; BONES_A_VERTEX];
    let mut weights = [0.0; BONES_A_VERTEX];
    let heaviest = skin.weights(at).take(BONES_A_VERTEX);
    for ((bone, weight), (number, share)) in bones.iter_mut().zip(&mut weights).zip(heaviest) {
        *bone = u8::try_from(number).unwrap_or(0);
        *weight = share as f32;
    }
    let sum: f32 = weights.iter().sum();
    let single = |v: &nalgebra::Vector3<f64>| [v.x as f32, v.y as f32, v.z as f32];
    HandVertex {
        place: single(&skin.places()[at]),
        normal: single(&skin.normals()[at]),
        uv: skin.uvs().get(at).copied().unwrap_or_default(),
        weights: weights.map(|weight| weight / sum.max(f32::EPSILON)),
        bones,
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Quaternion, UnitQuaternion, Vector3};
    use softgrasp_grasp::hand::{JointAngles, pose};

    use super::*;

    /// The place where the page's shader puts a vertex, in its order of operations.
    fn drawn(vertex: &HandVertex, bones: &[[f32; 8]; BONE_COUNT]) -> Vector3<f64> {
        let mut sum = [0.0_f64; 8];
        for (bone, weight) in vertex.bones.into_iter().zip(vertex.weights) {
            let motion = bones[usize::from(bone)].map(f64::from);
            let dot: f64 = (0..4).map(|i| motion[i] * sum[i]).sum();
            let weight = if dot < 0.0 { -f64::from(weight) } else { f64::from(weight) };
            (0..8).for_each(|i| sum[i] += motion[i] * weight);
        }
        let length = (0..4).map(|i| sum[i] * sum[i]).sum::<f64>().sqrt();
        let part = |at: usize| {
            let q = Quaternion::new(sum[at + 3], sum[at], sum[at + 1], sum[at + 2]);
            q / length
        };
        let (real, dual) = (part(0), part(4));
        let shift = (dual * real.conjugate()).imag() * 2.0;
        let place = Vector3::from(vertex.place.map(f64::from));
        UnitQuaternion::new_unchecked(real) * place + shift
    }

    #[test]
    fn page_puts_every_vertex_of_a_fist_within_half_a_millimetre_of_where_the_window_does() {
        let dimensions = HandDimensions::default();
        let palm = Isometry3::new(Vector3::new(0.1, 0.2, 0.3), Vector3::new(0.3, 2.0, 0.1));
        let hand = HandView::of_pose(dimensions, &pose(&dimensions, &JointAngles::fist(), palm));
        let shown = ShownHand::new(1, &hand, 0);
        let (mut places, mut normals) = (Vec::new(), Vec::new());
        let segments = &hand.world_from_segment;
        shown.skin.pose(&hand.world_from_palm, segments, &mut places, &mut normals);
        let bones = shown.bones(&hand);
        let off = places.iter().enumerate().map(|(i, place)| {
            (drawn(&vertex(&shown.skin, i), &bones) - Vector3::from(place.map(f64::from))).norm()
        });
        let most = off.fold(0.0, f64::max);
        assert!(most < 5e-4, "{most} m");
    }
}
