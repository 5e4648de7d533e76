//! Finite element answers of Softgrasp: meshes, elements, contact mechanics, solvers.
//!
//! [`mesh_io`] reads a mesh file, [`mesh`] holds and judges a mesh, [`fem`] makes its stiffness,
//! [`contact`] says what a round fingertip covers and solves contact with Coulomb friction,
//! [`rigid_body`] is what an object touches, [`dynamics`] moves it one step at a time, [`surface`]
//! asks triangles what is inside, [`fill`] makes tetrahedra of it, [`model`] is what depends on the
//! shape only, and [`solve`] factors, condenses, follows large deformation, and says how wrong an answer is. No I/O,
//! no clock, no threads of its own: bytes come in as slices, time as an argument, and parallel loops
//! run on the rayon pool of whoever calls.
//!
//! ```
//! use softgrasp_core::fem::Material;
//! use softgrasp_core::mesh::{BuiltIn, Quality, generate};
//!
//! let mesh = generate(BuiltIn::Cube, 64)?;
//! assert_eq!(mesh.node_count(), 64);
//! let rubber = Material::try_new(1e5, 0.45)?;
//! assert_eq!(rubber.poisson(), 0.45);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod contact;
pub mod dynamics;
pub mod fem;
pub mod fill;
pub mod mesh;
pub mod mesh_io;
pub mod model;
pub mod rigid_body;
pub mod solve;
mod stuffing;
pub mod surface;
