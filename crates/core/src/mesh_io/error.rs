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
        /// The format, which is recognised and not read.
        what: Foreign,
    },
    /// Something else stands where the format demands a certain thing.
    #[error("{at}: expected {expected}, found {found}")]
    Syntax {
        /// Place in the file.
        at: Place,
        /// What the format demands.
        expected: String,
        /// What the file has there.
        found: String,
    },
    /// An announced count that the file does not keep.
    #[error("{at}: {array}: expected {expected}, found {found}")]
    Count {
        /// Where the count or the array stands.
        at: Place,
        /// Name of the array.
        array: String,
        /// What the file announced.
        expected: String,
        /// What the file has there.
        found: String,
    },
    /// The format allows it, this reader does not read it.
    #[error("{at}: {what} is not read here; convert it with Gmsh or meshio to MSH 4.1")]
    Unsupported {
        /// Place in the file.
        at: Place,
        /// The construct, as the file names it.
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
        /// The label that stands twice or nowhere.
        label: i64,
    },
    /// The file has no tetrahedra.
    #[error("no tetrahedra: {found}")]
    NoTetrahedra {
        /// What the file has instead.
        found: String,
    },
    /// A surface was wanted, and the file holds tetrahedra.
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
