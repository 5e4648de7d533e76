//! Who may use the server: those who show one of its tokens, and nobody who guesses.

use std::collections::BTreeMap;
use std::net::IpAddr;
use std::time::{Duration, Instant};

use crate::lock::Lock;
use crate::origin::Origin;
use crate::refusal::Refusal;
use crate::tokens::{Bearer, TokenNumbers, Tokens};

/// The tokens of a server, and the owners of addresses that showed wrong ones.
pub(crate) struct Access {
    tokens: Option<Tokens>,
    wrong: Lock<BTreeMap<Origin, Wrong>>,
}

/// How often one owner has shown a wrong token, and when last.
#[derive(Clone, Copy)]
struct Wrong {
    count: u32,
    newest: Instant,
}

/// Number of wrong tokens after which an address is barred.
const WRONG_MAX: u32 = 5;
/// Time for which an address is barred after its newest wrong token.
const BARRED_FOR: Duration = Duration::from_secs(30);
/// Number of addresses remembered; with more, the one whose wrong token is oldest is forgotten.
const ADDRESSES_MAX: usize = 4096;

impl Access {
    /// Access for everybody (`None`) or for those who show one of the tokens.
    pub fn new(tokens: Option<Tokens>) -> Self {
        Self { tokens, wrong: Lock::default() }
    }

    /// Whether a client must show a token.
    pub fn wants_token(&self) -> bool {
        self.tokens.is_some()
    }

    /// Sessions and requests counted for each token that has a name.
    pub fn numbers(&self) -> Vec<TokenNumbers> {
        self.tokens.as_ref().map(Tokens::numbers).unwrap_or_default()
    }

    /// Lets a client in that shows a right token, and returns the token's bearer; `None` without tokens.
    ///
    /// # Errors
    /// [`Refusal::Token`] for a wrong or missing token, [`Refusal::Barred`] for an address that showed
    /// too many of them, whatever it shows now.
    pub fn check(
        &self,
        address: IpAddr,
        shown: Option<&str>,
        now: Instant,
    ) -> Result<Option<Bearer>, Refusal> {
        let Some(tokens) = &self.tokens else { return Ok(None) };
        let origin = Origin::of(address);
        let bearer = shown.and_then(|shown| tokens.bearer(shown));
        self.wrong.with(|wrong| {
            wrong.retain(|_, wrong| now.duration_since(wrong.newest) < BARRED_FOR);
            let count = wrong.get(&origin).map_or(0, |wrong| wrong.count);
            if count >= WRONG_MAX {
                return Err(Refusal::Barred { seconds: BARRED_FOR.as_secs() });
            }
            if bearer.is_some() {
                wrong.remove(&origin);
                return Ok(bearer);
            }
            if wrong.len() >= ADDRESSES_MAX && !wrong.contains_key(&origin) {
                let oldest = wrong.iter().min_by_key(|(_, wrong)| wrong.newest).map(|(a, _)| *a);
                oldest.map(|oldest| wrong.remove(&oldest));
            }
            wrong.insert(origin, Wrong { count: count + 1, newest: now });
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
        let access = Access::new(Some(Tokens::of("open sesame")));
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
        let access = Access::new(Some(Tokens::of("right")));
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
        let access = Access::new(Some(Tokens::of("right")));
        let now = Instant::now();
        for _ in 1..WRONG_MAX {
            assert!(access.check(address(1), Some("guess"), now).is_err());
        }
        assert!(access.check(address(1), Some("right"), now).is_ok());
    }

    #[test]
    fn addresses_that_are_remembered_are_bounded() {
        let access = Access::new(Some(Tokens::of("right")));
        let start = Instant::now();
        for at in 0..2 * ADDRESSES_MAX as u32 {
            let now = start + Duration::from_micros(u64::from(at));
            assert!(access.check(address(at), Some("guess"), now).is_err());
        }
        assert_eq!(access.wrong.with(|wrong| wrong.len()), ADDRESSES_MAX);
        let newest = address(2 * ADDRESSES_MAX as u32 - 1);
        assert!(access.wrong.with(|wrong| wrong.contains_key(&Origin::of(newest))));
    }
}
