//! Axes of a figure: linear or logarithmic, with round numbers at the lines.

use std::ops::Range;

use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};

/// Scale of an axis: linear or logarithmic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Equal distances are equal differences.
    Linear,
    /// Equal distances are equal factors; values that are not positive are left out.
    Log,
}

/// A range of values on a scale, and the labelled ones among them.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Axis {
    scale: Scale,
    low: f64,
    high: f64,
    ticks: Vec<f64>,
}

impl Axis {
    /// Axis around some values, with room at both ends; `None` if there are none.
    pub fn around(scale: Scale, values: impl Iterator<Item = f64>) -> Option<Self> {
        let (low, high) = values
            .map(|v| scale.place(v))
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
        let room = if high > low { 0.06 * (high - low) } else { 0.5 };
        (low <= high).then(|| Self::new(scale, low - room, high + room))
    }

    /// Axis between two positions.
    fn new(scale: Scale, low: f64, high: f64) -> Self {
        Self { scale, low, high, ticks: scale.ticks((low, high)) }
    }
}

impl Ranged for Axis {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        let share = (self.scale.place(*value) - self.low) / (self.high - self.low);
        limit.0 + (share * f64::from(limit.1 - limit.0)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, _: Hint) -> Vec<f64> {
        self.ticks.iter().map(|&t| self.scale.value(t)).collect()
    }

    fn range(&self) -> Range<f64> {
        self.scale.value(self.low)..self.scale.value(self.high)
    }
}

impl ValueFormatter<f64> for Axis {
    fn format_ext(&self, value: &f64) -> String {
        label(*value)
    }
}

impl Scale {
    /// Whether a value has a position on the scale.
    pub fn holds(self, value: f64) -> bool {
        value.is_finite() && (self == Self::Linear || value > 0.0)
    }

    /// Position along the axis: equal distances are equal differences of positions.
    fn place(self, value: f64) -> f64 {
        match self {
            Self::Linear => value,
            Self::Log => value.log10(),
        }
    }

    /// Value at a position.
    fn value(self, place: f64) -> f64 {
        match self {
            Self::Linear => place,
            Self::Log => 10f64.powf(place),
        }
    }

    /// Positions of the labelled lines: 1, 2, 5 times a power of ten.
    fn ticks(self, (low, high): (f64, f64)) -> Vec<f64> {
        match self {
            Self::Log => {
                // Over many decades the powers of ten suffice.
                let steps: &[f64] = if high - low > 4.0 { &[1.0] } else { &[1.0, 2.0, 5.0] };
                let decades = low.floor() as i32..=high.ceil() as i32;
                let all = decades.flat_map(|d| steps.iter().map(move |s| f64::from(d) + s.log10()));
                all.filter(|t| (low..=high).contains(t)).collect()
            }
            Self::Linear => {
                let rough = (high - low) / 6.0;
                let power = 10f64.powf(rough.log10().floor());
                let step = [1.0, 2.0, 5.0, 10.0].map(|s| s * power);
                let step = step.into_iter().find(|s| *s >= rough).unwrap_or(rough);
                let (first, last) = ((low / step).ceil() as i64, (high / step).floor() as i64);
                (first..=last).map(|i| i as f64 * step).collect()
            }
        }
    }
}

/// A labelled value: ticks have one digit that counts, five decimals show it and hide rounding.
fn label(value: f64) -> String {
    let size = value.abs();
    if size != 0.0 && !(1e-4..1e6).contains(&size) {
        return format!("{value:.0e}");
    }
    let text = format!("{value:.5}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_numbers_inside_the_range() {
        let labels = |scale: Scale, (low, high)| -> Vec<String> {
            let axis = Axis::new(scale, low, high);
            axis.key_points(10).iter().map(|v| axis.format_ext(v)).collect()
        };
        assert_eq!(labels(Scale::Log, (-0.1, 1.1)), ["1", "2", "5", "10"]);
        assert_eq!(labels(Scale::Log, (-3.2, 2.0)), ["0.001", "0.01", "0.1", "1", "10", "100"]);
        assert_eq!(labels(Scale::Linear, (-1.1, 0.2)), ["-1", "-0.5", "0"]);
    }

    #[test]
    fn equal_factors_are_equally_far_apart_on_a_logarithmic_axis() {
        let axis = Axis::around(Scale::Log, [1.0, 10_000.0].into_iter()).unwrap();
        let at = [1.0, 10.0, 100.0, 1000.0].map(|v| axis.map(&v, (0, 112_000)));
        assert_eq!(at, [6000, 31_000, 56_000, 81_000]);
        assert!(Axis::around(Scale::Log, std::iter::empty()).is_none());
    }
}
