//! `K11` ordered and analysed: work and memory of its factor are counted before it is made.

use std::sync::Arc;

use super::error::SolveError;
use super::kernel::Kernel;
use crate::fem::Stiffness;
use crate::solve::front::{FrontAnalysis, FrontError, FrontFactor};
use crate::solve::{Method, Partition, Stage};

/// The methods that factor over the tree of fronts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrontMethod {
    /// Double precision: [`Method::Front`].
    Double,
    /// Single precision, refined to rounding: [`Method::FrontMixed`].
    Mixed,
    /// Single precision as preconditioner, stopped where wanted: [`Method::Pcg`].
    Pcg,
}

impl From<FrontMethod> for Method {
    fn from(method: FrontMethod) -> Self {
        match method {
            FrontMethod::Double => Self::Front,
            FrontMethod::Mixed => Self::FrontMixed,
            FrontMethod::Pcg => Self::Pcg,
        }
    }
}

impl FrontMethod {
    /// The same method under its general name, the other way round; `None` for one without fronts.
    pub fn of(method: Method) -> Option<Self> {
        match method {
            Method::Front => Some(Self::Double),
            Method::FrontMixed => Some(Self::Mixed),
            Method::Pcg => Some(Self::Pcg),
            _ => None,
        }
    }
}

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

    /// Bytes held at most while a factor is made, the factor included.
    pub fn peak_bytes(&self, front: FrontMethod) -> u64 {
        (match front {
            FrontMethod::Double => self.analysis.peak_bytes::<f64>(),
            FrontMethod::Mixed | FrontMethod::Pcg => self.analysis.peak_bytes::<f32>(),
        }) as u64
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
    /// [`SolveError::NotPositiveDefinite`] with the node, [`SolveError::OutOfMemory`].
    pub(super) fn kernel(
        &self,
        stiffness: &Stiffness,
        front: FrontMethod,
        on_stage: &mut dyn FnMut(Stage),
    ) -> Result<Kernel, SolveError> {
        let Self { partition, analysis } = self;
        let method = Method::from(front);
        on_stage(Stage::Factor);
        let unknown_dofs = partition.unknown().len();
        let failed = |error| match error {
            FrontError::NotPositive { row } => SolveError::not_positive(method, partition, row),
            _ => SolveError::OutOfMemory { method, unknown_dofs },
        };
        Ok(match front {
            FrontMethod::Double => {
                Kernel::Front(FrontFactor::try_new(analysis, stiffness).map_err(failed)?)
            }
            FrontMethod::Mixed | FrontMethod::Pcg => {
                Kernel::FrontSingle(FrontFactor::try_new(analysis, stiffness).map_err(failed)?)
            }
        })
    }
}
