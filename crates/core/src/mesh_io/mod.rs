//! Mesh files: recognised by content, read into a checked mesh with what was found on the way.

mod cell_kind;
mod companion;
mod cursor;
mod deck;
mod deck_assembly;
mod deck_keyword;
mod deck_part;
mod encoding;
mod error;
mod febio;
mod findings;
mod format;
mod gmsh;
mod labels;
mod medit;
mod mending;
mod msh1;
mod msh2;
mod msh4;
mod netgen;
mod number;
mod parse;
mod raw_mesh;
mod scalar;
mod sniff;
mod surfaces;
mod tet;
mod tetgen;
mod thesis_lists;
mod vega;
mod vtk_legacy;
mod vtu;
mod vtu_array;
mod write;
mod xdmf;
mod xdmf_item;
mod xml;

#[cfg(test)]
pub(crate) mod tests;

pub use companion::Companion;
pub use error::{Fault, MeshFileError, Place};
pub use findings::{Findings, MeshFile};
pub use format::{Foreign, Format};
pub use labels::keeps_labels;
pub use mending::{BadTet, Mending, TetFault};
pub use parse::parse;
pub use sniff::{Sniffed, sniff};
pub use surfaces::{SurfaceFile, SurfaceFormat, parse_surface, surface_format};
pub use thesis_lists::{write_thesis_lists, write_thesis_lists_labelled};
pub use write::{
    PointField, VtuField, WriteError, write_msh41, write_msh41_labelled, write_vtu,
    write_vtu_fields, write_vtu_labelled,
};
