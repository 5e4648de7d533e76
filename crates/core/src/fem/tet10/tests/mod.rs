//! The ten-node tetrahedron: one element, patches, convergence, real meshes, hard input.

mod convergence;
mod element;
mod exact_quadrature;
mod fixtures;
mod whole_objects;
