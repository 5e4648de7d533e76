//! Compares two answers, within the difference that printed digits allow.
//!
//! CalculiX prints seven digits, so a number that agrees is within half a unit of the seventh of
//! what is printed: at most 5e-7 of the number itself. Both programs also round within: a number
//! much smaller than the largest is a difference of large ones and has fewer correct digits. For
//! that, [`ROUNDING`] of the largest is allowed on top, a tenth of a unit of the largest number's
//! seventh digit at most.

use std::fmt;

use crate::ccx::{Printed, Results};
use crate::question::Question;
use crate::solved::Found;

/// Largest rounding of seven printed digits, relative to the number.
const HALF_DIGIT: f64 = 5e-7;
/// Rounding within the two programs, relative to the largest number.
const ROUNDING: f64 = 1e-8;

/// Comparison of numbers of one kind.
#[derive(Clone, Debug, Default)]
pub struct Comparison {
    /// Largest difference, relative to the largest number.
    pub difference_rel: f64,
    /// Largest part of a difference above half a unit of the last digit, relative to the largest number;
    /// zero if there is none.
    pub beyond_digits_rel: f64,
    /// Number of compared numbers.
    pub count: usize,
    /// Number of those that differ by more than half a unit of their last digit and rounding.
    pub outside: usize,
}

/// Displacements and forces of one question, or of several.
#[derive(Clone, Debug, Default)]
pub struct Agreement {
    pub displacement: Comparison,
    pub force: Comparison,
    pub questions: usize,
}

impl Comparison {
    pub fn of(pairs: &[(Printed, f64)]) -> Self {
        let largest = pairs.iter().map(|(p, _)| p.value.abs()).fold(0.0, f64::max);
        let off = |(printed, ours): &(Printed, f64)| (printed.value - ours).abs();
        let beyond = |p: &(Printed, f64)| (off(p) - p.0.half_unit).max(0.0);
        // A NaN is not within.
        let is_within = |p: &&(Printed, f64)| off(p) <= p.0.half_unit + ROUNDING * largest;
        Self {
            difference_rel: pairs.iter().map(off).fold(0.0, f64::max) / largest,
            beyond_digits_rel: pairs.iter().map(beyond).fold(0.0, f64::max) / largest,
            count: pairs.len(),
            outside: pairs.len() - pairs.iter().filter(is_within).count(),
        }
    }

    /// Whether the differences are small enough, relative to the largest number and for each number.
    pub fn holds(&self) -> bool {
        self.outside == 0 && self.difference_rel <= HALF_DIGIT + ROUNDING
    }

    fn add(&mut self, other: &Self) {
        self.difference_rel = self.difference_rel.max(other.difference_rel);
        self.beyond_digits_rel = self.beyond_digits_rel.max(other.beyond_digits_rel);
        self.count += other.count;
        self.outside += other.outside;
    }
}

impl Agreement {
    /// Compares every displacement of our answer, and the forces where both have them.
    pub fn of(printed: &Results, found: &Found, question: &Question) -> Self {
        let nodes = printed.displacement.iter().zip(&found.displacement);
        let displacement: Vec<(Printed, f64)> =
            nodes.flat_map(|(p, u)| p.iter().copied().zip(*u)).collect();
        assert!(!displacement.is_empty(), "{}: nothing to compare", question.name);
        let known = question.known.iter().map(|(dof, _)| *dof as usize);
        let at_known = known.map(|dof| printed.force[dof / 3][dof % 3]);
        let force: Vec<(Printed, f64)> = at_known.zip(found.reaction.iter().copied()).collect();
        assert!(force.is_empty() || force.len() == question.known.len());
        let force = if force.is_empty() { Comparison::default() } else { Comparison::of(&force) };
        Self { displacement: Comparison::of(&displacement), force, questions: 1 }
    }

    /// Whether all comparisons hold.
    pub fn holds(&self) -> bool {
        self.displacement.holds() && self.force.holds()
    }

    /// Adds the numbers of another question.
    pub fn add(&mut self, other: &Self) {
        self.displacement.add(&other.displacement);
        self.force.add(&other.force);
        self.questions += other.questions;
    }
}

impl fmt::Display for Agreement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let of = |c: &Comparison| {
            format!(
                "differ by {:.2e} of the largest, {:.2e} beyond printed digits, {} of {} too far",
                c.difference_rel, c.beyond_digits_rel, c.outside, c.count
            )
        };
        write!(f, "displacements {}; forces {}", of(&self.displacement), of(&self.force))
    }
}

#[test]
fn a_difference_in_the_last_digit_is_outside() {
    let printed = Printed { value: 1.234567, half_unit: 5e-7 };
    let small = Printed { value: 1.234567e-3, half_unit: 5e-10 };
    let of = |a: f64, b: f64| Comparison::of(&[(printed, a), (small, b)]);
    assert!(of(1.2345674, 1.2345674e-3).holds());
    assert!(!of(1.2345676, 1.234567e-3).holds());
    // Small numbers count by their own digits too, within rounding relative to the largest.
    assert!(of(1.234567, 1.234575e-3).holds());
    assert!(!of(1.234567, 1.234590e-3).holds());
    assert!(!of(f64::NAN, 1.234567e-3).holds());
}
