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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn range_ends_at_the_next_nice_number() {
        for (value, nice) in [
            (1.0, 1.0),
            (1.01, 2.0),
            (2.0, 2.0),
            (3.0, 5.0),
            (5.1, 10.0),
            (0.0002, 0.0002),
            (0.00021, 0.0005),
            (0.3, 0.5),
            (7.0e5, 1.0e6),
        ] {
            assert_eq!(nice_above(value), nice, "for {value}");
        }
    }

    proptest! {
        #[test]
        fn nice_numbers_hold_the_value_and_are_at_most_two_and_a_half_times_it(e in -8.0..12.0f64) {
            let value = 10f64.powf(e);
            let nice = nice_above(value);
            prop_assert!(nice >= value * (1.0 - 1e-9) && nice <= 2.5 * value * (1.0 + 1e-9));
        }
    }
}
