//! Tree of boxes over the triangles of a surface: winding number, closest point, hits of a ray.

use nalgebra::{Point3, Vector3};

use super::TriangleSurface;
use super::moments::{Moments, winding_of_triangle};
use crate::rigid_body::{area_normal, on_triangle, point_at};

/// A surface made ready for questions about points.
///
/// Shapes: one entry of `corners` and `numbers` a triangle, in the order of the tree.
#[derive(Clone, Debug)]
pub struct SurfaceTree {
    corners: Vec<[Point3<f64>; 3]>,
    /// Number of the triangle in its surface.
    numbers: Vec<u32>,
    branches: Vec<Branch>,
}

/// A box, what is in it, and what it looks like from afar.
#[derive(Clone, Debug)]
struct Branch {
    low: Point3<f64>,
    high: Point3<f64>,
    /// Range of triangles.
    first: usize,
    count: usize,
    /// Position of the second child; the first stands behind its parent. 0 in a leaf.
    second: usize,
    moments: Moments,
}

/// The point of a surface that is closest to another point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closest {
    /// Number of its triangle in the surface.
    pub triangle: u32,
    /// Where it is.
    pub point: Point3<f64>,
    /// Distance to it.
    pub distance: f64,
}

/// Where a ray goes through a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance from the ray's start, in lengths of its direction.
    pub at: f64,
    /// Number of the triangle in the surface.
    pub triangle: u32,
    /// Whether the ray leaves through the triangle's outside.
    pub leaves: bool,
}

/// Triangles of a leaf.
const LEAF: usize = 6;
/// Distance, in radii of a group, from which its sums stand for its triangles.
const FAR: f64 = 2.0;

impl SurfaceTree {
    /// Builds the tree; equal surfaces give equal trees.
    pub fn new(surface: &TriangleSurface) -> Self {
        let numbers = (0..surface.triangles().len() as u32).collect();
        let mut tree = Self { corners: Vec::new(), numbers, branches: Vec::new() };
        let middles: Vec<Point3<f64>> = (0..surface.triangles().len())
            .map(|t| {
                let [a, b, c] = surface.corners(t);
                Point3::from((a.coords + b.coords + c.coords) / 3.0)
            })
            .collect();
        tree.sort(&middles, surface);
        tree
    }

    /// Sorts the triangles into halves along the longest edge of their box, without recursion.
    fn sort(&mut self, middles: &[Point3<f64>], surface: &TriangleSurface) {
        let mut waiting = vec![(0, self.numbers.len(), None)];
        while let Some((first, count, parent)) = waiting.pop() {
            let here = self.branches.len();
            if let Some(parent) = parent {
                let parent: &mut Branch = &mut self.branches[parent];
                parent.second = here;
            }
            let numbers = &mut self.numbers[first..first + count];
            let triangles: Vec<_> = numbers.iter().map(|t| surface.corners(*t as usize)).collect();
            let (low, high) = box_around(triangles.iter().flatten());
            let moments = Moments::of(&triangles);
            self.branches.push(Branch { low, high, first, count, second: 0, moments });
            if count <= LEAF {
                continue;
            }
            let (from, to) = box_around(numbers.iter().map(|t| &middles[*t as usize]));
            let axis = (to - from).imax();
            let half = count / 2;
            let at = |t: &u32| middles[*t as usize][axis];
            numbers.select_nth_unstable_by(half, |a, b| at(a).total_cmp(&at(b)).then(a.cmp(b)));
            // Which of equal halves comes first in a half depends on the algorithm.
            numbers[..half].sort_unstable();
            numbers[half..].sort_unstable();
            waiting.push((first + half, count - half, Some(here)));
            waiting.push((first, half, None));
        }
        self.corners = self.numbers.iter().map(|t| surface.corners(*t as usize)).collect();
    }

    /// Generalised winding number: 1 inside a closed surface, 0 outside, between the two near holes,
    /// sums where shells overlap. Groups of triangles far away are taken as one.
    ///
    /// Source: Jacobson, Kavan and Sorkine-Hornung, "Robust inside-outside segmentation using
    /// generalized winding numbers", ACM Transactions on Graphics 32 (2013); the tree is that of
    /// Barill et al. (2018).
    pub fn winding(&self, point: &Point3<f64>) -> f64 {
        let mut sum = 0.0;
        let mut waiting = Waiting::new();
        while let Some(index) = waiting.pop() {
            let branch = &self.branches[index];
            let moments = &branch.moments;
            if (moments.centre - point).norm_squared() > (FAR * moments.radius).powi(2) {
                sum += moments.winding(point);
            } else if branch.second == 0 {
                let triangles = &self.corners[branch.first..branch.first + branch.count];
                sum += triangles.iter().map(|t| winding_of_triangle(t, point)).sum::<f64>();
            } else {
                waiting.push(branch.second);
                waiting.push(index + 1);
            }
        }
        sum
    }

    /// Winding number as a sum over all triangles, the oracle of the tree.
    pub fn winding_by_sum(&self, point: &Point3<f64>) -> f64 {
        self.corners.iter().map(|t| winding_of_triangle(t, point)).sum()
    }

