//! The object as it is drawn: its skin, its ghost at rest, the edges of its elements.

use std::sync::Arc;

use kiss3d::prelude::{Color, SceneNode3d, Vec3, Window};
use nalgebra::{Isometry3, Point3};
use softgrasp_grasp::object::RestShape;

use super::drawn_mesh::{DrawnMesh, remove_texture, set_relief, set_texture};
use super::units::{UNITS_PER_M, drawn_pose};
use crate::view::colour_map::texture_u;
use crate::view::colouring::Colouring;
use crate::view::frame::ObjectView;
use crate::view::object_skin::{Look, ObjectSkin, Part, SurfaceMaterial};

/// One object on the graphics card.
pub struct DrawnObject {
    /// The rest shape that it was made for, and the newest one with the same triangles.
    made_for: Arc<RestShape>,
    rest_shapes: u64,
    skin: ObjectSkin,
    group: SceneNode3d,
    parts: Vec<DrawnMesh>,
    ghost: DrawnMesh,
    /// Rest shape that the ghost shows.
    ghost_of: u64,
    /// Name that distinguishes the textures of one object from those of the next.
    name: String,
    is_coloured: bool,
    world_from_object: Isometry3<f64>,
}

/// Colour of the element edges: dark on every skin.
const WIRE: Color = Color::new(0.05, 0.06, 0.08, 1.0);
/// Distance of the lines from the surface, outside, m: they do not flicker in it.
const WIRE_LIFT_M: f32 = 0.00012;

impl DrawnObject {
    /// The object at rest, below a node.
    pub fn new(scene: &mut SceneNode3d, look: Look, object: &ObjectView) -> Self {
        let skin = ObjectSkin::new(look, &object.rest);
        let name = match object.number {
            0 => format!("object {}", object.rest_shapes),
            number => format!("object {number}, shape {}", object.rest_shapes),
        };
        let mut group = scene.add_group();
        let parts = skin.parts().iter().map(|part| drawn_part(&mut group, &name, part)).collect();
        let ghost = ghost(&mut group, &skin);
        Self {
            made_for: Arc::clone(&object.rest),
            rest_shapes: object.rest_shapes,
            skin,
            group,
            parts,
            ghost,
            ghost_of: object.rest_shapes,
            name,
            is_coloured: false,
            world_from_object: object.world_from_object,
        }
    }

    /// Whether the object of a tick is this one, perhaps with another rest shape.
    pub fn is(&mut self, object: &ObjectView) -> bool {
        let same = self.rest_shapes == object.rest_shapes
            || self.made_for.surface().triangles == object.rest.surface().triangles;
        if same {
            self.rest_shapes = object.rest_shapes;
        }
        same
    }

    /// Moves the object to the pose and shape of a tick.
    pub fn follow(&mut self, object: &ObjectView, shape: &[Point3<f64>]) {
        if self.ghost_of != object.rest_shapes {
            self.show_rest_as_ghost(&object.rest);
            self.ghost_of = object.rest_shapes;
        }
        self.skin.follow(shape);
        for (drawn, part) in self.parts.iter_mut().zip(self.skin.parts()) {
            drawn.set(&part.positions, &part.normals);
        }
        self.world_from_object = object.world_from_object;
        self.group.set_pose(drawn_pose(&object.world_from_object));
    }

    /// Shows the rest shape as a ghost, or hides it.
    pub fn show_ghost(&mut self, shown: bool) {
        self.ghost.node().set_visible(shown);
    }

    /// Colours the body by shares of a range at the nodes, or gives it its own look back if there
    /// are none.
    pub fn colour_by(&mut self, colouring: Option<&Colouring>) {
        let shares = colouring.map_or(&[][..], Colouring::shares);
        let Some(body) = self.skin.parts().first() else { return };
        let Some(drawn) = self.parts.first_mut() else { return };
        if let Some(map) = colouring.map(Colouring::map).filter(|_| !shares.is_empty()) {
            let mut of_body = Vec::new();
            self.skin.body_values(shares, &mut of_body);
            let uv = |share: &f32| [texture_u(f64::from(*share)), 0.5];
            drawn.set_uvs(&of_body.iter().map(uv).collect::<Vec<_>>());
            if !self.is_coloured {
                set_texture(drawn.node(), "ramp", &map.image(4));
                drawn.node().clear_normal_map();
                drawn.node().set_color(Color::new(1.0, 1.0, 1.0, 1.0));
                drawn.node().set_roughness(0.65).set_clearcoat(0.0, 0.5).set_subsurface(0.0, 0.0);
            }
        } else if self.is_coloured {
            drawn.set_uvs(&body.uvs);
            remove_texture(drawn.node());
            set_material(drawn.node(), &self.name, body.name, &body.material);
        }
        self.is_coloured = !shares.is_empty();
    }

    /// Draws the edges of the elements on the surface in the next picture.
    pub fn draw_wireframe(&self, window: &mut Window) {
        let Some(body) = self.skin.parts().first() else { return };
        let pose = drawn_pose(&self.world_from_object);
        let place = |at: u32| {
            let (p, n) = (body.positions[at as usize], body.normals[at as usize]);
            let lifted = Vec3::from_array(p) + Vec3::from_array(n) * WIRE_LIFT_M;
            pose.translation + pose.rotation * (lifted * UNITS_PER_M)
        };
        for &[a, b] in self.skin.wireframe() {
            window.draw_line(place(a), place(b), WIRE, 1.2, false);
        }
    }

    /// Takes the object out of the scene.
    pub fn remove(mut self) {
        self.group.remove();
    }

    fn show_rest_as_ghost(&mut self, rest: &RestShape) {
        self.skin.follow(rest.mesh().vertices());
        if let Some(body) = self.skin.parts().first() {
            self.ghost.set(&body.positions, &body.normals);
        }
    }
}

fn drawn_part(group: &mut SceneNode3d, name: &str, part: &Part) -> DrawnMesh {
    let mut drawn =
        DrawnMesh::new(group, &part.triangles, &part.positions, &part.normals, &part.uvs);
    set_material(drawn.node(), name, part.name, &part.material);
    drawn
}

fn set_material(node: &mut SceneNode3d, object: &str, part: &str, material: &SurfaceMaterial) {
    let [red, green, blue] = material.colour;
    node.set_color(Color::new(red, green, blue, 1.0));
    node.set_metallic(material.metallic).set_roughness(material.roughness);
    node.set_clearcoat(material.clearcoat.0, material.clearcoat.1);
    node.set_subsurface(material.subsurface, 0.0);
    node.enable_backface_culling(!material.two_sided);
    if let Some(picture) = &material.texture {
        set_texture(node, &format!("{object}, {part}"), picture);
    }
    if let Some(relief) = &material.relief {
        set_relief(node, &format!("{object}, relief of {part}"), relief);
    }
}

/// The rest shape, drawn transparent.
fn ghost(group: &mut SceneNode3d, skin: &ObjectSkin) -> DrawnMesh {
    let empty: (&[_], &[_], &[_], &[_]) = (&[], &[], &[], &[]);
    let (triangles, positions, normals, uvs) = skin.parts().first().map_or(empty, |body| {
        (&body.triangles[..], &body.positions[..], &body.normals[..], &body.uvs[..])
    });
    let mut ghost = DrawnMesh::new(group, triangles, positions, normals, uvs);
    ghost.node().set_color(Color::new(0.20, 0.42, 0.95, 0.45));
    ghost.node().set_roughness(0.9).set_casts_shadows(false);
    ghost.node().set_visible(false);
    ghost
}
