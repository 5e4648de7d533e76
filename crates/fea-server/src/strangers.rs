//! Connections that have not introduced themselves: a largest number, and the oldest one is closed first.
//!
//! They have room of their own, so that silent connections take no session's place. Every new connection
//! is accepted; without room for it, the oldest connection of the owner that has most of them is closed.

use std::collections::BTreeMap;
use std::net::IpAddr;
use std::sync::Arc;

use tokio::sync::Notify;

use crate::lock::Lock;
use crate::origin::Origin;

/// Room for connections that have not introduced themselves.
#[derive(Clone)]
pub(crate) struct Strangers {
    there: Arc<Lock<There>>,
    max: usize,
}

/// Invariant: `of_origin` holds the number of those in `by_arrival` for every origin among them.
#[derive(Default)]
struct There {
    arrived: u64,
    by_arrival: BTreeMap<u64, Stranger>,
    of_origin: BTreeMap<Origin, usize>,
}

struct Stranger {
    origin: Origin,
    is_to_go: Arc<Notify>,
}

/// Room of one connection; given back when dropped.
pub(crate) struct Guest {
    strangers: Strangers,
    arrival: u64,
    is_to_go: Arc<Notify>,
}

impl Strangers {
    /// Room for `max` connections.
    pub fn new(max: usize) -> Self {
        Self { there: Arc::default(), max }
    }

    /// Gives a new connection room; without room, the oldest one of the owner that has most is to be
    /// closed.
    pub fn let_in(&self, address: IpAddr) -> Guest {
        let origin = Origin::of(address);
        let is_to_go = Arc::new(Notify::new());
        let arrival = self.there.with(|there| {
            while there.by_arrival.len() >= self.max && there.send_away() {}
            there.arrived += 1;
            let stranger = Stranger { origin, is_to_go: Arc::clone(&is_to_go) };
            there.by_arrival.insert(there.arrived, stranger);
            *there.of_origin.entry(origin).or_default() += 1;
            there.arrived
        });
        Guest { strangers: self.clone(), arrival, is_to_go }
    }

    /// Has one connection closed, as if another one needed its room; returns whether there was one.
    pub fn send_one_away(&self) -> bool {
        self.there.with(There::send_away)
    }

    /// Number of connections that have room now.
    pub fn count(&self) -> usize {
        self.there.with(|there| there.by_arrival.len())
    }
}

impl There {
    fn send_away(&mut self) -> bool {
        let Some(most) = self.of_origin.iter().max_by_key(|(_, count)| **count) else {
            return false;
        };
        let most = *most.0;
        let oldest = self.by_arrival.iter().find(|(_, stranger)| stranger.origin == most);
        let Some(stranger) = oldest.map(|(arrival, _)| *arrival).and_then(|a| self.leave(a)) else {
            return false;
        };
        stranger.is_to_go.notify_one();
        true
    }

    fn leave(&mut self, arrival: u64) -> Option<Stranger> {
        let stranger = self.by_arrival.remove(&arrival)?;
        if let Some(count) = self.of_origin.get_mut(&stranger.origin) {
            *count -= 1;
            if *count == 0 {
                self.of_origin.remove(&stranger.origin);
            }
        }
        Some(stranger)
    }
}

impl Guest {
    /// Ends when another connection needs the room. May be dropped at any await.
    pub async fn is_to_go(&self) {
        self.is_to_go.notified().await;
        // Whoever asks again hears the same.
        self.is_to_go.notify_one();
    }
}

impl Drop for Guest {
    fn drop(&mut self) {
        self.strangers.there.with(|there| there.leave(self.arrival));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn address(last: u8) -> IpAddr {
        [10, 0, 0, last].into()
    }

    async fn is_to_go(guest: &Guest) -> bool {
        tokio::select! { biased; () = guest.is_to_go() => true, () = std::future::ready(()) => false }
    }

    #[tokio::test]
    async fn oldest_of_the_origin_that_has_most_goes_and_the_one_that_has_few_stays() {
        let strangers = Strangers::new(4);
        let alone = strangers.let_in(address(9));
        let first = strangers.let_in(address(1));
        let crowd: Vec<Guest> = (0..20).map(|_| strangers.let_in(address(1))).collect();
        assert_eq!(strangers.count(), 4);
        assert!(!is_to_go(&alone).await, "it is the oldest, but has company of its own only");
        assert!(is_to_go(&first).await);
        assert!(is_to_go(&first).await, "it is told each time it asks");
        let mut stay = Vec::new();
        for guest in &crowd {
            stay.push(!is_to_go(guest).await);
        }
        assert!(stay[..17].iter().all(|stays| !stays) && stay[17..].iter().all(|stays| *stays));
        drop(crowd);
        assert_eq!(strangers.count(), 1);
        assert!(strangers.send_one_away());
        assert!(is_to_go(&alone).await);
        assert!(!strangers.send_one_away(), "nobody is left");
        drop((alone, first));
        assert_eq!(strangers.there.with(|there| there.of_origin.len()), 0);
    }
}
