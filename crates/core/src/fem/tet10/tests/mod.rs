//! The ten-node tetrahedron: one element, patches, convergence, real meshes, hard input, curved edges.

mod convergence;
mod curved;
pub(crate) mod curved_fixtures;
mod element;
mod exact_quadrature;
mod fixtures;
mod whole_objects;
