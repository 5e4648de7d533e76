//! Tests of the tree on many surfaces, compared with a search of every vertex.

use nalgebra::{Point3, Unit, Vector3};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use softgrasp_core::mesh::{BuiltIn, Surface, generate};

use super::naive::{self, Probe};
use super::{SphereTree, TreeError, VisitedSphere, tip_hits, vertex_normals};
use crate::shape::{Cylinder, Sphere};

/// Clouds, balls, flat sheets, lines, coincident points: 1 to 400 vertices, metres, finger scale.
fn shapes() -> impl Strategy<Value = Vec<Point3<f64>>> {
    let raw = prop::collection::vec(prop::array::uniform3(-1.0..1.0_f64), 1..400);
    (raw, 0..6_u8, 0.001..0.1_f64, -1.0..1.0_f64).prop_map(|(raw, kind, size, shift)| {
        let shaped = raw.into_iter().map(|[x, y, z]| match kind {
            0 => Vector3::new(x, y, z),
            1 => Vector3::new(x, y, z).try_normalize(1e-9).unwrap_or_else(Vector3::x),
            2 => Vector3::new(x, y, 0.25),
            3 => Vector3::new(x, 0.0, 0.0),
            // A coarse grid makes many coincident vertices, and vertices on cell borders.
            4 => Vector3::new(x, y, z).map(|c| (c * 4.0).round() / 4.0),
            _ => Vector3::new(1.0, 1.0, 1.0),
        });
        shaped.map(|v| Point3::from(v * size + Vector3::new(shift, -shift, shift * 0.5))).collect()
    })
}

/// Finger segments and tips in any pose near a vertex of the shape, given relative to its size.
fn probes(count: usize) -> impl Strategy<Value = Vec<ProbeSeed>> {
    let seed = (
        any::<prop::sample::Index>(),
        prop::array::uniform3(-1.0..1.0_f64),
        prop::array::uniform3(-1.0..1.0_f64),
        0.0..0.05_f64,
        0.0005..0.012_f64,
        any::<bool>(),
    );
    prop::collection::vec(seed, count)
}

type ProbeSeed = (prop::sample::Index, [f64; 3], [f64; 3], f64, f64, bool);

fn probe((near, offset, axis, length, radius, tip): &ProbeSeed, points: &[Point3<f64>]) -> Probe {
    let at = near.get(points) + Vector3::from(*offset) * 0.04;
    if *tip {
        return Probe::Sphere(Sphere { centre: at, radius: *radius });
    }
    let axis = Unit::try_new(Vector3::from(*axis), 1e-6).unwrap_or_else(Vector3::z_axis);
    Probe::Cylinder(Cylinder { base: at, axis, length: *length, radius: *radius })
}

fn search(tree: &SphereTree, probe: &Probe) -> Vec<u32> {
    let mut found = Vec::new();
    match probe {
        Probe::Cylinder(cylinder) => tree.search_cylinder(cylinder, &mut found),
        Probe::Sphere(tip) => tree.search_sphere(tip, &mut found),
    }
    found.sort_unstable();
    found
}

/// Bends, twists and stretches a shape about its first point.
fn deformed(points: &[Point3<f64>], [a, b, c]: [f64; 3]) -> Vec<Point3<f64>> {
    let centre = points[0];
    let bend = |p: &Point3<f64>| {
        let d = p - centre;
        let twist = nalgebra::Rotation3::from_axis_angle(&Vector3::y_axis(), 40.0 * a * d.y);
        centre + twist * Vector3::new(d.x * (1.0 + b), d.y + 20.0 * c * d.x * d.x, d.z * (1.0 - b))
    };
    points.iter().map(bend).collect()
}

fn tree_over(points: &[Point3<f64>]) -> SphereTree {
    let all: Vec<u32> = (0..points.len() as u32).collect();
    SphereTree::try_build(points, &all).unwrap()
}

/// Every invariant stated at [`SphereTree`].
fn assert_valid(tree: &SphereTree, points: &[Point3<f64>]) {
    let mut owners = vec![0; points.len()];
    let mut next_child = 1;
    for node in tree.nodes() {
        for &vertex in &tree.vertices()[node.slot_range()] {
            let gap = (points[vertex as usize] - node.sphere.centre).norm() - node.sphere.radius;
            assert!(gap <= 0.0, "vertex {vertex} is {gap:e} outside {node:?}");
        }
        if node.is_leaf() {
            tree.run(node).0.iter().for_each(|&v| owners[v as usize] += 1);
            continue;
        }
        assert!((2..=8).contains(&node.children), "{node:?}");
        assert_eq!(node.child_range().start, next_child);
        next_child = node.child_range().end;
        for child in &tree.nodes()[node.child_range()] {
            let reach = (child.sphere.centre - node.sphere.centre).norm() + child.sphere.radius;
            assert!(reach <= node.sphere.radius, "{child:?} leaves {node:?}");
        }
    }
    assert_eq!(next_child, tree.nodes().len());
    assert!(owners.iter().all(|&count| count == 1), "each vertex lies in exactly one leaf");
}

