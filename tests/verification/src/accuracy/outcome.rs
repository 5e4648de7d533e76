//! Outcome of a case for one element on one mesh.

use softgrasp_core::fem::Element;

/// Quantity beside its closed form or published value.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// Case, element and mesh of the quantity.
    pub solved: Solved,
    /// Name of the quantity.
    pub quantity: &'static str,
    /// Computed value; `None` if a whole field is compared.
    pub computed: Option<f64>,
    /// Expected value.
    pub expected: Option<f64>,
    /// Relative error of the computed value.
    pub error_rel: f64,
}

/// One case on one mesh by one element.
#[derive(Clone, Debug, PartialEq)]
pub struct Solved {
    /// Name of the case.
    pub case: &'static str,
    /// Kind of element.
    pub element: Element,
    /// Poisson's ratio of the material.
    pub poisson: f64,
    /// Number of boxes or layers along the length that the case names.
    pub cells: usize,
    /// Number of nodes, mid-edge nodes included.
    pub nodes: usize,
    /// Number of unknown degrees of freedom.
    pub unknown: usize,
}

impl Solved {
    /// Outcome of one number beside its expected value.
    pub fn with_number(self, quantity: &'static str, computed: f64, expected: f64) -> Outcome {
        let outcome = self.with_error(quantity, (computed / expected - 1.0).abs());
        Outcome { computed: Some(computed), expected: Some(expected), ..outcome }
    }

    /// Outcome of a whole field, by its error.
    pub fn with_error(self, quantity: &'static str, error_rel: f64) -> Outcome {
        Outcome { solved: self, quantity, computed: None, expected: None, error_rel }
    }
}

impl Outcome {
    /// Order of convergence from a coarser mesh of the same case to this one.
    pub fn order_from(&self, coarser: &Self) -> f64 {
        let refined = self.solved.cells as f64 / coarser.solved.cells as f64;
        (coarser.error_rel / self.error_rel).ln() / refined.ln()
    }

    /// Whether `other` is the same case, element, material and quantity on another mesh.
    pub fn is_like(&self, other: &Self) -> bool {
        let same = |o: &Self| {
            let Solved { case, element, poisson, .. } = o.solved;
            (case, element, poisson.to_bits(), o.quantity)
        };
        same(self) == same(other)
    }
}

/// Error by rounding of an answer that the element represents exactly, relative to the largest
/// displacement: ε times the condition of `K11`, below 1e5 on the small meshes of these cases.
#[cfg(test)]
pub const ROUNDING: f64 = 1e-11;
