//! Tests of single requests: large turns, long pulls, lost branches, and the causes of refusals.

use std::sync::Arc;

use nalgebra::{Rotation3, Unit, Vector3};

use super::*;
use crate::fem::hyperelastic::Law;
use crate::fem::{Element, Material};
use crate::mesh::{BuiltIn, Surface, generate};
use crate::model::{Known, Model};

/// A cube, known nodes and forces.
struct Case {
    model: Model,
    known: Known,
    forces: Vec<f64>,
    is_single: bool,
    law: Law,
}

fn cube(nodes: usize, young: f64, poisson: f64, element: Element) -> Model {
    let mesh = generate(BuiltIn::Cube, nodes).unwrap();
    let material = Material::try_new(young, poisson).unwrap();
    Model::try_new(mesh, element, &[material], vec![], &mut |_| {}).unwrap()
}

impl Case {
    /// The nodes of lower and upper face moved to where `to` says.
    fn faces(model: Model, to: impl Fn(&Vector3<f64>, bool) -> Vector3<f64>) -> Self {
        let mesh = model.mesh();
        let (low, high) = mesh.bounds();
        let mut pairs = Vec::new();
        for (n, place) in (0u32..).zip(mesh.vertices()) {
            let is_upper = place.z > high.z - 1e-9;
            if is_upper || place.z < low.z + 1e-9 {
                let moved = to(&place.coords, is_upper) - place.coords;
                pairs.extend((0..3u32).map(|axis| (3 * n + axis, moved[axis as usize])));
            }
        }
        let known = model.known(pairs).unwrap();
        let forces = vec![0.0; 3 * model.system_node_count()];
        Self { model, known, forces, is_single: false, law: Law::NeoHookean }
    }

    /// Round patches of the surface about a tip each, pressed towards the origin and turned about that
    /// way. Units: m, rad.
    fn patches(model: Model, patches: &[(Vector3<f64>, [f64; 3])]) -> Self {
        let mesh = model.mesh();
        let surface = Surface::from_mesh(mesh);
        let mut pairs = Vec::new();
        for (tip, [radius, press, turn]) in patches {
            let inward = Unit::new_normalize(-tip);
            let turn = Rotation3::from_axis_angle(&inward, *turn);
            for &n in &surface.nodes {
                let place = mesh.vertices()[n as usize].coords;
                if (place - tip).norm() <= *radius && !pairs.iter().any(|(dof, _)| *dof == 3 * n) {
                    let moved = tip + turn * (place - tip) + *inward * *press - place;
                    pairs.extend((0..3u32).map(|axis| (3 * n + axis, moved[axis as usize])));
                }
            }
        }
        let known = model.known(pairs).unwrap();
        let forces = vec![0.0; 3 * model.system_node_count()];
        Self { model, known, forces, is_single: false, law: Law::NeoHookean }
    }

    fn path(&self) -> Path {
        let hold = self.model.hold(&self.known.dofs, vec![], None).unwrap();
        let elements = Arc::new(self.model.hyperelastic(self.law).unwrap());
        let rest = vec![0.0; 3 * self.model.system_node_count()];
        Path::new(elements, self.model.stiffness(), Arc::new(hold), rest, self.is_single)
    }

    fn goal(&self) -> Goal<'_> {
        Goal { q_known: &self.known.q_known, mask_q: &[], forces: &self.forces }
    }

    fn found(&self) -> (Path, Equilibrium) {
        let mut path = self.path();
        let found = path.find(&self.goal(), &Wish::EXACT).unwrap();
        assert!(found.settled && found.jacobian_min > 0.0, "{found:?}");
        (path, found)
    }

    fn refused(&self) -> NoEquilibrium {
        let mut path = self.path();
        let refused = path.find(&self.goal(), &Wish::EXACT).unwrap_err();
        assert!(path.displacement().iter().all(|u| *u == 0.0), "the shape stays");
        refused
    }
}