fn assert_search_is_exhaustive(tree: &SphereTree, points: &[Point3<f64>], seeds: &[ProbeSeed]) {
    for seed in seeds {
        let probe = probe(seed, points);
        if let Some(expected) = naive::search(tree, &probe) {
            assert_eq!(search(tree, &probe), expected, "{probe:?}");
        }
        let closeness = match &probe {
            Probe::Cylinder(cylinder) => tree.closeness_to_cylinder(cylinder, 0.003),
            Probe::Sphere(tip) => tree.closeness_to_sphere(tip, 0.003),
        };
        let nearest = points.iter().map(|p| naive::distance(&probe, p)).fold(1e9, f64::min);
        // On the border itself rounding may decide either way.
        if (nearest == 0.0 || nearest > 1e-12) && (nearest - 0.003).abs() > 1e-12 {
            assert_eq!(closeness, naive::closeness(points, &probe, 0.003), "{probe:?}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn search_equals_brute_force_for_built_and_refitted_trees(
        points in shapes(),
        seeds in probes(12),
        bends in prop::array::uniform3(-0.8..0.8_f64),
    ) {
        let mut tree = tree_over(&points);
        assert_valid(&tree, &points);
        assert_search_is_exhaustive(&tree, &points, &seeds);

        let bent = deformed(&points, bends);
        tree.refit(&bent).unwrap();
        assert_valid(&tree, &bent);
        assert_search_is_exhaustive(&tree, &bent, &seeds);
    }

    #[test]
    fn visited_spheres_end_at_the_leaves_that_the_search_finds(
        points in shapes(),
        seeds in probes(6),
    ) {
        let tree = tree_over(&points);
        for seed in &seeds {
            let probe = probe(seed, &points);
            let visited = match &probe {
                Probe::Cylinder(cylinder) => tree.visited_by_cylinder(cylinder),
                Probe::Sphere(tip) => tree.visited_by_sphere(tip),
            };
            prop_assert!(visited.is_sorted_by_key(|v| v.level) && visited[0].level == 0);
            // Each sphere but the root is the child of one that overlaps.
            for below in visited.iter().filter(|v| v.level > 0) {
                let holds = |v: &&VisitedSphere| {
                    let reach = (v.sphere.centre - below.sphere.centre).norm();
                    v.overlaps && !v.is_leaf && reach + below.sphere.radius <= v.sphere.radius
                };
                let parents = visited.iter().filter(|v| v.level + 1 == below.level);
                prop_assert!(parents.filter(holds).count() > 0);
            }
            let mut ends: Vec<Sphere> =
                visited.iter().filter(|v| v.overlaps && v.is_leaf).map(|v| v.sphere).collect();
            let found = search(&tree, &probe);
            let leaves = tree.nodes().iter().filter(|node| node.is_leaf());
            let expected = leaves.filter(|leaf| found.contains(&tree.run(leaf).0[0]));
            let by_place = |a: &Sphere, b: &Sphere| {
                let key = |s: &Sphere| [s.centre.x, s.centre.y, s.centre.z, s.radius];
                key(a).partial_cmp(&key(b)).unwrap()
            };
            let mut expected: Vec<Sphere> = expected.map(|leaf| leaf.sphere).collect();
            ends.sort_by(by_place);
            expected.sort_by(by_place);
            prop_assert_eq!(ends, expected);
        }
    }

    #[test]
    fn near_nodes_are_those_within_the_radius(
        points in shapes(),
        seeds in probes(4),
    ) {
        let tree = tree_over(&points);
        for (near, offset, _, _, radius, _) in &seeds {
            let centre = near.get(&points) + Vector3::from(*offset) * 0.01;
            let mut found = Vec::new();
            tree.nodes_near(&centre, *radius, &mut found);
            found.sort_unstable();
            let inside = |p: &Point3<f64>| (p - centre).norm_squared() <= radius * radius;
            let expected: Vec<u32> =
                (0..points.len() as u32).filter(|&n| inside(&points[n as usize])).collect();
            prop_assert_eq!(found, expected);
        }
    }

    #[test]
    fn contact_nodes_equal_those_of_the_full_list(
        points in shapes(),
        seeds in probes(6),
    ) {
        let tree = tree_over(&points);
        let centre = points[0];
        let normals: Vec<_> = points
            .iter()
            .map(|p| (p - centre).try_normalize(1e-9).unwrap_or_else(Vector3::zeros))
            .collect();
        for (near, offset, towards, _, radius, _) in &seeds {
            let tip = Sphere { centre: near.get(&points) + Vector3::from(*offset) * 0.02, radius: *radius };
            let contact_point = tip.centre + Vector3::from(*towards) * *radius;
            if let Some(list) = naive::search(&tree, &Probe::Sphere(tip)) {
                let hits = tip_hits(&tree, &normals, &tip, &contact_point);
                let nodes: Vec<u32> = hits.iter().flatten().map(|hit| hit.node).collect();
                prop_assert_eq!(nodes, naive::tip_nodes(&list, &points, &normals, &contact_point));
            }
        }
    }
}

/// Grid of vertices on the six faces of a cube and its triangles, outward.
fn cube_surface(n: usize) -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
    let (mut points, mut triangles) = (Vec::new(), Vec::new());
    for side in 0..6 {
        let (axis, sign) = (side / 2, if side % 2 == 0 { 1.0 } else { -1.0 });
        let first = points.len() as u32;
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let mut p = Point3::from([sign; 3]);
            p[(axis + 1) % 3] = 2.0 * i as f64 / (n - 1) as f64 - 1.0;
            p[(axis + 2) % 3] = 2.0 * j as f64 / (n - 1) as f64 - 1.0;
            points.push(p * 0.03);
        }
        let w = n as u32;
        for (i, j) in (0..w - 1).flat_map(|i| (0..w - 1).map(move |j| (i, j))) {
            let [a, b, c, d] = [0, w, w + 1, 1].map(|k| first + i * w + j + k);
            let quad = [[a, b, c], [a, c, d]];
            triangles.extend(quad.map(|[a, b, c]| if sign > 0.0 { [a, b, c] } else { [a, c, b] }));
        }
    }
    (points, triangles)
}

