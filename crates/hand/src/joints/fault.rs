//! Why bytes did not become a record of joints.

use super::cut::LINE_MAX;
use super::record::{JOINT_COUNT, WEBXR_JOINT_COUNT};

/// A coordinate may be this far from the origin, m.
pub const RANGE_M: f64 = 100.0;

/// Why a line is not a record. `entry` counts from 0 in the line's own list of joints.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum JointsFaultKind {
    /// No LF where every possible line has ended.
    #[error("a line is longer than {LINE_MAX} bytes")]
    TooLong,
    /// The line is not JSON.
    #[error("not JSON at column {column}")]
    NotJson {
        /// Column of the line, from 1.
        column: usize,
        /// Whether NaN or an infinity stands in that column.
        has_no_number: bool,
    },
    /// JSON, but not an object with the fields of a record.
    #[error("not a record: {reason}")]
    NotARecord {
        /// What is wrong, in printable characters.
        reason: String,
    },
    /// The list has another number of joints.
    #[error("{got} joints; there must be {JOINT_COUNT} (OpenXR) or {WEBXR_JOINT_COUNT} (WebXR)")]
    JointCount {
        /// Number of joints in the line.
        got: usize,
    },
    /// A joint is a list of another length.
    #[error("joint {entry} has {got} numbers; there must be 3, 7 or 16")]
    EntryLength {
        /// Entry of the joint.
        entry: usize,
        /// Number of numbers in the entry.
        got: usize,
    },
    /// A joint is too far away.
    #[error("joint {entry} is farther than {RANGE_M} m from the origin")]
    Range {
        /// Entry of the joint.
        entry: usize,
    },
    /// A quaternion is not near length one.
    #[error("the orientation of joint {entry} is not a unit quaternion")]
    Orientation {
        /// Entry of the joint.
        entry: usize,
    },
    /// A matrix is not that of a rigid motion.
    #[error("the matrix of joint {entry} is not a rigid motion")]
    Matrix {
        /// Entry of the joint.
        entry: usize,
    },
    /// A radius is negative or larger than one metre.
    #[error("the radius of joint {entry} is not between 0 and 1 m")]
    Radius {
        /// Entry of the joint.
        entry: usize,
    },
}

/// Bytes that were thrown away, and why.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{kind} ({bytes_skipped} bytes skipped)")]
pub struct JointsFault {
    /// Why the bytes did not become a record.
    pub kind: JointsFaultKind,
    /// Number of bytes thrown away, LF included.
    pub bytes_skipped: usize,
}
