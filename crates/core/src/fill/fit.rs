//! Finds the size of cubes that gives the number of nodes asked for, and a sound mesh of it.

use super::carve::{Carved, carve};
use super::octree::SKIN_LEVEL;
use super::skin::Skin;
use crate::mesh::{Bodies, Quality, Surface, TetMesh};
use crate::stuffing::{Stuffing, smooth};
use nalgebra::Point3;

/// A mesh of the largest piece, smoothed, its boundary nodes on the surface.
pub(super) struct Fitted {
    pub(super) mesh: TetMesh,
    /// Edge of the cubes along the skin.
    pub(super) spacing: f64,
    pub(super) finest: f64,
    pub(super) coarsest: f64,
    /// Pieces left out.
    pub(super) pieces_left_out: usize,
    /// Share of the volume that these pieces have.
    pub(super) left_out: f64,
    /// Edges and nodes where the boundary touches itself.
    pub(super) hinges: usize,
}

/// Mesh with about `nodes` nodes; `None` where no cubes of any size have an inside.
pub(super) fn of_nodes(skin: &Skin, nodes: usize, volume: f64) -> Option<Fitted> {
    let area = skin.area();
    let mut spacing = (2.0 * volume / nodes as f64).cbrt();
    for _ in 0..20 {
        spacing = ((2.0 * volume + LAYER * area * spacing) / nodes as f64).cbrt();
    }
    let mut best: Option<(usize, Raw)> = None;
    for try_index in 0..TRIES_MAX {
        let raw = Raw::new(skin, spacing, shift(try_index));
        let count = raw.as_ref().map_or(0, |raw| raw.mesh.node_count());
        if let Some(raw) = raw {
            // A hinge is worth as much as being off by a fifth.
            let miss = count.abs_diff(nodes) + if raw.hinges > 0 { nodes / 5 } else { 0 };
            if best.as_ref().is_none_or(|(least, _)| miss < *least) {
                best = Some((miss, raw));
            }
        }
        if best.as_ref().is_some_and(|(miss, _)| *miss <= nodes / NEAR) {
            break;
        }
        spacing *= (count.max(1) as f64 / nodes as f64).powf(0.4).clamp(0.6, 1.6);
    }
    best.map(|(_, raw)| raw.finish(skin))
}

/// Mesh of cubes with an edge of `spacing` along the skin.
pub(super) fn of_size(skin: &Skin, spacing: f64) -> Option<Fitted> {
    let mut best: Option<Raw> = None;
    for try_index in 0..SHIFTS_TRIED {
        let Some(raw) = Raw::new(skin, spacing, shift(try_index)) else { continue };
        if best.as_ref().is_none_or(|best| raw.hinges < best.hinges) {
            best = Some(raw);
        }
        if best.as_ref().is_some_and(|best| best.hinges == 0) {
            break;
        }
    }
    best.map(|raw| raw.finish(skin))
}

/// The largest piece before it is smoothed.
struct Raw {
    mesh: TetMesh,
    spacing: f64,
    finest: f64,
    coarsest: f64,
    pieces_left_out: usize,
    left_out: f64,
    hinges: usize,
}

impl Raw {
    fn new(skin: &Skin, spacing: f64, shift: [f64; 3]) -> Option<Self> {
        let Carved { stuffing, finest, coarsest } = carve(skin, spacing, shift);
        if stuffing.tets.is_empty() {
            return None;
        }
        let (mesh, pieces_left_out, left_out) = largest_piece(stuffing)?;
        let surface = Surface::from_mesh(&mesh);
        let hinges = surface.non_manifold_edges() + surface.non_manifold_nodes();
        Some(Self { mesh, spacing, finest, coarsest, pieces_left_out, left_out, hinges })
    }

