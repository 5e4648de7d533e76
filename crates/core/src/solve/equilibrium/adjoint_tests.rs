//! Tests of what has no adjoint.

use std::sync::Arc;

use super::*;
use crate::contact::Mask;
use crate::fem::hyperelastic::Law;
use crate::fem::{Element, Material};
use crate::mesh::{BuiltIn, generate};
use crate::model::Model;

/// An equilibrium that has converged on the branch of rest.
pub(super) fn converged() -> Equilibrium {
    Equilibrium {
        reactions: vec![],
        mask_forces: vec![],
        residual_rel: 1e-14,
        error_estimate_rel: 0.0,
        energy_error_rel: 0.0,
        energy: 1.0,
        jacobian_min: 1.0,
        newton_steps: 1,
        linear_solves: 1,
        factors: 1,
        factor_age: 0,
        substeps: 1,
        jumped: false,
        settled: true,
        plastic_strain: 0.0,
    }
}

/// A bar of the same width as long as six of them, pressed evenly along z to a share of its length: in
/// balance, as Poisson's ratio is 0.
pub(super) fn pressed_bar(share: f64, nodes: usize, by: TangentsBy) -> Path {
    let cube = generate(BuiltIn::Cube, nodes).unwrap();
    let stretched = cube.vertices().iter().map(|p| nalgebra::Point3::new(p.x, p.y, 6.0 * p.z));
    let mesh = crate::mesh::TetMesh::try_new(stretched.collect(), cube.tets().to_vec(), vec![]);
    let material = Material::try_new(1e5, 0.0).unwrap();
    let model =
        Model::try_new(mesh.unwrap(), Element::Tet4, &[material], vec![], &mut |_| {}).unwrap();
    let (low, high) = model.mesh().bounds();
    let ends = (0u32..).zip(model.mesh().vertices());
    let ends = ends.filter(|(_, p)| p.z < low.z + 1e-9 || p.z > high.z - 1e-9);
    let known: Vec<u32> = ends.flat_map(|(n, _)| 3 * n..3 * n + 3).collect();
    let places = model.mesh().vertices().iter();
    let q = places.flat_map(|p| [0.0, 0.0, (share - 1.0) * (p.z - low.z)]).collect();
    let hold = Arc::new(model.hold_by(&known, vec![], by, None).unwrap());
    let elements = Arc::new(model.hyperelastic(Law::NeoHookeanLog).unwrap());
    Path::new(elements, model.stiffness(), hold, q, false)
}

fn adjoint_of(path: &Path, equilibrium: &Equilibrium) -> Result<Adjoint, NoAdjoint> {
    let slopes = vec![1.0; path.displacement().len()];
    let known = vec![0.0; path.hold().dofs().len()];
    path.adjoint(equilibrium, &AdjointLoad { slopes: &slopes, known: &known })
}

#[test]
fn straight_bar_beyond_its_buckling_load_is_refused() {
    assert!(adjoint_of(&pressed_bar(0.97, 125, TangentsBy::Factors), &converged()).is_ok());
    assert_eq!(
        adjoint_of(&pressed_bar(0.6, 125, TangentsBy::Factors), &converged()),
        Err(NoAdjoint::NotStable)
    );
}

#[test]
fn equilibria_that_snapped_or_have_not_converged_are_refused() {
    let path = pressed_bar(0.97, 125, TangentsBy::Factors);
    let snapped = Equilibrium { jumped: true, ..converged() };
    assert_eq!(adjoint_of(&path, &snapped), Err(NoAdjoint::Snapped));
    for residual_rel in [1e-5, f64::NAN] {
        let early = Equilibrium { residual_rel, ..converged() };
        let refused = adjoint_of(&path, &early).unwrap_err();
        assert!(matches!(refused, NoAdjoint::NotConverged { .. }), "{refused}");
    }
}

#[test]
fn masks_and_flow_are_refused() {
    let mesh = generate(BuiltIn::Cube, 27).unwrap();
    let material = Material::try_new(1e5, 0.3).unwrap();
    let model = Model::try_new(mesh, Element::Tet4, &[material], vec![], &mut |_| {}).unwrap();
    let path = |known: &[u32], masks: Vec<Mask>, yield_stress: Option<f64>| {
        let hold = Arc::new(model.hold(known, masks, None).unwrap());
        let elements = Arc::new(model.yielding(Law::NeoHookean, yield_stress).unwrap());
        Path::new(elements, model.stiffness(), hold, vec![0.0; 81], false)
    };
    let face: Vec<u32> = (0..27).collect();
    assert!(adjoint_of(&path(&face, vec![], None), &converged()).is_ok());
    let masked = path(&face, vec![Mask::of_node(26)], None);
    assert_eq!(adjoint_of(&masked, &converged()), Err(NoAdjoint::Masks));
    let flowing = path(&face, vec![], Some(1e3));
    assert_eq!(adjoint_of(&flowing, &converged()), Err(NoAdjoint::Plastic));
}
