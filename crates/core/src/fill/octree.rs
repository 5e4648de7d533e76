//! Cubes that are halved where small ones are wanted, neighbours differing by one halving at most.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};

/// Halvings of the largest cubes at most.
pub(super) const LEVELS: u8 = 4;
/// Halvings of the largest cubes that give those of the size asked for.
pub(super) const SKIN_LEVEL: u8 = 2;
/// Lattice steps along the largest cubes; the smallest have two, so that their centres are on it.
const LARGEST: i32 = 2 << LEVELS;

/// A place on the lattice of the smallest cubes' corners and centres: z, y, x.
pub(super) type Key = [i32; 3];

/// Cubes without overlap, each known by its lowest corner.
///
/// Frame: the surface's. `step` is half the edge of the smallest cubes.
#[derive(Clone, Debug)]
pub(super) struct Octree {
    origin: Point3<f64>,
    step: f64,
    leaves: BTreeMap<Key, u8>,
}

impl Octree {
    /// Cubes over the box `low` to `high` and at least a quarter of the largest cube around it.
    ///
    /// `spacing` is the edge after [`SKIN_LEVEL`] halvings; `shift` moves the cubes, in largest ones,
    /// each in 0..1. `wanted` is asked for the largest edge at a cube's centre, within a distance.
    pub(super) fn new(
        (low, high): (Point3<f64>, Point3<f64>),
        spacing: f64,
        shift: [f64; 3],
        wanted: impl Fn(&Point3<f64>, f64) -> f64,
    ) -> Self {
        let largest = spacing * f64::from(1 << SKIN_LEVEL);
        let margin = Vector3::repeat(0.25) + Vector3::from(shift);
        let origin = low - margin * largest;
        let step = largest / f64::from(LARGEST);
        let counts = [2, 1, 0].map(|d| ((high[d] - origin[d]) / largest + 0.25).floor() as i32 + 1);
        let mut tree = Self { origin, step, leaves: BTreeMap::new() };
        for z in 0..counts[0] {
            for y in 0..counts[1] {
                for x in 0..counts[2] {
                    tree.add([z, y, x].map(|i| i * LARGEST), 0, &wanted);
                }
            }
        }
        tree.balance();
        tree
    }

    /// Adds a cube, halved as often as wanted.
    fn add(&mut self, key: Key, level: u8, wanted: &impl Fn(&Point3<f64>, f64) -> f64) {
        let half = Self::length(level) / 2;
        let edge = f64::from(2 * half) * self.step;
        if level < LEVELS {
            let centre = self.position(key.map(|i| i + half));
            if wanted(&centre, 0.5 * 3f64.sqrt() * edge) < edge {
                for child in children(key, half) {
                    self.add(child, level + 1, wanted);
                }
                return;
            }
        }
        self.leaves.insert(key, level);
    }

    /// Halves cubes until neighbours, those at an edge or a corner too, differ by one halving.
    fn balance(&mut self) {
        let mut waiting: Vec<Key> = self.leaves.keys().copied().collect();
        while let Some(key) = waiting.pop() {
            let Some(&level) = self.leaves.get(&key) else { continue };
            for around in self.around(key, level) {
                let Some((other, other_level)) = self.leaf_at(around) else { continue };
                if other_level + 1 < level {
                    self.leaves.remove(&other);
                    for child in children(other, Self::length(other_level) / 2) {
                        self.leaves.insert(child, other_level + 1);
                        waiting.push(child);
                    }
                    waiting.push(key);
                }
            }
        }
    }

    /// The lowest corners of the 26 cubes of the same size around one.
    fn around(&self, key: Key, level: u8) -> impl Iterator<Item = Key> + use<> {
        let length = Self::length(level);
        (0..27).filter(|i| *i != 13).map(move |i| {
            [
                key[0] + (i / 9 - 1) * length,
                key[1] + (i / 3 % 3 - 1) * length,
                key[2] + (i % 3 - 1) * length,
            ]
        })
    }

    /// The cube that a place lies in (at its lowest corner, where it lies between cubes).
    pub(super) fn leaf_at(&self, place: Key) -> Option<(Key, u8)> {
        (0..=LEVELS).find_map(|level| {
            let length = Self::length(level);
            let key = place.map(|i| i.div_euclid(length) * length);
            self.leaves.get(&key).filter(|l| **l == level).map(|l| (key, *l))
        })
    }

    /// All cubes and their halvings, in the order of their places.
    pub(super) fn leaves(&self) -> impl Iterator<Item = (Key, u8)> {
        self.leaves.iter().map(|(key, level)| (*key, *level))
    }

    /// Lattice steps along a cube.
    pub(super) fn length(level: u8) -> i32 {
        LARGEST >> level
    }

    /// Edge of a cube.
    pub(super) fn edge(&self, level: u8) -> f64 {
        f64::from(Self::length(level)) * self.step
    }

    /// Coordinates of a place.
    pub(super) fn position(&self, key: Key) -> Point3<f64> {
        self.origin
            + Vector3::new(f64::from(key[2]), f64::from(key[1]), f64::from(key[0])) * self.step
    }
}

fn children(key: Key, half: i32) -> impl Iterator<Item = Key> {
    (0..8).map(move |c| [0, 1, 2].map(|d| key[d] + (c >> d & 1) * half))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Small cubes wanted along a curve.
    fn tree() -> Octree {
        let bounds = (Point3::origin(), Point3::new(1.0, 0.5, 0.7));
        Octree::new(bounds, 0.05, [0.3, 0.8, 0.1], |p, distance| {
            let off = Vector3::new(p.x - 0.5, p.y - 0.2, p.z - 0.3 * p.x).norm() - 0.2;
            match off.abs() < distance {
                true if p.x < 0.4 => 0.02,
                true => 0.05,
                false => f64::INFINITY,
            }
        })
    }

    #[test]
    fn neighbours_differ_by_one_halving() {
        let tree = tree();
        let mut levels = [0; 5];
        for (key, level) in tree.leaves() {
            levels[usize::from(level)] += 1;
            for around in tree.around(key, level) {
                if let Some((_, other)) = tree.leaf_at(around) {
                    assert!(other + 1 >= level);
                }
            }
        }
        assert!(levels.iter().all(|count| *count > 0), "{levels:?}");
    }

    #[test]
    fn cubes_fill_their_box_once() {
        let tree = tree();
        let volume: f64 = tree.leaves().map(|(_, level)| tree.edge(level).powi(3)).sum();
        let boxes = volume / 0.2f64.powi(3);
        assert!((boxes - boxes.round()).abs() < 1e-9);
        let mut low = Point3::from([f64::INFINITY; 3]);
        let mut high = Point3::from([f64::NEG_INFINITY; 3]);
        for (key, level) in tree.leaves() {
            low = low.inf(&tree.position(key));
            high = high.sup(&tree.position(key.map(|i| i + Octree::length(level))));
        }
        assert!(((high - low).product() - volume).abs() < 1e-9);
        assert!(low.iter().all(|c| *c <= -0.05 + 1e-12));
        assert!(high.x >= 1.05 - 1e-12 && high.y >= 0.55 - 1e-12 && high.z >= 0.75 - 1e-12);
    }
}
