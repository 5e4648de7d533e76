//! Isotropic linear elastic material (thesis 3.9–3.15).

use nalgebra::Matrix6;

/// Young's modulus and Poisson's ratio of one region.
///
/// Units: `young` Pa, `poisson` 1.
/// Invariant: `young` > 0, −1 < `poisson` < 0.5, both finite.
///
/// Source: thesis (3.9).
///
/// ```
/// use softgrasp_core::Material;
///
/// let silicone = Material::try_new(1.0e5, 0.49)?;
/// assert_eq!((silicone.young(), silicone.poisson()), (1.0e5, 0.49));
/// assert!(Material::try_new(1.0e5, 0.5).is_err());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    young: f64,
    poisson: f64,
}

/// A material outside the range in which `D` is positive definite.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum MaterialError {
    /// Young's modulus is not a positive finite number.
    #[error("Young's modulus is {young}; it must be a finite number above 0 Pa")]
    Young {
        /// Modulus or ratio that was given.
        young: f64,
    },
    /// Poisson's ratio is outside (−1, 0.5).
    #[error(
        "Poisson's ratio is {poisson}; it must lie between -1 and 0.5, both excluded \
         (0.5 is incompressible: use 0.49 or so)"
    )]
    Poisson {
        /// Modulus or ratio that was given.
        poisson: f64,
    },
}

impl Material {
    /// Checked constructor.
    ///
    /// # Errors
    /// [`MaterialError`] when `D` (3.15) would not be positive definite.
    pub fn try_new(young: f64, poisson: f64) -> Result<Self, MaterialError> {
        if !(young.is_finite() && young > 0.0) {
            return Err(MaterialError::Young { young });
        }
        if !(poisson > -1.0 && poisson < 0.5) {
            return Err(MaterialError::Poisson { poisson });
        }
        Ok(Self { young, poisson })
    }

    /// Modulus of elasticity `E`, Pa.
    pub fn young(&self) -> f64 {
        self.young
    }

    /// Poisson's ratio `ν`.
    pub fn poisson(&self) -> f64 {
        self.poisson
    }

    /// Modulus of rigidity `G = E / (2 (1 + ν))`, Pa; also Lamé's `μ`.
    ///
    /// Source: thesis (3.10).
    pub fn shear_modulus(&self) -> f64 {
        self.young / (2.0 * (1.0 + self.poisson))
    }

    /// Lamé's `λ = E ν / ((1 + ν)(1 − 2ν))`, Pa: the off-diagonal entry of `D`.
    pub fn lame_lambda(&self) -> f64 {
        self.young * self.poisson / ((1.0 + self.poisson) * (1.0 - 2.0 * self.poisson))
    }

    /// Bulk modulus `κ = E / (3 (1 − 2ν))`, Pa.
    pub fn bulk_modulus(&self) -> f64 {
        self.young / (3.0 * (1.0 - 2.0 * self.poisson))
    }

    /// Stress from strain, `σ = D ε`, order `x y z yz zx xy` with engineering shear.
    ///
    /// Shapes: 6 × 6. Units: Pa.
    ///
    /// Source: thesis (3.12)–(3.15). The order of the shear rows is that of `B` (3.30), which
    /// makes no difference to an isotropic `D`.
    pub fn d(&self) -> Matrix6<f64> {
        let nu = self.poisson;
        let scale = self.young / ((1.0 + nu) * (1.0 - 2.0 * nu));
        let mut d = Matrix6::zeros();
        for i in 0..3 {
            for j in 0..3 {
                d[(i, j)] = if i == j { 1.0 - nu } else { nu };
            }
            d[(i + 3, i + 3)] = 0.5 - nu;
        }
        d * scale
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector6;

    #[test]
    fn stress_of_uniaxial_strain_state_inverts_hookes_law() {
        let material = Material::try_new(2.0e5, 0.3).unwrap();
        // Hooke's law (3.9) for σ = (1, 0, 0): ε = (1, −ν, −ν) / E.
        let strain = Vector6::new(1.0, -0.3, -0.3, 0.0, 0.0, 0.0) / 2.0e5;
        let stress = material.d() * strain;
        assert!((stress - Vector6::new(1.0, 0.0, 0.0, 0.0, 0.0, 0.0)).amax() < 1e-14);
    }

    #[test]
    fn lame_parameters_are_entries_of_d() {
        let material = Material::try_new(1.0e5, 0.4).unwrap();
        let d = material.d();
        assert!((d[(0, 1)] - material.lame_lambda()).abs() < 1e-9);
        assert!((d[(3, 3)] - material.shear_modulus()).abs() < 1e-9);
    }

    #[test]
    fn values_without_a_positive_definite_d_are_refused() {
        for (young, poisson) in [(0.0, 0.3), (-1.0, 0.3), (f64::NAN, 0.3), (f64::INFINITY, 0.3)] {
            assert!(matches!(Material::try_new(young, poisson), Err(MaterialError::Young { .. })));
        }
        for poisson in [0.5, 0.7, -1.0, f64::NAN] {
            let made = Material::try_new(1.0, poisson);
            assert!(matches!(made, Err(MaterialError::Poisson { .. })));
        }
    }
}
