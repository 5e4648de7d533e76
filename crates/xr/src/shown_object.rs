//! The object as pages draw it: the part that stays the same from picture to picture.

use std::sync::Arc;

use softgrasp_grasp::object::RestShape;
use softgrasp_window::view::frame::ObjectView;
use softgrasp_window::view::object_skin::{Look, ObjectSkin, Part};

use crate::picture::ObjectMesh;
use crate::textures::Textures;
use crate::to_page::{ObjectPart, object_message};

/// Skin of one object, and the message that brings it to a page.
pub struct ShownObject {
    rest: Arc<RestShape>,
    rest_shapes: u64,
    skin: ObjectSkin,
    /// Message that a page needs once.
    pub mesh: Arc<ObjectMesh>,
}

impl ShownObject {
    /// Makes the skin of an object; takes some tenths of a second.
    pub fn new(version: u32, look: Look, object: &ObjectView, textures: &Textures) -> Self {
        let skin = ObjectSkin::new(look, &object.rest);
        let message = message(version, skin.parts(), textures);
        Self {
            rest: Arc::clone(&object.rest),
            rest_shapes: object.rest_shapes,
            skin,
            mesh: Arc::new(ObjectMesh { version, message }),
        }
    }

    /// Whether the object of a frame is this one, perhaps with another rest shape.
    pub fn is(&mut self, object: &ObjectView) -> bool {
        let same = self.rest_shapes == object.rest_shapes
            || self.rest.surface().triangles == object.rest.surface().triangles;
        if same {
            self.rest_shapes = object.rest_shapes;
        }
        same
    }

    /// Moves the skin to a shape: positions and normals of all vertices, part after part.
    ///
    /// Units: m. Frame: the object's.
    pub fn follow(
        &mut self,
        shape: &[nalgebra::Point3<f64>],
        places: &mut Vec<[f32; 3]>,
        normals: &mut Vec<[f32; 3]>,
    ) {
        self.skin.follow(shape);
        places.clear();
        normals.clear();
        for part in self.skin.parts() {
            places.extend_from_slice(&part.positions);
            normals.extend_from_slice(&part.normals);
        }
    }

    /// Shares of a range at the vertices of the body, 0 to 255; those of other parts are 0.
    pub fn shares(&self, of_nodes: &[f64], vertices: usize) -> Vec<u8> {
        if of_nodes.is_empty() {
            return Vec::new();
        }
        let mut of_body = Vec::new();
        self.skin.body_values(of_nodes, &mut of_body);
        let byte = |share: &f32| (share.clamp(0.0, 1.0) * 255.0).round() as u8;
        let mut shares: Vec<u8> = of_body.iter().map(byte).collect();
        shares.resize(vertices, 0);
        shares
    }
}

fn message(version: u32, parts: &[Part], textures: &Textures) -> Vec<u8> {
    let (mut records, mut uvs, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
    for part in parts {
        let first = u32::try_from(uvs.len()).unwrap_or(u32::MAX);
        let material = &part.material;
        let number = |texture: &Option<_>| texture.as_ref().map_or(0, |t| textures.add(t));
        records.push(ObjectPart {
            first_triangle: u32::try_from(triangles.len()).unwrap_or(u32::MAX),
            triangles: u32::try_from(part.triangles.len()).unwrap_or(u32::MAX),
            colour: material.colour,
            roughness: material.roughness,
            metallic: material.metallic,
            clearcoat: material.clearcoat,
            subsurface: material.subsurface,
            texture: number(&material.texture),
            relief: number(&material.relief),
            two_sided: material.two_sided,
        });
        uvs.extend_from_slice(&part.uvs);
        triangles.extend(part.triangles.iter().map(|t| t.map(|vertex| vertex + first)));
    }
    object_message(version, &records, &uvs, &triangles)
}
