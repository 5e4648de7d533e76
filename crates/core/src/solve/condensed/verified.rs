//! What the bound needs of a contact set: the small system with its rounding, an inverse that is
//! verified, and how stiffly the contacts hold the body (`docs/bound.md`, sections 4 and 5).

use nalgebra::{DMatrix, DVector};

use super::base::Base;
use super::columns::ContactColumns;
use super::rounding::{Ball, SLACK, gamma, settled};
use super::small_system::SmallSystem;
use super::touched::Touched;

/// The small system `S = [ s EᵀG  EᵀR ; (EᵀR)ᵀ 0 ]` as the stored columns define it.
///
/// Shapes: c unknown forces, z modes, k = c + z. Units: 1; the unknowns are λ / s and a, in m.
pub(super) struct Verified {
    /// S with its rounding, k².
    pub small: Ball,
    /// Bound per entry on what a product with S loses, k².
    lost: DMatrix<f64>,
    /// The inverse as computed, k².
    pub inverse: DMatrix<f64>,
    /// Bound of `‖I − S X‖`.
    pub eta: f64,
    /// Scale s of the forces, N/m.
    pub scale: f64,
    /// Norms of the columns of `M = [s G  R]`, and bounds of those of `s (E − K G)` and `−K R` over
    /// the rows of `K_B`.
    pub norms: Vec<f64>,
    pub residuals: Vec<f64>,
    /// Bounds of `‖M X‖` and of the residual of `M X`, N/m, from the columns' norms.
    pub moved: f64,
    pub left: f64,
    hold: Option<Hold>,
}

/// How stiffly the contacts hold the motions without energy.
struct Hold {
    /// Bound of `‖I − N EᵀR D‖`.
    delta: f64,
    /// Bound of `‖N EᵀG Nᵀ‖`, m/N, that of `‖G Nᵀ‖`, and that of its residual.
    compliance: f64,
    moved: f64,
    residual: f64,
}

/// Factors of the bound for one proven eigenvalue.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Amplification {
    /// Displacement per residual force, m/N.
    pub of_residual: f64,
    /// Displacement per force against a motion without energy, m/N.
    pub of_moment: f64,
}

impl Verified {
    /// Shapes: `small` and `inverse` k², scaled; `places` as in the contact set.
    pub fn new(base: &Base, touched: &Touched, small: &SmallSystem, inverse: DMatrix<f64>) -> Self {
        let SmallSystem { columns, places, matrix, scale, .. } = small;
        let scale = *scale;
        let (c, k) = (places.len(), places.len() + base.modes.len());
        let field = |j: usize| match places.get(j) {
            Some(&(at, axis)) => (&columns[at].fields[axis], scale),
            None => (&base.modes[j - c].field, 1.0),
        };
        let mut radius = DMatrix::zeros(k, k);
        let means = gamma(touched.longest() + 3);
        for j in 0..k {
            let (field, scale) = field(j);
            for i in 0..c {
                // A product by the scale is one more rounding; a single node is exact but for it.
                let off = touched.mean_of_sizes(i, field) * scale * means * SLACK;
                radius[(i, j)] = off;
                if j >= c {
                    radius[(j, i)] = off;
                }
            }
        }
        let small = Ball { middle: matrix.clone(), radius };
        let product = small.times(&Ball::exact(inverse.clone()));
        let eta = if k > 0 { product.distance_from_identity() } else { 0.0 };
        let of_places = |of: fn(&ContactColumns, usize) -> f64| {
            places.iter().map(move |&(at, axis)| scale * of(&columns[at], axis) * SLACK)
        };
        let modes = base.modes.iter();
        let norms = of_places(|c, axis| c.norms[axis]);
        let norms = norms.chain(modes.clone().map(|m| m.norm * SLACK)).collect();
        let residuals = of_places(|c, axis| c.residual_bounds[axis]);
        let residuals = residuals.chain(modes.map(|m| m.residual_bound * SLACK)).collect();
        let lost = (&small.radius + small.middle.abs() * gamma(k + 5)) * SLACK;
        let mut verified = Self {
            small,
            lost,
            inverse,
            eta,
            scale,
            norms,
            residuals,
            moved: 0.0,
            left: 0.0,
            hold: None,
        };
        verified.moved = verified.times_inverse(&verified.norms);
        verified.left = verified.times_inverse(&verified.residuals);
        verified.hold = verified.hold(base, c);
        verified
    }

