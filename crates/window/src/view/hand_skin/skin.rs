//! The skin of one hand, ready to be posed.

use nalgebra::{Isometry3, Point3, Vector3};
use softgrasp_grasp::hand::{HandDimensions, Handedness};

use super::bind_pose::BindPose;
use super::bone_weights::{BONE_COUNT, BoneWeights, METACARPALS, bone_of_segment};
use super::complexion::{skin_texture, uvs};
use super::fairing::fair;
use super::grid::{Grid, planes};
use super::hand_body::HandBody;
use super::palm_body::{CUT_MM, SLEEVE_MM};
use super::rigid_motion::RigidMotion;
use super::surface_net::SurfaceNet;
use crate::view::blend::smooth_step;
use crate::view::texture::Texture;

/// Cell size on the fingers, and along the arm where nothing is narrow, mm of the default hand.
const CELL_MM: f64 = 3.05;
const ARM_CELL_MM: f64 = 5.0;

/// Most a metacarpal is turned about the palm's axis, rad; a finger that is shown apart from the
/// palm does not drag it further.
const MOST_CUPPING: f64 = 0.6;

/// A closed surface around the bones of one hand, with what is needed to pose it.
///
/// Units: m. The skin ends in a sleeve whose lower end is closed.
#[derive(Clone, Debug)]
pub struct HandSkin {
    bind: BindPose,
    segment_from_palm: [[Isometry3<f64>; 3]; 5],
    /// Vertices in the bind pose, palm frame.
    pub(super) places: Vec<Vector3<f64>>,
    /// Outward unit normals of the vertices in the bind pose.
    pub(super) normals: Vec<Vector3<f64>>,
    weights: BoneWeights,
    triangles: Vec<[u32; 3]>,
    uvs: Vec<[f32; 2]>,
}

impl HandSkin {
    /// Makes the skin of a hand, once for each hand size.
    pub fn new(dimensions: &HandDimensions) -> Self {
        let right = BindPose::right(dimensions);
        let body = HandBody::new(&right);
        let grid = Grid::sample(grid_planes(&right), |p| body.distance(p));
        let surface = fair(SurfaceNet::new(&grid), &body);
        let weights = BoneWeights::new(&right, &body, &surface.places);
        let uvs = uvs(&right, &surface.places, &surface.normals);

        let is_left = dimensions.handedness == Handedness::Left;
        let handed = |v: Vector3<f64>| if is_left { Vector3::new(-v.x, v.y, v.z) } else { v };
        // A mirror image turns triangles inside out.
        let turned = |[a, b, c]: [u32; 3]| if is_left { [a, c, b] } else { [a, b, c] };
        let bind = BindPose::new(dimensions);
        Self {
            segment_from_palm: bind.palm_from_segment.map(|f| f.map(|s| s.inverse())),
            bind,
            places: surface.places.iter().map(|place| handed(place.coords)).collect(),
            normals: surface.normals.into_iter().map(handed).collect(),
            weights,
            triangles: surface.triangles.into_iter().map(turned).collect(),
            uvs,
        }
    }

    /// Triangles, counter-clockwise seen from outside; every edge belongs to two.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Place of every vertex in [`HandSkin::texture`].
    pub fn uvs(&self) -> &[[f32; 2]] {
        &self.uvs
    }

    /// Picture of skin tones, nails and sleeve.
    pub fn texture() -> Texture {
        skin_texture()
    }

    /// Vertices in the pose that the skin was made in. Units: m. Frame: palm.
    pub fn places(&self) -> &[Vector3<f64>] {
        &self.places
    }

    /// Outward unit normals in the pose that the skin was made in. Frame: palm.
    pub fn normals(&self) -> &[Vector3<f64>] {
        &self.normals
    }

    /// Bones that a vertex follows, the heaviest first, and how much; the weights sum to 1. None for
    /// a vertex that is not there.
    pub fn weights(&self, vertex: usize) -> impl Iterator<Item = (usize, f64)> {
        let is_there = vertex < self.places.len();
        is_there.then(|| self.weights.of(vertex)).into_iter().flatten()
    }

