//! The contacts of a frame: touched degrees of freedom, and masks.

use super::error::CondensedError;
use crate::contact::Mask;

/// What is held and gets a displacement: the columns of E.
///
/// Shapes: one unknown force per entry of `dofs`, then three (x, y, z) per mask; in this order stand
/// the displacements asked for and the forces answered.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Touched {
    /// Degrees of freedom `3 · node + axis`, ascending, none of them fixed by the scene.
    pub dofs: Vec<u32>,
    /// Masks; they may share nodes with each other and with `dofs`.
    pub masks: Vec<Mask>,
}

/// One thing that columns of the compliance belong to.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Contact {
    /// A single node.
    Node(u32),
    /// A mask, named by the exact bits of its nodes and weights.
    Mask(Mask),
}

impl Touched {
    /// Degrees of freedom only, ascending.
    pub fn of_dofs(dofs: &[u32]) -> Self {
        Self { dofs: dofs.to_vec(), masks: Vec::new() }
    }

    /// Number of unknown forces: c.
    pub fn force_count(&self) -> usize {
        self.dofs.len() + 3 * self.masks.len()
    }

    /// Each node of `dofs` once, then the masks.
    pub(super) fn contacts(&self) -> Vec<Contact> {
        let mut nodes: Vec<u32> = self.dofs.iter().map(|d| d / 3).collect();
        nodes.dedup();
        let masks = self.masks.iter().cloned().map(Contact::Mask);
        nodes.into_iter().map(Contact::Node).chain(masks).collect()
    }

    /// Position in [`Touched::contacts`] and axis of every unknown force.
    pub(super) fn places(&self) -> Vec<(usize, usize)> {
        let mut places = Vec::with_capacity(self.force_count());
        let (mut node_count, mut last) = (0, None);
        for &dof in &self.dofs {
            if last != Some(dof / 3) {
                (node_count, last) = (node_count + 1, Some(dof / 3));
            }
            places.push((node_count - 1, dof as usize % 3));
        }
        let masks = (0..self.masks.len()).map(|mask| node_count + mask);
        places.extend(masks.flat_map(|at| [(at, 0), (at, 1), (at, 2)]));
        places
    }

    /// Column i of E, times a field: a component of it, or its mean under a mask.
    pub(super) fn mean(&self, i: usize, field: &[f64]) -> f64 {
        match self.dofs.get(i) {
            Some(&dof) => field[dof as usize],
            None => {
                let (mask, axis) = self.mask_and_axis(i);
                self.masks[mask].mean(|node| field[3 * node as usize + axis])
            }
        }
    }

    /// Weighted mean of the field's absolute values: what rounding in the mean is measured by.
    pub(super) fn mean_of_sizes(&self, i: usize, field: &[f64]) -> f64 {
        match self.dofs.get(i) {
            Some(&dof) => field[dof as usize].abs(),
            None => {
                let (mask, axis) = self.mask_and_axis(i);
                self.masks[mask].mean(|node| field[3 * node as usize + axis].abs())
            }
        }
    }

    /// Mask and axis of an unknown force behind those of `dofs`.
    pub(super) fn mask_and_axis(&self, i: usize) -> (usize, usize) {
        let behind = i - self.dofs.len();
        (behind / 3, behind % 3)
    }

    /// Columns of E by degree of freedom.
    pub(super) fn columns(&self) -> Vec<Vec<(u32, f64)>> {
        let dofs = self.dofs.iter().map(|&dof| vec![(dof, 1.0)]);
        let of_mask = |mask: &Mask, axis: u32| {
            mask.entries().iter().map(|&(node, weight)| (3 * node + axis, weight)).collect()
        };
        let masks = self.masks.iter().flat_map(|mask| (0..3).map(move |axis| of_mask(mask, axis)));
        dofs.chain(masks).collect()
    }

    /// Most entries a column of E has.
    pub(super) fn longest(&self) -> usize {
        self.masks.iter().map(|m| m.entries().len()).max().unwrap_or(0).max(1)
    }

    /// Makes sure that all nodes are among `node_count`.
    pub(super) fn check(&self, node_count: usize) -> Result<(), CondensedError> {
        for (mask, entries) in self.masks.iter().enumerate() {
            let last = entries.entries().last();
            if let Some(&(node, _)) = last.filter(|last| last.0 as usize >= node_count) {
                return Err(CondensedError::NoSuchNode { mask, node, node_count });
            }
        }
        Ok(())
    }
}

impl Contact {
    /// Nodes and weights of one axis.
    pub(super) fn entries(&self) -> Vec<(u32, f64)> {
        match self {
            Self::Node(node) => vec![(*node, 1.0)],
            Self::Mask(mask) => mask.entries().to_vec(),
        }
    }

    /// Bytes that naming it takes beside its columns.
    pub(super) fn bytes(&self) -> usize {
        match self {
            Self::Node(_) => 0,
            Self::Mask(mask) => 16 * mask.entries().len(),
        }
    }
}
