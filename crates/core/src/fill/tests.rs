//! Filled surfaces: sound meshes of the right volume, whatever is wrong with the surface.

use nalgebra::{Point3, Vector3};

use super::*;
use crate::mesh::{Bodies, Quality, Surface};
use crate::surface::TriangleSurface;
use crate::surface::samples::{ball, both, cuboid, without};

/// What must hold of every mesh.
fn check(filled: &Filled) {
    let bodies = Bodies::from_mesh(&filled.mesh);
    assert_eq!((bodies.piece_count(), bodies.orphan_count()), (1, 0));
    let surface = Surface::from_mesh(&filled.mesh);
    assert_eq!(surface.non_manifold_edges() + surface.non_manifold_nodes(), filled.hinges);
    let quality = Quality::from_mesh(&filled.mesh, 0);
    assert!(quality.volume_min > 0.0);
    assert!(quality.dihedral_min.to_degrees() > 5.0, "{}", quality.dihedral_min.to_degrees());
    assert!((quality.volume - filled.volume).abs() < 1e-9 * filled.volume);
}

/// Why a surface is not filled.
fn refusal(surface: &TriangleSurface, target: FillTarget) -> FillError {
    let Err(error) = fill(surface, target) else { panic!("filled") };
    error
}

/// A rod of 0.2 with a thin neck that ends in a ball.
fn dumbbell() -> TriangleSurface {
    let neck = cuboid(Point3::new(0.0, -0.008, -0.008), Vector3::new(0.12, 0.016, 0.016));
    let one = ball(4, Point3::origin(), 0.04);
    let two = ball(4, Point3::new(0.12, 0.0, 0.0), 0.03);
    both(&both(&one, &neck), &two)
}

#[test]
fn ball_has_its_nodes_its_volume_and_a_small_error() {
    let surface = ball(4, Point3::new(0.3, 0.0, -0.1), 0.03);
    let filled = fill(&surface, FillTarget::Nodes(1000)).unwrap();
    check(&filled);
    assert!(filled.mesh.node_count().abs_diff(1000) <= 25, "{}", filled.mesh.node_count());
    assert_eq!(filled.hinges, 0);
    assert!(filled.volume_error == 0.0 && filled.mending.is_closed());
    assert!((filled.volume / filled.volume_of_surface - 1.0).abs() < 1e-6);
    assert!(filled.volume_before < filled.volume);
    assert!(filled.surface_to_mesh.max < 0.15 * filled.spacing);
    assert!(filled.mesh_to_surface.max < 0.15 * filled.spacing);
    assert_eq!(filled.covered, 0.0);
    let quality = Quality::from_mesh(&filled.mesh, 0);
    assert!(quality.dihedral_min.to_degrees() > 10.0, "{}", quality.dihedral_min.to_degrees());
}

#[test]
fn finer_cells_come_closer() {
    let surface = ball(5, Point3::origin(), 0.03);
    let [coarse, fine] = [0.01, 0.005].map(|size| fill(&surface, FillTarget::Size(size)).unwrap());
    assert!(fine.surface_to_mesh.rms < 0.4 * coarse.surface_to_mesh.rms);
    assert_eq!(fine.coarsest, 2.0 * fine.finest);
}

#[test]
fn damaged_ball_gives_nearly_the_mesh_of_the_sound_one() {
    let sound = ball(4, Point3::origin(), 0.03);
    let open = without(&sound, |t| t % 50 != 3);
    let mut triangles = open.triangles().to_vec();
    for t in (0..triangles.len()).step_by(40) {
        triangles[t].swap(0, 1);
    }
    triangles.extend_from_within(100..160);
    let damaged = TriangleSurface::try_new(open.points().to_vec(), triangles).unwrap();
    let [a, b] = [&sound, &damaged].map(|s| fill(s, FillTarget::Size(0.008)).unwrap());
    check(&b);
    assert!(b.mending.turned > 40 && b.mending.doubled == 60 && b.mending.open_edges > 0);
    assert_eq!(a.mesh.node_count(), b.mesh.node_count());
    assert!((b.volume / a.volume - 1.0).abs() < 0.01, "{}", b.volume / a.volume);
    assert!(b.covered < 0.1);
}

