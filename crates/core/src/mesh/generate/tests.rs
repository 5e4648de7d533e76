//! Tests of what holds for every built-in object at every size.

use proptest::prelude::*;

use super::cube::EDGE;
use super::solid::SPHERE_RADIUS;
use super::*;
use crate::mesh::{Bodies, Quality, Surface, TetMesh};

const SIZES: [usize; 16] =
    [27, 30, 50, 64, 100, 150, 200, 216, 267, 343, 500, 729, 1000, 2000, 5000, 10_000];

/// The first promise that `mesh` breaks, in words.
fn fault(shape: BuiltIn, nodes: usize, mesh: &TetMesh) -> Option<String> {
    let surface = Surface::from_mesh(mesh);
    let bodies = Bodies::from_mesh(mesh);
    let angle = Quality::from_mesh(mesh, 0).dihedral_min.to_degrees();
    let miss = mesh.node_count().abs_diff(nodes);
    // Measured: 25° and more for the round ones, 36.9° for the cube's flattest boxes.
    let angle_min = if shape == BuiltIn::Cube { 30.0 } else { 17.0 };
    let promises = [
        (miss == 0 || nodes < 200 && miss <= 2, format!("{} nodes", mesh.node_count())),
        (surface.non_manifold_edges() == 0, "non-manifold edge".to_owned()),
        (surface.non_manifold_nodes() == 0, "non-manifold node".to_owned()),
        (Surface::overused_faces(mesh) == 0, "face of three elements".to_owned()),
        (surface.euler_characteristic() == 2, "hole or handle".to_owned()),
        (bodies.piece_count() == 1, format!("{} pieces", bodies.piece_count())),
        (bodies.orphan_count() == 0, "orphans".to_owned()),
        (angle > angle_min, format!("smallest dihedral angle {angle:.1}°")),
    ];
    promises
        .into_iter()
        .find(|(kept, _)| !kept)
        .map(|(_, broken)| format!("{shape} of {nodes} nodes: {broken}"))
}

#[test]
fn every_object_is_sound_at_every_listed_size() {
    for shape in BuiltIn::ALL {
        for nodes in SIZES {
            assert_eq!(fault(shape, nodes, &generate(shape, nodes).unwrap()), None);
        }
    }
}

#[test]
fn every_object_is_sound_with_a_hundred_thousand_nodes() {
    for shape in BuiltIn::ALL {
        assert_eq!(fault(shape, 100_000, &generate(shape, 100_000).unwrap()), None);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn every_object_is_sound_at_any_size(
        shape in prop::sample::select(BuiltIn::ALL.to_vec()),
        nodes in NODES_MIN..3000,
    ) {
        prop_assert_eq!(fault(shape, nodes, &generate(shape, nodes).unwrap()), None);
    }
}

#[test]
fn equal_requests_give_equal_bits() {
    for shape in BuiltIn::ALL {
        let bits = |mesh: &TetMesh| -> Vec<u64> {
            mesh.vertices().iter().flat_map(|p| p.coords.iter().map(|c| c.to_bits())).collect()
        };
        let (first, second) = (generate(shape, 777).unwrap(), generate(shape, 777).unwrap());
        assert_eq!(bits(&first), bits(&second));
        assert_eq!(first.tets(), second.tets());
    }
}

#[test]
fn cube_has_its_exact_volume_at_every_listed_size() {
    for nodes in SIZES {
        let volume = Quality::from_mesh(&generate(BuiltIn::Cube, nodes).unwrap(), 0).volume;
        assert!((volume / EDGE.powi(3) - 1.0).abs() < 1e-12);
    }
}

#[test]
fn sphere_volume_converges_with_the_square_of_the_spacing() {
    let exact = 4.0 / 3.0 * std::f64::consts::PI * SPHERE_RADIUS.powi(3);
    let error = |nodes| {
        let volume = Quality::from_mesh(&generate(BuiltIn::Sphere, nodes).unwrap(), 0).volume;
        1.0 - volume / exact
    };
    let (coarse, middle, fine) = (error(1000), error(8000), error(64_000));
    assert!(coarse > 0.0 && coarse < 0.02, "{coarse}");
    // Eight times the nodes are about half the spacing: a quarter of the error.
    assert!(middle < 0.32 * coarse && fine < 0.32 * middle, "{coarse} {middle} {fine}");
}

#[test]
fn surface_nodes_of_the_sphere_lie_on_it() {
    let mesh = generate(BuiltIn::Sphere, 2000).unwrap();
    let surface = Surface::from_mesh(&mesh);
    for n in surface.nodes {
        let radius = mesh.vertices()[n as usize].coords.norm();
        assert!((radius - SPHERE_RADIUS).abs() < 1e-6);
    }
}

#[test]
fn objects_have_their_size_around_the_origin() {
    // Extents in m along X, Y, Z, from the thesis's objects at hand scale.
    for (shape, extent) in [
        (BuiltIn::Cube, [0.06, 0.06, 0.06]),
        (BuiltIn::Sphere, [0.07, 0.07, 0.07]),
        (BuiltIn::Strawberry, [0.0465, 0.065, 0.0465]),
        (BuiltIn::Toothpaste, [0.15, 0.03, 0.04]),
    ] {
        let (low, high) = generate(shape, 5000).unwrap().bounds();
        for d in 0..3 {
            assert!((high[d] - low[d] - extent[d]).abs() < 0.02 * extent[d], "{shape} axis {d}");
            assert!((high[d] + low[d]).abs() < 0.1 * extent[d], "{shape} axis {d}");
        }
    }
}

#[test]
fn sizes_out_of_range_are_refused_with_the_range() {
    for shape in BuiltIn::ALL {
        for nodes in [0, 26, 2_000_001, usize::MAX] {
            let error = generate(shape, nodes).unwrap_err();
            assert_eq!(error, GenerateError::NodeCount { shape, nodes });
            assert!(error.to_string().ends_with("it can have 27 to 2000000"), "{error}");
        }
    }
}

#[test]
fn names_are_read_as_they_are_written() {
    for shape in BuiltIn::ALL {
        assert_eq!(shape.to_string().parse(), Ok(shape));
    }
    let error = "banana".parse::<BuiltIn>().unwrap_err();
    assert!(error.to_string().contains("\"banana\"") && error.to_string().contains("strawberry"));
}
