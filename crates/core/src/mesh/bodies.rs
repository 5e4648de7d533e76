//! Connected parts of a mesh: bodies are connected through nodes, pieces through faces.

use super::TetMesh;
use super::surface::Faces;

/// Which body and which piece every element belongs to.
///
/// A *body* is a set of elements joined through shared nodes (what one set of six rigid modes
/// moves in the assembled equations); a *piece* is joined through shared faces, so a body whose
/// pieces hang together by an edge or a node only has hinges.
///
/// Shapes: `of_tet` and `piece_of_tet` M labels; `of_node` N labels, `None` for orphans;
/// `tet_counts` one per body, `piece_tet_counts` one per piece.
/// Labels count from 0 in the order of each part's first element.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Bodies {
    /// Body of each element.
    pub of_tet: Vec<u32>,
    /// Body of each node.
    pub of_node: Vec<Option<u32>>,
    /// Elements in each body.
    pub tet_counts: Vec<usize>,
    /// Nodes in each body.
    pub node_counts: Vec<usize>,
    /// Piece of each element.
    pub piece_of_tet: Vec<u32>,
    /// Elements in each piece.
    pub piece_tet_counts: Vec<usize>,
}

impl Bodies {
    /// Labels the parts of a mesh; a mid-edge node belongs to the body of its element, and joins none.
    pub fn from_mesh(mesh: &TetMesh) -> Self {
        let mut bodies = Self::from_tets(mesh.node_count(), mesh.tets());
        for (nodes, &body) in mesh.mid_edge_nodes().iter().zip(&bodies.of_tet) {
            for &node in nodes {
                if bodies.of_node[node as usize].replace(body).is_none() {
                    bodies.node_counts[body as usize] += 1;
                }
            }
        }
        bodies
    }

    /// Connected bodies of tetrahedra that are no mesh yet, some of them perhaps flat or repeated.
    ///
    /// Shapes: `tets` corner indices below `node_count`.
    pub(crate) fn from_tets(node_count: usize, tets: &[[u32; 4]]) -> Self {
        let mut nodes = DisjointSets::new(node_count);
        for t in tets {
            for c in 1..4 {
                nodes.join(t[0] as usize, t[c] as usize);
            }
        }
        let roots = tets.iter().map(|t| nodes.root(t[0] as usize));
        let (of_tet, tet_counts) = label(roots, node_count);

        let mut of_node = vec![None; node_count];
        let mut node_counts = vec![0; tet_counts.len()];
        for (t, &body) in tets.iter().zip(&of_tet) {
            for &n in t {
                if of_node[n as usize].replace(body).is_none() {
                    node_counts[body as usize] += 1;
                }
            }
        }

        let mut elements = DisjointSets::new(tets.len());
        Faces::from_tets(node_count, tets).for_each_triangle(|same| {
            for pair in same.windows(2) {
                elements.join(pair[0].1 / 4, pair[1].1 / 4);
            }
        });
        let roots = (0..tets.len()).map(|t| elements.root(t));
        let (piece_of_tet, piece_tet_counts) = label(roots, tets.len());
        Self { of_tet, of_node, tet_counts, node_counts, piece_of_tet, piece_tet_counts }
    }

    /// Number of bodies.
    pub fn count(&self) -> usize {
        self.tet_counts.len()
    }

    /// Number of pieces, at least [`Bodies::count`].
    pub fn piece_count(&self) -> usize {
        self.piece_tet_counts.len()
    }

    /// Number of nodes in no element.
    pub fn orphan_count(&self) -> usize {
        self.of_node.iter().filter(|body| body.is_none()).count()
    }
}

/// Numbers the parts in the order in which their roots first appear, and counts their members.
///
/// `root_count` bounds the roots.
fn label(roots: impl Iterator<Item = usize>, root_count: usize) -> (Vec<u32>, Vec<usize>) {
    let mut label_of_root = vec![None; root_count];
    let mut counts: Vec<usize> = Vec::new();
    let labels = roots
        .map(|root| {
            let label = *label_of_root[root].get_or_insert_with(|| {
                counts.push(0);
                counts.len() - 1
            });
            counts[label] += 1;
            u32::try_from(label).expect("no more parts than nodes, whose indices are u32")
        })
        .collect();
    (labels, counts)
}

