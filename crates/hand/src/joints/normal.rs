//! Normal equations of the fit: each digit's own angles meet only those unknowns that all share.

use nalgebra::{SMatrix, SVector, Vector3};

use super::slope::{PER_DIGIT, SHARED};

type SharedMatrix = SMatrix<f64, SHARED, SHARED>;
type SharedVector = SVector<f64, SHARED>;
type DigitMatrix = SMatrix<f64, PER_DIGIT, PER_DIGIT>;
type DigitVector = SVector<f64, PER_DIGIT>;
type Coupling = SMatrix<f64, PER_DIGIT, SHARED>;

/// A diagonal entry counts at least this much in the damping, so that unknowns of which the joints
/// say nothing stay where they are. Units: m² per unit of the unknown squared.
const DAMPED_AT_LEAST: f64 = 1e-6;

/// Which unknowns may not move, in the order of the steps.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Held {
    /// Whether the palm arch may not move.
    pub(super) arch: bool,
    /// Whether each angle of each digit may not move.
    pub(super) digits: [[bool; PER_DIGIT]; 5],
}

/// A change of all unknowns.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    /// Changes of palm shift (m), palm turn (rad) and palm arch (rad).
    pub(super) shared: SharedVector,
    /// Changes of the angles of each digit, rad.
    pub(super) digits: [DigitVector; 5],
}

/// JᵀJ and Jᵀr of a weighted least-squares sum, in blocks.
#[derive(Clone, Copy, Debug)]
pub(super) struct NormalEquations {
    shared: SharedMatrix,
    digits: [DigitMatrix; 5],
    coupling: [Coupling; 5],
    shared_gradient: SharedVector,
    digit_gradients: [DigitVector; 5],
}

impl NormalEquations {
    /// Equations of no residual at all.
    pub(super) fn new() -> Self {
        Self {
            shared: SharedMatrix::zeros(),
            digits: [DigitMatrix::zeros(); 5],
            coupling: [Coupling::zeros(); 5],
            shared_gradient: SharedVector::zeros(),
            digit_gradients: [DigitVector::zeros(); 5],
        }
    }

    /// Adds the residual of a joint that only the shared unknowns move.
    pub(super) fn add_shared(
        &mut self,
        weight: f64,
        residual: &Vector3<f64>,
        by_shared: &SMatrix<f64, 3, SHARED>,
    ) {
        self.shared += by_shared.transpose() * by_shared * weight;
        self.shared_gradient += by_shared.transpose() * residual * weight;
    }

    /// Adds the residual of a joint of one digit.
    pub(super) fn add_digit(
        &mut self,
        digit: usize,
        weight: f64,
        residual: &Vector3<f64>,
        (by_shared, by_angle): (&SMatrix<f64, 3, SHARED>, &SMatrix<f64, 3, PER_DIGIT>),
    ) {
        self.add_shared(weight, residual, by_shared);
        let transposed = by_angle.transpose() * weight;
        self.digits[digit] += transposed * by_angle;
        self.coupling[digit] += transposed * by_shared;
        self.digit_gradients[digit] += transposed * residual;
    }

    /// Half the derivative of the sum by the palm arch and by every angle.
    pub(super) fn gradient(&self) -> (f64, &[DigitVector; 5]) {
        (self.shared_gradient[SHARED - 1], &self.digit_gradients)
    }

    /// The step that makes the linear model least, damped (Levenberg–Marquardt); held unknowns
    /// stay. `None` if rounding leaves no positive matrix: damp more.
    pub(super) fn step(&self, damping: f64, held: &Held) -> Option<Step> {
        let mut schur = self.shared;
        let mut rhs = -self.shared_gradient;
        damp(&mut schur, damping);
        if held.arch {
            hold(&mut schur, &mut rhs, SHARED - 1);
        }
        let mut inner = [DigitVector::zeros(); 5];
        let mut outer = [Coupling::zeros(); 5];
        for digit in 0..5 {
            let (mut block, mut right) = (self.digits[digit], -self.digit_gradients[digit]);
            let mut coupling = self.coupling[digit];
            damp(&mut block, damping);
            for angle in 0..PER_DIGIT {
                if held.digits[digit][angle] {
                    hold(&mut block, &mut right, angle);
                    coupling.row_mut(angle).fill(0.0);
                }
            }
            if held.arch {
                coupling.column_mut(SHARED - 1).fill(0.0);
            }
            let factor = block.cholesky()?;
            inner[digit] = factor.solve(&right);
            outer[digit] = factor.solve(&coupling);
            schur -= coupling.transpose() * outer[digit];
            rhs -= coupling.transpose() * inner[digit];
        }
        let shared = schur.cholesky()?.solve(&rhs);
        let digits = std::array::from_fn(|digit| inner[digit] - outer[digit] * shared);
        Some(Step { shared, digits })
    }
}

