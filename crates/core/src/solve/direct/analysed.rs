//! `K11` ordered and analysed: work and memory of its factor are counted before it is made.

use std::sync::Arc;

use super::error::SolveError;
use super::kernel::Kernel;
use crate::fem::Stiffness;
use crate::solve::front::{FrontAnalysis, FrontError, FrontFactor};
use crate::solve::{Method, Partition, Stage};

/// `K11` of one partition, ordered and analysed but not factored yet: what a factor will cost is
/// known, so a precision can be chosen by it.
///
/// Source: thesis (3.41).
#[derive(Clone)]
pub struct Analysed {
    partition: Partition,
    analysis: Arc<FrontAnalysis>,
}

impl Analysed {
    /// Orders and analyses `K11`; `on_stage` hears [`Stage::Order`].
    pub fn new(
        stiffness: &Stiffness,
        partition: Partition,
        on_stage: &mut dyn FnMut(Stage),
    ) -> Self {
        on_stage(Stage::Order);
        let analysis = Arc::new(FrontAnalysis::new(stiffness, &partition));
        Self { partition, analysis }
    }

    /// Operations, entries and memory of a factor.
    pub fn analysis(&self) -> &Arc<FrontAnalysis> {
        &self.analysis
    }

    /// Bytes held at most while the factor of a method over fronts is made, the factor included.
    pub fn peak_bytes(&self, method: Method) -> u64 {
        self.analysis.peak_bytes_of(method) as u64
    }

    /// The partition that was analysed.
    pub(super) fn into_partition(self) -> Partition {
        self.partition
    }

    /// The factor on the current rayon pool; `on_stage` hears [`Stage::Factor`].
    ///
    /// `stiffness` must be the one this was analysed from.
    ///
    /// # Errors
    /// [`SolveError::NotPositiveDefinite`] with the node, [`SolveError::OutOfMemory`],
    /// [`SolveError::NoSuchFactor`] for a method without fronts.
    pub(super) fn kernel(
        &self,
        stiffness: &Stiffness,
        method: Method,
        on_stage: &mut dyn FnMut(Stage),
    ) -> Result<Kernel, SolveError> {
        let Self { partition, analysis } = self;
        if !method.has_fronts() {
            return Err(SolveError::NoSuchFactor { method });
        }
        on_stage(Stage::Factor);
        let unknown_dofs = partition.unknown().len();
        let failed = |error| match error {
            FrontError::NotPositive { row } => SolveError::not_positive(method, partition, row),
            _ => SolveError::OutOfMemory { method, unknown_dofs },
        };
        Ok(match method.is_single() {
            false => Kernel::Front(FrontFactor::try_new(analysis, stiffness).map_err(failed)?),
            true => Kernel::FrontSingle(FrontFactor::try_new(analysis, stiffness).map_err(failed)?),
        })
    }
}
