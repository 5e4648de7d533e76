//! Displacements and reactions for several loads of one partition.

use super::block::Block;
use super::error::SolveError;
use super::factored::Factored;
use super::kernel::Kernel;
use super::solution::{Loads, Solution, check};
use crate::fem::Stiffness;
use crate::solve::{Certainty, Method, Stage};

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
                Block::solve(self.partition(), stiffness, kernel, some, self.fallback())
            });
            for (found, loads) in found.into_iter().zip(some) {
                // Alone it may go on in double precision, or say what is wrong.
                solutions.push(found.map_or_else(|| alone(loads), Ok)?);
            }
        }
        Ok(solutions)
    }

    /// Solutions of several load cases, and how certain the least certain one is. Where no digit of one by single
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
