//! Numbers as mesh files write them, from bytes, without allocation.

/// Decimal integer with an optional sign; `None` if it is anything else or does not fit.
pub(super) fn parse_integer(token: &[u8]) -> Option<i64> {
    let (negative, digits) = match token {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] => (false, rest),
        _ => (false, token),
    };
    if digits.is_empty() {
        return None;
    }
    let mut value = 0_i64;
    for &byte in digits {
        let digit = byte.wrapping_sub(b'0');
        if digit > 9 {
            return None;
        }
        // Counting downwards would be needed for i64::MIN only; no file means that number.
        value = value.checked_mul(10)?.checked_add(i64::from(digit))?;
    }
    Some(if negative { -value } else { value })
}

/// Finite decimal number; Fortran's `1.0D+02` and `1.0-101` are understood too.
pub(super) fn parse_real(token: &[u8]) -> Option<f64> {
    let text = std::str::from_utf8(token).ok()?;
    let value = text.parse().ok().or_else(|| parse_fortran_real(token))?;
    f64::is_finite(value).then_some(value)
}

/// Exponent letter `D`, or no exponent letter before the sign of the exponent.
fn parse_fortran_real(token: &[u8]) -> Option<f64> {
    let mut text = [0_u8; 64];
    let mut length = 0;
    let has_letter = token.iter().any(|b| matches!(b, b'd' | b'D' | b'e' | b'E'));
    for (i, &byte) in token.iter().enumerate() {
        let needs_letter = i > 0 && !has_letter && matches!(byte, b'+' | b'-');
        if needs_letter {
            *text.get_mut(length)? = b'e';
            length += 1;
        }
        *text.get_mut(length)? = if matches!(byte, b'd' | b'D') { b'e' } else { byte };
        length += 1;
    }
    std::str::from_utf8(text.get(..length)?).ok()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn fortran_exponents_are_understood() {
        assert_eq!(parse_real(b"1.0D+02"), Some(100.0));
        assert_eq!(parse_real(b"-3.535534d-001"), Some(-0.353_553_4));
        assert_eq!(parse_real(b"2.5-101"), Some(2.5e-101));
        assert_eq!(parse_real(b"-2.5+3"), Some(-2500.0));
    }

    #[test]
    fn other_words_are_not_numbers() {
        for word in ["", "-", "+", "e", "D", "nan", "inf", "1.0.0", "0x10", "1e999", "1-", "--1"] {
            assert_eq!(parse_real(word.as_bytes()), None, "{word}");
        }
        for word in ["", "-", "1.0", "1e3", "9223372036854775808", "4294967296x"] {
            assert_eq!(parse_integer(word.as_bytes()), None, "{word}");
        }
    }

    proptest! {
        #[test]
        fn integers_agree_with_the_standard_library(text in "[+-]?[0-9]{0,20}") {
            let known = text.parse::<i64>().ok().filter(|&value| value != i64::MIN);
            prop_assert_eq!(parse_integer(text.as_bytes()), known);
        }

        #[test]
        fn printed_reals_come_back_unchanged(value in proptest::num::f64::NORMAL) {
            prop_assert_eq!(parse_real(format!("{value:?}").as_bytes()), Some(value));
            let fortran = format!("{value:e}").replace('e', "D");
            prop_assert_eq!(parse_real(fortran.as_bytes()), Some(value));
        }
    }
}
