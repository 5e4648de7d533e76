//! A body that is rotated rigidly is free of forces.

use nalgebra::{Point3, Rotation3, Unit, Vector3};
use softgrasp_core::fem::Element;
use softgrasp_core::fem::hyperelastic::Law;

use super::followed::Followed;
use super::row::{End, Row};
use crate::accuracy::block::{block, shaken};
use crate::accuracy::discrete::Discrete;
use softgrasp_bench::report::ReportError;

const YOUNG: f64 = 1.0;
/// Angles of the rotation, rad.
const ANGLES: [f64; 4] = [0.1, 1.0, 2.0, 3.0];
/// Number of steps from one angle to the next where one face leads, since known nodes move straight.
const STEPS: usize = 5;

fn axis() -> Unit<Vector3<f64>> {
    Unit::new_normalize(Vector3::new(1.0, -0.4, 0.3))
}

/// Displacement of a rotation by an angle around the origin.
fn turn(angle: f64, p: &Point3<f64>) -> Vector3<f64> {
    Rotation3::from_axis_angle(&axis(), angle) * p.coords - p.coords
}

/// Largest force at a node of a turned unit cube with an irregular inside, over E times the area of
/// a face.
///
/// # Errors
/// [`ReportError`].
pub fn given(element: Element, poisson: f64, cells: usize) -> Result<Vec<Row>, ReportError> {
    let discrete = cube(element, poisson, cells)?;
    let all = discrete.give_field(&vec![true; discrete.nodes().len()], |_| Vector3::zeros());
    let about = ("turned", poisson, cells);
    let body = Followed::new(&discrete, Law::NeoHookeanLog, &all, about)?;
    let row = |angle: f64| {
        let field: Vec<f64> =
            discrete.nodes().iter().flat_map(|p| <[f64; 3]>::from(turn(angle, p))).collect();
        let forces = body.forces_at(&field);
        let largest = forces.iter().fold(0.0, |most: f64, f| most.max(f.abs())) / YOUNG;
        let outcome = body.solved().clone().with_error("force", largest);
        Row { outcome, load: angle, end: End::Given }
    };
    Ok(ANGLES.into_iter().map(row).collect())
}

/// Largest distance of a node from where it should be, over the largest displacement, where one face
/// is turned and the rest has to follow.
///
/// # Errors
/// [`ReportError`].
pub fn led(element: Element, poisson: f64, cells: usize) -> Result<Vec<Row>, ReportError> {
    let discrete = cube(element, poisson, cells)?;
    let face: Vec<bool> = discrete.nodes().iter().map(|p| p.x == 0.0).collect();
    let given = |angle: f64| discrete.give_field(&face, |p| turn(angle, p));
    let about = ("led by a face", poisson, cells);
    let mut body = Followed::new(&discrete, Law::NeoHookeanLog, &given(0.0), about)?;
    let (mut rows, mut before, mut end) = (Vec::new(), 0.0, End::Given);
    for angle in ANGLES {
        end = match end.has_shape() {
            true => {
                body.follow(STEPS, |share| (given(before + share * (angle - before)), Vec::new()))?
            }
            false => End::NotTried,
        };
        let nodes = || discrete.nodes().iter().enumerate();
        let off = nodes().map(|(n, p)| (body.at(n) - turn(angle, p)).norm()).fold(0.0, f64::max);
        let largest = nodes().map(|(_, p)| turn(angle, p).norm()).fold(0.0, f64::max);
        let error = if end.has_shape() { off / largest } else { f64::NAN };
        let outcome = body.solved().clone().with_error("displacement, worst node", error);
        rows.push(Row { outcome, load: angle, end: end.clone() });
        before = angle;
    }
    Ok(rows)
}

fn cube(element: Element, poisson: f64, cells: usize) -> Result<Discrete, ReportError> {
    let mesh = shaken(&block([cells; 3], Point3::from)?, 0.15 / cells as f64)?;
    Discrete::new(&mesh, element, YOUNG, poisson)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accuracy::ELEMENTS;

    #[test]
    fn turned_cubes_hold_no_force() {
        for &element in ELEMENTS {
            for poisson in [0.3, 0.49] {
                for row in given(element, poisson, 3).unwrap() {
                    assert!(row.outcome.error_rel < 1e-13, "{row:?}");
                }
            }
        }
    }
}
