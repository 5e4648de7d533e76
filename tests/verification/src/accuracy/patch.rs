//! Patch test: constant strain, prescribed on the surface of an irregular mesh, must be constant inside.

use nalgebra::{Matrix3, Point3, Vector3};
use softgrasp_core::fem::Element;

use super::block::{block, shaken};
use super::discrete::Discrete;
use super::outcome::Outcome;
use softgrasp_bench::report::ReportError;

/// Error at the nodes; every element represents a linear field, so only rounding may be left.
///
/// # Errors
/// [`ReportError`].
pub fn constant_strain(
    element: Element,
    poisson: f64,
    cells: usize,
) -> Result<Outcome, ReportError> {
    let mesh = shaken(&block([cells; 3], Point3::from)?, 0.15 / cells as f64)?;
    let discrete = Discrete::new(&mesh, element, 1.0, poisson)?;
    let gradient = Matrix3::new(0.01, 0.02, -0.03, 0.005, -0.015, 0.01, 0.02, 0.0, 0.03);
    let field = |p: &Point3<f64>| gradient * p.coords + Vector3::new(0.01, 0.0, -0.02);
    let answer = discrete.solve(discrete.give_field(&discrete.on_surface(), field), Vec::new())?;
    let solved = discrete.solved("patch", poisson, cells, &answer);
    Ok(solved
        .with_error("displacement, worst node", answer.error_at_nodes(discrete.nodes(), field)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accuracy::ELEMENTS;
    use crate::accuracy::outcome::ROUNDING;

    #[test]
    fn constant_strain_is_reproduced_by_every_element() {
        for &element in ELEMENTS {
            for poisson in [0.0, 0.3, 0.49] {
                let outcome = constant_strain(element, poisson, 4).unwrap();
                println!("{outcome:?}");
                assert!(
                    outcome.solved.unknown >= 81 && outcome.error_rel < ROUNDING,
                    "{outcome:?}"
                );
            }
        }
    }
}
