//! `glove-client fill SURFACE`: fills a surface with tetrahedra and says how near they are.

use std::path::PathBuf;

use anyhow::bail;
use clap::Args;
use softgrasp_core::fill::{Deviation, FillTarget};
use softgrasp_core::mesh::{Quality, Surface};

use super::numbers::{count, positive};
use super::output::Progress;
use super::output::print;
use crate::object::file_writing::write_file;
use crate::object::mesh_file::encode_mesh;
use crate::object::object_file::FilledSurface;
use crate::object::scene::NODES_DEFAULT;

/// Fill a surface (STL, OBJ, PLY, OFF, glTF) with tetrahedra.
///
/// Holes, turned and doubled triangles and overlapping shells are no obstacle; a surface that
/// encloses nothing is refused.
#[derive(Args)]
pub struct FillCommand {
    /// Surface file; the format is recognised by its content.
    surface: PathBuf,
    /// Number of nodes, about [default: 1000].
    #[arg(long, value_name = "N", value_parser = count, allow_hyphen_values = true)]
    nodes: Option<usize>,
    /// Instead of nodes: edge of the cells along the surface, m.
    #[arg(long, value_name = "H", value_parser = positive, allow_hyphen_values = true, conflicts_with = "nodes")]
    size: Option<f64>,
    /// Factor that brings the coordinates of the file into metres: 0.001 for millimetres.
    #[arg(long, default_value_t = 1.0, value_name = "S", value_parser = positive, allow_hyphen_values = true)]
    scale: f64,
    /// File to write: .msh (Gmsh 4.1), .vtu, or .txt (the three lists of the thesis) [default: the
    /// surface's name with .msh].
    #[arg(long, value_name = "F")]
    out: Option<PathBuf>,
}

impl FillCommand {
    /// Reads, fills, writes, tells.
    ///
    /// # Errors
    /// A file that cannot be read or written, a surface that has no inside, in one line.
    pub fn run(&self) -> anyhow::Result<()> {
        let progress = Progress::start("filling the surface");
        let target = match self.size {
            Some(size) => FillTarget::Size(size),
            None => FillTarget::Nodes(self.nodes.unwrap_or(NODES_DEFAULT)),
        };
        let out = self.out.clone().unwrap_or_else(|| self.surface.with_extension("msh"));
        if out == self.surface {
            bail!("{}: the mesh would replace the surface; name another --out", out.display());
        }
        let surface = FilledSurface::read(&self.surface, self.scale, target)?;
        let mesh = &surface.filled.mesh;
        let bytes = encode_mesh(&out, mesh, &[], &Surface::from_mesh(mesh), &[])?;
        write_file(&out, &bytes)?;
        drop(progress);
        print(&self.describe(&surface, &out.display().to_string()))
    }

    fn describe(&self, surface: &FilledSurface, out: &str) -> String {
        let filled = &surface.filled;
        let extent = surface.extent;
        let mut text = format!(
            "{}: {} surface, {} triangles in {} shells, {:.4} × {:.4} × {:.4} m\n",
            self.surface.display(),
            surface.format,
            filled.mending.triangles,
            filled.mending.shells,
            extent.x,
            extent.y,
            extent.z
        );
        for fault in surface.faults().into_iter().chain(surface.doubtful_unit()) {
            text.push_str(&format!("  {fault}\n"));
        }
        let counted = match filled.volume_error {
            0.0 => String::new(),
            error => format!(" (by counting points, within {error:.1e} m³)"),
        };
        text.push_str(&format!(
            "filled: {} nodes, {} tetrahedra, cells of {:.4} m along the surface, {:.4} to {:.4} m \
             where it is thin and inside\n",
            filled.mesh.node_count(),
            filled.mesh.tets().len(),
            filled.spacing,
            filled.finest,
            filled.coarsest,
        ));
        text.push_str(&format!(
            "volume: {:.6e} m³, of the surface {:.6e} m³{counted}; nodes were moved by {:.5} m at most \
             for that\n",
            filled.volume, filled.volume_of_surface, filled.moved
        ));
        text.push_str(&deviation("surface to mesh", &filled.surface_to_mesh));
        text.push_str(&deviation("mesh to surface", &filled.mesh_to_surface));
        let quality = Quality::from_mesh(&filled.mesh, 0);
        text.push_str(&format!(
            "dihedral angles: {:.1}° to {:.1}°\nwritten to {out}\n",
            quality.dihedral_min.to_degrees(),
            quality.dihedral_max.to_degrees()
        ));
        text
    }
}

fn deviation(name: &str, deviation: &Deviation) -> String {
    let Deviation { rms, max, at } = deviation;
    format!(
        "{name}: {rms:.5} m (root mean square), {max:.5} m at most, at ({:.4}, {:.4}, {:.4})\n",
        at.x, at.y, at.z
    )
}
