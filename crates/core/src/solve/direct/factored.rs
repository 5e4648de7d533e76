//! `K11` of one partition, inverted or factored by one method, and its answers to load cases.

use std::sync::Arc;

use super::block::Block;
use super::error::SolveError;
use super::kernel::{Analysed, Kernel};
use super::one_load::{self, SHORT_OF_GOAL};
use super::refinement::{self, RESIDUAL_GOOD};
use super::solution::{Fallback, Loads, Solution, System};
use crate::fem::Stiffness;
use crate::solve::certainty::{Certainty, inverse_norm, row_sums};
use crate::solve::front::FrontFactor;
use crate::solve::multigrid::inverse_to_a_digit;
use crate::solve::worked_out::WorkedOut;
use crate::solve::{Method, Partition, Stage, Within};

/// `K11` of one partition, inverted or factored by one method.
///
/// Source: thesis (3.43a).
pub struct Factored {
    method: Method,
    partition: Partition,
    kernel: Kernel,
    /// Bytes that this may take, with a factor in double precision beside the single one.
    limit: u64,
    /// Why double precision was taken already when this was made.
    began_with: Option<Fallback>,
    /// The factor in double precision, once refinement has come to a halt; none if it failed too.
    double: WorkedOut<Option<Arc<Kernel>>>,
    /// Skeel's condition number, once somebody has asked for it.
    condition: WorkedOut<f64>,
}

/// Loads that are refined together: as many as the kernels take at once.
const TOGETHER: usize = 24;

impl Factored {
    /// Inverts or factors `K11` of a partition on the current rayon pool, by a [`Method`] or by a
    /// method [`Within`] a memory limit, which is looked at before anything is allocated.
    ///
    /// `on_stage` hears [`Stage::Order`] and [`Stage::Factor`] as they begin. Where a factor in single
    /// precision fails, now or in refinement later, double precision is taken as far as memory goes,
    /// and [`Factored::fallback`] says so.
    ///
    /// # Errors
    /// [`SolveError::NotPositiveDefinite`] with the node, [`SolveError::OutOfMemory`],
    /// [`SolveError::OverLimit`] with needed bytes and limit, [`SolveError::NoSuchFactor`].
    ///
    /// Source: thesis (3.43a), Appendix A for the Gauss–Jordan methods.
    pub fn try_new(
        stiffness: &Stiffness,
        partition: Partition,
        how: impl Into<Within>,
        on_stage: &mut dyn FnMut(Stage),
    ) -> Result<Self, SolveError> {
        let how = how.into();
        if how.method.has_fronts() {
            let analysed = Analysed::new(stiffness, partition, on_stage);
            return Self::of_analysed(analysed, stiffness, how, on_stage);
        }
        let kernel = Kernel::without_fronts(stiffness, &partition, how, on_stage)?;
        Ok(Self::of(how, partition, kernel, None))
    }

    /// As [`Factored::try_new`], by a method over fronts, where order and analysis are there already.
    ///
    /// `stiffness` must be the one that was analysed.
    ///
    /// # Errors
    /// Those of [`Factored::try_new`].
    pub fn of_analysed(
        analysed: Analysed,
        stiffness: &Stiffness,
        how: impl Into<Within>,
        on_stage: &mut dyn FnMut(Stage),
    ) -> Result<Self, SolveError> {
        let how = how.into();
        let needed = analysed.peak_bytes(how.method);
        SolveError::check_limit(how, needed, analysed.analysis().row_count())?;
        let has_room = analysed.peak_bytes(Method::Front) <= how.limit;
        let (kernel, began_with) = match analysed.kernel(stiffness, how.method, on_stage) {
            Err(SolveError::NotPositiveDefinite { .. }) if how.method.is_single() && has_room => {
                let double = analysed.kernel(stiffness, Method::Front, on_stage)?;
                (double, Some(Fallback::NoFactor))
            }
            kernel => (kernel?, None),
        };
        Ok(Self::of(how, analysed.into_partition(), kernel, began_with))
    }

