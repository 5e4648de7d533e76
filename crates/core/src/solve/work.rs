//! How much there is to do for one answer, counted or estimated before anything is done.

use super::FrontAnalysis;
use crate::fem::{AXES, Element};

/// Work of one answer by a factor over the tree of fronts, in units whose cost a machine can
/// measure.
///
/// Units: counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Work {
    /// Pairs of nodes that share an element, element by element: what assembly adds up.
    pub element_pairs: f64,
    /// 3 × 3 blocks of the stiffness: what the order looks at and a product multiplies.
    pub blocks: f64,
    /// Unknown degrees of freedom.
    pub unknown_dofs: f64,
    /// Floating point operations of a factor.
    pub factor_flops: f64,
    /// Numbers the factor holds.
    pub factor_entries: f64,
    /// Numbers held at once while it is made, at most.
    pub peak_entries: f64,
}

/// Nodes and elements of a mesh of linear tetrahedra.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeshSize {
    /// Nodes.
    pub nodes: usize,
    /// Tetrahedra.
    pub tets: usize,
}

/// Operations of a factor over the square of the nodes of the system, and numbers of the factor
/// over their power 4/3: the laws of nested dissection in three dimensions (George 1973), whose
/// constants depend on the shape. Counted by `examples/work_law.rs` on cubes, strawberries and
/// tubes of 500 to 8000 corners with both elements: 63 to 257 and 52 to 127, smaller for slender
/// shapes; contributions waiting add 1.3 to 2.2 times the factor.
const FLOPS_PER_NODE_SQUARED: f64 = 160.0;
const ENTRIES_PER_NODE_POWER: f64 = 90.0;
const PEAK_OVER_ENTRIES: f64 = 2.2;
/// Blocks of a row of the stiffness; from the same count.
const BLOCKS_PER_NODE: [f64; 2] = [13.5, 27.0];

impl Work {
    /// Estimate from the size of a mesh alone, within a factor of about 2.5 for the factor.
    ///
    /// Ten-node elements add a node per edge; a mesh of N nodes and M tetrahedra has nearly N + M
    /// edges (Euler), fewer by the boundary's share.
    pub fn estimate(size: MeshSize, element: Element) -> Self {
        let (corners, tets) = (size.nodes as f64, size.tets as f64);
        let (nodes, blocks_per_node) = match element {
            Element::Tet4 => (corners, BLOCKS_PER_NODE[0]),
            Element::Tet10 => (2.0 * corners + tets, BLOCKS_PER_NODE[1]),
        };
        let factor_entries = ENTRIES_PER_NODE_POWER * nodes.powf(4.0 / 3.0);
        Self {
            element_pairs: tets * (element.node_count() as f64).powi(2),
            blocks: blocks_per_node * nodes,
            unknown_dofs: AXES as f64 * nodes,
            factor_flops: FLOPS_PER_NODE_SQUARED * nodes.powi(2),
            factor_entries,
            peak_entries: PEAK_OVER_ENTRIES * factor_entries,
        }
    }

    /// The same with what the analysis of the pattern has counted.
    pub fn counted(self, analysis: &FrontAnalysis) -> Self {
        Self {
            unknown_dofs: analysis.row_count() as f64,
            factor_flops: analysis.flops(),
            // Bytes of numbers of one byte each.
            factor_entries: analysis.factor_bytes::<u8>() as f64,
            peak_entries: analysis.peak_bytes::<u8>() as f64,
            ..self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::Material;
    use crate::mesh::{BuiltIn, generate};
    use crate::model::Model;
    use crate::solve::Analysed;

    /// The law is the oracle's average: no shape may leave it by more than the factor it promises.
    #[test]
    fn estimates_are_within_a_factor_of_the_counts() {
        for shape in [BuiltIn::Cube, BuiltIn::Strawberry, BuiltIn::Toothpaste] {
            for element in [Element::Tet4, Element::Tet10] {
                let mesh = generate(shape, 1000).unwrap();
                let size = MeshSize { nodes: mesh.node_count(), tets: mesh.tets().len() };
                let material = Material::try_new(1.0, 0.3).unwrap();
                let model =
                    Model::try_new(mesh, element, &[material], vec![], &mut |_| {}).unwrap();
                let nodes = [0, 500, 999].into_iter().flat_map(|n| 3 * n..3 * n + 3);
                let analysed: Analysed =
                    model.analyse(&nodes.collect::<Vec<_>>(), &mut |_| {}).unwrap();
                let estimate = Work::estimate(size, element);
                let counted = estimate.counted(analysed.analysis());
                let close = |a: f64, b: f64, factor: f64| {
                    assert!(a < factor * b && b < factor * a, "{shape:?} {element:?}: {a} {b}");
                };
                close(estimate.unknown_dofs, counted.unknown_dofs, 1.15);
                close(estimate.factor_flops, counted.factor_flops, 2.6);
                close(estimate.factor_entries, counted.factor_entries, 2.0);
                close(estimate.peak_entries, counted.peak_entries, 2.6);
                let blocks = model.stiffness().pattern().block_count() as f64;
                close(estimate.blocks, blocks, 1.25);
            }
        }
    }
}