#[test]
fn vertex_normals_point_out_of_a_cube() {
    let (points, triangles) = cube_surface(6);
    let mut normals = vec![Vector3::x(); 3];
    vertex_normals(&points, &triangles, &mut normals).unwrap();
    for (point, normal) in points.iter().zip(&normals) {
        assert!((normal.norm() - 1.0).abs() < 1e-12);
        assert!((point.coords.dot(normal) - 0.03).abs() < 1e-12);
    }
}

#[test]
fn normals_of_bad_or_flat_faces_are_refused_or_zero() {
    let points = vec![Point3::origin(), Point3::new(1.0, 0.0, 0.0), Point3::new(2.0, 0.0, 0.0)];
    let mut normals = Vec::new();
    let error = vertex_normals(&points, &[[0, 1, 3]], &mut normals).unwrap_err();
    assert_eq!(error, super::TreeError::IndexOutOfRange { node: 3, node_count: 3 });
    vertex_normals(&points, &[[0, 1, 2]], &mut normals).unwrap();
    assert_eq!(normals, [Vector3::zeros(); 3]);
}

#[test]
fn a_tip_pressed_into_a_face_is_inside_and_one_above_it_is_not() {
    let (points, triangles) = cube_surface(13);
    let tree = tree_over(&points);
    let mut normals = Vec::new();
    vertex_normals(&points, &triangles, &mut normals).unwrap();
    let touch = |depth: f64| {
        let contact_point = Point3::new(0.0301 - depth, 0.0041, 0.0006);
        let tip = Sphere { centre: contact_point + Vector3::x() * 0.008, radius: 0.008 };
        tip_hits(&tree, &normals, &tip, &contact_point)
    };
    assert_eq!(touch(0.0), [None; 5]);
    let hit = touch(0.002)[0].unwrap();
    assert!((points[hit.node as usize] - Point3::new(0.03, 0.005, 0.0)).norm() < 1e-12);
    assert!((hit.normal - Vector3::x()).norm() < 1e-12);
    // Five different nodes to choose from, nearest first.
    let hits = touch(0.002).map(|hit| hit.unwrap());
    assert!(hits.is_sorted_by(|a, b| a.distance <= b.distance && a.node != b.node));
}

