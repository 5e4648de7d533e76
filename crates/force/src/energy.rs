//! Passivity of a port: an observer counts the energy that the hand was given, a controller holds the next
//! force so low that no motion can draw more than is there.

use nalgebra::Vector3;

use crate::limits::DeviceLimits;

/// Energy of one port of a device, in the sense of the hand: what it gives counts up.
///
/// Invariant: `Σ(−f·Δx) + b Σ‖Δx‖²/Δt ≥ −ε` after each tick that is no later than its hold, ε being the
/// reserve of the limits.
///
/// Source: Hannaford and Ryu (2002), time-domain passivity; here the controller scales the force by the
/// worst motion of the next tick instead of damping the last one.
#[derive(Clone, Debug)]
pub struct EnergyLedger {
    limits: DeviceLimits,
    /// Energy that may still be given, J.
    tank: f64,
    /// Sum of `−f·Δx` since the beginning, J.
    work: f64,
    /// Sum of `b‖Δx‖²/Δt`, J.
    damped: f64,
    /// Most energy that was given beyond what came in, J.
    created: f64,
    /// Number of ticks whose force was scaled down.
    held_back: u64,
    /// Force that is held now, N.
    held: Vector3<f64>,
}

/// Energy that a tank may keep, over what the model stores: fingers of one hand give each other some
/// through the object.
const KEPT_OF_STORED: f64 = 2.0;

impl EnergyLedger {
    /// A port at rest without force.
    pub fn new(limits: DeviceLimits) -> Self {
        Self {
            tank: limits.reserve,
            limits,
            work: 0.0,
            damped: 0.0,
            created: 0.0,
            held_back: 0,
            held: Vector3::zeros(),
        }
    }

    /// Books a tick in which the hand has moved against the force that was held.
    ///
    /// Units: `way` m, `seconds` s since the last tick.
    pub fn observe(&mut self, way: &Vector3<f64>, seconds: f64) {
        let work = -self.held.dot(way);
        let damped = match self.limits.is_active() && seconds > 0.0 {
            true => self.limits.damping * way.norm_squared() / seconds,
            false => 0.0,
        };
        self.work += work;
        self.damped += damped;
        self.tank += work + damped;
        self.created = self.created.max(-(self.work + self.damped));
    }

    /// The force that is held until the next tick: the wanted one, or as much of it as the tank allows.
    ///
    /// Units: N, J: `stored` is what the model stores at this port.
    pub fn allow(&mut self, wanted: Vector3<f64>, stored: f64) -> Vector3<f64> {
        self.held = wanted;
        if self.limits.is_active() {
            // What came in long ago and is stored nowhere is forgotten.
            let kept = self.limits.reserve + KEPT_OF_STORED * stored.max(0.0);
            self.tank = self.tank.min(kept);
            let (size, most) = (wanted.norm(), self.limits.force_within(self.tank));
            if size > most {
                self.held = wanted * (most / size);
                self.held_back += 1;
            }
        }
        self.held
    }

    /// Energy that the hand was given beyond what it gave and what the damping took, J: the most since
    /// the beginning, at least 0.
    pub fn created(&self) -> f64 {
        self.created
    }

    /// Energy that the hand has given, less what the device's damping took, J.
    pub fn balance(&self) -> f64 {
        self.work + self.damped
    }

    /// Number of ticks whose force was scaled down.
    pub fn held_back(&self) -> u64 {
        self.held_back
    }

    /// Force that is held now, N.
    pub fn held(&self) -> Vector3<f64> {
        self.held
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Whatever a controller wants and a hand does, no more than the reserve is given.
        #[test]
        fn no_force_and_no_motion_draw_more_than_the_reserve(
            ticks in prop::collection::vec(
                (prop::array::uniform3(-4.0..4.0f64), prop::array::uniform3(-2e-3..2e-3f64)), 1..300,
            ),
            stored in 0.0..1e-2f64,
        ) {
            let limits = DeviceLimits { delay: 0.0, ..DeviceLimits::desktop() };
            let mut ledger = EnergyLedger::new(limits);
            for (wanted, way) in ticks {
                ledger.allow(wanted.into(), stored);
                ledger.observe(&way.into(), limits.period);
                prop_assert!(ledger.balance() >= -limits.reserve - 1e-12);
            }
            prop_assert!(ledger.created() <= limits.reserve + 1e-12);
        }
    }

    #[test]
    fn the_worst_motion_draws_what_the_bound_says() {
        let limits = DeviceLimits { delay: 0.0, ..DeviceLimits::desktop() };
        let mut ledger = EnergyLedger::new(limits);
        let force = ledger.allow(Vector3::x() * 100.0, 0.0);
        let worst = force * limits.period / (2.0 * limits.damping);
        ledger.observe(&worst, limits.period);
        assert!((ledger.created() - limits.reserve).abs() < 1e-12);
        assert_eq!(ledger.allow(Vector3::x(), 0.0).norm(), 0.0, "the tank is empty");
        assert_eq!(ledger.held_back(), 2);
    }

    #[test]
    fn a_stiffest_spring_is_never_held_back() {
        let limits = DeviceLimits { delay: 0.0, reserve: 0.0, ..DeviceLimits::desktop() };
        let stiffness = 0.999 * limits.stiffness_max();
        let mut ledger = EnergyLedger::new(limits);
        let mut before = 0.0;
        for tick in 0..2000 {
            let now = 2e-3 * (1.0 - (f64::from(tick) * 0.05).cos());
            ledger.observe(&(Vector3::x() * (now - before)), limits.period);
            ledger.allow(Vector3::x() * (-stiffness * now), 0.5 * stiffness * now * now);
            before = now;
        }
        assert_eq!(ledger.held_back(), 0);
        assert!(ledger.created() < 1e-15, "{:e}", ledger.created());
    }

    #[test]
    fn a_brake_is_not_held_back() {
        let mut ledger = EnergyLedger::new(DeviceLimits::brakes());
        assert_eq!(ledger.allow(Vector3::x() * 4.0, 0.0), Vector3::x() * 4.0);
        ledger.observe(&(Vector3::x() * 1e-3), 1e-3);
        assert_eq!(ledger.held_back(), 0);
    }
}
