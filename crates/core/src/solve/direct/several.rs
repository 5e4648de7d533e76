//! Displacements and reactions for several loads of one partition: solved and refined together, so
//! that factor and stiffness are read once for all of them.

use super::error::SolveError;
use super::factored::Factored;
use super::kernel::{Kernel, norms};
use super::refinement::{Course, Judged, steps_max};
use super::solution::{Loads, Solution, check};
use crate::fem::{Products, Stiffness};
use crate::solve::{Certainty, Method, Partition, Stage};

/// Loads that are refined together: as many as the kernels take at once.
const TOGETHER: usize = 24;

impl Factored {
    /// [`Factored::solve`] for several loads of the partition, with the same goals and the same
    /// meaning of all figures; the last bits may be others.
    ///
    /// # Errors
    /// Those of [`Factored::solve`]; the first in the order of the loads.
    ///
    /// Source: thesis (3.43), (3.7).
    pub fn solve_several(
        &self,
        stiffness: &Stiffness,
        loads: &[Loads<'_>],
        on_stage: &mut dyn FnMut(Stage),
    ) -> Result<Vec<Solution>, SolveError> {
        on_stage(Stage::Solve);
        loads.iter().try_for_each(|loads| check(self.partition(), *loads))?;
        let alone = |loads: &Loads<'_>| self.solve(stiffness, *loads, &mut |_| {});
        let is_together = self.with_kernel(Kernel::takes_rows)
            && !matches!(self.method(), Method::Pcg | Method::Condensed);
        if !is_together || loads.len() < 2 {
            return loads.iter().map(alone).collect();
        }
        let mut solutions = Vec::with_capacity(loads.len());
        for some in loads.chunks(TOGETHER) {
            let found = self.with_kernel(|kernel| {
                let mut block = Block::new(self.partition(), stiffness, some);
                block.refine(kernel);
                block.solutions(self)
            });
            for (found, loads) in found.into_iter().zip(some) {
                // Alone it may go on in double precision, or say what is wrong.
                solutions.push(found.map_or_else(|| alone(loads), Ok)?);
            }
        }
        Ok(solutions)
    }

    /// The same, and how certain the least certain answer is. Where no digit of one by single
    /// precision is certain, double precision answers, as far as memory goes.
    ///
    /// # Errors
    /// Those of [`Factored::solve_several`].
    pub fn solve_several_for_certain(
        &self,
        stiffness: &Stiffness,
        loads: &[Loads<'_>],
        on_stage: &mut dyn FnMut(Stage),
    ) -> Result<(Vec<Solution>, Option<Certainty>), SolveError> {
        let solutions = self.solve_several(stiffness, loads, on_stage)?;
        let certainty = self.least_certain(stiffness, &solutions);
        let is_older = solutions.iter().any(|solution| solution.fallback != self.fallback());
        let is_none = certainty.as_ref().is_some_and(Certainty::is_none);
        if !self.is_to_solve_again(stiffness, is_older, is_none) {
            return Ok((solutions, certainty));
        }
        let solutions = self.solve_several(stiffness, loads, on_stage)?;
        let certainty = self.least_certain(stiffness, &solutions);
        Ok((solutions, certainty))
    }

    fn least_certain(&self, stiffness: &Stiffness, solutions: &[Solution]) -> Option<Certainty> {
        let found = solutions.iter().map(|solution| solution.certainty(self, stiffness));
        found.max_by(|a, b| a.error_rel.total_cmp(&b.error_rel))
    }
}

/// Several answers on their way.
///
/// Shapes: rows of all degrees of freedom (3N) or of the unknown (n), each with one number for each
/// of the loads.
struct Block<'a> {
    partition: &'a Partition,
    stiffness: &'a Stiffness,
    columns: usize,
    /// External forces, 3N rows.
    forces: Vec<f64>,
    /// Displacements, 3N rows.
    q: Vec<f64>,
    /// `K q`, and its rounding.
    products: Products,
    /// Size of the right-hand side of every load.
    b_norms: Vec<f64>,
    states: Vec<State>,
}

/// How far one answer is.
struct State {
    course: Course,
    residual_norm: f64,
    is_done: bool,
}

impl<'a> Block<'a> {
    /// The answers before anything is solved: known displacements and zeros.
    fn new(partition: &'a Partition, stiffness: &'a Stiffness, loads: &[Loads<'_>]) -> Self {
        let columns = loads.len();
        let rows = partition.dof_count() * columns;
        let (mut q, mut forces) = (vec![0.0; rows], vec![0.0; rows]);
        for (j, loads) in loads.iter().enumerate() {
            for (&dof, &value) in partition.known().iter().zip(loads.q_known) {
                q[dof as usize * columns + j] = value;
            }
            for (dof, &force) in loads.forces.iter().enumerate() {
                forces[dof * columns + j] = force;
            }
        }
        let products = stiffness.mul_columns(&q, columns);
        let mut this = Self {
            partition,
            stiffness,
            columns,
            forces,
            q,
            products,
            b_norms: Vec::new(),
            states: Vec::new(),
        };
        this.b_norms = norms(&this.residual(), columns);
        this
    }

    /// `f₁ − K q` on the unknown rows.
    fn residual(&self) -> Vec<f64> {
        let mut residual = Vec::with_capacity(self.partition.unknown().len() * self.columns);
        for &dof in self.partition.unknown() {
            let row = dof as usize * self.columns..(dof as usize + 1) * self.columns;
            let (forces, products) = (&self.forces[row.clone()], &self.products.forces[row]);
            residual.extend(forces.iter().zip(products).map(|(f, p)| f - p));
        }
        residual
    }

    /// Solves, and improves every answer until it is judged good or gets no better.
    fn refine(&mut self, kernel: &Kernel) {
        let mut residual = self.residual();
        kernel.apply_to_rows(&mut residual, self.columns);
        self.add(&residual, &vec![true; self.columns]);
        self.products = self.stiffness.mul_columns(&self.q, self.columns);
        residual = self.residual();
        self.states = self
            .judge(&residual)
            .into_iter()
            .map(|(judged, residual_norm)| {
                let course = Course::new(kernel, judged);
                State { course, residual_norm, is_done: false }
            })
            .collect();
        for _ in 0..steps_max(kernel) {
            for state in &mut self.states {
                state.is_done |= state.course.is_good();
            }
            if self.states.iter().all(|state| state.is_done) {
                return;
            }
            self.step(kernel, &mut residual);
        }
    }

    /// One correction of the answers that are not done; those that it makes no better are done and
    /// stay as they were.
    fn step(&mut self, kernel: &Kernel, residual: &mut Vec<f64>) {
        let before = self.q.clone();
        let mut correction = residual.clone();
        kernel.apply_to_rows(&mut correction, self.columns);
        let is_under_way: Vec<bool> = self.states.iter().map(|state| !state.is_done).collect();
        self.add(&correction, &is_under_way);
        let products = self.stiffness.mul_columns(&self.q, self.columns);
        let old = std::mem::replace(&mut self.products, products);
        *residual = self.residual();
        let judged = self.judge(residual);
        let sizes = norms(&correction, self.columns);
        let whole = norms(&self.unknown(), self.columns);
        let mut worse = Vec::new();
        for (j, (judged, residual_norm)) in judged.into_iter().enumerate() {
            let state = &mut self.states[j];
            if state.is_done {
                continue;
            }
            if state.course.takes(judged, || sizes[j] / whole[j]) {
                state.residual_norm = residual_norm;
            } else {
                state.is_done = true;
                worse.push(j);
            }
        }
        for j in worse {
            for k in (j..self.q.len()).step_by(self.columns) {
                self.q[k] = before[k];
                self.products.forces[k] = old.forces[k];
                self.products.sizes[k] = old.sizes[k];
            }
        }
    }

    /// Adds corrections to some of the answers.
    fn add(&mut self, correction: &[f64], is_under_way: &[bool]) {
        for (&dof, correction) in
            self.partition.unknown().iter().zip(correction.chunks_exact(self.columns))
        {
            let q = &mut self.q[dof as usize * self.columns..][..self.columns];
            for ((q, correction), is_under_way) in q.iter_mut().zip(correction).zip(is_under_way) {
                if *is_under_way {
                    *q += correction;
                }
            }
        }
    }

    fn unknown(&self) -> Vec<f64> {
        let rows = self.partition.unknown().iter().map(|&dof| dof as usize * self.columns);
        rows.flat_map(|at| &self.q[at..at + self.columns]).copied().collect()
    }

    /// How good every answer is, and the norm of its residual.
    fn judge(&self, residual: &[f64]) -> Vec<(Judged, f64)> {
        let mut backward = vec![0.0f64; self.columns];
        for (&dof, residual) in
            self.partition.unknown().iter().zip(residual.chunks_exact(self.columns))
        {
            let at = dof as usize * self.columns;
            let (sizes, forces) = (&self.products.sizes[at..], &self.forces[at..]);
            for (j, r) in residual.iter().enumerate() {
                let ratio = if *r == 0.0 { 0.0 } else { r.abs() / (sizes[j] + forces[j].abs()) };
                if ratio > backward[j] || ratio.is_nan() {
                    backward[j] = ratio;
                }
            }
        }
        let sizes = norms(residual, self.columns);
        let judged = backward.iter().zip(sizes).zip(&self.b_norms);
        judged
            .map(|((&backward, size), &b_norm)| (Judged::new(backward, size, b_norm), size))
            .collect()
    }

    /// The answers; none where one is no number or refinement came to a halt.
    fn solutions(self, factored: &Factored) -> Vec<Option<Solution>> {
        let column = |numbers: &[f64], j: usize| -> Vec<f64> {
            numbers.iter().skip(j).step_by(self.columns).copied().collect()
        };
        (0..self.columns)
            .map(|j| {
                let state = &self.states[j];
                let displacement = column(&self.q, j);
                if state.course.has_stalled() || !displacement.iter().all(|q| q.is_finite()) {
                    return None;
                }
                let forces = &self.products.forces;
                let known = self.partition.known().iter();
                let b_norm = self.b_norms[j];
                Some(Solution {
                    displacement,
                    reaction: known.map(|&dof| forces[dof as usize * self.columns + j]).collect(),
                    residual_rel: match b_norm > 0.0 {
                        true => state.residual_norm / b_norm,
                        false => state.residual_norm,
                    },
                    backward_error: state.course.judged.backward_error,
                    error_estimate_rel: None,
                    refinement_steps: state.course.steps,
                    fallback: factored.fallback(),
                })
            })
            .collect()
    }
}