    fn of(how: Within, partition: Partition, kernel: Kernel, began_with: Option<Fallback>) -> Self {
        let Within { method, limit } = how;
        let (double, condition) = (WorkedOut::default(), WorkedOut::default());
        Self { method, partition, kernel, limit, began_with, double, condition }
    }

    /// The method used.
    pub fn method(&self) -> Method {
        self.method
    }

    /// The partition answered for.
    pub fn partition(&self) -> &Partition {
        &self.partition
    }

    /// Bytes held by the factor or inverse: more once double precision had to be taken beside a
    /// factor in single precision.
    pub fn bytes(&self) -> usize {
        let n = self.partition.unknown().len();
        let double = self.double.get().flatten();
        self.kernel.bytes(n) + double.map_or(0, |kernel| kernel.bytes(n))
    }

    /// Why answers are of double precision where the method asked for single, if they are.
    pub fn fallback(&self) -> Option<Fallback> {
        let stalled = || self.double.get().flatten().map(|_| Fallback::Stalled);
        self.began_with.or_else(stalled)
    }

    /// The inverse or factor that answers are made with now.
    fn with_kernel<T>(&self, work: impl FnOnce(&Kernel) -> T) -> T {
        match self.double.get().flatten() {
            Some(double) => work(&double),
            None => work(&self.kernel),
        }
    }

    /// Makes a factor in double precision beside the single one, where there is none yet and memory
    /// allows it; whether answers are of double precision now, and were not before.
    fn take_double(&self, stiffness: &Stiffness) -> bool {
        let Kernel::FrontSingle(single) = &self.kernel else { return false };
        if self.double.get().is_some() {
            return false;
        }
        let needed = (single.bytes() + single.analysis().peak_bytes::<f64>()) as u64;
        if needed > self.limit {
            return false;
        }
        let made = self.double.get_or(|| {
            let factor = FrontFactor::try_new(single.analysis(), stiffness).ok()?;
            Some(Arc::new(Kernel::Front(factor)))
        });
        made.is_some()
    }

    fn system<'a>(&'a self, stiffness: &'a Stiffness) -> System<'a> {
        let (partition, method) = (&self.partition, self.method);
        System { stiffness, partition, method, fallback: self.fallback() }
    }

    /// Displacements and reactions for one set of loads: (3.43a) and (3.43b), refined while the
    /// residual falls. Where refinement with a factor in single precision comes to a halt, double
    /// precision answers, as far as memory goes ([`Factored::try_new`]), and the solution says so.
    ///
    /// `stiffness` must be the one this was factored from.
    ///
    /// # Errors
    /// [`SolveError::LoadCount`], [`SolveError::NotFinite`].
    ///
    /// Source: thesis (3.43), (3.7).
    pub fn solve(
        &self,
        stiffness: &Stiffness,
        loads: Loads<'_>,
        on_stage: &mut dyn FnMut(Stage),
    ) -> Result<Solution, SolveError> {
        on_stage(Stage::Solve);
        self.system(stiffness).check(loads)?;
        let first =
            self.with_kernel(|kernel| one_load::solve(self.system(stiffness), kernel, loads));
        let is_right = matches!(&first, Ok((_, is_right)) if *is_right);
        if is_right || !self.take_double(stiffness) {
            return first.map(|(solution, _)| solution);
        }
        self.with_kernel(|kernel| one_load::solve(self.system(stiffness), kernel, loads))
            .map(|found| found.0)
    }

    /// Solution of one load case, and how certain it is. Where no digit of an answer by single precision is
    /// certain, double precision answers, as far as memory goes.
    ///
    /// # Errors
    /// Those of [`Factored::solve`].
    pub fn solve_for_certain(
        &self,
        stiffness: &Stiffness,
        loads: Loads<'_>,
        on_stage: &mut dyn FnMut(Stage),
    ) -> Result<(Solution, Certainty), SolveError> {
        let solution = self.solve(stiffness, loads, on_stage)?;
        let certainty = self.certainty_of(&solution, stiffness);
        // The certainty may itself have found out that single precision does not do.
        let is_older = self.fallback() != solution.fallback;
        if !self.is_to_solve_again(stiffness, is_older, certainty.is_none()) {
            return Ok((solution, certainty));
        }
        let solution = self.solve(stiffness, loads, on_stage)?;
        let certainty = self.certainty_of(&solution, stiffness);
        Ok((solution, certainty))
    }

