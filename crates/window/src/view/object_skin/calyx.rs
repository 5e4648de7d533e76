//! The green of a strawberry: leaves that lie on its shoulders, and its stalk.

use std::f64::consts::TAU;

use nalgebra::{Point3, Vector3};

use super::anchor::Anchor;
use super::body::Body;
use super::part::{Part, SurfaceMaterial, single};
use crate::view::texture::Texture;

/// Leaves and stalk, fixed to the skin below them.
pub(super) struct Calyx {
    /// Anchor of each point of each leaf, and how far above the skin the point is, m.
    leaf_points: Vec<(Anchor, f64)>,
    /// Places of the leaf points in the picture of one leaf.
    leaf_uvs: Vec<[f32; 2]>,
    stalk: Option<Anchor>,
    scale: f64,
}

impl Calyx {
    /// Lays leaves on a fruit whose stalk's end is +Y.
    ///
    /// Units: m; `scale` is the fruit's height by that of a usual one.
    pub(super) fn new(body: &Body, rest: &[Point3<f64>], scale: f64) -> Self {
        let below = rest.iter().map(|p| p.y).fold(f64::INFINITY, f64::min) - scale;
        // A ray from below leaves the fruit on its upper side.
        let on_top = |x: f64, z: f64| {
            let origin = Point3::new(x, below, z);
            Anchor::on_ray(body.curved(), rest, &origin, &Vector3::y(), &Vector3::x())
        };
        let mut leaf_points = Vec::new();
        let mut leaf_uvs = Vec::new();
        for leaf in 0..LEAVES {
            let points = leaf_plan(leaf);
            let anchored: Vec<(Anchor, f64)> = points
                .iter()
                .filter_map(|p| {
                    let anchor = on_top(p.plan[0] * scale, p.plan[1] * scale)?;
                    Some((anchor, p.lift * scale))
                })
                .collect();
            // A leaf that hangs over the edge of a small fruit is left out whole.
            if anchored.len() == points.len() {
                leaf_points.extend(anchored);
                leaf_uvs.extend(points.iter().map(|p| p.uv));
            }
        }
        Self { leaf_points, leaf_uvs, stalk: on_top(0.0, 0.0), scale }
    }

    /// The leaves as something to draw; placed by [`Self::write_leaves`].
    ///
    /// Each leaf has an upper and a lower side, so that it is seen from everywhere.
    pub(super) fn leaves(&self) -> Part {
        let count = self.leaf_points.len() as u32;
        let mut triangles = Vec::new();
        for first in (0..count).step_by(PER_LEAF) {
            for row in 0..ROWS as u32 - 1 {
                for column in 0..COLUMNS as u32 - 1 {
                    let a = first + row * COLUMNS as u32 + column;
                    let (b, c, d) = (a + 1, a + COLUMNS as u32, a + COLUMNS as u32 + 1);
                    triangles.extend([[a, b, d], [a, d, c]]);
                    triangles.extend([[b, a, d], [d, a, c]].map(|t| t.map(|v| v + count)));
                }
            }
        }
        let uvs = [self.leaf_uvs.as_slice(), &self.leaf_uvs].concat();
        let texture = Texture::painted(64, 128, leaf_colour);
        let places = vec![[0.0; 3]; 2 * count as usize];
        let mut material = SurfaceMaterial::plain([1.0; 3], 0.55);
        material.subsurface = 0.3;
        material.texture = Some(texture);
        Part {
            name: "leaves",
            triangles,
            positions: places.clone(),
            normals: places,
            uvs,
            material,
        }
    }

    /// Lays the leaves on the skin as it is now.
    pub(super) fn write_leaves(&self, body: &Body, part: &mut Part) {
        let count = self.leaf_points.len();
        let points: Vec<Vector3<f64>> = self
            .leaf_points
            .iter()
            .map(|(anchor, lift)| {
                let frame = anchor.frame(body.curved());
                frame.origin + frame.normal * *lift
            })
            .collect();
        let mut normals = vec![Vector3::zeros(); count];
        for triangle in part.triangles.iter().filter(|t| (t[0] as usize) < count) {
            let [a, b, c] = triangle.map(|v| points[v as usize]);
            for &v in triangle {
                normals[v as usize] += (b - a).cross(&(c - a));
            }
        }
        for (i, (point, normal)) in points.iter().zip(&normals).enumerate() {
            let normal = normal.try_normalize(0.0).unwrap_or_else(Vector3::y);
            part.positions[i] = single(point);
            part.normals[i] = single(&normal);
            part.positions[i + count] = single(&(point - normal * (THICKNESS * self.scale)));
            part.normals[i + count] = single(&-normal);
        }
    }

    /// The stalk as something to draw; placed by [`Self::write_stalk`].
    pub(super) fn stalk(&self) -> Part {
        let (points, _) = self.stalk_points();
        let count = if self.stalk.is_some() { points.len() } else { 0 };
        let mut triangles = Vec::new();
        for ring in 0..STALK_RINGS.len() as u32 - 1 {
            for segment in 0..SEGMENTS {
                let at = |r: u32, s: u32| r * SEGMENTS + s % SEGMENTS;
                let [a, b] = [at(ring, segment), at(ring, segment + 1)];
                let [c, d] = [at(ring + 1, segment), at(ring + 1, segment + 1)];
                triangles.extend([[a, b, d], [a, d, c]]);
            }
        }
        triangles.retain(|_| count > 0);
        let places = vec![[0.0; 3]; count];
        Part {
            name: "stalk",
            triangles,
            positions: places.clone(),
            normals: places,
            uvs: vec![[0.0; 2]; count],
            material: SurfaceMaterial::plain([0.16, 0.33, 0.06], 0.6),
        }
    }

