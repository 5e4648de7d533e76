//! Mesh files: recognised by content, read into a checked mesh with what was found on the way.

mod base64;
mod byte_order;
mod cell_kind;
mod companion;
mod cursor;
mod deck;
mod deck_assembly;
mod deck_keyword;
mod deck_part;
mod error;
mod findings;
mod format;
mod gmsh;
mod gmsh_header;
mod gzip;
mod medit;
mod mending;
mod msh1;
mod msh2;
mod msh4;
mod node_labels;
mod number;
mod parse;
mod raw_mesh;
mod region_numbers;
mod scalar;
mod sniff;
mod surfaces;
mod tet;
mod tetgen;
mod thesis_lists;
mod vega;
mod vtk_cells;
mod vtk_legacy;
mod vtu;
mod vtu_array;
mod write_error;
mod write_msh41;
mod write_vtu;
mod xml;

#[cfg(test)]
mod tests;

pub use companion::Companion;
pub use error::{Fault, MeshFileError, Place};
pub use findings::{Findings, MeshFile};
pub use format::{Foreign, Format};
pub use mending::{BadTet, Mending, TetFault};
pub use parse::parse;
pub use region_numbers::keeps_labels;
pub use sniff::{Sniffed, sniff};
pub use surfaces::{SurfaceFile, SurfaceFormat, parse_surface, surface_format};
pub use thesis_lists::{write_thesis_lists, write_thesis_lists_labelled};
pub use write_error::WriteError;
pub use write_msh41::{write_msh41, write_msh41_labelled};
pub use write_vtu::{PointField, write_vtu, write_vtu_labelled};