#[test]
fn a_rigid_half_turn_of_both_faces_is_found_exactly() {
    for (axis, angle) in [(Vector3::x(), 180.0f64), (Vector3::new(1.0, 2.0, -1.0), 150.0)] {
        let turn = Rotation3::from_axis_angle(&Unit::new_normalize(axis), angle.to_radians());
        let case = Case::faces(cube(64, 2.0e4, 0.3, Element::Tet4), |place, _| turn * place);
        let (path, found) = case.found();
        for (n, place) in case.model.mesh().vertices().iter().enumerate() {
            let u = Vector3::from_column_slice(&path.displacement()[3 * n..3 * n + 3]);
            assert!((turn * place.coords - place.coords - u).norm() < 1e-12, "{axis} node {n}");
        }
        assert!(found.energy.abs() < 1e-12 && !found.jumped, "{found:?}");
    }
}

#[test]
fn a_half_turn_with_a_press_is_the_press_turned() {
    let turn = Rotation3::from_axis_angle(&Vector3::y_axis(), std::f64::consts::PI);
    let pressed = |place: &Vector3<f64>, is_upper: bool| {
        place - if is_upper { Vector3::new(0.001, 0.0, 0.006) } else { Vector3::zeros() }
    };
    let plain = Case::faces(cube(64, 2.0e4, 0.4, Element::Tet4), pressed);
    let turned = Case::faces(cube(64, 2.0e4, 0.4, Element::Tet4), |p, up| turn * pressed(p, up));
    let (plain, turned_path) = (plain.found().0, turned.found().0);
    for (n, place) in turned.model.mesh().vertices().iter().enumerate() {
        let of = |path: &Path| Vector3::from_column_slice(&path.displacement()[3 * n..3 * n + 3]);
        let expected = turn * (place.coords + of(&plain)) - place.coords;
        assert!((of(&turned_path) - expected).norm() < 1e-9, "node {n}");
    }
}

/// Linear elements lock at this ratio, and their pressures make them buckle; averaged ones do not.
#[test]
fn a_press_of_a_tenth_near_the_incompressible_limit_does_not_snap_without_locking() {
    for element in [Element::Tet4Anp, Element::Tet10] {
        let pressed = |place: &Vector3<f64>, is_upper: bool| match is_upper {
            true => place - Vector3::z() * 0.006,
            false => *place,
        };
        let case = Case::faces(cube(343, 2.0e4, 0.4999, element), pressed);
        let (_, found) = case.found();
        assert!(!found.jumped, "{element:?}: {found:?}");
    }
}

/// Where volume is held against stiffly, long pieces of a descent spend all their factors on bringing it
/// back; the shape was refused, though it is stable and 40 small steps of Newton's method find it.
#[test]
fn two_turned_presses_near_the_incompressible_limit_are_found() {
    let mesh = generate(BuiltIn::Sphere, 600).unwrap();
    let material = Material::try_new(2.0e4, 0.4999).unwrap();
    let model = Model::try_new(mesh, Element::Tet4Anp, &[material], vec![], &mut |_| {}).unwrap();
    let patches = [
        (Vector3::new(0.01114, -0.01242, 0.03077), [0.00922, 0.00574, -0.435]),
        (Vector3::new(0.00829, -0.01940, 0.02793), [0.00828, 0.00494, -0.463]),
    ];
    let (_, found) = Case::patches(model, &patches).found();
    assert!(found.residual_rel < 1e-9 && found.jacobian_min > 0.3, "{found:?}");
}

/// The other law loses its stability in such a pull before any mesh does.
#[test]
fn cube_pulled_to_eleven_times_its_height_is_found_by_the_logarithmic_law() {
    for (poisson, volume) in [(0.0, 11.0), (0.3, 1.4), (0.45, 0.5)] {
        let pulled = |place: &Vector3<f64>, is_upper: bool| match is_upper {
            true => place + Vector3::z() * 0.6,
            false => *place,
        };
        let mut case = Case::faces(cube(125, 2.0e4, poisson, Element::Tet4), pulled);
        case.law = Law::NeoHookeanLog;
        let (_, found) = case.found();
        assert!(found.residual_rel < 1e-9 && found.jacobian_min > volume - 1e-9, "{found:?}");
    }
}