#[test]
fn overlapping_shells_make_one_body_and_its_thin_neck_is_there() {
    let filled = fill(&dumbbell(), FillTarget::Nodes(900)).unwrap();
    check(&filled);
    assert_eq!(filled.mending.shells, 3);
    assert!(filled.volume_error > 0.0 && filled.volume_error < 0.02 * filled.volume);
    assert_eq!(filled.pieces_left_out, 0);
    assert!(filled.finest < filled.spacing);
    assert!(filled.surface_to_mesh.max < 0.5 * filled.spacing);
    let middle = |x: f64| filled.mesh.vertices().iter().any(|p| (p.x - x).abs() < 0.006);
    assert!(middle(0.06) && middle(-0.03) && middle(0.14));
}

#[test]
fn of_two_bodies_apart_the_larger_is_filled_and_said() {
    let two = both(&ball(3, Point3::origin(), 0.03), &ball(3, Point3::new(0.1, 0.0, 0.0), 0.02));
    let filled = fill(&two, FillTarget::Size(0.01)).unwrap();
    check(&filled);
    assert_eq!(filled.pieces_left_out, 1);
    assert!((filled.left_out - 8.0 / 35.0).abs() < 0.03, "{}", filled.left_out);
    assert!(filled.mesh.vertices().iter().all(|p| p.x < 0.04));
}

#[test]
fn what_has_no_inside_is_refused_with_its_place() {
    let grid = 8;
    let points = (0..grid * grid).map(|i| Point3::new((i % grid) as f64, (i / grid) as f64, 2.0));
    let quads = (0..grid - 1).flat_map(|y| (0..grid - 1).map(move |x| (y * grid + x) as u32));
    let n = grid as u32;
    let triangles = quads.flat_map(|q| [[q, q + 1, q + n], [q + 1, q + n + 1, q + n]]).collect();
    let sheet = TriangleSurface::try_new(points.collect(), triangles).unwrap();
    let error = refusal(&sheet, FillTarget::Nodes(500)).to_string();
    assert!(error.contains("no inside") && error.contains("(3.5000, 3.5000, 2.0000)"), "{error}");
    // A bowl of which less than a quarter of a ball is there.
    let whole = ball(4, Point3::origin(), 1.0);
    let cap = without(&whole, |t| whole.corners(t).iter().all(|p| p.z > 0.6));
    let error = refusal(&cap, FillTarget::Nodes(500));
    assert!(matches!(error, FillError::TooOpen { .. }), "{error}");
    let flat = both(&sheet, &sheet);
    assert!(matches!(refusal(&flat, FillTarget::Nodes(500)), FillError::NoInside { .. }));
}

#[test]
fn sizes_and_numbers_that_suit_no_object_are_refused() {
    let ball = ball(2, Point3::origin(), 1.0);
    for nodes in [0, 39, 400_001] {
        assert_eq!(
            fill(&ball, FillTarget::Nodes(nodes)).unwrap_err(),
            FillError::NodeCount { nodes }
        );
    }
    for size in [0.0, -1.0, f64::NAN, 1e-9, 5.0] {
        assert!(matches!(refusal(&ball, FillTarget::Size(size)), FillError::Size { .. }));
    }
}

#[test]
fn same_bits_for_any_number_of_threads() {
    let surface = dumbbell();
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| fill(&surface, FillTarget::Size(0.012)).unwrap())
    };
    let (one, three) = (with(1), with(3));
    assert_eq!(one.mesh, three.mesh);
    assert_eq!(one.surface_to_mesh, three.surface_to_mesh);
    assert_eq!(one.volume_of_surface, three.volume_of_surface);
}