    /// The closest point of the surface.
    pub fn closest(&self, point: &Point3<f64>) -> Closest {
        let mut best = (f64::INFINITY, 0, *point);
        let mut waiting = Waiting::new();
        while let Some(index) = waiting.pop() {
            let branch = &self.branches[index];
            if branch.square_of_distance(point) >= best.0 {
                continue;
            }
            if branch.second == 0 {
                for t in branch.first..branch.first + branch.count {
                    let corners = &self.corners[t];
                    let near = point_at(corners, &on_triangle(corners, point));
                    let square = (near - point).norm_squared();
                    if square < best.0 {
                        best = (square, t, near);
                    }
                }
                continue;
            }
            let children = [index + 1, branch.second];
            let [one, two] = children.map(|c| self.branches[c].square_of_distance(point));
            // The nearer one is looked at first.
            waiting.push(children[usize::from(one <= two)]);
            waiting.push(children[usize::from(one > two)]);
        }
        let (square, t, near) = best;
        Closest { triangle: self.numbers[t], point: near, distance: square.sqrt() }
    }

    /// All hits of a ray behind its start, nearest first.
    pub fn hits(&self, from: &Point3<f64>, direction: &Vector3<f64>) -> Vec<Hit> {
        let mut hits = Vec::new();
        let mut waiting = Waiting::new();
        while let Some(index) = waiting.pop() {
            let branch = &self.branches[index];
            if !branch.is_hit(from, direction) {
                continue;
            }
            if branch.second != 0 {
                waiting.push(branch.second);
                waiting.push(index + 1);
                continue;
            }
            for t in branch.first..branch.first + branch.count {
                if let Some((at, leaves)) = hit(&self.corners[t], from, direction) {
                    hits.push(Hit { at, triangle: self.numbers[t], leaves });
                }
            }
        }
        hits.sort_unstable_by(|a, b| a.at.total_cmp(&b.at).then(a.triangle.cmp(&b.triangle)));
        hits
    }

    /// Numbers with one entry a triangle, made ready for [`SurfaceTree::least_within`].
    pub(crate) fn minima(&self, of_triangle: &[f64]) -> Minima {
        let values: Vec<f64> = self.numbers.iter().map(|t| of_triangle[*t as usize]).collect();
        let least = |b: &Branch| {
            values[b.first..b.first + b.count].iter().copied().fold(f64::INFINITY, f64::min)
        };
        let of_branch = self.branches.iter().map(least).collect();
        Minima { values, of_branch }
    }

    /// The smallest number of a triangle that comes within `distance` of a point; infinite where
    /// there is none.
    pub(crate) fn least_within(&self, minima: &Minima, point: &Point3<f64>, distance: f64) -> f64 {
        let square = distance * distance;
        let mut least = f64::INFINITY;
        let mut waiting = Waiting::new();
        while let Some(index) = waiting.pop() {
            let branch = &self.branches[index];
            if minima.of_branch[index] >= least || branch.square_of_distance(point) > square {
                continue;
            }
            if branch.second != 0 {
                waiting.push(branch.second);
                waiting.push(index + 1);
                continue;
            }
            for t in branch.first..branch.first + branch.count {
                let corners = &self.corners[t];
                if minima.values[t] < least
                    && (point_at(corners, &on_triangle(corners, point)) - point).norm_squared()
                        <= square
                {
                    least = minima.values[t];
                }
            }
        }
        least
    }
}

/// Numbers of triangles, and the smallest in every branch.
#[derive(Clone, Debug)]
pub(crate) struct Minima {
    values: Vec<f64>,
    of_branch: Vec<f64>,
}

/// Branches still to be looked at. Halving leaves one a level, so a few dozen places are enough
/// for as many triangles as an index can name.
struct Waiting {
    branches: [usize; 64],
    count: usize,
}

impl Waiting {
    /// A tree that has only the root.
    fn new() -> Self {
        Self { branches: [0; 64], count: 1 }
    }

    fn pop(&mut self) -> Option<usize> {
        self.count = self.count.checked_sub(1)?;
        Some(self.branches[self.count])
    }

    fn push(&mut self, branch: usize) {
        self.branches[self.count] = branch;
        self.count += 1;
    }
}

impl Branch {
    fn square_of_distance(&self, point: &Point3<f64>) -> f64 {
        let out = |d: usize| (self.low[d] - point[d]).max(point[d] - self.high[d]).max(0.0);
        out(0).powi(2) + out(1).powi(2) + out(2).powi(2)
    }

    fn is_hit(&self, from: &Point3<f64>, direction: &Vector3<f64>) -> bool {
        let (mut enter, mut leave) = (0.0_f64, f64::INFINITY);
        for d in 0..3 {
            if direction[d] == 0.0 {
                if from[d] < self.low[d] || from[d] > self.high[d] {
                    return false;
                }
                continue;
            }
            let one = (self.low[d] - from[d]) / direction[d];
            let two = (self.high[d] - from[d]) / direction[d];
            (enter, leave) = (enter.max(one.min(two)), leave.min(one.max(two)));
        }
        // A flat box is as thin as rounding.
        enter <= leave * (1.0 + 1e-12) + f64::MIN_POSITIVE
    }
}

