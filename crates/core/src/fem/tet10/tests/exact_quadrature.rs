//! Quadrature of high degree over a tetrahedron, to compare the four-point rule with, and for loads
//! and errors of tests.

use std::sync::LazyLock;

/// Points per axis.
const COUNT: usize = 6;

/// Barycentric coordinates and weights with sum 1; exact up to degree 9.
///
/// Source: Gauss–Legendre points in the unit cube, mapped by Duffy's transformation
/// `L₁ = a, L₂ = (1 − a) b, L₃ = (1 − a)(1 − b) c`, whose Jacobian is `(1 − a)² (1 − b)`.
pub(super) static POINTS: LazyLock<Vec<([f64; 4], f64)>> = LazyLock::new(|| {
    let line = gauss_legendre();
    let mut points = Vec::new();
    for (a, wa) in line {
        for (b, wb) in line {
            for (c, wc) in line {
                let l = [a, (1.0 - a) * b, (1.0 - a) * (1.0 - b) * c];
                let weight = 6.0 * wa * wb * wc * (1.0 - a).powi(2) * (1.0 - b);
                points.push(([l[0], l[1], l[2], 1.0 - l[0] - l[1] - l[2]], weight));
            }
        }
    }
    points
});

/// Points and weights on [0, 1]: roots of the Legendre polynomial by Newton's method.
fn gauss_legendre() -> [(f64, f64); COUNT] {
    std::array::from_fn(|i| {
        let n = COUNT as f64;
        let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..20 {
            let (mut before, mut value) = (1.0, x);
            for k in 2..=COUNT {
                let k = k as f64;
                (before, value) = (value, ((2.0 * k - 1.0) * x * value - (k - 1.0) * before) / k);
            }
            slope = n * (x * value - before) / (x * x - 1.0);
            x -= value / slope;
        }
        (0.5 * (1.0 + x), 1.0 / ((1.0 - x * x) * slope * slope))
    })
}

/// `∫ L₁ᵖ L₂ᵠ L₃ʳ L₄ˢ dV / V = 6 p! q! r! s! / (p + q + r + s + 3)!`.
#[test]
fn monomials_up_to_degree_nine_are_integrated_exactly() {
    let factorial = |n: i32| (1..=n).map(f64::from).product::<f64>();
    for p in 0..=9 {
        for q in 0..=9 - p {
            for r in 0..=9 - p - q {
                let s = 9 - p - q - r;
                let sum: f64 = POINTS
                    .iter()
                    .map(|(l, w)| w * l[0].powi(p) * l[1].powi(q) * l[2].powi(r) * l[3].powi(s))
                    .sum();
                let exact = 6.0 * [p, q, r, s].map(factorial).iter().product::<f64>();
                let exact = exact / factorial(12);
                assert!((sum - exact).abs() <= 1e-13 * exact, "degrees {p} {q} {r} {s}");
            }
        }
    }
}
