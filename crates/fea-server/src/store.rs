//! Models kept between requests, and their factors, under one memory bound.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use softgrasp_core::fem::StrainSummary;
use softgrasp_core::model::{Model, ModelError};
use softgrasp_core::solve::condensed::{Base, Columns, ContactSet, Touched};
use softgrasp_core::solve::{Factored, Method, Stage};
use softgrasp_protocol::ModelHash;

/// A model and what has been made for it.
pub(crate) struct StoredModel {
    pub model: Model,
    factors: Mutex<Vec<(Vec<u32>, Arc<Factored>)>>,
    base: Result<Arc<Base>, ModelError>,
    pub columns: Columns,
    /// Whether a factor in double precision was larger than allowed.
    pub single_only: SingleOnly,
    sets: Mutex<Vec<KeptSet>>,
    strain: Mutex<StrainWatch>,
}

/// Set once a factor in double precision was larger than allowed.
#[derive(Default)]
pub(crate) struct SingleOnly(AtomicBool);

impl SingleOnly {
    pub fn set(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    pub fn is_set(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Bytes that a model and what is made for it may take.
#[derive(Clone, Copy)]
pub(crate) struct Allowed {
    /// All of it.
    pub bytes: u64,
    /// Columns of the compliance.
    pub column_cache: u64,
}

/// A contact set with the rows of the nodes that answers are wanted for.
struct KeptSet {
    nodes: Vec<u32>,
    set: Arc<ContactSet>,
}

/// Strain of the newest frame it was worked out for; it is worked out beside the frames.
#[derive(Default)]
pub(crate) struct StrainWatch {
    pub newest: StrainSummary,
    pub running: bool,
}

/// Factors kept per model; a grasp needs one, a change of grip a second.
const FACTORS_MAX: usize = 4;
/// Contact sets kept per model.
const SETS_MAX: usize = 8;

impl StoredModel {
    /// A model with the base of the condensed engine, or the reason why it has none; columns get
    /// what the base leaves.
    pub fn new(model: Model, allowed: Allowed, on_stage: &mut dyn FnMut(Stage)) -> Self {
        let left = allowed.bytes.saturating_sub(model.bytes() as u64);
        let base = model.condense_within(left, on_stage).map(Arc::new);
        let base_bytes = base.as_ref().map_or(0, |base| base.bytes()) as u64;
        let column_bytes = allowed.column_cache.min(left.saturating_sub(base_bytes));
        Self {
            model,
            factors: Mutex::default(),
            base,
            columns: Columns::new(usize::try_from(column_bytes).unwrap_or(usize::MAX)),
            single_only: SingleOnly::default(),
            sets: Mutex::default(),
            strain: Mutex::default(),
        }
    }

    /// The base of the condensed engine, or why there is none.
    pub fn base(&self) -> Result<Arc<Base>, ModelError> {
        self.base.clone()
    }

    /// The base, if it has been made.
    pub fn ready_base(&self) -> Option<&Arc<Base>> {
        self.base.as_ref().ok()
    }

    /// A contact set with the rows of some nodes, if it is kept.
    pub fn set_for(&self, touched: &Touched, nodes: &[u32]) -> Option<Arc<ContactSet>> {
        let mut sets = lock(&self.sets);
        let is_it = |kept: &KeptSet| kept.set.touched() == touched && kept.nodes == nodes;
        let at = sets.iter().position(is_it)?;
        let kept = sets.remove(at);
        sets.push(kept);
        sets.last().map(|kept| Arc::clone(&kept.set))
    }

    /// Keeps a contact set; the one unused for longest goes when there are too many.
    pub fn keep_set(&self, nodes: Vec<u32>, set: Arc<ContactSet>) {
        let mut sets = lock(&self.sets);
        if sets.len() >= SETS_MAX {
            sets.remove(0);
        }
        sets.push(KeptSet { nodes, set });
    }

    /// Strain of the newest frame it is known for.
    pub fn strain(&self) -> MutexGuard<'_, StrainWatch> {
        lock(&self.strain)
    }

    /// Factor for a set of known degrees of freedom by a method, if it is kept.
    pub fn factor_for(&self, dofs: &[u32], method: Method) -> Option<Arc<Factored>> {
        let mut factors = lock(&self.factors);
        let at = factors.iter().position(|(d, f)| f.method() == method && d == dofs)?;
        // Last used comes last.
        let entry = factors.remove(at);
        factors.push(entry);
        factors.last().map(|(_, factor)| Arc::clone(factor))
    }

    /// Keeps a factor; the one unused for longest goes when there are too many.
    pub fn keep_factor(&self, dofs: Vec<u32>, factor: Arc<Factored>) {
        let mut factors = lock(&self.factors);
        if factors.len() >= FACTORS_MAX {
            factors.remove(0);
        }
        factors.push((dofs, factor));
    }

    /// Bytes of the model, the base and its columns: what cannot be dropped without the model.
    pub fn lasting_bytes(&self) -> u64 {
        let base = match &self.base {
            Ok(base) => base.bytes() + self.columns.bytes(base),
            Err(_) => 0,
        };
        (self.model.bytes() + base) as u64
    }

    fn bytes(&self) -> u64 {
        let factors: usize = lock(&self.factors).iter().map(|(_, f)| f.bytes()).sum();
        let sets: usize = lock(&self.sets).iter().map(|kept| kept.set.bytes()).sum();
        self.lasting_bytes() + (factors + sets) as u64
    }

    fn drop_factors(&self) {
        lock(&self.factors).clear();
        lock(&self.sets).clear();
    }
}

/// All models, least recently used first to go.
pub(crate) struct ModelStore {
    memory_limit: u64,
    kept: Mutex<Kept>,
}

#[derive(Default)]
struct Kept {
    models: BTreeMap<ModelHash, (u64, Arc<StoredModel>)>,
    uses: u64,
}

impl ModelStore {
    pub fn new(memory_limit: u64) -> Self {
        Self { memory_limit, kept: Mutex::default() }
    }

    /// A kept model; using it makes it the last to go.
    pub fn find(&self, hash: ModelHash) -> Option<Arc<StoredModel>> {
        let mut kept = lock(&self.kept);
        kept.uses += 1;
        let now = kept.uses;
        let (used, model) = kept.models.get_mut(&hash)?;
        *used = now;
        Some(Arc::clone(model))
    }

    /// Keeps a model.
    pub fn keep(&self, hash: ModelHash, model: Arc<StoredModel>) {
        let mut kept = lock(&self.kept);
        kept.uses += 1;
        let now = kept.uses;
        kept.models.insert(hash, (now, model));
        drop(kept);
        self.trim();
    }

    /// Forgets a model; sessions that are using it finish first.
    pub fn forget(&self, hash: ModelHash) {
        lock(&self.kept).models.remove(&hash);
    }

    /// Makes room until the bound holds: factors of the models unused for longest, then the
    /// models. The one used last always stays.
    pub fn trim(&self) {
        let kept = lock(&self.kept);
        let last = kept.models.iter().max_by_key(|(_, (used, _))| *used).map(|(&hash, _)| hash);
        Self::trim_to(kept, self.memory_limit, last, false);
    }

    /// Makes room for what is `promised` to requests under way, in the same order; nothing stays
    /// for certain but the model `keep`, of which the factors may go.
    pub fn make_room(&self, promised: u64, keep: Option<ModelHash>) {
        let bound = self.memory_limit.saturating_sub(promised);
        Self::trim_to(lock(&self.kept), bound, keep, true);
    }

    fn trim_to(
        mut kept: MutexGuard<'_, Kept>,
        bound: u64,
        keep: Option<ModelHash>,
        may_drop_its_factors: bool,
    ) {
        let mut order: Vec<(u64, ModelHash)> =
            kept.models.iter().map(|(&hash, &(used, _))| (used, hash)).collect();
        order.sort_unstable();
        for drop_model in [false, true] {
            for (_, hash) in &order {
                let total: u64 = kept.models.values().map(|(_, m)| m.bytes()).sum();
                if total <= bound {
                    return;
                }
                let is_kept = keep == Some(*hash);
                match drop_model {
                    true if is_kept => {}
                    true => drop(kept.models.remove(hash)),
                    false if is_kept && !may_drop_its_factors => {}
                    false => {
                        if let Some((_, model)) = kept.models.get(hash) {
                            model.drop_factors();
                        }
                    }
                }
            }
        }
    }
}

/// A lock that outlives a panic elsewhere: what it guards is replaced whole, never half.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;
    use softgrasp_core::fem::Material;
    use softgrasp_core::mesh::{BuiltIn, generate};
    use softgrasp_core::model::Element;

    fn stored() -> Arc<StoredModel> {
        let mesh = generate(BuiltIn::Cube, 64).unwrap();
        let material = Material::try_new(1.0e5, 0.3).unwrap();
        let model = Model::try_new(mesh, Element::Tet4, &[material], vec![], &mut |_| {}).unwrap();
        let allowed = Allowed { bytes: u64::MAX, column_cache: 1 << 20 };
        Arc::new(StoredModel::new(model, allowed, &mut |_| {}))
    }

    #[test]
    fn least_recently_used_model_goes_first() {
        let one = stored().bytes();
        let store = ModelStore::new(2 * one);
        let hash = |i: u8| ModelHash([i; 32]);
        store.keep(hash(1), stored());
        store.keep(hash(2), stored());
        assert!(store.find(hash(1)).is_some());
        store.keep(hash(3), stored());
        assert!(store.find(hash(2)).is_none());
        assert!(store.find(hash(1)).is_some() && store.find(hash(3)).is_some());
    }

    #[test]
    fn the_only_model_stays_even_over_the_bound() {
        let store = ModelStore::new(1);
        store.keep(ModelHash([1; 32]), stored());
        assert!(store.find(ModelHash([1; 32])).is_some());
    }
}
