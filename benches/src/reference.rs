//! Exact answer to compare with: refined with residuals in twice the working precision.

use softgrasp_core::fem::Stiffness;
use softgrasp_core::model::{Known, Model};
use softgrasp_core::solve::{Factored, Loads, Method};

use crate::report::ReportError;

/// Displacements that solve `K11 Q_u = −K12 Q_k` to the last bits of double precision.
///
/// Shapes: `displacement` 3N. Units: m.
#[derive(Clone, Debug, PartialEq)]
pub struct Reference {
    /// Displacement of every degree of freedom, m.
    pub displacement: Vec<f64>,
    /// Largest correction of the last step, relative to the largest displacement.
    pub last_correction_rel: f64,
}

/// Change in a step, relative to the largest displacement, below which refinement ends.
const SETTLED: f64 = 1e-18;
const STEPS_MAX: usize = 12;

impl Reference {
    /// Solves by sparse Cholesky and refines. Displacement and residual are sums of two doubles, so each
    /// step reduces the error by the factor's accuracy, down to rounding.
    ///
    /// The stiffness itself is used as it was assembled.
    ///
    /// # Errors
    /// [`ReportError::Model`], [`ReportError::Solve`].
    ///
    /// Source: thesis (3.43a); Higham, Accuracy and Stability of Numerical Algorithms, chapter 12.
    pub fn of(model: &Model, known: &Known) -> Result<Self, ReportError> {
        let factored = model.factor(&known.dofs, Method::SparseCholesky, &mut |_| {})?;
        let loads = Loads { q_known: &known.q_known, ..Loads::default() };
        Self::refined(model.stiffness(), &factored, loads)
    }

    /// Refines the answer of a factor that exists, for further load cases of one partition.
    ///
    /// # Errors
    /// [`ReportError::Solve`].
    pub fn refined(
        stiffness: &Stiffness,
        factored: &Factored,
        loads: Loads<'_>,
    ) -> Result<Self, ReportError> {
        let mut high = factored.solve(stiffness, loads, &mut |_| {})?.displacement;
        let mut low = vec![0.0; high.len()];
        let largest = amax(&high);
        let mut last_correction_rel = f64::INFINITY;
        for _ in 0..STEPS_MAX {
            let correction = correction(stiffness, factored, loads.forces, &high, &low)?;
            for ((high, low), step) in high.iter_mut().zip(&mut low).zip(&correction) {
                let (sum, rest) = two_sum(*high, *step);
                (*high, *low) = two_sum(sum, rest + *low);
            }
            let size = if largest > 0.0 { amax(&correction) / largest } else { 0.0 };
            let stalled = size >= 0.5 * last_correction_rel;
            last_correction_rel = last_correction_rel.min(size);
            if size <= SETTLED || stalled {
                break;
            }
        }
        Ok(Self { displacement: high, last_correction_rel })
    }

    /// Largest difference to an answer, relative to the largest displacement; infinite for NaN or another
    /// number of degrees of freedom.
    ///
    /// `scale` multiplies the reference (the problem is linear).
    pub fn error_of(&self, answer: impl ExactSizeIterator<Item = f64>, scale: f64) -> f64 {
        if answer.len() != self.displacement.len() {
            return f64::INFINITY;
        }
        error_rel(answer.zip(self.displacement.iter().map(|u| u * scale)))
    }
}

/// Largest difference of pairs (answer, exact value), relative to the largest exact value; infinite for
/// NaN.
pub fn error_rel(pairs: impl Iterator<Item = (f64, f64)>) -> f64 {
    let (mut difference, mut largest) = (0.0f64, 0.0f64);
    for (answer, right) in pairs {
        if !(answer - right).is_finite() {
            return f64::INFINITY;
        }
        difference = difference.max((answer - right).abs());
        largest = largest.max(right.abs());
    }
    if largest > 0.0 { difference / largest } else { difference }
}

/// `K11⁻¹` times the residual of `high + low`, for all degrees of freedom; `given` forces are empty or
/// one for each degree of freedom.
fn correction(
    stiffness: &Stiffness,
    factored: &Factored,
    given: &[f64],
    high: &[f64],
    low: &[f64],
) -> Result<Vec<f64>, ReportError> {
    let partition = factored.partition();
    let residual = exact_residual(stiffness, given, high, low);
    let mut forces = vec![0.0; high.len()];
    for &dof in partition.unknown() {
        forces[dof as usize] = residual[dof as usize];
    }
    let zeros = vec![0.0; partition.known().len()];
    let loads = Loads { q_known: &zeros, forces: &forces, residual_rel: 0.0 };
    Ok(factored.solve(stiffness, loads, &mut |_| {})?.displacement)
}

