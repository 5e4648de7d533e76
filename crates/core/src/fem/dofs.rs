//! The numbering of degrees of freedom.

/// Degrees of freedom per node: displacements along x, y and z.
pub const AXES: usize = 3;

/// Index of the degree of freedom of `node` along `axis` (0 x, 1 y, 2 z): `3·node + axis` (3.45).
pub const fn dof(node: usize, axis: usize) -> usize {
    AXES * node + axis
}
