//! The local model against a naive solution of the law of contact, and by what springs and friction do.

use nalgebra::{DMatrix, DVector, Point3, Vector3};
use proptest::prelude::*;

use crate::{LocalModel, SmallContact, SmallSystem};

fn contact(normal: Vector3<f64>, force: Vector3<f64>, friction: f64) -> SmallContact {
    SmallContact {
        body: 0,
        port: Some(0),
        place_in_body: Point3::origin(),
        place: Point3::origin(),
        normal,
        force,
        friction,
    }
}

/// A finger that presses down on a spring in all directions.
fn spring(stiffness: f64, force: f64, friction: f64) -> LocalModel {
    let pressing = contact(-Vector3::z(), Vector3::new(0.0, 0.0, -force), friction);
    let compliance = DMatrix::identity(3, 3) / stiffness;
    LocalModel::new(SmallSystem::try_new(vec![pressing], compliance).unwrap(), f64::INFINITY)
}

fn force_at(model: &mut LocalModel, x: f64, z: f64) -> Vector3<f64> {
    let found = model.forces_at(&[Point3::new(x, 0.0, z)]);
    assert!(found.is_converged, "{found:?}");
    found.forces[0]
}

#[test]
fn a_spring_gives_newtons_and_lets_go() {
    let mut model = spring(250.0, 0.5, 0.8);
    let z = |z, model: &mut LocalModel| force_at(model, 0.0, z).z;
    assert!((z(0.0, &mut model) + 0.5).abs() < 1e-9);
    assert!((z(-4e-3, &mut model) + 1.5).abs() < 1e-9, "4 mm deeper are one newton more");
    assert!((z(1e-3, &mut model) + 0.25).abs() < 1e-9);
    assert_eq!(z(2.5e-3, &mut model), 0.0, "a finger that leaves is not pulled");
    assert!((z(0.0, &mut model) + 0.5).abs() < 1e-9, "it presses again where it did");
}

#[test]
fn friction_sticks_slips_and_turns_round() {
    let mut model = spring(100.0, 1.0, 0.5);
    let mut x = |x| force_at(&mut model, x, 0.0).x;
    assert!((x(4e-3) - 0.4).abs() < 1e-6, "sticks");
    for step in 5..=12 {
        let force = x(f64::from(step) * 1e-3);
        assert!((force - 0.5).abs() < 1e-6, "slips at the cone: {force}");
    }
    assert!((x(10e-3) - 0.3).abs() < 1e-6, "on the way back it sticks where it had slipped to");
    assert!((x(0.0) + 0.5).abs() < 1e-6, "and slips the other way");
}

#[test]
fn a_closed_path_with_friction_takes_energy() {
    let mut model = spring(100.0, 1.0, 0.5);
    let place = |k: i32| {
        let angle = f64::from(k) * std::f64::consts::TAU / 400.0;
        (8e-3 * angle.sin(), 2e-3 * (angle.cos() - 1.0))
    };
    let (mut work, mut last) = (0.0, place(0));
    let mut held = force_at(&mut model, last.0, last.1);
    for k in 1..=1200 {
        let now = place(k);
        // The force of the last tick is held on the way to this one.
        work += held.x * (now.0 - last.0) + held.z * (now.1 - last.1);
        held = force_at(&mut model, now.0, now.1);
        last = now;
    }
    assert!(work > 0.01, "{work}");
}

#[test]
fn a_resultant_that_leans_more_than_its_friction_is_kept_at_its_place() {
    let pressing = contact(-Vector3::z(), Vector3::new(0.9, 0.0, -1.0), 0.5);
    let system = SmallSystem::try_new(vec![pressing], DMatrix::identity(3, 3) / 100.0).unwrap();
    let mut model = LocalModel::new(system, f64::INFINITY);
    assert!((force_at(&mut model, 0.0, 0.0) - pressing.force).norm() < 1e-6);
}

