//! Isosurface stuffing: what the built-in objects and the filling of surfaces have in common.

mod cut;
mod incidence;
mod pieces;
mod smooth;

pub(crate) use cut::{Cut, Side, warp};
pub(crate) use incidence::Incidence;
pub(crate) use pieces::{Pieces, Stuffing};
pub(crate) use smooth::{least_sine, smooth};
