//! Laws T = k Nᵐ (6.1) fitted to measured times, with their uncertainty.

use crate::report::ReportError;

/// A straight line through logarithms, `ln T = ln k + m ln N`, by least squares.
///
/// Units: those of the times.
///
/// Source: thesis (6.1), Appendix B.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PowerLaw {
    /// Factor k: the time at N = 1.
    pub k: f64,
    /// Exponent m.
    pub m: f64,
    /// Standard error of the exponent.
    pub m_error: f64,
    /// Standard deviation of ln T about the line: 0.1 is about 10 % of T.
    pub residual: f64,
    /// Number of measurements.
    pub count: usize,
    log_k: f64,
    mean_x: f64,
    sum_squares_x: f64,
}

/// A predicted time with the range in which 95 % of further measurements fall if the law holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prediction {
    /// Most likely value of the time.
    pub value: f64,
    /// Lower end of the range.
    pub low: f64,
    /// Upper end of the range.
    pub high: f64,
}

impl PowerLaw {
    /// Fits the law to measurements (N, T); pairs that are not positive are left out.
    ///
    /// # Errors
    /// [`ReportError::TooFew`] below three measurements or with one N only.
    pub fn fit(what: &str, measured: &[(f64, f64)]) -> Result<Self, ReportError> {
        let logs: Vec<(f64, f64)> = measured
            .iter()
            .filter(|(n, t)| *n > 0.0 && *t > 0.0)
            .map(|(n, t)| (n.ln(), t.ln()))
            .collect();
        let count = logs.len();
        let mean_x = logs.iter().map(|p| p.0).sum::<f64>() / count as f64;
        let mean_y = logs.iter().map(|p| p.1).sum::<f64>() / count as f64;
        let sum_squares_x: f64 = logs.iter().map(|p| (p.0 - mean_x).powi(2)).sum();
        if count < 3 || sum_squares_x < 1e-12 {
            return Err(ReportError::TooFew { what: what.to_owned(), count });
        }
        let m = logs.iter().map(|p| (p.0 - mean_x) * (p.1 - mean_y)).sum::<f64>() / sum_squares_x;
        let log_k = mean_y - m * mean_x;
        let squares: f64 = logs.iter().map(|p| (p.1 - log_k - m * p.0).powi(2)).sum();
        let residual = (squares / (count - 2) as f64).sqrt();
        let m_error = residual / sum_squares_x.sqrt();
        Ok(Self { k: log_k.exp(), m, m_error, residual, count, log_k, mean_x, sum_squares_x })
    }

    /// Time that the law predicts, and the range of a further measurement.
    pub fn predict(&self, n: f64) -> Prediction {
        let x = n.ln();
        let centre = self.log_k + self.m * x;
        let spread = 1.0 + 1.0 / self.count as f64 + (x - self.mean_x).powi(2) / self.sum_squares_x;
        let reach = t_quantile_95(self.count - 2) * self.residual * spread.sqrt();
        Prediction {
            value: centre.exp(),
            low: (centre - reach).exp(),
            high: (centre + reach).exp(),
        }
    }
}

/// Value that a t-distributed number exceeds in magnitude 5 times of a hundred.
///
/// Source: printed tables below eleven degrees of freedom, then the expansion of Cornish and Fisher
/// (error below 3e-3).
fn t_quantile_95(freedom: usize) -> f64 {
    const FEW: [f64; 10] = [12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228];
    match freedom.checked_sub(1) {
        None => f64::INFINITY,
        Some(index) => FEW.get(index).copied().unwrap_or_else(|| {
            let (z, nu) = (1.959_964f64, freedom as f64);
            let first = (z.powi(3) + z) / 4.0;
            let second = (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / 96.0;
            z + first / nu + second / (nu * nu)
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn exact_law_is_found_exactly(k in 1e-3..1e3f64, m in -2.0..3.0f64) {
            let measured: Vec<_> =
                [1.0, 2.0, 3.0, 8.0].map(|n: f64| (n, k * n.powf(m))).to_vec();
            let law = PowerLaw::fit("", &measured).unwrap();
            prop_assert!((law.m - m).abs() < 1e-10 && (law.k / k - 1.0).abs() < 1e-10);
            prop_assert!(law.m_error < 1e-10);
            prop_assert!((law.predict(27.0).value / (k * 27f64.powf(m)) - 1.0).abs() < 1e-9);
        }
    }

    /// Worked by hand: ln N = 0, 0, ln 2, ln 2 and ln T = 0.1, -0.1, 0.1 - ln 2, -0.1 - ln 2.
    #[test]
    fn scatter_gives_the_textbook_uncertainty() {
        let times = [(1.0, 0.1f64), (1.0, -0.1), (2.0, 0.1 - 2f64.ln()), (2.0, -0.1 - 2f64.ln())];
        let law = PowerLaw::fit("", &times.map(|(n, t)| (n, t.exp()))).unwrap();
        let residual = (4.0 * 0.01f64 / 2.0).sqrt();
        assert!((law.m + 1.0).abs() < 1e-12);
        assert!((law.residual - residual).abs() < 1e-12);
        assert!((law.m_error - residual / 2f64.ln()).abs() < 1e-12);
        // Far outside, the slope's error rules.
        let far = law.predict(27.0);
        let x = 27f64.ln() - 0.5 * 2f64.ln();
        let reach = 4.303 * residual * (1.25 + (x / 2f64.ln()).powi(2)).sqrt();
        assert!((far.high.ln() - far.value.ln() - reach).abs() < 1e-9);
    }

    #[test]
    fn few_measurements_or_one_size_are_refused() {
        for measured in [vec![(1.0, 2.0), (2.0, 1.0)], vec![(2.0, 1.0); 9], vec![(0.0, 1.0); 4]] {
            let error = PowerLaw::fit("x", &measured).unwrap_err();
            assert!(matches!(error, ReportError::TooFew { .. }), "{error}");
        }
    }

    #[test]
    fn expansion_joins_the_table() {
        for (freedom, printed) in [(11, 2.201), (20, 2.086), (60, 2.000), (1000, 1.962)] {
            assert!((t_quantile_95(freedom) - printed).abs() < 3e-3, "{freedom}");
        }
    }
}
