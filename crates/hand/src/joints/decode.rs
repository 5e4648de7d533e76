//! One line of JSON to a record of joints, checked.

use std::fmt;

use nalgebra::{Matrix3, Point3, Quaternion, Rotation3, UnitQuaternion};
use serde::Deserialize;
use serde::de::value::MapAccessDeserializer;
use serde::de::{IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde_json::error::Category;
use softgrasp_grasp::hand::Handedness;

use super::fault::{JointsFaultKind, RANGE_M};
use super::record::{JOINT_COUNT, JointSample, JointsRecord, WEBXR_JOINT_COUNT};

/// A joint's radius is at most this, m.
const RADIUS_MAX_M: f64 = 1.0;
/// A quaternion's length, or that of a matrix's column, may be off by this share.
const LENGTH_TOLERANCE: f64 = 0.1;
/// Characters of a reason that are kept.
const REASON_MAX: usize = 120;

/// The fields of a line; unknown ones are passed over.
#[derive(Deserialize)]
struct RawLine {
    #[serde(default)]
    hand: Option<String>,
    #[serde(default)]
    time: Option<f64>,
    #[serde(default)]
    frame: Option<u64>,
    joints: RawJoints,
}

/// The list of joints: as many as can be used, and how many there were.
struct RawJoints {
    entries: Vec<RawEntry>,
    count: usize,
}

/// One entry of the list.
enum RawEntry {
    NotTracked,
    /// Numbers in their order, the first `count` of them; `count` may be larger than the array.
    Numbers {
        values: [f64; 16],
        count: usize,
    },
    Object(RawObject),
}

#[derive(Deserialize)]
struct RawObject {
    #[serde(default)]
    position: Option<[f64; 3]>,
    #[serde(default)]
    orientation: Option<[f64; 4]>,
    #[serde(default)]
    radius: Option<f64>,
}

/// The record on one line.
///
/// # Errors
/// Why the line is not a record.
pub(super) fn decode_line(line: &[u8]) -> Result<JointsRecord, JointsFaultKind> {
    let raw: RawLine = serde_json::from_slice(line).map_err(|error| kind_of(&error, line))?;
    // Without a palm the list begins with joint 1.
    let first = match raw.joints.count {
        JOINT_COUNT => 0,
        WEBXR_JOINT_COUNT => 1,
        got => return Err(JointsFaultKind::JointCount { got }),
    };
    let hand = match raw.hand.as_deref() {
        Some("left") => Handedness::Left,
        Some("right") | None => Handedness::Right,
        Some(_) => {
            let reason = "hand is neither left nor right".to_owned();
            return Err(JointsFaultKind::NotARecord { reason });
        }
    };
    let mut record =
        JointsRecord { time_s: raw.time, frame: raw.frame, ..JointsRecord::empty(hand) };
    for (entry, raw) in raw.joints.entries.iter().enumerate() {
        if let Some(place) = record.joints.get_mut(first + entry) {
            *place = sample(entry, raw)?;
        }
    }
    Ok(record)
}

fn kind_of(error: &serde_json::Error, line: &[u8]) -> JointsFaultKind {
    match error.classify() {
        Category::Data => {
            let text = error.to_string();
            let plain = text.chars().filter(|c| c.is_ascii_graphic() || *c == ' ');
            JointsFaultKind::NotARecord { reason: plain.take(REASON_MAX).collect() }
        }
        Category::Io | Category::Syntax | Category::Eof => {
            let column = error.column();
            JointsFaultKind::NotJson { column, has_no_number: names_no_number(line, column) }
        }
    }
}

/// Whether a number that is none stands where a line stops being JSON.
fn names_no_number(line: &[u8], column: usize) -> bool {
    let around = column.saturating_sub(4)..line.len().min(column.saturating_add(4));
    let around = line.get(around).unwrap_or_default().to_ascii_lowercase();
    around.windows(3).any(|three| three == b"nan" || three == b"inf")
}

fn sample(entry: usize, raw: &RawEntry) -> Result<Option<JointSample>, JointsFaultKind> {
    match raw {
        RawEntry::NotTracked => Ok(None),
        RawEntry::Numbers { values, count: 3 } => {
            let [x, y, z, ..] = *values;
            Ok(Some(JointSample::at(place(entry, [x, y, z])?)))
        }
        RawEntry::Numbers { values, count: 7 } => {
            let [x, y, z, qx, qy, qz, qw, ..] = *values;
            let position = place(entry, [x, y, z])?;
            let orientation = Some(turn(entry, [qx, qy, qz, qw])?);
            Ok(Some(JointSample { orientation, ..JointSample::at(position) }))
        }
        RawEntry::Numbers { values, count: 16 } => matrix_sample(entry, values).map(Some),
        RawEntry::Numbers { count, .. } => Err(JointsFaultKind::EntryLength { entry, got: *count }),
        RawEntry::Object(object) => object_sample(entry, object),
    }
}

fn object_sample(entry: usize, object: &RawObject) -> Result<Option<JointSample>, JointsFaultKind> {
    let Some(position) = object.position else { return Ok(None) };
    let position = place(entry, position)?;
    let orientation = object.orientation.map(|q| turn(entry, q)).transpose()?;
    let radius_m = match object.radius {
        Some(radius) if !(0.0..=RADIUS_MAX_M).contains(&radius) => {
            return Err(JointsFaultKind::Radius { entry });
        }
        radius => radius,
    };
    Ok(Some(JointSample { position, orientation, radius_m }))
}

fn place(entry: usize, coordinates: [f64; 3]) -> Result<Point3<f64>, JointsFaultKind> {
    // Also false for what is not a number.
    let is_near = coordinates.iter().all(|c| c.abs() <= RANGE_M);
    if is_near { Ok(coordinates.into()) } else { Err(JointsFaultKind::Range { entry }) }
}

fn is_near_one(length: f64) -> bool {
    (length - 1.0).abs() <= LENGTH_TOLERANCE
}

fn turn(entry: usize, [x, y, z, w]: [f64; 4]) -> Result<UnitQuaternion<f64>, JointsFaultKind> {
    let quaternion = Quaternion::new(w, x, y, z);
    if is_near_one(quaternion.norm()) {
        Ok(UnitQuaternion::from_quaternion(quaternion))
    } else {
        Err(JointsFaultKind::Orientation { entry })
    }
}

/// A joint from a 4 × 4 matrix, column after column.
fn matrix_sample(entry: usize, m: &[f64; 16]) -> Result<JointSample, JointsFaultKind> {
    let bad = JointsFaultKind::Matrix { entry };
    let last_row = [m[3], m[7], m[11], m[15] - 1.0];
    let axes = Matrix3::new(m[0], m[4], m[8], m[1], m[5], m[9], m[2], m[6], m[10]);
    let is_rigid = last_row.iter().all(|v| v.abs() <= 1e-3)
        && axes.column_iter().all(|axis| is_near_one(axis.norm()))
        && is_near_one(axes.determinant());
    if !is_rigid {
        return Err(bad);
    }
    let position = place(entry, [m[12], m[13], m[14]])?;
    let rotation = Rotation3::from_matrix_unchecked(axes);
    let orientation = UnitQuaternion::from_rotation_matrix(&rotation);
    let orientation = Some(UnitQuaternion::new_normalize(orientation.into_inner()));
    Ok(JointSample { orientation, ..JointSample::at(position) })
}

impl<'de> Deserialize<'de> for RawJoints {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_seq(JointsVisitor)
    }
}

