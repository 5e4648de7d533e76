//! The messages by which client and server introduce themselves.

use std::fmt;

use wincode::{SchemaRead, SchemaWrite};

use crate::block::Block;
use crate::payload::{PayloadReader, PayloadWriter};
use crate::{DecodeError, EncodeError, Limits};

/// Versions of the wire that one side reads and writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, SchemaRead, SchemaWrite)]
pub struct VersionRange {
    /// The oldest.
    pub lowest: u16,
    /// The newest.
    pub highest: u16,
}

/// First message of a client.
#[derive(Clone, PartialEq, Eq, SchemaRead, SchemaWrite)]
pub struct Hello {
    /// Name and version of the client, for the log.
    pub client: String,
    /// Shared secret, if the server wants one; never shown by `Debug`.
    pub token: Option<String>,
    /// Versions of the wire that the client speaks.
    pub versions: VersionRange,
    /// What the client can do beyond the version, by name.
    pub capabilities: Vec<String>,
    /// The server sends `Alive` when it has sent nothing for so long, whether it works or rests; 0:
    /// never.
    ///
    /// Units: ms.
    pub alive_every_ms: u32,
}

/// First message of a server, answer to [`Hello`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Welcome {
    /// Name of the server, for the log.
    pub server: String,
    /// Version of the server program (not of the wire).
    pub version: String,
    /// Threads it solves with.
    pub threads: u32,
    /// What it reads at most.
    pub limits: Limits,
    /// Version of the wire from now on: the highest that both sides speak.
    pub wire: u16,
    /// What the server can do, by name; a client passes over names it does not know.
    pub capabilities: Vec<String>,
    /// A client that has sent nothing for so long is given up; 0: it may rest for ever.
    ///
    /// Units: ms.
    pub idle_ms: u64,
}

#[derive(Clone, Debug, SchemaRead, SchemaWrite)]
struct WelcomePart {
    server: String,
    version: String,
    threads: u32,
    limits: Block,
    wire: u16,
    capabilities: Vec<String>,
    idle_ms: u64,
}

impl Default for Welcome {
    /// A server without a name that speaks this version of the wire.
    fn default() -> Self {
        Self {
            server: String::new(),
            version: String::new(),
            threads: 0,
            limits: Limits::default(),
            wire: crate::VERSION,
            capabilities: Vec::new(),
            idle_ms: 0,
        }
    }
}

impl VersionRange {
    /// The highest version that both sides speak.
    pub fn common(self, other: Self) -> Option<u16> {
        let highest = self.highest.min(other.highest);
        (highest >= self.lowest.max(other.lowest)).then_some(highest)
    }
}

impl Hello {
    /// A client of this version that shows a token, if it has one, and needs no `Alive`.
    pub fn new(client: impl Into<String>, token: Option<String>) -> Self {
        Self {
            client: client.into(),
            token,
            versions: crate::VERSIONS,
            capabilities: Vec::new(),
            alive_every_ms: 0,
        }
    }

    pub(super) fn check(&self, limits: &Limits) -> Result<(), DecodeError> {
        limits.check_text("client", &self.client)?;
        self.token.iter().try_for_each(|token| limits.check_text("token", token))?;
        self.capabilities.iter().try_for_each(|name| limits.check_text("capability", name))
    }
}

impl Welcome {
    pub(super) fn write(&self, writer: &mut PayloadWriter<'_>) -> Result<(), EncodeError> {
        writer.part(&WelcomePart {
            server: self.server.clone(),
            version: self.version.clone(),
            threads: self.threads,
            limits: Block::of(&self.limits)?,
            wire: self.wire,
            capabilities: self.capabilities.clone(),
            idle_ms: self.idle_ms,
        })
    }

    pub(super) fn read(
        reader: &mut PayloadReader<'_>,
        limits: &Limits,
    ) -> Result<Self, DecodeError> {
        let part: WelcomePart = reader.part()?;
        limits.check_text("server", &part.server)?;
        limits.check_text("version", &part.version)?;
        part.capabilities.iter().try_for_each(|name| limits.check_text("capability", name))?;
        Ok(Self {
            server: part.server,
            version: part.version,
            threads: part.threads,
            limits: part.limits.read()?,
            wire: part.wire,
            capabilities: part.capabilities,
            idle_ms: part.idle_ms,
        })
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
        let hello = Hello::new("me", Some("hush".to_owned()));
        let shown = format!("{hello:?}");
        assert!(shown.contains("me") && !shown.contains("hush"), "{shown}");
    }

    #[test]
    fn the_highest_version_of_both_is_taken() {
        let range = |lowest, highest| VersionRange { lowest, highest };
        assert_eq!(range(4, 6).common(range(5, 9)), Some(6));
        assert_eq!(range(4, 4).common(range(4, 5)), Some(4));
        assert_eq!(range(4, 5).common(range(6, 7)), None);
        assert_eq!(range(6, 7).common(range(4, 5)), None);
        assert_eq!(range(5, 4).common(range(4, 5)), None, "nothing lies in an empty range");
    }
}
