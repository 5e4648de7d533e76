//! A rigid sphere pressed into a half-space without friction, against Hertz.

use nalgebra::{Point3, Vector3};
use softgrasp_core::fem::Element;

use super::block::block;
use super::discrete::{Discrete, Given};
use super::outcome::Outcome;
use softgrasp_bench::report::ReportError;

const YOUNG: f64 = 1e5;
const POISSON: f64 = 0.3;
/// Radius of the contact; the sphere's is ten times it.
const CONTACT: f64 = 1.0;
const SPHERE: f64 = 10.0;
/// Depth of the tip, `a² / R`.
const DEPTH: f64 = CONTACT * CONTACT / SPHERE;
/// Half the width, and the depth, of the block.
const REACH: f64 = 8.0;
/// Ratio of the thicknesses of neighbouring boxes away from the contact, with two boxes per radius.
const GROWTH: f64 = 1.5;

/// Force `4/3 E* √R δ^1.5` with `E* = E / (1 − ν²)`.
///
/// Source: Hertz 1881; Johnson, Contact Mechanics, (4.23).
fn force() -> f64 {
    4.0 / 3.0 * YOUNG / (1.0 - POISSON * POISSON) * SPHERE.sqrt() * DEPTH.powf(1.5)
}

/// Displacement of the half-space z ≤ 0 under a point load down at the origin, which that of the
/// sphere becomes far away, but for the square of contact radius over distance.
///
/// Source: Boussinesq 1885; Johnson, Contact Mechanics, (3.18).
fn far_field(p: &Point3<f64>) -> Vector3<f64> {
    let (depth, distance) = (-p.z, p.coords.norm());
    let scale = force() * (1.0 + POISSON) / (2.0 * std::f64::consts::PI * YOUNG);
    let cubed = distance.powi(3);
    let outward = depth / cubed - (1.0 - 2.0 * POISSON) / (distance * (distance + depth));
    let down = depth * depth / cubed + 2.0 * (1.0 - POISSON) / distance;
    Vector3::new(p.x * outward, p.y * outward, -down) * scale
}

/// Places of the planes of the grid along one axis, from 0 to [`REACH`]: `cells` boxes per contact
/// radius as far as 1.25 of it, then each a little thicker than the one before. How much thicker goes
/// down as `cells` goes up, so that the mesh is refined everywhere and not under the sphere only.
///
/// With the same growth on every mesh the far boxes stay as thick as they are, and the error levels
/// off at about a per cent (or changes its sign where the error of the near ones has the other one).
fn grid(cells: usize) -> Vec<f64> {
    let step = CONTACT / cells as f64;
    let growth = GROWTH.powf(2.0 / cells as f64);
    let even = cells + cells.div_ceil(4);
    let mut places: Vec<f64> = (0..=even).map(|i| i as f64 * step).collect();
    let (start, mut thickness) = (even as f64 * step, step);
    let mut beyond = start;
    while beyond < REACH {
        thickness *= growth;
        beyond += thickness;
        places.push(beyond);
    }
    let shrink = (REACH - start) / (beyond - start);
    places.iter().map(|&x| if x > start { start + (x - start) * shrink } else { x }).collect()
}

