//! A mask: surface nodes with weights, whose weighted mean displacement is prescribed (a boundary condition
//! on an average, beside Dirichlet values at single nodes).

use std::cmp::Ordering;

/// Nodes and weights of one contact: its force F acts on node i as `w_i F`, and what is prescribed
/// is the mean displacement `Σ w_i u_i`.
///
/// Shapes: one entry a node, ascending; `w_i > 0`, their sum is one. Equality and order are those
/// of the exact bits, so a mask can name what was computed for it.
///
/// Source: pressure masks of James and Pai (1999, 2001).
#[derive(Clone, Debug)]
pub struct Mask {
    entries: Vec<(u32, f64)>,
}

/// Weights that make no mask.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MaskError {
    /// No node, or no node with a weight above zero.
    #[error("it has no node with a weight above 0; give it at least one")]
    Empty,
    /// A weight that is negative or no number.
    #[error("node {node} has the weight {weight}; weights must be finite and not negative")]
    Weight {
        /// The node, from 0.
        node: u32,
        /// Its weight.
        weight: f64,
    },
    /// The mask names a node twice.
    #[error("node {node} is in it twice; name each node once")]
    Twice {
        /// The node, from 0.
        node: u32,
    },
    /// The mask names a node that the mesh does not have.
    #[error("it names node {node}, but the mesh has {node_count} nodes (0-based)")]
    NoSuchNode {
        /// The node, from 0.
        node: u32,
        /// Nodes of the mesh.
        node_count: usize,
    },
    /// The mask names a node that no element uses.
    #[error("node {node} is in it, but no tetrahedron uses that node; leave it out")]
    Orphan {
        /// The node, from 0.
        node: u32,
    },
    /// The mask names nodes of two bodies.
    #[error("nodes {first} and {second} belong to different bodies; give each body its own mask")]
    SeveralBodies {
        /// A node of one body.
        first: u32,
        /// A node of another.
        second: u32,
    },
}

impl Mask {
    /// A mask of `(node, weight)` in any order; the weights are divided by their sum, and nodes of
    /// weight zero are left out.
    ///
    /// # Errors
    /// [`MaskError`] for weights that are negative or no numbers, repeated nodes, and when nothing
    /// is left. Whether the nodes are there is for the mesh to say.
    pub fn try_new(mut entries: Vec<(u32, f64)>) -> Result<Self, MaskError> {
        if let Some(&(node, weight)) = entries.iter().find(|(_, w)| !(w.is_finite() && *w >= 0.0)) {
            return Err(MaskError::Weight { node, weight });
        }
        entries.sort_unstable_by_key(|entry| entry.0);
        if let Some(pair) = entries.windows(2).find(|pair| pair[0].0 == pair[1].0) {
            return Err(MaskError::Twice { node: pair[0].0 });
        }
        // By the largest first, so that the sum of very large or very small weights is finite.
        let largest = entries.iter().map(|entry| entry.1).fold(0.0, f64::max);
        if largest <= 0.0 {
            return Err(MaskError::Empty);
        }
        let sum: f64 = entries.iter().map(|entry| entry.1 / largest).sum();
        entries.iter_mut().for_each(|entry| entry.1 = entry.1 / largest / sum);
        entries.retain(|entry| entry.1 > 0.0);
        Ok(Self { entries })
    }

    /// A mask of one node: the contact of the thesis.
    pub fn of_node(node: u32) -> Self {
        Self { entries: vec![(node, 1.0)] }
    }

    /// Nodes and weights, ascending by node.
    pub fn entries(&self) -> &[(u32, f64)] {
        &self.entries
    }

    /// Mean of a quantity given by node.
    pub fn mean(&self, of_node: impl Fn(u32) -> f64) -> f64 {
        self.entries.iter().map(|&(node, weight)| weight * of_node(node)).sum()
    }

    fn bits(&self) -> impl Iterator<Item = (u32, u64)> + '_ {
        self.entries.iter().map(|&(node, weight)| (node, weight.to_bits()))
    }
}

impl PartialEq for Mask {
    fn eq(&self, other: &Self) -> bool {
        self.bits().eq(other.bits())
    }
}

impl Eq for Mask {}

impl PartialOrd for Mask {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Mask {
    fn cmp(&self, other: &Self) -> Ordering {
        self.bits().cmp(other.bits())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn weights_that_make_no_mask_are_named() {
        let error = |entries: &[(u32, f64)]| Mask::try_new(entries.to_vec()).unwrap_err();
        assert_eq!(error(&[]), MaskError::Empty);
        assert_eq!(error(&[(3, 0.0), (4, 0.0)]), MaskError::Empty);
        assert_eq!(error(&[(3, 1.0), (4, -0.5)]), MaskError::Weight { node: 4, weight: -0.5 });
        assert!(matches!(error(&[(3, f64::NAN)]), MaskError::Weight { node: 3, .. }));
        assert!(matches!(error(&[(3, f64::INFINITY)]), MaskError::Weight { node: 3, .. }));
        assert_eq!(error(&[(7, 1.0), (2, 1.0), (7, 2.0)]), MaskError::Twice { node: 7 });
    }

    #[test]
    fn order_and_scale_of_the_weights_do_not_matter() {
        let mask = Mask::try_new(vec![(5, 1.0), (2, 3.0), (9, 0.0)]).unwrap();
        assert_eq!(mask.entries(), [(2, 0.75), (5, 0.25)]);
        for scale in [1e300, 1e-300] {
            let scaled = Mask::try_new(vec![(2, 3.0 * scale), (5, scale)]).unwrap();
            assert!(scaled.entries().iter().all(|e| e.1.is_finite()));
            assert!((scaled.entries()[0].1 - 0.75).abs() < 1e-15);
        }
        assert_eq!(mask, mask.clone());
        assert!(mask != Mask::of_node(2) && Mask::of_node(2) < Mask::of_node(3));
    }

    proptest! {
        #[test]
        fn weights_sum_to_one(weights in prop::collection::vec(0.0..1e9f64, 1..50)) {
            prop_assume!(weights.iter().any(|w| *w > 0.0));
            let mask = Mask::try_new((0u32..).zip(weights).collect()).unwrap();
            prop_assert!((mask.mean(|_| 1.0) - 1.0).abs() < 1e-14);
        }
    }
}
