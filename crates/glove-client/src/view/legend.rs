//! The range of the colours and its labels: nice numbers that do not flicker from frame to frame.

use super::nice_number::nice_above;
use super::shading::{DisplayUnit, Shading};

/// A range that falls is held for so long, s.
const HOLD_S: f64 = 2.0;
/// Values below this part of the range let it fall.
const LOW_PART: f64 = 1.0 / 3.0;

/// The range of one shading, from zero to a nice number.
///
/// It grows with the frame that needs it and falls only when all values stayed below a third of it
/// for two seconds: what is looked at keeps its colour.
#[derive(Clone, Debug, PartialEq)]
pub struct Legend {
    shading: Shading,
    most: f64,
    low: Option<Low>,
}

/// Since when all values have been low, and the largest of them.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Low {
    since_s: f64,
    largest: f64,
}

/// A mark of the legend.
#[derive(Clone, Debug, PartialEq)]
pub struct Tick {
    /// Where it is, from 0 to 1; also the place of its colour.
    pub fraction: f64,
    /// Its value with its unit.
    pub text: String,
}

impl Legend {
    /// A legend with the smallest range of a shading.
    pub fn new(shading: Shading) -> Self {
        Self { shading, most: shading.least_range(), low: None }
    }

    /// What it is the legend of.
    pub fn shading(&self) -> Shading {
        self.shading
    }

    /// End of the range, in SI units; above 0.
    pub fn most(&self) -> f64 {
        self.most
    }

    /// The unit of the labels.
    pub fn unit(&self) -> DisplayUnit {
        self.shading.unit(self.most)
    }

    /// Takes the largest value of a frame into account; what is no number changes nothing.
    ///
    /// Units: `largest` SI, `now_s` s on a clock that may be set back.
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
        nice_above(largest.max(self.shading.least_range()))
    }

    /// Where a value lies in the range; above 1 beyond its end.
    ///
    /// Units: `value` SI.
    pub fn fraction(&self, value: f64) -> f64 {
        value / self.most
    }

    /// Five marks from zero to the end.
    pub fn ticks(&self) -> [Tick; 5] {
        std::array::from_fn(|quarter| {
            let fraction = quarter as f64 / 4.0;
            Tick { fraction, text: self.unit().text(fraction * self.most) }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn texts(legend: &Legend) -> [String; 5] {
        legend.ticks().map(|tick| tick.text)
    }

    #[test]
    fn range_ends_at_the_next_nice_number() {
        for (value, nice) in [
            (1.0, 1.0),
            (1.01, 2.0),
            (2.0, 2.0),
            (3.0, 5.0),
            (5.1, 10.0),
            (0.0002, 0.0002),
            (0.00021, 0.0005),
            (0.3, 0.5),
            (7.0e5, 1.0e6),
        ] {
            assert_eq!(nice_above(value), nice, "for {value}");
        }
    }

    proptest! {
        #[test]
        fn nice_numbers_hold_the_value_and_are_at_most_two_and_a_half_times_it(e in -8.0..12.0f64) {
            let value = 10f64.powf(e);
            let nice = nice_above(value);
            prop_assert!(nice >= value * (1.0 - 1e-9) && nice <= 2.5 * value * (1.0 + 1e-9));
        }
    }

    #[test]
    fn labels_are_round_numbers_with_their_unit() {
        let mut legend = Legend::new(Shading::Displacement);
        assert_eq!(texts(&legend)[4], "0.1 mm");
        legend.follow(0.0017, 0.0);
        assert_eq!(texts(&legend), ["0 mm", "0.5 mm", "1 mm", "1.5 mm", "2 mm"]);
        let mut legend = Legend::new(Shading::VonMises);
        legend.follow(800.0, 0.0);
        assert_eq!(texts(&legend), ["0 kPa", "0.25 kPa", "0.5 kPa", "0.75 kPa", "1 kPa"]);
        legend.follow(450.0, 0.0);
        assert_eq!(texts(&legend)[1], "0.25 kPa");
        legend.follow(43_000.0, 0.1);
        assert_eq!(texts(&legend), ["0 kPa", "12.5 kPa", "25 kPa", "37.5 kPa", "50 kPa"]);
        let mut legend = Legend::new(Shading::Strain);
        legend.follow(0.041, 0.0);
        assert_eq!(texts(&legend), ["0 %", "1.25 %", "2.5 %", "3.75 %", "5 %"]);
        assert_eq!(legend.fraction(0.025), 0.5);
    }

    #[test]
    fn range_grows_at_once_and_falls_after_two_low_seconds() {
        let mut legend = Legend::new(Shading::Displacement);
        legend.follow(0.009, 0.0);
        assert_eq!(legend.most(), 0.01);
        // Half is not low.
        legend.follow(0.005, 10.0);
        legend.follow(0.005, 20.0);
        assert_eq!(legend.most(), 0.01);
        legend.follow(0.001, 20.5);
        legend.follow(0.0015, 22.0);
        assert_eq!(legend.most(), 0.01, "low for a second and a half");
        legend.follow(0.001, 22.5);
        assert_eq!(legend.most(), 0.002, "the largest of the low ones still fits");
        legend.follow(0.003, 22.6);
        assert_eq!(legend.most(), 0.005);
        legend.follow(0.0, 22.7);
        legend.follow(0.0, 30.0);
        assert_eq!(legend.most(), 1e-4, "never below the least range");
    }

    #[test]
    fn one_high_frame_or_a_clock_set_back_begins_the_wait_anew() {
        let mut legend = Legend::new(Shading::Strain);
        legend.follow(0.1, 0.0);
        for (largest, now_s) in [(0.0, 1.0), (0.05, 2.5), (0.0, 2.6), (0.0, 4.5)] {
            legend.follow(largest, now_s);
            assert_eq!(legend.most(), 0.1);
        }
        legend.follow(0.0, 1.0);
        legend.follow(0.0, 2.9);
        assert_eq!(legend.most(), 0.1);
        legend.follow(0.0, 3.0);
        assert_eq!(legend.most(), 1e-3);
    }

    #[test]
    fn what_is_no_number_changes_nothing() {
        let mut legend = Legend::new(Shading::Error);
        legend.follow(0.07, 0.0);
        let before = legend.clone();
        legend.follow(f64::NAN, 1.0);
        legend.follow(f64::INFINITY, 2.0);
        assert_eq!(legend, before);
    }
}
