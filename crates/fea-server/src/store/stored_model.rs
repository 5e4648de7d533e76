//! A kept model and what has been made for it: factors, base, columns, contact sets, strain.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use softgrasp_core::fem::StrainSummary;
use softgrasp_core::model::{Model, ModelError};
use softgrasp_core::solve::condensed::{
    Base, Columns, CondensedError, ContactSet, FreeBody, LoadedSet, Touched,
};
use softgrasp_core::solve::{Factored, Method, Stage};

use super::kept_loads::{FrameLoads, KeptLoads, UnitKey};
use super::recent::Recent;
use crate::lock::Lock;

/// A model with its factors, base, columns and contact sets.
pub(crate) struct StoredModel {
    pub model: Model,
    factors: Lock<Recent<KeptFactor>>,
    base: Result<Arc<Base>, ModelError>,
    pub columns: Columns,
    /// The model as a free body, once a contact frame has asked for it.
    free_body: Lock<Option<Arc<FreeBody>>>,
    /// Whether a factor in double precision needed more memory than allowed.
    pub single_only: AtomicBool,
    sets: Lock<Recent<KeptSet>>,
    loads: KeptLoads,
    strain: Lock<Option<KeptStrain>>,
    /// Held by the thread that computes the strain of an answer.
    pub strain_under_way: Claim,
    /// Held by the thread that proves the bound of the smallest eigenvalue.
    pub proof_under_way: Claim,
}

/// Right to do something that only one thread at a time does; other threads do not wait for it.
#[derive(Default)]
pub(crate) struct Claim(Arc<AtomicBool>);

/// Held claim; given back when dropped, also after a panic.
pub(crate) struct Claimed(Arc<AtomicBool>);

impl Claim {
    /// Takes the claim; `None` if another thread holds it.
    pub fn take(&self) -> Option<Claimed> {
        (!self.0.swap(true, Ordering::Acquire)).then(|| Claimed(Arc::clone(&self.0)))
    }
}

impl Drop for Claimed {
    fn drop(&mut self) {
        self.0.store(false, Ordering::Release);
    }
}

/// Memory that a model and what is made for it may take.
#[derive(Clone, Copy)]
pub(crate) struct Allowed {
    /// Memory for everything, bytes.
    pub bytes: u64,
    /// Part of it for columns of the compliance, bytes.
    pub column_cache: u64,
}

/// Factor for a set of known degrees of freedom.
struct KeptFactor {
    dofs: Vec<u32>,
    factored: Arc<Factored>,
}

/// Contact set with the rows of the wanted nodes.
struct KeptSet {
    nodes: Vec<u32>,
    set: Arc<ContactSet>,
}

/// Strain of one answer, with the question that it belongs to.
struct KeptStrain {
    asked: Asked,
    strain: StrainSummary,
}

/// Contacts, their displacements and the loads of one question.
#[derive(Clone, PartialEq)]
pub(crate) struct Asked {
    pub touched: Touched,
    pub q: Vec<f64>,
    pub loads: Option<FrameLoads>,
}

/// Largest number of factors kept for each model: one for a grasp, a second for a change of grip.
const FACTORS_MAX: usize = 4;
/// Largest number of contact sets kept for each model.
const SETS_MAX: usize = 8;

impl StoredModel {
    /// Model with the base of `condensed`, or the reason why it has none; columns may take what the base
    /// leaves.
    pub fn new(model: Model, allowed: Allowed, on_stage: &mut dyn FnMut(Stage)) -> Self {
        let left = allowed.bytes.saturating_sub(model.bytes() as u64);
        let base = model.condense(Some(left), on_stage).map(Arc::new);
        let base_bytes = base.as_ref().map_or(0, |base| base.bytes()) as u64;
        let column_bytes = allowed.column_cache.min(left.saturating_sub(base_bytes));
        Self {
            model,
            factors: Lock::default(),
            base,
            columns: Columns::new(usize::try_from(column_bytes).unwrap_or(usize::MAX)),
            free_body: Lock::default(),
            single_only: AtomicBool::default(),
            sets: Lock::default(),
            loads: KeptLoads::default(),
            strain: Lock::default(),
            strain_under_way: Claim::default(),
            proof_under_way: Claim::default(),
        }
    }

    /// Base of `condensed`, or the reason why there is none.
    pub fn base(&self) -> Result<Arc<Base>, ModelError> {
        self.base.clone()
    }

    /// Whether the free body has been made.
    pub fn has_free_body(&self) -> bool {
        self.free_body.with(|kept| kept.is_some())
    }

