//! A beam along an eighth of a circle, pushed out of its plane.

use std::f64::consts::FRAC_PI_4;

use nalgebra::{Point3, Vector3};
use softgrasp_core::fem::Element;
use softgrasp_core::fem::hyperelastic::Law;

use super::followed::Followed;
use super::row::Row;
use crate::accuracy::block::block;
use crate::accuracy::discrete::Discrete;
use softgrasp_bench::report::ReportError;

const RADIUS: f64 = 100.0;
const YOUNG: f64 = 1e7;
/// Force on the end, out of the plane; the section is a square of edge 1.
const FORCE: f64 = 600.0;

/// Displacement of the tip along the axes.
///
/// Source: NAFEMS 3DNLG-5, after Bathe and Bolourchi, Int. J. Numer. Meth. Engng 14 (1979) 961.
const PUBLISHED: [(&str, f64); 3] = [("tip, x", -13.74), ("tip, y", -23.85), ("tip, z", 53.63)];

/// Steps that the force is given in.
const STEPS: usize = 8;
/// Boxes along the beam for one over its section, which then are six times as long as wide.
const SLENDER: usize = 16;

/// Displacement of the tip with `cells` boxes along the beam and a sixteenth of that over each edge
/// of the section: one box there cannot warp as a twisted square does, and is too stiff.
///
/// # Errors
/// [`ReportError`].
pub fn pushed(element: Element, cells: usize) -> Result<Vec<Row>, ReportError> {
    followed(element, ("45° bend", cells), (cells / SLENDER).max(1), STEPS)
}

/// Displacement of the tip with one box over the section and the whole force in one step.
///
/// # Errors
/// [`ReportError`].
pub fn pushed_at_once(element: Element, cells: usize) -> Result<Vec<Row>, ReportError> {
    followed(element, ("45° bend, at once", cells), 1, 1)
}

fn followed(
    element: Element,
    (name, cells): (&'static str, usize),
    over: usize,
    steps: usize,
) -> Result<Vec<Row>, ReportError> {
    let place = |p: Vector3<f64>| {
        let (angle, radius) = (FRAC_PI_4 * p.x, RADIUS + p.y - 0.5);
        Point3::new(RADIUS - radius * angle.cos(), radius * angle.sin(), p.z - 0.5)
    };
    let mesh = block([cells, over, over], place)?;
    let discrete = Discrete::new(&mesh, element, YOUNG, 0.0)?;
    let clamped: Vec<bool> = discrete.nodes().iter().map(|p| p.y.abs() < 1e-9).collect();
    let given = discrete.give_field(&clamped, |_| Vector3::zeros());
    let is_end = |p: &Point3<f64>| (p.y - (RADIUS - p.x)).abs() < 1e-9;
    let forces = |share: f64| {
        let traction = Vector3::new(0.0, 0.0, share * FORCE);
        discrete.traction(|corners, _| corners.iter().all(is_end).then_some(traction))
    };
    let mut body = Followed::new(&discrete, Law::NeoHookeanLog, &given, (name, 0.0, cells))?;
    let end = body.follow(steps, |share| (given.clone(), forces(share)))?;
    let tip = body.mean(&forces(1.0), 2);
    let figures = [0, 1, 2].map(|axis| (PUBLISHED[axis].0, tip[axis], PUBLISHED[axis].1));
    Ok(body.rows(FORCE, &end, &figures))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Errors as measured on the finer mesh: 0.3, 0.4 and 0.1 %.
    #[test]
    fn tip_of_the_bend_comes_to_its_published_place() {
        let [coarse, fine] = [16, 32].map(|cells| pushed(Element::Tet10, cells).unwrap());
        println!("{coarse:?}\n{fine:?}");
        for (coarse, fine) in coarse.iter().zip(&fine) {
            assert!(fine.outcome.error_rel < 0.006, "{fine:?}");
            assert!(fine.order_from(coarse) > 1.0, "{coarse:?} {fine:?}");
        }
    }
}
