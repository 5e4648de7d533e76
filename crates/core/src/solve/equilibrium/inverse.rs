//! The inverse of an older tangent under the constraints of a hold: what corrections are made with.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector, Dyn, LU};

use super::hold::Hold;
use crate::fem::hyperelastic::{Curvature, Elements};
use crate::fem::{Stiffness, StiffnessPattern};
use crate::solve::Partition;
use crate::solve::front::{FrontError, FrontFactor};
use crate::solve::multigrid::{self, Goal, Hierarchy};
use crate::solve::vectors::norm;

/// A factor of a tangent in one of the precisions, or what stands for one.
pub(super) enum Factor {
    Double(FrontFactor<f64>),
    Single(FrontFactor<f32>),
    Cycles(Cycles),
}

/// Conjugate gradients with a multigrid hierarchy of a tangent.
pub(super) struct Cycles {
    hierarchy: Box<Hierarchy>,
    stiffness: Arc<Stiffness>,
    partition: Arc<Partition>,
}

/// Where conjugate gradients for a correction end: it is one of several, as with an older factor.
const OF_CORRECTION: Goal = Goal { residual_rel: 1e-6, error_rel: 1e-5, steps_max: 400 };
/// Estimated error with which a tangent counts as inverted. Along a direction without positive stiffness
/// conjugate gradients end long before.
const ERROR_OF_INVERSE: f64 = 1e-2;

impl Cycles {
    /// Makes the hierarchy, and looks whether conjugate gradients come to an end with it.
    fn try_new(hold: &Hold, stiffness: &Arc<Stiffness>) -> Result<Self, FactorError> {
        let partition = Arc::clone(&hold.partition);
        let hierarchy = Box::new(Hierarchy::new(stiffness, &partition));
        let cycles = Self { hierarchy, stiffness: Arc::clone(stiffness), partition };
        // Without pattern, so that no direction is orthogonal to it.
        let n = hold.partition.unknown().len();
        let b: Vec<f64> = (0..n).map(|i| (7.3 * (i + 1) as f64).sin()).collect();
        match cycles.solve(&b) {
            Some(_) => Ok(cycles),
            None => Err(FactorError::NotPositive),
        }
    }

    fn bytes(&self) -> usize {
        self.hierarchy.bytes() + self.stiffness.pattern().block_count() * size_of::<[f64; 9]>()
    }

    /// Answers for columns of n; `None` where conjugate gradients did not reach one.
    fn solve(&self, b: &[f64]) -> Option<Vec<f64>> {
        let Self { stiffness, partition, hierarchy } = self;
        let found = multigrid::solve_columns(stiffness, partition, hierarchy, b, OF_CORRECTION);
        let mut answers = Vec::with_capacity(b.len());
        for outcome in found {
            // A NaN is no answer either; nothing asked is nothing moved.
            let is_answer =
                outcome.error_estimate_rel <= ERROR_OF_INVERSE || outcome.residual_rel == 0.0;
            if !is_answer {
                return None;
            }
            let unknown = partition.unknown().iter();
            answers.extend(unknown.map(|&dof| outcome.x[dof as usize]));
        }
        Some(answers)
    }
}

/// Why a tangent has no factor.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FactorError {
    /// The tangent has a direction without positive stiffness.
    #[error("the tangent stiffness is not positive definite")]
    NotPositive,
    /// The system had no memory for the factor.
    #[error("no memory for a factor of {bytes} bytes")]
    OutOfMemory {
        /// Bytes asked for.
        bytes: usize,
    },
}

impl From<FrontError> for FactorError {
    fn from(error: FrontError) -> Self {
        match error {
            FrontError::OutOfMemory { bytes } => Self::OutOfMemory { bytes },
            FrontError::NotPositive { .. } | FrontError::OtherPattern => Self::NotPositive,
        }
    }
}

