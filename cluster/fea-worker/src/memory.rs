//! Predicts the memory of all ranks together from the size of a mesh, before anything is made.

use softgrasp_core::fem::Element;
use softgrasp_core::solve::memory::Bytes;

/// Sizes that memory and work are predicted from.
#[derive(Clone, Copy, Debug)]
pub struct Size {
    /// Nodes that elements use.
    pub nodes: usize,
    /// Kind of element.
    pub element: Element,
    /// Right-hand sides.
    pub cases: usize,
    /// Number of ranks.
    pub ranks: usize,
}

/// Bytes a node of the mesh, its rows and the part that a rank keeps beside the solver; with what follows
/// it comes to what was measured on 160 000 nodes: 7.3 kB a node on one rank, 12.5 kB on two.
const ROWS_PER_NODE: f64 = 3400.0;
/// Bytes a node of matrix and hierarchy inside the solver: measured on cubes of 4096 to 10⁶ nodes.
const HIERARCHY_PER_NODE: f64 = 4200.0;
/// Coarsening on several ranks holds more than as much again for a moment.
const SEVERAL_RANKS: f64 = 2.2;
/// Bytes of the factor of a cube of [`FACTOR_NODES`] nodes, by the analysis of MUMPS.
const FACTOR_BYTES: f64 = 8.0e9;
const FACTOR_NODES: f64 = 157_464.0;
/// Growth of a factor's entries with the nodes, counted from 42 875 to 10⁶.
const FACTOR_EXPONENT: f64 = 1.39;
/// What two ranks and more hold twice.
const FACTOR_SEVERAL_RANKS: f64 = 1.28;
/// Rows of averaged pressure reach twice as far.
const AVERAGED: f64 = 4.0;
/// Vectors of all nodes that rank 0 holds for each case.
const VECTORS_PER_CASE: f64 = 3.0;
/// A factor pays from one right-hand side on for each so many nodes: operations of the factor against
/// those of the steps, both measured.
const NODES_PER_CASE: usize = 6600;

impl Size {
    /// Memory of multigrid, all ranks together.
    ///
    /// Units: bytes.
    pub fn multigrid_bytes(&self) -> u64 {
        let several = if self.ranks > 1 { SEVERAL_RANKS } else { 1.0 };
        self.bytes(HIERARCHY_PER_NODE * several * self.nodes as f64 * self.reach())
    }

    /// Memory of a factor, all ranks together.
    ///
    /// Units: bytes.
    pub fn factor_bytes(&self) -> u64 {
        let several = if self.ranks > 1 { FACTOR_SEVERAL_RANKS } else { 1.0 };
        let growth = (self.nodes as f64 / FACTOR_NODES).powf(FACTOR_EXPONENT);
        self.bytes(FACTOR_BYTES * several * growth * self.reach())
    }

    /// Right-hand sides from which on a factor is the faster way.
    pub fn cases_that_pay(&self) -> usize {
        1 + self.nodes / NODES_PER_CASE
    }

    fn reach(&self) -> f64 {
        if self.element == Element::Tet4Anp { AVERAGED } else { 1.0 }
    }

    fn bytes(&self, solver: f64) -> u64 {
        let (nodes, cases) = (self.nodes as f64, self.cases as f64);
        let rows = ROWS_PER_NODE * nodes * self.reach();
        (solver + rows + 24.0 * VECTORS_PER_CASE * cases * nodes) as u64
    }
}

/// Why a question is not begun.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "{nodes} nodes, {cases} right-hand sides: {method} on {ranks} ranks is predicted to need {}, and \
     {ranks} ranks of {} have {} (--memory-per-rank); take more ranks or fewer nodes",
    Bytes(*.needed), Bytes(*.per_rank), Bytes(.per_rank.saturating_mul(*.ranks as u64))
)]
pub struct Shortage {
    /// Nodes that elements use.
    pub nodes: usize,
    /// Right-hand sides.
    pub cases: usize,
    /// Method that was looked at.
    pub method: &'static str,
    /// Number of ranks.
    pub ranks: usize,
    /// Memory needed by all ranks together, bytes.
    pub needed: u64,
    /// Memory of one rank, bytes.
    pub per_rank: u64,
}

impl Shortage {
    /// The numbers, for programs.
    pub fn detail(&self) -> String {
        let limit = self.per_rank.saturating_mul(self.ranks as u64);
        format!("limit_bytes={limit} reserved_bytes=0; needed_bytes={}", self.needed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn predictions_are_near_what_was_measured() {
        let size = |nodes, ranks| Size { nodes, element: Element::Tet4, cases: 1, ranks };
        let near = |found: u64, gib: f64| {
            let share = found as f64 / (gib * f64::from(1 << 30));
            assert!((0.7..2.2).contains(&share), "{share}");
        };
        near(size(1_000_000, 1).multigrid_bytes(), 5.5);
        near(size(157_464, 4).multigrid_bytes(), 1.9);
        near(size(42_875, 1).factor_bytes(), 1.5);
        near(size(1_000_000, 1).factor_bytes(), 97.0);
        assert_eq!(size(1_000_000, 1).cases_that_pay(), 152);
        assert_eq!(size(1000, 1).cases_that_pay(), 1);
    }

    #[test]
    fn a_shortage_has_all_its_numbers() {
        let shortage = Shortage {
            nodes: 7,
            cases: 3,
            method: "cluster-cg",
            ranks: 2,
            needed: 5 << 30,
            per_rank: 1 << 30,
        };
        let text = shortage.to_string();
        for part in ["7 nodes", "cluster-cg", "2 ranks", "5.0 GiB", "2.0 GiB"] {
            assert!(text.contains(part), "{part}: {text}");
        }
        assert!(shortage.detail().contains("needed_bytes=5368709120"));
    }
}
