//! Where a surface crosses the edges of a grid, and grid points that are moved onto it.

use nalgebra::Point3;

/// Where the surface crosses an edge of the grid.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cut {
    /// Grid points, ascending.
    pub(crate) ends: [usize; 2],
    /// Whether the edge runs along an axis.
    pub(crate) is_long: bool,
    /// Where it is.
    pub(crate) position: Point3<f64>,
    /// Length of the shortest long edge of the cells around each end.
    pub(crate) spacings: [f64; 2],
}

/// Side of the surface a grid point is on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    Inside,
    /// Moved onto the surface (or there from the start).
    On,
    Outside,
}

/// Moves every grid point with a cut too close to it onto the nearest such cut.
pub(crate) fn warp(cuts: &[Cut], points: &mut [Point3<f64>], sides: &mut [Side]) {
    let mut close: Vec<(usize, f64, usize)> = Vec::new();
    for (index, cut) in cuts.iter().enumerate() {
        let limit = if cut.is_long { WARP_LONG } else { WARP_SHORT * 0.75f64.sqrt() };
        for (end, spacing) in cut.ends.into_iter().zip(cut.spacings) {
            let distance = (cut.position - points[end]).norm() / spacing;
            if distance < limit {
                close.push((end, distance, index));
            }
        }
    }
    close.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
    for (point, _, cut) in close {
        // A cut vanishes as soon as one of its ends lies on the surface itself.
        if cuts[cut].ends.iter().all(|end| sides[*end] != Side::On) {
            points[point] = cuts[cut].position;
            sides[point] = Side::On;
        }
    }
}

/// A cut nearer to a point than this part of a long edge moves the point (Labelle and Shewchuk,
/// table 1, the thresholds for the best smallest angle).
const WARP_LONG: f64 = 0.24999;

/// Nearness to a lattice point, over the edge, below which a cut of a short edge is warped away.
const WARP_SHORT: f64 = 0.41189;
