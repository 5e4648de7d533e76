//! A hollow sphere that is inflated.

use nalgebra::Point3;
use softgrasp_core::fem::hyperelastic::Law;
use softgrasp_core::fem::{Element, Material};

use super::followed::Followed;
use super::row::{End, Row};
use crate::accuracy::block::octant;
use crate::accuracy::discrete::Discrete;
use softgrasp_bench::report::ReportError;

const INNER: f64 = 1.0;
const OUTER: f64 = 2.0;
/// Stretches of the inner radius.
const STRETCHES: [f64; 2] = [1.5, 2.0];
/// Number of steps to each stretch.
const STEPS: usize = 5;

/// Pressure over μ, incompressible: `g(λ_b) − g(λ_a)` with `g(λ) = 2/λ + 1/(2 λ⁴)` and
/// `λ_b³ − 1 = (λ_a³ − 1) (a/b)³`.
///
/// Source: the balance of forces `p = ∫ 2 (σ_θ − σ_r) dr/r` with `σ_θ − σ_r = μ (λ² − λ⁻⁴)`.
fn pressure(stretch: f64) -> f64 {
    let of = |stretch: f64| 2.0 / stretch + 0.5 / stretch.powi(4);
    let outside = (1.0 + (stretch.powi(3) - 1.0) * (INNER / OUTER).powi(3)).cbrt();
    of(outside) - of(stretch)
}

/// Pressure inside an eighth whose inner radius is stretched, with `cells` edges along each quarter
/// circle and `cells` layers.
///
/// The pressure is the work of the inner forces on a further stretch over the volume that it opens.
///
/// # Errors
/// [`ReportError`].
pub fn widened(element: Element, poisson: f64, cells: usize) -> Result<Vec<Row>, ReportError> {
    let mesh = octant(INNER, OUTER, cells, cells)?;
    let discrete = Discrete::new(&mesh, element, 1.0, poisson)?;
    let mu = Material::try_new(1.0, poisson)?.shear_modulus();
    let is_inside =
        |corners: &[Point3<f64>; 3]| corners.iter().all(|p| p.coords.norm() < INNER * (1.0 + 1e-9));
    let inside = discrete.on_triangles(is_inside);
    let given = |stretch: f64| {
        let mut given = discrete.give_field(&inside, |p| p.coords * (stretch - 1.0));
        given.extend((0..3).flat_map(|axis| discrete.give(axis, 0.0, |p| p[axis] == 0.0)));
        given
    };
    let work = |forces: &[f64]| -> f64 {
        let nodes = discrete.nodes().iter().zip(forces.chunks_exact(3)).zip(&inside);
        let inner = nodes.filter(|(_, is_inside)| **is_inside);
        inner.map(|((p, f), _)| p.x * f[0] + p.y * f[1] + p.z * f[2]).sum()
    };
    // A pressure of 1 at rest; areas grow with the square of the stretch.
    let unit = discrete.traction(|corners, normal| is_inside(corners).then_some(-normal));
    let about = ("hollow sphere", poisson, cells);
    let mut body = Followed::new(&discrete, Law::NeoHookeanLog, &given(1.0), about)?;
    let (mut rows, mut before, mut end) = (Vec::new(), 1.0, End::Given);
    for stretch in STRETCHES {
        end = match end.has_shape() {
            true => body
                .follow(STEPS, |share| (given(before + share * (stretch - before)), Vec::new()))?,
            false => End::NotTried,
        };
        let computed = work(&body.forces()) / (work(&unit) * stretch * stretch) / mu;
        let figure = ("pressure over μ", computed, pressure(stretch));
        rows.extend(body.rows(stretch, &end, &[figure]));
        before = stretch;
    }
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn closed_form_has_the_digits_of_the_literature() {
        assert!((pressure(1.5) - 0.755433).abs() < 6e-7, "{}", pressure(1.5));
        assert!((pressure(2.0) - 0.806927).abs() < 6e-7, "{}", pressure(2.0));
    }

    /// Errors as measured on the finer mesh: 7.6 % with averaged pressures, 1.5 % with ten nodes.
    #[test]
    fn widened_spheres_have_the_pressure_of_the_closed_form() {
        for (element, error_max) in [(Element::Tet4Anp, 0.09), (Element::Tet10, 0.02)] {
            let [coarse, fine] = [2, 4].map(|cells| widened(element, 0.4999, cells).unwrap());
            println!("{coarse:?}\n{fine:?}");
            for (coarse, fine) in coarse.iter().zip(&fine) {
                assert!(fine.outcome.error_rel < error_max, "{fine:?}");
                assert!(fine.order_from(coarse) > 1.8, "{coarse:?} {fine:?}");
            }
        }
    }
}
