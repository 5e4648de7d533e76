//! Report `accuracy`: every element against closed forms and published values.
//!
//! A further element is one more entry of [`ELEMENTS`].

mod bar;
mod block;
mod cantilever;
mod clamped_block;
mod discrete;
mod indentation;
mod membrane;
mod mirror;
mod outcome;
mod patch;
mod quadrature;
mod report;
mod thick_sphere;
mod waves;

use softgrasp_core::fem::Element;

pub use report::measure;

/// Elements that every case is solved with.
pub const ELEMENTS: &[Element] = &Element::ALL;

/// Power of the size of an element with which displacements converge on straight-edged bodies, in
/// the mean over the volume: one more than the degree of the polynomials that the element holds.
fn order(element: Element) -> f64 {
    if element.node_count() == 10 { 3.0 } else { 2.0 }
}
