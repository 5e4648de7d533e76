//! A block pressed on part of its upper face to a third of its height.

use nalgebra::{Point3, Vector3};
use softgrasp_core::fem::Element;
use softgrasp_core::fem::hyperelastic::Law;

use super::followed::{Followed, nearest};
use super::row::{End, Row};
use crate::accuracy::block::block;
use crate::accuracy::discrete::Discrete;
use softgrasp_bench::report::ReportError;

/// Shear modulus μ, N/mm².
const SHEAR: f64 = 80.194;
const POISSON: f64 = 0.4999;
/// Unit of the pressure, N/mm².
const PRESSURE: f64 = 4.0;
/// Steps from one pressure to the next.
const STEPS: usize = 2;

/// Pressure over its unit, and compression of the middle of the loaded face over the height.
///
/// Source: Reese and Wriggers, as in step 44 of deal.II.
const PUBLISHED: [(f64, f64); 4] = [(20.0, 0.219), (40.0, 0.424), (60.0, 0.584), (80.0, 0.692)];

/// Compression of the middle of the loaded face, with `cells` boxes (an even number) along each edge
/// of a quarter of the block.
///
/// The pressure keeps direction and area; the upper face moves vertically only.
///
/// # Errors
/// [`ReportError`].
pub fn compressed(element: Element, cells: usize) -> Result<Vec<Row>, ReportError> {
    let mesh = block([cells; 3], Point3::from)?;
    let young = 2.0 * (1.0 + POISSON) * SHEAR;
    let discrete = Discrete::new(&mesh, element, young, POISSON)?;
    let held =
        |axis: usize| discrete.give(axis, 0.0, |p| p[axis] == 0.0 || (axis < 2 && p.z == 1.0));
    let given: Vec<_> = (0..3).flat_map(held).collect();
    let pressed = |pressure: f64| {
        let traction = Vector3::new(0.0, 0.0, -pressure * PRESSURE);
        discrete.traction(|corners, _| {
            let is_loaded = corners.iter().all(|p| p.z == 1.0 && p.x <= 0.5 && p.y <= 0.5);
            is_loaded.then_some(traction)
        })
    };
    let middle = nearest(discrete.nodes(), &Point3::new(0.0, 0.0, 1.0));
    let about = ("compressed block", POISSON, cells);
    let mut body = Followed::new(&discrete, Law::NeoHookean, &given, about)?;
    let (mut rows, mut before, mut end) = (Vec::new(), 0.0, End::Given);
    for (pressure, expected) in PUBLISHED {
        end = match end.has_shape() {
            true => body.follow(STEPS, |share| {
                (given.clone(), pressed(before + share * (pressure - before)))
            })?,
            false => End::NotTried,
        };
        let figure = ("compression", -body.at(middle).z, expected);
        rows.extend(body.rows(pressure, &end, &[figure]));
        before = pressure;
    }
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Errors as measured: up to 2.4 % with averaged pressures and eight boxes, up to 4.2 % with ten
    /// nodes and four. Plain elements stop at half the height.
    #[test]
    fn compressed_blocks_follow_the_published_curve() {
        let worst = |element, cells| {
            let rows = compressed(element, cells).unwrap();
            println!("{rows:?}");
            rows.iter().map(|row| row.outcome.error_rel).fold(0.0, f64::max)
        };
        assert!(worst(Element::Tet4Anp, 8) < 0.03);
        assert!(worst(Element::Tet10, 4) < 0.05);
        let locked = compressed(Element::Tet4, 4).unwrap();
        assert!(locked[3].outcome.computed.unwrap() < 0.55, "{locked:?}");
    }
}
