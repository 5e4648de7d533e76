//! Finds the lattice whose stuffed solid has the number of nodes asked for.

use super::lattice::Lattice;
use super::solid::Solid;
use super::split::split_inner_edges;
use super::stuffing::stuff;
use crate::mesh::{Bodies, Quality, Surface, TetMesh};
use crate::stuffing::{Stuffing, smooth};

/// Mesh of `solid` with `nodes` nodes, or as near as the lattices tried come.
///
/// Spacing and shift of the lattice are varied in a fixed sequence. A lattice slightly too coarse
/// is filled up by splitting inner edges; the first exact and well-shaped mesh is taken. `None`
/// if no lattice gave a sound body.
pub(super) fn fit(solid: Solid, nodes: usize) -> Option<TetMesh> {
    // Filling up half a percent is always possible; aiming there makes nearly every try count.
    let aim = nodes - nodes / 200;
    let deficit_max = (nodes / 50).max(4);
    let mut spacing = first_spacing(solid, aim);
    let mut best: Option<Fitted> = None;
    let mut work = 0;
    for try_index in 0..TRIES_MAX {
        let (low, high) = solid.bounds(spacing);
        let lattice = Lattice::around(low, high, spacing, shift(try_index));
        let stuffing = stuff(solid, &lattice);
        let count = stuffing.vertices.len();
        work += count;
        let is_near = count.abs_diff(nodes) <= best.as_ref().map_or(nodes, |b| b.miss);
        let is_below = count <= nodes && nodes - count <= deficit_max;
        if is_near || is_below {
            let fitted = finish(solid, spacing, stuffing, nodes);
            best = match (best, fitted) {
                (Some(old), Some(new)) if new.is_better(&old) => Some(new),
                (old, new) => old.or(new),
            };
        }
        let is_done = best.as_ref().is_some_and(|b| b.miss == 0 && b.dihedral_min > GOOD);
        if is_done || (best.is_some() && work > WORK_MAX + 8 * nodes) {
            break;
        }
        spacing *= correction(count, aim);
    }
    best.map(|b| b.mesh)
}

/// A sound mesh and how well it answers the request.
struct Fitted {
    mesh: TetMesh,
    /// Nodes too many or too few.
    miss: usize,
    /// Smallest dihedral angle, rad.
    dihedral_min: f64,
}

impl Fitted {
    fn is_better(&self, other: &Self) -> bool {
        self.miss < other.miss
            || (self.miss == other.miss && self.dihedral_min > other.dihedral_min)
    }
}

/// Smooths, fills up to `nodes`, and checks that the result is one closed body.
fn finish(solid: Solid, spacing: f64, mut stuffing: Stuffing, nodes: usize) -> Option<Fitted> {
    // Soundness depends on the connections only, so it is checked before they are improved on.
    let raw =
        TetMesh::try_new(stuffing.vertices.clone(), stuffing.tets.clone(), Vec::new()).ok()?;
    let surface = Surface::from_mesh(&raw);
    let is_sound = surface.non_manifold_edges() == 0
        && surface.non_manifold_nodes() == 0
        && surface.euler_characteristic() == 2
        && Bodies::from_mesh(&raw).piece_count() == 1;
    if !is_sound {
        return None;
    }
    let mut on_surface = vec![false; stuffing.vertices.len()];
    for n in &surface.nodes {
        on_surface[*n as usize] = true;
    }
    let spacings = vec![spacing; on_surface.len()];
    smooth(&mut stuffing, &on_surface, &spacings, |p, spacing| solid.project(p, spacing));
    for sine_min in SPLIT_SINES {
        let missing = nodes.saturating_sub(stuffing.vertices.len());
        split_inner_edges(&mut stuffing, missing, sine_min);
    }
    let miss = stuffing.vertices.len().abs_diff(nodes);
    let mesh = TetMesh::try_new(stuffing.vertices, stuffing.tets, Vec::new()).ok()?;
    let dihedral_min = Quality::from_mesh(&mesh, 0).dihedral_min;
    Some(Fitted { mesh, miss, dihedral_min })
}

/// Spacing that gives about `nodes` nodes: two lattice points a cell, and a layer at the surface.
fn first_spacing(solid: Solid, nodes: usize) -> f64 {
    let (volume, area) = solid.volume_and_area();
    let mut spacing = (2.0 * volume / nodes as f64).cbrt();
    for _ in 0..20 {
        spacing = ((2.0 * volume + LAYER * area * spacing) / nodes as f64).cbrt();
    }
    spacing
}

/// Factor on the spacing after `count` nodes came where `aim` were wanted.
fn correction(count: usize, aim: usize) -> f64 {
    // The exponent lies between the inverse of 3 (inner nodes) and of 2 (surface nodes).
    (count.max(1) as f64 / aim as f64).powf(0.37).clamp(0.8, 1.25)
}

/// Shift of the lattice for each try: multiples of three roots without a common measure, which
/// fill the cell evenly.
fn shift(try_index: usize) -> [f64; 3] {
    [0.819_172_513, 0.671_043_607, 0.549_700_478].map(|step| (step * try_index as f64).fract())
}

/// Nodes that the surface adds, per its area in squared spacings (measured on the sphere).
const LAYER: f64 = 1.36;
/// Lattices tried at most.
const TRIES_MAX: usize = 400;
/// Nodes made in all tries after which the best mesh so far is taken, with 8 more per node asked.
const WORK_MAX: usize = 60_000;
/// Smallest dihedral angle that ends the search, rad: 20°.
const GOOD: f64 = 0.349;
/// Sines of 30°, 22° and 17°: edges that leave better elements are split first.
const SPLIT_SINES: [f64; 3] = [0.5, 0.3746, 0.2924];
