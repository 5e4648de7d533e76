//! The screw cap of a tube: stiff, ribbed, and where the nozzle is.

use std::f64::consts::TAU;

use nalgebra::{Matrix3, Point3, Vector3};

use super::part::{Part, SurfaceMaterial, single};
use super::tube_profile::TubeProfile;

/// A cap that moves with the nodes of a nozzle as one stiff piece.
pub(super) struct Cap {
    /// Nodes of the nozzle, and where they are at rest about their middle.
    nodes: Vec<u32>,
    rest: Vec<Vector3<f64>>,
    /// The cap about that middle at rest.
    points: Vec<Vector3<f64>>,
    normals: Vec<Vector3<f64>>,
}

impl Cap {
    /// A cap for the nozzle at the −X end of a tube; `None` if that end is no nozzle.
    ///
    /// Units: m.
    pub(super) fn new(
        vertices: &[Point3<f64>],
        nodes: &[u32],
        profile: &TubeProfile,
    ) -> Option<Self> {
        let length = profile.high - profile.low;
        let end = profile.low + NOZZLE * length;
        let nodes: Vec<u32> =
            nodes.iter().copied().filter(|n| vertices[*n as usize].x <= end).collect();
        let middle = middle_of(vertices, &nodes);
        let radius = |n: &u32| {
            let p = vertices[*n as usize].coords - middle;
            p.y.hypot(p.z)
        };
        let inner = nodes.iter().map(radius).fold(0.0, f64::max);
        let body = profile.half_extents(profile.low + 0.3 * length);
        if nodes.len() < 4 || inner > NOZZLE_SHARE * body[0].max(body[1]) {
            return None;
        }
        let rest = nodes.iter().map(|n| vertices[*n as usize].coords - middle).collect();
        let front = profile.low - 0.013 * length - middle.x;
        let (points, normals) = rings(front, end - middle.x, 1.04 * inner + 0.012 * length, length);
        Some(Self { nodes, rest, points, normals })
    }

    /// The cap as something to draw; placed by [`Self::write`].
    pub(super) fn part(&self) -> Part {
        let count = self.points.len() as u32;
        let at = |ring: u32, s: u32| ring * SEGMENTS + s % SEGMENTS;
        let quads =
            (0..count / SEGMENTS / 2).flat_map(|band| (0..SEGMENTS).map(move |s| (2 * band, s)));
        let triangles = quads
            .flat_map(|(ring, s)| {
                let [a, b] = [at(ring, s), at(ring, s + 1)];
                let [c, d] = [at(ring + 1, s), at(ring + 1, s + 1)];
                [[b, a, d], [d, a, c]]
            })
            .collect();
        let places = vec![[0.0; 3]; count as usize];
        let mut material = SurfaceMaterial::plain([0.02, 0.36, 0.36], 0.42);
        material.clearcoat = (0.3, 0.2);
        Part {
            name: "cap",
            triangles,
            positions: places.clone(),
            normals: places,
            uvs: vec![[0.0; 2]; count as usize],
            material,
        }
    }

    /// Moves the cap to where the nozzle is.
    pub(super) fn write(&self, shape: &[Point3<f64>], part: &mut Part) {
        let middle = middle_of(shape, &self.nodes);
        let mut spread = Matrix3::zeros();
        for (node, rest) in self.nodes.iter().zip(&self.rest) {
            spread += (shape[*node as usize].coords - middle) * rest.transpose();
        }
        let turn = nearest_rotation(&spread);
        for i in 0..self.points.len() {
            part.positions[i] = single(&(turn * self.points[i] + middle));
            part.normals[i] = single(&(turn * self.normals[i]));
        }
    }
}

fn middle_of(vertices: &[Point3<f64>], nodes: &[u32]) -> Vector3<f64> {
    let sum: Vector3<f64> = nodes.iter().map(|n| vertices[*n as usize].coords).sum();
    sum / nodes.len() as f64
}

/// The rotation that carries the rest places to the present ones best.
///
/// Source: Kabsch, "A solution for the best rotation to relate two sets of vectors", 1976.
fn nearest_rotation(spread: &Matrix3<f64>) -> Matrix3<f64> {
    let svd = spread.svd(true, true);
    let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else { return Matrix3::identity() };
    let mut mirror = Matrix3::identity();
    mirror[(2, 2)] = (u * v_t).determinant().signum();
    u * mirror * v_t
}

/// Bands of the cap, two rings each so that edges between bands are sharp.
fn rings(
    front: f64,
    back: f64,
    radius: f64,
    length: f64,
) -> (Vec<Vector3<f64>>, Vec<Vector3<f64>>) {
    let bevel = 0.006 * length;
    let rib = 0.0035 * length;
    // Where along X, how wide, how deep the ribs: from the open end over the side to the front.
    let outline = [
        (back, radius - 0.01 * length, 0.0),
        (back, radius + 0.3 * rib, 0.0),
        (back - 0.10 * (back - front), radius + 0.3 * rib, 0.0),
        (back - 0.13 * (back - front), radius, 1.0),
        (front + 1.6 * bevel, radius, 1.0),
        (front + bevel, radius - 0.2 * bevel, 0.0),
        (front + 0.3 * bevel, radius - 0.75 * bevel, 0.0),
        (front, radius - 1.7 * bevel, 0.0),
        (front, radius - 3.2 * bevel, 0.0),
        (front + 0.35 * bevel, radius - 3.6 * bevel, 0.0),
        (front + 0.35 * bevel, 0.0, 0.0),
    ];
    let at = |(x, r, ribbed): (f64, f64, f64), segment: u32| {
        let angle = f64::from(segment) * TAU / f64::from(SEGMENTS);
        let wave = (angle * RIBS).cos();
        let wide = r + ribbed * rib * wave.signum() * wave.abs().powf(0.4) - ribbed * rib;
        Vector3::new(x, wide * angle.cos(), wide * angle.sin())
    };
    let (mut points, mut normals) = (vec![], vec![]);
    for band in outline.windows(2) {
        for ring in band {
            for segment in 0..SEGMENTS {
                // Normals from the neighbours around and along, so that ribs catch the light.
                let around = at(*ring, segment + 1) - at(*ring, segment + SEGMENTS - 1);
                let along = at(band[1], segment) - at(band[0], segment);
                let normal = along.cross(&around).try_normalize(0.0);
                points.push(at(*ring, segment));
                normals.push(normal.unwrap_or_else(|| -Vector3::x()));
            }
        }
    }
    (points, normals)
}

/// Part of a tube that the cap covers.
const NOZZLE: f64 = 0.088;
/// An end wider than this part of the body is no nozzle.
const NOZZLE_SHARE: f64 = 0.8;
const SEGMENTS: u32 = 144;
const RIBS: f64 = 24.0;

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    #[test]
    fn rotation_is_found_again_from_the_points_it_moved() {
        let turn = Rotation3::from_euler_angles(0.4, -0.9, 2.1);
        let mut spread = Matrix3::zeros();
        for p in [[1.0, 0.2, 0.0], [0.1, -0.7, 0.3], [-0.4, 0.5, 0.9], [0.0, 0.1, -1.0]] {
            let p = Vector3::from(p);
            spread += (turn * p) * p.transpose();
        }
        assert!((nearest_rotation(&spread) - turn.matrix()).norm() < 1e-12);
    }
}
