//! The faces of all elements, grouped so that equal triangles lie side by side.

use super::TetMesh;

/// Corners of face `f` of a positive tetrahedron, counter-clockwise seen from outside.
///
/// Face `f` lies opposite corner `f`.
pub(super) const OUTWARD: [[usize; 3]; 4] = [[1, 3, 2], [0, 2, 3], [0, 3, 1], [0, 1, 2]];

/// All faces of a mesh, equal ones adjacent.
///
/// Shapes: `faces` 4 M entries of key and id (`4 · tet + face`), grouped by smallest corner,
/// sorted by key and id inside a group; `starts` N + 1 group borders.
/// Invariant: two entries of one group are the same triangle exactly if their keys agree.
#[derive(Debug)]
pub(super) struct Faces {
    starts: Vec<usize>,
    faces: Vec<(u64, usize)>,
}

impl Faces {
    /// Groups the faces by a counting sort on the smallest corner, then a short sort per group.
    pub(super) fn from_mesh(mesh: &TetMesh) -> Self {
        Self::from_tets(mesh.node_count(), mesh.tets())
    }

    /// Faces of tetrahedra that are no mesh yet.
    pub(super) fn from_tets(node_count: usize, tets: &[[u32; 4]]) -> Self {
        let mut starts = vec![0; node_count + 1];
        for corners in tets {
            for [low, _, _] in sorted_faces(corners) {
                starts[low as usize + 1] += 1;
            }
        }
        for n in 1..starts.len() {
            starts[n] += starts[n - 1];
        }
        let mut next = starts.clone();
        let mut faces = vec![(0, 0); 4 * tets.len()];
        for (tet, corners) in tets.iter().enumerate() {
            for (face, [low, mid, high]) in sorted_faces(corners).into_iter().enumerate() {
                let slot = &mut next[low as usize];
                faces[*slot] = (u64::from(mid) << 32 | u64::from(high), 4 * tet + face);
                *slot += 1;
            }
        }
        for group in starts.windows(2) {
            faces[group[0]..group[1]].sort_unstable();
        }
        Self { starts, faces }
    }

    /// Calls `visit` once per different triangle, with the entries that share it; an entry's
    /// second field is `4 · tet + face`.
    pub(super) fn for_each_triangle(&self, mut visit: impl FnMut(&[(u64, usize)])) {
        for group in self.starts.windows(2) {
            for same in self.faces[group[0]..group[1]].chunk_by(|a, b| a.0 == b.0) {
                visit(same);
            }
        }
    }
}

/// The four faces of an element, face `f` opposite corner `f`, corners in ascending order.
fn sorted_faces(corners: &[u32; 4]) -> [[u32; 3]; 4] {
    OUTWARD.map(|face| {
        let mut triangle = face.map(|c| corners[c]);
        triangle.sort_unstable();
        triangle
    })
}
