//! The skin against the computed shape: what is drawn may not leave it.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Point3, Vector3};
use softgrasp_core::mesh::{BuiltIn, generate};
use softgrasp_grasp::object::RestShape;

use super::{Look, ObjectSkin, Part};

fn rest(shape: BuiltIn, nodes: usize) -> RestShape {
    RestShape::try_new(generate(shape, nodes).unwrap()).unwrap()
}

fn skin(shape: BuiltIn, nodes: usize) -> (RestShape, ObjectSkin) {
    let rest = rest(shape, nodes);
    let skin = ObjectSkin::new(Look::of(shape.name()), &rest);
    (rest, skin)
}

/// A smooth deformation of some millimetres, another one for each `kind`.
fn deformed(rest: &RestShape, kind: usize) -> Vec<Point3<f64>> {
    let turn = kind as f64;
    let wave = |p: &Point3<f64>, d: usize| {
        let k = Vector3::new(40.0, 30.0, 50.0) + Vector3::repeat(9.0 * (turn + d as f64).sin());
        0.003 * (p.coords.dot(&k) + turn * 1.3 + d as f64).sin()
    };
    let moved = |p: &Point3<f64>| p + Vector3::from([0, 1, 2].map(|d| wave(p, d)));
    rest.mesh().vertices().iter().map(moved).collect()
}

fn at(part: &Part, vertex: u32) -> Vector3<f64> {
    Vector3::from(part.positions[vertex as usize].map(f64::from))
}

#[test]
fn every_computed_vertex_is_drawn_exactly_where_it_is() {
    for (shape, nodes) in [(BuiltIn::Cube, 125), (BuiltIn::Strawberry, 300)] {
        let (rest, mut skin) = skin(shape, nodes);
        for kind in 0..3 {
            let shape = deformed(&rest, kind);
            skin.follow(&shape);
            let bits = |p: [f32; 3]| p.map(f32::to_bits);
            let drawn: BTreeSet<_> = skin.parts()[0].positions.iter().map(|p| bits(*p)).collect();
            for node in &rest.surface().nodes {
                let p = shape[*node as usize];
                assert!(drawn.contains(&bits([p.x as f32, p.y as f32, p.z as f32])));
            }
        }
    }
}

/// Sides of drawn triangles that no other triangle with the same vertices shares.
fn open_sides(part: &Part) -> Vec<[u32; 2]> {
    let mut count: BTreeMap<[u32; 2], usize> = BTreeMap::new();
    for [a, b, c] in &part.triangles {
        for side in [[*a, *b], [*b, *c], [*c, *a]] {
            *count.entry(side).or_default() += 1;
        }
    }
    count.keys().filter(|[a, b]| !count.contains_key(&[*b, *a])).copied().collect()
}

#[test]
fn body_is_closed_across_creases_and_between_charts() {
    for (shape, nodes) in [(BuiltIn::Cube, 64), (BuiltIn::Toothpaste, 150), (BuiltIn::Sphere, 80)] {
        let (rest, mut skin) = skin(shape, nodes);
        skin.follow(&deformed(&rest, 1));
        let body = &skin.parts()[0];
        let open = open_sides(body);
        assert!(!open.is_empty(), "{shape}: creases and charts double vertices");
        for side in &open {
            let [a, b] = side.map(|v| at(body, v));
            let partner = open.iter().filter(|o| *o != side).any(|other| {
                let [c, d] = other.map(|v| at(body, v));
                (a - d).amax() < 1e-8 && (b - c).amax() < 1e-8
            });
            assert!(partner, "{shape}: gap at {a:?} {b:?}");
        }
    }
}

#[test]
fn values_of_constant_and_linear_fields_are_exact_on_flat_faces() {
    let (rest, skin) = skin(BuiltIn::Cube, 64);
    let mut drawn = Vec::new();
    skin.body_values(&vec![0.75; rest.mesh().node_count()], &mut drawn);
    assert_eq!(drawn.len(), skin.parts()[0].positions.len());
    assert!(drawn.iter().all(|v| (v - 0.75).abs() < 1e-6));
    let field = |p: &Vector3<f64>| 3.0 + 20.0 * p.x - 11.0 * p.y + 7.0 * p.z;
    let values: Vec<f64> = rest.mesh().vertices().iter().map(|p| field(&p.coords)).collect();
    skin.body_values(&values, &mut drawn);
    for (vertex, value) in (0..).zip(&drawn) {
        let expected = field(&at(&skin.parts()[0], vertex));
        assert!((f64::from(*value) - expected).abs() < 1e-5, "{value} for {expected}");
    }
}

