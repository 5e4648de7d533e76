//! The one function that fills a surface, its answer, and its refusals.

use nalgebra::Point3;

use super::deviation::{Deviation, deviations};
use super::fit::{self, Fitted};
use super::skin::Skin;
use super::swell::{Swollen, enclosed, swell, volume_of};
use crate::mesh::TetMesh;
use crate::surface::{MendedSurface, SurfaceError, SurfaceMending, TriangleSurface};

/// How fine the mesh is to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FillTarget {
    /// About so many nodes, within a few hundredths.
    Nodes(usize),
    /// Cubes of this edge along the surface, in the surface's unit.
    Size(f64),
}

/// A mesh of what a surface encloses, and how near it is.
///
/// Units and frame: the surface's.
#[derive(Clone, Debug)]
pub struct Filled {
    /// One face-connected body with positive elements and without orphans.
    pub mesh: TetMesh,
    /// What was wrong with the surface.
    pub mending: SurfaceMending,
    /// Edge of the cubes along the surface.
    pub spacing: f64,
    /// Edge of the smallest cubes along the surface, where the body is thin.
    pub finest: f64,
    /// Edge of the largest cubes inside.
    pub coarsest: f64,
    /// Volume that the surface encloses.
    pub volume_of_surface: f64,
    /// How far that may be off: 0 for a closed surface without overlap; else points were counted,
    /// and this is three standard deviations of as many points drawn by chance.
    pub volume_error: f64,
    /// Volume of the mesh before its boundary was moved.
    pub volume_before: f64,
    /// Volume of the mesh.
    pub volume: f64,
    /// Largest way of a boundary node to make the volume right.
    pub moved: f64,
    /// Distance from the surface to the mesh.
    pub surface_to_mesh: Deviation,
    /// Distance from the boundary of the mesh to the surface, where it covers no hole.
    pub mesh_to_surface: Deviation,
    /// Share of the boundary that covers holes.
    pub covered: f64,
    /// Pieces that were left out.
    pub pieces_left_out: usize,
    /// Their share of the volume.
    pub left_out: f64,
    /// Edges and nodes at which the boundary touches itself.
    pub hinges: usize,
}

/// Why a surface cannot be filled.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FillError {
    /// The triangles bound nothing.
    #[error("the surface has no triangle with an area")]
    NoArea,
    /// Fewer or more nodes than meshes are made with.
    #[error("{nodes} nodes asked for; there can be {FILL_NODES_MIN} to {FILL_NODES_MAX}")]
    NodeCount {
        /// Number of nodes that was asked for.
        nodes: usize,
    },
    /// A size that is no length, or far too small or large for the object.
    #[error("cells of {size} do not suit an object of {extent}; there can be {least} to {most}")]
    Size {
        /// Edge of the elements that was asked for, m.
        size: f64,
        /// Longest edge of the box around the surface.
        extent: f64,
        /// Smallest edge that can be asked for, m.
        least: f64,
        /// Largest edge that can be asked for, m.
        most: f64,
    },
    /// No point has the surface around it.
    #[error("the surface has no inside: {}", .hole.as_deref().unwrap_or(
        "its triangles enclose no volume"))]
    NoInside {
        /// Where it is open, in words.
        hole: Option<String>,
    },
    /// Most of what would bound the mesh is not there.
    #[error(
        "the surface is too open to have an inside: {:.0} % of the mesh's boundary would cover \
         holes; {hole}", 100.0 * .covered
    )]
    TooOpen {
        /// Share of the boundary.
        covered: f64,
        /// Where it is open, in words.
        hole: String,
    },
    /// There is an inside, but it is thinner than the cells.
    #[error("the inside is thinner than cells of {spacing} can show; ask for more nodes")]
    TooThin {
        /// Edge of the cells tried.
        spacing: f64,
    },
}

