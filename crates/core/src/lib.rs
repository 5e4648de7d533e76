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
//! The short way is [`SoftBody`]: a mesh and a material, what is prescribed, and back come displacements
//! and how wrong they are; [`Frames`] answers the same again and again in less than a millisecond.
//!
//! ```
//! use nalgebra::Vector3;
//! use softgrasp_core::mesh::{BuiltIn, generate};
//! use softgrasp_core::{LoadCase, Material, SoftBody};
//!
//! let mesh = generate(BuiltIn::Cube, 64)?;
//! let body = SoftBody::try_new(mesh, Material::try_new(2.0e4, 0.3)?)?;
//! let mut pinch = LoadCase::new();
//! pinch.hold([0, 1, 4]).prescribe(63, Vector3::new(-1e-3, -1e-3, 0.0));
//! let answer = body.solve(&pinch)?;
//! assert_eq!(answer.displacements[63].x, -1e-3);
//! assert!(answer.inexactness.relative() < 1e-9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod contact;
pub mod dynamics;
pub mod fem;
pub mod fill;
pub mod gradient;
pub mod mesh;
pub mod mesh_io;
pub mod model;
pub mod rigid_body;
pub mod soft_body;
pub mod solve;
mod stuffing;
pub mod surface;

pub use fem::hyperelastic::Law;
pub use fem::{Element, Material};
pub use gradient::{Gradient, Quantity, Term};
pub use mesh::TetMesh;
pub use soft_body::{
    Answer, Axis, Frames, Inexactness, LargeAnswer, LoadCase, SoftBody, SoftBodyError,
};
