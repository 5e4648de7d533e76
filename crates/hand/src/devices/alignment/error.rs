//! Why an alignment cannot be made of what was recorded.

/// Why an alignment cannot be made of what was recorded; each says what to do.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum AlignmentError {
    /// Too few good records.
    #[error("{got} records of the tracker, {needed} are needed; record for longer")]
    TooFew {
        /// Number of good records.
        got: usize,
        /// Fewest good records that are needed.
        needed: usize,
    },
    /// The hand was not held still.
    #[error(
        "the hand moved by {:.1} mm and {:.1}° while it should rest (5 mm and 2° are allowed); \
         hold it still and try again",
        1e3 * .spread_m,
        .spread_rad.to_degrees()
    )]
    Moved {
        /// Largest distance of a record from the mean position, m.
        spread_m: f64,
        /// Largest angle between a record and the mean attitude, rad.
        spread_rad: f64,
    },
    /// Too many records are far from the others.
    #[error(
        "{left_out} of {of} records are far from the others; hold the hand still, away from metal, \
         and try again"
    )]
    Scattered {
        /// Number of records left out.
        left_out: usize,
        /// Number of all records.
        of: usize,
    },
    /// The turns were too small, or all about one axis.
    #[error(
        "the hand turned by {:.0}° only in one of the directions (standard deviation, {:.0}° are \
         needed); bend the wrist up and down and to both sides about the resting crease",
        .turned_rad.to_degrees(),
        .needed_rad.to_degrees()
    )]
    TurnedTooLittle {
        /// Standard deviation of the turns in the weakest direction, rad.
        turned_rad: f64,
        /// Smallest standard deviation that is needed there, rad.
        needed_rad: f64,
    },
    /// The point that should rest did not.
    #[error(
        "the wrist crease moved by {:.1} mm while it should rest (5 mm are allowed); press it \
         against an edge and try again",
        1e3 * .residual_m
    )]
    CreaseMoved {
        /// Root mean square distance of the point from its mean position, m.
        residual_m: f64,
    },
    /// The fingers point up or down, so that they show no direction.
    #[error(
        "the fingers do not point forward: they rise or fall by {:.0}°",
        .tilt_rad.to_degrees()
    )]
    FingersUpright {
        /// Angle of the fingers above or below the horizontal, rad.
        tilt_rad: f64,
    },
}
