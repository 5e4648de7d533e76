//! Which triangles of a surface bound its inside, and how thick the body is behind each.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::surface::{SurfaceTree, TriangleSurface};

/// A surface whose triangles are small against it, with what each of them bounds.
///
/// Shapes: `is_skin` and `thickness` one entry a triangle.
#[derive(Clone, Debug)]
pub(super) struct Skin {
    pub(super) surface: TriangleSurface,
    pub(super) tree: SurfaceTree,
    /// Inside on one side and outside on the other. Parts of shells that lie in other shells, and
    /// sheets, are no skin.
    pub(super) is_skin: Vec<bool>,
    /// Way through the body from the triangle's middle; infinite where it is not found.
    pub(super) thickness: Vec<f64>,
}

impl Skin {
    /// Cuts long triangles in pieces and looks at both sides of each.
    pub(super) fn new(surface: &TriangleSurface) -> Self {
        let surface = divided(surface, surface.size() / PIECES);
        let tree = SurfaceTree::new(&surface);
        let small = NEAR * surface.size();
        let judged: Vec<(bool, f64)> = (0..surface.triangles().len())
            .into_par_iter()
            .map(|t| judge(&tree, &surface.corners(t), small))
            .collect();
        let (is_skin, thickness) = judged.into_iter().unzip();
        Self { surface, tree, is_skin, thickness }
    }

    /// Area of all skin.
    pub(super) fn area(&self) -> f64 {
        let skin = (0..self.is_skin.len()).filter(|t| self.is_skin[*t]);
        skin.map(|t| 0.5 * normal(&self.surface.corners(t)).norm()).sum()
    }
}

/// Whether a point is inside.
pub(super) fn is_inside(tree: &SurfaceTree, point: &Point3<f64>) -> bool {
    tree.winding(point) > 0.5
}

fn normal([a, b, c]: &[Point3<f64>; 3]) -> Vector3<f64> {
    (b - a).cross(&(c - a))
}

fn judge(tree: &SurfaceTree, corners: &[Point3<f64>; 3], small: f64) -> (bool, f64) {
    let middle = Point3::from((corners[0].coords + corners[1].coords + corners[2].coords) / 3.0);
    let inward = -normal(corners).normalize();
    let is_skin =
        is_inside(tree, &(middle + inward * small)) && !is_inside(tree, &(middle - inward * small));
    if !is_skin {
        return (false, f64::INFINITY);
    }
    let exit = tree
        .hits(&middle, &inward)
        .into_iter()
        .filter(|hit| hit.leaves && hit.at > 2.0 * small)
        .take(EXITS_TRIED)
        .find(|hit| !is_inside(tree, &(middle + inward * (hit.at + small))));
    (true, exit.map_or(f64::INFINITY, |hit| hit.at))
}

/// The surface with its triangles cut in four, until no edge is longer than `longest` or there are many.
fn divided(surface: &TriangleSurface, longest: f64) -> TriangleSurface {
    let mut points = surface.points().to_vec();
    let mut done = Vec::new();
    let mut waiting: Vec<[u32; 3]> = surface.triangles().iter().rev().copied().collect();
    while let Some(triangle) = waiting.pop() {
        let [a, b, c] = triangle.map(|n| points[n as usize]);
        let edge = (b - a).norm().max((c - b).norm()).max((a - c).norm());
        if edge <= longest || done.len() + waiting.len() > surface.triangles().len() + PIECES_MAX {
            done.push(triangle);
            continue;
        }
        let first = points.len() as u32;
        points.extend([
            nalgebra::center(&a, &b),
            nalgebra::center(&b, &c),
            nalgebra::center(&c, &a),
        ]);
        let ([a, b, c], [ab, bc, ca]) = (triangle, [first, first + 1, first + 2]);
        waiting.extend([[ab, bc, ca], [ca, bc, c], [ab, b, bc], [a, ab, ca]]);
    }
    TriangleSurface::try_new(points, done).expect("points between finite points are finite")
}

/// Pieces along the surface into which long triangles are cut.
const PIECES: f64 = 24.0;
/// Triangles that cutting adds at most.
const PIECES_MAX: usize = 60_000;
/// Distance from a triangle at which its two sides are looked at, in sizes of the surface.
const NEAR: f64 = 1e-5;
/// Triangles along a ray that are tried as its exit from the body.
const EXITS_TRIED: usize = 16;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::samples::{ball, both, cuboid};

    #[test]
    fn plate_is_as_thick_as_it_is() {
        let plate = cuboid(Point3::origin(), Vector3::new(1.0, 1.0, 0.05));
        let skin = Skin::new(&plate);
        assert!(skin.surface.triangles().len() > 1000);
        assert!((skin.surface.signed_volume() - 0.05).abs() < 1e-12);
        assert!(skin.is_skin.iter().all(|s| *s));
        for t in 0..skin.is_skin.len() {
            let normal = normal(&skin.surface.corners(t)).normalize();
            let expected = if normal.z.abs() > 0.5 { 0.05 } else { 1.0 };
            assert!((skin.thickness[t] - expected).abs() < 1e-9);
        }
        assert!((skin.area() - 2.2).abs() < 1e-9);
    }

    #[test]
    fn what_lies_inside_another_shell_is_no_skin() {
        let (one, two) = (ball(4, Point3::origin(), 1.0), ball(4, Point3::new(1.0, 0.0, 0.0), 1.0));
        let skin = Skin::new(&both(&one, &two));
        for t in 0..skin.is_skin.len() {
            let [a, b, c] = skin.surface.corners(t);
            let middle = (a.coords + b.coords + c.coords) / 3.0;
            let is_of_first = (middle.norm() - 1.0).abs() < 0.03;
            let other = if is_of_first { middle - Vector3::x() } else { middle };
            if (other.norm() - 1.0).abs() > 0.05 {
                assert_eq!(skin.is_skin[t], other.norm() > 1.0);
            }
            // Through both: the way does not end where the second shell begins.
            assert!(!skin.is_skin[t] || skin.thickness[t] > 0.1);
        }
        // Two caps of a sphere with the plane between at 0.5.
        let expected = 2.0 * std::f64::consts::TAU * 1.5;
        assert!((skin.area() / expected - 1.0).abs() < 0.03, "{}", skin.area());
    }
}
