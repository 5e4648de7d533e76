//! Measures times in turns and takes medians, because other work disturbs a machine.

use std::time::{Duration, Instant};

/// Number of rounds, and time for them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// Number of first rounds that do not count (caches, page faults, clock rates).
    pub warm_up_rounds: usize,
    /// Least number of rounds.
    pub rounds_min: usize,
    /// Largest number of rounds.
    pub rounds_max: usize,
    /// Time after which no round begins, once `rounds_min` have been run.
    pub budget: Duration,
}

/// One of several pieces of work that are compared; each call does it once.
pub type Competitor<'a, T, E> = Box<dyn FnMut() -> Result<T, E> + 'a>;

/// Runs competitors in turn; the results by competitor and round.
///
/// Each round runs every competitor once and begins with another one, so that disturbances of the machine
/// affect all of them alike and ratios hold.
///
/// # Errors
/// First error of a competitor.
pub fn take_turns<T, E>(
    effort: &Effort,
    competitors: &mut [Competitor<'_, T, E>],
) -> Result<Vec<Vec<T>>, E> {
    for _ in 0..effort.warm_up_rounds {
        for run in &mut *competitors {
            run()?;
        }
    }
    let count = competitors.len();
    let mut results: Vec<Vec<T>> = competitors.iter().map(|_| Vec::new()).collect();
    let start = Instant::now();
    for round in 0..effort.rounds_max {
        if round >= effort.rounds_min && start.elapsed() > effort.budget {
            break;
        }
        for turn in 0..count {
            let who = (round + turn) % count;
            results[who].push(competitors[who]()?);
        }
    }
    Ok(results)
}

/// Result of one call, and its time, ms.
pub fn timed_ms<T>(work: impl FnOnce() -> T) -> (f64, T) {
    let start = Instant::now();
    let result = work();
    (start.elapsed().as_secs_f64() * 1e3, result)
}

/// Median and extremes of a list of numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spread {
    /// Middle value, or the mean of the two middle ones.
    pub median: f64,
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
    /// Value that about a tenth is below.
    pub p10: f64,
    /// Value that about a tenth is above.
    pub p90: f64,
    /// Number of values.
    pub count: usize,
}

impl Spread {
    /// Spread of some values; all zero for none.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Self {
        let mut sorted: Vec<f64> = values.into_iter().collect();
        sorted.sort_by(f64::total_cmp);
        let count = sorted.len();
        let (Some(&min), Some(&max)) = (sorted.first(), sorted.last()) else {
            return Self::default();
        };
        let median = 0.5 * (sorted[(count - 1) / 2] + sorted[count / 2]);
        let (p10, p90) = (sorted[(count - 1) / 10], sorted[count - 1 - (count - 1) / 10]);
        Self { median, min, max, p10, p90, count }
    }

    /// Spread of the quotients of two competitors, round by round.
    pub fn of_ratio(dividend: &[f64], divisor: &[f64]) -> Self {
        Self::of(dividend.iter().zip(divisor).map(|(a, b)| a / b))
    }
}

/// Smallest value that a share of all does not exceed; `None` if the list is too short (fewer than one
/// value is expected above it).
///
/// Shapes: `sorted` ascending; `share` in 0..1.
pub fn quantile(sorted: &[f64], share: f64) -> Option<f64> {
    if (sorted.len() as f64) * (1.0 - share) < 1.0 - 1e-9 {
        return None;
    }
    let rank = (share * sorted.len() as f64).ceil() as usize;
    sorted.get(rank.saturating_sub(1)).copied()
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;

    use super::*;
    use proptest::prelude::*;

    const THREE_ROUNDS: Effort =
        Effort { warm_up_rounds: 1, rounds_min: 3, rounds_max: 9, budget: Duration::ZERO };

    #[test]
    fn competitors_take_turns_and_each_begins_once() {
        let order = RefCell::new(String::new());
        let runner = |name: char| -> Competitor<'_, char, ()> {
            let order = &order;
            Box::new(move || {
                order.borrow_mut().push(name);
                Ok(name)
            })
        };
        let mut all = [runner('a'), runner('b'), runner('c')];
        let results = take_turns(&THREE_ROUNDS, &mut all).unwrap();
        drop(all);
        assert_eq!(order.into_inner(), "abc abc bca cab".replace(' ', ""));
        assert_eq!(results, [['a'; 3], ['b'; 3], ['c'; 3]]);
    }

    #[test]
    fn error_of_one_competitor_ends_all() {
        let mut all: [Competitor<'_, (), &str>; 2] =
            [Box::new(|| Ok(())), Box::new(|| Err("wrong"))];
        assert_eq!(take_turns(&THREE_ROUNDS, &mut all), Err("wrong"));
    }

    #[test]
    fn rare_events_are_not_guessed_from_few_values() {
        let values: Vec<f64> = (1..=1000).map(f64::from).collect();
        assert_eq!(quantile(&values, 0.5), Some(500.0));
        assert_eq!(quantile(&values, 0.99), Some(990.0));
        assert_eq!(quantile(&values, 0.999), Some(999.0));
        assert_eq!(quantile(&values[..999], 0.999), None);
        assert_eq!(quantile(&[], 0.5), None);
    }

    proptest! {
        #[test]
        fn half_the_values_lie_on_each_side_of_the_median(
            values in prop::collection::vec(-1e3..1e3f64, 1..60),
        ) {
            let spread = Spread::of(values.iter().copied());
            let below = values.iter().filter(|&&v| v < spread.median).count();
            let above = values.iter().filter(|&&v| v > spread.median).count();
            prop_assert!(2 * below <= values.len() && 2 * above <= values.len());
            prop_assert!(values.iter().all(|v| (spread.min..=spread.max).contains(v)));
            prop_assert!(spread.p10 <= spread.median && spread.median <= spread.p90);
            let outside = values.iter().filter(|&&v| v < spread.p10 || v > spread.p90).count();
            prop_assert!(outside <= 2 * (values.len() / 10));
        }
    }
}
