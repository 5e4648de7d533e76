//! The kinds of finite elements, and the numbering of degrees of freedom.

/// Which finite element a model is made of, in the order of what they cost.
///
/// ```
/// use softgrasp_core::Element;
///
/// assert_eq!(Element::ALL.map(Element::name), ["t4", "t4-anp", "t10"]);
/// assert_eq!(Element::Tet10.node_count(), 10);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Element {
    /// Linear tetrahedron (thesis chapter 3).
    #[default]
    Tet4,
    /// Linear tetrahedron whose pressure is averaged around each node: it does not lock.
    Tet4Anp,
    /// Ten-node tetrahedron; its mid-edge nodes are made from the linear mesh.
    Tet10,
}

impl Element {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Tet4, Self::Tet4Anp, Self::Tet10];

    /// Name on the command line and in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Tet4 => "t4",
            Self::Tet4Anp => "t4-anp",
            Self::Tet10 => "t10",
        }
    }

    /// Nodes of one element.
    pub const fn node_count(self) -> usize {
        match self {
            Self::Tet4 | Self::Tet4Anp => 4,
            Self::Tet10 => 10,
        }
    }
}

/// Degrees of freedom per node: displacements along x, y and z.
pub const AXES: usize = 3;

/// Index of the degree of freedom of `node` along `axis` (0 x, 1 y, 2 z): `3·node + axis` (3.45).
pub const fn dof(node: usize, axis: usize) -> usize {
    AXES * node + axis
}
