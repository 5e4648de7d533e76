//! A block clamped below and pushed sideways, on which elements that lock are too stiff.

use softgrasp_core::fem::{AXES, Element};

use super::outcome::{Outcome, Solved};
use crate::hard_cases::pushed_block;
use softgrasp_bench::report::ReportError;

/// Poisson's ratio, and displacement over force, m/N: the limit of three meshes of ten-node
/// tetrahedra (C3D10) by CalculiX 2.20.
///
/// Source: `benches/peers/clamped_block.py`, which makes the decks.
const REFERENCE: [(f64, f64); 3] = [(0.3, 3.708048e-4), (0.49, 3.600177e-4), (0.4999, 3.590970e-4)];

/// Displacement of the pushed face over the force, with `cells` boxes over the width of the block and
/// twice as many over its height, against a fine mesh of another code.
///
/// # Errors
/// [`ReportError`]; a Poisson's ratio without a reference gives an error that is no number.
pub fn pushed(element: Element, poisson: f64, cells: usize) -> Result<Outcome, ReportError> {
    let reference = REFERENCE.iter().find(|(nu, _)| *nu == poisson);
    let expected = reference.map_or(f64::NAN, |(_, compliance)| *compliance);
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
