//! Hencky's elasticity up to a yield stress, at principal logarithmic strains.

use nalgebra::{Matrix3, Vector3};

/// Hencky's law `W = μ dev e : dev e + κ/2 (tr e)²` of the logarithmic strain e, with von Mises'
/// yield stress and without hardening.
///
/// Units: Pa.
///
/// Source: Simo, "Algorithms for static and dynamic multiplicative plasticity that preserve the
/// classical return mapping schemes of the infinitesimal theory", CMAME 99 (1992) 61.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Hencky {
    /// μ.
    pub mu: f64,
    /// κ.
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
    /// `‖dev e‖`.
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
