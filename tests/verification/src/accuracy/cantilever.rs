//! A cantilever under a shear force at its end, against Timoshenko's beam.

use nalgebra::{Point3, Vector3};
use softgrasp_core::fem::Element;

use super::block::block;
use super::discrete::Discrete;
use super::outcome::Outcome;
use softgrasp_bench::report::ReportError;

const YOUNG: f64 = 1e5;
const POISSON: f64 = 0.3;
/// Length over height; the section is a square of edge 1.
const LENGTH: f64 = 10.0;
/// Force on the end, N.
const FORCE: f64 = 1.0;
/// Deflection `F L³ / (3 E I) + F L / (κ G A)` with κ of the square section.
///
/// Source: Timoshenko 1921; κ = 10 (1 + ν) / (12 + 11 ν), Cowper 1966.
fn deflection() -> f64 {
    let shear_modulus = YOUNG / (2.0 * (1.0 + POISSON));
    let kappa = 10.0 * (1.0 + POISSON) / (12.0 + 11.0 * POISSON);
    FORCE * LENGTH.powi(3) / (3.0 * YOUNG / 12.0) + FORCE * LENGTH / (kappa * shear_modulus)
}

/// Mean deflection of the loaded end, with `cells` boxes over the height, twice as long as high;
/// half of the beam, cut along its plane of symmetry.
///
/// # Errors
/// [`ReportError`].
pub fn end_load(element: Element, cells: usize) -> Result<Outcome, ReportError> {
    let counts = [(LENGTH as usize * cells) / 2, cells, cells.div_ceil(2)];
    let mesh = block(counts, |p| Point3::new(LENGTH * p.x, p.y - 0.5, 0.5 * p.z))?;
    let discrete = Discrete::new(&mesh, element, YOUNG, POISSON)?;
    let clamped: Vec<bool> = discrete.nodes().iter().map(|p| p.x == 0.0).collect();
    let mut given = discrete.give_field(&clamped, |_| Vector3::zeros());
    given.extend(discrete.give(2, 0.0, |p| p.z == 0.0));
    // The half that is cut off carries the other half of the force; the section has area 1.
    let forces = discrete.traction(|corners, _| {
        corners.iter().all(|p| p.x == LENGTH).then_some(Vector3::new(0.0, -FORCE, 0.0))
    });
    let answer = discrete.solve(given, forces.clone())?;
    // The mean that the force does its work on.
    let work: f64 = forces.iter().zip(answer.displacement()).map(|(f, u)| f * u).sum();
    let computed = work / (0.5 * FORCE);
    let solved = discrete.solved("cantilever", POISSON, cells, &answer);
    Ok(solved.with_number("deflection of the end", computed, deflection()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accuracy::{ELEMENTS, order};

    /// Largest difference between beam theory and the clamped body, relative to the deflection. The
    /// clamped end cannot deform laterally, which has effect as deep as the height; the energy there is 3
    /// h/L of the whole, and bending without lateral deformation is stiffer by ν² at most.
    const VALID_TO: f64 = 3.0 * POISSON * POISSON / LENGTH;

    /// Displacements that elements hold are stiffer than all displacements there are, so finer
    /// meshes give more, up to what beam theory says within its range. Ten-node elements hold
    /// bending as such; linear ones come nearer by the square of their size, less on coarse meshes.
    #[test]
    fn cantilever_comes_near_timoshenkos_deflection_from_below() {
        for &element in ELEMENTS {
            let [coarse, fine] = [2, 4].map(|cells| end_load(element, cells).unwrap());
            println!("{coarse:?}\n{fine:?}");
            assert!(coarse.computed < fine.computed, "{coarse:?} {fine:?}");
            assert!(fine.computed.unwrap() < deflection() * (1.0 + VALID_TO), "{fine:?}");
            if order(element) > 2.0 {
                assert!(fine.error_rel < VALID_TO, "{fine:?}");
            } else {
                assert!(fine.order_from(&coarse) > 1.0, "{coarse:?} {fine:?}");
            }
        }
    }
}
