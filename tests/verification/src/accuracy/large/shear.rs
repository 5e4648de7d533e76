//! Simple shear of a cube, given on all of its surface.

use nalgebra::{Matrix3, Point3};
use softgrasp_core::fem::hyperelastic::Law;
use softgrasp_core::fem::{Element, Material};

use super::followed::Followed;
use super::row::Row;
use crate::accuracy::block::{block, shaken};
use crate::accuracy::discrete::Discrete;
use softgrasp_bench::report::ReportError;

/// Cauchy stresses `σ₁₂ = μ γ` and `σ₁₁ = μ γ²`, from the forces on the surface of a cube with an
/// irregular inside, each from rest.
///
/// # Errors
/// [`ReportError`].
pub fn sheared(element: Element, poisson: f64, cells: usize) -> Result<Vec<Row>, ReportError> {
    let mesh = shaken(&block([cells; 3], Point3::from)?, 0.15 / cells as f64)?;
    let discrete = Discrete::new(&mesh, element, 1.0, poisson)?;
    let mu = Material::try_new(1.0, poisson)?.shear_modulus();
    let gradient = |shear: f64| {
        let mut f = Matrix3::identity();
        f[(0, 1)] = shear;
        f
    };
    let outside = discrete.on_surface();
    let given = |shear: f64| {
        let change = gradient(shear) - Matrix3::identity();
        discrete.give_field(&outside, |p| change * p.coords)
    };
    let mut rows = Vec::new();
    for shear in [0.5, 1.0] {
        let about = ("simple shear", poisson, cells);
        let mut body = Followed::new(&discrete, Law::NeoHookeanLog, &given(0.0), about)?;
        let end = body.follow(1, |_| (given(shear), Vec::new()))?;
        // The cube has the volume 1, and keeps it.
        let cauchy = body.stress_sum() * gradient(shear).transpose();
        let figures = [
            ("shear stress", cauchy[(0, 1)], mu * shear),
            ("normal stress", cauchy[(0, 0)], mu * shear * shear),
        ];
        rows.extend(body.rows(shear, &end, &figures));
    }
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accuracy::ELEMENTS;
    use crate::accuracy::outcome::ROUNDING;

    #[test]
    fn sheared_cubes_carry_normal_stress_too() {
        for &element in ELEMENTS {
            for poisson in [0.3, 0.49] {
                let rows = sheared(element, poisson, 3).unwrap();
                assert_eq!(rows.len(), 4);
                for row in rows {
                    assert!(row.outcome.error_rel < ROUNDING, "{row:?}");
                }
            }
        }
    }
}
