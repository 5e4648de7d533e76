//! Sums of vectors: norm, scalar product, difference.

/// Euclidean norm, scaled so that tiny and huge units neither vanish nor overflow.
pub(crate) fn norm(v: &[f64]) -> f64 {
    let square = sum_of_squares(v, |x| x);
    if SAFE_SQUARES.contains(&square) {
        return square.sqrt();
    }
    // Too small or too large to square as they are.
    let scale = v.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    if scale == 0.0 || !scale.is_finite() {
        return scale;
    }
    scale * sum_of_squares(v, |x| x / scale).sqrt()
}

/// Sums of squares in which nothing that matters was lost below or above the range of a double.
pub(super) const SAFE_SQUARES: std::ops::Range<f64> = 1e-200..1e200;
/// Sums that run beside each other: always as many, so that the bits are always the same.
const SUMS: usize = 8;

#[inline]
fn sum_of_squares(v: &[f64], scaled: impl Fn(f64) -> f64) -> f64 {
    let mut sums = [0.0; SUMS];
    let (chunks, rest) = v.as_chunks::<SUMS>();
    for (sum, &x) in sums.iter_mut().zip(rest) {
        *sum = scaled(x) * scaled(x);
    }
    for chunk in chunks {
        for (sum, &x) in sums.iter_mut().zip(chunk) {
            *sum += scaled(x) * scaled(x);
        }
    }
    sums.iter().sum()
}

/// Largest absolute value.
pub(super) fn largest(v: &[f64]) -> f64 {
    v.iter().fold(0.0, |most: f64, x| most.max(x.abs()))
}

/// `aᵀ b`.
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// `a − b`.
pub(super) fn subtract(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

/// `x + scale · y` in the place of `x`.
pub(super) fn add_scaled(x: &mut [f64], scale: f64, y: &[f64]) {
    for (x, y) in x.iter_mut().zip(y) {
        *x += scale * y;
    }
}

/// Length of the longest of 3-vectors that stand one behind the other; of the unknown, where some
/// axes of a node are known, that of neighbours, which is of the same size.
pub(super) fn node_max(v: &[f64]) -> f64 {
    let length = |node: &[f64]| node.iter().map(|x| x * x).sum::<f64>();
    v.chunks(3).map(length).fold(0.0, f64::max).sqrt()
}
