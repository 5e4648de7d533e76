//! Tokens that let clients in: one for all, or one for each name, with a number of sessions.

use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering::Relaxed};

use crate::lock::Lock;
use crate::places::NoPlace;

/// Tokens of a server. Clones share them, and those of a running server can be replaced.
#[derive(Clone)]
pub struct Tokens(Arc<Lock<Vec<Token>>>);

struct Token {
    digest: blake3::Hash,
    is_short: bool,
    bearer: Bearer,
}

/// Holder of a token: its name, number of sessions and counters.
#[derive(Clone)]
pub(crate) struct Bearer {
    /// Name of the token; `None` for a token without one.
    pub name: Option<Arc<str>>,
    sessions_max: Option<usize>,
    counts: Arc<Counts>,
}

/// Counters for the bearers of one token; kept when the tokens are read again.
#[derive(Default)]
struct Counts {
    sessions: AtomicUsize,
    sessions_total: AtomicU64,
    requests: AtomicU64,
    refused: AtomicU64,
}

/// Sessions and requests counted for a token with a name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct TokenNumbers {
    /// Name of the token.
    pub name: Arc<str>,
    /// Number of open sessions.
    pub sessions: u64,
    /// Number of sessions that have begun.
    pub sessions_total: u64,
    /// Number of requests that have been answered or refused.
    pub requests: u64,
    /// Number of requests that have been refused.
    pub refused: u64,
}

/// Session of a token's bearer; counted until it is dropped.
pub(crate) struct BearerPlace(Arc<Counts>);

/// Why a file gives no tokens. The file's content is never part of the text.
#[derive(Debug, thiserror::Error)]
pub enum TokensError {
    /// The file cannot be read.
    #[error("cannot read the token file {path}")]
    Read {
        /// Path of the file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The first line of the file is empty.
    #[error("the token file {path} is empty")]
    Empty {
        /// Path of the file.
        path: PathBuf,
    },
    /// A line does not have the form of a named token.
    #[error(
        "line {line} of the token file {path}: {reason}; write name=NAME token=TOKEN, and \
         sessions=N to limit its sessions"
    )]
    Line {
        /// Path of the file.
        path: PathBuf,
        /// Number of the line, counted from 1.
        line: usize,
        /// Fault of the line.
        reason: &'static str,
    },
    /// A token is so short that it is guessed in minutes.
    #[error(
        "a token in {path} has fewer than {LETTERS_MIN} letters and is soon guessed; make one with \
         head -c 24 /dev/urandom | base64"
    )]
    Short {
        /// Path of the file.
        path: PathBuf,
    },
}

/// Number of letters below which a token is refused.
const LETTERS_MIN: usize = 4;
/// Number of letters below which a token is warned of, because it may be guessed. 24 random bytes as
/// base64 are 32 letters.
const LETTERS_GOOD: usize = 16;
/// Largest number of letters of a token's name.
const NAME_MAX: usize = 32;

impl Tokens {
    /// One token without a name, for all clients.
    pub fn of(token: &str) -> Self {
        Self(Arc::new(Lock::new(vec![Token::new(token, None, None)])))
    }

    /// Reads a file: its first line is the token, or, where the first one that is neither empty nor a
    /// comment (`#`) begins with `name=`, every line is `name=NAME token=TOKEN [sessions=N]`.
    ///
    /// # Errors
    /// [`TokensError`].
    pub fn read(path: &Path) -> Result<Self, TokensError> {
        let text = std::fs::read_to_string(path)
            .map_err(|source| TokensError::Read { path: path.to_owned(), source })?;
        let lines = || text.lines().enumerate().map(|(at, line)| (at + 1, line.trim()));
        let mut said = lines().filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
        let tokens = match said.next() {
            Some((_, first)) if first.starts_with("name=") => {
                named(lines().filter(|(_, line)| !line.is_empty() && !line.starts_with('#')))
                    .map_err(|(line, reason)| {
                        let path = path.to_owned();
                        TokensError::Line { path, line, reason }
                    })?
            }
            _ => match text.lines().next().unwrap_or("").trim() {
                "" => return Err(TokensError::Empty { path: path.to_owned() }),
                token => vec![(token, Token::new(token, None, None))],
            },
        };
        if tokens.iter().any(|(token, _)| token.chars().count() < LETTERS_MIN) {
            return Err(TokensError::Short { path: path.to_owned() });
        }
        Ok(Self(Arc::new(Lock::new(tokens.into_iter().map(|(_, token)| token).collect()))))
    }