    /// How each bone moves from the pose that the skin was made in to this one, as a dual quaternion:
    /// x, y, z, w of the turn, then of half of shift times turn. A vertex moves by their sum after
    /// its weights, each with the sign that brings it nearer to the sum so far, divided by the length
    /// of the turn.
    pub fn bones(
        &self,
        world_from_palm: &Isometry3<f64>,
        world_from_segment: &[[Isometry3<f64>; 3]; 5],
    ) -> [[f32; 8]; BONE_COUNT] {
        self.motions(world_from_palm, world_from_segment).map(|motion| motion.numbers())
    }

    /// Fills `positions` (m) and `normals` (unit) of all vertices in the world.
    ///
    /// The segments are those of the hand as it is to be seen, which may differ from the measured
    /// pose (`StepOutput::world_from_segment` of a grasp); whatever the vectors hold is dropped.
    pub fn pose(
        &self,
        world_from_palm: &Isometry3<f64>,
        world_from_segment: &[[Isometry3<f64>; 3]; 5],
        positions: &mut Vec<[f32; 3]>,
        normals: &mut Vec<[f32; 3]>,
    ) {
        let motions = self.motions(world_from_palm, world_from_segment);
        positions.clear();
        normals.clear();
        for (i, (place, normal)) in self.places.iter().zip(&self.normals).enumerate() {
            let motion = RigidMotion::blend(&motions, self.weights.of(i));
            positions.push(motion.move_point(place).map(|x| x as f32).into());
            normals.push(motion.turn(normal).map(|x| x as f32).into());
        }
    }

    /// How each bone moves from the bind pose, where the skin was made, to the pose in the world.
    fn motions(
        &self,
        world_from_palm: &Isometry3<f64>,
        world_from_segment: &[[Isometry3<f64>; 3]; 5],
    ) -> [RigidMotion; BONE_COUNT] {
        // The palm's own motion stays where no other is put.
        let mut motions = [RigidMotion::new(world_from_palm); BONE_COUNT];
        let palm_from_world = world_from_palm.inverse();
        for (bone, digit) in METACARPALS.into_iter().zip([3, 4]) {
            let root = palm_from_world * (world_from_segment[digit][0] * Point3::origin());
            let cupped = cupping(&self.bind.root(digit), &root);
            motions[bone] = RigidMotion::new(&(world_from_palm * cupped));
        }
        for digit in 0..5 {
            for segment in 0..3 {
                let motion =
                    world_from_segment[digit][segment] * self.segment_from_palm[digit][segment];
                motions[bone_of_segment(digit, segment)] = RigidMotion::new(&motion);
            }
        }
        motions
    }
}

/// The turn about the palm's Y axis that brings a knuckle from its place in the flat hand to
/// where it is.
fn cupping(flat: &Point3<f64>, now: &Point3<f64>) -> Isometry3<f64> {
    let sine = flat.z * now.x - flat.x * now.z;
    let cosine = flat.x * now.x + flat.z * now.z;
    let angle = sine.atan2(cosine).clamp(-MOST_CUPPING, MOST_CUPPING);
    Isometry3::rotation(Vector3::y() * angle)
}

/// Planes of the grid around the whole hand, a little beyond it on all sides.
fn grid_planes(bind: &BindPose) -> [Vec<f64>; 3] {
    let [across, along] = bind.scales().map(|scale| 1e-3 * scale);
    let mut low = bind.place(-42.0, -80.0, -42.0);
    let mut high = bind.place(44.0, -60.0, 34.0);
    for digit in 0..5 {
        let length = bind.dimensions.segment_lengths()[digit][2];
        for end in [0.0, length] {
            let place = bind.palm_from_segment[digit][2] * Point3::new(0.0, end, 0.0);
            let margin = Vector3::repeat(bind.radius(20.0));
            low = low.inf(&(place - margin));
            high = high.sup(&(place + margin));
        }
    }
    // Coarser along the arm, but fine again at the ends of the sleeve.
    let cell_y = |y: f64| {
        let on_hand = smooth_step(20.0 * along, 70.0 * along, y);
        let from_edge = (y / along - SLEEVE_MM).abs().min((y / along - CUT_MM).abs());
        let fine = on_hand.max(smooth_step(14.0, 7.0, from_edge));
        (ARM_CELL_MM + (CELL_MM - ARM_CELL_MM) * fine) * along.min(across)
    };
    [
        planes(low.x, high.x, |_| CELL_MM * across),
        planes(low.y, high.y, cell_y),
        planes(low.z, high.z, |_| CELL_MM * across),
    ]
}
