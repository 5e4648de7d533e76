//! What a page sends: bytes of a stranger, which are checked before anything is done with them.

use nalgebra::{Point3, Quaternion, UnitQuaternion};
use serde::Deserialize;
use softgrasp_grasp::hand::Handedness;
use softgrasp_hand::joints::{JointSample, JointsRecord, RANGE_M, WEBXR_JOINT_COUNT, WRIST};

/// Longest message, bytes.
pub const MESSAGE_MAX: usize = 2048;
/// Bytes of an acknowledgement.
pub const ACK_BYTES: usize = 24;
/// Bytes of a hand.
pub const JOINTS_BYTES: usize = 16 + 28 * WEBXR_JOINT_COUNT;
/// First byte of an acknowledgement.
pub const ACK: u8 = 0x81;
/// First byte of a hand.
pub const JOINTS: u8 = 0x82;

/// A binary message.
#[derive(Clone, Debug, PartialEq)]
pub enum FromPage {
    /// A picture has been drawn.
    Ack(Ack),
    /// A tracked hand.
    Joints(Box<JointsRecord>),
}

/// A picture has been drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ack {
    /// Number of the picture.
    pub number: u32,
    /// When, by the page's clock, ms; it is echoed with the next picture.
    pub stamp_ms: f64,
    /// From the tracked hand to the picture that shows it, ms, where that was the first to do so.
    pub hand_to_picture_ms: Option<f32>,
}

/// What a page asks of the run: its menu.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(tag = "ask", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Ask {
    /// Make the deformed shape the shape at rest.
    KeepShape,
    /// Go back to the shape at rest before.
    UndoKeepShape,
    /// Let the object go where it is.
    Detach,
    /// Put the object back where it began.
    ReturnHome,
    /// Take another object: a built-in one, or a file of the run's folder.
    Read {
        /// Its name.
        name: String,
    },
    /// Write the object into the run's folder.
    Save {
        /// A name without a folder, whose end is the format.
        name: String,
    },
    /// Show a quantity in colours.
    Shade {
        /// As on the command line.
        what: String,
    },
    /// Play a script from its beginning.
    Restart,
    /// Stand still, or go on.
    Pause {
        /// Which.
        stands: bool,
    },
    /// End the run.
    Exit,
}

/// Why bytes are no message.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FromPageError {
    /// No such message.
    #[error("no message begins with {0}")]
    Kind(u8),
    /// Too short or too long.
    #[error("a message of this kind has {expected} bytes, not {got}")]
    Length {
        /// What it would have.
        expected: usize,
        /// What came.
        got: usize,
    },
    /// Not a hand.
    #[error("a hand is 0 (left) or 1 (right) with 25 joints, not {0} with {1}")]
    Hand(u8, u16),
    /// A number that cannot be.
    #[error("joint {joint}: {what}")]
    Joint {
        /// Which.
        joint: usize,
        /// What is wrong.
        what: &'static str,
    },
    /// Not one of the things that can be asked for.
    #[error("nothing that can be asked for: {0}")]
    Ask(String),
}

impl FromPage {
    /// Reads a binary message.
    ///
    /// # Errors
    /// [`FromPageError`]; nothing of the message counts then.
    pub fn read(bytes: &[u8]) -> Result<Self, FromPageError> {
        match bytes.first().copied().unwrap_or(0) {
            ACK => Ok(Self::Ack(read_ack(of_length(bytes, ACK_BYTES)?))),
            JOINTS => read_joints(of_length(bytes, JOINTS_BYTES)?).map(Box::new).map(Self::Joints),
            kind => Err(FromPageError::Kind(kind)),
        }
    }
}

impl Ask {
    /// Reads a text message.
    ///
    /// # Errors
    /// [`FromPageError::Ask`] with what is wrong.
    pub fn read(text: &str) -> Result<Self, FromPageError> {
        serde_json::from_str(text).map_err(|error| FromPageError::Ask(error.to_string()))
    }
}

fn of_length(bytes: &[u8], expected: usize) -> Result<&[u8], FromPageError> {
    let got = bytes.len();
    (got == expected).then_some(bytes).ok_or(FromPageError::Length { expected, got })
}

/// Bytes at a place; zeros beyond the end, which no message of the right length has.
fn array<const N: usize>(bytes: &[u8], at: usize) -> [u8; N] {
    let piece = bytes.get(at..at + N).and_then(|piece| piece.try_into().ok());
    piece.unwrap_or([0; N])
}

fn float(bytes: &[u8], at: usize) -> f64 {
    f64::from(f32::from_le_bytes(array(bytes, at)))
}

fn read_ack(bytes: &[u8]) -> Ack {
    let latency = f32::from_le_bytes(array(bytes, 16));
    Ack {
        number: u32::from_le_bytes(array(bytes, 4)),
        stamp_ms: f64::from_le_bytes(array(bytes, 8)),
        hand_to_picture_ms: (latency.is_finite() && latency >= 0.0).then_some(latency),
    }
}

fn read_joints(bytes: &[u8]) -> Result<JointsRecord, FromPageError> {
    let (side, count) = (bytes[1], u16::from_le_bytes(array(bytes, 2)));
    let hand = match side {
        0 => Handedness::Left,
        1 => Handedness::Right,
        _ => return Err(FromPageError::Hand(side, count)),
    };
    if usize::from(count) != WEBXR_JOINT_COUNT {
        return Err(FromPageError::Hand(side, count));
    }
    let mut record = JointsRecord::empty(hand);
    record.frame = Some(u64::from(u32::from_le_bytes(array(bytes, 4))));
    let time_ms = f64::from_le_bytes(array(bytes, 8));
    record.time_s = time_ms.is_finite().then_some(1e-3 * time_ms);
    for joint in 0..WEBXR_JOINT_COUNT {
        let at = 16 + 28 * joint;
        let numbers: [f64; 7] = std::array::from_fn(|i| float(bytes, at + 4 * i));
        record.joints[WRIST + joint] = read_joint(joint, numbers)?;
    }
    Ok(record)
}

/// A joint; `None` where it is not tracked, which a NaN says.
fn read_joint(joint: usize, numbers: [f64; 7]) -> Result<Option<JointSample>, FromPageError> {
    if numbers.iter().any(|number| number.is_nan()) {
        return Ok(None);
    }
    let [x, y, z, i, j, k, w] = numbers;
    let wrong = |what| Err(FromPageError::Joint { joint, what });
    if [x, y, z].iter().any(|c| c.abs() > RANGE_M) {
        return wrong("further away than a room is wide");
    }
    let quaternion = Quaternion::new(w, i, j, k);
    if !(0.99..=1.01).contains(&quaternion.norm()) {
        return wrong("its orientation is no quaternion of length 1");
    }
    let orientation = Some(UnitQuaternion::new_normalize(quaternion));
    Ok(Some(JointSample { orientation, ..JointSample::at(Point3::new(x, y, z)) }))
}

#[cfg(test)]
#[path = "from_page_tests.rs"]
mod tests;
