//! What the colour of the object shows, with the units it is read in.

use std::fmt;
use std::str::FromStr;

/// Quantity that the colour of the object shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Shading {
    /// No quantity: the object has its own look.
    #[default]
    Plain,
    /// Distance of each node from its place at rest.
    Displacement,
    /// Largest absolute principal strain.
    Strain,
    /// Von Mises stress.
    VonMises,
    /// Estimated error that the mesh brings into the stress, relative to the largest stress.
    Error,
}

/// A unit that values are shown in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DisplayUnit {
    /// Symbol of the unit, as written behind a number.
    pub symbol: &'static str,
    /// Size of the unit in SI units.
    pub in_si: f64,
}

/// The text is not the name of a shading.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no shading is called '{0}'; there are plain, displacement, strain, von-mises and error")]
pub struct UnknownShading(String);

const NONE: DisplayUnit = DisplayUnit { symbol: "", in_si: 1.0 };
const MILLIMETRE: DisplayUnit = DisplayUnit { symbol: "mm", in_si: 1e-3 };
const PERCENT: DisplayUnit = DisplayUnit { symbol: "%", in_si: 1e-2 };
/// Units of stress, the largest first.
const OF_STRESS: [DisplayUnit; 3] = [
    DisplayUnit { symbol: "MPa", in_si: 1e6 },
    DisplayUnit { symbol: "kPa", in_si: 1e3 },
    DisplayUnit { symbol: "Pa", in_si: 1.0 },
];

impl Shading {
    /// All shadings, in the order of a menu.
    pub const ALL: [Self; 5] =
        [Self::Plain, Self::Displacement, Self::Strain, Self::VonMises, Self::Error];

    /// Name of the shading on the command line.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Plain => "plain",
            Self::Displacement => "displacement",
            Self::Strain => "strain",
            Self::VonMises => "von-mises",
            Self::Error => "error",
        }
    }

    /// Title of the legend, and name in a menu.
    pub const fn title(self) -> &'static str {
        match self {
            Self::Plain => "Plain",
            Self::Displacement => "Displacement",
            Self::Strain => "Largest principal strain",
            Self::VonMises => "Von Mises stress",
            Self::Error => "Estimated stress error",
        }
    }

    /// Whether the displacements of the nodes inside are needed too, or those of the surface do.
    pub const fn needs_inside(self) -> bool {
        matches!(self, Self::Strain | Self::VonMises | Self::Error)
    }

    /// Smallest range of the legend, in SI units: smaller values are not worth a colour.
    pub const fn least_range(self) -> f64 {
        match self {
            Self::Plain => 1.0,
            Self::Displacement => 1e-4,
            Self::Strain => 1e-3,
            Self::VonMises => 1.0,
            Self::Error => 1e-2,
        }
    }

    /// The unit in which values up to `most` are shown.
    ///
    /// Units: `most` SI (m, 1, Pa, 1).
    pub fn unit(self, most: f64) -> DisplayUnit {
        match self {
            Self::Plain => NONE,
            Self::Displacement => MILLIMETRE,
            Self::Strain | Self::Error => PERCENT,
            Self::VonMises => {
                let [.., pascal] = OF_STRESS;
                OF_STRESS.into_iter().find(|unit| most >= unit.in_si).unwrap_or(pascal)
            }
        }
    }

    /// A value with its unit, by at most three digits: `0.5 mm`, `12 kPa`, `3 %`.
    ///
    /// Units: `value` SI.
    pub fn text(self, value: f64) -> String {
        self.unit(value).text(value)
    }
}

impl DisplayUnit {
    /// A value in this unit, by three digits without zeros at the end; whole numbers in full.
    ///
    /// Units: `value` SI.
    pub fn text(self, value: f64) -> String {
        let number = value / self.in_si;
        // 0.0005 has its first digit in the fourth place: three digits end in the sixth.
        let first_place = match number == 0.0 || !number.is_finite() {
            true => 0,
            false => number.abs().log10().floor() as i32,
        };
        let places = (2 - first_place).clamp(0, PLACES_MAX) as usize;
        let mut digits = format!("{number:.places$}");
        if digits.contains('.') {
            digits.truncate(digits.trim_end_matches('0').trim_end_matches('.').len());
        }
        match self.symbol {
            "" => digits,
            symbol => format!("{digits} {symbol}"),
        }
    }
}

/// Decimal places of the smallest number that is not written as 0.
const PLACES_MAX: i32 = 6;

impl FromStr for Shading {
    type Err = UnknownShading;

    fn from_str(name: &str) -> Result<Self, UnknownShading> {
        let found = Self::ALL.into_iter().find(|shading| shading.as_str() == name);
        found.ok_or_else(|| UnknownShading(name.to_owned()))
    }
}

impl fmt::Display for Shading {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_as_they_are_written() {
        for shading in Shading::ALL {
            assert_eq!(shading.to_string().parse(), Ok(shading));
        }
        let text = "mises".parse::<Shading>().unwrap_err().to_string();
        for shading in Shading::ALL {
            assert!(text.contains(shading.as_str()), "{text}");
        }
    }

    #[test]
    fn values_are_read_in_units_of_a_hand() {
        for (shading, value, text) in [
            (Shading::Displacement, 0.0005, "0.5 mm"),
            (Shading::Displacement, 0.012_34, "12.3 mm"),
            (Shading::Displacement, 0.0, "0 mm"),
            (Shading::Strain, 0.03, "3 %"),
            (Shading::Error, 0.0725, "7.25 %"),
            (Shading::VonMises, 12_000.0, "12 kPa"),
            (Shading::VonMises, 999.0, "999 Pa"),
            (Shading::VonMises, 1000.0, "1 kPa"),
            (Shading::VonMises, 2.5e6, "2.5 MPa"),
            (Shading::VonMises, 0.001_25, "0.00125 Pa"),
            (Shading::Displacement, 1.25, "1250 mm"),
            (Shading::Plain, 2.0, "2"),
        ] {
            assert_eq!(shading.text(value), text);
        }
    }

    #[test]
    fn what_is_no_number_is_written_as_that() {
        assert_eq!(Shading::Strain.text(f64::NAN), "NaN %");
        assert_eq!(Shading::Strain.text(f64::INFINITY), "inf %");
    }
}
