//! Makes a factor or inverse of `K11` within the memory there is.

use softgrasp_core::model::{Model, ModelError};
use softgrasp_core::solve::memory::{Need, hierarchy_bytes};
use softgrasp_core::solve::{Analysed, Factored, Method, SolveError};

use crate::budget::Reservation;
use crate::clock::StageClock;
use crate::plan::{PlanError, Subject, admit, counted, shortage};
use crate::refusal::Refusal;
use crate::store::ModelStore;

/// Bytes above which a factor takes so long that reading the machine's free memory first costs little.
const LARGE_BYTES: u64 = 16 << 20;

/// Model and known degrees of freedom that a factor is made for, and the memory it may take.
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
    /// Factors `K11` by the first of `methods` whose factor fits in memory; methods over fronts come
    /// first.
    ///
    /// # Errors
    /// [`PlanError::Memory`] if none fits; [`Refusal::Model`] if `K11` has no factor.
    pub fn factor(&self, methods: &[Method], clock: &mut StageClock) -> Result<Factored, Refusal> {
        if let [method] = *methods
            && !method.has_fronts()
        {
            return self.factor_without_fronts(method, clock);
        }
        let (fronts, others): (Vec<_>, Vec<_>) = methods.iter().partition(|m| m.has_fronts());
        let by_fronts = match self.is_hopeless(&fronts) && !others.is_empty() {
            // Ordering would take time and memory for nothing.
            true => Err(self.short_of(&self.subject.predict(self.model.element(), methods))),
            false => self
                .analyse(clock)
                .and_then(|analysed| self.factor_analysed(analysed, &fronts, clock)),
        };
        match (by_fronts, others.first()) {
            (Err(Refusal::Plan(PlanError::Memory(short))), Some(&method)) => {
                let made = self.factor_without_fronts(method, clock);
                let is_short = matches!(&made, Err(Refusal::Plan(PlanError::Memory(_))));
                // What is short is told of the more exact methods.
                if is_short {
                    return Err(Refusal::Plan(PlanError::Memory(short)));
                }
                made
            }
            (by_fronts, _) => by_fronts,
        }
    }

    /// Whether even the smallest factor of each method needs more memory than there is.
    fn is_hopeless(&self, methods: &[Method]) -> bool {
        let needs = self.subject.predict(self.model.element(), methods);
        let free = self.reservation.free().saturating_sub(self.held);
        needs.iter().all(|need| need.factor_bytes_min > free)
    }

    /// Orders and analyses `K11`, after which the memory of a factor over fronts is known.
    pub fn analyse(&self, clock: &mut StageClock) -> Result<Analysed, Refusal> {
        let analysed = self.model.analyse(self.dofs, &mut |stage| clock.begin(stage))?;
        clock.end();
        Ok(analysed)
    }

    /// Memory that the factor of a method over fronts needs.
    pub fn need(&self, analysed: &Analysed, method: Method) -> Need {
        counted(self.model, self.held, analysed, method)
    }

    /// Factors the analysed `K11` by the first of `methods` (all over fronts) whose factor fits in
    /// memory.
    ///
    /// # Errors
    /// The same as those of [`FactorRequest::factor`].
    pub fn factor_analysed(
        &self,
        analysed: Analysed,
        methods: &[Method],
        clock: &mut StageClock,
    ) -> Result<Factored, Refusal> {
        let fronts = methods.iter().copied().filter(|method| method.has_fronts());
        let needs: Vec<Need> = fronts.map(|method| self.need(&analysed, method)).collect();
        let admitted = self.admit(&needs)?;
        let limit = self.limit_with_fallback(&analysed, &admitted);
        if admitted.factor_bytes > LARGE_BYTES {
            // What assembly and order have freed lies in holes that the factor does not fit into.
            softgrasp_os::give_back_freed_memory();
        }
        let (stiffness, method) = (self.model.stiffness(), admitted.method);
        match Factored::of_analysed(analysed, stiffness, method.within(limit), &mut |s| {
            clock.begin(s)
        }) {
            // Too hard for single precision, which was taken for its size: what is short is memory.
            Err(SolveError::NotPositiveDefinite { .. }) if Some(&admitted) != needs.first() => {
                Err(self.short_of(&needs[..1]))
            }
            factored => factored.map_err(|error| Refusal::Model(error.into())),
        }
    }

    /// Bytes that a factor may take. Where single precision is admitted and memory suffices for a factor
    /// in double precision beside it, both are reserved, in case single precision does not suffice.
    fn limit_with_fallback(&self, analysed: &Analysed, admitted: &Need) -> u64 {
        if !admitted.method.is_single() {
            return u64::MAX;
        }
        let double = self.need(analysed, Method::Front);
        let both = admitted.factor_bytes.saturating_add(double.factor_bytes);
        let (own, held) = match self.subject.kept {
            None => (both.saturating_add(admitted.model_bytes), 0),
            Some(_) => (both, admitted.model_bytes),
        };
        match self.reservation.reserve(own, held) {
            true => {
                self.models.make_room(self.subject.kept);
                both
            }
            false => admitted.factor_bytes,
        }
    }

    /// Reserves memory for the first of some needs that fits, and returns this need.
    fn admit(&self, needs: &[Need]) -> Result<Need, Refusal> {
        admit(self.models, self.reservation, needs, self.subject)
            .map_err(|shortage| PlanError::Memory(shortage).into())
    }

    /// Factors by a dense method, by the one without a factor, or by the sparse one that counts its own
    /// memory.
    fn factor_without_fronts(
        &self,
        method: Method,
        clock: &mut StageClock,
    ) -> Result<Factored, Refusal> {
        let exact = |bytes| Need::exact(self.model.element(), method, self.held, bytes);
        let blocks = self.model.stiffness().pattern().block_count();
        let bytes = match method {
            Method::Multigrid => {
                Some(hierarchy_bytes(self.model.system_node_count(), blocks) as u64)
            }
            _ => method.dense_bytes(self.subject.unknown_dofs),
        };
        let limit = match bytes {
            Some(bytes) => {
                self.model.check_held(self.dofs, &[])?;
                self.admit(&[exact(bytes)])?.factor_bytes
            }
            None => self.reservation.free().saturating_sub(self.held),
        };
        let on_stage = &mut |stage| clock.begin(stage);
        match self.model.factor(self.dofs, method.within(limit), on_stage) {
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

/// Reason of the plan, with a clause if the method in double precision needed more memory than allowed.
pub(super) fn because_of_memory(why: String, asked: Method, taken: Method) -> String {
    match asked == taken {
        true => why,
        false => format!(
            "{why}; {taken}, because the factor of {asked} is larger than the memory allowed"
        ),
    }
}
