//! Where a surface crosses the edges of a grid, and grid points that are moved onto it; the grid of
//! tetrahedra cut along the surface into well-shaped ones, by a few fixed patterns.

use nalgebra::Point3;

use crate::mesh::signed_volume;

/// Where the surface crosses an edge of the grid.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cut {
    /// Grid points, ascending.
    pub(crate) ends: [usize; 2],
    /// Whether the edge runs along an axis.
    pub(crate) is_long: bool,
    /// Place where the surface crosses the edge.
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

/// Vertices and elements as they come out of the lattice, elements positive, no orphans.
#[derive(Clone, Debug, Default)]
pub(crate) struct Stuffing {
    pub(crate) vertices: Vec<Point3<f64>>,
    pub(crate) tets: Vec<[u32; 4]>,
}

/// A corner of the mesh before numbering: a grid point or the cut with that index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Corner {
    Point(usize),
    Cut(usize),
}

/// The elements as they are cut, one tetrahedron of the grid after the other.
///
/// Shapes: `points`, `sides` and `parities` one entry a grid point.
#[derive(Clone, Debug)]
pub(crate) struct Pieces {
    points: Vec<Point3<f64>>,
    sides: Vec<Side>,
    parities: Vec<u8>,
    cuts: Vec<Cut>,
    tets: Vec<[Corner; 4]>,
}

impl Pieces {
    /// No elements yet. `cuts` are sorted by their ends and hold every edge of the grid from an
    /// inside to an outside point; `parities` are 0 or 1, different for the two ends of a long edge
    /// wherever the grid allows.
    pub(crate) fn new(
        points: Vec<Point3<f64>>,
        sides: Vec<Side>,
        parities: Vec<u8>,
        cuts: Vec<Cut>,
    ) -> Self {
        Self { points, sides, parities, cuts, tets: Vec::new() }
    }

    /// Adds what lies inside of one tetrahedron of the grid.
    pub(crate) fn add(&mut self, corners: [usize; 4]) {
        // Nearly all are whole or empty; they need no lists.
        if corners.iter().all(|c| self.sides[*c] != Side::Inside) {
            return;
        }
        if corners.iter().all(|c| self.sides[*c] != Side::Outside) {
            self.tets.push(corners.map(Corner::Point));
            return;
        }
        let (mut inside, mut on, mut outside) = (Vec::new(), Vec::new(), Vec::new());
        for c in corners {
            match self.sides[c] {
                Side::Inside => inside.push(c),
                Side::On => on.push(Corner::Point(c)),
                Side::Outside => outside.push(c),
            }
        }
        match (&inside[..], &on[..], &outside[..]) {
            (&[a], _, _) => {
                let mut tet = [Corner::Point(a); 4];
                let rest = on.iter().copied().chain(outside.iter().map(|o| self.cut(a, *o)));
                for (slot, corner) in tet[1..].iter_mut().zip(rest) {
                    *slot = corner;
                }
                self.tets.push(tet);
            }
            (&[a, b], &[apex], &[o]) => {
                let quad = [Corner::Point(a), Corner::Point(b), self.cut(b, o), self.cut(a, o)];
                self.add_pyramid(quad, apex);
            }
            (&[a, b], _, &[o, p]) => self.add_prism(
                [Corner::Point(a), self.cut(a, o), self.cut(a, p)],
                [Corner::Point(b), self.cut(b, o), self.cut(b, p)],
            ),
            (&[a, b, c], _, &[o, ..]) => self.add_prism(
                [a, b, c].map(Corner::Point),
                [self.cut(a, o), self.cut(b, o), self.cut(c, o)],
            ),
            _ => unreachable!("a cut tetrahedron has 1 to 3 corners inside, one or more outside"),
        }
    }

    fn cut(&self, a: usize, b: usize) -> Corner {
        let ends = [a.min(b), a.max(b)];
        let found = self.cuts.binary_search_by_key(&ends, |c| c.ends);
        Corner::Cut(found.expect("every edge between inside and outside has a cut"))
    }

    /// Order in which corners claim the diagonals of the quadrilaterals they belong to.
    ///
    /// The rule depends on the corner only, so the two elements at a face agree.
    fn rank(&self, corner: Corner) -> (usize, usize) {
        match corner {
            Corner::Cut(c) if self.cuts[c].is_long => (0, c),
            Corner::Point(p) => (1 + usize::from(self.parities[p]), p),
            Corner::Cut(c) => (3, c),
        }
    }

    /// Splits a pyramid along the diagonal at the lowest-ranked corner of its base.
    fn add_pyramid(&mut self, base: [Corner; 4], apex: Corner) {
        let lowest = (0..4).min_by_key(|i| self.rank(base[*i])).expect("a base has four corners");
        let [a, b, c, d] = [0, 1, 2, 3].map(|i| base[(lowest + i) % 4]);
        self.tets.push([a, b, c, apex]);
        self.tets.push([a, c, d, apex]);
    }

    /// Splits a prism between two triangles whose corners face each other: the lowest-ranked
    /// corner sees the opposite triangle and the one quadrilateral it is not part of.
    fn add_prism(&mut self, bottom: [Corner; 3], top: [Corner; 3]) {
        let all = [bottom, top].concat();
        let lowest = (0..6).min_by_key(|i| self.rank(all[*i])).expect("a prism has six corners");
        let (near, far) = if lowest < 3 { (bottom, top) } else { (top, bottom) };
        let [i, j, k] = [0, 1, 2].map(|step| (lowest + step) % 3);
        self.tets.push([near[i], far[i], far[j], far[k]]);
        self.add_pyramid([near[j], near[k], far[k], far[j]], near[i]);
    }

    /// Numbers the corners in use, grid points first, and turns every element positive.
    pub(crate) fn finish(self) -> Stuffing {
        let point_count = self.points.len();
        let slot = |corner: Corner| match corner {
            Corner::Point(p) => p,
            Corner::Cut(c) => point_count + c,
        };
        let mut numbers = vec![u32::MAX; point_count + self.cuts.len()];
        for corner in self.tets.iter().flatten() {
            numbers[slot(*corner)] = 0;
        }
        let positions = self.points.iter().chain(self.cuts.iter().map(|c| &c.position));
        let mut vertices = Vec::new();
        for (number, position) in numbers.iter_mut().zip(positions).filter(|(n, _)| **n == 0) {
            *number = u32::try_from(vertices.len()).expect("node counts are limited far below u32");
            vertices.push(*position);
        }
        let orient = |tet: &[Corner; 4]| {
            let mut nodes = tet.map(|corner| numbers[slot(corner)]);
            if signed_volume(&nodes.map(|n| vertices[n as usize])) < 0.0 {
                nodes.swap(0, 1);
            }
            nodes
        };
        let tets = self.tets.iter().map(orient).collect();
        Stuffing { vertices, tets }
    }
}
