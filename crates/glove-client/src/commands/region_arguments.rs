//! The argument that gives regions of a mesh materials of their own.

use clap::Args;

use crate::object::region_choice::RegionChoice;

/// Regions of another material than the body.
#[derive(Args, Clone, Default)]
pub(super) struct RegionArguments {
    /// Material of a region of the mesh file, which inspect lists: its name or number, Young's modulus in Pa,
    /// Poisson's ratio. Given once for each region; the others are of the body's material.
    #[arg(long = "material-region", value_name = "ID:E:NU", allow_hyphen_values = true)]
    pub regions: Vec<RegionChoice>,
}
