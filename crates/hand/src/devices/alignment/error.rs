//! Why an alignment cannot be made of what was recorded.

/// Why an alignment cannot be made of what was recorded; each says what to do.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum AlignmentError {
    /// Too few good records.
    #[error("{got} records of the tracker, {needed} are needed; record for longer")]
    TooFew {
        /// Records.
        got: usize,
        /// At least these.
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
        /// Largest way from the mean place, m.
        spread_m: f64,
        /// Largest turn from the mean attitude, rad.
        spread_rad: f64,
    },
    /// Too many records are far from the others.
    #[error(
        "{left_out} of {of} records are far from the others; hold the hand still, away from metal, \
         and try again"
    )]
    Scattered {
        /// Records left out.
        left_out: usize,
        /// All records.
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
        /// Standard deviation in the weakest direction, rad.
        turned_rad: f64,
        /// What is needed, rad.
        needed_rad: f64,
    },
    /// The point that should rest did not.
    #[error(
        "the wrist crease moved by {:.1} mm while it should rest (5 mm are allowed); press it \
         against an edge and try again",
        1e3 * .residual_m
    )]
    CreaseMoved {
        /// Root mean square of its way, m.
        residual_m: f64,
    },
    /// The fingers point up or down, so that they show no direction.
    #[error(
        "the fingers do not point forward: they rise or fall by {:.0}°",
        .tilt_rad.to_degrees()
    )]
    FingersUpright {
        /// Angle above or below the horizontal, rad.
        tilt_rad: f64,
    },
}
