//! All kept models: found by hash, held by sessions, dropped if memory is needed.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

use softgrasp_protocol::ModelHash;

use super::stored_model::StoredModel;
use crate::budget::{Budget, Reservation};
use crate::lock::Lock;

/// All kept models; those unused for longest are dropped first.
///
/// Invariant: after every change the models and what is kept for them take at most what the
/// reservations of requests under way leave of the budget. A model that alone is larger than that
/// stays only while nothing is reserved.
pub(crate) struct ModelStore {
    budget: Budget,
    kept: Lock<Kept>,
}

#[derive(Default)]
struct Kept {
    models: BTreeMap<ModelHash, Entry>,
    /// Number of sessions that have named a model and not dropped it, also for models that are not kept
    /// any more.
    holders: BTreeMap<ModelHash, usize>,
    uses: u64,
}

struct Entry {
    last_use: u64,
    last_used: Instant,
    stored: Arc<StoredModel>,
}

impl ModelStore {
    /// Empty store within a budget.
    pub fn new(budget: Budget) -> Self {
        Self { budget, kept: Lock::default() }
    }

    /// A kept model, which then counts as used last.
    pub fn find(&self, hash: ModelHash) -> Option<Arc<StoredModel>> {
        self.kept.with(|kept| {
            kept.uses += 1;
            let now = kept.uses;
            let entry = kept.models.get_mut(&hash)?;
            entry.last_use = now;
            entry.last_used = Instant::now();
            Some(Arc::clone(&entry.stored))
        })
    }

    /// Keeps a model; its memory takes the place of the request's reservation.
    pub fn keep(&self, hash: ModelHash, stored: Arc<StoredModel>, reservation: Reservation) {
        self.kept.with(|kept| {
            kept.uses += 1;
            let last_use = kept.uses;
            kept.models.insert(hash, Entry { last_use, last_used: Instant::now(), stored });
            drop(reservation);
        });
        self.trim();
    }

    /// Counts one more session that holds a model, if it is kept; returns whether it is.
    pub fn hold(&self, hash: ModelHash) -> bool {
        self.kept.with(|kept| {
            let is_kept = kept.models.contains_key(&hash);
            if is_kept {
                *kept.holders.entry(hash).or_default() += 1;
            }
            is_kept
        })
    }

    /// Counts one session less that holds a model; the model stays until memory is needed.
    pub fn release(&self, hash: ModelHash) {
        self.kept.with(|kept| {
            if let Some(holders) = kept.holders.get_mut(&hash) {
                *holders -= 1;
                if *holders == 0 {
                    kept.holders.remove(&hash);
                    // Nobody has it from now on.
                    if let Some(entry) = kept.models.get_mut(&hash) {
                        entry.last_used = Instant::now();
                    }
                }
            }
        });
    }

    /// Forgets the models that no session has held and no request has used since `then`.
    pub fn forget_unused_since(&self, then: Instant) {
        let forgotten = self.kept.with(|kept| {
            let Kept { models, holders, .. } = kept;
            let is_forgotten = |hash: &ModelHash, entry: &mut Entry| {
                !holders.contains_key(hash) && entry.last_used < then
            };
            models.extract_if(.., is_forgotten).map(|(_, entry)| entry.stored).collect::<Vec<_>>()
        });
        // What they hold is given back outside the lock.
        if !forgotten.is_empty() {
            tracing::info!(models = forgotten.len(), "unused models are forgotten");
        }
    }

    /// Number of kept models, and bytes of all that is kept for them.
    pub fn count_and_bytes(&self) -> (usize, u64) {
        self.kept.with(|kept| (kept.models.len(), kept.bytes()))
    }

    /// Forgets a model that no session holds; requests that use it finish first.
    pub fn forget(&self, hash: ModelHash) {
        self.kept.with(|kept| {
            if !kept.holders.contains_key(&hash) {
                kept.models.remove(&hash);
            }
        });
    }

    /// Drops what is unused for longest until the invariant holds.
    pub fn trim(&self) {
        self.kept.with(|kept| {
            let last = kept.models.iter().max_by_key(|(_, entry)| entry.last_use);
            let last = last.map(|(hash, _)| *hash);
            kept.trim_to(self.budget.left_for_kept(), last);
            if self.budget.left_for_kept() < self.budget.limit() {
                kept.trim_to(self.budget.left_for_kept(), None);
            }
        });
    }

    /// Drops what a new reservation needs room for; only the model `keep` is sure to stay.
    pub fn make_room(&self, keep: Option<ModelHash>) {
        self.kept.with(|kept| kept.trim_to(self.budget.left_for_kept(), keep));
    }
}

