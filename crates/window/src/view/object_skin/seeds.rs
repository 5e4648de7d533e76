//! The seeds on a strawberry: small drops that ride on the skin.

use std::f64::consts::TAU;

use nalgebra::{Point3, Vector3};

use super::anchor::Anchor;
use super::body::{Body, SpreadBody};
use super::part::{Part, SurfaceMaterial, single};
use crate::view::texture::Texture;

/// Seeds, evenly spread, each fixed to the surface.
pub(super) struct Seeds {
    anchors: Vec<Anchor>,
    drop: Drop,
}

/// One seed about its anchor: aside, ahead, out of the surface.
struct Drop {
    points: Vec<Vector3<f64>>,
    normals: Vec<Vector3<f64>>,
    triangles: Vec<[u32; 3]>,
}

impl Seeds {
    /// Spreads seeds over a fruit whose stalk's end is +Y.
    ///
    /// They follow the spiral in which plants set seeds: each a golden angle further round, and
    /// higher by an equal share of the area.
    ///
    /// Units: `scale` is the fruit's height by that of a usual one.
    pub(super) fn new(body: &Body, spread: &SpreadBody, rest: &[Point3<f64>], scale: f64) -> Self {
        let areas = spread.area_by_height(&body.triangles);
        let total = areas.last().map_or(0.0, |a| a.1);
        let [low, high] = [areas.first(), areas.last()].map(|a| a.map_or(0.0, |a| a.0));
        let anchors = (0..SEEDS)
            .filter_map(|k| {
                let wanted = (k as f64 + 0.5) / SEEDS as f64 * total;
                let y = areas[areas.partition_point(|a| a.1 < wanted).min(areas.len() - 1)].0;
                // Under the leaves nobody looks, and the top is no slope to stand on.
                if (y - low) / (high - low) > SEEDS_END {
                    return None;
                }
                let angle = k as f64 * TAU * GOLDEN;
                let direction = Vector3::new(angle.cos(), 0.0, angle.sin());
                let origin = Point3::new(0.0, y, 0.0);
                Anchor::on_ray(body.curved(), rest, &origin, &direction, &Vector3::y())
            })
            .collect();
        Self { anchors, drop: Drop::new(scale) }
    }

    /// Where the seeds sit. Units: m.
    pub(super) fn places(&self, body: &Body) -> Vec<Vector3<f64>> {
        self.anchors.iter().map(|a| a.frame(body.curved()).origin).collect()
    }

    /// The seeds as something to draw; their vertices are placed by [`Self::write`].
    pub(super) fn part(&self) -> Part {
        let per_seed = self.drop.points.len() as u32;
        let count = self.anchors.len() as u32;
        let triangles = (0..count)
            .flat_map(|s| self.drop.triangles.iter().map(move |t| t.map(|v| v + s * per_seed)))
            .collect();
        let height = self.drop.points.iter().map(|p| p.z).fold(0.0, f64::max);
        let uvs = (0..count)
            .flat_map(|s| {
                // No two neighbours have the same shade.
                let shade = (f64::from(s) * 0.754_877).fract();
                let up = |p: &Vector3<f64>| (p.z / height).clamp(0.02, 0.98) as f32;
                self.drop.points.iter().map(move |p| [shade as f32, up(p)])
            })
            .collect();
        let texture = Texture::painted(16, 16, |shade, up| {
            let gold = [0.93 - 0.10 * shade, 0.72 - 0.16 * shade, 0.24 - 0.06 * shade];
            let rim = [0.62, 0.26, 0.08];
            [0, 1, 2].map(|i| rim[i] + (gold[i] - rim[i]) * (up * 1.6).min(1.0))
        });
        let places = vec![[0.0; 3]; (count * per_seed) as usize];
        let mut material = SurfaceMaterial::plain([1.0; 3], 0.38);
        material.clearcoat = (0.5, 0.15);
        material.texture = Some(texture);
        Part { name: "seeds", triangles, positions: places.clone(), normals: places, uvs, material }
    }

    /// Moves the seeds to where the surface is now.
    pub(super) fn write(&self, body: &Body, part: &mut Part) {
        let per_seed = self.drop.points.len();
        let places = part.positions.chunks_mut(per_seed).zip(part.normals.chunks_mut(per_seed));
        for (anchor, (positions, normals)) in self.anchors.iter().zip(places) {
            let frame = anchor.frame(body.curved());
            for i in 0..per_seed {
                positions[i] = single(&frame.point(&self.drop.points[i]));
                normals[i] = single(&frame.direction(&self.drop.normals[i]));
            }
        }
    }
}

impl Drop {
    /// A flattened drop, pointed towards the stalk, its lower half left out.
    fn new(scale: f64) -> Self {
        let (mut points, mut normals, mut triangles) = (vec![], vec![], vec![]);
        for ring in RINGS {
            for segment in 0..SEGMENTS {
                let angle = f64::from(segment) * TAU / f64::from(SEGMENTS);
                let (x, y) = (angle.cos() * (1.0 - 0.38 * angle.sin()), angle.sin());
                let p = Vector3::new(
                    HALF_WIDTH * ring.0 * x,
                    HALF_LENGTH * ring.0 * y,
                    HEIGHT * ring.1 - SUNK,
                );
                // The gradient of the ellipsoid that the dome is a part of.
                let gradient = Vector3::new(
                    ring.0 * angle.cos() / HALF_WIDTH,
                    ring.0 * angle.sin() / HALF_LENGTH,
                    ring.1.max(0.0) / HEIGHT,
                );
                points.push(p * scale);
                normals.push(gradient.normalize());
            }
        }
        let top = points.len() as u32;
        points.push(Vector3::new(0.0, 0.0, HEIGHT - SUNK) * scale);
        normals.push(Vector3::z());
        for ring in 0..RINGS.len() as u32 - 1 {
            for segment in 0..SEGMENTS {
                let at = |r: u32, s: u32| r * SEGMENTS + s % SEGMENTS;
                let [a, b] = [at(ring, segment), at(ring, segment + 1)];
                let [c, d] = [at(ring + 1, segment), at(ring + 1, segment + 1)];
                triangles.extend([[a, b, d], [a, d, c]]);
            }
        }
        let last = (RINGS.len() as u32 - 1) * SEGMENTS;
        for segment in 0..SEGMENTS {
            triangles.push([last + segment, last + (segment + 1) % SEGMENTS, top]);
        }
        Self { points, normals, triangles }
    }
}

/// Seeds on the whole fruit; those right below the leaves are left out.
const SEEDS: usize = 220;
/// The golden section of a turn.
const GOLDEN: f64 = 0.381_966_011_250_105;
/// Height, as a part of the fruit's, where the leaves begin.
const SEEDS_END: f64 = 0.988;
/// Rings of a seed from below the skin to its top: radius and height, 1 for its own.
const RINGS: [(f64, f64); 4] = [(1.0, -0.4), (1.0, 0.1), (0.82, 0.57), (0.45, 0.89)];
const SEGMENTS: u32 = 8;
const HALF_LENGTH: f64 = 0.001_30;
const HALF_WIDTH: f64 = 0.000_85;
const HEIGHT: f64 = 0.000_75;
/// How deep a seed sits in the skin.
const SUNK: f64 = 0.000_34;
