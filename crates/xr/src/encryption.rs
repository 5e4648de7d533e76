//! TLS of the page: headsets track hands only on pages that come encrypted, or from the same machine.

use std::net::IpAddr;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use tokio_rustls::TlsAcceptor;
use tokio_rustls::rustls::pki_types::pem::PemObject;
use tokio_rustls::rustls::pki_types::{CertificateDer, PrivateKeyDer, PrivatePkcs8KeyDer};
use tokio_rustls::rustls::{self, crypto, version};

/// What the page is encrypted with.
#[derive(Clone)]
pub struct PageEncryption(TlsAcceptor);

/// Why it is not.
#[derive(Debug, thiserror::Error)]
pub enum EncryptionError {
    /// A file that is no PEM of the right kind.
    #[error("{what} {path} of the page cannot be used: {reason}")]
    File {
        /// `certificate` or `key`.
        what: &'static str,
        /// The file.
        path: PathBuf,
        /// What the reader says.
        reason: String,
    },
    /// No pair could be made or used.
    #[error("the page cannot be encrypted: {0}")]
    Pair(String),
}

impl PageEncryption {
    /// With a pair that is made now, for the names that a browser may use.
    ///
    /// # Errors
    /// [`EncryptionError::Pair`].
    pub fn self_made(address: IpAddr) -> Result<Self, EncryptionError> {
        let wrong = |error: rcgen::Error| EncryptionError::Pair(error.to_string());
        let names = vec!["localhost".to_owned(), "127.0.0.1".to_owned(), address.to_string()];
        let made = rcgen::generate_simple_self_signed(names).map_err(wrong)?;
        let key = PrivatePkcs8KeyDer::from(made.signing_key.serialize_der());
        Self::of(vec![made.cert.der().clone()], key.into())
    }

    /// With a certificate and key from files, both PEM.
    ///
    /// # Errors
    /// [`EncryptionError`].
    pub fn read(certificate: &Path, key: &Path) -> Result<Self, EncryptionError> {
        let wrong = |what, path: &Path, reason: String| EncryptionError::File {
            what,
            path: path.to_owned(),
            reason,
        };
        let chain = CertificateDer::pem_file_iter(certificate)
            .and_then(|chain| chain.collect::<Result<Vec<_>, _>>())
            .map_err(|error| wrong("certificate", certificate, error.to_string()))?;
        if chain.is_empty() {
            return Err(wrong("certificate", certificate, "it holds none".to_owned()));
        }
        let private = PrivateKeyDer::from_pem_file(key)
            .map_err(|error| wrong("key", key, error.to_string()))?;
        Self::of(chain, private)
    }

    fn of(
        chain: Vec<CertificateDer<'static>>,
        key: PrivateKeyDer<'static>,
    ) -> Result<Self, EncryptionError> {
        let provider = Arc::new(crypto::ring::default_provider());
        let config = rustls::ServerConfig::builder_with_provider(provider)
            .with_protocol_versions(&[&version::TLS13])
            .and_then(|builder| builder.with_no_client_auth().with_single_cert(chain, key))
            .map_err(|error| EncryptionError::Pair(error.to_string()))?;
        Ok(Self(TlsAcceptor::from(Arc::new(config))))
    }

    pub(crate) fn acceptor(&self) -> TlsAcceptor {
        self.0.clone()
    }
}
