//! Moves nodes a little where elements are thin; surface nodes stay on the surface.

use nalgebra::{Point3, Vector3};

use super::pieces::Stuffing;
use crate::mesh::Incidence;

/// Raises the smallest dihedral angles of a stuffed solid by moving nodes one at a time.
///
/// Shapes: `on_surface` one flag per vertex, `spacings` the length of a long edge around it.
/// `project` brings a point near the surface onto it, or gives `None`. A node moves only if the
/// worst element around it gets better, so no element is ever inverted. Serial and in index order:
/// deterministic.
pub(crate) fn smooth(
    stuffing: &mut Stuffing,
    on_surface: &[bool],
    spacings: &[f64],
    project: impl Fn(&Point3<f64>, f64) -> Option<Point3<f64>>,
) {
    let around = Incidence::new(stuffing.vertices.len(), &stuffing.tets);
    let mut shortenings = 0;
    for _ in 0..PASS_COUNT_MAX {
        let mut nodes: Vec<u32> = stuffing
            .tets
            .iter()
            .filter(|t| least_sine(&t.map(|n| stuffing.vertices[n as usize])) < TARGET_SINE)
            .flatten()
            .copied()
            .collect();
        if nodes.is_empty() {
            break;
        }
        nodes.sort_unstable();
        nodes.dedup();
        let mut moved = 0;
        for n in nodes {
            let spacing = spacings[n as usize];
            let step = (0..shortenings).fold(0.1 * spacing, |step, _| 0.4 * step);
            let onto = |p: &Point3<f64>| match on_surface[n as usize] {
                true => project(p, spacing),
                false => Some(*p),
            };
            moved += usize::from(improve(stuffing, around.tets(n), n, onto, step));
        }
        if moved == 0 {
            shortenings += 1;
        }
        if shortenings > SHORTENINGS_MAX {
            break;
        }
    }
}

/// Tries a step in each of 14 directions and keeps the best; true if the node moved.
fn improve(
    stuffing: &mut Stuffing,
    tets: &[u32],
    node: u32,
    onto: impl Fn(&Point3<f64>) -> Option<Point3<f64>>,
    step: f64,
) -> bool {
    let start = stuffing.vertices[node as usize];
    let corners = |at: &Point3<f64>, tet: u32| {
        let nodes = stuffing.tets[tet as usize];
        nodes.map(|n| if n == node { *at } else { stuffing.vertices[n as usize] })
    };
    let mut best =
        tets.iter().map(|t| least_sine(&corners(&start, *t))).fold(f64::INFINITY, f64::min);
    if best >= TARGET_SINE {
        return false;
    }
    let mut best_at = start;
    for direction in DIRECTIONS {
        let aim = start + Vector3::from(direction).normalize() * step;
        let Some(at) = onto(&aim) else { continue };
        let floor = best * (1.0 + 1e-6);
        let mut least = f64::INFINITY;
        for t in tets {
            least = least.min(least_sine(&corners(&at, *t)));
            if least <= floor {
                break;
            }
        }
        if least > floor {
            (best, best_at) = (least, at);
        }
    }
    stuffing.vertices[node as usize] = best_at;
    best_at != start
}

/// Smallest sine of the six dihedral angles, negative for inverted elements.
///
/// `sin θ = 3 V l / (2 A B)` at the edge of length `l` between faces of areas `A` and `B`.
pub(crate) fn least_sine(c: &[Point3<f64>; 4]) -> f64 {
    let edge = |i: usize, j: usize| c[j] - c[i];
    let doubled_area = |i: usize, j: usize, k: usize| edge(i, j).cross(&edge(i, k)).norm();
    let areas = [
        doubled_area(1, 2, 3),
        doubled_area(0, 2, 3),
        doubled_area(0, 1, 3),
        doubled_area(0, 1, 2),
    ];
    let det = edge(3, 0).dot(&edge(3, 1).cross(&edge(3, 2)));
    let mut least = f64::INFINITY;
    for (i, j, k, l) in
        [(0, 1, 2, 3), (0, 2, 1, 3), (0, 3, 1, 2), (1, 2, 0, 3), (1, 3, 0, 2), (2, 3, 0, 1)]
    {
        // The faces at edge i–j lie opposite k and l.
        let sine = edge(i, j).norm() * det / (areas[k] * areas[l]);
        if sine.is_nan() {
            // A face without area; `min` would pass over it.
            return f64::NEG_INFINITY;
        }
        least = least.min(sine);
    }
    least
}

/// Sine of 25°: elements better than this in all angles are left alone.
const TARGET_SINE: f64 = 0.4226;

/// Sweeps over the thin elements; measured: later ones change the smallest angle by under 0.1°.
const PASS_COUNT_MAX: usize = 12;

/// Times the step is shortened, by 0.4 each: from a tenth of the spacing to 0.0064 of it.
const SHORTENINGS_MAX: usize = 3;

/// Axes and space diagonals.
const DIRECTIONS: [[f64; 3]; 14] = [
    [1.0, 0.0, 0.0],
    [-1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, -1.0, 0.0],
    [0.0, 0.0, 1.0],
    [0.0, 0.0, -1.0],
    [1.0, 1.0, 1.0],
    [1.0, 1.0, -1.0],
    [1.0, -1.0, 1.0],
    [1.0, -1.0, -1.0],
    [-1.0, 1.0, 1.0],
    [-1.0, 1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [-1.0, -1.0, -1.0],
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn least_sine_agrees_with_the_measured_angles() {
        let c = [[1.0, 0.1, 0.0], [0.0, 1.0, 0.2], [0.3, 0.0, 1.0], [0.0; 3]].map(Point3::from);
        let q = crate::mesh::tet_quality(&c);
        let expected = q.dihedral_min.sin().min(q.dihedral_max.sin());
        assert!((least_sine(&c) - expected).abs() < 1e-14);
        assert!(least_sine(&[c[1], c[0], c[2], c[3]]) < 0.0);
        assert_eq!(least_sine(&[c[0]; 4]), f64::NEG_INFINITY);
    }
}
