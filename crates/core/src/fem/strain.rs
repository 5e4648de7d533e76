//! The largest rotation and strain of an element: how far linear elasticity can be trusted.

use nalgebra::{Matrix3, Vector3};

use super::{QuadraticMesh, dof, tet4};
use crate::mesh::TetMesh;

/// Largest element rotation and principal strain of a displacement field.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StrainSummary {
    /// Largest rotation of an element, rad. Linear elasticity errs by its square.
    pub rotation_max: f64,
    /// Largest absolute principal strain, 1.
    pub strain_max: f64,
}

impl StrainSummary {
    /// Component-wise maximum of two summaries, of two load cases for one.
    pub fn or_larger(self, other: Self) -> Self {
        Self {
            rotation_max: self.rotation_max.max(other.rotation_max),
            strain_max: self.strain_max.max(other.strain_max),
        }
    }
}

/// Largest rotation and principal strain over all elements.
///
/// Shapes: `displacement` 3N. Units: m. `pause` is called every 50 µs or so: who works this out beside
/// something more urgent can let that pass.
///
/// Source: displacement gradient `H = Σ u_a ∇N_aᵀ` from thesis (3.28); rotation angle from the
/// skew part and the trace of `I + H`, exact when `I + H` is a rotation.
pub fn summarise_strain(
    mesh: &TetMesh,
    displacement: &[f64],
    pause: &mut dyn FnMut(),
) -> StrainSummary {
    largest(mesh.tets().len(), pause, |tet, most| most.see(&gradient_of(mesh, tet, displacement)))
}

/// Displacement gradient of a linear element.
fn gradient_of(mesh: &TetMesh, tet: usize, displacement: &[f64]) -> Matrix3<f64> {
    let g = tet4::gradients(&mesh.corners(tet));
    let u = displacements_of(&mesh.tets()[tet], displacement);
    u.iter()
        .zip(&g.of_shape)
        .fold(Matrix3::zeros(), |h, (u_a, gradient)| h + u_a * gradient.transpose())
}

/// [`summarise_strain`] for ten-node tetrahedra, over the four quadrature points of each.
///
/// The strain of an element is linear in space; at these points it is most exact, and it lies
/// between that of the element's middle, which a linear tetrahedron has everywhere, and the
/// extrapolated one of its corners.
///
/// Shapes: `displacement` 3 per node of `mesh`. Units: m.
///
/// Source: as there, with [`super::tet10::QUADRATURE`].
pub fn summarise_strain_quadratic(
    mesh: &QuadraticMesh,
    displacement: &[f64],
    pause: &mut dyn FnMut(),
) -> StrainSummary {
    largest(mesh.tets().len(), pause, |tet, most| {
        let u = displacements_of(&mesh.tets()[tet], displacement);
        mesh.points(tet).displacement_gradients(&u).iter().for_each(|h| most.see(h));
    })
}

/// Elements between two pauses.
const ELEMENTS_TOGETHER: usize = 1024;

/// Largest summary over elements, one after the other, so that most are dismissed by the largest so
/// far. A thread alone: next to a factor it costs nothing, and beside frames it leaves the other
/// processors to them.
fn largest(
    tet_count: usize,
    pause: &mut dyn FnMut(),
    see_tet: impl Fn(usize, &mut Largest),
) -> StrainSummary {
    let mut most = Largest::default();
    for tet in 0..tet_count {
        see_tet(tet, &mut most);
        if tet % ELEMENTS_TOGETHER == ELEMENTS_TOGETHER - 1 {
            pause();
        }
    }
    most.summary
}

/// Running maximum: the angle and the eigenvalue are worked out only where they can be larger.
#[derive(Default)]
struct Largest {
    summary: StrainSummary,
    /// Square of the tangent of the largest rotation so far.
    tangent_squared: f64,
}

/// What is dismissed is smaller by more than the rounding of both sides.
const DISMISSAL_MARGIN: f64 = 1.0 + 1e-12;

impl Largest {
    /// Takes the rotation and the principal strain of one displacement gradient into account.
    fn see(&mut self, h: &Matrix3<f64>) {
        let skew =
            Vector3::new(h[(2, 1)] - h[(1, 2)], h[(0, 2)] - h[(2, 0)], h[(1, 0)] - h[(0, 1)]) * 0.5;
        let (sine_squared, cosine) = (skew.norm_squared(), 1.0 + 0.5 * h.trace());
        // Written so that a NaN is not dismissed.
        let is_less = cosine > 0.0
            && sine_squared * DISMISSAL_MARGIN < self.tangent_squared * cosine * cosine;
        if !is_less {
            self.summary.rotation_max = self.summary.rotation_max.max(skew.norm().atan2(cosine));
            let tangent = self.summary.rotation_max.tan();
            // From a right angle on nothing is dismissed by its tangent.
            let is_acute = self.summary.rotation_max < 1.5;
            self.tangent_squared = if is_acute { tangent * tangent } else { 0.0 };
        }
        let strain = (h + h.transpose()) * 0.5;
        // No eigenvalue is larger than the Frobenius norm.
        let most = self.summary.strain_max;
        let is_less = strain.norm_squared() * DISMISSAL_MARGIN < most * most;
        if !is_less {
            self.summary.strain_max = most.max(principal_max(&strain));
        }
    }
}

