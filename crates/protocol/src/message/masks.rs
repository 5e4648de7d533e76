//! Masks on the wire: lists of nodes with weights, one behind the other.

use wincode::{SchemaRead, SchemaWrite};

use crate::limits::check_count;
use crate::payload::{PayloadReader, PayloadWriter, count_of};
use crate::{DecodeError, EncodeError, Limits};

/// Masks, contacts held by a weighted mean of nodes; stored flat, as they travel.
///
/// Invariant: the lengths add up to the number of nodes and to that of weights. Whether weights and
/// nodes make sense is for the server to say.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Masks {
    lens: Vec<u32>,
    nodes: Vec<u32>,
    weights: Vec<f64>,
}

/// Announces the arrays of [`Masks`].
#[derive(Clone, Copy, Debug, SchemaRead, SchemaWrite)]
pub(super) struct MasksPart {
    mask_count: u32,
    entry_count: u32,
}

impl Masks {
    /// Adds a mask of `(node, weight)`; weights need not sum to one.
    pub fn push(&mut self, entries: &[(u32, f64)]) {
        // A list that 32 bits do not count makes a total that they do not count: it is not sent.
        self.lens.push(u32::try_from(entries.len()).unwrap_or(u32::MAX));
        self.nodes.extend(entries.iter().map(|entry| entry.0));
        self.weights.extend(entries.iter().map(|entry| entry.1));
    }

    /// Appends the masks of another list.
    pub fn append(&mut self, other: &Self) {
        self.lens.extend_from_slice(&other.lens);
        self.nodes.extend_from_slice(&other.nodes);
        self.weights.extend_from_slice(&other.weights);
    }

    /// Number of masks.
    pub fn len(&self) -> usize {
        self.lens.len()
    }

    /// Whether the list contains no mask.
    pub fn is_empty(&self) -> bool {
        self.lens.is_empty()
    }

    /// Nodes and weights of every mask, in order.
    pub fn iter(&self) -> impl Iterator<Item = (&[u32], &[f64])> {
        let (mut nodes, mut weights) = (self.nodes.as_slice(), self.weights.as_slice());
        self.lens.iter().map(move |&len| {
            let len = (len as usize).min(nodes.len());
            let (nodes_now, nodes_left) = nodes.split_at(len);
            let (weights_now, weights_left) = weights.split_at(len);
            (nodes, weights) = (nodes_left, weights_left);
            (nodes_now, weights_now)
        })
    }

    pub(super) fn part(&self) -> Result<MasksPart, EncodeError> {
        Ok(MasksPart {
            mask_count: count_of("masks", self.lens.len())?,
            entry_count: count_of("nodes of masks", self.nodes.len())?,
        })
    }

    /// Writes the arrays: lengths, nodes, weights.
    pub(super) fn write_arrays(&self, writer: &mut PayloadWriter<'_>) {
        writer.array(&self.lens);
        writer.array(&self.nodes);
        writer.array(&self.weights);
    }

    /// Reads the arrays that [`write_arrays`](Self::write_arrays) wrote; the counts have been checked.
    pub(super) fn read_arrays(
        reader: &mut PayloadReader<'_>,
        part: MasksPart,
    ) -> Result<Self, DecodeError> {
        let entry_count = part.entry_count as usize;
        let lens: Vec<u32> = reader.array("masks", part.mask_count())?;
        let nodes = reader.array("nodes of masks", entry_count)?;
        let weights = reader.array("weights of masks", entry_count)?;
        let lens_sum = lens.iter().map(|&len| u64::from(len)).sum();
        if lens_sum != u64::from(part.entry_count) {
            return Err(DecodeError::MaskLengths { lens_sum, entry_count: part.entry_count });
        }
        Ok(Self { lens, nodes, weights })
    }
}

impl MasksPart {
    pub(super) fn check(&self, limits: &Limits) -> Result<(), DecodeError> {
        check_count("masks", self.mask_count, limits.dof_count_max)?;
        check_count("nodes of masks", self.entry_count, limits.dof_count_max)?;
        Ok(())
    }

    pub(super) fn mask_count(self) -> usize {
        self.mask_count as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn masks_come_back_in_order_empty_ones_too() {
        let mut masks = Masks::default();
        assert!(masks.is_empty());
        let lists: [&[(u32, f64)]; 3] = [&[(7, 0.5), (2, 0.25)], &[], &[(9, 1.0)]];
        for list in lists {
            masks.push(list);
        }
        let back: Vec<Vec<(u32, f64)>> = masks
            .iter()
            .map(|(nodes, weights)| nodes.iter().copied().zip(weights.iter().copied()).collect())
            .collect();
        assert_eq!(back, lists);
        assert_eq!(masks.len(), 3);
        let mut twice = masks.clone();
        twice.append(&masks);
        assert!(twice.len() == 6 && twice.iter().skip(3).eq(masks.iter()));
    }
}
