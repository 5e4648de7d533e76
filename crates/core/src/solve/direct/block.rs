//! Several answers of one partition on their way: solved and refined together, so that factor and
//! stiffness are read once for all of them.

use rayon::prelude::*;

use super::kernel::Kernel;
use super::refinement::{Judged, Shrinking, steps_max};
use super::solution::{Fallback, Loads, Solution, System};
use crate::fem::{Products, Stiffness, forces_of_columns};
use crate::solve::Partition;
use crate::solve::vectors::{PART_ROWS, dots, roots, sum};

/// Several answers on their way.
///
/// Shapes: rows of all degrees of freedom (3N), each with one number for each of the loads.
pub(super) struct Block<'a> {
    partition: &'a Partition,
    stiffness: &'a Stiffness,
    /// Loads, and empty ones that fill up whole vectors of the processor.
    columns: usize,
    /// External forces; none where no load has any.
    forces: Option<Vec<f64>>,
    /// Displacements of all degrees of freedom, m.
    q: Vec<f64>,
    /// `K q`, and its rounding.
    products: Products,
    /// What is missing in `K q` on the unknown rows, zero on the others.
    residual: Vec<f64>,
    /// Size of the right-hand side of every load.
    b_norms: Vec<f64>,
}

/// How good the answers of a block are.
struct Progress {
    /// Goodness of each answer.
    judged: Vec<Judged>,
    /// Sizes of the residuals.
    residual_norms: Vec<f64>,
    /// Corrections that were added so far.
    steps: u32,
    /// How the corrections of each answer shrink; `None` for a factor in double precision.
    shrinking: Option<Vec<Shrinking>>,
}

/// Several loads are filled up to a multiple of this.
const LANES: usize = 8;

