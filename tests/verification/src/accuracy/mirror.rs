//! Mirror images: a mirrored question must have the mirrored answer.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};
use softgrasp_core::fem::Element;

use super::block::block;
use super::discrete::Discrete;
use super::outcome::Outcome;
use softgrasp_bench::report::ReportError;

/// Deviation from symmetry of the displacements of a symmetric block under a symmetric press, relative to
/// the largest; `cells` (an even number) boxes along each edge. NaN if the mesh itself is not symmetric.
///
/// # Errors
/// [`ReportError`].
pub fn symmetric(element: Element, poisson: f64, cells: usize) -> Result<Outcome, ReportError> {
    let bent = |p: Vector3<f64>| {
        let (x, y) = (p.x - 0.5, p.y - 0.5);
        Point3::new(x * (1.0 + 0.2 * p.z), y + 0.3 * x * x + 0.1 * p.z, p.z + 0.2 * x * x * y)
    };
    let mesh = block([cells; 3], bent)?;
    let discrete = Discrete::new(&mesh, element, 1.0, poisson)?;
    // The field is its own mirror image in x: odd along x, even along the others.
    let press = |p: &Point3<f64>| {
        let x = p.x * p.x;
        Vector3::new(0.3 * p.x * p.y, x - 0.2 * p.y, -0.2 - 0.1 * x * p.y) * 0.1
    };
    let bottom: Vec<bool> = discrete.nodes().iter().map(|p| p.z <= 0.05).collect();
    let top: Vec<bool> = discrete.nodes().iter().map(|p| p.z >= 0.95).collect();
    let mut given = discrete.give_field(&bottom, |_| Vector3::zeros());
    given.extend(discrete.give_field(&top, press));
    let answer = discrete.solve(given, Vec::new())?;
    let mirrored = |v: Vector3<f64>| Vector3::new(-v.x, v.y, v.z);
    // Mirrored places have the same numbers but for a sign, so they are found by their bits.
    let bits = |v: Vector3<f64>| [v.x + 0.0, v.y + 0.0, v.z + 0.0].map(f64::to_bits);
    let of_place: BTreeMap<[u64; 3], usize> =
        discrete.nodes().iter().enumerate().map(|(n, p)| (bits(p.coords), n)).collect();
    let (mut off, mut largest, mut is_symmetric) = (0.0f64, 0.0f64, true);
    for (n, p) in discrete.nodes().iter().enumerate() {
        match of_place.get(&bits(mirrored(p.coords))) {
            Some(&other) => off = off.max((answer.at(other) - mirrored(answer.at(n))).amax()),
            None => is_symmetric = false,
        }
        largest = largest.max(answer.at(n).amax());
    }
    let solved = discrete.solved("mirror", poisson, cells, &answer);
    Ok(solved.with_error(
        "displacement, worst node",
        if is_symmetric { off / largest } else { f64::NAN },
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accuracy::ELEMENTS;
    use crate::accuracy::outcome::ROUNDING;
    use softgrasp_core::mesh::{BuiltIn, Surface, TetMesh, generate};

    #[test]
    fn symmetric_press_moves_a_symmetric_block_symmetrically() {
        for &element in ELEMENTS {
            for poisson in [0.3, 0.49] {
                let outcome = symmetric(element, poisson, 4).unwrap();
                println!("{outcome:?}");
                assert!(outcome.error_rel < ROUNDING, "{outcome:?}");
            }
        }
    }

    /// Any object: the mirrored mesh, with corners exchanged so that its volume stays positive.
    #[test]
    fn mirrored_object_has_mirrored_displacements() {
        let mesh = generate(BuiltIn::Strawberry, 150).unwrap();
        let vertices = mesh.vertices().iter().map(|p| Point3::new(-p.x, p.y, p.z)).collect();
        let tets = mesh.tets().iter().map(|&[a, b, c, d]| [a, b, d, c]).collect();
        let other = TetMesh::try_new(vertices, tets, Vec::new()).unwrap();
        let outside = Surface::from_mesh(&mesh).nodes;
        let answer = |mesh: &TetMesh, sign: f64, element: Element| {
            let discrete = Discrete::new(mesh, element, 1e5, 0.3).unwrap();
            let held = outside.iter().step_by(outside.len() / 6);
            let given = held.flat_map(|&n| {
                let u = [sign * f64::from(n), 30.0, -0.5 * f64::from(n)];
                (0u32..).zip(u).map(move |(axis, u)| (3 * n + axis, 1e-5 * u))
            });
            discrete.solve(given.collect(), Vec::new()).unwrap()
        };
        for &element in ELEMENTS {
            let (here, there) = (answer(&mesh, 1.0, element), answer(&other, -1.0, element));
            let (mut off, mut largest) = (0.0f64, 0.0f64);
            // Mid-edge nodes have the same numbers too: edges are sorted by their corners.
            for n in 0..here.displacement().len() / 3 {
                let (u, v) = (here.at(n), there.at(n));
                off = off.max((u - Vector3::new(-v.x, v.y, v.z)).amax());
                largest = largest.max(u.amax());
            }
            println!("{element:?}: {off:e} of {largest:e}");
            // Held by single nodes, the condition is larger than with whole sides held.
            assert!(largest > 0.0 && off < 10.0 * ROUNDING * largest, "{element:?}: {off:e}");
        }
    }
}
