//! A slender cantilever under a dead force at its end, against the elastica.

use nalgebra::{Point3, Vector3};
use softgrasp_core::fem::Element;
use softgrasp_core::fem::hyperelastic::Law;

use super::followed::Followed;
use super::row::{End, Row};
use crate::accuracy::block::block;
use crate::accuracy::discrete::Discrete;
use softgrasp_bench::report::ReportError;

/// Length over height; the section is a square of edge 1.
const LENGTH: f64 = 50.0;
/// Steps from one load to the next.
const STEPS: usize = 4;

/// Load `P L² / E I`, shortening of the distance of the ends over L, deflection over L.
///
/// Source: Bisshopp and Drucker, Quart. Appl. Math. 3 (1945) 272; the digits are integrated in the tests.
const ELASTICA: [(f64, f64, f64); 3] =
    [(1.0, 0.05643, 0.30172), (5.0, 0.38763, 0.71379), (10.0, 0.55500, 0.81061)];

/// Shortening and deflection of the end, with `cells` boxes over the height, twice as long as high;
/// half of the beam, cut along its plane of symmetry.
///
/// # Errors
/// [`ReportError`].
pub fn bent(element: Element, cells: usize) -> Result<Vec<Row>, ReportError> {
    let counts = [LENGTH as usize * cells / 2, cells, cells.div_ceil(2)];
    let mesh = block(counts, |p| Point3::new(LENGTH * p.x, p.y - 0.5, 0.5 * p.z))?;
    let discrete = Discrete::new(&mesh, element, 1.0, 0.0)?;
    let clamped: Vec<bool> = discrete.nodes().iter().map(|p| p.x == 0.0).collect();
    let mut given = discrete.give_field(&clamped, |_| Vector3::zeros());
    given.extend(discrete.give(2, 0.0, |p| p.z == 0.0));
    let pushed = |load: f64| {
        // The second moment of the section is 1/12, that of the half has half the force to carry.
        let traction = Vector3::new(0.0, -load / (12.0 * LENGTH * LENGTH), 0.0);
        let is_end = |corners: &[Point3<f64>; 3]| corners.iter().all(|p| p.x == LENGTH);
        discrete.traction(|corners, _| is_end(corners).then_some(traction))
    };
    let about = ("elastica", 0.0, cells);
    let mut body = Followed::new(&discrete, Law::NeoHookeanLog, &given, about)?;
    let (mut rows, mut before, mut last) = (Vec::new(), 0.0, End::Given);
    for (load, shortening, deflection) in ELASTICA {
        last = match last.has_shape() {
            true => body
                .follow(STEPS, |share| (given.clone(), pushed(before + share * (load - before))))?,
            false => End::NotTried,
        };
        let end = body.mean(&pushed(load), 1) / LENGTH;
        let figures = [("shortening", -end.x, shortening), ("deflection", -end.y, deflection)];
        rows.extend(body.rows(load, &last, &figures));
        before = load;
    }
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tangent angle, curvature, place along and across, for unit length and curvature at the clamp:
    /// `θ″ = −k cos θ`, by Runge and Kutta's fourth order.
    fn end_of(k: f64, curvature: f64) -> [f64; 4] {
        let slope = |[theta, curvature, ..]: [f64; 4]| {
            [curvature, -k * theta.cos(), theta.cos(), theta.sin()]
        };
        let moved = |from: [f64; 4], slope: [f64; 4], by: f64| -> [f64; 4] {
            std::array::from_fn(|i| from[i] + by * slope[i])
        };
        let (mut at, steps) = ([0.0, curvature, 0.0, 0.0], 1000);
        let h = 1.0 / f64::from(steps);
        for _ in 0..steps {
            let first = slope(at);
            let second = slope(moved(at, first, 0.5 * h));
            let third = slope(moved(at, second, 0.5 * h));
            let fourth = slope(moved(at, third, h));
            at = std::array::from_fn(|i| {
                at[i] + h / 6.0 * (first[i] + 2.0 * (second[i] + third[i]) + fourth[i])
            });
        }
        at
    }

    #[test]
    fn constants_are_those_of_the_integrated_elastica() {
        for (k, shortening, deflection) in ELASTICA {
            let (mut low, mut high) = (0.0, (2.0 * k).sqrt());
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                let is_too_low = end_of(k, middle)[1] < 0.0;
                (low, high) = if is_too_low { (middle, high) } else { (low, middle) };
            }
            let [_, _, along, across] = end_of(k, low);
            assert!((1.0 - along - shortening).abs() < 6e-6, "{k}: {}", 1.0 - along);
            assert!((across - deflection).abs() < 6e-6, "{k}: {across}");
        }
    }

    /// Beam theory leaves out shear and stretch, by the square of height over length: 4e-4. The
    /// plain element with one box over the height is off by more than half.
    #[test]
    fn only_ten_nodes_bend_as_the_elastica() {
        for row in bent(Element::Tet10, 1).unwrap() {
            assert!(row.outcome.error_rel < 1e-3, "{row:?}");
        }
        let rows = bent(Element::Tet4, 1).unwrap();
        assert!(rows.iter().all(|row| row.outcome.error_rel > 0.5), "{rows:?}");
    }
}
