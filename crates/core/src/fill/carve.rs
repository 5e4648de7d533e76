//! Cuts the inside of a surface out of a graded grid.

use nalgebra::Point3;
use rayon::prelude::*;

use super::grid::Grid;
use super::octree::{LEVELS, Octree, SKIN_LEVEL};
use super::skin::{Skin, is_inside};
use crate::stuffing::{Cut, Pieces, Side, Stuffing, warp};
use crate::surface::SurfaceTree;

/// Tetrahedra of the inside, as they come out of the grid.
pub(super) struct Carved {
    pub(super) stuffing: Stuffing,
    /// Edge of the smallest cubes that the skin lies in.
    pub(super) finest: f64,
    /// Edge of the largest cubes inside.
    pub(super) coarsest: f64,
}

/// Fills the inside of a surface with cubes of edge `spacing` along the skin, halved where the body
/// is thin and doubled towards its middle.
pub(super) fn carve(skin: &Skin, spacing: f64, shift: [f64; 3]) -> Carved {
    let smallest = spacing / f64::from(1 << (LEVELS - SKIN_LEVEL));
    let wanted: Vec<f64> = skin
        .thickness
        .iter()
        .zip(&skin.is_skin)
        .map(|(thickness, is_skin)| match is_skin {
            true => (thickness / CUBES_ACROSS).clamp(smallest, spacing) * (1.0 + 1e-9),
            false => f64::INFINITY,
        })
        .collect();
    let minima = skin.tree.minima(&wanted);
    let tree = Octree::new(skin.surface.bounds(), spacing, shift, |centre, distance| {
        skin.tree.least_within(&minima, centre, distance)
    });
    let mut grid = Grid::new(&tree);
    let mut sides: Vec<Side> = grid
        .points
        .par_iter()
        .map(|p| if is_inside(&skin.tree, p) { Side::Inside } else { Side::Outside })
        .collect();
    let cuts = find_cuts(skin, &grid, &sides);
    let at_skin = cuts.iter().flat_map(|cut| cut.spacings);
    let finest = at_skin.fold(f64::INFINITY, f64::min);
    let inside = grid.spacings.iter().zip(&sides).filter(|(_, side)| **side == Side::Inside);
    let coarsest = inside.map(|(spacing, _)| *spacing).fold(0.0, f64::max);
    warp(&cuts, &mut grid.points, &mut sides);
    let mut pieces = Pieces::new(grid.points, sides, grid.parities, cuts);
    for tet in &grid.tets {
        pieces.add(tet.map(|n| n as usize));
    }
    Carved { stuffing: pieces.finish(), finest, coarsest }
}

/// All edges of the grid from an inside to an outside point, sorted by their ends.
fn find_cuts(skin: &Skin, grid: &Grid, sides: &[Side]) -> Vec<Cut> {
    let mut edges: Vec<[usize; 2]> = grid
        .tets
        .iter()
        .flat_map(|&[a, b, c, d]| [[a, b], [a, c], [a, d], [b, c], [b, d], [c, d]])
        .map(|[a, b]| [a.min(b) as usize, a.max(b) as usize])
        .filter(|[a, b]| sides[*a] != sides[*b])
        .collect();
    edges.sort_unstable();
    edges.dedup();
    edges
        .into_par_iter()
        .map(|ends| {
            let [a, b] = ends.map(|n| grid.points[n]);
            let position = match sides[ends[0]] {
                Side::Inside => crossing(&skin.tree, &a, &b),
                _ => crossing(&skin.tree, &b, &a),
            };
            let is_long = grid.is_along_axis(ends[0], ends[1]);
            Cut { ends, is_long, position, spacings: ends.map(|n| grid.spacings[n]) }
        })
        .collect()
}

/// Where the way from an inside to an outside point leaves the inside: at a triangle where there is
/// one, and over a hole where the winding number falls below a half.
fn crossing(tree: &SurfaceTree, inside: &Point3<f64>, outside: &Point3<f64>) -> Point3<f64> {
    let step = outside - inside;
    let at = |t: f64| inside + step * t;
    let hits = tree.hits(inside, &step);
    let mut before = 0.0;
    for (i, hit) in hits.iter().enumerate().take_while(|(_, hit)| hit.at < 1.0) {
        let next = hits.get(i + 1).map_or(1.0, |next| next.at.min(1.0));
        let is_exit = hit.leaves
            && (hit.at - before < BESIDE || is_inside(tree, &at(0.5 * (before + hit.at))))
            && !is_inside(tree, &at(0.5 * (hit.at + next)));
        if is_exit {
            return at(hit.at);
        }
        before = hit.at;
    }
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        match is_inside(tree, &at(middle)) {
            true => low = middle,
            false => high = middle,
        }
    }
    at(0.5 * (low + high))
}

/// Cubes that the way through a thin part passes at least.
const CUBES_ACROSS: f64 = 2.0;
/// Hits so close together, in lengths of an edge, have no room for a point between them.
const BESIDE: f64 = 1e-9;
/// Halvings of an edge on the way to where the winding number is a half.
const BISECTIONS: u32 = 24;