/// Displacements of an element's nodes, in their order.
fn displacements_of<const K: usize>(nodes: &[u32; K], displacement: &[f64]) -> [Vector3<f64>; K] {
    nodes.map(|node| {
        let d = dof(node as usize, 0);
        Vector3::new(displacement[d], displacement[d + 1], displacement[d + 2])
    })
}

/// Largest absolute eigenvalue of a symmetric 3 × 3 matrix, by the trigonometric formula.
pub(super) fn principal_max(e: &Matrix3<f64>) -> f64 {
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
    use crate::fem::tet10;
    use crate::mesh::{BuiltIn, generate};
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
        let summary = summarise_strain(&mesh, &u, &mut || {});
        assert!((summary.rotation_max - 30f64.to_radians()).abs() < 1e-14);
    }

    #[test]
    fn stretch_and_shear_give_their_principal_strains() {
        let mesh = tet();
        let stretched = field(&mesh, |p| Vector3::new(0.01 * p.x, -0.03 * p.y, 0.02 * p.z));
        assert!((summarise_strain(&mesh, &stretched, &mut || {}).strain_max - 0.03).abs() < 1e-15);
        let sheared = field(&mesh, |p| Vector3::new(0.02 * p.y, 0.0, 0.0));
        assert!((summarise_strain(&mesh, &sheared, &mut || {}).strain_max - 0.01).abs() < 1e-15);
    }

    #[test]
    fn ten_node_summary_of_a_linear_field_is_that_of_four_nodes() {
        let linear = tet();
        let mesh = QuadraticMesh::try_new(&linear).unwrap();
        let map = |p: &Point3<f64>| Vector3::new(0.1 * p.y + 0.02 * p.x, -0.04 * p.z, 0.03 * p.y);
        let u = field(&linear, map);
        let u_quadratic: Vec<f64> =
            mesh.vertices().iter().flat_map(|p| <[f64; 3]>::from(map(p))).collect();
        let (four, ten) = (
            summarise_strain(&linear, &u, &mut || {}),
            summarise_strain_quadratic(&mesh, &u_quadratic, &mut || {}),
        );
        assert!((four.rotation_max - ten.rotation_max).abs() < 1e-15);
        assert!((four.strain_max - ten.strain_max).abs() < 1e-15);
    }

    #[test]
    fn strain_of_a_bent_ten_node_element_is_that_of_the_field_at_its_quadrature_points() {
        let linear = tet();
        let mesh = QuadraticMesh::try_new(&linear).unwrap();
        // u = (0.01 x², 0, 0): strain 0.02 x along x alone, no rotation.
        let u: Vec<f64> =
            mesh.vertices().iter().flat_map(|p| [0.01 * p.x * p.x, 0.0, 0.0]).collect();
        let x_max = tet10::QUADRATURE
            .iter()
            .map(|l| linear.corners(0).iter().zip(l).map(|(c, l)| l * c.x).sum::<f64>())
            .fold(0.0, f64::max);
        let summary = summarise_strain_quadratic(&mesh, &u, &mut || {});
        assert!((summary.strain_max - 0.02 * x_max).abs() < 1e-16);
        assert!(summary.rotation_max < 1e-15);
    }

    #[test]
    fn dismissed_elements_are_never_the_largest() {
        let mesh = generate(BuiltIn::Sphere, 2000).unwrap();
        for seed in 0..20 {
            let wave = |i: usize| (f64::from(seed) + 1.7 * i as f64).sin();
            let turn = Rotation3::from_euler_angles(wave(1), 2.0 * wave(2), wave(3));
            let mut u = field(&mesh, |p| turn * p.coords - p.coords);
            for (i, u) in u.iter_mut().enumerate() {
                *u += 1e-3 * wave(i * i + 7);
            }
            let mut all = StrainSummary::default();
            for tet in 0..mesh.tets().len() {
                let mut alone = Largest::default();
                alone.see(&gradient_of(&mesh, tet, &u));
                all.rotation_max = all.rotation_max.max(alone.summary.rotation_max);
                all.strain_max = all.strain_max.max(alone.summary.strain_max);
            }
            assert_eq!(summarise_strain(&mesh, &u, &mut || {}), all, "seed {seed}");
        }
    }
}