    fn finish(self, skin: &Skin) -> Fitted {
        let surface = Surface::from_mesh(&self.mesh);
        let mut on_surface = vec![false; self.mesh.node_count()];
        surface.nodes.iter().for_each(|n| on_surface[*n as usize] = true);
        let spacings = spacings(&self.mesh);
        let mut stuffing =
            Stuffing { vertices: self.mesh.vertices().to_vec(), tets: self.mesh.tets().to_vec() };
        smooth(&mut stuffing, &on_surface, &spacings, |p, spacing| project(skin, p, spacing));
        let smoothed = self.mesh.with_vertices(stuffing.vertices);
        let angle = |mesh: &TetMesh| Quality::from_mesh(mesh, 0).dihedral_min;
        let mesh = match smoothed {
            Ok(smoothed) if angle(&smoothed) >= angle(&self.mesh) => smoothed,
            _ => self.mesh,
        };
        Fitted {
            mesh,
            spacing: self.spacing,
            finest: self.finest,
            coarsest: self.coarsest,
            pieces_left_out: self.pieces_left_out,
            left_out: self.left_out,
            hinges: self.hinges,
        }
    }
}

/// The closest point of the surface, where it is near: over a hole there is none.
fn project(skin: &Skin, point: &Point3<f64>, spacing: f64) -> Option<Point3<f64>> {
    let closest = skin.tree.closest(point);
    (closest.distance < 0.1 * spacing).then_some(closest.point)
}

/// Half the length of the edges around every node, on the mean: about a long edge of the grid.
fn spacings(mesh: &TetMesh) -> Vec<f64> {
    let mut sums = vec![(0.0, 0.0); mesh.node_count()];
    for (t, tet) in mesh.tets().iter().enumerate() {
        // Twelve tetrahedra of the grid fill a cube.
        let edge = (12.0 * mesh.signed_volume(t)).cbrt();
        for n in tet {
            let sum: &mut (f64, f64) = &mut sums[*n as usize];
            *sum = (sum.0 + edge, sum.1 + 1.0);
        }
    }
    sums.iter().map(|(sum, count)| sum / count).collect()
}

/// The face-connected piece with the most volume, how many others there are, and their share.
fn largest_piece(stuffing: Stuffing) -> Option<(TetMesh, usize, f64)> {
    let whole = TetMesh::try_new(stuffing.vertices, stuffing.tets, Vec::new()).ok()?;
    let bodies = Bodies::from_mesh(&whole);
    if bodies.piece_count() == 1 {
        return Some((whole, 0, 0.0));
    }
    let mut volumes = vec![0.0; bodies.piece_count()];
    for (t, piece) in bodies.piece_of_tet.iter().enumerate() {
        volumes[*piece as usize] += whole.signed_volume(t);
    }
    let largest = (0..volumes.len()).max_by(|a, b| volumes[*a].total_cmp(&volumes[*b]))?;
    let kept: Vec<[u32; 4]> = whole
        .tets()
        .iter()
        .zip(&bodies.piece_of_tet)
        .filter(|(_, piece)| **piece as usize == largest)
        .map(|(tet, _)| *tet)
        .collect();
    let mut is_used = vec![false; whole.node_count()];
    kept.iter().flatten().for_each(|n| is_used[*n as usize] = true);
    let mut place = vec![0; whole.node_count()];
    let mut vertices = Vec::new();
    for n in (0..whole.node_count()).filter(|n| is_used[*n]) {
        place[n] = vertices.len() as u32;
        vertices.push(whole.vertices()[n]);
    }
    let tets = kept.iter().map(|tet| tet.map(|n| place[n as usize])).collect();
    let left_out = 1.0 - volumes[largest] / volumes.iter().sum::<f64>();
    let mesh = TetMesh::try_new(vertices, tets, Vec::new()).ok()?;
    Some((mesh, volumes.len() - 1, left_out))
}

/// Shift of the cubes for each try, in largest cubes: multiples of three roots without a common
/// measure. None is 0: an object whose faces lie on round numbers would lie in faces of cubes.
fn shift(try_index: usize) -> [f64; 3] {
    let turns = (try_index + 1) as f64 / f64::from(1 << SKIN_LEVEL);
    [0.819_172_513, 0.671_043_607, 0.549_700_478].map(|step| (step * turns).fract())
}

/// Nodes that the surface adds, per its area in squared spacings (as for the built-in objects).
const LAYER: f64 = 1.36;
/// Sizes tried at most.
const TRIES_MAX: usize = 12;
/// Places of the cubes tried until the boundary does not touch itself.
const SHIFTS_TRIED: usize = 6;
/// Nodes may be off by one part in so many.
const NEAR: usize = 40;