impl<'a> Block<'a> {
    /// The answers before anything is solved: known displacements and zeros.
    fn new(partition: &'a Partition, stiffness: &'a Stiffness, loads: &[Loads<'_>]) -> Self {
        let columns = if loads.len() == 1 { 1 } else { loads.len().next_multiple_of(LANES) };
        let rows = partition.dof_count() * columns;
        let mut q = vec![0.0; rows];
        for (j, loads) in loads.iter().enumerate() {
            for (&dof, &value) in partition.known().iter().zip(loads.q_known) {
                q[dof as usize * columns + j] = value;
            }
        }
        let products = Products::of(stiffness, &q, columns);
        let (forces, residual) = (external(partition, loads, columns), vec![0.0; rows]);
        let b_norms = Vec::new();
        let mut this =
            Self { partition, stiffness, columns, forces, q, products, residual, b_norms };
        this.b_norms = this.find_residual().1;
        this
    }

    /// The answers by a factor; none of a load that needs to be solved alone.
    pub fn solve(
        system: System<'_>,
        kernel: &Kernel,
        loads: &[Loads<'_>],
    ) -> Vec<Option<Solution>> {
        // What is no number would spread from one answer to the others.
        let is_number =
            |loads: &Loads<'_>| loads.q_known.iter().chain(loads.forces).all(|x| x.is_finite());
        if !loads.iter().all(is_number) {
            return vec![None; loads.len()];
        }
        let System { stiffness, partition, fallback, .. } = system;
        let mut block = Block::new(partition, stiffness, loads);
        let progress = block.refine(kernel);
        (0..loads.len()).map(|j| block.solution(j, &progress, fallback)).collect()
    }

    /// Solves, and improves the answers until all are good or get no better.
    fn refine(&mut self, kernel: &Kernel) -> Progress {
        let mut direction = Direction::new(self.q.len(), self.columns);
        kernel.apply_to_rows(&self.residual, &mut direction.p, self.columns, self.partition);
        self.q.par_iter_mut().zip(&direction.p).for_each(|(q, first)| *q += first);
        let mut progress = self.judge();
        if kernel.is_single() {
            progress.shrinking = Some((0..self.columns).map(|_| Shrinking::UNSEEN).collect());
        }
        while !progress.is_good() && progress.steps < steps_max(kernel) {
            let sizes = self.correct(kernel, &mut direction);
            progress.steps += 1;
            if !progress.see(&sizes) && progress.steps < steps_max(kernel) {
                continue;
            }
            // What was added up drifts away from the truth.
            let now = self.judge();
            let gets_better = now.worst() < 0.5 * progress.worst();
            (progress.judged, progress.residual_norms) = (now.judged, now.residual_norms);
            if !gets_better {
                break;
            }
        }
        progress
    }

    /// One correction of all answers; how large each was, relative to the answer.
    fn correct(&mut self, kernel: &Kernel, direction: &mut Direction) -> Vec<f64> {
        let columns = self.columns;
        let mut correction = direction.memory();
        kernel.apply_to_rows(&self.residual, &mut correction, columns, self.partition);
        direction.turn(correction);
        forces_of_columns(self.stiffness, &direction.p, columns, &mut direction.forces);
        let lengths = direction.lengths(&self.residual);
        let (added, whole) = self.add(direction, &lengths);
        let size = |(added, whole): (f64, f64)| if added == 0.0 { 0.0 } else { added / whole };
        added.into_iter().zip(whole).map(size).collect()
    }

    /// Adds so much of each direction to its answer; norms of what was added and of the answers.
    fn add(&mut self, direction: &Direction, lengths: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let (columns, partition, part) = (self.columns, self.partition, PART_ROWS * self.columns);
        let Self { q, products, residual, .. } = self;
        let ours = q.par_chunks_mut(part).zip(products.forces.par_chunks_mut(part));
        let theirs = direction.p.par_chunks(part).zip(direction.forces.par_chunks(part));
        let parts = ours.zip(residual.par_chunks_mut(part)).zip(theirs).enumerate();
        let sums = parts.map(|(k, (((q, forces), residual), (p, p_forces)))| {
            let (mut added, mut whole) = (vec![0.0; columns], vec![0.0; columns]);
            for (i, q) in q.chunks_exact_mut(columns).enumerate() {
                let row = i * columns..(i + 1) * columns;
                let (p, p_forces) = (&p[row.clone()], &p_forces[row.clone()]);
                let (forces, residual) = (&mut forces[row.clone()], &mut residual[row]);
                let is_unknown = partition.row_of(k * PART_ROWS + i).is_some();
                for j in 0..columns {
                    let (more, force) = (lengths[j] * p[j], lengths[j] * p_forces[j]);
                    q[j] += more;
                    added[j] += more * more;
                    whole[j] += q[j] * q[j];
                    forces[j] += force;
                    residual[j] -= if is_unknown { force } else { 0.0 };
                }
            }
            (added, whole)
        });
        let (added, whole): (Vec<_>, Vec<_>) = sums.unzip();
        // Of sums out of range nothing is known but that they are not zero.
        let root = |sums: Vec<f64>| sums.into_iter().map(f64::sqrt).collect();
        (root(sum(added, columns)), root(sum(whole, columns)))
    }

    /// `K q` anew, and how good the answers are.
    fn judge(&mut self) -> Progress {
        self.products = Products::of(self.stiffness, &self.q, self.columns);
        let (backward, residual_norms) = self.find_residual();
        let found = backward.into_iter().zip(&residual_norms).zip(&self.b_norms);
        let judged = found.map(|((backward, &norm), &b_norm)| Judged::new(backward, norm, b_norm));
        Progress { judged: judged.collect(), residual_norms, steps: 0, shrinking: None }
    }

    /// `f₁ − K q` on the unknown rows; the backward errors, and the residuals' norms.
    fn find_residual(&mut self) -> (Vec<f64>, Vec<f64>) {
        let (columns, partition) = (self.columns, self.partition);
        let Self { residual, products, forces, .. } = self;
        let part = PART_ROWS * columns;
        let zeros = vec![0.0; columns];
        let parts = residual.par_chunks_mut(part).enumerate().map(|(k, residual)| {
            let (mut ratios, mut squares) = (vec![0.0; columns], vec![0.0; columns]);
            for (i, residual) in residual.chunks_exact_mut(columns).enumerate() {
                let dof = k * PART_ROWS + i;
                if partition.row_of(dof).is_none() {
                    continue;
                }
                let row = dof * columns..(dof + 1) * columns;
                let force = forces.as_ref().map_or(&zeros[..], |forces| &forces[row.clone()]);
                let (made, sizes) = (&products.forces[row.clone()], &products.sizes[row]);
                for j in 0..columns {
                    let r = force[j] - made[j];
                    let ratio = if r == 0.0 { 0.0 } else { r.abs() / (sizes[j] + force[j].abs()) };
                    ratios[j] = if ratio > ratios[j] || ratio.is_nan() { ratio } else { ratios[j] };
                    squares[j] += r * r;
                    residual[j] = r;
                }
            }
            (ratios, squares)
        });
        let (ratios, squares): (Vec<Vec<f64>>, Vec<_>) = parts.unzip();
        let most = |most: f64, ratio: f64| {
            if ratio > most || ratio.is_nan() { ratio } else { most }
        };
        let worst = |j: usize| ratios.iter().fold(0.0, |worst, part| most(worst, part[j]));
        ((0..columns).map(worst).collect(), roots(sum(squares, columns), residual))
    }

    /// One answer; none where it is no number or refinement came to a halt.
    fn solution(
        &self,
        j: usize,
        progress: &Progress,
        fallback: Option<Fallback>,
    ) -> Option<Solution> {
        let displacement: Vec<f64> = self.q.iter().skip(j).step_by(self.columns).copied().collect();
        let has_stalled = progress.shrinking.as_ref().is_some_and(|all| all[j].has_stalled());
        if has_stalled || !displacement.iter().all(|q| q.is_finite()) {
            return None;
        }
        let internal = &self.products.forces;
        let external = |at: usize| self.forces.as_ref().map_or(0.0, |forces| forces[at]);
        let reaction = self.partition.known().iter().map(|&dof| {
            let at = dof as usize * self.columns + j;
            internal[at] - external(at)
        });
        let (residual, b_norm) = (progress.residual_norms[j], self.b_norms[j]);
        Some(Solution {
            displacement,
            reaction: reaction.collect(),
            residual_rel: if b_norm > 0.0 { residual / b_norm } else { residual },
            backward_error: progress.judged[j].backward_error,
            error_estimate_rel: None,
            refinement_steps: progress.steps,
            fallback,
        })
    }
}

impl Progress {
    /// Whether all answers are good, and no further correction would change them.
    fn is_good(&self) -> bool {
        self.worst() <= 1.0 && self.shrinking.iter().flatten().all(Shrinking::is_done)
    }

    /// Component-wise maximum of what the answers lack.
    fn worst(&self) -> f64 {
        let most = |most: f64, off: f64| if off > most || off.is_nan() { off } else { most };
        self.judged.iter().map(|judged| judged.off).fold(0.0, most)
    }

    /// Looks at the sizes of the last corrections; whether the next ones would change nothing.
    fn see(&mut self, sizes: &[f64]) -> bool {
        for (shrinking, size) in self.shrinking.iter_mut().flatten().zip(sizes) {
            shrinking.see(*size);
        }
        self.shrinking.iter().flatten().all(Shrinking::is_done)
    }
}

/// External forces in rows; none where no load has any.
fn external(partition: &Partition, loads: &[Loads<'_>], columns: usize) -> Option<Vec<f64>> {
    loads.iter().any(|loads| !loads.forces.is_empty()).then(|| {
        let mut forces = vec![0.0; partition.dof_count() * columns];
        for (j, loads) in loads.iter().enumerate() {
            for (dof, &force) in loads.forces.iter().enumerate() {
                forces[dof * columns + j] = force;
            }
        }
        forces
    })
}

/// Directions in which several answers are corrected, each conjugate to the one before.
///
/// A factor in single precision is wrong in few shapes of displacement, the softest ones, so that
/// plain refinement takes the same share off in every step. The length of a step that leaves the
/// least energy of error, and conjugate directions, take those shapes out one after another.
///
/// Shapes: rows of all degrees of freedom (3N) × `columns` loads, the numbers of one row next to each
/// other; known rows of `p` are zero.
///
/// Source: Hestenes and Stiefel 1952; the flexible form after Golub and Ye 1999.
struct Direction {
    columns: usize,
    /// The direction, at first the answers themselves.
    p: Vec<f64>,
    /// `K p`; zeros as long as it is not known.
    forces: Vec<f64>,
    /// `pᵀ K p` of every load.
    energy: Vec<f64>,
    /// Memory of the direction before.
    spare: Vec<f64>,
}

impl Direction {
    fn new(rows: usize, columns: usize) -> Self {
        let none = || vec![0.0; rows];
        Self { columns, p: none(), forces: none(), energy: vec![0.0; columns], spare: none() }
    }

    /// Memory for corrections, with anything in it.
    fn memory(&mut self) -> Vec<f64> {
        std::mem::take(&mut self.spare)
    }

    /// Takes the corrections, made conjugate to the direction before.
    fn turn(&mut self, mut correction: Vec<f64>) {
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
    fn lengths(&mut self, residual: &[f64]) -> Vec<f64> {
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
