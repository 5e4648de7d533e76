//! A bar in tension: pulled at one end, with lateral contraction free.

use nalgebra::{Point3, Vector3};
use softgrasp_core::fem::Element;

use super::block::{block, shaken};
use super::discrete::Discrete;
use super::outcome::Outcome;
use softgrasp_bench::report::ReportError;

const YOUNG: f64 = 1e5;
const LENGTH: f64 = 3.0;
/// Traction on the end, Pa.
const PULL: f64 = 100.0;

/// Error at the nodes of an eighth of the bar, with irregular inner nodes and `cells` boxes across.
///
/// Closed form: `u = (σ / E) (x, −ν y, −ν z)`, held by every element.
///
/// # Errors
/// [`ReportError`].
pub fn tension(element: Element, poisson: f64, cells: usize) -> Result<Outcome, ReportError> {
    let straight = |p: Vector3<f64>| Point3::new(LENGTH * p.x, p.y, p.z);
    let mesh = shaken(&block([3 * cells, cells, cells], straight)?, 0.15 / cells as f64)?;
    let discrete = Discrete::new(&mesh, element, YOUNG, poisson)?;
    let mut given = discrete.give(0, 0.0, |p| p.x == 0.0);
    given.extend(discrete.give(1, 0.0, |p| p.y == 0.0));
    given.extend(discrete.give(2, 0.0, |p| p.z == 0.0));
    let forces = discrete.traction(|corners, _| {
        corners.iter().all(|p| p.x == LENGTH).then_some(Vector3::new(PULL, 0.0, 0.0))
    });
    let answer = discrete.solve(given, forces)?;
    let exact =
        |p: &Point3<f64>| Vector3::new(p.x, -poisson * p.y, -poisson * p.z) * (PULL / YOUNG);
    let end = discrete.nodes().iter().position(|p| *p == Point3::new(LENGTH, 0.0, 0.0));
    let solved = discrete.solved("bar", poisson, cells, &answer);
    let outcome = solved
        .with_error("displacement, worst node", answer.error_at_nodes(discrete.nodes(), exact));
    Ok(Outcome {
        computed: end.map(|n| answer.at(n).x),
        expected: Some(LENGTH * PULL / YOUNG),
        ..outcome
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accuracy::ELEMENTS;
    use crate::accuracy::outcome::ROUNDING;

    #[test]
    fn bar_in_tension_becomes_longer_and_thinner_by_hookes_law() {
        for &element in ELEMENTS {
            for poisson in [0.0, 0.3, 0.49] {
                let outcome = tension(element, poisson, 3).unwrap();
                println!("{outcome:?}");
                let (computed, expected) = (outcome.computed.unwrap(), outcome.expected.unwrap());
                assert!((computed / expected - 1.0).abs() < ROUNDING, "{outcome:?}");
                assert!(outcome.error_rel < ROUNDING, "{outcome:?}");
            }
        }
    }
}
