//! The largest rotation, stretch and compression of an element at large deformation.

use nalgebra::Matrix3;

use super::body::Body;

/// What a displacement field does to the elements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LargeSummary {
    /// Largest rotation of an element, of the polar decomposition `F = R U`, rad.
    pub rotation_max: f64,
    /// Largest `|λ − 1|` of a principal stretch.
    pub strain_max: f64,
    /// Largest principal stretch.
    pub stretch_max: f64,
    /// Smallest principal stretch.
    pub stretch_min: f64,
    /// Smallest volume ratio.
    pub jacobian_min: f64,
}

impl Default for LargeSummary {
    fn default() -> Self {
        Self {
            rotation_max: 0.0,
            strain_max: 0.0,
            stretch_max: 1.0,
            stretch_min: 1.0,
            jacobian_min: f64::INFINITY,
        }
    }
}

impl LargeSummary {
    /// What was not worked out: no numbers.
    pub const UNKNOWN: Self = Self {
        rotation_max: f64::NAN,
        strain_max: f64::NAN,
        stretch_max: f64::NAN,
        stretch_min: f64::NAN,
        jacobian_min: f64::NAN,
    };

    /// The summary of a displacement field, in parallel.
    pub(super) fn of(body: &Body, u: &[f64]) -> Self {
        let pieces = body.by_pieces(u, |_, _, h, piece: &mut Self| piece.see(h));
        pieces.iter().fold(Self::default(), Self::joined)
    }

    fn joined(self, other: &Self) -> Self {
        Self {
            rotation_max: self.rotation_max.max(other.rotation_max),
            strain_max: self.strain_max.max(other.strain_max),
            stretch_max: self.stretch_max.max(other.stretch_max),
            stretch_min: self.stretch_min.min(other.stretch_min),
            jacobian_min: self.jacobian_min.min(other.jacobian_min),
        }
    }

    fn see(&mut self, h: &Matrix3<f64>) {
        let f = h + Matrix3::identity();
        self.jacobian_min = self.jacobian_min.min(f.determinant());
        let eigen = (f.transpose() * f).symmetric_eigen();
        let stretches = eigen.eigenvalues.map(|value| value.max(0.0).sqrt());
        self.stretch_max = self.stretch_max.max(stretches.max());
        self.stretch_min = self.stretch_min.min(stretches.min());
        let strain = stretches.iter().map(|stretch| (stretch - 1.0).abs()).fold(0.0, f64::max);
        self.strain_max = self.strain_max.max(strain);
        // tr R with R = F U⁻¹, U⁻¹ = Σ λ⁻¹ n nᵀ.
        let mut cosine = -1.0;
        for (stretch, n) in stretches.iter().zip(eigen.eigenvectors.column_iter()) {
            cosine += n.dot(&(f * n)) / stretch;
        }
        let angle = (0.5 * cosine).clamp(-1.0, 1.0).acos();
        self.rotation_max = self.rotation_max.max(angle);
    }
}

/// Largest change of a deformation gradient (Frobenius norm) that a step makes, point by point.
pub(super) fn gradient_change_max(body: &Body, step: &[f64]) -> f64 {
    let pieces = body.by_pieces(step, |_, _, h, most: &mut f64| {
        *most = most.max(h.norm_squared());
    });
    pieces.into_iter().fold(0.0, f64::max).sqrt()
}
