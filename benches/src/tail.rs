//! Slowest answers: high quantiles, and the share that is slower than a given time.

use crate::plot::PlotPoint;
use crate::sample::quantile;

/// Quantiles of a list of times; `None` for those that the list is too short to show.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tail {
    /// Time that half of them do not exceed.
    pub p50: Option<f64>,
    /// Time that 99 of 100 do not exceed.
    pub p99: Option<f64>,
    /// Time that 999 of 1000 do not exceed.
    pub p999: Option<f64>,
    /// Time that 9999 of 10 000 do not exceed.
    pub p9999: Option<f64>,
    /// Largest time.
    pub max: Option<f64>,
}

impl Tail {
    /// Quantiles of times in any order.
    pub fn of(times: impl IntoIterator<Item = f64>) -> Self {
        let sorted = ascending(times);
        Self {
            p50: quantile(&sorted, 0.5),
            p99: quantile(&sorted, 0.99),
            p999: quantile(&sorted, 0.999),
            p9999: quantile(&sorted, 0.9999),
            max: sorted.last().copied(),
        }
    }
}

/// Largest number of points of the curve.
const POINTS: usize = 200;

/// Share of times that are longer, against the time: the steeper, the more even.
///
/// Shapes: at most 200 points, evenly spread over the logarithm of the share. Units: those of the
/// times; share 0 … 1.
pub fn longer_than(times: impl IntoIterator<Item = f64>) -> Vec<PlotPoint> {
    let sorted = ascending(times);
    let count = sorted.len();
    let mut points: Vec<PlotPoint> = Vec::new();
    for step in 0..POINTS {
        // From all of them to the slowest one.
        let share = (count as f64).powf(-(step as f64) / (POINTS - 1) as f64);
        let slower = (share * count as f64).round().max(1.0) as usize;
        let Some(&x) = count.checked_sub(slower).and_then(|at| sorted.get(at)) else { continue };
        let point = PlotPoint { x, y: slower as f64 / count as f64, spread: None };
        if points.last() != Some(&point) {
            points.push(point);
        }
    }
    points
}

fn ascending(times: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let mut sorted: Vec<f64> = times.into_iter().collect();
    sorted.sort_by(f64::total_cmp);
    sorted
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_come_as_far_out_as_the_count_allows() {
        let tail = Tail::of((1..=1000).rev().map(f64::from));
        assert_eq!((tail.p50, tail.p99, tail.p999), (Some(500.0), Some(990.0), Some(999.0)));
        assert_eq!((tail.p9999, tail.max), (None, Some(1000.0)));
        assert_eq!(Tail::of([]), Tail::default());
    }

    #[test]
    fn curve_falls_from_all_to_the_slowest() {
        let points = longer_than((1..=5000).map(f64::from));
        assert!(points.len() > 100 && points.len() <= POINTS);
        assert!(points.windows(2).all(|w| w[0].x < w[1].x && w[0].y > w[1].y));
        let (first, last) = (points[0], points[points.len() - 1]);
        assert_eq!((first.x, first.y, last.x, last.y), (1.0, 1.0, 5000.0, 1.0 / 5000.0));
        assert!(longer_than([]).is_empty());
    }
}