    /// Sets the stalk on the skin as it is now.
    pub(super) fn write_stalk(&self, body: &Body, part: &mut Part) {
        let Some(anchor) = &self.stalk else { return };
        let frame = anchor.frame(body.curved());
        let (points, normals) = self.stalk_points();
        for (i, (point, normal)) in points.iter().zip(&normals).enumerate() {
            part.positions[i] = single(&frame.point(point));
            part.normals[i] = single(&frame.direction(normal));
        }
    }

    /// Rings of the stalk about its anchor, with normals; the last ring closes the cut.
    fn stalk_points(&self) -> (Vec<Vector3<f64>>, Vec<Vector3<f64>>) {
        let mut points = Vec::new();
        let mut normals = Vec::new();
        for &(height, radius, lean) in &STALK_RINGS {
            for segment in 0..SEGMENTS {
                let angle = f64::from(segment) * TAU / f64::from(SEGMENTS);
                let out = Vector3::new(angle.cos(), angle.sin(), 0.0);
                let axis = Vector3::new(0.0, lean, height);
                points.push((axis + out * radius) * self.scale);
                normals.push(if radius > 0.0 { out } else { Vector3::z() });
            }
        }
        (points, normals)
    }
}

/// A point of a leaf seen from above.
struct LeafPoint {
    /// X and Z of the point, m.
    plan: [f64; 2],
    /// Height of the point above the skin, m.
    lift: f64,
    uv: [f32; 2],
}

/// A leaf of a usual fruit, from its root outward, row by row.
fn leaf_plan(leaf: usize) -> Vec<LeafPoint> {
    // No two leaves are quite the same.
    let vary = |n: f64| (leaf as f64 * n).sin();
    let angle = (leaf as f64 + 0.22 * vary(2.3)) * TAU / LEAVES as f64;
    let (outward, across) = ([angle.cos(), angle.sin()], [-angle.sin(), angle.cos()]);
    let length = LENGTH * (1.0 + 0.13 * vary(4.1));
    let curl = CURL * (1.0 + 0.45 * vary(1.7));
    let mut points = Vec::new();
    for row in 0..ROWS {
        let s = row as f64 / (ROWS - 1) as f64;
        // Widest before the middle, pointed at the end.
        let width = HALF_WIDTH * (0.35 + 2.6 * s * (1.0 - 0.55 * s)) * (1.0 - s.powi(3)).powf(0.9);
        for column in 0..COLUMNS {
            let c = 2.0 * column as f64 / (COLUMNS - 1) as f64 - 1.0;
            let sway = 0.0012 * vary(3.3) * s * s;
            let along = ROOT + length * s * (1.0 - 0.06 * c * c);
            let beside = width * c + sway;
            points.push(LeafPoint {
                plan: [0, 1].map(|d| outward[d] * along + across[d] * beside),
                // Folded along the middle; the tip curls away from the fruit.
                lift: 0.0006 + 0.0011 * s + curl * s.powi(3) + FOLD * c * c * (1.0 - s),
                uv: [(0.5 + 0.5 * c) as f32, s as f32],
            });
        }
    }
    points
}

/// Colour of a leaf across and along: veins light, tip dark.
fn leaf_colour(across: f64, along: f64) -> [f64; 3] {
    let from_middle = (2.0 * across - 1.0).abs();
    let rib = (-(from_middle / 0.07).powi(2)).exp();
    let vein = (40.0 * (along - 0.35 * from_middle)).sin().max(0.0).powi(6) * (1.0 - from_middle);
    let light = 0.55 * rib + 0.22 * vein;
    let dark = 0.35 * along + 0.25 * from_middle;
    let base = [0.36 - 0.16 * dark, 0.60 - 0.18 * dark, 0.16 - 0.06 * dark];
    let vein_colour = [0.62, 0.78, 0.36];
    [0, 1, 2].map(|i| base[i] + (vein_colour[i] - base[i]) * light)
}

const LEAVES: usize = 10;
const ROWS: usize = 10;
const COLUMNS: usize = 5;
const PER_LEAF: usize = ROWS * COLUMNS;
/// Distance of a leaf's root from the middle, m.
const ROOT: f64 = 0.0012;
const LENGTH: f64 = 0.0178;
const HALF_WIDTH: f64 = 0.0034;
/// How far the tip stands off, m.
const CURL: f64 = 0.0048;
/// How far the edges stand off, m.
const FOLD: f64 = 0.0009;
const THICKNESS: f64 = 0.0003;
const SEGMENTS: u32 = 12;
/// Height, radius and lean of the stalk's rings, m.
const STALK_RINGS: [(f64, f64, f64); 8] = [
    (-0.0010, 0.0032, 0.0),
    (0.0012, 0.0021, 0.0),
    (0.0045, 0.0016, 0.0004),
    (0.0085, 0.0014, 0.0014),
    (0.0120, 0.0014, 0.0030),
    (0.0145, 0.0017, 0.0046),
    (0.0147, 0.0015, 0.0047),
    (0.0148, 0.0, 0.0048),
];
