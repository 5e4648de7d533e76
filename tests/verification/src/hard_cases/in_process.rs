//! Answers by calls of the library: a factor, columns of the compliance, masks.

use std::time::Instant;

use softgrasp_core::contact::Mask;
use softgrasp_core::model::{Element, Model, ModelError};
use softgrasp_core::solve::condensed::{Columns, ContactSet, Delivery, Touched};
use softgrasp_core::solve::{Certainty, Loads, Method};

use super::answer::{Answer, since};
use super::case::Question;
use super::refusal::Refusal;

/// Memory for columns, bytes; more than any case needs.
const COLUMN_BYTES: usize = 1 << 30;
/// Number of nodes up to which the bound is proven, which takes a second factor.
const PROVEN_NODES_MAX: usize = 20_000;

/// Model of a question.
///
/// # Errors
/// [`ModelError`].
pub(super) fn model_of(question: &Question, element: Element) -> Result<Model, ModelError> {
    let Question { mesh, materials, fixed, .. } = question;
    Model::try_new(mesh.clone(), element, materials, fixed.clone(), &mut |_| {})
}

/// Answer by a factor or inverse of `K11`.
///
/// # Errors
/// [`Refusal`].
pub(super) fn direct(
    question: &Question,
    element: Element,
    method: Method,
) -> Result<Answer, Refusal> {
    let begin = Instant::now();
    let model = model_of(question, element)?;
    let known = model.known(question.pairs.clone())?;
    let factored = model.factor(&known.dofs, method, &mut |_| {})?;
    let loads = Loads { q_known: &known.q_known, ..Loads::default() };
    let (solution, certainty) =
        factored.solve_for_certain(model.stiffness(), loads, &mut |_| {})?;
    let ms = since(begin);
    Answer {
        residual_rel: solution.residual_rel,
        displacement: solution.displacement,
        condition: certainty.condition,
        stated_rel: certainty.error_rel,
        bound_rel: None,
        remark: solution.fallback.map(|fallback| fallback.to_string()).unwrap_or_default(),
        ms,
    }
    .if_certain()
}

/// Answer by columns of the compliance. With `by_masks` every touched node is held by a mask of that node
/// alone, which is the same question to other code.
///
/// # Errors
/// [`Refusal`].
pub(super) fn condensed(
    question: &Question,
    element: Element,
    by_masks: bool,
) -> Result<Answer, Refusal> {
    let begin = Instant::now();
    let model = model_of(question, element)?;
    let known = model.known(question.pairs.clone())?;
    // What the scene holds is part of the base; no case moves it.
    let is_touched = |dof: u32| model.fixed().binary_search(&dof).is_err();
    let pairs = known.dofs.iter().zip(&known.q_known).filter(|(dof, _)| is_touched(**dof));
    let pairs: Vec<(u32, f64)> = pairs.map(|(dof, q)| (*dof, *q)).collect();
    let Grouped { loose, masked } = Grouped::of(&pairs, by_masks);
    let (dofs, mut q): (Vec<u32>, Vec<f64>) = loose.into_iter().unzip();
    q.extend(masked.iter().flat_map(|(_, mean)| mean));
    let masks: Vec<Mask> = masked.iter().map(|(node, _)| Mask::of_node(*node)).collect();
    let mut held: Vec<u32> = dofs.iter().chain(model.fixed()).copied().collect();
    held.sort_unstable();
    model.check_held(&held, &masks)?;
    let base = model.condense(None, &mut |_| {})?;
    let columns = Columns::new(COLUMN_BYTES);
    let set = ContactSet::try_new(&base, &columns, &Touched { dofs, masks })?;
    let answer = set.solve(&q)?;
    let displacement = set.full_displacement(&base, &answer);
    let ms = since(begin);
    if model.mesh().node_count() <= PROVEN_NODES_MAX {
        // Kept by the base, and `certify` finds it there.
        let _ = base.prove_eigenvalue_min();
    }
    let delivered = displacement.as_chunks::<3>().0;
    let certificate = set.certify(&base, &q, &answer, delivered, Delivery::Double);
    base.estimate_condition();
    let nothing = Certainty { condition: f64::NAN, error_rel: f64::NAN };
    let certainty = set.certainty(&base).unwrap_or(nothing);
    Answer {
        residual_rel: certificate.residual_rel,
        condition: certainty.condition,
        stated_rel: certainty.error_rel,
        bound_rel: certificate.error_bound_rel.ok(),
        remark: String::new(),
        displacement,
        ms,
    }
    .if_certain()
}

/// Known displacements; if masks are wanted, those of whole nodes apart.
pub(super) struct Grouped {
    /// Displacements by degree of freedom, m.
    pub loose: Vec<(u32, f64)>,
    /// Displacements by node, to be held by masks, m.
    pub masked: Vec<(u32, [f64; 3])>,
}

/// Largest number of masks; further nodes are held without masks.
const MASKS_MAX: usize = 10;

impl Grouped {
    /// Groups `pairs`, which are ascending, each degree of freedom once.
    pub fn of(pairs: &[(u32, f64)], by_masks: bool) -> Self {
        let (mut loose, mut masked) = (Vec::new(), Vec::new());
        for of_node in pairs.chunk_by(|a, b| a.0 / 3 == b.0 / 3) {
            match of_node {
                [(first, x), (_, y), (_, z)] if by_masks && masked.len() < MASKS_MAX => {
                    masked.push((first / 3, [*x, *y, *z]));
                }
                _ => loose.extend_from_slice(of_node),
            }
        }
        Self { loose, masked }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_nodes_become_masks_and_single_axes_stay() {
        let pairs = [(3, 1.0), (4, 2.0), (5, 3.0), (7, 4.0)];
        let grouped = Grouped::of(&pairs, true);
        assert_eq!((grouped.loose, grouped.masked), (vec![(7, 4.0)], vec![(1, [1.0, 2.0, 3.0])]));
        assert_eq!(Grouped::of(&pairs, false).loose, pairs);
    }
}
