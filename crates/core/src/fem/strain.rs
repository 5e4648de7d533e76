//! How far an answer leaves the range of linear elasticity: largest element strain and rotation.

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::{dof, tet4};
use crate::mesh::TetMesh;

/// Largest element rotation and principal strain of a displacement field.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StrainSummary {
    /// Largest rotation of an element, rad. Linear elasticity errs by its square.
    pub rotation_max: f64,
    /// Largest absolute principal strain, 1.
    pub strain_max: f64,
}

/// Largest rotation and principal strain over all elements.
///
/// Shapes: `displacement` 3N. Units: m.
///
/// Source: displacement gradient `H = Σ u_a ∇N_aᵀ` from thesis (3.28); rotation angle from the
/// skew part and the trace of `I + H`, exact when `I + H` is a rotation.
pub fn summarise_strain(mesh: &TetMesh, displacement: &[f64]) -> StrainSummary {
    // `max` does not depend on the order, so a parallel reduction keeps the same bits.
    (0..mesh.tets().len())
        .into_par_iter()
        .with_min_len(512)
        .map(|t| element_strain(mesh, t, displacement))
        .reduce(StrainSummary::default, |a, b| StrainSummary {
            rotation_max: a.rotation_max.max(b.rotation_max),
            strain_max: a.strain_max.max(b.strain_max),
        })
}

fn element_strain(mesh: &TetMesh, tet: usize, displacement: &[f64]) -> StrainSummary {
    let g = tet4::gradients(&mesh.corners(tet));
    let mut h = Matrix3::zeros();
    for (a, &node) in mesh.tets()[tet].iter().enumerate() {
        let d = dof(node as usize, 0);
        let u = Vector3::new(displacement[d], displacement[d + 1], displacement[d + 2]);
        h += u * g.of_shape[a].transpose();
    }
    let skew =
        Vector3::new(h[(2, 1)] - h[(1, 2)], h[(0, 2)] - h[(2, 0)], h[(1, 0)] - h[(0, 1)]) * 0.5;
    let rotation_max = skew.norm().atan2(1.0 + 0.5 * h.trace());
    let strain = (h + h.transpose()) * 0.5;
    StrainSummary { rotation_max, strain_max: principal_max(&strain) }
}

/// Largest absolute eigenvalue of a symmetric 3 × 3 matrix, by the trigonometric formula.
fn principal_max(e: &Matrix3<f64>) -> f64 {
    let mean = e.trace() / 3.0;
    let deviator = e - Matrix3::identity() * mean;
    let spread = (deviator.norm_squared() / 6.0).sqrt();
    if spread == 0.0 {
        return mean.abs();
    }
    let cosine = ((deviator / spread).determinant() / 2.0).clamp(-1.0, 1.0);
    let angle = cosine.acos() / 3.0;
    let high = mean + 2.0 * spread * angle.cos();
    let low = mean + 2.0 * spread * (angle + 2.0 * std::f64::consts::PI / 3.0).cos();
    high.abs().max(low.abs())
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Point3, Rotation3};

    fn tet() -> TetMesh {
        let vertices = [[1.0, 0.1, 0.0], [0.0, 1.0, 0.2], [0.1, 0.0, 1.0], [0.0; 3]];
        TetMesh::try_new(vertices.map(Point3::from).to_vec(), vec![[0, 1, 2, 3]], vec![]).unwrap()
    }

    fn field(mesh: &TetMesh, map: impl Fn(&Point3<f64>) -> Vector3<f64>) -> Vec<f64> {
        mesh.vertices().iter().flat_map(|p| <[f64; 3]>::from(map(p))).collect()
    }

    #[test]
    fn rotation_of_thirty_degrees_is_found_exactly() {
        let mesh = tet();
        let rotation = Rotation3::from_axis_angle(&Vector3::z_axis(), 30f64.to_radians());
        let u = field(&mesh, |p| rotation * p.coords - p.coords);
        let summary = summarise_strain(&mesh, &u);
        assert!((summary.rotation_max - 30f64.to_radians()).abs() < 1e-14);
    }

    #[test]
    fn stretch_and_shear_give_their_principal_strains() {
        let mesh = tet();
        let stretched = field(&mesh, |p| Vector3::new(0.01 * p.x, -0.03 * p.y, 0.02 * p.z));
        assert!((summarise_strain(&mesh, &stretched).strain_max - 0.03).abs() < 1e-15);
        let sheared = field(&mesh, |p| Vector3::new(0.02 * p.y, 0.0, 0.0));
        assert!((summarise_strain(&mesh, &sheared).strain_max - 0.01).abs() < 1e-15);
    }
}
