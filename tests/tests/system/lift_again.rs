//! Objects that slip out of the first grasp are lifted by a pinch of opposed places of their surface.

use glove_client::run::contact_grasp::ContactScene;
use nalgebra::{Point3, Vector3};
use softgrasp_core::mesh::{BuiltIn, TetMesh, generate};
use softgrasp_core::mesh_io;
use softgrasp_grasp::object::lying;
use softgrasp_tests::shared::shared;

use crate::lift::Lift;

/// A mesh moved to the origin, stretched along x, y and z, and laid on its flattest side.
fn laid(mesh: &TetMesh, stretch: impl Fn(Vector3<f64>) -> Vector3<f64>) -> TetMesh {
    let (low, high) = mesh.bounds();
    let (middle, factor) = (nalgebra::center(&low, &high), stretch(high - low));
    let moved = mesh.vertices().iter().map(|p| Point3::from((p - middle).component_mul(&factor)));
    lying(&mesh.with_vertices(moved.collect()).unwrap()).unwrap().0
}

fn of_size(shape: BuiltIn, nodes: usize, size_m: [f64; 3]) -> TetMesh {
    let mesh = generate(shape, nodes).unwrap();
    laid(&mesh, |extent| Vector3::from(size_m).component_div(&extent))
}

/// Highest place of an object in a run, m above its first, and how far it lies above the table at the end.
fn lifted(mesh: TetMesh) -> (f64, f64) {
    let mut lift = Lift::of(mesh, ContactScene::default());
    let mut highest = 0.0f64;
    while lift.tick().is_some() {
        highest = highest.max(lift.height());
    }
    (highest, lift.above_table())
}

/// Checks that an object is lifted, and higher than some m, and lies on the table at the end.
fn check(name: &str, mesh: TetMesh, least: f64) {
    let (highest, above) = lifted(mesh);
    assert!(highest > least, "{name}: lifted by {highest} m");
    assert!(above.abs() < 1e-3, "{name}: {above} m above the table at the end");
}

/// They slid out of the only grasp that was tried, and the script went on without them.
#[test]
fn flat_and_thin_objects_that_slip_are_lifted_at_the_second_try() {
    check("lens", of_size(BuiltIn::Sphere, 400, [0.08, 0.025, 0.07]), 0.05);
    check("bar", of_size(BuiltIn::Cube, 343, [0.08, 0.02, 0.03]), 0.05);
    let Some(folder) = shared("meshes") else { return };
    let name = "cylinder.medit.mesh";
    let bytes = std::fs::read(folder.join(name)).unwrap();
    let mesh = mesh_io::parse(name, &bytes, &mut |_| None).unwrap().mesh;
    check(name, laid(&mesh, |extent| Vector3::repeat(0.08 / extent.max())), 0.05);
}

/// It stood on a facet of its back, fell over, and the hand went after it as it pushed it along.
#[test]
fn banana_that_fell_over_beside_the_hand_lies_and_is_lifted() {
    let Some(folder) = shared("meshes") else { return };
    let name = "banana.vtk";
    let bytes = std::fs::read(folder.join(name)).unwrap();
    let mesh = mesh_io::parse(name, &bytes, &mut |_| None).unwrap().mesh;
    // Its first place is that of the banana that has not fallen over yet, which is higher.
    check(name, laid(&mesh, |extent| Vector3::repeat(0.16 / extent.max())), 0.04);
}
