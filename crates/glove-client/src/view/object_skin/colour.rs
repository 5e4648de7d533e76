//! Arithmetic of colours: red, green, blue as sRGB, 0 to 1.

/// Part of the way from one colour to another.
pub(super) fn mix(from: [f64; 3], to: [f64; 3], share: f64) -> [f64; 3] {
    [0, 1, 2].map(|i| from[i] + (to[i] - from[i]) * share)
}

/// 0 below 0, 1 above 1, smooth between.
pub(super) fn smooth_step(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Four bytes of a colour with components 0 to 1.
pub(super) fn texel(colour: [f64; 3]) -> [u8; 4] {
    let byte = |c: f64| (c.clamp(0.0, 1.0) * 255.0).round() as u8;
    [byte(colour[0]), byte(colour[1]), byte(colour[2]), 255]
}
