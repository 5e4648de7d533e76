//! Makes a factor or inverse of `K11` within the memory there is.

use softgrasp_core::model::{Model, ModelError};
use softgrasp_core::solve::memory::Need;
use softgrasp_core::solve::{Factored, FrontMethod, Method, SolveError};

use crate::budget::Reservation;
use crate::clock::StageClock;
use crate::plan::{PlanError, Subject, admit, counted, shortage};
use crate::refusal::Refusal;
use crate::store::ModelStore;

/// What a factor is made for, and the memory it may take.
#[derive(Clone, Copy)]
pub(super) struct FactorRequest<'a> {
    pub models: &'a ModelStore,
    pub reservation: &'a Reservation,
    pub model: &'a Model,
    /// Known degrees of freedom, ascending.
    pub dofs: &'a [u32],
    pub subject: &'a Subject,
    /// Bytes that the model holds.
    pub held: u64,
}

impl FactorRequest<'_> {
    /// Factors `K11` by the first of some methods whose factor fits.
    ///
    /// # Errors
    /// [`PlanError::Memory`] where none fits; [`Refusal::Model`] where there is no factor.
    pub fn factor(&self, methods: &[Method], clock: &mut StageClock) -> Result<Factored, Refusal> {
        let fronts: Vec<FrontMethod> =
            methods.iter().copied().filter_map(FrontMethod::of).collect();
        if let [method] = *methods
            && fronts.is_empty()
        {
            return self.factor_without_fronts(method, clock);
        }
        let analysed = self.model.analyse(self.dofs, &mut |stage| clock.begin(stage))?;
        clock.end();
        let needs: Vec<Need> =
            fronts.iter().map(|&front| counted(self.model, self.held, &analysed, front)).collect();
        let admitted = self.admit(&needs)?;
        let front = fronts.into_iter().find(|&f| Method::from(f) == admitted.method);
        let front = front.unwrap_or(FrontMethod::Double);
        let stiffness = self.model.stiffness();
        match analysed.factor(stiffness, front, &mut |stage| clock.begin(stage)) {
            // Too hard for single precision, which was taken for its size: what is short is memory.
            Err(SolveError::NotPositiveDefinite { .. }) if Some(&admitted) != needs.first() => {
                Err(self.short_of(&needs[..1]))
            }
            factored => factored.map_err(|error| Refusal::Model(error.into())),
        }
    }

    /// Reserves memory for the first of some needs that fits.
    pub fn admit(&self, needs: &[Need]) -> Result<Need, Refusal> {
        admit(self.models, self.reservation, needs, self.subject)
            .map_err(|shortage| PlanError::Memory(shortage).into())
    }

    /// The same for a dense method, or for the sparse one whose count is its own.
    fn factor_without_fronts(
        &self,
        method: Method,
        clock: &mut StageClock,
    ) -> Result<Factored, Refusal> {
        let exact = |bytes| Need::exact(self.model.element(), method, self.held, bytes);
        let limit = match method.dense_bytes(self.subject.unknown_dofs) {
            Some(bytes) => {
                self.model.check_held(self.dofs, &[])?;
                self.admit(&[exact(bytes)])?.factor_bytes
            }
            None => self.reservation.free().saturating_sub(self.held),
        };
        let on_stage = &mut |stage| clock.begin(stage);
        match self.model.factor_within(self.dofs, method, limit, on_stage) {
            Err(ModelError::Solve(SolveError::OverLimit { needed, .. })) => {
                Err(self.short_of(&[exact(needed)]))
            }
            factored => Ok(factored?),
        }
    }

    fn short_of(&self, needs: &[Need]) -> Refusal {
        PlanError::Memory(shortage(self.reservation, needs, self.subject, None)).into()
    }
}

/// Why a method was taken, where its like in double precision was larger than allowed.
pub(super) fn because_of_memory(why: String, asked: Method, taken: Method) -> String {
    match asked == taken {
        true => why,
        false => format!(
            "{why}; {taken}, because the factor of {asked} is larger than the memory allowed"
        ),
    }
}