    /// Bound of what the equations of the contacts and of balance miss, m.
    ///
    /// Shapes: `x` scaled unknowns, k; `q` displacements of the contacts, c.
    pub fn mismatch(&self, q: &[f64], x: &DVector<f64>) -> f64 {
        let right = DVector::from_fn(x.len(), |i, _| q.get(i).copied().unwrap_or(0.0));
        self.missed(&right, x)
    }

    /// The same for any right side that is exact.
    ///
    /// Shapes: k.
    pub fn missed(&self, right: &DVector<f64>, x: &DVector<f64>) -> f64 {
        let missed = (right - &self.small.middle * x).norm();
        let lost = (&self.lost * x.abs() + right.abs() * gamma(2)).norm();
        settled(missed, lost) * SLACK
    }

    /// Bound of `‖Σ xⱼ vⱼ‖` from bounds of the columns' norms.
    pub fn sum(bounds: &[f64], x: &DVector<f64>) -> f64 {
        bounds.iter().zip(x).map(|(bound, x)| bound * x.abs()).sum::<f64>() * SLACK
    }

    /// Bound of `‖V X‖` from bounds of the norms of the columns of V.
    pub fn times_inverse(&self, bounds: &[f64]) -> f64 {
        let columns = self.inverse.column_iter();
        let of_column = |x: nalgebra::DVectorView<'_, f64>| {
            bounds.iter().zip(x.iter()).map(|(bound, x)| bound * x.abs()).sum::<f64>()
        };
        columns.map(|x| of_column(x).powi(2)).sum::<f64>().sqrt() * SLACK
    }

    /// Factors from residuals to displacements; `None` where they cannot be proven.
    ///
    /// Units: `eigenvalue` N/m.
    pub fn amplification(&self, base: &Base, eigenvalue: f64) -> Option<Amplification> {
        let root = 1.0 / eigenvalue.sqrt();
        let Some(rigid) = &base.rigid else {
            let of_residual = root * root * SLACK;
            return base.modes.is_empty().then_some(Amplification { of_residual, of_moment: 0.0 });
        };
        let hold = self.hold.as_ref()?;
        let omega =
            hold.compliance + hold.moved * hold.residual + hold.residual.powi(2) / eigenvalue;
        let held = omega.sqrt() / (1.0 - hold.delta) * SLACK;
        let compliance = (root + rigid.norm * held) * SLACK;
        let energy = rigid.stiffness * (2.0 * held * compliance + held * held * rigid.norm);
        let kept = 1.0 - energy * SLACK;
        // Written so that a NaN is refused too.
        let is_proven = kept > 0.01;
        is_proven.then(|| Amplification {
            of_residual: compliance * root / kept * SLACK,
            of_moment: compliance * held / kept * SLACK,
        })
    }

    /// Estimate of the displacement that rounding in the stiffness makes, over the displacements: `K` moves
    /// motions without energy by a little force, and the contacts hold these so weakly or firmly.
    pub fn turned_by_rounding(&self, base: &Base) -> f64 {
        let (Some(rigid), Some(hold)) = (&base.rigid, &self.hold) else { return 0.0 };
        rigid.norm * hold.compliance * rigid.computed_stiffness
    }

    /// Finds a left inverse N of `EᵀR D` in the inverse of S and verifies it.
    fn hold(&self, base: &Base, c: usize) -> Option<Hold> {
        let rigid = base.rigid.as_ref()?;
        let z = base.modes.len();
        let block = |row, column, rows, columns| Ball {
            middle: self.small.middle.view((row, column), (rows, columns)).into_owned(),
            radius: self.small.radius.view((row, column), (rows, columns)).into_owned(),
        };
        let left = Ball::exact(&rigid.from_modes * self.inverse.view((c, 0), (z, c)));
        let moved = block(0, c, c, z).times(&Ball::exact(rigid.to_orthonormal.clone()));
        let delta = left.times(&moved).distance_from_identity();
        // Written so that a NaN is refused too.
        let is_verified = delta < 0.5;
        if !is_verified {
            return None;
        }
        let compliance = left.times(&block(0, 0, c, c)).times(&left.transposed());
        let weighted = |of: &dyn Fn(usize) -> f64| {
            let rows = left.middle.row_iter();
            let sums = rows.map(|row| (0..c).map(|j| row[j].abs() * of(j)).sum::<f64>().powi(2));
            sums.sum::<f64>().sqrt() / self.scale * SLACK
        };
        Some(Hold {
            delta,
            compliance: compliance.norm() / self.scale * SLACK,
            moved: weighted(&|j| self.norms[j]),
            residual: weighted(&|j| self.residuals[j] + base.asymmetry * self.norms[j]),
        })
    }
}
