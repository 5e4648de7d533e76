//! Isosurface stuffing: cuts the lattice along a solid's surface into well-shaped tetrahedra.
//!
//! After Labelle and Shewchuk, "Isosurface stuffing: fast tetrahedral meshes with good dihedral
//! angles", SIGGRAPH 2007: lattice points too near the surface are moved onto it, then every
//! lattice tetrahedron keeps its part inside, cut by one of a few fixed patterns.

use nalgebra::Point3;

use super::lattice::Lattice;
use super::solid::Solid;
use crate::stuffing::{Cut, Pieces, Side, Stuffing, warp};

/// Fills `solid` with tetrahedra cut from `lattice`.
pub(super) fn stuff(solid: Solid, lattice: &Lattice) -> Stuffing {
    let mut points: Vec<Point3<f64>> =
        (0..lattice.point_count()).map(|p| lattice.position(p)).collect();
    let depths: Vec<f64> = (0..points.len())
        .map(|p| {
            // The lattice leaves room around the solid: its border is outside by construction.
            if lattice.is_border(p) { -1.0 } else { solid.depth(&points[p], lattice.spacing()) }
        })
        .collect();
    let mut sides: Vec<Side> = depths.iter().map(|d| side_of(*d)).collect();
    let cuts = find_cuts(solid, lattice, &points, &depths, &sides);
    warp(&cuts, &mut points, &mut sides);
    let parities = (0..points.len()).map(|p| lattice.parity(p) as u8).collect();
    let mut pieces = Pieces::new(points, sides, parities, cuts);
    lattice.for_each_tet(|corners| pieces.add(corners));
    pieces.finish()
}

fn side_of(depth: f64) -> Side {
    match depth.partial_cmp(&0.0) {
        Some(std::cmp::Ordering::Greater) => Side::Inside,
        Some(std::cmp::Ordering::Equal) => Side::On,
        _ => Side::Outside,
    }
}

/// All edges from an inside to an outside point, sorted by their ends.
fn find_cuts(
    solid: Solid,
    lattice: &Lattice,
    points: &[Point3<f64>],
    depths: &[f64],
    sides: &[Side],
) -> Vec<Cut> {
    let mut cuts = Vec::new();
    for inside in (0..points.len()).filter(|p| sides[*p] == Side::Inside) {
        for (outside, is_long) in lattice.neighbours(inside) {
            if sides[outside] != Side::Outside {
                continue;
            }
            let step = points[outside] - points[inside];
            let at = |t: f64| points[inside] + step * t;
            let depth_at = |t: f64| solid.depth(&at(t), lattice.spacing());
            let t = find_root(depth_at, depths[inside], depths[outside]);
            let ends = [inside.min(outside), inside.max(outside)];
            let spacings = [lattice.spacing(); 2];
            cuts.push(Cut { ends, is_long, position: at(t), spacings });
        }
    }
    cuts.sort_unstable_by_key(|c| c.ends);
    cuts
}

/// Root of `f` in 0..1 by regula falsi in the Illinois variant; `f0` > 0 and `f1` < 0.
fn find_root(f: impl Fn(f64) -> f64, f0: f64, f1: f64) -> f64 {
    let (mut low, mut f_low, mut high, mut f_high) = (0.0, f0, 1.0, f1);
    let mut last_low = None;
    for _ in 0..60 {
        let t: f64 = (low * f_high - high * f_low) / (f_high - f_low);
        let value = f(t);
        // By the value itself: the halved weights of the ends say nothing about how near it is.
        if value.abs() <= 1e-9 * (f0 - f1) || high - low < 1e-9 {
            return t;
        }
        let is_low = value > 0.0;
        // An end that stays twice loses half its weight, so that both ends close in.
        if is_low {
            (low, f_low) = (t, value);
            if last_low == Some(true) {
                f_high *= 0.5;
            }
        } else {
            (high, f_high) = (t, value);
            if last_low == Some(false) {
                f_low *= 0.5;
            }
        }
        last_low = Some(is_low);
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::mesh::{Quality, Surface, TetMesh};
    use crate::stuffing::smooth;

    #[test]
    fn root_of_a_cubic_is_found() {
        let f = |t: f64| 0.3 - t * t * t;
        let t = find_root(f, f(0.0), f(1.0));
        assert!((t - 0.3f64.cbrt()).abs() < 1e-8, "{t}");
    }

    /// The tube's depth is the smaller of two functions; the end that stayed was taken for the root
    /// when its weight had been halved often enough, 1e-5 of the edge away.
    #[test]
    fn root_next_to_a_kink_is_found() {
        for slope in [1e-3, 1.0, 1e3] {
            let f = |t: f64| (0.3 - t).min(slope * (0.31 - t));
            let t = find_root(f, f(0.0), f(1.0));
            assert!(f(t).abs() <= 1e-8 * (f(0.0) - f(1.0)), "{slope}: {t}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn cut_elements_fit_together_and_keep_the_promised_angle(
            shift in prop::array::uniform3(0.0f64..1.0),
            spacing in 0.004f64..0.016,
            solid in prop::sample::select(vec![Solid::Sphere, Solid::Strawberry, Solid::Toothpaste]),
        ) {
            let (low, high) = solid.bounds(spacing);
            let stuffing = stuff(solid, &Lattice::around(low, high, spacing, shift));
            let mesh = TetMesh::try_new(stuffing.vertices, stuffing.tets, Vec::new()).unwrap();
            // Labelle and Shewchuk prove 10.7° and 164.8° for these thresholds; where the surface
            // bends within one cell a little less is left (10.35° has been seen). 8° is promised.
            let quality = Quality::from_mesh(&mesh, 0);
            let least = quality.dihedral_min.to_degrees();
            prop_assert!(least > 8.0, "{}", least);
            prop_assert!(quality.dihedral_max.to_degrees() < 164.8);
            let surface = Surface::from_mesh(&mesh);
            prop_assert_eq!(surface.non_manifold_edges(), 0);
            for n in &surface.nodes {
                let depth = solid.depth(&mesh.vertices()[*n as usize], spacing);
                prop_assert!(depth.abs() < 1e-6 * spacing, "{depth:e}");
            }
        }
    }

    #[test]
    fn thin_elements_get_better_and_surface_nodes_stay_on_the_surface() {
        let (solid, spacing) = (Solid::Toothpaste, 0.006);
        let (low, high) = solid.bounds(spacing);
        let mut stuffing = stuff(solid, &Lattice::around(low, high, spacing, [0.1, 0.4, 0.7]));
        let mesh = |s: &Stuffing| {
            TetMesh::try_new(s.vertices.clone(), s.tets.clone(), Vec::new()).unwrap()
        };
        let before = mesh(&stuffing);
        let surface = Surface::from_mesh(&before);
        let mut on_surface = vec![false; before.node_count()];
        surface.nodes.iter().for_each(|n| on_surface[*n as usize] = true);
        let spacings = vec![spacing; on_surface.len()];
        smooth(&mut stuffing, &on_surface, &spacings, |p, spacing| solid.project(p, spacing));
        let after = mesh(&stuffing);
        let angle = |m: &TetMesh| Quality::from_mesh(m, 0).dihedral_min.to_degrees();
        assert!(angle(&before) < 20.0 && angle(&after) > 24.0);
        for n in surface.nodes {
            let depth = solid.depth(&after.vertices()[n as usize], spacing);
            assert!(depth.abs() < 2e-4 * spacing);
        }
    }
}
