//! Places for sessions: a largest number in all, and one for each owner.

use std::collections::BTreeMap;
use std::net::IpAddr;
use std::sync::Arc;

use crate::lock::Lock;
use crate::origin::Origin;

/// Places for sessions, taken and given back.
#[derive(Clone)]
pub(crate) struct Places {
    taken: Arc<Lock<Taken>>,
    max: usize,
    of_origin_max: usize,
}

#[derive(Default)]
struct Taken {
    all: usize,
    by_origin: BTreeMap<Origin, usize>,
}

/// Place of a session; given back when dropped.
pub(crate) struct Place {
    places: Places,
    origin: Origin,
}

/// Why there is no place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum NoPlace {
    #[error("all sessions of this server are taken (--max-sessions); try again later")]
    Server,
    #[error(
        "all sessions for your address are taken (--max-sessions-per-address); end one of them first"
    )]
    Address,
    #[error(
        "all sessions of your token are taken (sessions=N in the token file); end one of them first"
    )]
    Token,
}

impl Places {
    /// `max` places, of which one address or IPv6 network may take `of_origin_max`.
    pub fn new(max: usize, of_origin_max: usize) -> Self {
        Self { taken: Arc::default(), max, of_origin_max }
    }

    /// Takes a place. Programs on the server's own machine share all places.
    ///
    /// # Errors
    /// [`NoPlace`] if all places of the server or of the address are taken.
    pub fn take(&self, address: IpAddr) -> Result<Place, NoPlace> {
        let origin = Origin::of(address);
        self.taken.with(|taken| {
            if taken.all >= self.max {
                return Err(NoPlace::Server);
            }
            let of_origin = taken.by_origin.get(&origin).copied().unwrap_or(0);
            if of_origin >= self.of_origin_max && origin != Origin::ThisMachine {
                return Err(NoPlace::Address);
            }
            taken.all += 1;
            taken.by_origin.insert(origin, of_origin + 1);
            Ok(Place { places: self.clone(), origin })
        })
    }

    /// Number of places that are taken.
    pub fn taken(&self) -> usize {
        self.taken.with(|taken| taken.all)
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.places.taken.with(|taken| {
            taken.all -= 1;
            if let Some(of_origin) = taken.by_origin.get_mut(&self.origin) {
                *of_origin -= 1;
                if *of_origin == 0 {
                    taken.by_origin.remove(&self.origin);
                }
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_of_server_and_address_run_out_and_come_back() {
        let places = Places::new(3, 2);
        let [a, b] = [[10, 0, 0, 1], [10, 0, 0, 2]].map(IpAddr::from);
        let first = places.take(a).unwrap();
        let _second = places.take(a).unwrap();
        assert_eq!(places.take(a).err(), Some(NoPlace::Address));
        let _third = places.take(b).unwrap();
        assert_eq!(places.take(b).err(), Some(NoPlace::Server));
        assert_eq!(places.taken(), 3);
        drop(first);
        assert!(places.take(a).is_ok());
        assert_eq!(places.taken(), 2);
        assert_eq!(places.taken.with(|taken| taken.by_origin.len()), 2);
    }

    #[test]
    fn addresses_of_one_ipv6_network_share_its_places() {
        let places = Places::new(5, 2);
        let [a, b, c, other] = ["2001:db8::1", "2001:db8::2", "2001:db8::3:3", "2001:db8:0:1::1"]
            .map(|text| {
                let address: IpAddr = text.parse().unwrap();
                address
            });
        let _taken = [places.take(a).unwrap(), places.take(b).unwrap()];
        assert_eq!(places.take(c).err(), Some(NoPlace::Address));
        assert!(places.take(other).is_ok());
    }

    #[test]
    fn programs_on_the_same_machine_may_take_all_places() {
        let places = Places::new(3, 1);
        let own = [[127, 0, 0, 1], [127, 0, 0, 1], [127, 8, 0, 1]].map(IpAddr::from);
        let taken: Vec<_> = own.map(|address| places.take(address)).into_iter().collect();
        assert!(taken.iter().all(Result::is_ok));
    }
}