impl Factor {
    /// A factor of a tangent (with its springs).
    pub fn try_new(
        hold: &Hold,
        stiffness: &Arc<Stiffness>,
        is_single: bool,
    ) -> Result<Self, FactorError> {
        Ok(match &hold.analysis {
            None => Self::Cycles(Cycles::try_new(hold, stiffness)?),
            Some(analysis) if is_single => Self::Single(FrontFactor::try_new(analysis, stiffness)?),
            Some(analysis) => Self::Double(FrontFactor::try_new(analysis, stiffness)?),
        })
    }

    pub fn bytes(&self) -> usize {
        match self {
            Self::Double(factor) => factor.bytes(),
            Self::Single(factor) => factor.bytes(),
            Self::Cycles(cycles) => cycles.bytes(),
        }
    }

    /// Solves in place for columns of n, each scaled to one, so that small units do not fall below
    /// single precision's range.
    fn solve(&self, b: &mut [f64], n: usize) {
        if n == 0 || b.is_empty() {
            return;
        }
        let columns = b.len() / n;
        match self {
            // Where rounding leaves no answer the correction is none, and the line search says so.
            Self::Cycles(cycles) => match cycles.solve(b) {
                Some(x) => b.copy_from_slice(&x),
                None => b.fill(0.0),
            },
            Self::Double(factor) => factor.solve_in_place(b, columns),
            Self::Single(factor) => {
                let scales: Vec<f64> = b.chunks(n).map(usable_norm).collect();
                for (column, scale) in b.chunks_mut(n).zip(&scales) {
                    column.iter_mut().for_each(|x| *x /= scale);
                }
                factor.solve_in_place(b, columns);
                for (column, scale) in b.chunks_mut(n).zip(&scales) {
                    column.iter_mut().for_each(|x| *x *= scale);
                }
            }
        }
    }
}

fn usable_norm(v: &[f64]) -> f64 {
    let norm = norm(v);
    if norm > 0.0 && norm.is_finite() { norm } else { 1.0 }
}

/// The inverse of a tangent among the displacements that a hold allows.
///
/// With springs of stiffness g at some degrees of freedom the tangent K is A − B g Bᵀ, A being what
/// was factored. The step z of smallest energy with `C z = m` solves
/// `A z + Cᵀ λ + B μ = r`, `C z = m`, `Bᵀ z + μ/g = 0`: the springs' forces are taken out again, so a
/// body that masks alone hold is as free as it is.
pub(super) struct Inverse {
    factor: Factor,
    springs: Vec<f64>,
    /// `A⁻¹ [Cᵀ B]`, columns of n.
    columns: Vec<f64>,
    small: Option<LU<f64, Dyn, Dyn>>,
}

impl Inverse {
    /// From a factor and the springs that are in it.
    pub fn new(hold: &Hold, factor: Factor, springs: Vec<f64>) -> Self {
        let mut inverse = Self { factor, springs, columns: Vec::new(), small: None };
        inverse.fit(hold);
        inverse
    }

    /// Works out the columns of the constraints of a hold with the same known degrees of freedom.
    pub fn fit(&mut self, hold: &Hold) {
        let n = hold.partition.unknown().len();
        let sprung: Vec<usize> =
            hold.sprung.iter().filter_map(|&dof| hold.partition.row_of(dof as usize)).collect();
        let c = hold.constraint_count();
        let count = c + sprung.len();
        self.columns = vec![0.0; n * count];
        for (column, row) in self.columns.chunks_mut(n.max(1)).zip(&hold.rows) {
            row.iter().for_each(|&(at, weight)| column[at as usize] = weight);
        }
        for (j, &row) in sprung.iter().enumerate() {
            self.columns[(c + j) * n + row] = 1.0;
        }
        self.factor.solve(&mut self.columns, n);
        if count == 0 {
            self.small = None;
            return;
        }
        let mut small = DMatrix::zeros(count, count);
        for (j, column) in self.columns.chunks(n.max(1)).enumerate() {
            for (i, value) in pulled(hold, column).into_iter().enumerate() {
                small[(i, j)] = value;
            }
        }
        for (j, spring) in self.springs.iter().enumerate() {
            small[(c + j, c + j)] -= 1.0 / spring;
        }
        self.small = Some(small.lu());
    }

