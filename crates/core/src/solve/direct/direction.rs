//! The directions in which answers are corrected.
//!
//! A factor in single precision is wrong in few shapes of displacement, the softest ones, so that
//! plain refinement takes the same share off in every step. The length of a step that leaves the
//! least energy of error, and conjugate directions, take those shapes out one after another.
//!
//! Source: Hestenes and Stiefel 1952; the flexible form after Golub and Ye 1999.

use rayon::prelude::*;

use crate::solve::columns::{PART_ROWS, dots};

/// Directions of several answers, each conjugate to the one before.
///
/// Shapes: rows of all degrees of freedom (3N) × `columns` loads, the numbers of one row next to each
/// other; known rows of `p` are zero.
pub(super) struct Direction {
    columns: usize,
    /// The direction, at first the answers themselves.
    pub p: Vec<f64>,
    /// `K p`; zeros as long as it is not known.
    pub forces: Vec<f64>,
    /// `pᵀ K p` of every load.
    energy: Vec<f64>,
    /// Memory of the direction before.
    spare: Vec<f64>,
}

impl Direction {
    pub fn new(rows: usize, columns: usize) -> Self {
        let none = || vec![0.0; rows];
        Self { columns, p: none(), forces: none(), energy: vec![0.0; columns], spare: none() }
    }

    /// Memory for corrections, with anything in it.
    pub fn memory(&mut self) -> Vec<f64> {
        std::mem::take(&mut self.spare)
    }

    /// Takes the corrections, made conjugate to the direction before.
    pub fn turn(&mut self, mut correction: Vec<f64>) {
        let columns = self.columns;
        if self.energy.iter().any(|energy| *energy > 0.0) {
            let common = dots(&correction, &self.forces, columns);
            let share: Vec<f64> = common
                .iter()
                .zip(&self.energy)
                .map(|(c, e)| if *e > 0.0 { c / e } else { 0.0 })
                .collect();
            let part = PART_ROWS * columns;
            let pairs = correction.par_chunks_mut(part).zip(self.p.par_chunks(part));
            pairs.for_each(|(correction, p)| {
                for (c, p) in correction.chunks_exact_mut(columns).zip(p.chunks_exact(columns)) {
                    for j in 0..columns {
                        c[j] -= share[j] * p[j];
                    }
                }
            });
        }
        self.spare = std::mem::replace(&mut self.p, correction);
    }

    /// How far each answer goes so that the energy of its error is least; as far as the correction
    /// says where rounding hides that.
    pub fn lengths(&mut self, residual: &[f64]) -> Vec<f64> {
        self.energy = dots(&self.p, &self.forces, self.columns);
        let work = dots(&self.p, residual, self.columns);
        let length = |(work, energy): (f64, &f64)| match work / energy {
            length if (LENGTH_MIN..LENGTH_MAX).contains(&length) => length,
            _ => 1.0,
        };
        work.into_iter().zip(&self.energy).map(length).collect()
    }
}

/// Lengths of a step that a factor of the same matrix can ask for.
const LENGTH_MIN: f64 = 0.5;
const LENGTH_MAX: f64 = 2.0;
