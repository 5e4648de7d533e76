//! Many processes that answer one question together, behind Softgrasp's own wire.
//!
//! Rank 0 is a [`fea_server`] to the outside whose engine is the [`job`]. For each question it checks the
//! [`fea_server::engine::Equations`], predicts the [`memory`], splits the nodes ([`partition`]), and sends
//! each rank its [`part`]. Every rank assembles its own [`rows`], in the order of the elements of the whole
//! mesh, hands them to [`petsc`], and judges what comes back by its own rows ([`solve`]).
//!
//! Without PETSc and MPI only the pure part is compiled, and the program says what is missing.

pub mod arguments;
#[cfg(petsc)]
pub mod job;
pub mod memory;
pub mod order;
pub mod part;
pub mod partition;
#[cfg(petsc)]
pub mod petsc;
#[cfg(petsc)]
pub mod report;
pub mod rows;
pub mod settings;
#[cfg(petsc)]
pub mod solve;