#[test]
fn a_softened_spring_is_without_force_where_the_true_one_is() {
    let pressing = contact(-Vector3::z(), -Vector3::z(), 0.5);
    let system = SmallSystem::try_new(vec![pressing], DMatrix::identity(3, 3) / 1000.0).unwrap();
    let mut model = LocalModel::new(system, 250.0);
    assert!((model.softened() - 0.75).abs() < 1e-9);
    // The true one is a millimetre deep.
    assert!((force_at(&mut model, 0.0, 0.0).z + 0.25).abs() < 1e-9);
    assert!(force_at(&mut model, 0.0, 0.999e-3).z.abs() < 1e-3);
    assert_eq!(force_at(&mut model, 0.0, 1.001e-3).z, 0.0);
}

/// The law solved as slowly and plainly as can be: forces go against their motions by a little, and back
/// into their cones, ever again.
fn naive(system: &SmallSystem, places: &[Point3<f64>]) -> DVector<f64> {
    let contacts = system.contacts();
    let c = system.compliance();
    let moved: Vec<f64> = contacts
        .iter()
        .zip(places)
        .flat_map(|(contact, place)| <[f64; 3]>::from(place - contact.place))
        .collect();
    let free = -(c * system.forces() + DVector::from_vec(moved));
    let step = 0.2 / c.symmetric_eigenvalues().max();
    let mut force = system.forces();
    for _ in 0..200_000 {
        let motion = c * &force + &free;
        for (i, contact) in contacts.iter().enumerate() {
            let own = motion.fixed_rows::<3>(3 * i).into_owned();
            let gap = own.dot(&contact.normal);
            let slip = own - contact.normal * gap;
            let corrected = own + contact.normal * (contact.friction * slip.norm());
            let tried = force.fixed_rows::<3>(3 * i) - step * corrected;
            let normal = tried.dot(&contact.normal);
            let tangent = tried - contact.normal * normal;
            let (size, mu) = (tangent.norm(), contact.friction);
            let inside = if size <= mu * normal {
                tried
            } else if mu * size <= -normal {
                Vector3::zeros()
            } else {
                let normal = (normal + mu * size) / (1.0 + mu * mu);
                contact.normal * normal + tangent * (mu * normal / size)
            };
            force.fixed_rows_mut::<3>(3 * i).copy_from(&inside);
        }
    }
    force
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn forces_are_those_of_the_plain_law(
        count in 1..=5usize,
        numbers in prop::collection::vec(-1.0..1.0f64, 225),
        normals in prop::collection::vec(prop::array::uniform3(-1.0..1.0f64), 5),
        forces in prop::collection::vec(prop::array::uniform3(-0.2..0.2f64), 5),
        ways in prop::collection::vec(prop::array::uniform3(-2e-3..2e-3f64), 5),
        friction in 0.0..0.4f64,
    ) {
        let rows = 3 * count;
        let a = DMatrix::from_fn(rows, rows, |r, c| numbers[r * 15 + c]);
        let compliance =
            2e-3 * (0.3 / rows as f64 * &a * a.transpose() + DMatrix::identity(rows, rows));
        let contacts: Vec<SmallContact> = (0..count)
            .map(|i| {
                let normal = Vector3::from(normals[i]);
                let unit = normal.try_normalize(1e-3).unwrap_or(Vector3::z());
                let lean = Vector3::from(forces[i]);
                let tangent = lean - unit * lean.dot(&unit);
                // A force of the answer obeys its cone.
                let force = unit + tangent.cap_magnitude(friction);
                contact(unit, force, friction)
            })
            .collect();
        let system = SmallSystem::try_new(contacts, compliance).unwrap();
        let places: Vec<Point3<f64>> = ways[..count].iter().map(|w| Point3::from(*w)).collect();
        let expected = naive(&system, &places);
        let found = LocalModel::new(system, f64::INFINITY).forces_at(&places);
        prop_assert!(found.is_converged);
        for (i, force) in found.forces.iter().enumerate() {
            let off = (force - expected.fixed_rows::<3>(3 * i)).norm();
            prop_assert!(off < 1e-4 * (1.0 + expected.norm()), "{off:e} {force} {expected}");
        }
    }
}
