//! Cook's membrane in plane strain, nearly incompressible, at large deformation.

use nalgebra::{Point3, Vector3};
use softgrasp_core::fem::Element;
use softgrasp_core::fem::hyperelastic::Law;

use super::followed::{Followed, nearest};
use super::row::Row;
use crate::accuracy::block::block;
use crate::accuracy::discrete::Discrete;
use softgrasp_bench::report::ReportError;

/// κ and μ, N/mm².
const BULK: f64 = 400_942.0;
const SHEAR: f64 = 80.1938;
/// Force on the edge for each unit of thickness.
const FORCE: f64 = 100.0;
/// Vertical displacement of the upper corner: published values of elements that do not lock, within 0.1.
const PUBLISHED: f64 = 6.93;
/// Number of steps of the force.
const STEPS: usize = 2;

/// Vertical displacement of the upper corner, with `cells` × `cells` boxes and one through the
/// thickness, along which nothing moves.
///
/// # Errors
/// [`ReportError`].
pub fn sheared(element: Element, cells: usize) -> Result<Vec<Row>, ReportError> {
    let young = 9.0 * BULK * SHEAR / (3.0 * BULK + SHEAR);
    let poisson = (3.0 * BULK - 2.0 * SHEAR) / (2.0 * (3.0 * BULK + SHEAR));
    // In plane strain the thickness is free to choose: boxes are about as thick as wide.
    let thickness = 40.0 / cells as f64;
    let panel = |p: Vector3<f64>| {
        let (low, high) = (44.0 * p.x, 44.0 + 16.0 * p.x);
        Point3::new(48.0 * p.x, low + (high - low) * p.y, thickness * p.z)
    };
    let mesh = block([cells, cells, 1], panel)?;
    let discrete = Discrete::new(&mesh, element, young, poisson)?;
    let mut given = discrete.give(0, 0.0, |p| p.x == 0.0);
    given.extend(discrete.give(1, 0.0, |p| p.x == 0.0));
    given.extend(discrete.give(2, 0.0, |_| true));
    let forces = |share: f64| {
        let traction = Vector3::new(0.0, share * FORCE / 16.0, 0.0);
        discrete.traction(|corners, _| corners.iter().all(|p| p.x == 48.0).then_some(traction))
    };
    let about = ("Cook's membrane", poisson, cells);
    let mut body = Followed::new(&discrete, Law::NeoHookean, &given, about)?;
    let end = body.follow(STEPS, |share| (given.clone(), forces(share)))?;
    let corner = nearest(discrete.nodes(), &Point3::new(48.0, 60.0, 0.0));
    Ok(body.rows(FORCE, &end, &[("upper corner", body.at(corner).y, PUBLISHED)]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Within the 0.1 that printed values scatter by, and 1 % more for the mesh, with ten nodes;
    /// linear elements come nearer from below.
    #[test]
    fn cooks_membrane_comes_to_its_published_displacement() {
        let displacement =
            |element, cells| sheared(element, cells).unwrap()[0].outcome.computed.unwrap();
        let ten = displacement(Element::Tet10, 8);
        assert!((ten - PUBLISHED).abs() < 0.1 + 0.07, "{ten}");
        let averaged = [8, 16].map(|cells| displacement(Element::Tet4Anp, cells));
        assert!(averaged[0] < averaged[1] && averaged[1] < PUBLISHED, "{averaged:?}");
        assert!(averaged[1] > 6.5, "{averaged:?}");
        assert!(displacement(Element::Tet4, 16) < averaged[1], "{averaged:?}");
    }
}
