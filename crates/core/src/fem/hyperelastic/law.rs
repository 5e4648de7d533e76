//! Laws of isotropic hyperelastic materials: energy, stress and tangent in closed form.

use std::fmt;
use std::str::FromStr;

use nalgebra::Matrix3;

use super::Deformed;
use super::shrink::shrink;
use crate::fem::Material;

/// Which energy a material stores. Small strains give the linear answers (3.15) by both.
///
/// ```
/// use softgrasp_core::Law;
///
/// assert_eq!("neo-hookean".parse(), Ok(Law::default()));
/// assert_eq!(Law::NeoHookeanLog.to_string(), "neo-hookean-log");
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Law {
    /// `W = μ/2 (J^−2/3 tr FᵀF − 3) + κ/2 (J − 1)²`: that of Abaqus, Ansys and CalculiX.
    #[default]
    NeoHookean,
    /// `W = μ/2 (tr FᵀF − 3) − μ ln J + λ/2 ln² J`: that of FEBio, SOFA and PolyFEM.
    NeoHookeanLog,
}

/// A name that no law has.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no material is called {name:?}; there are neo-hookean and neo-hookean-log")]
pub struct UnknownLaw {
    /// The name given.
    pub name: String,
}

impl Law {
    /// Name, as in commands and reports.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::NeoHookean => "neo-hookean",
            Self::NeoHookeanLog => "neo-hookean-log",
        }
    }
}

impl fmt::Display for Law {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
}

impl FromStr for Law {
    type Err = UnknownLaw;

    fn from_str(name: &str) -> Result<Self, UnknownLaw> {
        [Self::NeoHookean, Self::NeoHookeanLog]
            .into_iter()
            .find(|law| law.as_str() == name)
            .ok_or_else(|| UnknownLaw { name: name.to_owned() })
    }
}

/// A law with its moduli.
///
/// Units: Pa.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moduli {
    pub(super) law: Law,
    pub(super) mu: f64,
    /// κ of [`Law::NeoHookean`], λ of [`Law::NeoHookeanLog`].
    pub(super) volumetric: f64,
}

/// The tangent `dP = a dF + b [(G : dF) F + (F : dF) G] + c (G : dF) G + d G dFᵀ G` with `G = F⁻ᵀ`,
/// which both laws have.
///
/// Units: Pa.
///
/// Source: derivative of [`Moduli::stress`]; compared with differences in the tests.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TangentCoefficients {
    /// Coefficient of `dF`.
    pub a: f64,
    /// Coefficient of `(G : dF) F + (F : dF) G`.
    pub b: f64,
    /// Coefficient of `(G : dF) G`.
    pub c: f64,
    /// Coefficient of `G dFᵀ G`.
    pub d: f64,
}

/// Which part of the moduli counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ModuliPart {
    /// Change of shape and change of volume.
    Whole,
    /// Without the change of volume, which is averaged around nodes.
    WithoutVolume,
}

impl ModuliPart {
    #[inline(always)]
    pub fn of(self, moduli: Moduli) -> Moduli {
        match self {
            Self::Whole => moduli,
            Self::WithoutVolume => moduli.without_volume(),
        }
    }
}

impl Moduli {
    /// Moduli of a material: μ = E/2(1+ν), κ = E/3(1−2ν), λ = κ − 2μ/3.
    pub fn new(law: Law, material: &Material) -> Self {
        let volumetric = match law {
            Law::NeoHookean => material.bulk_modulus(),
            Law::NeoHookeanLog => material.lame_lambda(),
        };
        Self { law, mu: material.shear_modulus(), volumetric }
    }

    /// A material of 1 Pa of shear modulus alone, and one of 1 Pa of volumetric modulus alone: energy, stress
    /// and tangent are sums of theirs.
    pub(super) fn units(law: Law) -> [Self; 2] {
        [Self { law, mu: 1.0, volumetric: 0.0 }, Self { law, mu: 0.0, volumetric: 1.0 }]
    }

    /// Bulk modulus κ at small strains, Pa.
    pub(super) fn bulk(&self) -> f64 {
        match self.law {
            Law::NeoHookean => self.volumetric,
            Law::NeoHookeanLog => self.volumetric + 2.0 / 3.0 * self.mu,
        }
    }

    /// Poisson's ratio at small strains.
    pub(super) fn poisson(&self) -> f64 {
        let kappa = self.bulk();
        (3.0 * kappa - 2.0 * self.mu) / (6.0 * kappa + 2.0 * self.mu)
    }

    /// The part that belongs to an element when the volume ratio is averaged around nodes; the rest
    /// is [`Moduli::pressure_of_volume`].
    pub(super) fn without_volume(self) -> Self {
        Self { volumetric: 0.0, ..self }
    }

    /// μ and κ at small strain, Pa.
    pub(super) fn at_small_strain(self) -> (f64, f64) {
        (self.mu, self.bulk())
    }

