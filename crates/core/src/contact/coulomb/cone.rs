//! The cone of Coulomb's law, and how far a force and a motion are from obeying it.

use nalgebra::Vector3;

/// A force or a motion at one contact point: along the normal, then along two tangents.
pub type PointForce = Vector3<f64>;

/// All forces that Coulomb's law allows at one point: `‖λ_t‖ ≤ μ λ_n`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrictionCone {
    /// Coefficient of friction μ, at least 0.
    pub friction: f64,
}

impl FrictionCone {
    /// The force of the cone that is nearest to another force.
    ///
    /// Units: N.
    pub fn project(self, force: PointForce) -> PointForce {
        let mu = self.friction;
        let tangential = force.yz().norm();
        if tangential <= mu * force.x {
            return force;
        }
        // In the dual cone's negative: nearest is the tip.
        if mu * tangential <= -force.x {
            return PointForce::zeros();
        }
        let normal = (force.x + mu * tangential) / (1.0 + mu * mu);
        let along = if tangential > 0.0 { mu * normal / tangential } else { 0.0 };
        PointForce::new(normal, along * force.y, along * force.z)
    }

    /// How far force and motion are from obeying the law of Signorini and Coulomb, N.
    ///
    /// The natural map `‖λ − P(λ − ρ (u + μ‖u_t‖ n))‖` with De Saxcé's correction, so that it is zero
    /// exactly where the gap is not negative, the force presses and pulls not, one of both is zero,
    /// and friction opposes a slip with all it has.
    ///
    /// Units: `force` N, `motion` m (gap and slip), `rho` N/m.
    ///
    /// Source: De Saxcé and Feng (1998), Alart and Curnier (1991).
    pub fn residual(self, force: PointForce, motion: PointForce, rho: f64) -> f64 {
        let mut corrected = motion;
        corrected.x += self.friction * motion.yz().norm();
        (force - self.project(force - rho * corrected)).norm()
    }

    /// By how much a force leaves the cone: the larger of `‖λ_t‖ − μ λ_n` and `−λ_n`, at least 0, N.
    pub fn violation(self, force: PointForce) -> f64 {
        (force.yz().norm() - self.friction * force.x.max(0.0)).max(-force.x).max(0.0)
    }
}

/// The three numbers of a point.
pub(super) fn at(numbers: &[f64], point: usize) -> PointForce {
    Vector3::new(numbers[3 * point], numbers[3 * point + 1], numbers[3 * point + 2])
}

/// The numbers of some points, three for each, of those of all.
pub(super) fn chosen(all: &[f64], points: &[usize]) -> Vec<f64> {
    points.iter().flat_map(|&point| <[f64; 3]>::from(at(all, point))).collect()
}

/// Puts the numbers of some points, three for each, among those of all.
pub(super) fn put_back(numbers: &[f64], points: &[usize], all: &mut [f64]) {
    for (&point, numbers) in points.iter().zip(numbers.chunks_exact(3)) {
        all[3 * point..3 * point + 3].copy_from_slice(numbers);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn force() -> impl Strategy<Value = PointForce> {
        prop::array::uniform3(-2.0..2.0f64).prop_map(PointForce::from)
    }

    proptest! {
        #[test]
        fn projection_is_in_the_cone_and_no_force_of_the_cone_is_nearer(
            f in force(), other in force(), mu in 0.0..2.0f64,
        ) {
            let cone = FrictionCone { friction: mu };
            let nearest = cone.project(f);
            prop_assert!(cone.violation(nearest) < 1e-12);
            let normal = other.x.abs();
            let shrink = (mu * normal / other.yz().norm().max(1e-300)).min(1.0);
            let inside = PointForce::new(normal, shrink * other.y, shrink * other.z);
            prop_assert!((f - nearest).norm() <= (f - inside).norm() + 1e-12);
        }

        #[test]
        fn projecting_twice_changes_nothing(f in force(), mu in 0.0..2.0f64) {
            let cone = FrictionCone { friction: mu };
            let once = cone.project(f);
            prop_assert!((cone.project(once) - once).norm() < 1e-12);
        }
    }

    #[test]
    fn law_is_obeyed_in_its_three_states_and_broken_otherwise() {
        let cone = FrictionCone { friction: 0.5 };
        let residual = |f: [f64; 3], u: [f64; 3]| cone.residual(f.into(), u.into(), 3.0);
        assert_eq!(residual([0.0; 3], [0.1, 0.3, 0.0]), 0.0, "open");
        assert!(residual([1.0, 0.2, 0.1], [0.0; 3]) < 1e-15, "sticks");
        assert!(residual([1.0, -0.5, 0.0], [0.0, 0.3, 0.0]) < 1e-15, "slips");
        assert!(residual([1.0, 0.0, 0.0], [0.1, 0.0, 0.0]) > 0.1, "a force at a distance");
        assert!(residual([0.0; 3], [-0.1, 0.0, 0.0]) > 0.1, "a point inside");
        assert!(residual([1.0, 0.5, 0.0], [0.0, 0.3, 0.0]) > 0.1, "friction along the slip");
        assert!(
            residual([1.0, -0.2, 0.0], [0.0, 0.3, 0.0]) > 0.1,
            "less friction than it slips with"
        );
    }
}
