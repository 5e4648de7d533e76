//! The hand as it is drawn: one smooth skin, and over it the colliders that the search uses.

use kiss3d::prelude::{Color, SceneNode3d};
use softgrasp_grasp::hand::{HandColliders, HandDimensions};
use softgrasp_grasp::shape::Cylinder;

use super::drawn_mesh::{DrawnMesh, set_texture};
use super::units::{UNITS_PER_M, drawn_point, rotation_from_y};
use crate::view::frame::HandView;
use crate::view::hand_skin::HandSkin;
use crate::view::light::HAND;

/// A hand on the graphics card.
pub struct DrawnHand {
    dimensions: HandDimensions,
    skin: HandSkin,
    drawn: DrawnMesh,
    colliders: DrawnColliders,
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
}

impl DrawnHand {
    /// A hand of these dimensions, hidden before its first pose.
    pub fn new(scene: &mut SceneNode3d, hand: &HandView) -> Self {
        let skin = HandSkin::new(&hand.dimensions);
        let (mut positions, mut normals) = (Vec::new(), Vec::new());
        skin.pose(&hand.world_from_palm, &hand.world_from_segment, &mut positions, &mut normals);
        let mut drawn = DrawnMesh::new(scene, skin.triangles(), &positions, &normals, skin.uvs());
        let node = drawn.node();
        node.set_color(Color::new(1.0, 1.0, 1.0, 1.0));
        let [roughness, subsurface] = HAND;
        node.set_roughness(roughness).set_metallic(0.0).set_subsurface(subsurface, 0.0);
        set_texture(node, "skin", &HandSkin::texture());
        let colliders = DrawnColliders::new(scene, &hand.colliders());
        Self { dimensions: hand.dimensions, skin, drawn, colliders, positions, normals }
    }

    /// Whether this hand is of the dimensions of another one.
    pub fn fits(&self, hand: &HandView) -> bool {
        self.dimensions == hand.dimensions
    }

    /// Moves the hand to the pose of a tick.
    pub fn follow(&mut self, hand: &HandView) {
        let Self { skin, positions, normals, .. } = self;
        skin.pose(&hand.world_from_palm, &hand.world_from_segment, positions, normals);
        self.drawn.set(positions, normals);
        self.colliders.follow(&hand.colliders());
    }

    /// Shows skin and colliders, or hides them.
    pub fn show(&mut self, skin: bool, colliders: bool) {
        self.drawn.node().set_visible(skin);
        self.colliders.group.set_visible(colliders);
    }

    /// Takes the hand out of the scene.
    pub fn remove(mut self) {
        self.colliders.group.remove();
        self.drawn.remove();
    }
}

/// Cylinders and fingertip spheres of the colliders, transparent.
struct DrawnColliders {
    group: SceneNode3d,
    cylinders: Vec<SceneNode3d>,
    tips: Vec<SceneNode3d>,
    points: Vec<SceneNode3d>,
}

const SEE_THROUGH: Color = Color::new(0.15, 0.45, 0.95, 0.35);
const CONTACT_POINT: Color = Color::new(1.0, 0.85, 0.1, 1.0);
/// Radius of the ball that marks a contact point, m.
const POINT_RADIUS_M: f32 = 0.0012;

impl DrawnColliders {
    fn new(scene: &mut SceneNode3d, hand: &HandColliders) -> Self {
        let mut group = scene.add_group();
        let (mut cylinders, mut tips, mut points) = (Vec::new(), Vec::new(), Vec::new());
        for finger in &hand.fingers {
            for cylinder in &finger.cylinders {
                let (radius, length) = (cylinder.radius as f32, cylinder.length as f32);
                let node = group.add_cylinder(radius * UNITS_PER_M, length * UNITS_PER_M);
                cylinders.push(see_through(node));
            }
            tips.push(see_through(group.add_sphere(finger.tip.radius as f32 * UNITS_PER_M)));
            let mut point = group.add_sphere(POINT_RADIUS_M * UNITS_PER_M);
            point.set_color(CONTACT_POINT);
            points.push(point);
        }
        let mut drawn = Self { group, cylinders, tips, points };
        drawn.follow(hand);
        drawn
    }

    fn follow(&mut self, hand: &HandColliders) {
        let cylinders = hand.fingers.iter().flat_map(|finger| &finger.cylinders);
        for (node, cylinder) in self.cylinders.iter_mut().zip(cylinders) {
            let Cylinder { base, axis, length, .. } = cylinder;
            let centre = base + axis.into_inner() * (0.5 * length);
            node.set_position(drawn_point(&centre)).set_rotation(rotation_from_y(axis));
        }
        for ((tip, point), finger) in self.tips.iter_mut().zip(&mut self.points).zip(&hand.fingers)
        {
            tip.set_position(drawn_point(&finger.tip.centre));
            point.set_position(drawn_point(&finger.contact_point));
        }
    }
}

fn see_through(mut node: SceneNode3d) -> SceneNode3d {
    node.set_color(SEE_THROUGH).set_roughness(0.7).set_casts_shadows(false);
    node
}
