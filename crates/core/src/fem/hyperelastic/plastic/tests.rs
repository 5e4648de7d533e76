//! Tests of yielding points against differences, second formulas and small strain.

use nalgebra::{Rotation3, SMatrix};
use proptest::prelude::*;

use super::*;

const LAW: Hencky = Hencky { mu: 1.0, kappa: 2.5, radius: 0.3 };

/// Logarithmic strain of the elastic part, `½ ln Fe Feᵀ`, with axes of another making.
fn logarithmic_strain(fe: &Matrix3<f64>) -> Matrix3<f64> {
    let eigen = (fe * fe.transpose()).symmetric_eigen();
    let logs = eigen.eigenvalues.map(|value| 0.5 * value.ln());
    eigen.eigenvectors * Matrix3::from_diagonal(&logs) * eigen.eigenvectors.transpose()
}

fn deviator(e: &Matrix3<f64>) -> Matrix3<f64> {
    e - Matrix3::identity() * (e.trace() / 3.0)
}

/// The potential as it is printed.
fn potential_as_printed(law: Hencky, fe: &Matrix3<f64>) -> f64 {
    let Hencky { mu, kappa, radius } = law;
    let e = logarithmic_strain(fe);
    let size = deviator(&e).norm();
    let of_shape = match 2.0 * mu * size <= radius {
        true => mu * size * size,
        false => radius * size - radius * radius / (4.0 * mu),
    };
    0.5 * kappa * e.trace().powi(2) + of_shape
}

fn gradient() -> impl Strategy<Value = Matrix3<f64>> {
    prop::array::uniform9(-0.4..0.4f64)
        .prop_map(|h| Matrix3::from_row_slice(&h))
        .prop_filter("inside out", |h| (h + Matrix3::identity()).determinant() > 0.2)
}

/// A state that a few deformations left.
fn state() -> impl Strategy<Value = PlasticPoint> {
    prop::collection::vec(gradient(), 0..4).prop_map(|path| {
        path.iter().fold(PlasticPoint::default(), |state, h| {
            Trial::new(&state, &Deformed::new(h)).unwrap().committed(LAW)
        })
    })
}

fn law() -> impl Strategy<Value = Hencky> {
    // From much flow to none.
    (0.02..3.0f64).prop_map(|radius| Hencky { radius, ..LAW })
}

/// Distance from the yield surface, over its size: differences must not reach across.
fn off_yield(trial: &Trial<'_>, law: Hencky) -> f64 {
    (2.0 * law.mu * deviator(&logarithmic_strain(&trial.fe)).norm() / law.radius - 1.0).abs()
}

fn stress(state: &PlasticPoint, h: &Matrix3<f64>, law: Hencky) -> Matrix3<f64> {
    Trial::new(state, &Deformed::new(h)).unwrap().potential_and_stress(law).1
}

fn tangent_is_slope(state: &PlasticPoint, h: &Matrix3<f64>, df: &Matrix3<f64>, law: Hencky) {
    let step = 1e-6;
    let slope = (stress(state, &(h + df * step), law) - stress(state, &(h - df * step), law))
        / (2.0 * step);
    let trial = Trial::new(state, &Deformed::new(h)).unwrap();
    let tangent = trial.tangent(law, Curvature::AsItIs);
    let change = tangent.apply(df);
    assert!((slope - change).amax() < 1e-6 * (1.0 + change.amax()), "{slope} {change}");
    let through_matrix = tangent.matrix() * SMatrix::<f64, 9, 1>::from_column_slice(df.as_slice());
    let change = SMatrix::<f64, 9, 1>::from_column_slice(change.as_slice());
    assert!((through_matrix - change).amax() < 1e-12 * (1.0 + change.amax()));
}

