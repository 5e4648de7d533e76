//! A number at one degree of freedom.

/// A number at one degree of freedom: known displacement (m), force (N) or reaction force (N).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DofValue {
    /// Number of the degree of freedom: `3 · node + axis`, axis 0 to 2.
    pub dof: u32,
    /// Displacement in m or force in N at this degree of freedom.
    pub value: f64,
}
