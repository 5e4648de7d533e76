//! Tests of whole files: real ones, the quirks of each format, round trips, hostile bytes.

mod binary_medit;
mod deck_quirks;
mod febio_quirks;
mod foreign_files;
mod gmsh_quirks;
mod gzip_quirks;
mod hostile_bytes;
mod mending;
mod netgen_quirks;
mod other_quirks;
mod real_files;
mod round_trips;
mod samples;
mod vtk_quirks;
mod vtu_samples;
mod xdmf_quirks;