fn damp<const N: usize>(matrix: &mut SMatrix<f64, N, N>, damping: f64) {
    for i in 0..N {
        matrix[(i, i)] += damping * matrix[(i, i)].max(DAMPED_AT_LEAST);
    }
}

/// Makes an equation say that its unknown does not move.
fn hold<const N: usize>(matrix: &mut SMatrix<f64, N, N>, rhs: &mut SVector<f64, N>, at: usize) {
    matrix.row_mut(at).fill(0.0);
    matrix.column_mut(at).fill(0.0);
    matrix[(at, at)] = 1.0;
    rhs[at] = 0.0;
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};
    use proptest::prelude::*;

    const UNKNOWNS: usize = SHARED + 5 * PER_DIGIT;

    proptest! {
        #[test]
        fn steps_equal_those_of_the_whole_matrix(
            numbers in prop::collection::vec(-1.0..1.0f64, 20 * (3 * 12)),
            holds in prop::collection::vec(prop::bool::weighted(0.2), 21),
            damping in 1e-4..1.0f64,
        ) {
            let mut number = numbers.into_iter();
            let mut next = || number.next().unwrap();
            let mut equations = NormalEquations::new();
            let mut whole = DMatrix::<f64>::zeros(UNKNOWNS, UNKNOWNS);
            let mut gradient = DVector::<f64>::zeros(UNKNOWNS);
            for joint in 0..20 {
                let digit = joint / 4;
                let by_shared = SMatrix::<f64, 3, SHARED>::from_fn(|_, _| next());
                let by_angle = SMatrix::<f64, 3, PER_DIGIT>::from_fn(|_, _| next());
                let residual = Vector3::from_fn(|_, _| next());
                let weight = 1.0 + 0.1 * joint as f64;
                equations.add_digit(digit, weight, &residual, (&by_shared, &by_angle));
                let mut row = DMatrix::<f64>::zeros(3, UNKNOWNS);
                row.view_mut((0, 0), (3, SHARED)).copy_from(&by_shared);
                row.view_mut((0, SHARED + PER_DIGIT * digit), (3, PER_DIGIT)).copy_from(&by_angle);
                whole += row.transpose() * &row * weight;
                gradient += row.transpose() * residual * weight;
            }
            for i in 0..UNKNOWNS {
                whole[(i, i)] += damping * whole[(i, i)].max(DAMPED_AT_LEAST);
            }
            let mut held = Held { arch: holds[20], ..Held::default() };
            let mut rhs = -gradient;
            for (at, is_held) in holds.into_iter().enumerate() {
                let column = if at == 20 { SHARED - 1 } else { SHARED + at };
                if at < 20 {
                    held.digits[at / PER_DIGIT][at % PER_DIGIT] = is_held;
                }
                if is_held {
                    whole.row_mut(column).fill(0.0);
                    whole.column_mut(column).fill(0.0);
                    whole[(column, column)] = 1.0;
                    rhs[column] = 0.0;
                }
            }
            let expected = whole.lu().solve(&rhs).unwrap();
            let step = equations.step(damping, &held).unwrap();
            for i in 0..SHARED {
                prop_assert!((step.shared[i] - expected[i]).abs() < 1e-8);
            }
            for i in 0..5 * PER_DIGIT {
                let got = step.digits[i / PER_DIGIT][i % PER_DIGIT];
                prop_assert!((got - expected[SHARED + i]).abs() < 1e-8);
            }
        }
    }

    #[test]
    fn unknowns_without_any_equation_stay() {
        let mut equations = NormalEquations::new();
        let by_shared = SMatrix::<f64, 3, SHARED>::identity();
        equations.add_shared(1.0, &Vector3::new(0.1, 0.2, 0.3), &by_shared);
        let step = equations.step(1e-9, &Held::default()).unwrap();
        assert!((step.shared.fixed_rows::<3>(0) + Vector3::new(0.1, 0.2, 0.3)).norm() < 1e-8);
        assert_eq!(step.shared[SHARED - 1], 0.0);
        assert!(step.digits.iter().all(|digit| *digit == DigitVector::zeros()));
    }
}
