//! Columns of the compliance at the nodes of the boundary surface, node by node: what contact reads again
//! and again, and what a memory must bring in one piece.

use crate::mesh::{Surface, TetMesh};

/// The nodes of a boundary surface, and where each of them stands among them.
///
/// Shapes: `nodes` ascending; `places` one for each node of the mesh.
pub(super) struct SurfaceNodes {
    nodes: Vec<u32>,
    places: Vec<u32>,
}

/// Displacement of a node of the surface under a unit force along x, y and z, one after the other, m/N.
pub(super) type Block = [f64; 9];

/// Of a node that is inside.
const INSIDE: u32 = u32::MAX;

impl SurfaceNodes {
    pub fn from_mesh(mesh: &TetMesh) -> Self {
        let nodes = Surface::from_mesh(mesh).nodes;
        let mut places = vec![INSIDE; mesh.node_count()];
        for (place, &node) in (0..).zip(&nodes) {
            places[node as usize] = place;
        }
        Self { nodes, places }
    }

    /// Position of a node among those of the surface.
    pub fn place_of(&self, node: u32) -> Option<usize> {
        let place = self.places.get(node as usize).copied().unwrap_or(INSIDE);
        (place != INSIDE).then_some(place as usize)
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice()) + size_of_val(self.places.as_slice())
    }

    /// Bytes of the blocks of one contact.
    pub fn block_bytes(&self) -> usize {
        self.nodes.len() * size_of::<Block>()
    }

    /// The blocks of a contact, in the order of the nodes.
    ///
    /// Shapes: `fields` displacement of every degree of freedom under a unit force along x, y, z; 3 × 3N.
    pub fn blocks(&self, [x, y, z]: [&[f64]; 3]) -> Vec<Block> {
        let block = |&node: &u32| {
            let at = 3 * node as usize;
            let [x, y, z] = [&x[at..at + 3], &y[at..at + 3], &z[at..at + 3]];
            [x[0], x[1], x[2], y[0], y[1], y[2], z[0], z[1], z[2]]
        };
        self.nodes.iter().map(block).collect()
    }
}
