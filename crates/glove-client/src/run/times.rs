//! Times of a run of any length in memory of a fixed size: how long most, and the longest, took.

use hdrhistogram::Histogram;

/// Times, of which quantiles are asked. A quantile is off by at most 0.1 %.
///
/// Units: ms; from 1 ns to 1 h, longer ones count as 1 h.
#[derive(Clone, Debug)]
pub struct Times(Histogram<u64>);

/// One hour, ns.
const LONGEST_NS: u64 = 3_600_000_000_000;
const NS_PER_MS: f64 = 1e6;

impl Default for Times {
    fn default() -> Self {
        let histogram = Histogram::new_with_bounds(1, LONGEST_NS, 3);
        Self(histogram.expect("the bounds are in order and the digits few"))
    }
}

impl Times {
    /// Counts a time.
    pub fn add(&mut self, ms: f64) {
        // A number that is none counts as the shortest.
        self.0.saturating_record((ms * NS_PER_MS) as u64);
    }

    /// How many there are.
    pub fn count(&self) -> u64 {
        self.0.len()
    }

    /// The time that a part `q` of them does not exceed, ms; `None` where there are none.
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
