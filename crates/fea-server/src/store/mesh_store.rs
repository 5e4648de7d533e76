//! Models that an engine answers for: kept as they were uploaded, nothing is assembled here.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

use softgrasp_protocol::{ModelHash, UploadModel};

use crate::budget::Reservation;
use crate::lock::Lock;

/// Uploaded models by name, each with the memory that it counts for.
#[derive(Default)]
pub(crate) struct MeshStore {
    kept: Lock<BTreeMap<ModelHash, Entry>>,
}

struct Entry {
    model: Arc<UploadModel>,
    _reservation: Reservation,
    /// Number of sessions that hold it.
    holders: usize,
    last_used: Instant,
}

impl MeshStore {
    /// A kept model, which then counts as used.
    pub fn find(&self, hash: ModelHash) -> Option<Arc<UploadModel>> {
        self.kept.with(|kept| {
            let entry = kept.get_mut(&hash)?;
            entry.last_used = Instant::now();
            Some(Arc::clone(&entry.model))
        })
    }

    /// Keeps a model; `reservation` is the memory that it takes.
    pub fn keep(&self, hash: ModelHash, model: Arc<UploadModel>, reservation: Reservation) {
        let entry =
            Entry { model, _reservation: reservation, holders: 0, last_used: Instant::now() };
        let before = self.kept.with(|kept| kept.insert(hash, entry));
        // Given back outside the lock.
        drop(before);
    }

    /// Counts one more session that holds a model, if it is kept; returns whether it is.
    pub fn hold(&self, hash: ModelHash) -> bool {
        self.kept.with(|kept| match kept.get_mut(&hash) {
            Some(entry) => {
                entry.holders += 1;
                true
            }
            None => false,
        })
    }

    /// Counts one session less that holds a model.
    pub fn release(&self, hash: ModelHash) {
        self.kept.with(|kept| {
            if let Some(entry) = kept.get_mut(&hash) {
                entry.holders = entry.holders.saturating_sub(1);
                entry.last_used = Instant::now();
            }
        });
    }

    /// Forgets a model that no session holds.
    pub fn forget(&self, hash: ModelHash) {
        let gone = self.kept.with(|kept| match kept.get(&hash) {
            Some(entry) if entry.holders == 0 => kept.remove(&hash),
            _ => None,
        });
        drop(gone);
    }

    /// Forgets the models that no session has held and no request has used since `then`.
    pub fn forget_unused_since(&self, then: Instant) {
        let gone = self.kept.with(|kept| {
            let is_forgotten =
                |_: &ModelHash, entry: &mut Entry| entry.holders == 0 && entry.last_used < then;
            kept.extract_if(.., is_forgotten).collect::<Vec<_>>()
        });
        drop(gone);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::budget::Budget;
    use softgrasp_protocol::{ElementName, MeshData};

    #[test]
    fn a_model_is_kept_as_long_as_it_is_held_and_its_memory_comes_back() {
        let (store, budget) = (MeshStore::default(), Budget::new(100));
        let model = UploadModel {
            mesh: MeshData::default(),
            materials: Vec::new(),
            element: ElementName::T4,
            fixed: Vec::new(),
        };
        let hash = ModelHash::of(&model);
        assert!(!store.hold(hash));
        let reservation = budget.reservation();
        reservation.settle(40);
        store.keep(hash, Arc::new(model), reservation);
        assert!(store.hold(hash));
        store.forget(hash);
        store.forget_unused_since(Instant::now());
        assert!(store.find(hash).is_some());
        assert_eq!(budget.left_for_kept(), 60);
        store.release(hash);
        store.forget(hash);
        assert!(store.find(hash).is_none());
        assert_eq!(budget.left_for_kept(), 100);
    }
}
