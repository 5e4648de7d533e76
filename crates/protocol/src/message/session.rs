//! The messages by which client and server introduce themselves.

use std::fmt;

use wincode::{SchemaRead, SchemaWrite};

use crate::block::Block;
use crate::payload::{PayloadReader, PayloadWriter};
use crate::{DecodeError, EncodeError, Limits, VersionRange};

/// First message of a client.
#[derive(Clone, PartialEq, Eq, SchemaRead, SchemaWrite)]
pub struct Hello {
    /// Name and version of the client, for the log.
    pub client: String,
    /// Token that the server may require; never shown by `Debug`.
    pub token: Option<String>,
    /// Versions of the wire that the client speaks.
    pub versions: VersionRange,
    /// Names of capabilities that the client has beyond the version.
    pub capabilities: Vec<String>,
    /// Silence of the server after which it sends `Alive`, whether it works or is idle; 0: never.
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
    /// Number of threads that the server solves with.
    pub threads: u32,
    /// Limits on what the server reads.
    pub limits: Limits,
    /// Version of the wire for all that follows: the highest that both sides speak.
    pub wire: u16,
    /// Names of the server's capabilities; a client passes over names it does not know.
    pub capabilities: Vec<String>,
    /// Silence of a client after which the server gives it up; 0: it may be silent for ever.
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
    /// `Welcome` of a server without a name that speaks this version of the wire.
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

impl Hello {
    /// `Hello` of a client of this version with its token, if it has one; no `Alive` is asked for.
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
    /// Whether the server has a capability of this name.
    pub fn knows(&self, capability: &str) -> bool {
        self.capabilities.iter().any(|name| name == capability)
    }

    /// Name and version of the server program, for people.
    pub fn program(&self) -> String {
        format!("{} {}", self.server, self.version)
    }

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
}
