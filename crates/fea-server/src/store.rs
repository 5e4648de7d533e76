//! Models kept between requests, and their factors, under one memory bound.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use softgrasp_core::model::Model;
use softgrasp_core::solve::{Factored, Method};
use softgrasp_protocol::ModelHash;

/// A model and the factors made for it.
pub(crate) struct StoredModel {
    pub model: Model,
    factors: Mutex<Vec<(Vec<u32>, Arc<Factored>)>>,
}

/// Factors kept per model; a grasp needs one, a change of grip a second.
const FACTORS_MAX: usize = 4;

impl StoredModel {
    pub fn new(model: Model) -> Self {
        Self { model, factors: Mutex::new(Vec::new()) }
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

    fn bytes(&self) -> u64 {
        let factors: usize = lock(&self.factors).iter().map(|(_, f)| f.bytes()).sum();
        (self.model.bytes() + factors) as u64
    }

    fn drop_factors(&self) {
        lock(&self.factors).clear();
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
        let mut kept = lock(&self.kept);
        let mut order: Vec<(u64, ModelHash)> =
            kept.models.iter().map(|(&hash, &(used, _))| (used, hash)).collect();
        order.sort_unstable();
        order.pop();
        for drop_model in [false, true] {
            for (_, hash) in &order {
                let total: u64 = kept.models.values().map(|(_, m)| m.bytes()).sum();
                if total <= self.memory_limit {
                    return;
                }
                match drop_model {
                    true => drop(kept.models.remove(hash)),
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

    fn stored() -> Arc<StoredModel> {
        let mesh = generate(BuiltIn::Cube, 64).unwrap();
        let material = Material::try_new(1.0e5, 0.3).unwrap();
        let model = Model::try_new(mesh, &[material], vec![], &mut |_| {}).unwrap();
        Arc::new(StoredModel::new(model))
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
