//! Whether an answer keeps what was prescribed and leaves no force on the free nodes, by our own rows.

use std::collections::BTreeSet;

use softgrasp_core::model::Model;

/// Largest force on a free degree of freedom, relative to the largest on a known one; infinite if the
/// answer does not have the known displacements or the right length.
///
/// Shapes: `displacement` 3N. Units: `known` and `displacement` m.
pub(crate) fn imbalance(model: &Model, known: &[(u32, f64)], displacement: &[f64]) -> f64 {
    let size = known.iter().fold(0.0f64, |m, (_, u)| m.max(u.abs()));
    let is_kept = |&(dof, u): &(u32, f64)| {
        displacement.get(dof as usize).is_some_and(|got| (got - u).abs() <= 1e-12 * size)
    };
    if displacement.len() != 3 * model.mesh().node_count() || !known.iter().all(is_kept) {
        return f64::INFINITY;
    }
    let held: BTreeSet<usize> = known.iter().map(|&(dof, _)| dof as usize).collect();
    let (mut free, mut needed) = (0.0f64, 0.0f64);
    for (dof, force) in model.stiffness().mul(displacement).iter().enumerate() {
        let largest = if held.contains(&dof) { &mut needed } else { &mut free };
        *largest = if force.is_finite() { largest.max(force.abs()) } else { f64::INFINITY };
    }
    free / needed
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Pressed;
    use softgrasp_core::mesh::BuiltIn;
    use softgrasp_core::solve::Method;

    #[test]
    fn an_answer_that_is_moved_is_out_of_balance() {
        let scene = Pressed::try_new(BuiltIn::Sphere, 100).unwrap();
        let (model, _) = scene.model().unwrap();
        let (_, solution) = scene.analyse(Method::SparseCholesky).unwrap();
        let mut displacement = solution.displacement;
        assert!(imbalance(&model, &scene.pairs, &displacement) < 1e-12);
        let free = (0..displacement.len()).find(|&d| scene.pairs.iter().all(|p| p.0 as usize != d));
        displacement[free.unwrap()] *= 1.0 + 1e-6;
        assert!(imbalance(&model, &scene.pairs, &displacement) > 1e-12);
        displacement.pop();
        assert_eq!(imbalance(&model, &scene.pairs, &displacement), f64::INFINITY);
    }
}