    /// Replaces the tokens; the counters of a name go on.
    pub fn renew(&self, by: &Self) {
        let mut tokens = by.0.with(std::mem::take);
        self.0.with(|old| {
            for token in &mut tokens {
                let same = old.iter().find(|old| old.bearer.name == token.bearer.name);
                if let Some(same) = same {
                    token.bearer.counts = Arc::clone(&same.bearer.counts);
                }
            }
            *old = tokens;
        });
    }

    /// Number of tokens.
    pub fn count(&self) -> usize {
        self.0.with(|tokens| tokens.len())
    }

    /// Number of tokens that are so short that they may be guessed.
    pub fn count_short(&self) -> usize {
        self.0.with(|tokens| tokens.iter().filter(|token| token.is_short).count())
    }

    /// Bearer of the token that was shown. The time it takes tells nothing of the tokens: all digests are
    /// compared, all of their bytes.
    pub(crate) fn bearer(&self, shown: &str) -> Option<Bearer> {
        let digest = blake3::hash(shown.as_bytes());
        self.0.with(|tokens| {
            let looked_at_all = tokens.iter().fold(None, |found, token| {
                if token.digest == digest { Some(&token.bearer) } else { found }
            });
            looked_at_all.cloned()
        })
    }

    /// Counters of each name, in the order of the file.
    pub(crate) fn numbers(&self) -> Vec<TokenNumbers> {
        self.0.with(|tokens| tokens.iter().filter_map(|token| token.bearer.numbers()).collect())
    }
}

impl fmt::Debug for Tokens {
    // Tokens and their digests are not for logs.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Tokens({})", self.count())
    }
}

impl Token {
    fn new(token: &str, name: Option<&str>, sessions_max: Option<usize>) -> Self {
        let bearer = Bearer { name: name.map(Arc::from), sessions_max, counts: Arc::default() };
        let is_short = token.chars().count() < LETTERS_GOOD;
        Self { digest: blake3::hash(token.as_bytes()), is_short, bearer }
    }
}

impl Bearer {
    /// Takes the place of one more session.
    ///
    /// # Errors
    /// [`NoPlace::Token`] if all of its sessions are taken.
    pub fn take_place(&self) -> Result<BearerPlace, NoPlace> {
        let max = self.sessions_max.unwrap_or(usize::MAX);
        let more = |sessions| (sessions < max).then_some(sessions + 1);
        self.counts.sessions.fetch_update(Relaxed, Relaxed, more).map_err(|_| NoPlace::Token)?;
        self.counts.sessions_total.fetch_add(1, Relaxed);
        Ok(BearerPlace(Arc::clone(&self.counts)))
    }

    /// Counts a request that was answered or refused.
    pub fn count(&self, is_refused: bool) {
        self.counts.requests.fetch_add(1, Relaxed);
        self.counts.refused.fetch_add(u64::from(is_refused), Relaxed);
    }

    fn numbers(&self) -> Option<TokenNumbers> {
        let Counts { sessions, sessions_total, requests, refused } = &*self.counts;
        Some(TokenNumbers {
            name: self.name.clone()?,
            sessions: sessions.load(Relaxed) as u64,
            sessions_total: sessions_total.load(Relaxed),
            requests: requests.load(Relaxed),
            refused: refused.load(Relaxed),
        })
    }
}

impl Drop for BearerPlace {
    fn drop(&mut self) {
        self.0.sessions.fetch_sub(1, Relaxed);
    }
}

/// Tokens of named lines, each with its text, or the number of the first wrong line and its fault.
fn named<'a>(
    lines: impl Iterator<Item = (usize, &'a str)>,
) -> Result<Vec<(&'a str, Token)>, (usize, &'static str)> {
    let mut tokens: Vec<(&str, Token)> = Vec::new();
    for (at, line) in lines {
        let (mut name, mut token, mut sessions) = (None, None, None);
        for word in line.split_whitespace() {
            let place = match word.split_once('=') {
                Some(("name", value)) => (&mut name, value),
                Some(("token", value)) => (&mut token, value),
                Some(("sessions", value)) => (&mut sessions, value),
                _ => return Err((at, "a word is none of name=, token= and sessions=")),
            };
            if place.0.replace(place.1).is_some() {
                return Err((at, "a word is there twice"));
            }
        }
        let name = name
            .filter(|name| is_name(name))
            .ok_or((at, "a name of 1 to 32 letters, digits, '.', '_' and '-' is missing"))?;
        let token = token.ok_or((at, "token= is missing"))?;
        let max = match sessions.map(str::parse) {
            None => None,
            Some(Ok(max)) if max > 0 => Some(max),
            Some(_) => return Err((at, "sessions= is no number above 0")),
        };
        if tokens.iter().any(|(_, known)| known.bearer.name.as_deref() == Some(name)) {
            return Err((at, "the name is taken by a line before"));
        }
        if tokens.iter().any(|(known, _)| *known == token) {
            return Err((at, "the token is that of a line before"));
        }
        tokens.push((token, Token::new(token, Some(name), max)));
    }
    Ok(tokens)
}

