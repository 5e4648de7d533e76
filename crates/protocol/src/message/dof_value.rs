//! A number at one degree of freedom.

/// A number at one degree of freedom: known displacement (m), force (N) or reaction force (N).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DofValue {
    /// `3 · node + axis`, axis 0 to 2.
    pub dof: u32,
    /// Its value, m or N.
    pub value: f64,
}
