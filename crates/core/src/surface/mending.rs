//! Puts right what can be put right in a list of triangles, and says what it was.

use nalgebra::{Point3, Vector3};

use super::oriented::orient;
use super::{SurfaceError, TriangleSurface};
use crate::mesh::DisjointSets;

/// Open edges that hang together.
///
/// Units: the surface's. Frame: the surface's.
#[derive(Clone, Debug, PartialEq)]
pub struct Hole {
    /// Mean of its edges by length.
    pub centre: Point3<f64>,
    /// Length of all its edges.
    pub rim: f64,
    /// Number of its edges.
    pub edges: usize,
}

impl Hole {
    /// The holes that open edges of a surface make, longest rim first.
    pub(super) fn of_edges(surface: &TriangleSurface, edges: &[[u32; 2]]) -> Vec<Self> {
        let mut sets = DisjointSets::new(surface.points().len());
        for [a, b] in edges {
            sets.join(*a as usize, *b as usize);
        }
        let mut by_root: Vec<(usize, [u32; 2])> =
            edges.iter().map(|e| (sets.root(e[0] as usize), *e)).collect();
        by_root.sort_unstable();
        let mut holes: Vec<Self> = by_root
            .chunk_by(|a, b| a.0 == b.0)
            .map(|rim| {
                let (mut length, mut sum) = (0.0, Vector3::zeros());
                for (_, ends) in rim {
                    let [a, b] = ends.map(|n| surface.points()[n as usize]);
                    let edge = (b - a).norm();
                    length += edge;
                    sum += (a.coords + b.coords) * (0.5 * edge);
                }
                Self { centre: Point3::from(sum / length), rim: length, edges: rim.len() }
            })
            .collect();
        holes.sort_by(|a, b| b.rim.total_cmp(&a.rim));
        holes
    }
}

/// A surface whose neighbours agree which side is outside, without triangles that bound nothing.
#[derive(Clone, Debug)]
pub struct MendedSurface {
    /// Points in the same place are one; every triangle has an area and is there once.
    pub surface: TriangleSurface,
    /// What was done, and what is left.
    pub mending: SurfaceMending,
}

/// What was wrong with a surface.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SurfaceMending {
    /// Triangles as they came.
    pub triangles: usize,
    /// Triangles without area, dropped.
    pub without_area: usize,
    /// Triangles with the corners of an earlier one, dropped.
    pub doubled: usize,
    /// Triangles turned against their neighbours, turned back.
    pub turned: usize,
    /// Shells that were inside out, turned.
    pub turned_shells: usize,
    /// Shells: triangles joined by edges.
    pub shells: usize,
    /// Edges of three and more triangles, as where shells are glued together; they stay.
    pub crowded_edges: usize,
    /// Edges of one triangle; they stay open.
    pub open_edges: usize,
    /// What the open edges bound, longest rim first.
    pub holes: Vec<Hole>,
}

impl SurfaceMending {
    /// Whether every edge joins two triangles, so that the surface bounds a volume.
    pub fn is_closed(&self) -> bool {
        self.open_edges == 0 && self.crowded_edges == 0
    }
}

impl MendedSurface {
    /// Mends a surface.
    ///
    /// # Errors
    /// [`SurfaceError::Empty`] where no triangle has an area.
    pub fn new(surface: &TriangleSurface) -> Result<Self, SurfaceError> {
        let mut mending =
            SurfaceMending { triangles: surface.triangles().len(), ..Default::default() };
        let (points, place_of) = welded(surface.points());
        let mut triangles: Vec<[u32; 3]> =
            surface.triangles().iter().map(|t| t.map(|n| place_of[n as usize])).collect();
        triangles.retain(|t| has_area(&points, t));
        mending.without_area = mending.triangles - triangles.len();
        let with_area = triangles.len();
        drop_doubled(&mut triangles);
        mending.doubled = with_area - triangles.len();
        let turned = orient(&points, &mut triangles);
        let surface = TriangleSurface::try_new(points, triangles)?;
        mending.turned = turned.triangles;
        mending.turned_shells = turned.shells;
        mending.shells = turned.shell_count;
        mending.crowded_edges = turned.crowded_edges;
        mending.open_edges = turned.open_edges.len();
        mending.holes = Hole::of_edges(&surface, &turned.open_edges);
        Ok(Self { surface, mending })
    }
}

/// Points without repetition, and the new index of every old one.
fn welded(points: &[Point3<f64>]) -> (Vec<Point3<f64>>, Vec<u32>) {
    // Adding 0 makes one zero of the two.
    let key = |n: &u32| points[*n as usize].coords.map(|c| c + 0.0);
    let compare = |a: &u32, b: &u32| {
        let (p, q) = (key(a), key(b));
        p.x.total_cmp(&q.x).then(p.y.total_cmp(&q.y)).then(p.z.total_cmp(&q.z))
    };
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    order.sort_unstable_by(|a, b| compare(a, b).then(a.cmp(b)));
    let mut place_of = vec![0; points.len()];
    let mut kept = Vec::new();
    for same in order.chunk_by(|a, b| compare(a, b).is_eq()) {
        same.iter().for_each(|n| place_of[*n as usize] = kept.len() as u32);
        kept.push(points[same[0] as usize]);
    }
    (kept, place_of)
}