fn is_name(name: &str) -> bool {
    let is_letter = |c: char| c.is_ascii_alphanumeric() || ".-_".contains(c);
    (1..=NAME_MAX).contains(&name.len()) && name.chars().all(is_letter)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Tokens, TokensError> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("tokens");
        std::fs::write(&path, text).unwrap();
        Tokens::read(&path)
    }

    fn name(tokens: &Tokens, shown: &str) -> Option<String> {
        tokens.bearer(shown).map(|bearer| bearer.name.as_deref().unwrap_or("-").to_owned())
    }

    #[test]
    fn first_line_alone_is_the_token_whatever_it_and_the_others_hold() {
        for (text, token) in [
            (" open sesame \nsecond line\n", "open sesame"),
            ("#hash\nsecond line\n", "#hash"),
            ("key=value token=abcdef\n", "key=value token=abcdef"),
        ] {
            let tokens = read(text).unwrap();
            assert_eq!(name(&tokens, token).as_deref(), Some("-"), "{text:?}");
            assert_eq!(name(&tokens, "second line"), None);
            assert_eq!(tokens.count(), 1);
        }
        assert!(matches!(read("\nsecond line\n"), Err(TokensError::Empty { .. })));
        assert!(matches!(read("abc\n"), Err(TokensError::Short { .. })));
        assert_eq!(read("sixteen letters!").unwrap().count_short(), 0);
        assert_eq!(read("fifteen letters").unwrap().count_short(), 1);
    }

    #[test]
    fn lines_with_names_are_read_and_what_is_wrong_is_said_without_the_token() {
        let text =
            "# our lab\n\nname=alice token=abcdefgh= sessions=2\n  name=bob.2   token=#ijkl\n";
        let tokens = read(text).unwrap();
        assert_eq!(name(&tokens, "abcdefgh=").as_deref(), Some("alice"));
        assert_eq!(name(&tokens, "#ijkl").as_deref(), Some("bob.2"));
        assert_eq!(name(&tokens, "abcdefgh"), None);
        for (second, reason) in [
            ("bob", "none of name="),
            ("name=bob", "token= is missing"),
            ("token=hidden", "name of 1 to 32"),
            ("name=b\u{e9} token=hidden", "name of 1 to 32"),
            ("name=bob token=hidden name=bob", "twice"),
            ("name=bob token=hidden sessions=0", "sessions="),
            ("name=bob token=hidden memory=1", "none of name="),
            ("name=alice token=hidden", "the name is taken"),
            ("name=bob token=abcdefgh", "that of a line before"),
        ] {
            let error = read(&format!("name=alice token=abcdefgh\n{second}\n")).unwrap_err();
            let said = error.to_string();
            assert!(said.contains("line 2") && said.contains(reason), "{said}");
            assert!(!said.contains("hidden") && !said.contains("abcdefgh"), "{said}");
        }
        assert!(!format!("{tokens:?}").contains("abcd"));
    }

    #[test]
    fn sessions_of_a_token_run_out_and_come_back_and_go_on_when_tokens_are_read_again() {
        let tokens = read("name=alice token=abcdefgh sessions=1\nname=bob token=ijklmnop").unwrap();
        let alice = tokens.bearer("abcdefgh").unwrap();
        let place = alice.take_place().unwrap();
        assert_eq!(alice.take_place().err(), Some(NoPlace::Token));
        assert!(tokens.bearer("ijklmnop").unwrap().take_place().is_ok());
        alice.count(true);
        tokens.renew(&read("name=alice token=qrstuvwx sessions=2").unwrap());
        assert!(tokens.bearer("abcdefgh").is_none() && tokens.bearer("ijklmnop").is_none());
        let again = tokens.bearer("qrstuvwx").unwrap();
        let _second = again.take_place().unwrap();
        assert_eq!(again.take_place().err(), Some(NoPlace::Token), "the first one is there still");
        drop(place);
        let numbers = tokens.numbers();
        let [alice] = numbers.as_slice() else { panic!("{numbers:?}") };
        assert_eq!((&*alice.name, alice.sessions, alice.sessions_total), ("alice", 1, 2));
        assert_eq!((alice.requests, alice.refused), (1, 1));
    }
}
