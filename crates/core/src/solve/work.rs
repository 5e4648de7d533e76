//! The number of operations and entries of an answer, estimated or counted beforehand.

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
    /// Number of nodes.
    pub nodes: usize,
    /// Number of tetrahedra.
    pub tets: usize,
}

/// Operations of a factor over the square of the nodes of the system, and numbers of the factor
/// over their power 4/3: the laws of nested dissection in three dimensions (George 1973). What they
/// are multiplied with depends on the shape, smaller for slender ones, and grows by so much with the
/// logarithm of the nodes. Counted by `examples/work_law.rs` on cubes, spheres, strawberries and
/// tubes of 500 to 160 000 corners (linear; ten-node to 8000), which leave the laws by factors of
/// 0.6 to 1.7 (operations) and 0.75 to 1.35 (numbers).
const FLOPS: [f64; 2] = [21.0, 13.0];
const ENTRIES: [f64; 2] = [15.0, 6.6];
/// What is held at once while the factor is made, over the factor; from the same count.
const PEAK_OVER_ENTRIES: f64 = 1.4;
/// How much more operations and numbers averaged nodal pressure takes, which couples nodes two
/// elements apart; from the same count, on 500 to 8000 corners.
const NODAL_PRESSURE: [f64; 2] = [5.5, 2.4];
/// Blocks of a row of the stiffness; from the same count.
const BLOCKS_PER_NODE: [f64; 3] = [13.5, 50.0, 27.0];

impl Work {
    /// Estimate from the size of a mesh alone, within a factor of about 2 for the factor of bodies as
    /// thick as a tube or thicker.
    ///
    /// Ten-node elements add a node per edge; a mesh of N nodes and M tetrahedra has nearly N + M
    /// edges (Euler), fewer by the boundary's share.
    pub fn estimate(size: MeshSize, element: Element) -> Self {
        let (corners, tets) = (size.nodes as f64, size.tets as f64);
        let (nodes, blocks_per_node) = match element {
            Element::Tet4 => (corners, BLOCKS_PER_NODE[0]),
            Element::Tet4Anp => (corners, BLOCKS_PER_NODE[1]),
            Element::Tet10 => (2.0 * corners + tets, BLOCKS_PER_NODE[2]),
        };
        let [more_flops, more_entries] = match element {
            Element::Tet4 | Element::Tet10 => [1.0, 1.0],
            Element::Tet4Anp => NODAL_PRESSURE,
        };
        let law = |[constant, growth]: [f64; 2]| constant + growth * nodes.max(1.0).ln();
        let factor_entries = more_entries * law(ENTRIES) * nodes.powf(4.0 / 3.0);
        Self {
            element_pairs: tets * (element.node_count() as f64).powi(2),
            blocks: blocks_per_node * nodes,
            unknown_dofs: AXES as f64 * nodes,
            factor_flops: more_flops * law(FLOPS) * nodes.powi(2),
            factor_entries,
            peak_entries: PEAK_OVER_ENTRIES * factor_entries,
        }
    }

    /// Work with the operations and entries that the analysis of the pattern has counted.
    pub fn counted(self, analysis: &FrontAnalysis) -> Self {
        Self {
            unknown_dofs: analysis.row_count() as f64,
            factor_flops: analysis.flops(),
            factor_entries: (analysis.factor_bytes::<f64>() / size_of::<f64>()) as f64,
            peak_entries: (analysis.peak_bytes::<f64>() / size_of::<f64>()) as f64,
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
        for shape in [BuiltIn::Cube, BuiltIn::Sphere, BuiltIn::Strawberry, BuiltIn::Toothpaste] {
            for element in Element::ALL {
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
                close(estimate.factor_flops, counted.factor_flops, 2.0);
                close(estimate.factor_entries, counted.factor_entries, 1.5);
                close(estimate.peak_entries, counted.peak_entries, 1.8);
                let blocks = model.stiffness().pattern().block_count() as f64;
                close(estimate.blocks, blocks, 1.25);
            }
        }
    }
}
