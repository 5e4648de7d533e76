//! Tests of whole files: real ones, the quirks of each format, round trips, hostile bytes.

mod deck_quirks;
mod febio_quirks;
mod gmsh_quirks;
mod hostile_bytes;
mod mending;
mod other_quirks;
pub(crate) mod real_files;
mod round_trips;
mod samples;
mod ten_nodes;
mod vtk_quirks;
mod vtu_samples;
mod xdmf_quirks;
