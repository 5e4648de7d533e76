//! Memory for requests that are being received: reserved from the budget as their bytes come.

use std::sync::Arc;
use std::time::Duration;

use tokio::time::{Instant, timeout_at};

use crate::budget::Reservation;
use crate::no_room::NoRoom;
use crate::resources::Resources;

/// The memory that one session takes for the request that it receives.
pub(crate) struct Room {
    resources: Arc<Resources>,
    /// Memory reserved for the bytes of the next request that have come.
    reserved: Reservation,
}

/// Bytes that every session may hold without a reservation.
pub(crate) const OWN_BYTES: usize = 256 * 1024;
/// Longest time that a request waits for memory; its connection is not read meanwhile.
const WAIT_MAX: Duration = Duration::from_secs(5);

impl Room {
    /// Room of a session, with nothing reserved.
    pub fn new(resources: Arc<Resources>) -> Self {
        let reserved = resources.budget.reservation();
        Self { resources, reserved }
    }

    /// Checks that a request of `bytes` bytes can be received and read at all.
    ///
    /// # Errors
    /// [`NoRoom::Never`] if it would exceed the budget.
    pub fn check(&self, bytes: usize) -> Result<(), NoRoom> {
        let (bytes, limit) = (bytes as u64, self.reserved.limit());
        match bytes > OWN_BYTES as u64 && bytes.saturating_mul(2) > limit {
            true => Err(NoRoom::Never { bytes, limit }),
            false => Ok(()),
        }
    }

    /// Changes the reservation to `bytes`, for a request that will have `whole` bytes at its end. Waits
    /// for some seconds if others hold too much.
    ///
    /// May be dropped at any await.
    ///
    /// # Errors
    /// [`NoRoom::Now`] if no memory was freed in time.
    pub async fn grow(&self, bytes: usize, whole: usize) -> Result<(), NoRoom> {
        if bytes <= OWN_BYTES {
            return Ok(());
        }
        let until = Instant::now() + WAIT_MAX;
        loop {
            let freed = self.resources.budget.freed();
            // What is given back from here on is heard of.
            tokio::pin!(freed);
            freed.as_mut().enable();
            match self.try_grow(bytes, whole) {
                Ok(()) => return Ok(()),
                Err(no_room) => {
                    timeout_at(until, freed).await.map_err(|_| no_room)?;
                }
            }
        }
    }

    fn try_grow(&self, bytes: usize, whole: usize) -> Result<(), NoRoom> {
        if self.reserved.reserve(bytes as u64, 0) {
            self.resources.models.make_room(None);
            return Ok(());
        }
        let (limit, taken) = (self.reserved.limit(), self.reserved.of_others());
        Err(NoRoom::Now { bytes: whole as u64, limit, taken })
    }

    /// Reservation of a request that is complete, to go with it.
    pub fn hand_over(&mut self) -> Reservation {
        std::mem::replace(&mut self.reserved, self.resources.budget.reservation())
    }

    /// Gives back the reservation of a request whose remaining bytes are skipped.
    pub fn give_up(&self) {
        self.reserved.settle(0);
    }
}

/// Reserves the memory that decoding a request of `bytes` bytes takes: the bytes and the message.
///
/// # Errors
/// [`NoRoom::Now`] if others hold too much.
pub(crate) fn reserve_for_reading(received: &Reservation, bytes: usize) -> Result<(), NoRoom> {
    let bytes = bytes as u64;
    match bytes <= OWN_BYTES as u64 || received.reserve(2 * bytes, 0) {
        true => Ok(()),
        false => {
            let (limit, taken) = (received.limit(), received.of_others());
            Err(NoRoom::Now { bytes, limit, taken })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::ServerConfig;
    use crate::workers::Workers;

    fn resources(memory_limit: u64) -> Arc<Resources> {
        let config = ServerConfig { memory_limit, ..ServerConfig::default() };
        Arc::new(Resources::new(config, Workers::new(1, 1).unwrap()))
    }

    #[tokio::test(start_paused = true)]
    async fn bytes_that_are_received_count_and_wait_for_those_of_others() {
        let resources = resources(10 << 20);
        let [mut first, second] = [(); 2].map(|()| Room::new(Arc::clone(&resources)));
        first.grow(8 << 20, 8 << 20).await.unwrap();
        assert_eq!(resources.budget.left_for_kept(), 2 << 20);
        second.grow(OWN_BYTES, 8 << 20).await.expect("every session may hold so much");
        let refused = second.grow(4 << 20, 5 << 20).await;
        let taken = 8 << 20;
        assert_eq!(refused, Err(NoRoom::Now { bytes: 5 << 20, limit: 10 << 20, taken }));
        // It goes on as soon as the other's request has been read.
        let held = first.hand_over();
        let (grown, ()) = tokio::join!(second.grow(4 << 20, 5 << 20), async {
            tokio::time::sleep(WAIT_MAX / 2).await;
            drop(held);
        });
        assert_eq!(grown, Ok(()));
        second.give_up();
        assert_eq!(resources.budget.left_for_kept(), 10 << 20);
    }

    #[tokio::test(start_paused = true)]
    async fn request_that_can_never_be_read_is_refused_before_it_comes() {
        let room = Room::new(resources(10 << 20));
        assert_eq!(room.check(5 << 20), Ok(()));
        let (bytes, limit) = ((5 << 20) + 1, 10 << 20);
        assert_eq!(room.check(bytes), Err(NoRoom::Never { bytes: bytes as u64, limit }));
        let small = Room::new(resources(1));
        assert_eq!(small.check(OWN_BYTES), Ok(()), "a small one is told more by its own refusal");
    }
}
