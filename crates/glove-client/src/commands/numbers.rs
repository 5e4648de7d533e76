//! Numbers on the command line: a value that can never work is refused with the option's name.

use nalgebra::{Point3, Vector3};
use softgrasp_core::fem::Material;

/// Parses a finite number above 0.
pub fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number > 0.0 && number.is_finite() => Ok(number),
        _ => Err("it must be a finite number above 0".to_owned()),
    }
}

/// Parses a Poisson's ratio of an elastic material.
pub fn poisson(text: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().map_err(|_| "it must be a number".to_owned())?;
    Material::try_new(1.0, number).map_err(|error| error.to_string())?;
    Ok(number)
}

/// Parses a whole number, 1 or above.
pub fn count(text: &str) -> Result<usize, String> {
    match text.parse::<usize>() {
        Ok(number) if number > 0 => Ok(number),
        _ => Err("it must be a whole number, 1 or above".to_owned()),
    }
}

/// Parses a speed: 0 or above.
pub fn speed(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number >= 0.0 && number.is_finite() => Ok(number),
        _ => Err("it must be a finite number, 0 or above".to_owned()),
    }
}

/// Parses a position: three finite numbers with commas, m.
pub fn place(text: &str) -> Result<Point3<f64>, String> {
    let numbers: Vec<f64> = text.split(',').map_while(|n| n.trim().parse().ok()).collect();
    match numbers[..] {
        [x, y, z] if text.split(',').count() == 3 && [x, y, z].iter().all(|n| n.abs() <= 10.0) => {
            Ok(Point3::new(x, y, z))
        }
        _ => Err("it must be three numbers with commas, at most 10 m each".to_owned()),
    }
}

/// Parses a vector: three finite numbers with commas.
pub fn vector(text: &str) -> Result<Vector3<f64>, String> {
    let numbers: Vec<f64> = text.split(',').map_while(|n| n.trim().parse().ok()).collect();
    match numbers[..] {
        [x, y, z]
            if text.split(',').count() == 3 && numbers.iter().all(|n: &f64| n.is_finite()) =>
        {
            Ok(Vector3::new(x, y, z))
        }
        _ => Err("it must be three numbers with commas".to_owned()),
    }
}

/// Parses a number of ticks.
pub fn ticks(text: &str) -> Result<u64, String> {
    text.parse().map_err(|_| "it must be a whole number, 0 or above".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_can_never_work_are_refused() {
        for text in ["0", "-1", "nan", "inf", "", "stiff"] {
            assert!(positive(text).is_err(), "{text}");
        }
        for text in ["0.5", "-1", "nan", "2", "soft"] {
            assert!(poisson(text).is_err(), "{text}");
        }
        for text in ["0", "-1", "1.5", "99999999999999999999999"] {
            assert!(count(text).is_err(), "{text}");
        }
        assert_eq!((positive("2e4"), poisson("-0.3"), count("7")), (Ok(2e4), Ok(-0.3), Ok(7)));
    }
}