impl Kept {
    /// Drops factors and contact sets of other models, their columns, the other models, and at last what
    /// can be made again for the model `keep`, until at most `bound` bytes are left.
    fn trim_to(&mut self, bound: u64, keep: Option<ModelHash>) {
        let mut order: Vec<(u64, ModelHash)> =
            self.models.iter().map(|(&hash, entry)| (entry.last_use, hash)).collect();
        order.sort_unstable();
        let others = || order.iter().map(|(_, hash)| *hash).filter(|hash| keep != Some(*hash));
        let kept = || keep.into_iter();
        for hash in others() {
            self.drop_until(bound, hash, StoredModel::drop_factors_and_sets);
        }
        for hash in others() {
            self.drop_until(bound, hash, StoredModel::drop_columns);
        }
        for hash in others() {
            if self.bytes() <= bound {
                return;
            }
            self.models.remove(&hash);
        }
        for hash in kept() {
            self.drop_until(bound, hash, StoredModel::drop_factors_and_sets);
            self.drop_until(bound, hash, StoredModel::drop_columns);
        }
    }

    fn drop_until(&self, bound: u64, hash: ModelHash, drop_some: fn(&StoredModel)) {
        if self.bytes() > bound
            && let Some(entry) = self.models.get(&hash)
        {
            drop_some(&entry.stored);
        }
    }

    fn bytes(&self) -> u64 {
        self.models.values().map(|entry| entry.stored.bytes()).sum()
    }
}

#[cfg(test)]
mod tests {
    use softgrasp_core::fem::Material;
    use softgrasp_core::mesh::{BuiltIn, generate};
    use softgrasp_core::model::{Element, Model};
    use softgrasp_core::solve::condensed::Contact;

    use super::super::stored_model::Allowed;
    use super::*;

    fn stored() -> Arc<StoredModel> {
        let mesh = generate(BuiltIn::Cube, 64).unwrap();
        let material = Material::try_new(1.0e5, 0.3).unwrap();
        let model = Model::try_new(mesh, Element::Tet4, &[material], vec![], &mut |_| {}).unwrap();
        let allowed = Allowed { bytes: u64::MAX, column_cache: 1 << 20 };
        Arc::new(StoredModel::new(model, allowed, &mut |_| {}))
    }

    fn hash(i: u8) -> ModelHash {
        ModelHash([i; 32])
    }

    fn keep(store: &ModelStore, i: u8) -> Arc<StoredModel> {
        let stored = stored();
        store.keep(hash(i), Arc::clone(&stored), store.budget.reservation());
        stored
    }

    fn touch(stored: &StoredModel, node: u32) {
        let base = stored.base().unwrap();
        stored.columns.of_contacts(&base, &[Contact::Node(node)]).unwrap();
    }

    #[test]
    fn least_recently_used_model_goes_first() {
        let store = ModelStore::new(Budget::new(2 * stored().bytes()));
        keep(&store, 1);
        keep(&store, 2);
        assert!(store.find(hash(1)).is_some());
        keep(&store, 3);
        assert!(store.find(hash(2)).is_none());
        assert!(store.find(hash(1)).is_some() && store.find(hash(3)).is_some());
    }

    #[test]
    fn the_only_model_stays_even_over_the_bound() {
        let store = ModelStore::new(Budget::new(1));
        keep(&store, 1);
        assert!(store.find(hash(1)).is_some());
    }

    #[test]
    fn memory_limit_holds_for_kept_plus_reserved_memory() {
        let one = stored().bytes();
        let budget = Budget::new(3 * one);
        let store = ModelStore::new(budget.clone());
        let models = [keep(&store, 1), keep(&store, 2)];
        let under_way = budget.reservation();
        assert!(under_way.reserve(one, 0), "a request of another session");
        store.make_room(None);
        assert!(store.find(hash(1)).is_some() && store.find(hash(2)).is_some(), "all fits");
        // The models grow while the request is under way.
        for node in 0..20 {
            for stored in &models {
                touch(stored, node);
                store.trim();
                let kept = store.kept.with(|kept| kept.bytes());
                assert!(kept + one <= budget.limit(), "{kept} kept and {one} reserved");
            }
        }
        drop(under_way);
        touch(&models[1], 3);
        store.trim();
        assert!(store.find(hash(2)).is_some());
    }

    #[test]
    fn model_that_no_session_holds_is_forgotten_when_its_time_is_over() {
        let store = ModelStore::new(Budget::new(u64::MAX));
        keep(&store, 1);
        keep(&store, 2);
        let kept_until = Instant::now();
        assert!(store.hold(hash(1)));
        store.forget_unused_since(kept_until);
        assert!(store.find(hash(2)).is_none(), "nobody held it");
        assert_eq!(store.count_and_bytes().0, 1);
        store.forget_unused_since(Instant::now());
        assert!(store.hold(hash(1)), "it is held");
        store.release(hash(1));
        store.forget_unused_since(kept_until);
        store.release(hash(1));
        assert!(store.find(hash(1)).is_some(), "its time begins when the last one lets go");
        store.forget_unused_since(Instant::now());
        assert!(store.find(hash(1)).is_none());
    }

    #[test]
    fn model_held_by_another_session_is_not_forgotten() {
        let store = ModelStore::new(Budget::new(u64::MAX));
        keep(&store, 1);
        assert!(store.hold(hash(1)) && store.hold(hash(1)) && !store.hold(hash(2)));
        store.release(hash(1));
        store.forget(hash(1));
        assert!(store.find(hash(1)).is_some(), "the other session holds it");
        store.release(hash(1));
        store.forget(hash(1));
        assert!(store.find(hash(1)).is_none());
    }
}
