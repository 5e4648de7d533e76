//! Which object is to be grasped: a built-in shape or a mesh file.

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

use softgrasp_core::mesh::BuiltIn;

/// Choice of the object that is grasped.
#[derive(Clone, Debug, PartialEq)]
pub enum ObjectChoice {
    /// A built-in object, whose mesh the program generates.
    BuiltIn(BuiltIn),
    /// An object that is read from a mesh file.
    File(PathBuf),
}

impl FromStr for ObjectChoice {
    type Err = std::convert::Infallible;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Ok(text.parse().map_or_else(|_| Self::File(PathBuf::from(text)), Self::BuiltIn))
    }
}

impl fmt::Display for ObjectChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::BuiltIn(shape) => write!(f, "{shape}"),
            Self::File(path) => write!(f, "{}", path.display()),
        }
    }
}