fn has_area(points: &[Point3<f64>], triangle: &[u32; 3]) -> bool {
    let [a, b, c] = triangle.map(|n| points[n as usize]);
    // Written so that a NaN has none.
    (b - a).cross(&(c - a)).norm_squared() > 0.0
}

/// Keeps the first of the triangles with the same corners, in any order.
fn drop_doubled(triangles: &mut Vec<[u32; 3]>) {
    let sorted = |t: &[u32; 3]| {
        let mut corners = *t;
        corners.sort_unstable();
        corners
    };
    let mut order: Vec<([u32; 3], usize)> =
        triangles.iter().enumerate().map(|(i, t)| (sorted(t), i)).collect();
    order.sort_unstable();
    let mut is_kept = vec![false; triangles.len()];
    for same in order.chunk_by(|a, b| a.0 == b.0) {
        is_kept[same[0].1] = true;
    }
    let mut kept = is_kept.iter();
    triangles.retain(|_| kept.next() == Some(&true));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::samples::{ball, both, without};

    /// Every corner a point of its own, as STL has it.
    fn loose(surface: &TriangleSurface) -> TriangleSurface {
        let corners = (0..surface.triangles().len()).flat_map(|t| surface.corners(t)).collect();
        let triangles = (0..surface.triangles().len() as u32).map(|t| [0, 1, 2].map(|c| 3 * t + c));
        TriangleSurface::try_new(corners, triangles.collect()).unwrap()
    }

    /// The surface with some triangles changed.
    fn changed(
        surface: &TriangleSurface,
        change: impl Fn(usize, [u32; 3]) -> Vec<[u32; 3]>,
    ) -> TriangleSurface {
        let triangles = surface.triangles().iter().enumerate();
        let changed = triangles.flat_map(|(i, t)| change(i, *t)).collect();
        TriangleSurface::try_new(surface.points().to_vec(), changed).unwrap()
    }

    #[test]
    fn sound_surface_stays_as_it_is() {
        let ball = ball(2, Point3::origin(), 1.0);
        let mended = MendedSurface::new(&loose(&ball)).unwrap();
        assert_eq!(mended.surface.points().len(), ball.points().len());
        let expected = SurfaceMending { triangles: 128, shells: 1, ..SurfaceMending::default() };
        assert_eq!(mended.mending, expected);
        assert!(mended.mending.is_closed());
        assert_eq!(mended.surface.signed_volume(), ball.signed_volume());
    }

    #[test]
    fn turned_doubled_and_flat_triangles_are_put_right() {
        let ball = ball(3, Point3::origin(), 1.0);
        let broken = changed(&ball, |i, [a, b, c]| match i % 10 {
            0 => vec![[a, c, b]],
            1 => vec![[a, b, c], [b, c, a]],
            2 => vec![[a, b, c], [a, a, b]],
            _ => vec![[a, b, c]],
        });
        let MendedSurface { surface, mending } = MendedSurface::new(&broken).unwrap();
        assert_eq!((mending.turned, mending.doubled, mending.without_area), (52, 52, 51));
        assert_eq!((mending.shells, mending.turned_shells), (1, 0));
        assert!(mending.is_closed());
        assert!((surface.signed_volume() - ball.signed_volume()).abs() < 1e-12);
    }

    #[test]
    fn ball_inside_out_is_turned_and_a_cavity_is_not() {
        let turn = |s: &TriangleSurface| changed(s, |_, [a, b, c]| vec![[a, c, b]]);
        let (outer, inner) = (ball(3, Point3::origin(), 1.0), ball(2, Point3::origin(), 0.5));
        let mended = MendedSurface::new(&both(&outer, &turn(&inner))).unwrap();
        assert_eq!((mended.mending.shells, mended.mending.turned_shells), (2, 0));
        let apart = ball(2, Point3::new(3.0, 0.0, 0.0), 0.5);
        let mended = MendedSurface::new(&both(&outer, &turn(&apart))).unwrap();
        assert_eq!((mended.mending.shells, mended.mending.turned_shells), (2, 1));
        let sum = outer.signed_volume() + apart.signed_volume();
        assert!((mended.surface.signed_volume() - sum).abs() < 1e-12);
    }

    #[test]
    fn holes_are_found_where_they_are() {
        let ball = ball(3, Point3::origin(), 1.0);
        let open = without(&ball, |t| {
            let [a, b, c] = ball.corners(t);
            (a.z + b.z + c.z) / 3.0 < 0.9
        });
        let mended = MendedSurface::new(&open).unwrap();
        let holes = &mended.mending.holes;
        assert_eq!((holes.len(), holes[0].edges), (1, mended.mending.open_edges));
        assert!((holes[0].centre - Point3::new(0.0, 0.0, 0.87)).norm() < 0.1);
        assert!(holes[0].rim > 2.0 && holes[0].rim < 4.5);
    }

    #[test]
    fn triangles_without_area_are_no_surface() {
        let line = vec![Point3::origin(), Point3::new(1.0, 0.0, 0.0), Point3::new(2.0, 0.0, 0.0)];
        let flat = TriangleSurface::try_new(line, vec![[0, 1, 2], [1, 1, 0]]).unwrap();
        assert_eq!(MendedSurface::new(&flat).unwrap_err(), SurfaceError::Empty);
    }
}
