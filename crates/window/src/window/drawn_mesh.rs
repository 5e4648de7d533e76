//! A triangle mesh on the graphics card whose vertices move.

use std::cell::RefCell;
use std::rc::Rc;
use std::sync::Arc;

use image::{DynamicImage, RgbaImage};
use kiss3d::prelude::{GpuMesh3d, SceneNode3d, Texture, TextureManager, Vec2, Vec3};

use super::units::UNITS_PER_M;
use crate::view::texture::Texture as Picture;

/// A mesh in metres; its node has the scale of the scene.
pub struct DrawnMesh {
    node: SceneNode3d,
}

impl DrawnMesh {
    /// A mesh below a node.
    ///
    /// Shapes: one normal and one place in the texture for each position.
    /// Units: m. Frame: that of the node it hangs below.
    pub fn new(
        parent: &mut SceneNode3d,
        triangles: &[[u32; 3]],
        positions: &[[f32; 3]],
        normals: &[[f32; 3]],
        uvs: &[[f32; 2]],
    ) -> Self {
        let vectors = |all: &[[f32; 3]]| all.iter().map(|v| Vec3::from_array(*v)).collect();
        let uvs = uvs.iter().map(|uv| Vec2::from_array(*uv)).collect();
        let mesh = GpuMesh3d::new(
            vectors(positions),
            triangles.to_vec(),
            Some(vectors(normals)),
            Some(uvs),
            true,
        );
        let node = parent.add_mesh(Rc::new(RefCell::new(mesh)), Vec3::splat(UNITS_PER_M));
        Self { node }
    }

    /// The mesh's node in the scene, for material and visibility.
    pub fn node(&mut self) -> &mut SceneNode3d {
        &mut self.node
    }

    /// Moves the vertices.
    ///
    /// Shapes: those of [`DrawnMesh::new`].
    pub fn set(&mut self, positions: &[[f32; 3]], normals: &[[f32; 3]]) {
        self.node.modify_vertices(&mut |vertices| copy(positions, vertices));
        self.node.modify_normals(&mut |all| copy(normals, all));
    }

    /// Sets the vertices' places in the texture.
    pub fn set_uvs(&mut self, uvs: &[[f32; 2]]) {
        self.node.modify_uvs(&mut |all| {
            all.clear();
            all.extend(uvs.iter().map(|uv| Vec2::from_array(*uv)));
        });
    }

    /// Takes the mesh out of the scene.
    pub fn remove(mut self) {
        self.node.remove();
    }
}

fn copy(from: &[[f32; 3]], to: &mut Vec<Vec3>) {
    to.clear();
    to.extend(from.iter().map(|v| Vec3::from_array(*v)));
}

/// Puts a picture on a mesh; `name` distinguishes it from other pictures.
///
/// Colours: sRGB.
pub fn set_texture(node: &mut SceneNode3d, name: &str, picture: &Picture) {
    if let Some(texture) = texture(name, picture, true) {
        node.set_texture(texture);
    }
}

/// Takes the picture off a mesh, which has the plain colour of its material then.
pub fn remove_texture(node: &mut SceneNode3d) {
    // The renderer's own white texture has no name to ask for it by.
    node.set_texture(TextureManager::get_global_manager(|textures| textures.get_default()));
}

/// Gives a mesh a fine relief by a picture of its slopes.
///
/// Values of the picture: linear.
pub fn set_relief(node: &mut SceneNode3d, name: &str, picture: &Picture) {
    if let Some(texture) = texture(name, picture, false) {
        node.set_normal_map(texture);
    }
}

/// `None` for a picture of another size than announced; the mesh keeps its colour then.
fn texture(name: &str, picture: &Picture, is_colour: bool) -> Option<Arc<Texture>> {
    let picture = RgbaImage::from_raw(picture.width, picture.height, picture.rgba.clone())?;
    Some(TextureManager::get_global_manager(|textures| {
        // Without them fine print falls apart from afar.
        textures.set_generate_mipmaps(true);
        textures.set_anisotropy(8);
        let picture = DynamicImage::ImageRgba8(picture.clone());
        textures.add_image_with_color_space(picture, name, is_colour)
    }))
}
