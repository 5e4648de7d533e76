//! Mathematics of Softgrasp: meshes, finite elements, solvers, sphere tree, hand and grasp rules.
//!
//! No I/O, no clock, no threads of its own: bytes come in as slices, time as an argument, and
//! parallel loops run on the rayon pool of whoever calls.

pub mod contact;
pub mod dynamics;
pub mod fem;
pub mod grasp;
pub mod hand;
pub mod mesh;
pub mod mesh_io;
pub mod model;
pub mod rigid_body;
pub mod shape;
pub mod solve;
pub mod sphere_tree;
