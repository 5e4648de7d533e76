//! Ceiling, rise and release: what stands between a computed force and a person's hand.

use nalgebra::Vector3;

/// Why the forces were released.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Release {
    /// The newest answer is too old.
    StaleAnswer,
    /// The hand was not seen for too long.
    StaleHand,
    /// A force is not a finite number, or the law of contact was not met.
    Unsolved,
    /// The device does not answer.
    DeviceLost,
    /// The server is gone.
    ServerLost,
    /// The ticks of the force came far too late.
    TickLost,
}

impl Release {
    /// The reason in words, for the report and the log.
    pub const fn words(self) -> &'static str {
        match self {
            Self::StaleAnswer => "the newest answer was too old",
            Self::StaleHand => "the hand was not seen",
            Self::Unsolved => "a force was no finite number or broke the law of contact",
            Self::DeviceLost => "the device did not answer",
            Self::ServerLost => "the server was lost",
            Self::TickLost => "a tick of the force came far too late",
        }
    }
}

/// Force below which the forces may begin, N: nobody is pushed by what was there before.
///
/// Source: the safeguard of CHAI3D.
pub const BEGIN_BELOW: f64 = 0.2;
/// Time in which the forces rise to their full size, s.
pub const RISE_SECONDS: f64 = 2.0;

/// Whether forces may act, and which share of them.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Phase {
    /// Until the commanded forces have been small once.
    Waits,
    /// The forces rise since a moment, s.
    Rises { since: f64 },
}

/// Holds forces back until it is safe, lets them rise, and releases them on a fault.
#[derive(Clone, Debug)]
pub struct Safeguard {
    force_max: f64,
    phase: Phase,
    /// Fault of the last tick.
    fault: Option<Release>,
    releases: Vec<(f64, Release)>,
    release_count: u64,
}

/// Releases that are kept with their time; all are counted.
const RELEASES_KEPT: usize = 64;

impl Safeguard {
    /// No force above `force_max`, N.
    pub fn new(force_max: f64) -> Self {
        Self { force_max, phase: Phase::Waits, fault: None, releases: Vec::new(), release_count: 0 }
    }

    /// The forces that may act now: none with a fault, and those of the ports otherwise.
    ///
    /// Shapes: one force for each port, N. Units: `now_s` s.
    pub fn guard(
        &mut self,
        now_s: f64,
        fault: Option<Release>,
        forces: &mut [Vector3<f64>],
    ) -> f64 {
        let is_finite = forces.iter().all(|f| f.iter().all(|x| x.is_finite()));
        let fault = if is_finite { fault } else { Some(Release::Unsolved) };
        if let Some(why) = fault {
            if self.fault != Some(why) {
                self.release_count += 1;
                if self.releases.len() < RELEASES_KEPT {
                    self.releases.push((now_s, why));
                }
            }
            self.fault = fault;
            self.phase = Phase::Waits;
            forces.fill(Vector3::zeros());
            return 0.0;
        }
        self.fault = None;
        let largest = forces.iter().map(Vector3::norm).fold(0.0, f64::max);
        if self.phase == Phase::Waits && largest < BEGIN_BELOW {
            self.phase = Phase::Rises { since: now_s };
        }
        let share = match self.phase {
            Phase::Waits => 0.0,
            Phase::Rises { since } => ((now_s - since) / RISE_SECONDS).clamp(0.0, 1.0),
        };
        for force in forces {
            *force *= share;
            let size = force.norm();
            if size > self.force_max {
                *force *= self.force_max / size;
            }
        }
        share
    }

    /// Releases with their times, s; the first 64 of them.
    pub fn releases(&self) -> &[(f64, Release)] {
        &self.releases
    }

    /// Number of releases.
    pub fn release_count(&self) -> u64 {
        self.release_count
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn guarded(guard: &mut Safeguard, now_s: f64, fault: Option<Release>, force: f64) -> f64 {
        let mut forces = [Vector3::x() * force];
        guard.guard(now_s, fault, &mut forces);
        forces[0].x
    }

    #[test]
    fn nothing_acts_until_the_command_was_small_once() {
        let mut guard = Safeguard::new(3.0);
        for tick in 0..5000 {
            assert_eq!(guarded(&mut guard, f64::from(tick) * 1e-3, None, 0.3), 0.0);
        }
        assert_eq!(guarded(&mut guard, 5.0, None, 0.1), 0.0);
        assert!((guarded(&mut guard, 6.0, None, 1.0) - 0.5).abs() < 1e-12);
        assert!((guarded(&mut guard, 7.0, None, 1.0) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn no_force_is_above_the_ceiling() {
        let mut guard = Safeguard::new(3.0);
        guarded(&mut guard, 0.0, None, 0.0);
        assert!((guarded(&mut guard, 3.0, None, 50.0) - 3.0).abs() < 1e-12);
    }

    #[test]
    fn a_fault_releases_at_once_and_the_force_rises_anew() {
        let mut guard = Safeguard::new(3.0);
        guarded(&mut guard, 0.0, None, 0.0);
        assert!(guarded(&mut guard, 3.0, None, 1.0) > 0.9);
        for now_s in [3.001, 3.002] {
            assert_eq!(guarded(&mut guard, now_s, Some(Release::DeviceLost), 1.0), 0.0);
        }
        assert_eq!(guarded(&mut guard, 3.003, None, 1.0), 0.0, "it waits for a small command");
        guarded(&mut guard, 3.004, None, 0.0);
        assert!(guarded(&mut guard, 3.005, None, 1.0) < 1e-3);
        assert_eq!(guard.releases(), [(3.001, Release::DeviceLost)]);
        assert_eq!(guarded(&mut guard, 4.0, None, f64::NAN), 0.0);
        assert_eq!(guard.releases()[1].1, Release::Unsolved);
        assert_eq!(guard.release_count(), 2);
    }
}