/// Force on the sphere by a quarter of a block, with `cells` boxes per contact radius.
///
/// Nodes of the top within the contact radius go down by `δ − r² / 2R` and slide freely; the
/// outer sides have the displacement of the point load of the closed form, so that what the block
/// lacks of the half-space shows by the cube of contact radius over its size only (0.2 %).
///
/// # Errors
/// [`ReportError`].
pub fn pressed(element: Element, cells: usize) -> Result<Outcome, ReportError> {
    let places = grid(cells);
    let count = places.len() - 1;
    let plane = |part: f64| places[(part * count as f64).round() as usize];
    let mesh = block([count; 3], |p| Point3::new(plane(p.x), plane(p.y), -plane(p.z)))?;
    let discrete = Discrete::new(&mesh, element, YOUNG, POISSON)?;
    let distance = |p: &Point3<f64>| p.x.hypot(p.y);
    let touched: Vec<Given> = discrete
        .nodes()
        .iter()
        .zip(0u32..)
        .filter(|(p, _)| p.z == 0.0 && distance(p) <= CONTACT * (1.0 + 1e-9))
        .map(|(p, n)| (3 * n + 2, distance(p).powi(2) / (2.0 * SPHERE) - DEPTH))
        .collect();
    let outer: Vec<bool> =
        discrete.nodes().iter().map(|p| p.coords.amax() > REACH * (1.0 - 1e-9)).collect();
    let mut given = discrete.give_field(&outer, far_field);
    given.extend(discrete.give(0, 0.0, |p| p.x == 0.0));
    given.extend(discrete.give(1, 0.0, |p| p.y == 0.0));
    given.extend(touched.iter().copied());
    let answer = discrete.solve(given, Vec::new())?;
    let computed = -4.0 * answer.support(&touched);
    let solved = discrete.solved("indentation", POISSON, cells, &answer);
    Ok(solved.with_number("force", computed, force()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accuracy::{ELEMENTS, order};

    /// The work of the force is that of the strains, whose error is that of the field squared:
    /// (h/a)² or better for quadratic displacements, h/a allowed for linear ones on a mesh whose
    /// pressure changes from full to nothing over four of them. That the edge of the contact lies
    /// between nodes costs (3/2)(h/2a)², for Hertz's force is stationary in the contact radius.
    #[test]
    fn sphere_needs_the_force_of_hertz() {
        for &element in ELEMENTS {
            let outcome = pressed(element, 4).unwrap();
            println!("{outcome:?}");
            let size: f64 = 0.25;
            let allowed = if order(element) > 2.0 { size * size } else { size };
            assert!(outcome.error_rel < allowed, "{outcome:?}");
        }
    }

    /// With far boxes of constant size, twice the boxes per radius made it worse: 0.2 % error, then 0.9
    /// %.
    #[test]
    fn indentation_by_averaged_pressure_does_not_get_worse_with_the_mesh() {
        let error = |cells| pressed(Element::Tet4Anp, cells).unwrap().error_rel;
        let (coarse, fine) = (error(2), error(4));
        assert!(fine < coarse && fine < 0.01, "{coarse} {fine}");
    }

    #[test]
    fn grid_is_even_under_the_sphere_and_ends_at_the_sides() {
        let places = grid(4);
        assert_eq!(places[..6], [0.0, 0.25, 0.5, 0.75, 1.0, 1.25]);
        assert!((places[places.len() - 1] - REACH).abs() < 1e-12);
        assert!(places.windows(2).all(|w| w[1] - w[0] > 0.2));
        // Twice as many boxes per radius: about half as thick far away too.
        let last = |cells| grid(cells).windows(2).map(|w| w[1] - w[0]).fold(0.0, f64::max);
        assert!(last(8) < 0.7 * last(4) && last(4) < 0.7 * last(2));
    }

    /// The traction of the point load on a far hemisphere is its force: by finite differences of
    /// the field, Hooke's law and a sum over the hemisphere.
    #[test]
    fn far_field_carries_the_force() {
        let (lambda, mu) = {
            let mu = YOUNG / (2.0 * (1.0 + POISSON));
            (2.0 * mu * POISSON / (1.0 - 2.0 * POISSON), mu)
        };
        let (radius, step) = (5.0, 1e-4);
        let mut carried = 0.0;
        let rings = 200;
        for ring in 0..rings {
            let polar = (f64::from(ring) + 0.5) / f64::from(rings) * std::f64::consts::FRAC_PI_2;
            let normal = Vector3::new(polar.sin(), 0.0, -polar.cos());
            let p = Point3::from(normal * radius);
            let slope = |axis: usize| {
                let d = Vector3::ith(axis, step);
                (far_field(&(p + d)) - far_field(&(p - d))) / (2.0 * step)
            };
            let h = nalgebra::Matrix3::from_columns(&[slope(0), slope(1), slope(2)]);
            let traction = normal * (lambda * h.trace()) + (h + h.transpose()) * normal * mu;
            let width = std::f64::consts::FRAC_PI_2 / f64::from(rings) * radius;
            carried += traction.z * 2.0 * std::f64::consts::PI * radius * polar.sin() * width;
        }
        // Traction on the block from outside holds it up against the load.
        assert!((carried / force() - 1.0).abs() < 1e-4, "{carried} {}", force());
    }
}
