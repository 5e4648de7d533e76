//! Force of the same press on an elastic half-space, in closed form.

/// Force that presses the mean of a half-space's surface down, the mean and the pressure both
/// weighted by `1 − (d/r)²` on a disc.
///
/// With `p̂(k) = ∫ p J₀(kd) d dd` the work of the pressure is `4π (1−ν²)/E ∫ p̂² dk`; here
/// `p̂ = 2 J₂(kr)/k²`, and `∫ J₂²(t) t⁻⁴ dt = 6 √π / (16 Γ(5/2)² Γ(9/2))` (Watson 13.41).
///
/// Units: m, Pa, N.
pub fn force(depth: f64, radius: f64, young: f64, poisson: f64) -> f64 {
    depth * young * radius / (COMPLIANCE * (1.0 - poisson * poisson))
}

/// `64/π` times the integral above: mean depth times `E r / ((1 − ν²) F)`.
const COMPLIANCE: f64 = 0.658_748_520_950_818_2;

#[cfg(test)]
mod tests {
    use super::*;

    /// The pressure of a disc on itself: rings of points, `u = (1 − ν²)/(πE) ∫ p/|x − y| dA`, the
    /// point's own cell left out and halved away by refining.
    #[test]
    fn closed_form_equals_the_sum_over_points_of_the_disc() {
        let mean = |n: i32| {
            let h = 1.0 / f64::from(n);
            let mut points = Vec::new();
            for i in -n..n {
                for j in -n..n {
                    let (x, y) = ((f64::from(i) + 0.5) * h, (f64::from(j) + 0.5) * h);
                    let p = 1.0 - x * x - y * y;
                    if p > 0.0 {
                        points.push((x, y, p * h * h));
                    }
                }
            }
            let force: f64 = points.iter().map(|p| p.2).sum();
            let mut sum = 0.0;
            for &(x, y, p) in &points {
                for &(other_x, other_y, q) in &points {
                    let distance = (x - other_x).hypot(y - other_y);
                    // Mean of 1/distance over a square cell from its middle: 4 ln(1 + √2) / h.
                    let inverse = match distance > 0.0 {
                        true => 1.0 / distance,
                        false => 4.0 * (1.0 + 2f64.sqrt()).ln() / h,
                    };
                    sum += p * q * inverse;
                }
            }
            sum / (std::f64::consts::PI * force * force)
        };
        // The error of the sum goes with the size of a cell: one step of extrapolation.
        let found = 2.0 * mean(40) - mean(20);
        assert!((found - COMPLIANCE).abs() < 1e-3 * COMPLIANCE, "{found}");
        assert!((force(1e-3, 0.01, 1e5, 0.3) - 1.668).abs() < 1e-3);
    }
}
