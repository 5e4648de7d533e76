//! Names of the built-in objects, and the one function that makes any of them.

use std::fmt;
use std::str::FromStr;

use super::solid::Solid;
use super::{cube, fit};
use crate::mesh::{MeshError, TetMesh};

/// An object that can be made without a file.
///
/// Frame: centred near the origin, Y up; a few centimetres in size (m).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum BuiltIn {
    /// Edge 6 cm, six tetrahedra around the same diagonal of every cell.
    Cube,
    /// Diameter 7 cm.
    Sphere,
    /// About 6.5 cm high, tip down, dented at the stalk (thesis Figure 4.24).
    Strawberry,
    /// A tube of about 15 × 3 × 4 cm along X (thesis Figure 6.5).
    Toothpaste,
}

/// A name that is none of the built-in objects'.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no built-in object is called {name:?}; there are cube, sphere, strawberry, toothpaste")]
pub struct UnknownShape {
    /// The name as given.
    pub name: String,
}

/// Why an object could not be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GenerateError {
    /// Fewer or more nodes than objects are made with.
    #[error("{nodes} nodes asked for a {shape}; it can have {NODES_MIN} to {NODES_MAX}")]
    NodeCount {
        /// The object that was asked for.
        shape: BuiltIn,
        /// Number of nodes that was asked for.
        nodes: usize,
    },
    /// No lattice gave a closed body in one piece.
    #[error("no lattice gives a sound {shape} of about {nodes} nodes")]
    NoLattice {
        /// The object that was asked for.
        shape: BuiltIn,
        /// Number of nodes that was asked for.
        nodes: usize,
    },
    /// The elements do not make a mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

/// Fewest nodes an object is made with.
pub const NODES_MIN: usize = 27;

/// Most nodes an object is made with.
pub const NODES_MAX: usize = 2_000_000;

impl BuiltIn {
    /// Every object, in the order of the names.
    pub const ALL: [Self; 4] = [Self::Cube, Self::Sphere, Self::Strawberry, Self::Toothpaste];

    /// Lower-case name, as the commands take it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cube => "cube",
            Self::Sphere => "sphere",
            Self::Strawberry => "strawberry",
            Self::Toothpaste => "toothpaste",
        }
    }
}

impl fmt::Display for BuiltIn {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for BuiltIn {
    type Err = UnknownShape;

    fn from_str(name: &str) -> Result<Self, UnknownShape> {
        Self::ALL
            .into_iter()
            .find(|shape| shape.name() == name)
            .ok_or_else(|| UnknownShape { name: name.to_owned() })
    }
}

/// Makes a built-in object with `nodes` nodes, or as near as the shape allows.
///
/// The mesh is one face-connected body without orphans; its surface is closed, manifold and
/// without handles; no dihedral angle is below 8°. Equal arguments give equal bits.
///
/// Units: m. Frame: the object's, see [`BuiltIn`].
///
/// # Errors
/// [`GenerateError::NodeCount`] outside [`NODES_MIN`]`..=`[`NODES_MAX`].
pub fn generate(shape: BuiltIn, nodes: usize) -> Result<TetMesh, GenerateError> {
    if !(NODES_MIN..=NODES_MAX).contains(&nodes) {
        return Err(GenerateError::NodeCount { shape, nodes });
    }
    let solid = match shape {
        BuiltIn::Cube => return Ok(cube::generate(nodes)?),
        BuiltIn::Sphere => Solid::Sphere,
        BuiltIn::Strawberry => Solid::Strawberry,
        BuiltIn::Toothpaste => Solid::Toothpaste,
    };
    fit::fit(solid, nodes).ok_or(GenerateError::NoLattice { shape, nodes })
}
