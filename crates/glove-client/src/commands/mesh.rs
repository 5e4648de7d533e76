//! `glove-client mesh SHAPE --nodes N --out F`: generates a built-in object.

use std::path::PathBuf;

use clap::Args;
use softgrasp_core::mesh::{BuiltIn, Surface, generate};

use super::numbers::count;
use super::output::print;
use crate::commands::output::Progress;
use crate::object::file_writing::write_file;
use crate::object::mesh_file::encode_mesh;

/// Generate a built-in object and write it to a file.
#[derive(Args)]
pub struct MeshCommand {
    /// cube, sphere, strawberry or toothpaste.
    shape: BuiltIn,
    /// Number of nodes, as near as the shape allows.
    #[arg(long, value_name = "N", value_parser = count, allow_hyphen_values = true)]
    nodes: usize,
    /// File to write: .msh (Gmsh 4.1), .vtu, or .txt (the three lists of the thesis).
    #[arg(long, value_name = "F")]
    out: PathBuf,
}

impl MeshCommand {
    /// Generates the mesh and writes it.
    ///
    /// # Errors
    /// A node count out of range, an unknown extension, a file that cannot be written.
    pub fn run(&self) -> anyhow::Result<()> {
        let mesh = {
            let _progress = Progress::start(&format!("generating a {}", self.shape));
            generate(self.shape, self.nodes)?
        };
        let surface = Surface::from_mesh(&mesh);
        write_file(&self.out, &encode_mesh(&self.out, &mesh, &[], &surface, &[])?)?;
        print(&format!(
            "{}: {} nodes, {} tetrahedra, {} surface triangles written to {}\n",
            self.shape,
            mesh.node_count(),
            mesh.tets().len(),
            surface.triangles.len(),
            self.out.display()
        ))
    }
}
