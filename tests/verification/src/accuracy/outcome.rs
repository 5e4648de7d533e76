//! The outcome of a case for one element on one mesh.

use softgrasp_core::fem::Element;

/// A quantity beside its closed form or published value.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// What was solved for it.
    pub solved: Solved,
    /// What is compared.
    pub quantity: &'static str,
    /// As computed; none where a whole field is compared.
    pub computed: Option<f64>,
    /// As it should be.
    pub expected: Option<f64>,
    /// Relative error.
    pub error_rel: f64,
}

/// One case on one mesh by one element.
#[derive(Clone, Debug, PartialEq)]
pub struct Solved {
    /// Name of the case.
    pub case: &'static str,
    /// The element.
    pub element: Element,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Boxes or layers along the length that the case names.
    pub cells: usize,
    /// Nodes, mid-edge nodes among them.
    pub nodes: usize,
    /// Unknown degrees of freedom.
    pub unknown: usize,
}

impl Solved {
    /// One number beside what it should be.
    pub fn with_number(self, quantity: &'static str, computed: f64, expected: f64) -> Outcome {
        let outcome = self.with_error(quantity, (computed / expected - 1.0).abs());
        Outcome { computed: Some(computed), expected: Some(expected), ..outcome }
    }

    /// The error of a whole field.
    pub fn with_error(self, quantity: &'static str, error_rel: f64) -> Outcome {
        Outcome { solved: self, quantity, computed: None, expected: None, error_rel }
    }
}

impl Outcome {
    /// The order of convergence from a coarser mesh of the same case to this one.
    pub fn order_from(&self, coarser: &Self) -> f64 {
        let refined = self.solved.cells as f64 / coarser.solved.cells as f64;
        (coarser.error_rel / self.error_rel).ln() / refined.ln()
    }

    /// Whether the other is the same case, element, material and quantity on another mesh.
    pub fn is_like(&self, other: &Self) -> bool {
        let same = |o: &Self| {
            let Solved { case, element, poisson, .. } = o.solved;
            (case, element, poisson.to_bits(), o.quantity)
        };
        same(self) == same(other)
    }
}

/// What rounding may leave of an answer that the element holds exactly, relative to the largest
/// displacement: ε times the condition of `K11`, below 1e5 on the small meshes these cases have.
#[cfg(test)]
pub const ROUNDING: f64 = 1e-11;
