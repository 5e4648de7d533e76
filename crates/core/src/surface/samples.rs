//! Surfaces that tests start from.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};

use super::TriangleSurface;

/// An octahedron whose triangles were cut in four `cuts` times, blown up to a ball.
pub(crate) fn ball(cuts: usize, centre: Point3<f64>, radius: f64) -> TriangleSurface {
    let (x, y, z) = (Vector3::x(), Vector3::y(), Vector3::z());
    let mut points = vec![x, -x, y, -y, z, -z];
    let mut triangles: Vec<[u32; 3]> = vec![
        [0, 2, 4],
        [2, 1, 4],
        [1, 3, 4],
        [3, 0, 4],
        [2, 0, 5],
        [1, 2, 5],
        [3, 1, 5],
        [0, 3, 5],
    ];
    for _ in 0..cuts {
        let mut middles = BTreeMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                points.push((points[a as usize] + points[b as usize]).normalize());
                points.len() as u32 - 1
            })
        };
        triangles = triangles
            .iter()
            .flat_map(|&[a, b, c]| {
                let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    let points = points.iter().map(|p| centre + p * radius).collect();
    TriangleSurface::try_new(points, triangles).unwrap()
}

/// The triangles for which `keep` is true.
pub(crate) fn without(surface: &TriangleSurface, keep: impl Fn(usize) -> bool) -> TriangleSurface {
    let kept = (0..surface.triangles().len()).filter(|t| keep(*t));
    let triangles = kept.map(|t| surface.triangles()[t]).collect();
    TriangleSurface::try_new(surface.points().to_vec(), triangles).unwrap()
}

/// Both surfaces in one list.
pub(crate) fn both(a: &TriangleSurface, b: &TriangleSurface) -> TriangleSurface {
    let shift = a.points().len() as u32;
    let points = [a.points(), b.points()].concat();
    let moved = b.triangles().iter().map(|t| t.map(|n| n + shift));
    let triangles = a.triangles().iter().copied().chain(moved).collect();
    TriangleSurface::try_new(points, triangles).unwrap()
}

/// A box with two triangles a side, its lowest corner at `low`.
pub(crate) fn cuboid(low: Point3<f64>, size: Vector3<f64>) -> TriangleSurface {
    let points = (0..8).map(|corner| {
        let bit = |d: usize| f64::from(corner >> d & 1);
        low + Vector3::new(bit(0) * size.x, bit(1) * size.y, bit(2) * size.z)
    });
    let quads: [[u32; 4]; 6] =
        [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    TriangleSurface::try_new(points.collect(), triangles).unwrap()
}
