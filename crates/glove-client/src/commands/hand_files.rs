//! Reads and writes the files of a hand's configuration and calibration.

use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use anyhow::Context;
use softgrasp_hand::hand_setup::HandConfiguration;

use crate::object::file_writing::write_file;

/// Reads a configuration, and its calibration if it names one.
///
/// # Errors
/// Sentence with the path.
pub(super) fn read_configuration(path: &Path) -> anyhow::Result<HandConfiguration> {
    let mut configuration = HandConfiguration::read(&read_text(path)?)
        .with_context(|| format!("cannot use {}", path.display()))?;
    if let Some(file) = &configuration.calibration_file {
        let beside = path.with_file_name("").join(file);
        let text = read_text(&beside)?;
        configuration
            .take_calibration(&text)
            .with_context(|| format!("cannot use {}", beside.display()))?;
    }
    Ok(configuration)
}

/// Writes a configuration.
///
/// # Errors
/// Path and error of the operating system.
pub(super) fn write_configuration(
    path: &Path,
    configuration: &HandConfiguration,
) -> anyhow::Result<()> {
    Ok(write_file(path, configuration.to_text().as_bytes())?)
}

/// Reads a text file.
///
/// # Errors
/// Path and reason: an error of the operating system, or bytes that are no text.
pub(super) fn read_text(path: &Path) -> anyhow::Result<String> {
    std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))
}

/// Path of a file as its configuration names it: without the folder, if both are in the same one.
pub(super) fn relative_to(configuration: &Path, file: &Path) -> PathBuf {
    let folder = configuration.parent().unwrap_or(Path::new(""));
    match file.strip_prefix(folder) {
        Ok(inside) => inside.to_owned(),
        // Where it starts anew it must not depend on the folder the program runs in.
        Err(_) => std::path::absolute(file).unwrap_or_else(|_| file.to_owned()),
    }
}

/// Today's date by the system's clock, as year-month-day in universal time.
pub(super) fn today() -> String {
    let seconds = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs());
    date_of_day(seconds / 86_400)
}

/// Date of a day, counted from 1970-01-01.
fn date_of_day(days: u64) -> String {
    let is_leap = |year: u64| {
        year.is_multiple_of(4) && (!year.is_multiple_of(100) || year.is_multiple_of(400))
    };
    // Whole cycles of 400 years have the same days; the rest is counted out.
    let (mut year, mut left) = (1970 + days / 146_097 * 400, days % 146_097);
    loop {
        let length = if is_leap(year) { 366 } else { 365 };
        if left < length {
            break;
        }
        left -= length;
        year += 1;
    }
    let february = if is_leap(year) { 29 } else { 28 };
    let months = [31, february, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31];
    let mut month = 1;
    for length in months {
        if left < length {
            break;
        }
        left -= length;
        month += 1;
    }
    format!("{year:04}-{month:02}-{:02}", left + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn days_become_dates() {
        for (days, date) in [
            (0, "1970-01-01"),
            (58, "1970-02-28"),
            (59, "1970-03-01"),
            (11_016, "2000-02-29"),
            (11_322, "2000-12-31"),
            (20_779, "2026-11-22"),
            (47_541, "2100-03-01"),
        ] {
            assert_eq!(date_of_day(days), date, "day {days}");
        }
    }

    #[test]
    fn files_in_the_same_folder_are_named_without_it() {
        let named = |a: &str, b: &str| relative_to(Path::new(a), Path::new(b));
        assert_eq!(named("hand.toml", "me.cal"), Path::new("me.cal"));
        assert_eq!(named("a/hand.toml", "a/me.cal"), Path::new("me.cal"));
        assert!(named("a/hand.toml", "b/me.cal").is_absolute());
    }
}