/// `f − K (high + low)`, each row summed in twice the working precision and rounded once.
fn exact_residual(stiffness: &Stiffness, given: &[f64], high: &[f64], low: &[f64]) -> Vec<f64> {
    let mut residual = vec![0.0; high.len()];
    for node in 0..stiffness.node_count() {
        for axis in 0..3 {
            let force = given.get(3 * node + axis).copied().unwrap_or(0.0);
            let (mut sum, mut rest) = (-force, 0.0);
            for (column, block) in stiffness.row(node) {
                for other in 0..3 {
                    let (k, dof) = (block[3 * axis + other], 3 * column + other);
                    let (term, term_rest) = two_product(k, high[dof]);
                    let (next, lost) = two_sum(sum, term);
                    sum = next;
                    rest += lost + term_rest + k * low[dof];
                }
            }
            residual[3 * node + axis] = -(sum + rest);
        }
    }
    residual
}

/// Rounded sum, and the part that rounding lost.
pub fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let b_seen = sum - a;
    (sum, (a - (sum - b_seen)) + (b - b_seen))
}

/// Rounded product, and the part that rounding lost.
pub fn two_product(a: f64, b: f64) -> (f64, f64) {
    let product = a * b;
    (product, a.mul_add(b, -product))
}

fn amax(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most: f64, v| most.max(v.abs()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Pressed;
    use proptest::prelude::*;
    use softgrasp_core::mesh::BuiltIn;

    proptest! {
        #[test]
        fn sums_and_products_lose_nothing(a in -1_000_000_000i64..1_000_000_000, e in 0..30i32) {
            // Both are integers below 2⁶⁰ or so: checked in exact arithmetic.
            let (x, y) = (a as f64 * f64::from(1 << 20) + 1.0, f64::from(1 << e) + 1.0);
            let (product, rest) = two_product(x, y);
            let exact = (i128::from(a) * (1 << 20) + 1) * ((1 << e) + 1);
            prop_assert_eq!(product as i128 + rest as i128, exact);
            let (sum, rest) = two_sum(x * 4096.0, y / 1024.0);
            let exact = (i128::from(a) * (1 << 20) + 1) * 4096 * 1024 + (1 << e) + 1;
            prop_assert_eq!((sum * 1024.0) as i128 + (rest * 1024.0) as i128, exact);
        }
    }

    #[test]
    fn forces_are_answered_as_exactly_as_known_displacements() {
        let scene = Pressed::try_new(BuiltIn::Sphere, 120).unwrap();
        let (model, known) = scene.model().unwrap();
        let mut forces = vec![0.0; 3 * scene.mesh.node_count()];
        for dof in (1..forces.len() as u32).step_by(3).filter(|d| !known.dofs.contains(d)) {
            forces[dof as usize] = -1e-3;
        }
        let q_known = vec![0.0; known.dofs.len()];
        let loads = Loads { q_known: &q_known, forces: &forces, ..Loads::default() };
        let factored = model.factor(&known.dofs, Method::Front, &mut |_| {}).unwrap();
        let reference = Reference::refined(model.stiffness(), &factored, loads).unwrap();
        assert!(reference.last_correction_rel < 1e-17, "{:e}", reference.last_correction_rel);
        let answer = factored.solve(model.stiffness(), loads, &mut |_| {}).unwrap().displacement;
        let error = reference.error_of(answer.into_iter(), 1.0);
        assert!(error > 0.0 && error < 1e-11, "{error:e}");
    }

    #[test]
    fn reference_is_settled_and_every_method_is_near_it() {
        let scene = Pressed::try_new(BuiltIn::Sphere, 120).unwrap();
        let (model, known) = scene.model().unwrap();
        let reference = Reference::of(&model, &known).unwrap();
        assert!(reference.last_correction_rel < 1e-17, "{:e}", reference.last_correction_rel);
        for method in Method::DIRECT {
            let (_, solution) = scene.analyse(method).unwrap();
            let error = reference.error_of(solution.displacement.iter().copied(), 1.0);
            assert!(error < 1e-11, "{method}: {error:e}");
        }
    }

    #[test]
    fn a_wrong_or_missing_answer_has_an_error() {
        let reference = Reference { displacement: vec![1.0, -2.0, 0.5], last_correction_rel: 0.0 };
        assert_eq!(reference.error_of([1.0, -2.0, 0.5].into_iter(), 1.0), 0.0);
        assert_eq!(reference.error_of([2.0, -4.0, 2.0].into_iter(), 2.0), 0.25);
        assert_eq!(reference.error_of([1.0, f64::NAN, 0.5].into_iter(), 1.0), f64::INFINITY);
        assert_eq!(reference.error_of([1.0, -2.0].into_iter(), 1.0), f64::INFINITY);
    }
}
