//! Errors of mesh files: one line with file, place, what was expected, what was found.

use std::fmt;

use crate::mesh::MeshError;
use crate::mesh_io::{Companion, Foreign};
use crate::surface::SurfaceError;

/// A mesh file that could not be used, and why.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{file}: {fault}")]
pub struct MeshFileError {
    /// The file at fault; a companion or an included file when the fault is there.
    pub file: String,
    /// What is wrong with it.
    pub fault: Fault,
}

/// What is wrong with a mesh file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Fault {
    /// No bytes, or white space only.
    #[error("the file is empty")]
    Empty,
    /// No known format begins like this.
    #[error(
        "no mesh format known here begins with {start}; convert it with Gmsh or meshio to MSH 4.1"
    )]
    Unknown {
        /// The first characters, quoted.
        start: String,
    },
    /// A known format that is not read.
    #[error("this is {what}, which is not read here; {}", what.advice())]
    Foreign {
        /// The format.
        what: Foreign,
    },
    /// Something else stands where the format demands a certain thing.
    #[error("{at}: expected {expected}, found {found}")]
    Syntax {
        /// Where.
        at: Place,
        /// What the format demands.
        expected: String,
        /// What is there.
        found: String,
    },
    /// An announced count that the file does not keep.
    #[error("{at}: {array}: expected {expected}, found {found}")]
    Count {
        /// Where the count or the array stands.
        at: Place,
        /// Which array.
        array: String,
        /// What was announced.
        expected: String,
        /// What is there.
        found: String,
    },
    /// The format allows it, this reader does not read it.
    #[error("{at}: {what} is not read here; convert it with Gmsh or meshio to MSH 4.1")]
    Unsupported {
        /// Where.
        at: Place,
        /// The construct.
        what: String,
    },
    /// A second file is needed and was not given.
    #[error("{companion} is needed as well and was not found")]
    MissingCompanion {
        /// The file that was asked for.
        companion: Companion,
    },
    /// A tetrahedron names a node that the file does not have.
    #[error("tetrahedron {tet} (from 0) names node {label}, but {nodes}")]
    UnknownNode {
        /// Record number among the tetrahedra, from 0.
        tet: usize,
        /// The label in the file.
        label: i64,
        /// Which nodes there are.
        nodes: String,
    },
    /// Two nodes with one label.
    #[error("node label {label} is given to two nodes")]
    DuplicateLabel {
        /// The label.
        label: i64,
    },
    /// Nothing to model.
    #[error("no tetrahedra: {found}")]
    NoTetrahedra {
        /// What the file has instead.
        found: String,
    },
    /// A surface was wanted.
    #[error("this is no surface that is read here; there are STL, OBJ, PLY, OFF and glTF")]
    NoSurface,
    /// The file was read, but its content is no surface.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    /// The file was read, but its content is not a mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

/// A place in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Line of a text, from 1.
    Line(usize),
    /// Byte offset in binary data, from 0.
    Byte(usize),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}"),
            Self::Byte(offset) => write!(f, "byte {offset}"),
        }
    }
}