proptest! {
    #[test]
    fn stress_is_the_slope_of_the_printed_potential(
        h in gradient(), state in state(), law in law(),
    ) {
        let trial = Trial::new(&state, &Deformed::new(&h)).unwrap();
        let (potential, stress) = trial.potential_and_stress(law);
        let printed = |h: &Matrix3<f64>| {
            potential_as_printed(law, &((h + Matrix3::identity()) * state.fp_inverse))
        };
        prop_assert!((potential - printed(&h)).abs() < 1e-12 * (1.0 + potential));
        let step = 1e-5;
        for entry in 0..9 {
            let moved = |sign: f64| {
                let mut h = h;
                h[entry] += sign * step;
                printed(&h)
            };
            let slope = (moved(1.0) - moved(-1.0)) / (2.0 * step);
            prop_assert!((slope - stress[entry]).abs() < 1e-5 * (1.0 + stress.amax()));
        }
    }

    #[test]
    fn tangent_is_the_slope_of_the_stress(
        h in gradient(), state in state(), law in law(), df in prop::array::uniform9(-1.0..1.0f64),
    ) {
        prop_assume!(off_yield(&Trial::new(&state, &Deformed::new(&h)).unwrap(), law) > 1e-3);
        tangent_is_slope(&state, &h, &Matrix3::from_row_slice(&df), law);
    }

    #[test]
    fn equal_stretches_have_their_tangent_too(
        stretches in prop::array::uniform2(0.6..1.6f64), same in 0..2usize, law in law(),
        axis in prop::array::uniform3(-3.0..3.0f64), df in prop::array::uniform9(-1.0..1.0f64),
    ) {
        let [one, other] = stretches;
        let turn = Rotation3::new(Vector3::from(axis)).into_inner();
        let third = if same == 0 { one } else { other };
        // Nearly equal as well.
        for off in [0.0, 1e-12, 1e-8, 1e-5] {
            let f = turn * Matrix3::from_diagonal(&Vector3::new(one, one + off, third));
            let state = PlasticPoint::default();
            let h = f - Matrix3::identity();
            let trial = Trial::new(&state, &Deformed::new(&h)).unwrap();
            if off_yield(&trial, law) > 1e-3 {
                tangent_is_slope(&state, &h, &Matrix3::from_row_slice(&df), law);
            }
        }
    }

    #[test]
    fn positive_part_is_that_of_the_eigenvalues_of_the_whole_matrix(
        h in gradient(), law in law(), state in state(),
    ) {
        let (rest, point) = (PlasticPoint::default(), Deformed::new(&h));
        let trial = Trial::new(&rest, &point).unwrap();
        let tangent = trial.tangent(law, Curvature::AsItIs).matrix();
        let eigen = (tangent + tangent.transpose()).symmetric_eigen();
        let positive = eigen.eigenvalues.map(|value| 0.5 * value.max(0.0));
        let axes = eigen.eigenvectors;
        let naive = axes * SMatrix::from_diagonal(&positive) * axes.transpose();
        let closed = trial.tangent(law, Curvature::PositivePart).matrix();
        prop_assert!((closed - naive).amax() < 1e-9 * (1.0 + naive.amax()));
        // From a plastic state it is no less than the tangent, and has no negative eigenvalue.
        let trial = Trial::new(&state, &point).unwrap();
        let (tangent, closed) = (trial.tangent(law, Curvature::AsItIs).matrix(), trial.tangent(law, Curvature::PositivePart).matrix());
        for matrix in [closed, closed - tangent] {
            let least = ((matrix + matrix.transpose()) * 0.5).symmetric_eigenvalues().min();
            prop_assert!(least > -1e-9 * (1.0 + closed.amax()), "{least}");
        }
    }

    #[test]
    fn below_the_yield_stress_kirchhoffs_stress_is_henckys(h in gradient()) {
        let law = Hencky { radius: 100.0, ..LAW };
        let f = h + Matrix3::identity();
        let e = logarithmic_strain(&f);
        let hencky = deviator(&e) * (2.0 * law.mu) + Matrix3::identity() * (law.kappa * e.trace());
        let state = PlasticPoint::default();
        let kirchhoff = stress(&state, &h, law) * f.transpose();
        prop_assert!((kirchhoff - hencky).amax() < 1e-12 * (1.0 + hencky.amax()));
        let after = Trial::new(&state, &Deformed::new(&h)).unwrap().committed(law);
        prop_assert_eq!(after.fp_inverse, Matrix3::identity());
        prop_assert_eq!(after.strain, 0.0);
    }

    #[test]
    fn flow_leaves_the_stress_on_the_yield_surface_and_keeps_volume(
        h in gradient(), state in state(), law in law(),
    ) {
        let (point, f) = (Deformed::new(&h), h + Matrix3::identity());
        let trial = Trial::new(&state, &point).unwrap();
        let after = trial.committed(law);
        prop_assert!((after.fp_inverse.determinant() - 1.0).abs() < 1e-14);
        let kirchhoff = stress(&state, &h, law) * f.transpose();
        let size = deviator(&kirchhoff).norm();
        prop_assert!(size < law.radius * (1.0 + 1e-12));
        // What flowed is gone: the same stress from elastic strain alone.
        let elastic = stress(&after, &h, Hencky { radius: 1e9, ..law }) * f.transpose();
        prop_assert!((elastic - kirchhoff).amax() < 1e-12 * (1.0 + kirchhoff.amax()));
        // On the yield surface the tangent is the elastic one.
        let again = Trial::new(&after, &point).unwrap();
        let [yielding, elastic] =
            [law, Hencky { radius: 1e9, ..law }].map(|law| again.tangent(law, Curvature::AsItIs).matrix());
        prop_assert!((yielding - elastic).amax() < 1e-9 * elastic.amax());
        // Strain counts flow: as much as the trial strain was above the yield stress.
        let above = deviator(&logarithmic_strain(&trial.fe)).norm() - 0.5 * law.radius / law.mu;
        let flowed = (2.0f64 / 3.0).sqrt() * above.max(0.0);
        prop_assert!((after.strain - state.strain - flowed).abs() < 1e-12);
    }

    #[test]
    fn stress_turns_with_the_body(
        h in gradient(), state in state(), axis in prop::array::uniform3(-3.0..3.0f64),
    ) {
        let turn = Rotation3::new(Vector3::from(axis)).into_inner();
        let turned = turn * (h + Matrix3::identity()) - Matrix3::identity();
        let (before, after) = (stress(&state, &h, LAW), stress(&state, &turned, LAW));
        prop_assert!((turn * before - after).amax() < 1e-12 * (1.0 + before.amax()));
        let committed = |h| Trial::new(&state, &Deformed::new(h)).unwrap().committed(LAW);
        let (before, after) = (committed(&h), committed(&turned));
        prop_assert!((before.fp_inverse - after.fp_inverse).amax() < 1e-12);
    }
}