/// Union-find with path halving; the smaller root wins, so results do not depend on the order.
pub(crate) struct DisjointSets {
    parent: Vec<usize>,
}

impl DisjointSets {
    /// Every member in a set of its own.
    pub(crate) fn new(count: usize) -> Self {
        Self { parent: (0..count).collect() }
    }

    /// The smallest member of the set of `at`.
    pub(crate) fn root(&mut self, mut at: usize) -> usize {
        while self.parent[at] != at {
            self.parent[at] = self.parent[self.parent[at]];
            at = self.parent[at];
        }
        at
    }

    /// Makes one set of the sets of `a` and `b`.
    pub(crate) fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.parent[a.max(b)] = a.min(b);
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;
    use proptest::prelude::*;

    use super::*;
    use crate::mesh::signed_volume;

    fn curve(n: u32) -> Point3<f64> {
        let t = f64::from(n);
        Point3::new(t, t * t, t * t * t)
    }

    /// Elements over the moment curve, turned positive.
    fn mesh(nodes: u32, tets: &[[u32; 4]]) -> TetMesh {
        let positive = |t: &[u32; 4]| {
            if signed_volume(&t.map(curve)) > 0.0 { *t } else { [t[1], t[0], t[2], t[3]] }
        };
        let tets = tets.iter().map(positive).collect();
        TetMesh::try_new((0..nodes).map(curve).collect(), tets, vec![]).unwrap()
    }

    /// Spreads the smallest label over elements with at least `shared` common nodes until it rests.
    fn naive_labels(tets: &[[u32; 4]], shared: usize) -> Vec<u32> {
        let mut labels: Vec<usize> = (0..tets.len()).collect();
        loop {
            let before = labels.clone();
            for i in 0..tets.len() {
                for j in 0..tets.len() {
                    let common = tets[i].iter().filter(|n| tets[j].contains(n)).count();
                    if common >= shared {
                        labels[i] = labels[i].min(labels[j]);
                    }
                }
            }
            if labels == before {
                break;
            }
        }
        let mut order: Vec<usize> = labels.clone();
        order.sort_unstable();
        order.dedup();
        labels.iter().map(|l| order.binary_search(l).unwrap() as u32).collect()
    }

    #[test]
    fn touching_by_a_node_is_one_body_of_two_pieces() {
        let bodies = Bodies::from_mesh(&mesh(9, &[[0, 1, 2, 3], [3, 4, 5, 6]]));
        assert_eq!((bodies.count(), bodies.piece_count(), bodies.orphan_count()), (1, 2, 2));
        assert_eq!(bodies.of_node[8], None);
        assert_eq!(bodies.node_counts, [7]);
    }

    #[test]
    fn separate_bodies_are_numbered_by_their_first_element() {
        let bodies = Bodies::from_mesh(&mesh(8, &[[4, 5, 6, 7], [0, 1, 2, 3]]));
        assert_eq!(bodies.of_tet, [0, 1]);
        assert_eq!(bodies.of_node[0], Some(1));
        assert_eq!(bodies.tet_counts, [1, 1]);
    }

    proptest! {
        #[test]
        fn labels_agree_with_repeated_spreading(
            picks in prop::collection::vec(prop::array::uniform4(0u32..24), 1..14)
        ) {
            let tets: Vec<[u32; 4]> = picks
                .into_iter()
                .filter(|t| (0..4).all(|i| (0..i).all(|j| t[i] != t[j])))
                .collect();
            prop_assume!(!tets.is_empty());
            let bodies = Bodies::from_mesh(&mesh(24, &tets));
            prop_assert_eq!(&bodies.of_tet, &naive_labels(&tets, 1));
            prop_assert_eq!(&bodies.piece_of_tet, &naive_labels(&tets, 3));
            prop_assert_eq!(bodies.tet_counts.iter().sum::<usize>(), tets.len());
        }
    }
}
