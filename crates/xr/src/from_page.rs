//! Messages that a page sends: untrusted bytes, which are checked before anything is done with them.

use nalgebra::{Point3, Quaternion, UnitQuaternion};
use serde::Deserialize;
use softgrasp_grasp::hand::Handedness;
use softgrasp_hand::joints::{JointSample, JointsRecord, RANGE_M, WEBXR_JOINT_COUNT, WRIST};

/// Length of the longest message, bytes.
pub const MESSAGE_MAX: usize = 2048;
/// Length of an acknowledgement, bytes.
pub const ACK_BYTES: usize = 24;
/// Length of a tracked hand, bytes.
pub const JOINTS_BYTES: usize = 16 + 28 * WEBXR_JOINT_COUNT;
/// First byte of an acknowledgement.
pub const ACK: u8 = 0x81;
/// First byte of a tracked hand.
pub const JOINTS: u8 = 0x82;

/// Binary message of a page.
#[derive(Clone, Debug, PartialEq)]
pub enum FromPage {
    /// Acknowledges a picture that has been drawn.
    Ack(Ack),
    /// Joints of a tracked hand.
    Joints(Box<JointsRecord>),
}

/// Acknowledgement of a picture that has been drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ack {
    /// Number of the picture that was drawn.
    pub number: u32,
    /// Time of drawing by the page's clock, ms; repeated in the next picture's message.
    pub stamp_ms: f64,
    /// Time from the tracked hand to the first picture that shows it, ms; `None` for other pictures.
    pub hand_to_picture_ms: Option<f32>,
}

/// Wish that a person chose in the page's menu.
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
        /// Name of a built-in object, or of a file.
        name: String,
    },
    /// Write the object into the run's folder.
    Save {
        /// File name without a folder; its extension gives the format.
        name: String,
    },
    /// Show a quantity in colours.
    Shade {
        /// Name of the quantity, as on the command line.
        what: String,
    },
    /// Play a script from its beginning.
    Restart,
    /// Pause the run, or go on.
    Pause {
        /// Whether the run is to pause.
        stands: bool,
    },
    /// End the run.
    Exit,
}

/// Why bytes from a page are no message.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FromPageError {
    /// The first byte is the kind of no message.
    #[error("no message begins with {0}")]
    Kind(u8),
    /// The message is too short or too long.
    #[error("a message of this kind has {expected} bytes, not {got}")]
    Length {
        /// Length that this kind of message has, bytes.
        expected: usize,
        /// Length of the message that came, bytes.
        got: usize,
    },
    /// The counts in the message are not those of a tracked hand.
    #[error("a hand is 0 (left) or 1 (right) with 25 joints, not {0} with {1}")]
    Hand(u8, u16),
    /// A joint has an impossible number.
    #[error("joint {joint}: {what}")]
    Joint {
        /// Number of the joint.
        joint: usize,
        /// Fault of the joint.
        what: &'static str,
    },
    /// The text is none of the wishes.
    #[error("nothing that can be asked for: {0}")]
    Ask(String),
}

impl FromPage {
    /// Reads a binary message.
    ///
    /// # Errors
    /// [`FromPageError`]; nothing of the message is then used.
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
    /// [`FromPageError::Ask`] with the fault.
    pub fn read(text: &str) -> Result<Self, FromPageError> {
        serde_json::from_str(text).map_err(|error| FromPageError::Ask(error.to_string()))
    }
}

fn of_length(bytes: &[u8], expected: usize) -> Result<&[u8], FromPageError> {
    let got = bytes.len();
    (got == expected).then_some(bytes).ok_or(FromPageError::Length { expected, got })
}

/// `N` bytes from position `at`; zeros beyond the end, which no message of the right length has.
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

/// Pose of a joint; `None` where it is not tracked, which the page says by NaN.
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
