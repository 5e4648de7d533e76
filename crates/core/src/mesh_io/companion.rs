//! Names the other files that a mesh file needs, as the file itself refers to them.

use std::fmt;

/// A file to be found beside the one that is read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Companion {
    /// The file's name with another extension (without the dot): TetGen's other half.
    Extension(&'static str),
    /// A file name out of the file (`*INCLUDE` of decks and of Vega); it comes from outside, so the
    /// caller decides which folders it may reach.
    FileName(String),
}

impl fmt::Display for Companion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Extension(extension) => write!(f, "the file with extension .{extension}"),
            Self::FileName(name) => write!(f, "the included file \"{}\"", name.escape_debug()),
        }
    }
}

/// How companions are found: the caller reads files, this crate does not.
pub(super) type FindCompanion<'f> = dyn FnMut(&Companion) -> Option<Vec<u8>> + 'f;
