//! The boundary surface of a mesh: the display list of the thesis.
//! The faces of all elements are grouped so that equal triangles lie side by side.

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

/// The faces that exactly one element has, as element and face, in the order of the elements.
fn boundary_faces(mesh: &TetMesh) -> Vec<(usize, usize)> {
    let mut boundary = Vec::new();
    Faces::from_mesh(mesh).for_each_triangle(|same| {
        if let [(_, id)] = same {
            boundary.push(*id);
        }
    });
    boundary.sort_unstable();
    boundary.into_iter().map(|id| (id / 4, id % 4)).collect()
}

/// Position of the edge between two corners among the edges 12, 23, 13, 14, 24, 34.
const fn edge_between(ends: [usize; 2]) -> usize {
    match ends {
        [0, 1] | [1, 0] => 0,
        [1, 2] | [2, 1] => 1,
        [0, 2] | [2, 0] => 2,
        [0, 3] | [3, 0] => 3,
        [1, 3] | [3, 1] => 4,
        _ => 5,
    }
}

/// Boundary triangles of a mesh, and the vertices they use.
///
/// Shapes: `triangles` P × 3 node indices, counter-clockwise seen from outside, in the order of
/// the elements they bound; `nodes` ascending, each once.
///
/// Source: thesis Table 3.1, list 3.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Surface {
    /// The display list.
    pub triangles: Vec<[u32; 3]>,
    /// Nodes on the surface, ascending.
    pub nodes: Vec<u32>,
}

impl Surface {
    /// The faces that exactly one element has, turned outward.
    ///
    /// A face of three or more elements (overlapping elements) is not part of the surface; see
    /// [`Surface::overused_faces`].
    pub fn from_mesh(mesh: &TetMesh) -> Self {
        let face = |(tet, face): (usize, usize)| OUTWARD[face].map(|c| mesh.tets()[tet][c]);
        Self::of_triangles(mesh, boundary_faces(mesh).into_iter().map(face).collect())
    }

    /// The same faces between all nodes of the mesh: one of an element with mid-edge nodes is four flat
    /// triangles. That of [`Surface::from_mesh`] where the mesh has no mid-edge nodes.
    pub fn with_mid_edge_nodes(mesh: &TetMesh) -> Self {
        if mesh.mid_edge_nodes().is_empty() {
            return Self::from_mesh(mesh);
        }
        let faces = boundary_faces(mesh).into_iter().flat_map(|(tet, face)| {
            let corners = OUTWARD[face];
            let [a, b, c] = corners.map(|corner| mesh.tets()[tet][corner]);
            let [ab, bc, ca] = [0, 1, 2].map(|side| {
                let ends = [corners[side], corners[(side + 1) % 3]];
                mesh.mid_edge_nodes()[tet][edge_between(ends)]
            });
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        });
        Self::of_triangles(mesh, faces.collect())
    }

    fn of_triangles(mesh: &TetMesh, triangles: Vec<[u32; 3]>) -> Self {
        let mut on_surface = vec![false; mesh.node_count()];
        for &n in triangles.iter().flatten() {
            on_surface[n as usize] = true;
        }
        let nodes = (0u32..).zip(&on_surface).filter(|(_, on)| **on).map(|(n, _)| n).collect();
        Self { triangles, nodes }
    }

    /// Number of different faces that three or more elements of `mesh` share; 0 in a sound mesh.
    pub fn overused_faces(mesh: &TetMesh) -> usize {
        let mut count = 0;
        Faces::from_mesh(mesh).for_each_triangle(|same| count += usize::from(same.len() > 2));
        count
    }

    /// Number of edges that are not shared by exactly two triangles of opposite sense.
    ///
    /// The surface is closed and orientable around every edge exactly if this is 0.
    pub fn non_manifold_edges(&self) -> usize {
        let mut edges: Vec<(u32, u32, bool)> = self
            .triangles
            .iter()
            .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)])
            .map(|(from, to)| (from.min(to), from.max(to), from < to))
            .collect();
        edges.sort_unstable();
        edges
            .chunk_by(|a, b| (a.0, a.1) == (b.0, b.1))
            .filter(|uses| !matches!(uses, [(_, _, false), (_, _, true)]))
            .count()
    }

    /// Number of nodes around which the triangles do not form one closed fan.
    ///
    /// Two bodies that touch in one node give 1 here and no non-manifold edge.
    pub fn non_manifold_nodes(&self) -> usize {
        // One entry per triangle corner: the node, and the edge opposite it, in sense.
        let mut links: Vec<(u32, u32, u32)> = self
            .triangles
            .iter()
            .flat_map(|&[a, b, c]| [(a, b, c), (b, c, a), (c, a, b)])
            .collect();
        links.sort_unstable();
        links.chunk_by(|a, b| a.0 == b.0).filter(|fan| !is_one_fan(fan)).count()
    }

    /// Euler characteristic V − E + F of a closed surface: 2 for a ball, 0 for a ring.
    pub fn euler_characteristic(&self) -> i64 {
        // A closed surface has three half-edges a face and two a edge.
        let faces = i64::try_from(self.triangles.len()).expect("fewer than 2⁶³ triangles fit");
        let nodes = i64::try_from(self.nodes.len()).expect("fewer than 2⁶³ nodes fit");
        nodes - faces / 2
    }
}

