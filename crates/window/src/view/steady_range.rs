//! A range that does not flicker from tick to tick: it grows at once and falls late.

use super::nice_number::nice_above;

/// A range that falls is held for so long, s.
const HOLD_S: f64 = 2.0;
/// Values below this part of the range let it fall.
const LOW_PART: f64 = 1.0 / 3.0;

/// A range from zero to a nice number above all values.
///
/// It grows with the tick that needs it and falls only when all values stayed below a third of it for two
/// seconds: what is looked at keeps its colour and its length.
#[derive(Clone, Debug, PartialEq)]
pub struct SteadyRange {
    least: f64,
    most: f64,
    low: Option<Low>,
}

/// Since when all values have been low, and the largest of them.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Low {
    since_s: f64,
    largest: f64,
}

impl SteadyRange {
    /// A range that never ends below `least`, which is above 0, and ends there at first.
    pub fn new(least: f64) -> Self {
        Self { least, most: least, low: None }
    }

    /// End of the range; above 0.
    pub fn most(&self) -> f64 {
        self.most
    }

    /// Takes the largest value of a tick into account; a value that is not a number changes nothing.
    ///
    /// Units: `now_s` s on a clock that may be set back.
    pub fn follow(&mut self, largest: f64, now_s: f64) {
        if !largest.is_finite() {
            return;
        }
        if largest >= LOW_PART * self.most {
            self.low = None;
            if largest > self.most {
                self.most = self.range_for(largest);
            }
            return;
        }
        let low = match self.low {
            Some(low) if low.since_s <= now_s => low,
            _ => Low { since_s: now_s, largest: 0.0 },
        };
        let low = Low { largest: low.largest.max(largest), ..low };
        self.low = Some(low);
        if now_s - low.since_s >= HOLD_S {
            self.most = self.range_for(low.largest);
            self.low = None;
        }
    }

    fn range_for(&self, largest: f64) -> f64 {
        nice_above(largest.max(self.least))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn range_grows_at_once_and_falls_after_two_low_seconds() {
        let mut range = SteadyRange::new(1e-4);
        range.follow(0.009, 0.0);
        assert_eq!(range.most(), 0.01);
        // Half is not low.
        range.follow(0.005, 10.0);
        range.follow(0.005, 20.0);
        assert_eq!(range.most(), 0.01);
        range.follow(0.001, 20.5);
        range.follow(0.0015, 22.0);
        assert_eq!(range.most(), 0.01, "low for a second and a half");
        range.follow(0.001, 22.5);
        assert_eq!(range.most(), 0.002, "the largest of the low ones still fits");
        range.follow(0.003, 22.6);
        assert_eq!(range.most(), 0.005);
        range.follow(0.0, 22.7);
        range.follow(0.0, 30.0);
        assert_eq!(range.most(), 1e-4, "never below the least range");
    }

    #[test]
    fn one_high_frame_or_a_clock_set_back_begins_the_wait_anew() {
        let mut range = SteadyRange::new(1e-3);
        range.follow(0.1, 0.0);
        for (largest, now_s) in [(0.0, 1.0), (0.05, 2.5), (0.0, 2.6), (0.0, 4.5)] {
            range.follow(largest, now_s);
            assert_eq!(range.most(), 0.1);
        }
        range.follow(0.0, 1.0);
        range.follow(0.0, 2.9);
        assert_eq!(range.most(), 0.1);
        range.follow(0.0, 3.0);
        assert_eq!(range.most(), 1e-3);
    }

    #[test]
    fn what_is_no_number_changes_nothing() {
        let mut range = SteadyRange::new(1e-3);
        range.follow(0.07, 0.0);
        let before = range.clone();
        range.follow(f64::NAN, 1.0);
        range.follow(f64::INFINITY, 2.0);
        assert_eq!(range, before);
    }
}
