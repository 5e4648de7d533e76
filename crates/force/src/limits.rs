//! What a device can render without shaking: damping, delay, rate, and the largest force.

/// Physical limits of a device, from which the stiffest spring that it may render follows.
///
/// Units: N s/m, s, N, J.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeviceLimits {
    /// Damping of the device and the hand on it, N s/m; infinite for a brake, which only resists.
    pub damping: f64,
    /// Time from a position to the force that answers it, beside the hold of a tick, s.
    pub delay: f64,
    /// Time from tick to tick, s.
    pub period: f64,
    /// Largest force of a port, N.
    pub force_max: f64,
    /// Energy that a port may have given at most beyond what it was given, J: ε of the guarantee.
    pub reserve: f64,
}

/// Time from tick to tick, s.
pub const PERIOD: f64 = 1e-3;
/// Damping of a desktop device with a hand on it, N s/m: the figure with which Colgate's limit is
/// usually worked out.
const DESKTOP_DAMPING: f64 = 0.5;
/// Position and force travel by a socket and USB, s.
const DESKTOP_DELAY: f64 = 1e-3;
/// Below what desktop devices can hold for long.
const DESKTOP_FORCE: f64 = 3.0;
/// A millijoule lifts ten grams by a centimetre.
const RESERVE: f64 = 1e-3;
/// A level of one stands for this force, N: a firm pinch.
pub const FULL_LEVEL: f64 = 5.0;

impl DeviceLimits {
    /// Limits of an arm on the desk that moves one point by newtons.
    pub const fn desktop() -> Self {
        Self {
            damping: DESKTOP_DAMPING,
            delay: DESKTOP_DELAY,
            period: PERIOD,
            force_max: DESKTOP_FORCE,
            reserve: RESERVE,
        }
    }

    /// Limits of brakes and strings at the fingers: they only resist, so that they give no energy.
    pub const fn brakes() -> Self {
        Self {
            damping: f64::INFINITY,
            delay: 0.0,
            period: PERIOD,
            force_max: FULL_LEVEL,
            reserve: RESERVE,
        }
    }

    /// Stiffest spring that the device holds still with, N/m: `b / (T/2 + t_d)`.
    ///
    /// Source: Colgate and Schenkel (1997), with the delay added to the half of the hold.
    pub fn stiffness_max(&self) -> f64 {
        self.damping / (0.5 * self.period + self.delay)
    }

    /// Largest force that cannot take more than an energy (J) from a port until the next tick, whatever
    /// the hand does, N.
    ///
    /// A force f that is held for T does the work `f·Δx` and the damping takes at least `b‖Δx‖²/T`, so
    /// that at most `f² T/(4b)` is given. The delay counts twice, as in [`Self::stiffness_max`].
    pub fn force_within(&self, energy: f64) -> f64 {
        let hold = self.period + 2.0 * self.delay;
        (4.0 * self.damping * energy.max(0.0) / hold).sqrt()
    }

    /// Whether the device can give energy at all.
    pub fn is_active(&self) -> bool {
        self.damping.is_finite()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stiffest_spring_is_that_of_colgate_with_delay() {
        let of_delay = |delay| DeviceLimits { delay, ..DeviceLimits::desktop() }.stiffness_max();
        assert!((of_delay(1e-3) - 333.3).abs() < 0.1);
        assert!((of_delay(0.0) - 1000.0).abs() < 1e-9);
        assert_eq!(DeviceLimits::brakes().stiffness_max(), f64::INFINITY);
    }

    #[test]
    fn a_spring_of_the_stiffest_kind_may_give_back_what_it_stores() {
        let limits = DeviceLimits::desktop();
        let (stiffness, force) = (limits.stiffness_max(), 1.3);
        let stored = 0.5 * force * force / stiffness;
        assert!((limits.force_within(stored) - force).abs() < 1e-12);
        assert_eq!(limits.force_within(-1.0), 0.0);
    }
}
