//! Tests of the laws against differences, second formulas and small strain.

use nalgebra::{Matrix3, Rotation3, SMatrix, Vector3};
use proptest::prelude::*;

use super::super::tangent::positive_part;
use super::*;

const LAWS: [Law; 2] = [Law::NeoHookean, Law::NeoHookeanLog];

fn moduli(law: Law, poisson: f64) -> Moduli {
    Moduli::new(law, &Material::try_new(1.0, poisson).unwrap())
}

/// The energy as it is printed.
fn energy_as_printed(law: Law, poisson: f64, f: &Matrix3<f64>) -> f64 {
    let material = Material::try_new(1.0, poisson).unwrap();
    let (mu, kappa, lambda) =
        (material.shear_modulus(), material.bulk_modulus(), material.lame_lambda());
    let (j, squares) = (f.determinant(), f.norm_squared());
    match law {
        Law::NeoHookean => {
            mu / 2.0 * (j.powf(-2.0 / 3.0) * squares - 3.0) + kappa / 2.0 * (j - 1.0).powi(2)
        }
        Law::NeoHookeanLog => {
            mu / 2.0 * (squares - 3.0) - mu * j.ln() + lambda / 2.0 * j.ln().powi(2)
        }
    }
}

/// The tangent as a 9 × 9 matrix over `dF` column by column.
fn as_matrix(tangent: &TangentCoefficients, point: &Deformed) -> SMatrix<f64, 9, 9> {
    let mut matrix = SMatrix::<f64, 9, 9>::zeros();
    for column in 0..9 {
        let mut df = Matrix3::zeros();
        df[column] = 1.0;
        matrix.column_mut(column).copy_from_slice(tangent.apply(point, &df).as_slice());
    }
    matrix
}

fn gradient() -> impl Strategy<Value = Matrix3<f64>> {
    prop::array::uniform9(-0.6..0.6f64)
        .prop_map(|h| Matrix3::from_row_slice(&h))
        .prop_filter("inside out", |h| (h + Matrix3::identity()).determinant() > 0.1)
}

proptest! {
    #[test]
    fn stress_is_the_slope_of_the_printed_energy(h in gradient(), nu in 0.0..0.48f64) {
        for law in LAWS {
            let point = Deformed::new(&h);
            let moduli = moduli(law, nu);
            let energy = energy_as_printed(law, nu, &point.f);
            prop_assert!((moduli.energy(&point) - energy).abs() < 1e-12 * (1.0 + energy));
            let stress = moduli.stress(&point);
            let step = 1e-5;
            for entry in 0..9 {
                let moved = |sign: f64| {
                    let mut f = point.f;
                    f[entry] += sign * step;
                    energy_as_printed(law, nu, &f)
                };
                let slope = (moved(1.0) - moved(-1.0)) / (2.0 * step);
                prop_assert!((slope - stress[entry]).abs() < 1e-6 * (1.0 + stress.amax()));
            }
        }
    }

    #[test]
    fn tangent_is_the_slope_of_the_stress(h in gradient(), nu in 0.0..0.48f64,
                                          df in prop::array::uniform9(-1.0..1.0f64)) {
        let df = Matrix3::from_row_slice(&df);
        for law in LAWS {
            let moduli = moduli(law, nu);
            let point = Deformed::new(&h);
            let step = 1e-6;
            let moved = |sign: f64| moduli.stress(&Deformed::new(&(h + df * (sign * step))));
            let slope = (moved(1.0) - moved(-1.0)) / (2.0 * step);
            let tangent = moduli.tangent(&point).apply(&point, &df);
            prop_assert!((slope - tangent).amax() < 1e-6 * (1.0 + tangent.amax()));
        }
    }

    #[test]
    fn positive_part_is_that_of_the_eigenvalues_of_the_whole_matrix(h in gradient(),
                                                                     nu in 0.0..0.48f64) {
        for law in LAWS {
            let point = Deformed::new(&h);
            let tangent = moduli(law, nu).tangent(&point);
            let eigen = as_matrix(&tangent, &point).symmetric_eigen();
            let mut naive = SMatrix::<f64, 9, 9>::zeros();
            for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
                naive += vector * vector.transpose() * value.max(0.0);
            }
            let closed = positive_part(&tangent, &point);
            prop_assert!((closed - naive).amax() < 1e-9 * (1.0 + naive.amax()));
        }
    }

    #[test]
    fn stress_turns_with_the_body(h in gradient(), nu in 0.0..0.48f64,
                                  axis in prop::array::uniform3(-3.0..3.0f64)) {
        let turn = Rotation3::new(Vector3::from(axis)).into_inner();
        for law in LAWS {
            let moduli = moduli(law, nu);
            let point = Deformed::new(&h);
            let turned = Deformed::new(&(turn * point.f - Matrix3::identity()));
            let (before, after) = (moduli.stress(&point), moduli.stress(&turned));
            prop_assert!((turn * before - after).amax() < 1e-12 * (1.0 + before.amax()));
        }
    }
}