struct JointsVisitor;

impl<'de> Visitor<'de> for JointsVisitor {
    type Value = RawJoints;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a list of joints")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<RawJoints, A::Error> {
        let mut joints = RawJoints { entries: Vec::with_capacity(JOINT_COUNT), count: 0 };
        while joints.count < JOINT_COUNT {
            let Some(entry) = list.next_element()? else { return Ok(joints) };
            joints.entries.push(entry);
            joints.count += 1;
        }
        while list.next_element::<IgnoredAny>()?.is_some() {
            joints.count += 1;
        }
        Ok(joints)
    }
}

impl<'de> Deserialize<'de> for RawEntry {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(EntryVisitor)
    }
}

struct EntryVisitor;

impl<'de> Visitor<'de> for EntryVisitor {
    type Value = RawEntry;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a joint: null, a list of 3, 7 or 16 numbers, or an object")
    }

    fn visit_unit<E: serde::de::Error>(self) -> Result<RawEntry, E> {
        Ok(RawEntry::NotTracked)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<RawEntry, A::Error> {
        let (mut values, mut count, mut is_tracked) = ([0.0; 16], 0, true);
        // A browser fills the matrix of a joint that it lost with NaN, which JSON writes as null.
        while let Some(number) = list.next_element::<Option<f64>>()? {
            is_tracked &= number.is_some();
            if let Some(value) = values.get_mut(count) {
                *value = number.unwrap_or(0.0);
            }
            count += 1;
        }
        let has_form = matches!(count, 3 | 7 | 16);
        Ok(match is_tracked || !has_form {
            true => RawEntry::Numbers { values, count },
            false => RawEntry::NotTracked,
        })
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<RawEntry, A::Error> {
        RawObject::deserialize(MapAccessDeserializer::new(map)).map(RawEntry::Object)
    }
}

#[cfg(test)]
#[path = "decode_tests.rs"]
mod tests;
