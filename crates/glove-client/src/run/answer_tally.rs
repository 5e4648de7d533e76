//! The answers of a run in a few numbers, which do not grow with it.

use softgrasp_protocol::solve_report::SolveSummary;

use crate::run::times::Times;

/// What the answers of a run were like.
#[derive(Clone, Debug, Default)]
pub struct AnswerTally {
    /// How many there were.
    pub solves: usize,
    /// Largest relative residual.
    pub residual_rel_max: f64,
    /// Round trips, ms.
    pub round_trips: Times,
    /// Ages of the shapes that deforming ticks showed, ms.
    pub ages: Times,
    /// Bytes on the wire of all requests that were answered.
    pub bytes_sent: u64,
    /// Bytes on the wire of their answers.
    pub bytes_received: u64,
    /// Largest rotation of an element, degrees; `None` where no answer tells it.
    pub max_rotation_deg: Option<f64>,
    /// Largest strain of an element, of the same answers.
    pub max_strain: Option<f64>,
    /// Answers with the equations of large deformation.
    pub large_solves: usize,
    /// Largest estimated relative error.
    pub error_estimate_rel_max: Option<f64>,
    /// Smallest ratio of an element's volume to that at rest, of the answers at large deformation.
    pub min_jacobian: Option<f64>,
    /// Equilibria that jumped.
    pub jumps: usize,
    /// Largest resident memory of the server, bytes.
    pub peak_rss_bytes: u64,
    /// The last answer.
    pub last: Option<SolveSummary>,
}

impl AnswerTally {
    /// Counts an answer.
    pub fn add(&mut self, solve: &SolveSummary) {
        self.solves += 1;
        self.residual_rel_max = self.residual_rel_max.max(solve.report.residual_rel);
        self.round_trips.add(solve.round_trip_ms);
        self.bytes_sent += solve.request_bytes;
        self.bytes_received += solve.answer_bytes;
        // An answer that has no time to work a number out has none.
        let told = |number: f64| number.is_finite().then_some(number);
        self.max_rotation_deg = larger(self.max_rotation_deg, told(solve.report.max_rotation_deg));
        self.max_strain = larger(self.max_strain, told(solve.report.max_strain));
        self.error_estimate_rel_max =
            larger(self.error_estimate_rel_max, solve.report.error_estimate_rel);
        let large = solve.large.as_ref().filter(|_| solve.deformation == "large");
        if let Some(large) = large {
            self.large_solves += 1;
            self.jumps += usize::from(large.jumped);
            let least = self.min_jacobian.into_iter().chain([large.min_jacobian]);
            self.min_jacobian = least.min_by(f64::total_cmp);
        }
        self.peak_rss_bytes = self.peak_rss_bytes.max(solve.report.peak_rss_bytes);
        self.last = Some(solve.clone());
    }
}

fn larger(one: Option<f64>, other: Option<f64>) -> Option<f64> {
    one.into_iter().chain(other).max_by(f64::total_cmp)
}
