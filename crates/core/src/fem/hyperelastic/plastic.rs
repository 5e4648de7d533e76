//! Plasticity of a point: Hencky's elasticity up to a yield stress, and the state that flow leaves.

use nalgebra::{Matrix3, Vector3};

use super::Deformed;
use super::principal::{Curvature, OfStrains, Principal, PrincipalTangent};

/// Hencky's law `W = μ dev e : dev e + κ/2 (tr e)²` of the logarithmic strain e, with von Mises'
/// yield stress and without hardening.
///
/// Units: Pa.
///
/// Source: Simo, "Algorithms for static and dynamic multiplicative plasticity that preserve the
/// classical return mapping schemes of the infinitesimal theory", CMAME 99 (1992) 61.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Hencky {
    /// Shear modulus μ.
    pub mu: f64,
    /// Bulk modulus κ.
    pub kappa: f64,
    /// Largest norm of the deviatoric Kirchhoff stress, `√(2/3) σ_y`.
    pub radius: f64,
}

/// The law at trial strains: principal logarithmic strains of a step that had no plastic flow.
#[derive(Clone, Copy, Debug)]
pub(super) struct TrialStrains {
    law: Hencky,
    trace: f64,
    deviator: Vector3<f64>,
    /// Norm `‖dev e‖` of the deviatoric strain.
    size: f64,
}

/// Up to this share above the yield stress the tangent is the elastic one. A shape whose plastic strain was
/// made permanent lies on the yield surface but for rounding, and from there unloading is as likely as
/// further flow.
const ON_YIELD: f64 = 1e-9;

impl Hencky {
    /// At three principal logarithmic strains.
    #[inline]
    pub fn at(self, strains: &Vector3<f64>) -> TrialStrains {
        let trace = strains.sum();
        let deviator = strains.map(|e| e - trace / 3.0);
        TrialStrains { law: self, trace, deviator, size: deviator.norm() }
    }
}

impl TrialStrains {
    /// Whether the step has plastic flow.
    #[inline]
    pub fn is_plastic(&self) -> bool {
        2.0 * self.law.mu * self.size > self.law.radius
    }

    /// Potential of the step: elastic energy behind the flow, and what the flow dissipates.
    ///
    /// Units: Pa.
    ///
    /// Source: Ortiz and Stainier, CMAME 171 (1999) 419, without hardening.
    #[inline]
    pub fn potential(&self) -> f64 {
        let Hencky { mu, kappa, radius } = self.law;
        let of_shape = match self.is_plastic() {
            true => radius * (self.size - radius / (4.0 * mu)),
            false => mu * self.size * self.size,
        };
        0.5 * kappa * self.trace * self.trace + of_shape
    }

    /// `dev τ` over the trial `dev e`, Pa.
    #[inline]
    pub fn secant(&self) -> f64 {
        if self.is_plastic() { self.law.radius / self.size } else { 2.0 * self.law.mu }
    }

    /// Principal Kirchhoff stresses, the slope of the potential, Pa.
    #[inline]
    pub fn stress(&self) -> Vector3<f64> {
        let pressure = self.law.kappa * self.trace;
        (self.deviator * self.secant()).map(|of_shape| of_shape + pressure)
    }

    /// Slopes of the stresses, Pa; on the yield surface the elastic ones.
    pub fn slopes(&self) -> Matrix3<f64> {
        let secant = self.secant();
        let mut slopes = Matrix3::from_element(self.law.kappa - secant / 3.0);
        (0..3).for_each(|i| slopes[(i, i)] += secant);
        if 2.0 * self.law.mu * self.size > self.law.radius * (1.0 + ON_YIELD) {
            let direction = self.deviator / self.size;
            slopes -= direction * direction.transpose() * secant;
        }
        slopes
    }

    /// Plastic strain of the step, its principal values; none while the step is elastic.
    ///
    /// The return is radial, exact for this law.
    pub fn flow(&self) -> Option<Vector3<f64>> {
        let share = 1.0 - self.law.radius / (2.0 * self.law.mu * self.size);
        self.is_plastic().then(|| self.deviator * share)
    }
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

    /// Tangent consistent with the return, over `dF`, or the sum of the directions of `Fe` in which it
    /// is positive.
    pub fn tangent(&self, law: Hencky, curvature: Curvature) -> PrincipalTangent {
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
        let tangent = of_strains.tangent(left, *axes);
        let tangent = match curvature {
            Curvature::AsItIs => tangent,
            Curvature::PositivePart => tangent.positive_part(),
        };
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
