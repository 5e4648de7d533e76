//! Torsion of a cylinder whose ends keep their distance: it needs a torque, and pushes.

use std::f64::consts::PI;

use nalgebra::{Point3, Rotation3, Vector3};
use softgrasp_core::fem::hyperelastic::Law;
use softgrasp_core::fem::{Element, Material};

use super::cylinder::cylinder;
use super::followed::{Followed, of_node};
use super::row::Row;
use crate::accuracy::discrete::Discrete;
use softgrasp_bench::report::ReportError;
use softgrasp_bench::table::Table;

/// Angle between the ends of a cylinder of radius 1 and length 1.
const TWIST: f64 = 1.0;
/// Steps of the angle: known nodes go straight from one to the next, which draws the ends together
/// by `1 − cos(angle/2)` half way, and what is nearly incompressible resists that.
const STEPS: usize = 8;

/// Torque and axial force, with `cells` rings of elements and as many layers.
///
/// Closed form, incompressible: `M = π μ τ a⁴ / 2`, `N = −π μ τ² a⁴ / 4`.
///
/// Source: Rivlin, Phil. Trans. R. Soc. A 242 (1949) 173.
///
/// # Errors
/// [`ReportError`].
pub fn twisted(element: Element, poisson: f64, cells: usize) -> Result<Vec<Row>, ReportError> {
    let discrete = Discrete::new(&cylinder(cells)?, element, 1.0, poisson)?;
    let mu = Material::try_new(1.0, poisson)?.shear_modulus();
    let is_end = |p: &Point3<f64>| p.z == 0.0 || p.z == 1.0;
    let ends: Vec<bool> = discrete.nodes().iter().map(is_end).collect();
    let given = |angle: f64| {
        discrete.give_field(&ends, |p| {
            let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), angle * p.z);
            turn * p.coords - p.coords
        })
    };
    let about = ("torsion", poisson, cells);
    let mut body = Followed::new(&discrete, Law::NeoHookeanLog, &given(0.0), about)?;
    let end = body.follow(STEPS, |share| (given(share * TWIST), Vec::new()))?;
    let forces = body.forces();
    let (mut torque, mut push) = (0.0, 0.0);
    for (n, p) in discrete.nodes().iter().enumerate().filter(|(_, p)| p.z == 1.0) {
        let (place, force) = (p + body.at(n), of_node(&forces, n));
        torque += place.coords.cross(&force).z;
        push += force.z;
    }
    let figures = [
        ("torque", torque, 0.5 * PI * mu * TWIST),
        ("axial force", push, -0.25 * PI * mu * TWIST * TWIST),
    ];
    Ok(body.rows(TWIST, &end, &figures))
}

/// Poisson's ratios, each half as far from 0.5 as the one before.
const NEARER: [f64; 4] = [0.48, 0.49, 0.495, 0.4975];

/// Difference of the figures from those of the incompressible body as Poisson's ratio approaches 0.5, on
/// one mesh. Most of the mesh's own error cancels in their differences.
///
/// # Errors
/// [`ReportError`].
pub fn nearly_incompressible(element: Element, cells: usize) -> Result<Table, ReportError> {
    let title = "Torsion: what being compressible changes";
    let mut table = Table::new("accuracy-large-torsion", title, &COLUMNS);
    let by_poisson: Vec<Vec<Row>> =
        NEARER.iter().map(|&nu| twisted(element, nu, cells)).collect::<Result<_, _>>()?;
    for quantity in 0..2 {
        let (mut ratio_before, mut change_before): (Option<f64>, Option<f64>) = (None, None);
        for (poisson, rows) in NEARER.iter().zip(&by_poisson) {
            let ratio = ratio(&rows[quantity]);
            let change = ratio_before.map(|before| ratio - before);
            let order = change_before.zip(change).map(|(before, now)| (before / now).abs().log2());
            table.push([
                rows[quantity].outcome.quantity.into(),
                element.name().into(),
                cells.into(),
                format!("{poisson}").into(),
                format!("{ratio:.5}").into(),
                change.into(),
                order.into(),
            ]);
            (ratio_before, change_before) = (Some(ratio), change);
        }
    }
    Ok(table)
}

fn ratio(row: &Row) -> f64 {
    let outcome = &row.outcome;
    outcome
        .computed
        .zip(outcome.expected)
        .map_or(f64::NAN, |(computed, expected)| computed / expected)
}

const COLUMNS: [&str; 7] =
    ["quantity", "element", "cells", "poisson", "over_closed_form", "change", "order"];

#[cfg(test)]
mod tests {
    use super::*;

    /// Errors as measured: torque 12 and 7.6 %, axial force 32 and 8.9 %.
    #[test]
    fn twisted_cylinders_have_rivlins_torque_and_push() {
        for (element, cells, torque_max, push_max) in
            [(Element::Tet4Anp, [2, 4], 0.14, 0.35), (Element::Tet10, [1, 2], 0.09, 0.11)]
        {
            let [coarse, fine] = cells.map(|cells| twisted(element, 0.499, cells).unwrap());
            println!("{coarse:?}\n{fine:?}");
            assert!(fine[0].outcome.error_rel < torque_max, "{fine:?}");
            assert!(fine[1].outcome.error_rel < push_max, "{fine:?}");
            assert!((0..2).all(|i| fine[i].order_from(&coarse[i]) > 1.0), "{coarse:?} {fine:?}");
        }
    }

    /// Five times the torque on the mesh where averaged pressures leave 12 %.
    #[test]
    fn plain_elements_lock_in_torsion() {
        let rows = twisted(Element::Tet4, 0.499, 4).unwrap();
        assert!(rows[0].outcome.error_rel > 1.0, "{rows:?}");
    }
}