/// Whether the edges opposite one node, sorted by their start, join to a single ring.
fn is_one_fan(fan: &[(u32, u32, u32)]) -> bool {
    let first = fan[0].1;
    let mut at = first;
    for step in 1..=fan.len() {
        let Ok(index) = fan.binary_search_by_key(&at, |link| link.1) else { return false };
        at = fan[index].2;
        if at == first {
            return step == fan.len();
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use nalgebra::Point3;
    use proptest::prelude::*;

    use super::*;
    use crate::mesh::{BuiltIn, generate};

    /// Every face counted in a map, by definition.
    fn naive_boundary(mesh: &TetMesh) -> Vec<[u32; 3]> {
        let mut uses: BTreeMap<[u32; 3], usize> = BTreeMap::new();
        for t in mesh.tets() {
            for skip in 0..4 {
                let mut face: Vec<u32> = (0..4).filter(|&c| c != skip).map(|c| t[c]).collect();
                face.sort_unstable();
                *uses.entry([face[0], face[1], face[2]]).or_default() += 1;
            }
        }
        uses.into_iter().filter(|(_, n)| *n == 1).map(|(face, _)| face).collect()
    }

    fn two_tets(second: [u32; 4], extra: Vec<Point3<f64>>) -> TetMesh {
        let mut vertices = vec![
            Point3::new(1.0, 0.0, 0.0),
            Point3::new(0.0, 1.0, 0.0),
            Point3::new(0.0, 0.0, 1.0),
            Point3::origin(),
        ];
        vertices.extend(extra);
        TetMesh::try_new(vertices, vec![[0, 1, 2, 3], second], vec![]).unwrap()
    }

    #[test]
    fn single_tetrahedron_has_four_outward_faces() {
        let mesh = TetMesh::try_new(
            two_tets([0, 1, 2, 3], vec![]).vertices().to_vec(),
            vec![[0, 1, 2, 3]],
            vec![],
        )
        .unwrap();
        let surface = Surface::from_mesh(&mesh);
        assert_eq!(surface.nodes, [0, 1, 2, 3]);
        assert_eq!(surface.triangles.len(), 4);
        let inside = Point3::new(0.1, 0.1, 0.1);
        for t in &surface.triangles {
            let [a, b, c] = t.map(|n| mesh.vertices()[n as usize]);
            assert!((b - a).cross(&(c - a)).dot(&(a - inside)) > 0.0);
        }
        assert_eq!(surface.non_manifold_edges(), 0);
        assert_eq!(surface.euler_characteristic(), 2);
    }

    #[test]
    fn bodies_that_share_an_edge_or_a_node_are_seen() {
        let at = |x, y, z| Point3::new(x, y, z);
        // Shares the edge 0–3 only.
        let edge = two_tets([0, 4, 5, 3], vec![at(0.0, -1.0, 0.0), at(0.0, 0.0, -1.0)]);
        assert_eq!(Surface::from_mesh(&edge).non_manifold_edges(), 1);
        // Shares node 3 only.
        let extra = vec![at(-1.0, 0.0, 0.0), at(0.0, 0.0, -1.0), at(0.0, -1.0, 0.0)];
        let node = Surface::from_mesh(&two_tets([4, 5, 6, 3], extra));
        assert_eq!((node.non_manifold_edges(), node.non_manifold_nodes()), (0, 1));
    }

    #[test]
    fn face_of_three_elements_is_counted_and_left_out() {
        let mesh = two_tets([0, 1, 2, 3], vec![]);
        let mut tets = mesh.tets().to_vec();
        tets.push([0, 1, 2, 3]);
        let mesh = TetMesh::try_new(mesh.vertices().to_vec(), tets, vec![]).unwrap();
        assert_eq!(Surface::overused_faces(&mesh), 4);
        assert!(Surface::from_mesh(&mesh).triangles.is_empty());
    }

    proptest! {
        #[test]
        fn any_element_list_has_the_naive_boundary(
            picks in prop::collection::vec(prop::array::uniform4(0u32..9), 1..40)
        ) {
            // Points on a moment curve: four different ones are never in one plane.
            let curve = |n: u32| { let t = f64::from(n); Point3::new(t, t * t, t * t * t) };
            let tets: Vec<[u32; 4]> = picks
                .into_iter()
                .filter_map(|mut t| {
                    t.sort_unstable();
                    let distinct = t.windows(2).all(|w| w[0] < w[1]);
                    distinct.then(|| [t[1], t[0], t[2], t[3]])
                })
                .collect();
            prop_assume!(!tets.is_empty());
            let flip = |t: [u32; 4]| {
                let volume = crate::mesh::signed_volume(&t.map(curve));
                if volume > 0.0 { t } else { [t[1], t[0], t[2], t[3]] }
            };
            let tets = tets.into_iter().map(flip).collect();
            let mesh = TetMesh::try_new((0..9).map(curve).collect(), tets, vec![]).unwrap();
            let mut sorted = Surface::from_mesh(&mesh).triangles;
            sorted.iter_mut().for_each(|t| t.sort_unstable());
            sorted.sort_unstable();
            prop_assert_eq!(sorted, naive_boundary(&mesh));
        }
    }

    #[test]
    fn surface_of_the_cube_encloses_its_volume() {
        let mesh = generate(BuiltIn::Cube, 343).unwrap();
        let surface = Surface::from_mesh(&mesh);
        // Divergence theorem: a sixth of a · (b × c) over outward triangles.
        let enclosed: f64 = surface
            .triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|n| mesh.vertices()[n as usize].coords);
                a.dot(&b.cross(&c)) / 6.0
            })
            .sum();
        assert!((enclosed - 0.06f64.powi(3)).abs() < 1e-15);
    }
}
