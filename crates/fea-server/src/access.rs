//! Who may use the server: those who show its token, and nobody who guesses.

use std::collections::BTreeMap;
use std::net::IpAddr;
use std::time::{Duration, Instant};

use crate::lock::Lock;
use crate::refusal::Refusal;

/// The token of a server, as a digest, and the addresses that showed wrong ones.
pub(crate) struct Access {
    token: Option<blake3::Hash>,
    wrong: Lock<BTreeMap<IpAddr, Wrong>>,
}

/// Wrong tokens of one address.
#[derive(Clone, Copy)]
struct Wrong {
    count: u32,
    newest: Instant,
}

/// Wrong tokens after which an address is barred.
const WRONG_MAX: u32 = 5;
/// For how long after its newest wrong token.
const BARRED_FOR: Duration = Duration::from_secs(30);
/// Addresses that are remembered; with more, the one that was wrong longest ago is forgotten.
const ADDRESSES_MAX: usize = 4096;

impl Access {
    /// Access for all (`None`) or for those who show the token.
    pub fn new(token: Option<&str>) -> Self {
        let token = token.map(|token| blake3::hash(token.as_bytes()));
        Self { token, wrong: Lock::default() }
    }

    /// Whether a token is wanted.
    pub fn wants_token(&self) -> bool {
        self.token.is_some()
    }

    /// Lets in who shows the right token. The time it takes tells nothing of the token: digests are
    /// compared, all of their bytes.
    ///
    /// # Errors
    /// [`Refusal::Token`] for a wrong or missing token, [`Refusal::Barred`] for an address that showed
    /// too many of them, whatever it shows now.
    pub fn check(&self, address: IpAddr, shown: Option<&str>, now: Instant) -> Result<(), Refusal> {
        let Some(token) = self.token else { return Ok(()) };
        // An address of either family counts as the same one.
        let address = address.to_canonical();
        let is_right = blake3::hash(shown.unwrap_or("").as_bytes()) == token && shown.is_some();
        self.wrong.with(|wrong| {
            wrong.retain(|_, wrong| now.duration_since(wrong.newest) < BARRED_FOR);
            let count = wrong.get(&address).map_or(0, |wrong| wrong.count);
            if count >= WRONG_MAX {
                return Err(Refusal::Barred { seconds: BARRED_FOR.as_secs() });
            }
            if is_right {
                wrong.remove(&address);
                return Ok(());
            }
            if wrong.len() >= ADDRESSES_MAX && !wrong.contains_key(&address) {
                let oldest = wrong.iter().min_by_key(|(_, wrong)| wrong.newest).map(|(a, _)| *a);
                oldest.map(|oldest| wrong.remove(&oldest));
            }
            wrong.insert(address, Wrong { count: count + 1, newest: now });
            Err(Refusal::Token)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn address(last: u32) -> IpAddr {
        IpAddr::from((0x0a00_0000 + last).to_be_bytes())
    }

    #[test]
    fn without_a_token_everybody_is_let_in() {
        let access = Access::new(None);
        assert!(!access.wants_token());
        assert!(access.check(address(1), None, Instant::now()).is_ok());
    }

    #[test]
    fn only_the_right_token_is_let_in() {
        let access = Access::new(Some("open sesame"));
        let now = Instant::now();
        for (at, shown) in
            [None, Some(""), Some("open sesam"), Some("open sesame ")].iter().enumerate()
        {
            let refused = access.check(address(at as u32), *shown, now);
            assert!(matches!(refused, Err(Refusal::Token)), "{shown:?}");
        }
        assert!(access.check(address(0), Some("open sesame"), now).is_ok());
    }

    #[test]
    fn an_address_that_guesses_is_barred_for_a_while_and_others_are_not() {
        let access = Access::new(Some("right"));
        let start = Instant::now();
        for _ in 0..WRONG_MAX {
            assert!(matches!(access.check(address(1), Some("guess"), start), Err(Refusal::Token)));
        }
        let mapped = IpAddr::V6(std::net::Ipv4Addr::new(10, 0, 0, 1).to_ipv6_mapped());
        for from in [address(1), mapped] {
            let refused = access.check(from, Some("right"), start);
            assert!(matches!(refused, Err(Refusal::Barred { .. })), "{from}");
        }
        assert!(access.check(address(2), Some("right"), start).is_ok());
        let almost = start + BARRED_FOR - Duration::from_millis(1);
        assert!(access.check(address(1), Some("right"), almost).is_err());
        assert!(access.check(address(1), Some("right"), start + BARRED_FOR).is_ok());
    }

    #[test]
    fn one_wrong_token_less_than_the_limit_does_not_bar() {
        let access = Access::new(Some("right"));
        let now = Instant::now();
        for _ in 1..WRONG_MAX {
            assert!(access.check(address(1), Some("guess"), now).is_err());
        }
        assert!(access.check(address(1), Some("right"), now).is_ok());
    }

    #[test]
    fn addresses_that_are_remembered_are_bounded() {
        let access = Access::new(Some("right"));
        let start = Instant::now();
        for at in 0..2 * ADDRESSES_MAX as u32 {
            let now = start + Duration::from_micros(u64::from(at));
            assert!(access.check(address(at), Some("guess"), now).is_err());
        }
        assert_eq!(access.wrong.with(|wrong| wrong.len()), ADDRESSES_MAX);
        let newest = address(2 * ADDRESSES_MAX as u32 - 1);
        assert!(access.wrong.with(|wrong| wrong.contains_key(&newest)));
    }
}
