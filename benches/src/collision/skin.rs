//! The surfaces that are searched, at rest and deformed.

use nalgebra::{Point3, Rotation3, Vector3};
use softgrasp_core::mesh::{BuiltIn, Surface, generate};

use crate::report::ReportError;

/// Surface of a built-in object, its vertices numbered from 0 without gaps.
///
/// Shapes: `points` V; `triangles` three indices each, counter-clockwise seen from outside.
/// Units: m. Frame: the object's, moved so that its bounding box is centred at the origin.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Skin {
    pub shape: BuiltIn,
    pub points: Vec<Point3<f64>>,
    pub triangles: Vec<[u32; 3]>,
}

/// Relative deviation of the number of vertices that is accepted.
const NEAR_ENOUGH: f64 = 0.03;
/// Number of meshes made to find one with the right number of vertices.
const TRIES_MAX: usize = 6;

impl Skin {
    /// Surface with about `vertices` vertices: the object's number of nodes is corrected until its
    /// surface has as many.
    ///
    /// # Errors
    /// [`ReportError::Generate`] if the object cannot be generated.
    pub fn try_new(shape: BuiltIn, vertices: usize) -> Result<Self, ReportError> {
        let wanted = vertices as f64;
        // Between a cube's six faces of n² and its n³ nodes.
        let mut nodes = (wanted / 5.0).powf(1.5);
        let mut best: Option<(f64, Self)> = None;
        for _ in 0..TRIES_MAX {
            let skin = Self::of_object(shape, nodes.round() as usize)?;
            let share = wanted / skin.points.len() as f64;
            let off = (share - 1.0).abs();
            if best.as_ref().is_none_or(|(least, _)| off < *least) {
                best = Some((off, skin));
            }
            if off <= NEAR_ENOUGH {
                break;
            }
            // A surface grows with the power 2/3 of a volume.
            nodes = (nodes * share.powf(1.5)).max(27.0);
        }
        Ok(best.expect("at least one mesh was made").1)
    }

    fn of_object(shape: BuiltIn, nodes: usize) -> Result<Self, ReportError> {
        let mesh = generate(shape, nodes)?;
        let surface = Surface::from_mesh(&mesh);
        let (low, high) = mesh.bounds();
        let centre = nalgebra::center(&low, &high).coords;
        let mut number = vec![0u32; mesh.node_count()];
        for (index, &node) in (0u32..).zip(&surface.nodes) {
            number[node as usize] = index;
        }
        let points = surface.nodes.iter().map(|&n| mesh.vertices()[n as usize] - centre).collect();
        let triangles = surface.triangles.iter().map(|t| t.map(|n| number[n as usize])).collect();
        Ok(Self { shape, points, triangles })
    }

    /// Vertices squeezed, twisted and bent; `amount` 1 means strains of some per cent.
    pub fn deformed(&self, amount: f64) -> Vec<Point3<f64>> {
        let bend = |p: &Point3<f64>| {
            let twist = Rotation3::from_axis_angle(&Vector3::y_axis(), 4.0 * amount * p.y);
            let squeezed =
                Vector3::new(p.x * (1.0 + 0.05 * amount), p.y * (1.0 - 0.08 * amount), p.z);
            let mut moved = twist * squeezed;
            moved.y += 3.0 * amount * p.x * p.x;
            Point3::from(moved)
        };
        self.points.iter().map(bend).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn surfaces_are_closed_and_of_the_size_asked_for() {
        for shape in [BuiltIn::Sphere, BuiltIn::Strawberry] {
            let skin = Skin::try_new(shape, 400).unwrap();
            let count = skin.points.len() as f64;
            assert!((count / 400.0 - 1.0).abs() <= 0.1, "{shape}: {count}");
            // Euler: a closed surface without handles.
            assert_eq!(skin.triangles.len(), 2 * skin.points.len() - 4, "{shape}");
            assert!(skin.triangles.iter().flatten().all(|&n| (n as usize) < skin.points.len()));
        }
    }
}
