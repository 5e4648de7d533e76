//! Numbers that are read easily: 1, 2, 5 times a power of ten.

/// The least of 1, 2, 5 times a power of ten that is not below a value above 0.
pub fn nice_above(value: f64) -> f64 {
    let power = value.log10().floor() as i32;
    // A negative power of ten is not exact, and its inverse is.
    let times = |mantissa: f64| match power < 0 {
        true => mantissa / 10f64.powi(-power),
        false => mantissa * 10f64.powi(power),
    };
    NICE.into_iter().map(times).find(|nice| *nice >= value * (1.0 - 1e-12)).unwrap_or(value)
}

/// Steps of the mantissa.
const NICE: [f64; 4] = [1.0, 2.0, 5.0, 10.0];
