//! The range of the colours and its labels: nice numbers that do not flicker from tick to tick.

use super::shading::{DisplayUnit, Shading};
use super::steady_range::SteadyRange;

/// The range of one shading, from zero to a nice number.
#[derive(Clone, Debug, PartialEq)]
pub struct Legend {
    shading: Shading,
    range: SteadyRange,
}

/// A mark of the legend.
#[derive(Clone, Debug, PartialEq)]
pub struct Tick {
    /// Place of the mark, from 0 to 1; also the place of its colour.
    pub fraction: f64,
    /// Value at the mark, with its unit.
    pub text: String,
}

impl Legend {
    /// A legend with the smallest range of a shading.
    pub fn new(shading: Shading) -> Self {
        Self { shading, range: SteadyRange::new(shading.least_range()) }
    }

    /// Shading that the legend explains.
    pub fn shading(&self) -> Shading {
        self.shading
    }

    /// End of the range, in SI units; above 0.
    pub fn most(&self) -> f64 {
        self.range.most()
    }

    /// The unit of the labels.
    pub fn unit(&self) -> DisplayUnit {
        self.shading.unit(self.most())
    }

    /// Takes the largest value of a tick into account; a value that is not a number changes nothing.
    ///
    /// Units: `largest` SI, `now_s` s on a clock that may be set back.
    pub fn follow(&mut self, largest: f64, now_s: f64) {
        self.range.follow(largest, now_s);
    }

    /// Place of a value in the range; above 1 beyond its end.
    ///
    /// Units: `value` SI.
    pub fn fraction(&self, value: f64) -> f64 {
        value / self.most()
    }

    /// Five marks from zero to the end of the range.
    pub fn ticks(&self) -> [Tick; 5] {
        std::array::from_fn(|quarter| {
            let fraction = quarter as f64 / 4.0;
            Tick { fraction, text: self.unit().text(fraction * self.most()) }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(legend: &Legend) -> [String; 5] {
        legend.ticks().map(|tick| tick.text)
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
}