#[test]
fn seeds_leaves_and_stalk_stay_on_the_fruit_however_it_deforms() {
    let (rest, mut skin) = skin(BuiltIn::Strawberry, 300);
    for kind in 0..4 {
        skin.follow(&deformed(&rest, kind));
        let [body, seeds, leaves, stalk] = skin.parts() else { panic!("four parts") };
        let per_seed = 33;
        assert_eq!(seeds.positions.len() % per_seed, 0);
        let count = seeds.positions.len() / per_seed;
        assert!((180..=220).contains(&count), "{count} seeds");
        for seed in seeds.positions.chunks(per_seed) {
            let middle: Vector3<f32> =
                seed.iter().map(|p| Vector3::from(*p)).sum::<Vector3<f32>>() / per_seed as f32;
            let distance = |i: usize| (Vector3::from(body.positions[i]) - middle).norm();
            let near = (0..body.positions.len())
                .min_by(|a, b| distance(*a).total_cmp(&distance(*b)))
                .unwrap();
            let above = (middle - Vector3::from(body.positions[near]))
                .dot(&Vector3::from(body.normals[near]));
            assert!(above.abs() < 0.001 && distance(near) < 0.002, "{above}");
        }
        for p in leaves.positions.iter().chain(&stalk.positions) {
            let p = Vector3::from(*p);
            let near = body.positions.iter().map(|b| (Vector3::from(*b) - p).norm());
            assert!(near.fold(f32::INFINITY, f32::min) < 0.016);
        }
    }
}

#[test]
fn all_parts_of_all_looks_are_whole_and_finite() {
    let looks = [
        (BuiltIn::Strawberry, 100, Look::Strawberry, 4),
        (BuiltIn::Toothpaste, 300, Look::Toothpaste, 2),
        (BuiltIn::Cube, 27, Look::Cube, 1),
        (BuiltIn::Sphere, 60, Look::Sphere, 1),
        // A look need not fit the mesh that a file holds.
        (BuiltIn::Cube, 60, Look::Strawberry, 4),
        (BuiltIn::Cube, 60, Look::Toothpaste, 1),
        (BuiltIn::Sphere, 60, Look::Imported, 1),
    ];
    for (shape, nodes, look, parts) in looks {
        let rest = rest(shape, nodes);
        let mut skin = ObjectSkin::new(look, &rest);
        skin.follow(&deformed(&rest, 2));
        assert_eq!(skin.parts().len(), parts, "{shape} as {look:?}");
        for part in skin.parts() {
            let count = part.positions.len();
            assert_eq!((part.normals.len(), part.uvs.len()), (count, count));
            assert!(part.triangles.iter().flatten().all(|v| (*v as usize) < count));
            assert!(part.positions.iter().flatten().all(|c| c.is_finite() && c.abs() < 0.12));
            assert!(part.uvs.iter().flatten().all(|c| (0.0..=1.0).contains(c)));
            for normal in &part.normals {
                let length = Vector3::from(*normal).norm();
                assert!((length - 1.0).abs() < 1e-4, "{}: {normal:?}", part.name);
            }
            let material = &part.material;
            for texture in material.texture.iter().chain(&material.relief) {
                let texels = texture.width as usize * texture.height as usize;
                assert_eq!(texture.rgba.len(), 4 * texels);
            }
        }
        let body = skin.parts()[0].positions.len();
        assert!(skin.wireframe().iter().flatten().all(|v| (*v as usize) < body));
    }
}

#[test]
fn drawn_triangles_are_small_but_not_too_many() {
    for nodes in [27, 1000, 5000] {
        let (_, skin) = skin(BuiltIn::Cube, nodes);
        let count = skin.parts()[0].triangles.len();
        assert!(count <= super::tessellation::TRIANGLES_MAX, "{count}");
        assert!(count >= 12_000, "{count}");
    }
}