#[test]
fn rotation_by_any_angle_gives_no_stress() {
    for degrees in [1.0, 29.0, 90.0, 179.0, 360.0] {
        let axis = Vector3::new(1.0, 2.0, -0.5).normalize() * f64::to_radians(degrees);
        let h = Rotation3::new(axis).into_inner() - Matrix3::identity();
        assert!(stress(&PlasticPoint::default(), &h, LAW).amax() < 1e-14, "{degrees}");
    }
}

#[test]
fn small_strain_gives_hookes_stress_to_the_last_digits() {
    let h = Matrix3::new(1.0, 0.5, -0.25, 0.5, -2.0, 0.75, -0.25, 0.75, 0.5) * 1e-12;
    let lambda = LAW.kappa - 2.0 / 3.0 * LAW.mu;
    let hooke = h * (2.0 * LAW.mu) + Matrix3::identity() * (lambda * h.trace());
    let stress = stress(&PlasticPoint::default(), &h, LAW);
    assert!((stress - hooke).amax() < 1e-10 * hooke.amax());
}

#[test]
fn points_without_volume_have_no_trial() {
    let flat = Matrix3::from_diagonal(&Vector3::new(-1.0, 0.0, 0.0));
    for h in [flat, flat * 2.0, Matrix3::from_element(f64::NAN), Matrix3::identity() * 1e300] {
        assert!(Trial::new(&PlasticPoint::default(), &Deformed::new(&h)).is_none(), "{h}");
    }
}
