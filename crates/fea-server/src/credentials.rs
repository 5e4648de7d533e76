//! The files that let clients in and hide what they say: read at the start, and again when asked to.

use std::path::Path;
use std::time::SystemTime;

use fea_server::arguments::AccessArguments;
use fea_server::{Encryption, ServerConfig, Tokens};

/// Tokens, and certificate with key, as far as the options ask for them.
pub struct Credentials {
    pub tokens: Option<Tokens>,
    pub encryption: Option<Encryption>,
}

/// Credentials of a running server, and the options that name their files.
pub struct Renewal {
    access: AccessArguments,
    in_use: Credentials,
}

/// Days of validity left, below which a certificate is warned of.
const DAYS_LEFT_MIN: u64 = 30;

impl Credentials {
    /// Reads the files, and warns of weak tokens, readable files and certificates that end soon.
    ///
    /// # Errors
    /// The file that cannot be read or used, with the reason.
    pub fn read(access: &AccessArguments) -> anyhow::Result<Self> {
        let tokens = access.token_file.as_deref().map(Tokens::read).transpose()?;
        let encryption = match (&access.tls_cert, &access.tls_key) {
            (Some(certificate), Some(key)) => Some(Encryption::read(certificate, key)?),
            _ => None,
        };
        for (what, file) in [("token", &access.token_file), ("key", &access.tls_key)] {
            if let Some(file) = file {
                warn_if_others_read(what, file);
            }
        }
        let short = tokens.as_ref().map_or(0, Tokens::count_short);
        if short > 0 {
            tracing::warn!(
                short,
                "a token has fewer than 16 letters and may be guessed; make one with \
                 head -c 24 /dev/urandom | base64"
            );
        }
        if let Some(validity) = encryption.as_ref().map(Encryption::validity) {
            let (on, days_left) = (validity.expires_on(), validity.days_left(SystemTime::now()));
            match days_left {
                ..DAYS_LEFT_MIN => tracing::warn!(
                    on,
                    days_left,
                    "the certificate expires soon; put a new one in its place and send SIGHUP"
                ),
                _ => tracing::info!(on, days_left, "the certificate expires"),
            }
        }
        Ok(Self { tokens, encryption })
    }
}

fn warn_if_others_read(what: &str, file: &Path) {
    if softgrasp_os::others_can_read(file) {
        let (file, name) = (file.display(), file.display());
        tracing::warn!(
            %file, "others on this machine can read the {what} file; say chmod 600 {name}"
        );
    }
}

impl Renewal {
    /// Renewal for a server with these settings; `None` if it uses no files that could be read again.
    pub fn of(access: &AccessArguments, config: &ServerConfig) -> Option<Self> {
        let in_use =
            Credentials { tokens: config.tokens.clone(), encryption: config.encryption.clone() };
        let is_any = in_use.tokens.is_some() || in_use.encryption.is_some();
        is_any.then(|| Self { access: access.clone(), in_use })
    }

    /// Reads all files again. New clients need the new credentials; present sessions go on. If one file
    /// cannot be used, none is.
    pub fn read_again(&self) {
        let read = match Credentials::read(&self.access) {
            Ok(read) => read,
            Err(error) => {
                let error = softgrasp_os::one_line(error.as_ref());
                return tracing::error!(error, "what was read before stays in use");
            }
        };
        if let (Some(old), Some(new)) = (&self.in_use.tokens, &read.tokens) {
            old.renew(new);
        }
        if let (Some(old), Some(new)) = (&self.in_use.encryption, &read.encryption) {
            old.renew(new);
        }
        tracing::info!("tokens and certificate were read again");
    }
}
