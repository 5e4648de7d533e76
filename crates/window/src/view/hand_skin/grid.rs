//! A box of sampled distances whose cells are finer where the surface is finer.

use nalgebra::Point3;

/// Cells whose distance at the middle exceeds this many half diagonals of a block hold no
/// surface: the distances are right to first order only.
const SAFETY: f64 = 1.6;
/// Cells of a block along each axis.
const BLOCK: usize = 4;

/// Sampled distances at the corners of a box of cells.
///
/// Units: m.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    /// Places of the grid's planes along X, Y and Z, ascending.
    pub planes: [Vec<f64>; 3],
    /// Distance at each corner; X runs fastest, then Y. Far from the surface only the sign is
    /// right.
    pub distances: Vec<f64>,
}

impl Grid {
    /// Samples a signed distance.
    pub fn sample(planes: [Vec<f64>; 3], distance: impl Fn(&Point3<f64>) -> f64) -> Self {
        let counts = [0, 1, 2].map(|axis| planes[axis].len());
        let mut grid = Self { planes, distances: vec![0.0; counts.iter().product()] };
        for z in (0..counts[2]).step_by(BLOCK) {
            for y in (0..counts[1]).step_by(BLOCK) {
                for x in (0..counts[0]).step_by(BLOCK) {
                    grid.sample_block([x, y, z], &distance);
                }
            }
        }
        grid.separate();
        grid
    }

    /// Lets no face of a cell have its inner corners at opposite ends only, where two parts of
    /// the surface would share an edge: the corner that is less deep is given to the outside.
    ///
    /// A corner changes once at most, from inside to outside, so this ends.
    fn separate(&mut self) {
        let counts = [0, 1, 2].map(|axis| self.planes[axis].len());
        let steps = [1, counts[0], counts[0] * counts[1]];
        loop {
            let mut is_clean = true;
            for z in 0..counts[2] {
                for y in 0..counts[1] {
                    for x in 0..counts[0] {
                        for (u, v) in [(0, 1), (1, 2), (2, 0)] {
                            let at = [x, y, z];
                            if at[u] + 1 < counts[u] && at[v] + 1 < counts[v] {
                                is_clean &= !self.separate_face(self.index(at), steps[u], steps[v]);
                            }
                        }
                    }
                }
            }
            if is_clean {
                return;
            }
        }
    }

    /// Whether the face at a corner, spanned by two steps, was changed.
    fn separate_face(&mut self, corner: usize, u: usize, v: usize) -> bool {
        let around = [corner, corner + u, corner + u + v, corner + v];
        let inside = around.map(|i| self.distances[i] < 0.0);
        if inside != [true, false, true, false] && inside != [false, true, false, true] {
            return false;
        }
        let first = usize::from(!inside[0]);
        let (a, b) = (around[first], around[first + 2]);
        let shallow = if self.distances[a] > self.distances[b] { a } else { b };
        self.distances[shallow] = -self.distances[shallow];
        true
    }

    /// Place of a corner.
    pub fn corner(&self, at: [usize; 3]) -> Point3<f64> {
        Point3::new(self.planes[0][at[0]], self.planes[1][at[1]], self.planes[2][at[2]])
    }

    /// Position of a corner in `distances`.
    pub fn index(&self, at: [usize; 3]) -> usize {
        (at[2] * self.planes[1].len() + at[1]) * self.planes[0].len() + at[0]
    }

    /// Fills one block, in full only if the surface may pass through it.
    fn sample_block(&mut self, first: [usize; 3], distance: &impl Fn(&Point3<f64>) -> f64) {
        let last = [0, 1, 2].map(|axis| (first[axis] + BLOCK - 1).min(self.planes[axis].len() - 1));
        let (low, high) = (self.corner(first), self.corner(last));
        let middle = distance(&nalgebra::center(&low, &high));
        let is_far = middle.abs() > SAFETY * 0.5 * (high - low).norm();
        for z in first[2]..=last[2] {
            for y in first[1]..=last[1] {
                for x in first[0]..=last[0] {
                    let i = self.index([x, y, z]);
                    let value = if is_far { middle } else { distance(&self.corner([x, y, z])) };
                    self.distances[i] = value;
                }
            }
        }
    }
}

/// Planes from `low` to `high` whose spacing follows `spacing(place)`, the last one at or beyond
/// `high`.
pub(super) fn planes(low: f64, high: f64, spacing: impl Fn(f64) -> f64) -> Vec<f64> {
    let mut places = vec![low];
    let mut place = low;
    while place < high {
        place += spacing(place);
        places.push(place);
    }
    places
}
