//! Cases with elements that are nearly flat or nearly a line.

use nalgebra::{Point3, Vector3};
use softgrasp_core::mesh::{MeshError, Quality, TetMesh};

use super::case::{Case, Family, Form, Question, plain};
use super::shapes::{block, nearest, with_node_at};
use softgrasp_bench::report::ReportError;

/// Elements collapsed onto a short edge and onto a face.
///
/// # Errors
/// [`ReportError`] if a case cannot be set up.
pub(super) fn family(form: Form) -> Result<Family, ReportError> {
    let mesh = block([form.cells; 3], [1.0; 3])?;
    let mut cases = Vec::new();
    let edges: &[f64] = if form.is_quick { &[1e-4] } else { &[1e-1, 1e-2, 1e-3, 1e-4] };
    for &edge in edges {
        let question = Question::clamped(with_short_edge(&mesh, form, edge)?, plain()?, 2);
        cases.push(Case::new(format!("aspect {:.0e}", 1.0 / edge), question, 1.0 / edge));
    }
    let angles: &[f64] = if form.is_quick { &[0.001] } else { &[1.0, 0.1, 0.01, 0.001] };
    for &angle in angles {
        let (mesh, height) = with_dihedral(&mesh, form, angle)?;
        let question = Question::clamped(mesh, plain()?, 2);
        cases.push(Case::new(format!("dihedral angle {angle}°"), question, 1.0 / height));
    }
    Ok(Family {
        name: "slivers",
        reasoning: "An element of height a (over the edges around it) is 1/a times as stiff across \
                    as its neighbours are, and the digits of 1/a are lost where its stiffness is \
                    added to theirs.",
        advice: "Nothing for a few slivers down to 0.1°. Flatter ones: let the mesh maker improve \
                 the mesh, or merge the two nodes; the warning of an answer says what it costs.",
        cases,
    })
}

/// Mesh whose inner node is moved along an edge, until the share `left` of the edge remains.
fn with_short_edge(mesh: &TetMesh, form: Form, left: f64) -> Result<TetMesh, MeshError> {
    let cell = 1.0 / form.cells as f64;
    let inner = nearest(mesh, &Point3::from([cell; 3]));
    let other = Point3::new(2.0 * cell, cell, cell);
    with_node_at(mesh, inner, other - Vector3::x() * (left * cell))
}

/// Mesh whose inner node is moved towards the middle of a face of the elements around it, until the
/// smallest dihedral angle is `angle_deg`; also the share of the way that remains.
fn with_dihedral(mesh: &TetMesh, form: Form, angle_deg: f64) -> Result<(TetMesh, f64), MeshError> {
    let inner = nearest(mesh, &Point3::from([1.0 / form.cells as f64; 3]));
    let at = |node: u32| mesh.vertices()[node as usize];
    let around = mesh.tets().iter().find(|tet| tet.contains(&inner));
    let face = around.into_iter().flatten().filter(|n| **n != inner);
    let middle = Point3::from(face.map(|n| at(*n).coords).sum::<Vector3<f64>>() / 3.0);
    let moved = |left: f64| with_node_at(mesh, inner, middle + (at(inner) - middle) * left);
    // The angle falls with the height: bisection over powers of ten.
    let (mut low, mut high) = (-8.0, 0.0);
    for _ in 0..60 {
        let exponent = 0.5 * (low + high);
        let least = Quality::from_mesh(&moved(10f64.powf(exponent))?, 0).dihedral_min.to_degrees();
        if least > angle_deg { high = exponent } else { low = exponent }
    }
    let left = 10f64.powf(high);
    Ok((moved(left)?, left))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slivers_are_as_thin_as_their_names_say() {
        for cells in [2, 3] {
            let form = Form { is_quick: true, cells };
            let mesh = block([cells; 3], [1.0; 3]).unwrap();
            let (flat, height) = with_dihedral(&mesh, form, 0.001).unwrap();
            let least = Quality::from_mesh(&flat, 0).dihedral_min.to_degrees();
            assert!((least / 0.001 - 1.0).abs() < 1e-6 && height < 1e-3, "{least}");
            let needles = with_short_edge(&mesh, form, 1e-4).unwrap();
            let volume = Quality::from_mesh(&needles, 0).volume_min;
            assert!(volume < 2e-4 * Quality::from_mesh(&mesh, 0).volume_min, "{volume}");
        }
    }
}