    /// The step z with `C z = m` that forces r make.
    ///
    /// Shapes: `r` n, `m` c; result n. Units: N, m.
    pub fn apply(&self, hold: &Hold, mut r: Vec<f64>, m: &[f64]) -> Vec<f64> {
        let n = r.len();
        self.factor.solve(&mut r, n);
        let Some(small) = &self.small else { return r };
        let mut right = pulled(hold, &r);
        right.iter_mut().zip(m).for_each(|(right, m)| *right -= m);
        let Some(forces) = small.solve(&DVector::from_vec(right)) else { return r };
        for (column, force) in self.columns.chunks(n.max(1)).zip(forces.iter()) {
            r.iter_mut().zip(column).for_each(|(z, y)| *z -= force * y);
        }
        r
    }
    pub fn bytes(&self) -> usize {
        self.factor.bytes() + size_of_val(self.columns.as_slice())
    }
}

/// `[C; Bᵀ] v`.
fn pulled(hold: &Hold, v: &[f64]) -> Vec<f64> {
    let mut pulled = hold.constrained(v);
    let rows = hold.sprung.iter().filter_map(|&dof| hold.partition.row_of(dof as usize));
    pulled.extend(rows.map(|row| v[row]));
    pulled
}

/// A factor to be made of the shape that a path has now, anywhere.
pub struct Renewal {
    pub(super) elements: Arc<Elements>,
    pub(super) pattern: Arc<StiffnessPattern>,
    pub(super) hold: Arc<Hold>,
    pub(super) q: Vec<f64>,
    pub(super) is_single: bool,
}

/// A factor that was made for a path.
pub struct Renewed {
    pub(super) hold: Arc<Hold>,
    pub(super) inverse: Inverse,
}

/// How far from the tangent to its positive part a factor is looked for. Masks hold a body in ways
/// that a factor does not know of, so the tangent of a pressed body often has none; the less is added
/// to it, the better is its inverse.
const POSITIVE_SHARES: [f64; 4] = [0.0, 0.1, 0.35, 1.0];

impl Renewal {
    /// Makes the factor: of the tangent as it is, or of its positive part where that has none.
    ///
    /// # Errors
    /// [`FactorError`] if neither has one.
    pub fn make(self) -> Result<Renewed, FactorError> {
        let Self { elements, pattern, hold, q, is_single } = self;
        let tangent_of = |curvature| elements.tangent(&pattern, &q, curvature);
        let factored = Factored::try_new(&hold, is_single, POSITIVE_SHARES, tangent_of)?;
        Ok(Renewed { inverse: factored.inverse, hold })
    }
}

/// A tangent that was factored.
pub(super) struct Factored {
    pub inverse: Inverse,
    /// The tangent, with the springs of the hold.
    pub stiffness: Arc<Stiffness>,
    /// Share of the way to its positive part that was gone for a factor.
    pub share: f64,
}

impl Factored {
    /// Factors a tangent with shares of the way to its positive part, the first that has a factor.
    ///
    /// # Errors
    /// [`FactorError`] if none has one.
    pub fn try_new(
        hold: &Hold,
        is_single: bool,
        shares: impl IntoIterator<Item = f64>,
        tangent_of: impl Fn(Curvature) -> Stiffness,
    ) -> Result<Self, FactorError> {
        let mut positive = None;
        for share in shares {
            let mut stiffness = tangent_of(Curvature::AsItIs);
            if share > 0.0 {
                let part = || tangent_of(Curvature::PositivePart);
                stiffness.blend(positive.get_or_insert_with(part), share);
            }
            let springs = hold.add_springs(&mut stiffness);
            let stiffness = Arc::new(stiffness);
            match Factor::try_new(hold, &stiffness, is_single) {
                Ok(factor) => {
                    let inverse = Inverse::new(hold, factor, springs);
                    return Ok(Self { inverse, stiffness, share });
                }
                Err(FactorError::NotPositive) => {}
                Err(error) => return Err(error),
            }
        }
        Err(FactorError::NotPositive)
    }
}