    /// The model as a free body, made now if no contact frame has asked for it before. Two threads may
    /// both make it, with the same bits; neither waits for the other.
    ///
    /// # Errors
    /// [`CondensedError`] if the body has fixed nodes, or parts that move on their own.
    pub fn free_body(&self, base: &Base) -> Result<Arc<FreeBody>, CondensedError> {
        if let Some(kept) = self.free_body.with(|kept| kept.clone()) {
            return Ok(kept);
        }
        let made = Arc::new(FreeBody::try_new(self.model.spread_loads(), base)?);
        Ok(self.free_body.with(|kept| Arc::clone(kept.get_or_insert(made))))
    }

    /// Contact set with the rows of the wanted nodes, if it is kept.
    pub fn set_for(&self, touched: &Touched, nodes: &[u32]) -> Option<Arc<ContactSet>> {
        let is_it = |kept: &KeptSet| kept.set.touched() == touched && kept.nodes == nodes;
        self.sets.with(|sets| sets.find(is_it).map(|kept| Arc::clone(&kept.set)))
    }

    /// Keeps a contact set; drops the one unused for longest if there are too many.
    pub fn keep_set(&self, nodes: Vec<u32>, set: Arc<ContactSet>) {
        self.sets.with(|sets| {
            // Two frames at once may have made the same set.
            sets.retain(|kept| kept.set.touched() != set.touched() || kept.nodes != nodes);
            sets.push(KeptSet { nodes, set });
            sets.shorten(SETS_MAX);
        });
    }

    /// Contact set with loads beside it, if it is kept.
    pub fn loaded_set_for(
        &self,
        set: &Arc<ContactSet>,
        units: &[UnitKey],
    ) -> Option<Arc<LoadedSet>> {
        self.loads.set_for(set, units)
    }

    /// Contact set with loads beside it, made now and kept.
    ///
    /// # Errors
    /// [`ModelError`] for a load that does not fit the model.
    pub fn make_loaded_set(
        &self,
        base: &Base,
        set: &Arc<ContactSet>,
        units: &[UnitKey],
    ) -> Result<Arc<LoadedSet>, ModelError> {
        self.loads.make_set((&self.model, base, &self.columns), set, units)
    }

    /// Strain of an earlier answer to the same question, if it is kept.
    pub fn strain_of(&self, asked: &Asked) -> Option<StrainSummary> {
        let is_it = |kept: &&KeptStrain| kept.asked == *asked;
        self.strain.with(|kept| kept.as_ref().filter(is_it).map(|kept| kept.strain))
    }

    /// Keeps the strain of an answer.
    pub fn keep_strain(&self, asked: Asked, strain: StrainSummary) {
        self.strain.with(|kept| *kept = Some(KeptStrain { asked, strain }));
    }

    /// Factor by a method for a set of known degrees of freedom, if it is kept.
    pub fn factor_for(&self, dofs: &[u32], method: Method) -> Option<Arc<Factored>> {
        let is_it = |kept: &KeptFactor| kept.factored.method() == method && kept.dofs == dofs;
        self.factors.with(|factors| factors.find(is_it).map(|kept| Arc::clone(&kept.factored)))
    }

    /// Keeps a factor; drops the one unused for longest if there are too many.
    pub fn keep_factor(&self, dofs: Vec<u32>, factored: Arc<Factored>) {
        self.factors.with(|factors| {
            let method = factored.method();
            factors.retain(|kept| kept.factored.method() != method || kept.dofs != dofs);
            factors.push(KeptFactor { dofs, factored });
            factors.shorten(FACTORS_MAX);
        });
    }

    /// Bytes of the model and its base, which stay as long as the model.
    pub fn lasting_bytes(&self) -> u64 {
        let base = self.base.as_ref().map_or(0, |base| base.bytes());
        (self.model.bytes() + base) as u64
    }

    /// Bytes of all that is kept for the model.
    pub fn bytes(&self) -> u64 {
        let columns = self.base.as_ref().map_or(0, |base| self.columns.bytes(base));
        let factors: usize =
            self.factors.with(|factors| factors.iter().map(|kept| kept.factored.bytes()).sum());
        let sets: usize = self.sets.with(|sets| sets.iter().map(|kept| kept.set.bytes()).sum());
        let free = self.free_body.with(|kept| kept.as_ref().map_or(0, |body| body.bytes()));
        self.lasting_bytes() + (free + columns + factors + sets + self.loads.bytes()) as u64
    }

    /// Drops factors and contact sets, which can be made again.
    pub fn drop_factors_and_sets(&self) {
        self.factors.with(Recent::clear);
        self.sets.with(Recent::clear);
        self.loads.drop_sets();
    }

    /// Drops the columns of contacts and loads, which can be made again.
    pub fn drop_columns(&self) {
        self.columns.clear();
        self.loads.drop_columns();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn claim_is_given_back_after_a_panic() {
        let claim = Claim::default();
        let broken = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            let _claimed = claim.take().unwrap();
            assert!(claim.take().is_none(), "claimed once");
            panic!("a fault");
        }));
        assert!(broken.is_err() && claim.take().is_some());
    }
}
