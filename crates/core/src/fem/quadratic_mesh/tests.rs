//! Numbers and places of the mid-edge nodes that are made.

use std::collections::BTreeMap;

use super::*;
use crate::mesh::{BuiltIn, generate};

#[test]
fn corners_keep_their_numbers_and_orphans_get_no_edges() {
    let vertices = [[1.0, 0.0, 0.0], [9.0, 9.0, 9.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0; 3]]
        .map(Point3::from);
    let linear = TetMesh::try_new(vertices.to_vec(), vec![[0, 2, 3, 4]], vec![7]).unwrap();
    let mesh = QuadraticMesh::try_new(&linear).unwrap();
    assert_eq!((mesh.corner_count(), mesh.node_count()), (5, 11));
    assert_eq!(mesh.vertices()[..5], vertices);
    assert_eq!(mesh.edges(), [[0, 2], [0, 3], [0, 4], [2, 3], [2, 4], [3, 4]]);
    // Edges 12, 23, 13, 14, 24, 34 of corners 0, 2, 3, 4.
    assert_eq!(mesh.tets(), [[0, 2, 3, 4, 5, 8, 6, 7, 9, 10]]);
    assert_eq!(mesh.regions(), [7]);
    assert_eq!(mesh.used_nodes().iter().filter(|u| !**u).count(), 1);
    assert!(!mesh.used_nodes()[1]);
}

/// Numbers the edges through a map from pairs of corners instead of a sorted list.
fn naive_tets(linear: &TetMesh) -> Vec<[u32; 10]> {
    let mut numbers = BTreeMap::new();
    for c in linear.tets() {
        for [a, b] in EDGES {
            numbers.insert((c[a].min(c[b]), c[a].max(c[b])), 0);
        }
    }
    for (i, number) in numbers.values_mut().enumerate() {
        *number = (linear.node_count() + i) as u32;
    }
    let number = |a: u32, b: u32| numbers[&(a.min(b), a.max(b))];
    let tets = linear.tets().iter();
    tets.map(|&[a, b, c, d]| {
        let edges = [(a, b), (b, c), (a, c), (a, d), (b, d), (c, d)];
        let [e1, e2, e3, e4, e5, e6] = edges.map(|(a, b)| number(a, b));
        [a, b, c, d, e1, e2, e3, e4, e5, e6]
    })
    .collect()
}

#[test]
fn built_in_objects_get_one_node_per_edge_in_its_middle() {
    for shape in [BuiltIn::Cube, BuiltIn::Sphere, BuiltIn::Strawberry, BuiltIn::Toothpaste] {
        let linear = generate(shape, 300).unwrap();
        let mesh = QuadraticMesh::try_new(&linear).unwrap();
        assert_eq!(mesh.tets(), naive_tets(&linear));
        assert!(mesh.edges().is_sorted_by(|a, b| a < b));
        for tet in mesh.tets() {
            for (node, [a, b]) in tet[4..].iter().zip(EDGES) {
                let at = |n: u32| mesh.vertices()[n as usize];
                let off = at(*node) - nalgebra::center(&at(tet[a]), &at(tet[b]));
                assert!(off.norm() <= 1e-16, "{shape:?}");
            }
        }
        // Euler characteristic of a ball: nodes − edges + faces − elements = 1, where
        // 2 faces = 4 elements + boundary faces.
        let boundary = crate::mesh::Surface::from_mesh(&linear).triangles.len() as i64;
        let [n, e, t] = [linear.node_count(), mesh.edges().len(), linear.tets().len()]
            .map(|count| count as i64);
        assert_eq!(n - e + (4 * t + boundary) / 2 - t, 1, "{shape:?}");
    }
}

#[test]
fn middle_of_huge_coordinates_is_finite() {
    let (small, y, y_far) = (1e-150, 1.6e308, 1.7e308);
    let vertices = [[small, y, 0.0], [0.0, y_far, 0.0], [0.0, y, small], [0.0, y, 0.0]];
    let vertices = vertices.map(Point3::from).to_vec();
    let linear = TetMesh::try_new(vertices, vec![[0, 1, 2, 3]], vec![]).unwrap();
    let mesh = QuadraticMesh::try_new(&linear).unwrap();
    assert_eq!(mesh.vertices()[4], Point3::new(0.5 * small, 0.5 * y + 0.5 * y_far, 0.0));
    assert!(mesh.vertices().iter().all(|p| p.coords.iter().all(|c| c.is_finite())));
}

#[test]
fn more_nodes_than_degrees_of_freedom_can_number_are_refused() {
    assert_eq!(check_node_count(NODES_MAX - 6, 6), Ok(()));
    let error = check_node_count(NODES_MAX - 5, 6).unwrap_err();
    assert_eq!(error, TooManyNodes { corners: NODES_MAX - 5, edges: 6 });
    assert!(error.to_string().contains("1431655765 nodes"), "{error}");
    assert!(check_node_count(usize::MAX, 6).is_err());
}
