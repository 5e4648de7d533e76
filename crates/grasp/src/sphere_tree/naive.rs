//! Answers every question to the tree by looking at every vertex, to compare with in tests.

use nalgebra::{Point3, Vector3};

use super::tree::{Closeness, SphereTree};
use crate::shape::{Cylinder, Sphere};

/// Finger-like solid.
#[derive(Clone, Copy, Debug)]
pub(super) enum Probe {
    Cylinder(Cylinder),
    Sphere(Sphere),
}

/// Distance from a point to the solid probe, 0 inside.
pub(super) fn distance(probe: &Probe, point: &Point3<f64>) -> f64 {
    match probe {
        Probe::Sphere(s) => ((point - s.centre).norm() - s.radius).max(0.0),
        Probe::Cylinder(c) => {
            let from_base = point - c.base;
            let z = from_base.dot(&c.axis);
            let d_min = from_base.cross(&c.axis).norm();
            let along = (z - c.length).max(-z).max(0.0);
            along.hypot((d_min - c.radius).max(0.0))
        }
    }
}

/// Vertices whose leaf sphere meets the probe, ascending; `None` if one is too close to call.
pub(super) fn search(tree: &SphereTree, probe: &Probe) -> Option<Vec<u32>> {
    let mut found = Vec::new();
    for node in tree.nodes().iter().filter(|n| n.is_leaf()) {
        let gap = distance(probe, &node.sphere.centre) - node.sphere.radius;
        let scale = node.sphere.radius + node.sphere.centre.coords.amax();
        if gap.abs() <= 1e-12 * scale {
            return None;
        }
        if gap < 0.0 {
            found.extend_from_slice(tree.run(node).0);
        }
    }
    found.sort_unstable();
    Some(found)
}

/// Closeness by the distances of all vertices.
pub(super) fn closeness(points: &[Point3<f64>], probe: &Probe, margin: f64) -> Closeness {
    let nearest = points.iter().map(|p| distance(probe, p)).fold(f64::INFINITY, f64::min);
    if nearest <= 0.0 {
        Closeness::Colliding
    } else if nearest <= margin {
        Closeness::Near
    } else {
        Closeness::Clear
    }
}

/// Contact nodes of a tip, nearest first, from the full list of near vertices.
pub(super) fn tip_nodes(
    near: &[u32],
    positions: &[Point3<f64>],
    normals: &[Vector3<f64>],
    contact_point: &Point3<f64>,
) -> Vec<u32> {
    let mut sorted: Vec<(f64, u32)> = near
        .iter()
        .filter(|&&n| normals[n as usize] != Vector3::zeros())
        .map(|&n| ((contact_point - positions[n as usize]).norm(), n))
        .collect();
    sorted.sort_by(|a, b| a.partial_cmp(b).unwrap());
    sorted.truncate(5);
    let r = |n: u32| (contact_point - positions[n as usize]).dot(&normals[n as usize]);
    match sorted.first() {
        Some(&(_, n)) if r(n) <= 0.0 => {
            sorted.into_iter().map(|(_, n)| n).filter(|&n| r(n) <= 0.0).collect()
        }
        _ => Vec::new(),
    }
}