/// The limit of (4.10) that docs/grasp.md states.
#[test]
fn beside_an_edge_a_tip_counts_as_inside_up_to_its_distance_from_the_edge() {
    let tree = tree_over(&[Point3::origin()]);
    let over_the_edge = [Vector3::new(1.0, 1.0, 0.0).normalize()];
    let is_inside = |above_face: f64| {
        let contact_point = Point3::new(above_face, -0.002, 0.0);
        let tip = Sphere { centre: contact_point, radius: 0.008 };
        tip_hits(&tree, &over_the_edge, &tip, &contact_point)[0].is_some()
    };
    assert!(is_inside(-0.001) && is_inside(0.0019) && !is_inside(0.0021));
}

#[test]
fn refit_without_motion_finds_the_same_and_quality_falls_with_crumpling_only() {
    let (points, _) = cube_surface(20);
    let mut tree = tree_over(&points);
    assert_eq!(tree.quality(), 1.0);
    let built = tree.clone();
    tree.refit(&points).unwrap();
    assert!(tree.quality() <= 1.0 && !tree.needs_rebuild());
    let tip = Sphere { centre: Point3::new(0.03, 0.0, 0.0), radius: 0.008 };
    assert_eq!(search(&tree, &Probe::Sphere(tip)), search(&built, &Probe::Sphere(tip)));

    // Doubling the object is no reason to rebuild; throwing its vertices about is.
    let doubled: Vec<_> = points.iter().map(|p| p * 2.0).collect();
    tree.refit(&doubled).unwrap();
    assert!(!tree.needs_rebuild(), "{}", tree.quality());
    let shuffled: Vec<_> = (0..points.len()).map(|i| points[i * 997 % points.len()]).collect();
    tree.refit(&shuffled).unwrap();
    assert!(tree.needs_rebuild(), "{}", tree.quality());
    assert_valid(&tree, &shuffled);
}

#[test]
fn a_refused_refit_leaves_the_tree_as_it_was() {
    let (mut points, _) = cube_surface(4);
    let mut tree = tree_over(&points);
    let before = tree.clone();
    points[7].z = f64::NAN;
    assert_eq!(tree.refit(&points), Err(super::TreeError::NotFinite { node: 7 }));
    assert!(tree.refit(&points[..3]).is_err());
    assert_eq!(tree, before);
}

#[test]
fn far_away_tiny_and_huge_objects_keep_their_vertices_enclosed() {
    let (points, _) = cube_surface(7);
    for (scale, shift) in
        [(1e-8, 0.0), (1e8, 0.0), (1.0, 1e6), (1e-3, 1e9), (1e-300, 0.0), (1e140, 0.0)]
    {
        let moved: Vec<_> = points.iter().map(|p| p * scale + Vector3::repeat(shift)).collect();
        let mut tree = tree_over(&moved);
        assert_valid(&tree, &moved);
        tree.refit(&moved).unwrap();
        assert_valid(&tree, &moved);
    }
}

#[test]
fn the_deepest_tree_with_all_branches_fits_the_search_stack() {
    // Each cell at the low corner splits into itself and seven siblings of two vertices each.
    let mut points = vec![Point3::origin(), Point3::from([1.0; 3])];
    for level in 1..=21 {
        let edge = 0.5_f64.powi(level);
        for octant in 1..8_u8 {
            let low = Vector3::new(octant >> 2, octant >> 1 & 1, octant & 1).map(f64::from) * edge;
            points.extend([0.3, 0.7].map(|c| Point3::from(low + Vector3::repeat(c * edge))));
        }
    }
    let tree = tree_over(&points);
    assert_valid(&tree, &points);
    let mut found = Vec::new();
    tree.nodes_near(&Point3::origin(), 2.0, &mut found);
    assert_eq!(found.len(), points.len());
}

/// Vertices of the TetGen armadillo among the shared data, scaled to a hand's size.
fn armadillo() -> Option<Vec<Point3<f64>>> {
    let shared =
        std::env::var_os("SOFTGRASP_SHARED").map(std::path::PathBuf::from).or_else(|| {
            let up = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).ancestors();
            up.map(|folder| folder.join("shared")).find(|folder| folder.is_dir())
        })?;
    let text = std::fs::read_to_string(shared.join("meshes/armadillo_4k.node")).ok()?;
    let rows = text.lines().skip(1).filter(|line| !line.trim_start().starts_with('#'));
    let points = rows.filter_map(|line| {
        let row: Vec<f64> = line.split_whitespace().filter_map(|w| w.parse().ok()).collect();
        (row.len() == 4).then(|| Point3::new(row[1], row[2], row[3]) * 0.03)
    });
    Some(points.collect())
}

