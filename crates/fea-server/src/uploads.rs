//! Uploads under way: the second upload of a mesh waits for the first and finds its model.

use std::collections::BTreeMap;
use std::sync::Arc;

use softgrasp_protocol::ModelHash;
use tokio::sync::{Mutex, OwnedMutexGuard};

use crate::lock::Lock;

/// For each model, the right to make it, which one upload has at a time.
#[derive(Clone, Default)]
pub(crate) struct Uploads(Arc<Lock<Turns>>);

type Turns = BTreeMap<ModelHash, Arc<Mutex<()>>>;

/// The right to make a model; passed on when dropped.
pub(crate) struct Turn {
    uploads: Uploads,
    model: ModelHash,
    _right: OwnedMutexGuard<()>,
}

impl Uploads {
    /// Waits, without a thread and without a lock, until no other upload makes this model.
    pub async fn turn(&self, model: ModelHash) -> Turn {
        let of_model = self.0.with(|turns| Arc::clone(turns.entry(model).or_default()));
        Turn { uploads: self.clone(), model, _right: of_model.lock_owned().await }
    }
}

impl Drop for Turn {
    fn drop(&mut self) {
        self.uploads.0.with(|turns| {
            // The map's own and this turn's: nobody waits.
            if turns.get(&self.model).is_some_and(|turn| Arc::strong_count(turn) <= 2) {
                turns.remove(&self.model);
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use std::pin::Pin;
    use std::task::{Context, Poll, Waker};

    use super::*;

    fn polled_once<T>(future: Pin<&mut impl Future<Output = T>>) -> Option<T> {
        match future.poll(&mut Context::from_waker(Waker::noop())) {
            Poll::Ready(value) => Some(value),
            Poll::Pending => None,
        }
    }

    #[tokio::test]
    async fn second_upload_of_a_model_waits_and_others_do_not() {
        let uploads = Uploads::default();
        let (one, other) = (ModelHash([1; 32]), ModelHash([2; 32]));
        let first = uploads.turn(one).await;
        let mut second = Box::pin(uploads.turn(one));
        assert!(polled_once(second.as_mut()).is_none());
        drop(uploads.turn(other).await);
        drop(first);
        drop(second.await);
        assert!(uploads.0.with(|turns| turns.is_empty()), "nothing is left behind");
    }
}
