//! One thing to draw: triangles, where they are now, and what they are made of.

use crate::view::texture::Texture;

/// Triangles of one material.
///
/// Shapes: `positions`, `normals` and `uvs` one per vertex; `triangles` index them,
/// counter-clockwise seen from outside. Units: m. Frame: the object's.
#[derive(Clone, Debug)]
pub struct Part {
    /// Name of the part, in a word.
    pub name: &'static str,
    /// Three vertex numbers of each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Positions of the vertices now.
    pub positions: Vec<[f32; 3]>,
    /// Outward unit normals of the vertices now.
    pub normals: Vec<[f32; 3]>,
    /// Places in the textures; (0, 0) is the first texel of the first row.
    pub uvs: Vec<[f32; 2]>,
    /// Material of the part.
    pub material: SurfaceMaterial,
}

/// How a surface takes the light, in the terms of physically based rendering.
#[derive(Clone, Debug)]
pub struct SurfaceMaterial {
    /// Linear red, green, blue; multiplies the texture (white where there is one).
    pub colour: [f32; 3],
    /// Roughness: 0 is a mirror, 1 is chalk.
    pub roughness: f32,
    /// Metallic share: 0 is no metal.
    pub metallic: f32,
    /// Strength and roughness of a clear layer on top, 0 to 1.
    pub clearcoat: (f32, f32),
    /// How much light comes through from behind, 0 to 1.
    pub subsurface: f32,
    /// Picture of the colours, encoded as sRGB.
    pub texture: Option<Texture>,
    /// Slopes of a fine relief as a normal map: linear values, red along −u, green along +v.
    ///
    /// It belongs to the same `uvs` as the texture; who puts other values there drops both.
    pub relief: Option<Texture>,
    /// Whether the back of a triangle can be seen.
    pub two_sided: bool,
}

impl SurfaceMaterial {
    /// A plain surface without texture.
    pub(super) fn plain(colour: [f32; 3], roughness: f32) -> Self {
        Self {
            colour,
            roughness,
            metallic: 0.0,
            clearcoat: (0.0, 0.0),
            subsurface: 0.0,
            texture: None,
            relief: None,
            two_sided: false,
        }
    }
}

/// Three single-precision numbers of a vector.
pub(super) fn single(v: &nalgebra::Vector3<f64>) -> [f32; 3] {
    [v.x as f32, v.y as f32, v.z as f32]
}