#[test]
fn rotation_by_any_angle_gives_no_stress() {
    for degrees in [1.0, 29.0, 90.0, 179.0, 360.0] {
        let axis = Vector3::new(1.0, 2.0, -0.5).normalize() * f64::to_radians(degrees);
        let h = Rotation3::new(axis).into_inner() - Matrix3::identity();
        for law in LAWS {
            assert!(moduli(law, 0.45).stress(&Deformed::new(&h)).amax() < 1e-13, "{degrees}");
        }
    }
}

#[test]
fn small_strain_gives_hookes_stress_to_the_last_digits() {
    let material = Material::try_new(1.0, 0.3).unwrap();
    let (mu, lambda) = (material.shear_modulus(), material.lame_lambda());
    let h = Matrix3::new(1.0, 0.5, -0.25, 0.5, -2.0, 0.75, -0.25, 0.75, 0.5) * 1e-12;
    let hooke = h * (2.0 * mu) + Matrix3::identity() * (lambda * h.trace());
    for law in LAWS {
        let stress = moduli(law, 0.3).stress(&Deformed::new(&h));
        assert!((stress - hooke).amax() < 1e-10 * hooke.amax(), "{law}");
    }
}

/// Figures of the logarithmic law with E = 1, ν = 0.3.
#[test]
fn homogeneous_states_have_the_derived_stresses() {
    let moduli = moduli(Law::NeoHookeanLog, 0.3);
    let stress = |stretches: [f64; 3]| {
        let h = Matrix3::from_diagonal(&(Vector3::from(stretches) - Vector3::repeat(1.0)));
        moduli.stress(&Deformed::new(&h))
    };
    for (along, lateral, expected) in
        [(0.5, 1.210767, -0.935352), (0.84, 1.052554, -0.184190), (2.0, 0.798078, 0.646745)]
    {
        let p = stress([along, lateral, lateral]);
        assert!((p[(0, 0)] - expected).abs() < 2e-6, "{along}: {}", p[(0, 0)]);
        assert!(p[(1, 1)].abs() < 2e-6);
    }
    let shear = Matrix3::new(0.0, 0.7, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    let point = Deformed::new(&shear);
    let cauchy = moduli.stress(&point) * point.f.transpose() / point.j;
    let mu = 1.0 / 2.6;
    assert!((cauchy[(0, 1)] - mu * 0.7).abs() < 1e-15);
    assert!((cauchy[(0, 0)] - mu * 0.49).abs() < 1e-15);
}

#[test]
fn names_read_back() {
    for law in LAWS {
        assert_eq!(law.as_str().parse(), Ok(law));
    }
    let error = "hooke".parse::<Law>().unwrap_err().to_string();
    assert!(error.contains("neo-hookean-log"));
}
