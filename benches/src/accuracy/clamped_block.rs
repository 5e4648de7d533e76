//! A block clamped below and pushed sideways: what an element that locks cannot do.

use softgrasp_core::fem::{AXES, Element};

use super::outcome::{Outcome, Solved};
use crate::hard_cases::pushed_block;
use crate::report::ReportError;

/// Boxes over the width of the reference, made of ten-node elements.
const REFERENCE_CELLS: usize = 8;

/// Displacement of the pushed face over the force, with `cells` boxes over the width of the block and
/// twice as many over its height, against ten-node elements of a fine mesh.
///
/// # Errors
/// [`ReportError`].
pub fn pushed(element: Element, poisson: f64, cells: usize) -> Result<Outcome, ReportError> {
    let (expected, _) = pushed_block(Element::Tet10, REFERENCE_CELLS, poisson)?;
    let (computed, [nodes, known]) = pushed_block(element, cells, poisson)?;
    let (case, unknown) = ("clamped block", AXES * nodes - known);
    let solved = Solved { case, element, poisson, cells, nodes, unknown };
    Ok(solved.with_number("displacement over force", computed, expected))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bending by shear of a short block: the plain element is off by tens of per cent near
    /// incompressibility, the others get better with the mesh.
    #[test]
    fn only_the_plain_element_locks() {
        let error = |element, cells| pushed(element, 0.4999, cells).unwrap().error_rel;
        assert!(error(Element::Tet4, 6) > 0.5);
        let averaged = [3, 6].map(|cells| error(Element::Tet4Anp, cells));
        assert!(averaged[1] < 0.5 * averaged[0] && averaged[1] < 0.2, "{averaged:?}");
        assert!(error(Element::Tet10, 4) < 0.05);
    }
}
