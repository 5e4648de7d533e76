//! What a run tells of its forces.

use serde::Serialize;

use crate::rendering::Rendering;

/// The forces of a run, for its report.
///
/// Units: as in the names.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ForceReport {
    /// Name of the device.
    pub device: String,
    /// Ticks of the force in a second, as planned.
    pub rate_hz: f64,
    /// Number of ticks that were played.
    pub ticks: u64,
    /// Number of ticks that were not played, because the one before took too long.
    pub missed: u64,
    /// Share of all ticks that were missed, or begun more than half a period late.
    pub late_share: f64,
    /// Longest delay of a tick, ms.
    pub late_worst_ms: f64,
    /// Longest time that a tick computed, ms.
    pub computed_worst_ms: f64,
    /// Whether the thread had real-time rights.
    pub is_urgent: bool,
    /// Number of answers with a small system.
    pub answers: u64,
    /// Largest age of the answer of a tick with contacts, ms.
    pub answer_age_worst_ms: f64,
    /// Largest force at a port, N.
    pub force_max_n: f64,
    /// Most energy that a port was given beyond what it gave and its damping took, J.
    pub energy_created_j: f64,
    /// Share of the ticks and ports whose force passivity has held back.
    pub held_back_share: f64,
    /// Largest share of a port's stiffness that the virtual coupling has taken.
    pub softened_max: f64,
    /// Number of releases.
    pub release_count: u64,
    /// Releases with their times; the first 64.
    pub releases: Vec<ReleaseReport>,
    /// Why the device has ended badly; `None` where it has not.
    pub device_failed: Option<String>,
}

/// A release of the forces.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ReleaseReport {
    /// Time since the beginning of the forces, s.
    pub at_s: f64,
    /// The reason in words.
    pub why: &'static str,
}

impl ForceReport {
    /// Adds what the rendering has counted.
    pub(crate) fn add_rendering(&mut self, rendering: &Rendering) {
        let ledgers = rendering.ledgers();
        let held_back: u64 = ledgers.iter().map(|ledger| ledger.held_back()).sum();
        self.force_max_n = rendering.force_max();
        self.energy_created_j = ledgers.iter().map(|l| l.created()).fold(0.0, f64::max);
        self.held_back_share = held_back as f64 / (self.ticks.max(1) * ledgers.len() as u64) as f64;
        self.softened_max = rendering.softened();
        self.release_count = rendering.guard().release_count();
        let releases = rendering.guard().releases().iter();
        self.releases =
            releases.map(|&(at_s, why)| ReleaseReport { at_s, why: why.words() }).collect();
    }
}
