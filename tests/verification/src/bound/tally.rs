//! Counts of proven bounds and true errors.

use std::collections::BTreeMap;

use softgrasp_core::solve::condensed::Delivery;

/// Error bound, or the reason why there is none.
pub(super) type Bound = Result<f64, &'static str>;

/// Counts over some grips.
#[derive(Clone, Debug, Default)]
pub(super) struct Tally {
    /// Ratios of bound to error: in double precision from residuals, after a second solve, and after a
    /// second solve in single precision.
    pub ratios: [Vec<f64>; 3],
    /// True errors in double precision, relative.
    pub errors: Vec<f64>,
    /// Error and bound of each grip whose bound was below the error.
    pub below: Vec<(f64, f64)>,
    /// Number of grips without a bound, by reason: before and after a second solve.
    pub none: [BTreeMap<&'static str, usize>; 2],
    /// Number of grips.
    pub grips: usize,
    /// Number of contact sets that do not hold the body or depend on each other.
    pub refused_sets: usize,
    /// Number of contact sets for which no exact answer could be found.
    pub sets_without_reference: usize,
}

/// Names of the three lists of ratios.
pub(super) const LISTS: [&str; 3] =
    ["double, residuals only", "double, refined", "single, refined"];

impl Tally {
    /// Counts one grip.
    pub fn add(&mut self, delivery: Delivery, error: f64, plain: Bound, refined: Bound) {
        self.grips += 1;
        if delivery == Delivery::Double {
            self.errors.push(error);
        }
        for (at, bound) in [plain, refined].into_iter().enumerate() {
            match bound {
                Err(why) => *self.none[at].entry(why).or_default() += 1,
                Ok(bound) if error > 0.0 && error <= bound => {
                    let list = match (delivery, at) {
                        (Delivery::Double, at) => Some(at),
                        (Delivery::Single, 1) => Some(2),
                        (Delivery::Single, _) => None,
                    };
                    if let Some(list) = list {
                        self.ratios[list].push(bound / error);
                    }
                }
                // An answer without error has no ratio; a NaN counts as below.
                Ok(bound) if error != 0.0 => self.below.push((error, bound)),
                Ok(_) => {}
            }
        }
    }

    /// Adds the counts of another tally.
    pub fn join(&mut self, other: &Self) {
        for (own, of_other) in self.ratios.iter_mut().zip(&other.ratios) {
            own.extend(of_other);
        }
        self.errors.extend(&other.errors);
        self.below.extend(&other.below);
        for (own, of_other) in self.none.iter_mut().zip(&other.none) {
            for (why, count) in of_other {
                *own.entry(why).or_default() += count;
            }
        }
        self.grips += other.grips;
        self.refused_sets += other.refused_sets;
        self.sets_without_reference += other.sets_without_reference;
    }
}

/// Quantile of some numbers; NaN if there are none.
pub(super) fn quantile(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let at = (share * sorted.len() as f64) as usize;
    sorted.get(at.min(sorted.len().saturating_sub(1))).copied().unwrap_or(f64::NAN)
}
