//! Where a mesh is folded over itself: neighbouring elements on the same side of their common face.

use std::fmt;

use super::surface::Faces;
use super::tet_mesh::TetMesh;

/// Neighbouring elements that lie on the same side of the face they share, so that they overlap.
///
/// Units: volumes m³.
#[derive(Clone, Debug, PartialEq)]
pub struct Folds {
    /// Faces with both elements on the same side.
    pub faces: usize,
    /// Elements at such faces, ascending, [`Folds::LISTED`] at most.
    pub first: Vec<usize>,
    /// Sum over these faces of the smaller element's volume: so much counts twice at most.
    pub volume: f64,
    /// Overlapping volume over the volume of the mesh.
    pub volume_rel: f64,
}

impl Folds {
    /// Elements that are listed.
    pub const LISTED: usize = 5;

    /// Folds of a mesh; `None` if there are none.
    ///
    /// Elements that overlap without a common face are not looked for.
    pub fn from_mesh(mesh: &TetMesh) -> Option<Self> {
        let mut folds = Self { faces: 0, first: Vec::new(), volume: 0.0, volume_rel: 0.0 };
        let mut smaller = Vec::new();
        Faces::from_mesh(mesh).for_each_triangle(|same| {
            let [(_, a), (_, b)] = same else { return };
            if !is_same_side(mesh, *a, *b) {
                return;
            }
            folds.first.extend([a / 4, b / 4]);
            smaller.push(mesh.signed_volume(a / 4).min(mesh.signed_volume(b / 4)));
        });
        if smaller.is_empty() {
            return None;
        }
        folds.faces = smaller.len();
        folds.first.sort_unstable();
        folds.first.dedup();
        folds.first.truncate(Self::LISTED);
        folds.volume = smaller.iter().sum();
        let all: f64 = (0..mesh.tets().len()).map(|tet| mesh.signed_volume(tet)).sum();
        folds.volume_rel = folds.volume / all;
        Some(folds)
    }
}

/// Whether two faces, as `4 · tet + face`, of the same three nodes have their elements on one side:
/// positive elements list it in the same sense then.
fn is_same_side(mesh: &TetMesh, a: usize, b: usize) -> bool {
    let outward = |id: usize| {
        let corners = mesh.tets()[id / 4];
        let face = super::surface::OUTWARD[id % 4].map(|c| corners[c]);
        // From its smallest node on.
        let first = (0..3).min_by_key(|&i| face[i]).unwrap_or(0);
        [face[first], face[(first + 1) % 3], face[(first + 2) % 3]]
    };
    outward(a) == outward(b)
}

impl fmt::Display for Folds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "the mesh is folded over itself: at {} faces both elements lie on the same side and \
             overlap (elements {:?}{}), up to {:.1} % of the volume counts twice, and no answer is \
             right there; mesh the object again",
            self.faces,
            self.first,
            if 2 * self.faces > Self::LISTED { " and more" } else { "" },
            100.0 * self.volume_rel
        )
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;
    use crate::mesh::{BuiltIn, generate};

    #[test]
    fn sound_meshes_have_no_folds() {
        for shape in [BuiltIn::Cube, BuiltIn::Sphere, BuiltIn::Toothpaste] {
            assert_eq!(Folds::from_mesh(&generate(shape, 300).unwrap()), None);
        }
    }

    /// Two elements on the same side of their common triangle: one lies inside the other.
    #[test]
    fn elements_on_the_same_side_of_a_face_are_a_fold_with_its_volume() {
        let vertices = vec![
            Point3::new(0.0, 0.0, 0.0),
            Point3::new(1.0, 0.0, 0.0),
            Point3::new(0.0, 1.0, 0.0),
            Point3::new(0.0, 0.0, 1.0),
            Point3::new(0.1, 0.1, 0.25),
        ];
        let mesh = TetMesh::try_new(vertices, vec![[1, 0, 2, 3], [1, 0, 2, 4]], vec![]).unwrap();
        let folds = Folds::from_mesh(&mesh).unwrap();
        assert_eq!((folds.faces, folds.first.as_slice()), (1, &[0, 1][..]));
        assert!((folds.volume_rel - 0.2).abs() < 1e-12, "{folds:?}");
        assert!(folds.to_string().contains("up to 20.0 % of the volume counts twice"), "{folds}");
    }

    /// A node of a cube's inside is moved through the faces round it, and what is inverted is turned.
    #[test]
    fn a_mesh_with_turned_elements_that_overlap_is_told_from_one_with_another_order() {
        let mesh = generate(BuiltIn::Cube, 125).unwrap();
        let other_order: Vec<[u32; 4]> =
            mesh.tets().iter().map(|t| [t[1], t[2], t[0], t[3]]).collect();
        let same = TetMesh::try_new(mesh.vertices().to_vec(), other_order, vec![]).unwrap();
        assert_eq!(Folds::from_mesh(&same), None);
        let (low, high) = mesh.bounds();
        let centre = nalgebra::center(&low, &high);
        let middle = |n: &usize| (mesh.vertices()[*n] - centre).norm() < 1e-9;
        let node = (0..mesh.node_count()).find(middle).unwrap();
        let mut vertices = mesh.vertices().to_vec();
        vertices[node].x += 0.4 * (high.x - low.x);
        let turned = mesh.tets().iter().map(|t| {
            let is_positive = crate::mesh::signed_volume(&t.map(|n| vertices[n as usize])) > 0.0;
            if is_positive { *t } else { [t[1], t[0], t[2], t[3]] }
        });
        let turned: Vec<[u32; 4]> = turned.collect();
        let folded = TetMesh::try_new(vertices, turned, vec![]).unwrap();
        let folds = Folds::from_mesh(&folded).unwrap();
        assert!(folds.faces > 3 && folds.volume_rel > 0.01, "{folds}");
    }
}
