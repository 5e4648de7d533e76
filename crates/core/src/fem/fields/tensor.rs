//! Symmetric tensors of strain and stress, six numbers each, as viewers and decks order them.

use nalgebra::Matrix3;

/// A symmetric tensor as `xx yy zz xy yz zx`; shear strains are the tensor's, half of the engineering
/// ones.
pub type Tensor = [f64; 6];

/// The symmetric part of a matrix.
pub(crate) fn tensor_of(m: &Matrix3<f64>) -> Tensor {
    let mean = |i, j| 0.5 * (m[(i, j)] + m[(j, i)]);
    [m[(0, 0)], m[(1, 1)], m[(2, 2)], mean(0, 1), mean(1, 2), mean(0, 2)]
}

/// A tensor plus so much on its diagonal.
pub(crate) fn with_pressure(mut tensor: Tensor, pressure: f64) -> Tensor {
    tensor[..3].iter_mut().for_each(|normal| *normal += pressure);
    tensor
}

/// `a + factor b`.
pub(super) fn plus(mut a: Tensor, factor: f64, b: &Tensor) -> Tensor {
    a.iter_mut().zip(b).for_each(|(a, b)| *a += factor * b);
    a
}

/// Von Mises stress `√(3/2 s:s)` of a stress, s its deviator.
///
/// Units: those of the stress.
pub fn von_mises(stress: &Tensor) -> f64 {
    let [xx, yy, zz, xy, yz, zx] = *stress;
    let of_normals = (xx - yy).powi(2) + (yy - zz).powi(2) + (zz - xx).powi(2);
    (0.5 * of_normals + 3.0 * (xy * xy + yz * yz + zx * zx)).sqrt()
}

/// `t:t`, all nine components of it.
pub(super) fn square(tensor: &Tensor) -> f64 {
    let [xx, yy, zz, xy, yz, zx] = *tensor;
    xx * xx + yy * yy + zz * zz + 2.0 * (xy * xy + yz * yz + zx * zx)
}

/// `t : C⁻¹ : t` for isotropic moduli: twice the energy that a stress stores for each unit of volume.
///
/// Units: Pa.
pub(super) fn twice_energy(stress: &Tensor, (mu, kappa): (f64, f64)) -> f64 {
    let pressure = (stress[0] + stress[1] + stress[2]) / 3.0;
    let deviator = with_pressure(*stress, -pressure);
    square(&deviator) / (2.0 * mu) + pressure * pressure / kappa
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix6, Vector6};

    use super::*;
    use crate::fem::Material;

    const STRESS: Tensor = [3.0, -1.0, 0.5, 2.0, -0.25, 1.5];

    #[test]
    fn von_mises_of_one_axis_is_its_stress_and_of_pressure_is_zero() {
        assert_eq!(von_mises(&[-7.0, 0.0, 0.0, 0.0, 0.0, 0.0]), 7.0);
        assert_eq!(von_mises(&[5.0, 5.0, 5.0, 0.0, 0.0, 0.0]), 0.0);
        let shear = von_mises(&[0.0, 0.0, 0.0, 0.0, 2.0, 0.0]);
        assert!((shear - 2.0 * 3f64.sqrt()).abs() < 1e-15);
    }

    #[test]
    fn twice_the_energy_is_that_of_the_inverse_of_d() {
        let material = Material::try_new(2.0e4, 0.3).unwrap();
        let inverse: Matrix6<f64> = material.d().try_inverse().unwrap();
        let [xx, yy, zz, xy, yz, zx] = STRESS;
        let stress = Vector6::new(xx, yy, zz, yz, zx, xy);
        let expected = stress.dot(&(inverse * stress));
        let found = twice_energy(&STRESS, (material.shear_modulus(), material.bulk_modulus()));
        assert!((found - expected).abs() < 1e-13 * expected, "{found} for {expected}");
    }

    #[test]
    fn a_matrix_gives_its_symmetric_part() {
        let m = Matrix3::new(1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0);
        assert_eq!(tensor_of(&m), [1.0, 5.0, 9.0, 3.0, 7.0, 5.0]);
        let full = square(&tensor_of(&m));
        let by_hand = 1.0 + 25.0 + 81.0 + 2.0 * (9.0 + 49.0 + 25.0);
        assert_eq!(full, by_hand);
    }
}