/// Fewest nodes a surface is filled with.
pub const FILL_NODES_MIN: usize = 40;
/// Most nodes a surface is filled with.
pub const FILL_NODES_MAX: usize = 400_000;
/// Cells along the longest extent, fewest and most.
const CELLS: [f64; 2] = [2.0, 200.0];
/// Share of covers from which a surface is no bound of anything.
const COVERED_MAX: f64 = 0.4;

/// Fills what a surface encloses. Equal arguments give equal bits, for any number of threads.
///
/// # Errors
/// [`FillError`].
pub fn fill(surface: &TriangleSurface, target: FillTarget) -> Result<Filled, FillError> {
    check(surface, target)?;
    let MendedSurface { surface, mending } =
        MendedSurface::new(surface).map_err(|_: SurfaceError| FillError::NoArea)?;
    let skin = Skin::new(&surface);
    if !skin.is_skin.contains(&true) {
        return Err(FillError::NoInside { hole: place_of_hole(&mending) });
    }
    let enclosed = enclosed(&skin, mending.is_closed());
    let extent = surface.size();
    // Written so that a NaN is refused.
    let has_volume = enclosed.volume > FLAT * extent.powi(3);
    if !has_volume {
        return Err(FillError::NoInside { hole: place_of_hole(&mending) });
    }
    let fitted = match target {
        FillTarget::Nodes(nodes) => fit::of_nodes(&skin, nodes, enclosed.volume),
        FillTarget::Size(size) => fit::of_size(&skin, size),
    };
    let spacing = match target {
        FillTarget::Nodes(nodes) => (2.0 * enclosed.volume / nodes as f64).cbrt(),
        FillTarget::Size(size) => size,
    };
    let Some(Fitted { mesh, spacing, finest, coarsest, pieces_left_out, left_out, hinges }) =
        fitted
    else {
        return Err(FillError::TooThin { spacing });
    };
    let volume_before = volume_of(&mesh);
    let Swollen { mesh, moved } = swell(&skin, mesh, enclosed.volume * (1.0 - left_out));
    let Some(apart) = deviations(&skin, &mesh, mending.open_edges > 0) else {
        return Err(FillError::TooThin { spacing });
    };
    if apart.covered > COVERED_MAX {
        let hole = place_of_hole(&mending).unwrap_or_else(|| "no open edge was found".to_owned());
        return Err(FillError::TooOpen { covered: apart.covered, hole });
    }
    Ok(Filled {
        volume: volume_of(&mesh),
        mesh,
        mending,
        spacing,
        finest,
        coarsest,
        volume_of_surface: enclosed.volume,
        volume_error: enclosed.error,
        volume_before,
        moved,
        surface_to_mesh: apart.surface_to_mesh,
        mesh_to_surface: apart.mesh_to_surface,
        covered: apart.covered,
        pieces_left_out,
        left_out,
        hinges,
    })
}

fn check(surface: &TriangleSurface, target: FillTarget) -> Result<(), FillError> {
    match target {
        FillTarget::Nodes(nodes) => match (FILL_NODES_MIN..=FILL_NODES_MAX).contains(&nodes) {
            true => Ok(()),
            false => Err(FillError::NodeCount { nodes }),
        },
        FillTarget::Size(size) => {
            let extent = surface.size();
            let (least, most) = (extent / CELLS[1], extent / CELLS[0]);
            match (least..=most).contains(&size) {
                true => Ok(()),
                false => Err(FillError::Size { size, extent, least, most }),
            }
        }
    }
}

/// The largest hole, in words.
fn place_of_hole(mending: &SurfaceMending) -> Option<String> {
    let largest = mending.holes.first()?;
    let Point3 { coords } = largest.centre;
    Some(format!(
        "it is open along {} edges around ({:.4}, {:.4}, {:.4}), {:.4} round the rim",
        largest.edges, coords.x, coords.y, coords.z, largest.rim
    ))
}

/// Volume, in cubes of the extent, below which nothing is enclosed.
const FLAT: f64 = 1e-7;
