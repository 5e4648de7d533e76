//! Isosurface stuffing: what the built-in objects and the filling of surfaces have in common.

mod pieces;
mod smooth;

pub(crate) use pieces::{Cut, Side, warp};
pub(crate) use pieces::{Pieces, Stuffing};
pub(crate) use smooth::{least_sine, smooth};
