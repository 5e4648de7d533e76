//! Labels of nodes and regions: node labels, which are any numbers in some formats, become indices from 0;
//! a region gets the number that it has in a written file: its label, where that is a number.

use super::error::Fault;
use crate::mesh::TetMesh;

/// Table from the labels of a file to the order of its node records.
#[derive(Debug)]
pub(super) enum NodeLabels {
    /// The label is the record number plus `first`.
    Sequence { first: i64, count: usize },
    /// Labels are nearly dense: entry `label − low` is the index, `u32::MAX` where there is none.
    Dense { low: i64, indices: Vec<u32> },
    /// Labels are far apart: pairs in order of the label.
    Sparse(Vec<(i64, u32)>),
}

impl NodeLabels {
    /// Table for records numbered from `first` without gaps.
    pub(super) fn sequence(first: i64, count: usize) -> Self {
        Self::Sequence { first, count }
    }

    /// Table for records with the labels given, at most `u32::MAX` of them.
    ///
    /// # Errors
    /// [`Fault::DuplicateLabel`].
    pub(super) fn try_new(labels: &[i64]) -> Result<Self, Fault> {
        let first = labels.first().copied().unwrap_or(0);
        let is_sequence =
            labels.iter().enumerate().all(|(i, &label)| label.checked_sub(i as i64) == Some(first));
        if is_sequence {
            return Ok(Self::sequence(first, labels.len()));
        }
        let low = labels.iter().copied().min().unwrap_or(0);
        let high = labels.iter().copied().max().unwrap_or(0);
        let span = high.checked_sub(low).and_then(|s| usize::try_from(s).ok());
        match span {
            // At most 32 bytes a node, whatever the labels are.
            Some(span) if span / 8 <= labels.len() => Self::dense(low, span + 1, labels),
            _ => Self::sparse(labels),
        }
    }

    fn dense(low: i64, span: usize, labels: &[i64]) -> Result<Self, Fault> {
        let mut indices = vec![u32::MAX; span];
        for (index, &label) in labels.iter().enumerate() {
            let entry = indices
                .get_mut((label - low) as usize)
                .expect("every label lies between the smallest and the largest one");
            if *entry != u32::MAX {
                return Err(Fault::DuplicateLabel { label });
            }
            *entry = index as u32;
        }
        Ok(Self::Dense { low, indices })
    }

    fn sparse(labels: &[i64]) -> Result<Self, Fault> {
        let mut pairs: Vec<(i64, u32)> =
            labels.iter().enumerate().map(|(index, &label)| (label, index as u32)).collect();
        pairs.sort_unstable();
        match pairs.windows(2).find(|pair| pair[0].0 == pair[1].0) {
            Some(pair) => Err(Fault::DuplicateLabel { label: pair[0].0 }),
            None => Ok(Self::Sparse(pairs)),
        }
    }

    /// Index of the record with this label.
    pub(super) fn index(&self, label: i64) -> Option<u32> {
        match self {
            Self::Sequence { first, count } => {
                let index = usize::try_from(label.checked_sub(*first)?).ok()?;
                (index < *count).then_some(index as u32)
            }
            Self::Dense { low, indices } => {
                let entry = usize::try_from(label.checked_sub(*low)?).ok()?;
                indices.get(entry).copied().filter(|&index| index != u32::MAX)
            }
            Self::Sparse(pairs) => {
                let at = pairs.binary_search_by_key(&label, |pair| pair.0).ok()?;
                pairs.get(at).map(|pair| pair.1)
            }
        }
    }

    /// Whether the labels are something else than 0, 1, 2 … or 1, 2, 3 ….
    pub(super) fn mapped(&self) -> bool {
        !matches!(self, Self::Sequence { first: 0 | 1, .. })
    }

