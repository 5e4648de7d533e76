//! Sizes of rigid bodies, and why some make no body.

/// A size that makes no body.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ShapeError {
    /// A size that is no positive number.
    #[error("{what} is {value}; it must be a positive number of metres")]
    Size {
        /// Name of the size.
        what: &'static str,
        /// What it is.
        value: f64,
    },
    /// A normal without a direction.
    #[error("the normal of a plane must have a direction")]
    Normal,
    /// A radius of the edges of a box that is negative, no number or larger than half its smallest edge.
    #[error(
        "the radius of the edges of a box is {radius}; it must be between 0 and {most} m, half its \
         smallest edge"
    )]
    Rounding {
        /// The radius.
        radius: f64,
        /// The largest one there is.
        most: f64,
    },
}

/// The size, if it is one.
///
/// # Errors
/// [`ShapeError::Size`] with the name.
pub(super) fn positive(what: &'static str, value: f64) -> Result<f64, ShapeError> {
    match value > 0.0 && value.is_finite() {
        true => Ok(value),
        false => Err(ShapeError::Size { what, value }),
    }
}
