//! The elements that every case is solved with.

use softgrasp_core::fem::Element;

/// Elements that every case is solved with.
pub(super) const ELEMENTS: &[Element] = &Element::ALL;

/// Order of convergence of displacements in the size of the elements on straight-edged bodies, in the
/// mean over the volume: one more than the degree of the element's polynomials.
pub(super) fn order(element: Element) -> f64 {
    if element.node_count() == 10 { 3.0 } else { 2.0 }
}
