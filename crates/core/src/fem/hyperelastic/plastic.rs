//! The plastic state of points, and what a deformation from it answers.

use nalgebra::{Matrix3, Vector3};

use super::Deformed;
use super::hencky::Hencky;
use super::principal::Principal;
use super::principal_tangent::{OfStrains, PrincipalTangent};

/// Yield stress and plastic state of all points of a body.
///
/// Shapes: `points` one for each point of each element, in their order.
#[derive(Clone, Debug)]
pub(super) struct Plastic {
    /// `√(2/3) σ_y`, Pa.
    pub radius: f64,
    pub points: Vec<PlasticPoint>,
}

/// Plastic state of one point.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlasticPoint {
    /// `Fp⁻¹` of `F = Fe Fp`, of determinant 1.
    pub fp_inverse: Matrix3<f64>,
    /// Accumulated plastic strain, `Σ √(2/3) ‖dev e‖` of what flowed.
    pub strain: f64,
}

impl Default for PlasticPoint {
    fn default() -> Self {
        Self { fp_inverse: Matrix3::identity(), strain: 0.0 }
    }
}

/// A deformation gradient from a plastic state as if the step had no flow: `Fe = F Fp⁻¹`.
pub(super) struct Trial<'a> {
    state: &'a PlasticPoint,
    fe: Matrix3<f64>,
    /// Axes of `Feᵀ Fe − I` and its principal values.
    principal: Principal,
    /// Principal logarithmic strains.
    strains: Vector3<f64>,
}

impl<'a> Trial<'a> {
    /// From a state; `None` where the volume is gone.
    ///
    /// Strains come from Green's strain of the elastic part, so that they are as exact at small
    /// strain, and after a large rotation, as elsewhere.
    #[inline]
    pub fn new(state: &'a PlasticPoint, deformed: &Deformed) -> Option<Self> {
        if deformed.j.is_nan() || deformed.j <= 0.0 {
            return None;
        }
        let a = &state.fp_inverse;
        let of_flow = a.tr_mul(a) - Matrix3::identity();
        let green_twice = a.tr_mul(&(deformed.green * 2.0 * a));
        let principal = Principal::new(&(green_twice + of_flow));
        let strains = principal.values.map(|value| 0.5 * value.ln_1p());
        let is_finite = strains.iter().all(|strain| strain.is_finite());
        is_finite.then(|| Self { state, fe: deformed.f * a, principal, strains })
    }

    /// Potential of the step for each unit of volume at rest, and its slope `P = ∂ψ/∂F`.
    ///
    /// Shapes: 3 × 3. Units: Pa.
    #[inline]
    pub fn potential_and_stress(&self, law: Hencky) -> (f64, Matrix3<f64>) {
        let at = law.at(&self.strains);
        let squares = self.principal.values.map(|value| 1.0 + value);
        let inner = self.principal.with_values(&at.stress().component_div(&squares));
        (at.potential(), self.fe * inner * self.state.fp_inverse.transpose())
    }

    /// Tangent consistent with the return, over `dF`.
    pub fn tangent(&self, law: Hencky) -> PrincipalTangent {
        self.tangent_with(law, |tangent| tangent)
    }

    /// Sum of the directions of `Fe` in which the tangent is positive, over `dF`.
    pub fn positive_tangent(&self, law: Hencky) -> PrincipalTangent {
        self.tangent_with(law, PrincipalTangent::positive_part)
    }

    fn tangent_with(
        &self,
        law: Hencky,
        part: impl Fn(PrincipalTangent) -> PrincipalTangent,
    ) -> PrincipalTangent {
        let at = law.at(&self.strains);
        let squares = self.principal.values.map(|value| 1.0 + value);
        let axes = &self.principal.axes;
        let left = self.fe * axes * Matrix3::from_diagonal(&squares.map(|s| 1.0 / s.sqrt()));
        let of_strains = OfStrains {
            strains: self.strains,
            squares,
            stress: at.stress(),
            slopes: at.slopes(),
            secant: at.secant(),
        };
        let tangent = part(of_strains.tangent(left, *axes));
        // dFe = dF Fp⁻¹ and dP = dPe Fp⁻ᵀ.
        PrincipalTangent { right: self.state.fp_inverse * axes, ..tangent }
    }

    /// The state behind the step.
    pub fn committed(&self, law: Hencky) -> PlasticPoint {
        let Some(flow) = law.at(&self.strains).flow() else { return *self.state };
        let back = self.principal.with_values(&flow.map(|flow| (-flow).exp()));
        let fp_inverse = self.state.fp_inverse * back;
        // Rounding must not add up to a change of volume.
        let fp_inverse = fp_inverse / fp_inverse.determinant().cbrt();
        PlasticPoint { fp_inverse, strain: self.state.strain + (2.0f64 / 3.0).sqrt() * flow.norm() }
    }
}

#[cfg(test)]
mod tests;