#[test]
fn young_or_size_beyond_what_squares_hold_is_refused_with_that_sentence() {
    for young in [1e300, 1e-300] {
        let case =
            Case::faces(cube(27, young, 0.3, Element::Tet4), |place, is_upper| match is_upper {
                true => place - Vector3::z() * 0.003,
                false => *place,
            });
        let refused = case.refused();
        assert!(matches!(refused, NoEquilibrium::OutOfRange { .. }), "{refused}");
        assert!(refused.to_string().contains("use other units for Young's modulus"), "{refused}");
    }
    // What linear elasticity answers in range is answered here too.
    for young in [1e90, 1e-90] {
        let case =
            Case::faces(cube(27, young, 0.3, Element::Tet4), |place, is_upper| match is_upper {
                true => place - Vector3::z() * 0.003,
                false => *place,
            });
        case.found();
    }
}

#[test]
fn faces_brought_together_near_the_incompressible_limit_are_refused_for_it() {
    let case =
        Case::faces(cube(125, 2.0e4, 0.4999, Element::Tet4), |place, is_upper| match is_upper {
            true => place - Vector3::z() * 0.05,
            false => *place,
        });
    let refused = case.refused();
    assert!(matches!(refused, NoEquilibrium::Incompressible { .. }), "{refused}");
    assert!(refused.to_string().contains("Poisson's ratio of 0.4999"), "{refused}");
}

#[test]
fn faces_pressed_through_each_other_are_refused_as_a_crease() {
    let case = Case::faces(cube(27, 2.0e4, 0.0, Element::Tet4), |place, is_upper| match is_upper {
        true => place - Vector3::z() * 0.07,
        false => *place,
    });
    let refused = case.refused();
    assert!(matches!(refused, NoEquilibrium::Creased { .. }), "{refused}");
    assert!(refused.to_string().contains("surfaces crease from about 60 % on"), "{refused}");
}

#[test]
fn forces_that_draw_a_body_out_without_end_are_refused_as_an_overload() {
    let mut case = Case::faces(cube(27, 2.0e4, 0.3, Element::Tet4), |place, _| *place);
    // The upper face is let go and drawn up with a hundred times what the section bears.
    let (low, high) = case.model.mesh().bounds();
    let is_lower = |dof: u32| case.model.mesh().vertices()[dof as usize / 3].z < low.z + 1e-9;
    let held = case.known.dofs.iter().copied().filter(|dof| is_lower(*dof)).map(|dof| (dof, 0.0));
    let known = case.model.known(held.collect()).unwrap();
    let section = (high.x - low.x) * (high.y - low.y);
    let upper: Vec<usize> = (0..case.model.mesh().vertices().len())
        .filter(|n| case.model.mesh().vertices()[*n].z > high.z - 1e-9)
        .collect();
    for node in &upper {
        case.forces[3 * node + 2] = 100.0 * 2.0e4 * section / upper.len() as f64;
    }
    case.known = known;
    let refused = case.refused();
    assert!(matches!(refused, NoEquilibrium::Overloaded { .. }), "{refused}");
    assert!(refused.to_string().contains("use smaller forces, or a stiffer material"), "{refused}");
}

/// Before any factor: two nodes of one edge are a hinge.
#[test]
fn a_body_that_forces_can_turn_about_its_holds_is_refused_with_that_motion() {
    let case = Case::faces(cube(27, 2.0e4, 0.3, Element::Tet4), |place, _| *place);
    let mesh = case.model.mesh();
    let low = mesh.bounds().0;
    let is_on_edge = |n: u32| {
        let place = mesh.vertices()[n as usize];
        place.z < low.z + 1e-9 && place.y < low.y + 1e-9
    };
    let hinge = case.known.dofs.iter().copied().filter(|dof| is_on_edge(*dof / 3));
    let Err(refused) = case.model.hold(&hinge.collect::<Vec<_>>(), vec![], None) else {
        panic!("a hinge holds nothing")
    };
    let said = refused.to_string();
    assert!(said.contains("can still turn about the axis"), "{said}");
    assert!(said.contains("prescribe all three axes of at least three nodes"), "{said}");
}
