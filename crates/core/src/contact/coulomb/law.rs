//! What holds between the force and the motion of one point: Coulomb's law, or a spring.

use super::cone::{FrictionCone, PointForce};

/// What holds between the force and the motion of a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PointLaw {
    /// The law of Signorini and Coulomb.
    Contact(FrictionCone),
    /// A force in proportion to the motion along the normal, `λ = −k u_n`: the geometric stiffness of a
    /// contact whose place moves with the surface.
    Spring {
        /// Stiffness k, N/m: what each direction has of the force; the first is not negative.
        stiffness: PointForce,
    },
}

impl PointLaw {
    /// Whether the point has a force whatever it moves by.
    pub(super) fn is_spring(self) -> bool {
        matches!(self, Self::Spring { .. })
    }

    /// Coefficient of friction; 0 for a spring.
    pub(super) fn friction(self) -> f64 {
        match self {
            Self::Contact(cone) => cone.friction,
            Self::Spring { .. } => 0.0,
        }
    }

    /// The nearest force that the law allows at some motion.
    pub(super) fn project(self, force: PointForce) -> PointForce {
        match self {
            Self::Contact(cone) => cone.project(force),
            Self::Spring { .. } => force,
        }
    }

    /// The force λ that obeys the law where the motion is `added (λ − force)`.
    ///
    /// Units: `force` N, `added` m/N.
    pub(super) fn yielding(self, force: PointForce, added: f64) -> PointForce {
        match self {
            Self::Contact(cone) => cone.project(force),
            Self::Spring { stiffness } => {
                // The motion along the normal is `−added force_n / (1 + k_n added)`.
                stiffness * (added * force.x / (1.0 + stiffness.x * added))
            }
        }
    }

    /// How far force and motion are from obeying the law, N: 0 where they do.
    ///
    /// Units: `force` N, `motion` m, `rho` N/m.
    pub(super) fn residual(self, force: PointForce, motion: PointForce, rho: f64) -> f64 {
        match self {
            Self::Contact(cone) => cone.residual(force, motion, rho),
            Self::Spring { stiffness } => {
                (force + stiffness * motion.x).norm() * rho / (rho + stiffness.x)
            }
        }
    }
}

impl From<FrictionCone> for PointLaw {
    fn from(cone: FrictionCone) -> Self {
        Self::Contact(cone)
    }
}
