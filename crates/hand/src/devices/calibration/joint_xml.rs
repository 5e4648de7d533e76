//! Reads calibrations as XML: per joint a few pairs of relative reading and angle in degrees.

use super::checks::{CalibrationError, check, check_sensor};
use super::linear::Calibration;
use super::straight_line::{Point, line_through};
use crate::devices::cyberglove::Sensor;

/// The joints' names in such files (Shadow's driver), in the order of [`Sensor::ALL`].
const JOINT_NAMES: [&str; 22] = [
    "G_ThumbRotate",
    "G_ThumbMPJ",
    "G_ThumbIJ",
    "G_ThumbAb",
    "G_IndexMPJ",
    "G_IndexPIJ",
    "G_IndexDIJ",
    "G_MiddleMPJ",
    "G_MiddlePIJ",
    "G_MiddleDIJ",
    "G_MiddleIndexAb",
    "G_RingMPJ",
    "G_RingPIJ",
    "G_RingDIJ",
    "G_RingMiddleAb",
    "G_PinkieMPJ",
    "G_PinkiePIJ",
    "G_PinkieDIJ",
    "G_PinkieRingAb",
    "G_PalmArch",
    "G_WristPitch",
    "G_WristYaw",
];

/// The points of one joint are taken together; more than these no file has.
const MAX_POINTS: usize = 1000;

/// One XML tag of the text.
struct Tag<'a> {
    line: usize,
    name: &'a str,
    attributes: &'a str,
}

/// Reads `<Joint name="…"><calib raw_value="0…1" calibrated_value="deg"/>…</Joint>`.
///
/// Angles are this program's: flexion and spread positive. Joints that are not listed keep their
/// default line; a relative reading r is 1 + 254 r counts.
pub(super) fn read_joint_xml(text: &str) -> Result<Calibration, CalibrationError> {
    let mut calibration = Calibration::default();
    let mut open: Option<(usize, Sensor, Vec<Point>)> = None;
    let mut seen = [false; 22];
    for tag in tags(text) {
        let tag = tag?;
        match tag.name {
            "Joint" => {
                close(&mut calibration, open.take())?;
                let sensor = joint_of(&tag)?;
                if std::mem::replace(&mut seen[sensor.index()], true) {
                    return Err(CalibrationError::Twice(sensor).at(tag.line));
                }
                open = Some((tag.line, sensor, Vec::new()));
            }
            "/Joint" => close(&mut calibration, open.take())?,
            "calib" => {
                let expected = "points inside `<Joint>`";
                let wrong = || CalibrationError::line(tag.line, expected, tag.attributes);
                let (_, _, points) = open.as_mut().ok_or_else(wrong)?;
                if points.len() >= MAX_POINTS {
                    return Err(CalibrationError::line(tag.line, "fewer points", tag.attributes));
                }
                points.push(point_of(&tag)?);
            }
            _ => {}
        }
    }
    close(&mut calibration, open)?;
    if !seen.contains(&true) {
        return Err(CalibrationError::Ends { expected: "`<Joint name=\"…\">`" });
    }
    check(&calibration)?;
    Ok(calibration)
}

fn joint_of(tag: &Tag<'_>) -> Result<Sensor, CalibrationError> {
    let name = attribute(tag.attributes, "name");
    let sensor = Sensor::ALL.into_iter().find(|s| name == Some(JOINT_NAMES[s.index()]));
    let expected = "`name=\"G_…\"` of one of the 22 joints";
    sensor.ok_or_else(|| CalibrationError::line(tag.line, expected, tag.attributes))
}

fn point_of(tag: &Tag<'_>) -> Result<Point, CalibrationError> {
    let number = |name: &str, most: f64, expected| {
        let value =
            attribute(tag.attributes, name).and_then(|text| text.trim().parse::<f64>().ok());
        value
            .filter(|value| value.abs() <= most)
            .ok_or_else(|| CalibrationError::line(tag.line, expected, tag.attributes))
    };
    let relative = number("raw_value", 2.0, "`raw_value=\"0.0\"` to 1")?;
    let degrees = number("calibrated_value", 720.0, "`calibrated_value=\"…\"` in degrees")?;
    Ok(Point { counts: 1.0 + 254.0 * relative, angle_rad: degrees.to_radians() })
}

/// Fits the line of a joint whose points are complete.
fn close(
    calibration: &mut Calibration,
    joint: Option<(usize, Sensor, Vec<Point>)>,
) -> Result<(), CalibrationError> {
    let Some((line, sensor, points)) = joint else { return Ok(()) };
    if points.len() < 2 {
        let found = JOINT_NAMES[sensor.index()];
        return Err(CalibrationError::line(line, "two points or more for the joint", found));
    }
    let fitted = line_through(calibration.sensor(sensor), &points);
    check_sensor(&fitted).map_err(|error| error.at(line))?;
    calibration.sensors[sensor.index()] = fitted;
    Ok(())
}

/// The tags of a text in order; comments and text between tags are skipped.
fn tags(text: &str) -> impl Iterator<Item = Result<Tag<'_>, CalibrationError>> {
    let mut rest = text;
    let mut line = 1;
    std::iter::from_fn(move || {
        loop {
            let start = rest.find('<')?;
            line += newlines(&rest[..start]);
            let (is_comment, close) = match rest[start..].starts_with("<!--") {
                true => (true, "-->"),
                false => (false, ">"),
            };
            let Some(length) = rest[start..].find(close) else {
                let error = CalibrationError::line(line, "a closing `>`", &rest[start..]);
                rest = "";
                return Some(Err(error));
            };
            let inner = &rest[start + 1..start + length];
            let at = line;
            line += newlines(inner);
            rest = &rest[start + length + close.len()..];
            if is_comment {
                continue;
            }
            let inner = inner.trim_end_matches('/').trim();
            let (name, attributes) = inner.split_once(char::is_whitespace).unwrap_or((inner, ""));
            return Some(Ok(Tag { line: at, name, attributes }));
        }
    })
}

fn newlines(text: &str) -> usize {
    text.bytes().filter(|&byte| byte == b'\n').count()
}

/// Value of an attribute `name="value"` or `name='value'`.
fn attribute<'a>(attributes: &'a str, name: &str) -> Option<&'a str> {
    let mut rest = attributes;
    loop {
        let (key, after) = rest.split_once('=')?;
        let after = after.trim_start();
        let quote = after.chars().next().filter(|c| matches!(c, '"' | '\''))?;
        let (value, tail) = after[1..].split_once(quote)?;
        if key.trim() == name {
            return Some(value);
        }
        rest = tail;
    }
}