#[test]
fn a_real_object_is_found_as_by_brute_force_while_it_bends() {
    let Some(points) = armadillo() else {
        println!("skipped: shared/meshes/armadillo_4k.node is not there");
        return;
    };
    assert_eq!(points.len(), 1180);
    let mut tree = tree_over(&points);
    assert_valid(&tree, &points);
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    for frame in 0..20 {
        let bent = deformed(&points, [0.01, 0.01, 0.005].map(|c| c * f64::from(frame)));
        tree.refit(&bent).unwrap();
        assert_valid(&tree, &bent);
        let seeds = probes(50).new_tree(&mut runner).unwrap().current();
        assert_search_is_exhaustive(&tree, &bent, &seeds);
    }
}

fn strawberry() -> (SphereTree, Vec<Point3<f64>>) {
    let mesh = generate(BuiltIn::Strawberry, 800).unwrap();
    let nodes = Surface::from_mesh(&mesh).nodes;
    let points = nodes.iter().map(|&n| mesh.vertices()[n as usize]).collect();
    (SphereTree::try_build(mesh.vertices(), &nodes).unwrap(), points)
}

#[test]
fn levels_begin_with_the_root_and_end_with_the_leaves() {
    let (tree, points) = strawberry();
    assert_eq!(tree.spheres_at_level(0), [tree.bounding_sphere()]);
    let leaves = tree.nodes().iter().filter(|node| node.is_leaf()).count();
    let depth = tree.depth();
    assert!((2..=22).contains(&depth), "{depth}");
    assert_eq!(tree.spheres_at_level(depth).len(), leaves);
    assert_eq!(tree.spheres_at_level(depth + 1).len(), leaves);
    assert_eq!(leaves, points.len(), "no two vertices of this mesh coincide");
}

#[test]
fn every_level_covers_every_vertex_with_more_and_smaller_spheres() {
    let (tree, points) = strawberry();
    let levels: Vec<_> = (0..=tree.depth()).map(|level| tree.spheres_at_level(level)).collect();
    for spheres in &levels {
        for point in &points {
            let holds = |s: &Sphere| (point - s.centre).norm() <= s.radius * (1.0 + 1e-12);
            assert!(spheres.iter().any(holds));
        }
    }
    let mean =
        |spheres: &[Sphere]| spheres.iter().map(|s| s.radius).sum::<f64>() / spheres.len() as f64;
    for pair in levels.windows(2) {
        assert!(pair[0].len() < pair[1].len() && mean(&pair[0]) > mean(&pair[1]));
    }
}

#[test]
fn one_vertex_is_one_level() {
    let tree = SphereTree::try_build(&[Point3::origin()], &[0]).unwrap();
    assert_eq!((tree.depth(), tree.spheres_at_level(0).len()), (0, 1));
}

#[test]
fn bad_input_is_refused_with_its_node() {
    let mut positions = vec![Point3::origin(); 3];
    assert_eq!(SphereTree::try_build(&positions, &[]), Err(TreeError::NoVertices));
    let error = SphereTree::try_build(&positions, &[0, 3]).unwrap_err();
    assert_eq!(error, TreeError::IndexOutOfRange { node: 3, node_count: 3 });
    for bad in [f64::NAN, f64::INFINITY, 1e200] {
        positions[1].y = bad;
        let error = SphereTree::try_build(&positions, &[0, 1]).unwrap_err();
        assert_eq!(error, TreeError::NotFinite { node: 1 });
        assert!(SphereTree::try_build(&positions, &[0, 2]).is_ok());
    }
}

#[test]
fn coincident_vertices_share_one_leaf_and_end_the_subdivision() {
    let positions = vec![Point3::new(1.0, 2.0, 3.0); 50];
    let all: Vec<u32> = (0..50).collect();
    let tree = SphereTree::try_build(&positions, &all).unwrap();
    assert_eq!((tree.sphere_count(), tree.vertex_count()), (1, 50));
}

#[test]
fn order_and_repetition_of_the_surface_nodes_do_not_matter() {
    let positions: Vec<_> =
        (0..40).map(|i| Point3::new(f64::from(i * 7 % 40), f64::from(i), 0.5)).collect();
    let forward: Vec<u32> = (0..40).collect();
    let backward: Vec<u32> = (0..40).rev().chain(5..9).collect();
    let tree = SphereTree::try_build(&positions, &forward).unwrap();
    assert_eq!(tree, SphereTree::try_build(&positions, &backward).unwrap());
}
