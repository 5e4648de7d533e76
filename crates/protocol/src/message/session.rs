//! The messages by which client and server introduce themselves.

use std::fmt;

use wincode::{SchemaRead, SchemaWrite};

use crate::{DecodeError, Limits};

/// First message of a client.
#[derive(Clone, PartialEq, Eq, SchemaRead, SchemaWrite)]
pub struct Hello {
    /// Name and version of the client, for the log.
    pub client: String,
    /// Shared secret, if the server wants one; never shown by `Debug`.
    pub token: Option<String>,
}

/// First message of a server, answer to [`Hello`].
#[derive(Clone, Debug, PartialEq, Eq, SchemaRead, SchemaWrite)]
pub struct Welcome {
    /// Name of the server, for the log.
    pub server: String,
    /// Version of the server program (not of the protocol, which is in every header).
    pub version: String,
    /// Threads it solves with.
    pub threads: u32,
    /// What it reads at most.
    pub limits: Limits,
}

impl Hello {
    pub(super) fn check(&self, limits: &Limits) -> Result<(), DecodeError> {
        limits.check_text("client", &self.client)?;
        self.token.iter().try_for_each(|token| limits.check_text("token", token))
    }
}

impl Welcome {
    pub(super) fn check(&self, limits: &Limits) -> Result<(), DecodeError> {
        limits.check_text("server", &self.server)?;
        limits.check_text("version", &self.version)
    }
}

impl fmt::Debug for Hello {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let token = self.token.as_ref().map(|_| "hidden");
        f.debug_struct("Hello").field("client", &self.client).field("token", &token).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn token_is_not_shown() {
        let hello = Hello { client: "me".to_owned(), token: Some("hush".to_owned()) };
        let shown = format!("{hello:?}");
        assert!(shown.contains("me") && !shown.contains("hush"), "{shown}");
    }
}
