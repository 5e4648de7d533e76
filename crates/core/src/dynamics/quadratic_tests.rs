//! Contact of ten-node elements: the same laws and closed forms as for four-node ones.

use nalgebra::Vector3;

use super::law_tests::{EDGE, YOUNG, press_evenly};
use super::tests::{Object, at, lies_with_its_weight, off_hertz, table};
use super::*;
use crate::fem::hyperelastic::Law;
use crate::mesh::{BuiltIn, Surface};

#[test]
fn block_of_ten_node_elements_is_pressed_evenly_by_planes() {
    for corners in [27, 64, 125] {
        press_evenly(&Object::quadratic(BuiltIn::Cube, corners, EDGE, YOUNG, 0.3));
    }
}

#[test]
fn cube_of_ten_node_elements_lies_on_a_table_with_its_weight() {
    let cube = Object::quadratic(BuiltIn::Cube, 64, 0.05, 2.0e4, 0.4);
    assert!((cube.mass() - 1000.0 * 0.05_f64.powi(3)).abs() < 1e-12);
    lies_with_its_weight(&cube);
}

/// A ball whose boundary edges are arcs.
fn round_ball(corners: usize, radius: f64, (young, poisson): (f64, f64)) -> Object {
    let flat = Object::quadratic(BuiltIn::Sphere, corners, 2.0 * radius, young, poisson);
    let mut vertices = flat.model.mesh().vertices().to_vec();
    for &node in &flat.surface.nodes {
        let place = &mut vertices[node as usize];
        place.coords *= radius / place.coords.norm();
    }
    Object::new(flat.model.mesh().with_vertices(vertices).unwrap(), young, poisson)
}

#[test]
fn round_ball_of_ten_node_elements_is_pressed_as_hertz_says_on_finer_and_finer_meshes() {
    let (radius, material) = (0.03, (2.0e4, 0.4));
    let off = [100, 300, 700].map(|corners| {
        let ball = round_ball(corners, radius, material);
        off_hertz(&ball, radius, material)
    });
    assert!(off[0] < 0.15 && off[1] < 0.035 && off[2] < 0.035 && off[2] < off[1], "{off:?}");
}

#[test]
fn every_face_of_the_surface_is_four_triangles_that_cover_it() {
    let ball = Object::quadratic(BuiltIn::Sphere, 200, 0.06, 2.0e4, 0.4);
    let mesh = ball.model.mesh();
    let area = |triangles: &[[u32; 3]]| -> Vector3<f64> {
        let at = |n: u32| mesh.vertices()[n as usize];
        let of = |&[a, b, c]: &[u32; 3]| 0.5 * (at(b) - at(a)).cross(&(at(c) - at(a)));
        triangles.iter().map(|t| of(t).map(f64::abs)).sum()
    };
    let corners = Surface::from_mesh(mesh);
    assert_eq!(ball.surface.triangles.len(), 4 * corners.triangles.len());
    assert!((area(&ball.surface.triangles) - area(&corners.triangles)).norm() < 1e-12);
    assert!(ball.surface.nodes.len() > 3 * corners.nodes.len());
}

#[test]
fn ten_node_elements_are_pressed_at_large_deformation_too() {
    let cube = Object::quadratic(BuiltIn::Cube, 27, 0.05, 3.0e3, 0.4);
    let mut large = cube.large(Law::NeoHookean);
    let settings = StepSettings { viscosity: 0.02, ..StepSettings::default() };
    let mut state = ObjectState::at_rest(at(0.0, 0.0, 0.03));
    let mut found = None;
    for _ in 0..200 {
        let made = cube.advance_large(&mut large, &state, &[table(0.5)], settings);
        state = made.state.clone();
        found = Some(made);
    }
    let found = found.unwrap();
    let (force, weight) = (found.loads[0].force, 9.81 * cube.mass());
    assert!((force.z - weight).abs() < 1e-6 * weight, "{force} {weight}");
    assert!(found.is_converged && found.penetration_max < 1e-6 * 0.05);
}
