//! Answers and times of a run in a few numbers, whose size does not grow with the run.

use hdrhistogram::Histogram;
use softgrasp_protocol::solve_report::SolveSummary;

/// Largest and typical numbers of the answers of a run.
#[derive(Clone, Debug, Default)]
pub struct AnswerTally {
    /// Number of answers.
    pub solves: usize,
    /// Largest relative residual of an answer.
    pub residual_rel_max: f64,
    /// Times from sending a request to having its answer, ms.
    pub round_trips: Times,
    /// Ages of the shapes that deforming ticks showed, ms.
    pub ages: Times,
    /// Sum of the lengths of all answered requests on the wire, bytes.
    pub bytes_sent: u64,
    /// Sum of the lengths of their answers on the wire, bytes.
    pub bytes_received: u64,
    /// Largest rotation of an element, degrees; `None` if no answer tells it.
    pub max_rotation_deg: Option<f64>,
    /// Largest strain of an element, of the same answers.
    pub max_strain: Option<f64>,
    /// Number of answers by the equations of large deformation.
    pub large_solves: usize,
    /// Largest estimated relative error of an answer.
    pub error_estimate_rel_max: Option<f64>,
    /// Smallest ratio of an element's volume to that at rest, of the answers at large deformation.
    pub min_jacobian: Option<f64>,
    /// Number of equilibria that jumped to another shape.
    pub jumps: usize,
    /// Largest resident memory of the server, bytes.
    pub peak_rss_bytes: u64,
    /// Report of the last answer.
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

/// Distribution of times, for quantiles. A quantile is wrong by at most 0.1 %.
///
/// Units: ms; from 1 ns to 1 h, longer ones count as 1 h.
#[derive(Clone, Debug)]
pub struct Times(Histogram<u64>);

/// Longest time that is counted: one hour, ns.
const LONGEST_NS: u64 = 3_600_000_000_000;
const NS_PER_MS: f64 = 1e6;

impl Default for Times {
    fn default() -> Self {
        let histogram = Histogram::new_with_bounds(1, LONGEST_NS, 3);
        Self(histogram.expect("the bounds are in order and the digits few"))
    }
}

impl Times {
    /// Counts a time, ms.
    pub fn add(&mut self, ms: f64) {
        // A number that is none counts as the shortest.
        self.0.saturating_record((ms * NS_PER_MS) as u64);
    }

    /// Number of times.
    pub fn count(&self) -> u64 {
        self.0.len()
    }

    /// Quantile `q` of the times, ms; `None` if there are none.
    pub fn quantile(&self, q: f64) -> Option<f64> {
        (!self.0.is_empty()).then(|| self.0.value_at_quantile(q) as f64 / NS_PER_MS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_of_a_million_times_are_those_of_the_sorted_list_and_take_no_more_memory() {
        let mut times = Times::default();
        assert_eq!((times.quantile(0.5), times.count()), (None, 0));
        // 0.001 ms to 1000 ms in a scrambled order.
        for i in 0..1_000_000u64 {
            times.add(1e-3 * ((i * 7_919) % 1_000_000 + 1) as f64);
        }
        for (q, expected) in [(0.5, 500.0), (0.99, 990.0), (1.0, 1000.0)] {
            let found = times.quantile(q).unwrap();
            assert!((found / expected - 1.0).abs() < 1e-3, "{q}: {found}");
        }
        let fresh = Times::default();
        assert_eq!(times.0.distinct_values(), fresh.0.distinct_values());
        for odd in [f64::NAN, -1.0, f64::INFINITY] {
            times.add(odd);
        }
        assert_eq!(times.count(), 1_000_003);
    }
}