    /// Energy for each unit of volume at rest; infinite where the volume is gone.
    ///
    /// Units: Pa.
    #[inline]
    pub fn energy(&self, point: &Deformed) -> f64 {
        if point.j <= 0.0 || point.j.is_nan() {
            return f64::INFINITY;
        }
        let trace = point.green.trace();
        match self.law {
            Law::NeoHookean => {
                // J^−2/3 (3 + 2 tr E) − 3, without subtracting what is nearly equal.
                let shrunk = shrink(point.j_minus_one);
                0.5 * self.mu * (3.0 * shrunk + 2.0 * trace * (1.0 + shrunk))
                    + self.energy_of_volume(point.j_minus_one)
            }
            Law::NeoHookeanLog => {
                self.mu * (trace - point.j_minus_one.ln_1p())
                    + self.energy_of_volume(point.j_minus_one)
            }
        }
    }

    /// First Piola–Kirchhoff stress `P = ∂W/∂F`.
    ///
    /// Shapes: 3 × 3. Units: Pa.
    ///
    /// Written as `F⁻ᵀ` times a symmetric matrix of Green's strain, so that it is as exact at small
    /// strain, and after a large rotation, as elsewhere.
    #[inline]
    pub fn stress(&self, point: &Deformed) -> Matrix3<f64> {
        let Deformed { f_inverse_transposed: g, green, j, j_minus_one, .. } = point;
        let mut inner = match self.law {
            Law::NeoHookean => {
                let a = self.mu * (1.0 + shrink(*j_minus_one));
                let mut inner = green * (2.0 * a);
                let mean = inner.trace() / 3.0;
                (0..3).for_each(|i| inner[(i, i)] -= mean);
                inner
            }
            Law::NeoHookeanLog => green * (2.0 * self.mu),
        };
        let pressure = j * self.pressure_of_volume(*j_minus_one);
        (0..3).for_each(|i| inner[(i, i)] += pressure);
        g * inner
    }

    /// Energy of the change of volume alone, U(J).
    #[inline]
    pub(super) fn energy_of_volume(&self, j_minus_one: f64) -> f64 {
        let x = match self.law {
            Law::NeoHookean => j_minus_one,
            Law::NeoHookeanLog => j_minus_one.ln_1p(),
        };
        0.5 * self.volumetric * x * x
    }

    /// Pressure `U′(J)` of a change of volume, Pa.
    #[inline]
    pub(super) fn pressure_of_volume(&self, j_minus_one: f64) -> f64 {
        match self.law {
            Law::NeoHookean => self.volumetric * j_minus_one,
            Law::NeoHookeanLog => self.volumetric * j_minus_one.ln_1p() / (1.0 + j_minus_one),
        }
    }

    /// Stiffness `U″(J)` of a change of volume, Pa. That of the logarithmic law is negative beyond J = e.
    #[inline]
    pub(super) fn bulk_of_volume(&self, j_minus_one: f64) -> f64 {
        match self.law {
            Law::NeoHookean => self.volumetric,
            Law::NeoHookeanLog => {
                let j = 1.0 + j_minus_one;
                self.volumetric * (1.0 - j_minus_one.ln_1p()) / (j * j)
            }
        }
    }

    /// Coefficients of the tangent at a point.
    #[inline]
    pub fn tangent(&self, point: &Deformed) -> TangentCoefficients {
        let j = point.j;
        // d(U′ J G) = (U″ J² + U′ J) (G : dF) G − U′ J G dFᵀ G.
        let pressure = j * self.pressure_of_volume(point.j_minus_one);
        let of_volume = j * j * self.bulk_of_volume(point.j_minus_one) + pressure;
        match self.law {
            Law::NeoHookean => {
                let a = self.mu * (1.0 + shrink(point.j_minus_one));
                let squares = 3.0 + 2.0 * point.green.trace();
                TangentCoefficients {
                    a,
                    b: -2.0 / 3.0 * a,
                    c: 2.0 / 9.0 * a * squares + of_volume,
                    d: a * squares / 3.0 - pressure,
                }
            }
            Law::NeoHookeanLog => {
                TangentCoefficients { a: self.mu, b: 0.0, c: of_volume, d: self.mu - pressure }
            }
        }
    }
}

impl TangentCoefficients {
    /// `dP` of a change `dF`.
    ///
    /// Shapes: 3 × 3. Units: Pa.
    #[inline]
    pub fn apply(&self, point: &Deformed, df: &Matrix3<f64>) -> Matrix3<f64> {
        let (f, g) = (&point.f, &point.f_inverse_transposed);
        let (along_g, along_f) = (g.dot(df), f.dot(df));
        df * self.a
            + f * (self.b * along_g)
            + g * (self.b * along_f + self.c * along_g)
            + g * (df.tr_mul(g) * self.d)
    }
}

#[cfg(test)]
mod tests;