/// Where a ray goes through a triangle, and whether it leaves there.
fn hit(
    corners: &[Point3<f64>; 3],
    from: &Point3<f64>,
    direction: &Vector3<f64>,
) -> Option<(f64, bool)> {
    let normal = area_normal(corners);
    let rise = normal.dot(direction);
    if rise == 0.0 {
        return None;
    }
    let at = normal.dot(&(corners[0] - from)) / rise;
    let point = from + direction * at;
    let square = normal.norm_squared();
    let inside = [(1, 2), (2, 0), (0, 1)].iter().all(|&(a, b)| {
        normal.dot(&(corners[a] - point).cross(&(corners[b] - point))) >= -1e-12 * square
    });
    (at > 0.0 && inside).then_some((at, rise > 0.0))
}

fn box_around<'a>(points: impl Iterator<Item = &'a Point3<f64>>) -> (Point3<f64>, Point3<f64>) {
    let start = (Point3::from([f64::INFINITY; 3]), Point3::from([f64::NEG_INFINITY; 3]));
    points.fold(start, |(low, high), p| (low.inf(p), high.sup(p)))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::surface::samples::{ball, both, without};

    fn point() -> impl Strategy<Value = Point3<f64>> {
        prop::array::uniform3(-2.0..2.0f64).prop_map(Point3::from)
    }

    /// Two overlapping balls, one of them with a hole.
    fn surface() -> TriangleSurface {
        let open = without(&ball(3, Point3::origin(), 1.0), |t| t % 37 > 2);
        both(&open, &ball(2, Point3::new(0.8, 0.1, 0.0), 0.7))
    }

    proptest! {
        #[test]
        fn winding_number_by_the_tree_is_that_of_the_sum(p in point()) {
            let tree = SurfaceTree::new(&surface());
            let off = tree.winding(&p) - tree.winding_by_sum(&p);
            // A point is inside from 0.5 on: a hundredth of a turn decides nothing.
            prop_assert!(off.abs() < 1e-2, "{off:e}");
        }

        #[test]
        fn no_triangle_is_closer_than_the_closest_point(p in point()) {
            let surface = surface();
            let found = SurfaceTree::new(&surface).closest(&p);
            let distance = |t: usize| {
                let corners = surface.corners(t);
                (point_at(&corners, &on_triangle(&corners, &p)) - p).norm()
            };
            let least = (0..surface.triangles().len()).map(distance).fold(f64::INFINITY, f64::min);
            prop_assert_eq!(found.distance, least);
            prop_assert_eq!(distance(found.triangle as usize), least);
        }

        #[test]
        fn hits_are_those_of_every_triangle(p in point(), towards in point()) {
            let surface = surface();
            let direction = towards - p;
            prop_assume!(direction.norm() > 1e-3);
            let found = SurfaceTree::new(&surface).hits(&p, &direction);
            let all = (0..surface.triangles().len())
                .filter(|t| hit(&surface.corners(*t), &p, &direction).is_some())
                .count();
            prop_assert_eq!(found.len(), all);
            prop_assert!(found.windows(2).all(|w| w[0].at <= w[1].at));
        }

        #[test]
        fn least_number_within_a_distance_is_that_of_every_triangle(p in point(), d in 0.01..1.0f64) {
            let surface = surface();
            let number = |t: usize| ((t * 7919) % 1000) as f64;
            let numbers: Vec<f64> = (0..surface.triangles().len()).map(number).collect();
            let tree = SurfaceTree::new(&surface);
            let within = |t: &usize| {
                let corners = surface.corners(*t);
                (point_at(&corners, &on_triangle(&corners, &p)) - p).norm() <= d
            };
            let all = (0..numbers.len()).filter(within).map(number).fold(f64::INFINITY, f64::min);
            prop_assert_eq!(tree.least_within(&tree.minima(&numbers), &p, d), all);
        }
    }

    #[test]
    fn winding_number_is_one_inside_and_nothing_outside() {
        let tree = SurfaceTree::new(&ball(4, Point3::origin(), 1.0));
        assert!((tree.winding(&Point3::new(0.1, 0.2, -0.3)) - 1.0).abs() < 4e-3);
        assert!(tree.winding(&Point3::new(1.1, 0.2, -0.3)).abs() < 4e-3);
    }

    #[test]
    fn many_equal_triangles_make_a_tree() {
        let points = vec![Point3::origin(), Point3::new(1.0, 0.0, 0.0), Point3::new(0.0, 1.0, 0.0)];
        let same = TriangleSurface::try_new(points, vec![[0, 1, 2]; 100_000]).unwrap();
        let closest = SurfaceTree::new(&same).closest(&Point3::new(0.2, 0.2, 1.0));
        assert_eq!(closest.distance, 1.0);
    }
}
