//! The arguments that let a client in at a server: a token, and whose certificates are trusted.

use std::path::PathBuf;

use anyhow::ensure;
use clap::Args;

use crate::ask::connection::ServerChoice;
use crate::ask::endpoint::{Endpoint, Trust};

/// What a server elsewhere wants.
#[derive(Args, Clone, Default)]
pub(super) struct AccessArguments {
    /// File whose first line is the token that the server wants.
    #[arg(long, value_name = "F")]
    token_file: Option<PathBuf>,
    /// Speak TLS, and trust the certificates in this PEM file: those of an authority, or the server's
    /// own.
    #[arg(long, value_name = "F.pem")]
    tls_ca: Option<PathBuf>,
}

impl AccessArguments {
    /// Endpoint of the server, with token and trusted certificates; `None` for the embedded one.
    ///
    /// # Errors
    /// A file that cannot be read or is empty, and arguments that do not fit the embedded server.
    pub fn to(&self, server: &ServerChoice) -> anyhow::Result<Option<Endpoint>> {
        let ServerChoice::At(address) = server else {
            let is_given = self.token_file.is_some() || self.tls_ca.is_some();
            ensure!(!is_given, "--token-file and --tls-ca are for --server HOST:PORT");
            return Ok(None);
        };
        let token = self.token_file.as_deref().map(softgrasp_os::read_token).transpose()?;
        let trust = self.tls_ca.as_deref().map(Trust::read).transpose()?;
        Ok(Some(Endpoint { address: address.clone(), token, trust }))
    }
}
