//! The elements that every case is solved with.

use softgrasp_core::fem::Element;

/// Elements that every case is solved with.
pub(super) const ELEMENTS: &[Element] = &Element::ALL;

/// Power of the size of an element with which displacements converge on straight-edged bodies, in
/// the mean over the volume: one more than the degree of the polynomials that the element holds.
pub(super) fn order(element: Element) -> f64 {
    if element.node_count() == 10 { 3.0 } else { 2.0 }
}