    /// Whether there is a better factor than the one an answer is of: since the answer (`is_older`), or
    /// now, because no digit of it is certain (`is_none`).
    fn is_to_solve_again(&self, stiffness: &Stiffness, is_older: bool, is_none: bool) -> bool {
        is_older || (is_none && self.take_double(stiffness))
    }

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
        let system = self.system(stiffness);
        loads.iter().try_for_each(|loads| system.check(*loads))?;
        if let Kernel::Multigrid(hierarchy) = &self.kernel {
            return one_load::solve_by_cycles(system, hierarchy, loads).into_iter().collect();
        }
        let alone = |loads: &Loads<'_>| self.solve(stiffness, *loads, &mut |_| {});
        let is_together = self.with_kernel(Kernel::takes_rows)
            && !matches!(self.method(), Method::Pcg | Method::Condensed);
        if !is_together || loads.len() < 2 {
            return loads.iter().map(alone).collect();
        }
        let mut solutions = Vec::with_capacity(loads.len());
        for some in loads.chunks(TOGETHER) {
            let found =
                self.with_kernel(|kernel| Block::solve(self.system(stiffness), kernel, some));
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
        let found = solutions.iter().map(|solution| self.certainty_of(solution, stiffness));
        found.max_by(|a, b| a.error_rel.total_cmp(&b.error_rel))
    }

    /// How certain an answer is; where the method stopped early, its own estimate counts beside
    /// rounding.
    fn certainty_of(&self, solution: &Solution, stiffness: &Stiffness) -> Certainty {
        let Some(stopped_at) = solution.error_estimate_rel else {
            return self.certainty(stiffness, solution.backward_error);
        };
        // What was stopped early on purpose is not judged by its residual.
        let is_whole = solution.residual_rel <= SHORT_OF_GOAL * RESIDUAL_GOOD;
        let backward_error = if is_whole { solution.backward_error } else { 0.0 };
        let rounding = self.certainty(stiffness, backward_error);
        Certainty { error_rel: rounding.error_rel.max(stopped_at), ..rounding }
    }

    /// How certain an answer of this factor is; the condition is estimated at the first call, by a
    /// few solves, and kept.
    ///
    /// `stiffness` must be the one this was factored from; `backward_error` that of the answer
    /// ([`crate::solve::Solution`]).
    pub fn certainty(&self, stiffness: &Stiffness, backward_error: f64) -> Certainty {
        let condition = self.condition.get_or(|| {
            let found = self.estimate_condition(stiffness);
            match found.is_finite() || !self.take_double(stiffness) {
                true => found,
                false => self.estimate_condition(stiffness),
            }
        });
        Certainty::new(condition, backward_error)
    }

    /// Skeel's condition number by the factor as it is; infinite where refinement with a factor in
    /// single precision comes to a halt.
    fn estimate_condition(&self, stiffness: &Stiffness) -> f64 {
        let system = self.system(stiffness);
        let apply = |x: &[f64]| system.apply_k11(x);
        let weights = row_sums(stiffness, self.partition());
        let n = weights.len();
        self.with_kernel(|kernel| {
            if let Kernel::Multigrid(hierarchy) = kernel {
                let partition = self.partition();
                let solve =
                    |b: Vec<f64>, _| inverse_to_a_digit(stiffness, partition, hierarchy, &b);
                return inverse_norm(&weights, &solve);
            }
            inverse_norm(&weights, &|b, columns| {
                refinement::apply_inverse_for_certain(kernel, &apply, b, n, columns)
            })
        })
    }
}
