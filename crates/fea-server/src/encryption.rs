//! TLS: the certificate and key of a server.

use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;

use tokio_rustls::TlsAcceptor;
use tokio_rustls::rustls::pki_types::pem::PemObject;
use tokio_rustls::rustls::pki_types::{CertificateDer, PrivateKeyDer};
use tokio_rustls::rustls::{self, crypto, version};

use crate::certificate::{MakeError, Validity, ValidityError, self_signed_now};
use crate::lock::Lock;

/// TLS 1.3 with the server's certificate and key. Clones share them, and those of a running server can be
/// replaced.
#[derive(Clone)]
pub struct Encryption(Arc<Lock<Pair>>);

/// Certificate with its key, and its validity.
#[derive(Clone)]
struct Pair {
    config: Arc<rustls::ServerConfig>,
    validity: Validity,
}

/// Why there is no encryption.
#[derive(Debug, thiserror::Error)]
pub enum EncryptionError {
    /// A file is not a PEM of the expected kind.
    #[error(
        "{what} {path} cannot be used: {reason}; PEM is expected, as --make-certificate writes it"
    )]
    File {
        /// Kind of the file: `certificate` or `key`.
        what: &'static str,
        /// Path of the file.
        path: PathBuf,
        /// Reason given by the PEM reader.
        reason: String,
    },
    /// Certificate and key do not make a pair that can be served.
    #[error("certificate {certificate} and key {key} cannot be used together: {reason}")]
    Pair {
        /// Path of the certificate's file.
        certificate: PathBuf,
        /// Path of the key's file.
        key: PathBuf,
        /// Reason given by the TLS library.
        reason: String,
    },
    /// The certificate has expired or is not valid yet.
    #[error("certificate {path} cannot be used: {source}")]
    Validity {
        /// Path of the certificate's file.
        path: PathBuf,
        /// How the validity differs from the present time.
        source: ValidityError,
    },
    /// No self-signed certificate could be made.
    #[error(transparent)]
    Made(#[from] MakeError),
}

impl Encryption {
    /// Reads a chain of certificates and the key of the first, both PEM.
    ///
    /// # Errors
    /// [`EncryptionError`]; also for a certificate that has expired or is not valid yet.
    pub fn read(certificate: &Path, key: &Path) -> Result<Self, EncryptionError> {
        let wrong = |what, path: &Path, reason: String| EncryptionError::File {
            what,
            path: path.to_owned(),
            reason,
        };
        let chain = CertificateDer::pem_file_iter(certificate)
            .and_then(|chain| chain.collect::<Result<Vec<_>, _>>())
            .map_err(|e| wrong("certificate", certificate, e.to_string()))?;
        let Some(first) = chain.first() else {
            return Err(wrong("certificate", certificate, "it holds none".to_owned()));
        };
        let outdated = |source| EncryptionError::Validity { path: certificate.to_owned(), source };
        let validity = Validity::of(first).map_err(outdated)?;
        validity.check(SystemTime::now()).map_err(outdated)?;
        let private =
            PrivateKeyDer::from_pem_file(key).map_err(|e| wrong("key", key, e.to_string()))?;
        Self::of(chain, private, validity).map_err(|e| EncryptionError::Pair {
            certificate: certificate.to_owned(),
            key: key.to_owned(),
            reason: e.to_string(),
        })
    }

    /// Self-signed certificate for hosts and addresses, made now, of which no file is written: for a page
    /// that a person opens and trusts by hand. It is valid for a year.
    ///
    /// # Errors
    /// [`EncryptionError::Made`] if no certificate can be made for these names.
    pub fn self_made(names: &[String]) -> Result<Self, EncryptionError> {
        let unread = |reason: String| MakeError::Names { names: names.join(","), reason };
        let (certificate, key) = self_signed_now(names, 365)?;
        let certificate = CertificateDer::from_pem_slice(certificate.as_bytes())
            .map_err(|e| unread(e.to_string()))?;
        let key =
            PrivateKeyDer::from_pem_slice(key.as_bytes()).map_err(|e| unread(e.to_string()))?;
        let validity = Validity::of(&certificate).map_err(|e| unread(e.to_string()))?;
        Ok(Self::of(vec![certificate], key, validity).map_err(|e| unread(e.to_string()))?)
    }

    fn of(
        chain: Vec<CertificateDer<'static>>,
        key: PrivateKeyDer<'static>,
        validity: Validity,
    ) -> Result<Self, rustls::Error> {
        let provider = Arc::new(crypto::ring::default_provider());
        let config = rustls::ServerConfig::builder_with_provider(provider)
            .with_protocol_versions(&[&version::TLS13])
            .and_then(|builder| builder.with_no_client_auth().with_single_cert(chain, key))?;
        Ok(Self(Arc::new(Lock::new(Pair { config: Arc::new(config), validity }))))
    }

    /// Replaces certificate and key for new connections; present connections go on.
    pub fn renew(&self, by: &Self) {
        let new = by.0.with(|pair| pair.clone());
        self.0.with(|pair| *pair = new);
    }

    /// Validity of the certificate.
    pub fn validity(&self) -> Validity {
        self.0.with(|pair| pair.validity)
    }

    /// Acceptor of TLS connections with the present certificate and key.
    pub fn acceptor(&self) -> TlsAcceptor {
        TlsAcceptor::from(self.0.with(|pair| Arc::clone(&pair.config)))
    }
}

impl fmt::Debug for Encryption {
    // A key is not for logs.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Encryption")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::certificate::make_certificate;

    fn pair(folder: &Path) -> (PathBuf, PathBuf) {
        (folder.join("certificate.pem"), folder.join("key.pem"))
    }

    #[test]
    fn files_that_are_no_pair_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let (certificate, key) = pair(folder.path());
        make_certificate(&["a".to_owned()], 1, &certificate, &key).unwrap();
        let (other, other_key) = (folder.path().join("other"), folder.path().join("other-key"));
        make_certificate(&["a".to_owned()], 1, &other, &other_key).unwrap();
        let mixed = Encryption::read(&certificate, &other_key);
        assert!(matches!(mixed, Err(EncryptionError::Pair { .. })), "{mixed:?}");
        let swapped = Encryption::read(&key, &certificate);
        assert!(matches!(swapped, Err(EncryptionError::File { what: "certificate", .. })));
        let missing = Encryption::read(&certificate, &folder.path().join("none"));
        assert!(matches!(missing, Err(EncryptionError::File { what: "key", .. })));
    }
}
