//! Integrals over a tetrahedron of functions that are no polynomials: loads and errors.

use std::sync::LazyLock;

/// Barycentric coordinates of the points, and weights whose sum is 1; exact up to degree 7.
///
/// Source: five Gauss–Legendre points along each edge of a unit cube that is drawn together to a
/// tetrahedron, `L₁ = a, L₂ = (1 − a) b, L₃ = (1 − a)(1 − b) c`, with the volume `(1 − a)² (1 − b)`.
pub static POINTS: LazyLock<Vec<([f64; 4], f64)>> = LazyLock::new(|| {
    let line = gauss_legendre();
    let mut points = Vec::with_capacity(125);
    for (a, weight_a) in line {
        for (b, weight_b) in line {
            for (c, weight_c) in line {
                let l = [a, (1.0 - a) * b, (1.0 - a) * (1.0 - b) * c];
                let last = 1.0 - l[0] - l[1] - l[2];
                let volume = 6.0 * (1.0 - a).powi(2) * (1.0 - b);
                points.push(([l[0], l[1], l[2], last], weight_a * weight_b * weight_c * volume));
            }
        }
    }
    points
});

/// Points and weights of five-point Gauss–Legendre quadrature, moved to [0, 1].
fn gauss_legendre() -> [(f64, f64); 5] {
    let root = 2.0 * (10.0f64 / 7.0).sqrt();
    let (near, far) = ((5.0 - root).sqrt() / 3.0, (5.0 + root).sqrt() / 3.0);
    let part = 13.0 * 70f64.sqrt();
    let (at_near, at_far) = ((322.0 + part) / 900.0, (322.0 - part) / 900.0);
    [(-far, at_far), (-near, at_near), (0.0, 128.0 / 225.0), (near, at_near), (far, at_far)]
        .map(|(x, weight)| (0.5 * (1.0 + x), 0.5 * weight))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `∫ L₁ᵖ L₂ᵠ L₃ʳ L₄ˢ dV / V = 6 p! q! r! s! / (p + q + r + s + 3)!`.
    #[test]
    fn polynomials_of_degree_seven_are_exact() {
        let factorial = |n: i32| (1..=n).map(f64::from).product::<f64>();
        for powers in [[7, 0, 0, 0], [0, 0, 7, 0], [2, 1, 1, 3], [0, 3, 0, 4], [1, 2, 2, 2]] {
            let value =
                |l: &[f64; 4]| -> f64 { l.iter().zip(powers).map(|(l, p)| l.powi(p)).product() };
            let sum: f64 = POINTS.iter().map(|(l, weight)| weight * value(l)).sum();
            let exact = 6.0 * powers.iter().map(|&p| factorial(p)).product::<f64>() / factorial(10);
            assert!((sum - exact).abs() < 1e-13 * exact, "{powers:?}: {sum:e}, {exact:e}");
        }
    }
}
