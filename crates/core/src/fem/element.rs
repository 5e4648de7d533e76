//! The finite elements there are.

/// Which finite element a model is made of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Element {
    /// Linear tetrahedron (thesis chapter 3).
    #[default]
    Tet4,
    /// Ten-node tetrahedron; its mid-edge nodes are made from the linear mesh.
    Tet10,
}

impl Element {
    /// Nodes of one element.
    pub const fn node_count(self) -> usize {
        match self {
            Self::Tet4 => 4,
            Self::Tet10 => 10,
        }
    }
}