    /// "there are 17 nodes, 1 to 17", for errors.
    pub(super) fn describe(&self) -> String {
        let (count, low, high) = match self {
            Self::Sequence { count: 0, .. } => return "the file has no nodes".to_owned(),
            Self::Sequence { first, count } => (*count, *first, first + (*count as i64 - 1)),
            Self::Dense { low, indices } => {
                let count = indices.iter().filter(|&&index| index != u32::MAX).count();
                (count, *low, low + (indices.len() as i64 - 1))
            }
            Self::Sparse(pairs) => {
                let label = |pair: Option<&(i64, u32)>| pair.map_or(0, |pair| pair.0);
                (pairs.len(), label(pairs.first()), label(pairs.last()))
            }
        };
        format!("there are {count} nodes, {low} to {high}")
    }
}

/// Numbers of the regions of a mesh for a format that has only numbers for them.
///
/// Shapes: one per region.
pub(super) struct RegionNumbers {
    numbers: Vec<i64>,
    /// Whether the labels themselves are these numbers.
    pub(super) are_labels: bool,
}

impl RegionNumbers {
    /// The labels as numbers if each of them is one, else 0, 1, 2 ….
    ///
    /// Shapes: `labels` one per region, or empty where nothing is known of them.
    pub(super) fn new(mesh: &TetMesh, labels: &[String]) -> Self {
        let count = mesh.regions().iter().max().map_or(1, |&most| most as usize + 1);
        let parsed: Option<Vec<i64>> = labels.iter().map(|label| label.parse().ok()).collect();
        match parsed.filter(|numbers| numbers.len() >= count) {
            Some(numbers) => Self { numbers, are_labels: true },
            None => Self { numbers: (0..count as i64).collect(), are_labels: false },
        }
    }

    /// Number of a region.
    pub(super) fn of(&self, region: u32) -> i64 {
        self.numbers.get(region as usize).copied().unwrap_or(i64::from(region))
    }

    /// Whether all of them are above 0 and fit 32 bits, as Gmsh's tags do.
    pub(super) fn are_tags(&self) -> bool {
        self.numbers.iter().all(|&number| number > 0 && number <= i64::from(i32::MAX))
    }
}

/// Whether a format that has only numbers for regions keeps their labels.
pub fn keeps_labels(mesh: &TetMesh, labels: &[String]) -> bool {
    mesh.regions().is_empty() || RegionNumbers::new(mesh, labels).are_labels
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn two_nodes_with_one_label_are_refused() {
        assert!(matches!(NodeLabels::try_new(&[3, 5, 3]), Err(Fault::DuplicateLabel { label: 3 })));
        let far = [i64::MAX, -7, i64::MIN, -7];
        assert!(matches!(NodeLabels::try_new(&far), Err(Fault::DuplicateLabel { label: -7 })));
    }

    #[test]
    fn labels_in_sequence_need_no_mapping() {
        assert!(!NodeLabels::try_new(&[1, 2, 3]).unwrap().mapped());
        assert!(!NodeLabels::try_new(&[0, 1]).unwrap().mapped());
        assert!(NodeLabels::try_new(&[2, 3]).unwrap().mapped());
        assert!(NodeLabels::try_new(&[2, 1]).unwrap().mapped());
        assert!(NodeLabels::try_new(&[i64::MAX, i64::MIN]).unwrap().mapped());
    }

    proptest! {
        #[test]
        fn every_label_finds_its_record(
            set in proptest::collection::btree_set(-40_i64..40, 1..30),
            scale in prop_oneof![Just(1_i64), Just(3), Just(1_000_000_007)],
            turn in 0_usize..30,
        ) {
            let mut labels: Vec<i64> = set.iter().map(|label| label * scale).collect();
            let turn = turn % labels.len();
            labels.rotate_left(turn);
            let table = NodeLabels::try_new(&labels).unwrap();
            for near in -45_i64..45 {
                let label = near * scale;
                let known = labels.iter().position(|&l| l == label).map(|i| i as u32);
                prop_assert_eq!(table.index(label), known);
            }
            for (index, &label) in labels.iter().enumerate() {
                prop_assert_eq!(table.index(label), Some(index as u32));
                prop_assert_eq!(table.index(label + 100 * scale), None);
            }
            prop_assert_eq!(table.index(i64::MAX), None);
            prop_assert_eq!(table.index(i64::MIN), None);
        }
    }
}
