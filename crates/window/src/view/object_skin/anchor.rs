//! A place on the surface on which something hangs, and the coordinate frame it has there.

use nalgebra::{Point3, Vector3};

use super::curved_surface::{CurvedSurface, PlaceWeights};
use crate::view::ray_hit::ray_hit;

/// A place on the curved surface, with a direction along it.
pub(super) struct Anchor {
    triangle: u32,
    at: PlaceWeights,
    /// A place near by, towards which the direction points.
    ahead: PlaceWeights,
}

/// The coordinate frame of an anchor now: a point and three unit vectors, right-handed.
///
/// Units: m. Frame: the object's.
pub(super) struct AnchorFrame {
    pub(super) origin: Vector3<f64>,
    /// Direction out of the surface.
    pub(super) normal: Vector3<f64>,
    /// Direction along the surface, where the anchor was told to look.
    pub(super) ahead: Vector3<f64>,
    /// Direction `ahead` × `normal`.
    pub(super) aside: Vector3<f64>,
}

impl Anchor {
    /// The outermost place of the surface on a ray, looking along `ahead`.
    ///
    /// `None` if the ray misses. Frame: the rest shape's.
    pub(super) fn on_ray(
        surface: &CurvedSurface,
        rest: &[Point3<f64>],
        origin: &Point3<f64>,
        direction: &Vector3<f64>,
        ahead: &Vector3<f64>,
    ) -> Option<Self> {
        let count = surface.creased().corners.len();
        let hits = (0..count).filter_map(|t| {
            let corners = surface.creased().nodes_of(t).map(|n| rest[n as usize]);
            ray_hit(&corners, origin, direction).map(|(distance, linear)| (distance, t, linear))
        });
        let (_, triangle, linear) = hits.max_by(|a, b| a.0.total_cmp(&b.0))?;
        let corners = surface.creased().nodes_of(triangle).map(|n| rest[n as usize]);
        let step = barycentric_step(&corners, ahead).map(|s| s * AHEAD);
        let near = [0, 1, 2].map(|i| linear[i] + step[i]);
        Some(Self {
            triangle: triangle as u32,
            at: PlaceWeights::new(linear),
            ahead: PlaceWeights::new(near),
        })
    }

    /// The coordinate frame of the anchor on the surface as it is now.
    pub(super) fn frame(&self, surface: &CurvedSurface) -> AnchorFrame {
        let origin = surface.point(self.triangle, &self.at);
        let normal = surface.normal(self.triangle, &self.at);
        let towards = surface.point(self.triangle, &self.ahead) - origin;
        let ahead = (towards - normal * towards.dot(&normal))
            .try_normalize(1e-12)
            .unwrap_or_else(|| any_perpendicular(&normal));
        AnchorFrame { origin, normal, ahead, aside: ahead.cross(&normal) }
    }
}

impl AnchorFrame {
    /// A direction given by its parts aside, ahead and along the normal.
    pub(super) fn direction(&self, local: &Vector3<f64>) -> Vector3<f64> {
        self.aside * local.x + self.ahead * local.y + self.normal * local.z
    }

    /// A point given by its parts aside, ahead and along the normal.
    pub(super) fn point(&self, local: &Vector3<f64>) -> Vector3<f64> {
        self.origin + self.direction(local)
    }
}

/// Change of barycentric coordinates that goes along a direction, as far as it lies in the plane.
fn barycentric_step([a, b, c]: &[Point3<f64>; 3], direction: &Vector3<f64>) -> [f64; 3] {
    let (side_b, side_c) = (b - a, c - a);
    let normal = side_b.cross(&side_c);
    let square = normal.norm_squared().max(f64::MIN_POSITIVE);
    let v = direction.cross(&side_c).dot(&normal) / square;
    let w = side_b.cross(direction).dot(&normal) / square;
    let length = v.abs().max(w.abs()).max(f64::MIN_POSITIVE);
    [-(v + w) / length, v / length, w / length]
}

fn any_perpendicular(normal: &Vector3<f64>) -> Vector3<f64> {
    let axis = if normal.x.abs() < 0.7 { Vector3::x() } else { Vector3::y() };
    normal.cross(&axis).normalize()
}

/// Step from an anchor to the place ahead of it, in barycentric coordinates.
const AHEAD: f64 = 0.02;

#[cfg(test)]
mod tests {
    use super::super::crease::CreasedSurface;
    use super::*;
    use softgrasp_core::mesh::{BuiltIn, Surface, generate};

    #[test]
    fn anchor_on_a_cube_stands_where_the_ray_leaves_and_looks_ahead() {
        let mesh = generate(BuiltIn::Cube, 125).unwrap();
        let surface = Surface::from_mesh(&mesh);
        let creased = CreasedSurface::new(mesh.vertices(), &surface.triangles, 0.7);
        let curved = CurvedSurface::new(creased, mesh.vertices());
        let (origin, direction) = (Point3::new(0.0, 0.004, 0.001), Vector3::x());
        let anchor =
            Anchor::on_ray(&curved, mesh.vertices(), &origin, &direction, &Vector3::y()).unwrap();
        let frame = anchor.frame(&curved);
        assert!((frame.origin - Vector3::new(0.03, 0.004, 0.001)).norm() < 1e-9);
        assert!((frame.normal - Vector3::x()).norm() < 1e-9);
        assert!((frame.ahead - Vector3::y()).norm() < 1e-9);
        let local = Vector3::new(0.3, -0.2, 0.9);
        let expected = frame.aside * 0.3 - frame.ahead * 0.2 + frame.normal * 0.9;
        assert!((frame.direction(&local) - expected).norm() < 1e-9);
    }
}
