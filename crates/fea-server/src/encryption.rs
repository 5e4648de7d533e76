//! TLS: the certificate and key of a server, and a pair for a lab that has no authority.

use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use tokio_rustls::TlsAcceptor;
use tokio_rustls::rustls::pki_types::pem::PemObject;
use tokio_rustls::rustls::pki_types::{CertificateDer, PrivateKeyDer};
use tokio_rustls::rustls::{self, crypto, version};

/// What a server encrypts with: TLS 1.3, its certificate and key.
#[derive(Clone)]
pub struct Encryption(Arc<rustls::ServerConfig>);

/// Why there is no encryption.
#[derive(Debug, thiserror::Error)]
pub enum EncryptionError {
    /// A file that is no PEM of the right kind.
    #[error(
        "{what} {path} cannot be used: {reason}; PEM is expected, as --make-certificate writes it"
    )]
    File {
        /// `certificate` or `key`.
        what: &'static str,
        /// The file.
        path: PathBuf,
        /// What the reader says.
        reason: String,
    },
    /// Certificate and key do not make a pair that can be served.
    #[error("certificate {certificate} and key {key} cannot be used together: {reason}")]
    Pair {
        /// The certificate's file.
        certificate: PathBuf,
        /// The key's file.
        key: PathBuf,
        /// What the library says.
        reason: String,
    },
    /// Names for which no certificate can be made.
    #[error(
        "no certificate can be made for {names}: {reason}; name hosts or addresses, as in lab.example,192.168.1.5"
    )]
    Names {
        /// As given.
        names: String,
        /// What the library says.
        reason: String,
    },
    /// A file that cannot be written.
    #[error("cannot write {path}: {source}")]
    Write {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
}

impl Encryption {
    /// Reads a chain of certificates and the key of the first, both PEM.
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
            .map_err(|e| wrong("certificate", certificate, e.to_string()))?;
        if chain.is_empty() {
            return Err(wrong("certificate", certificate, "it holds none".to_owned()));
        }
        let private =
            PrivateKeyDer::from_pem_file(key).map_err(|e| wrong("key", key, e.to_string()))?;
        let provider = Arc::new(crypto::ring::default_provider());
        rustls::ServerConfig::builder_with_provider(provider)
            .with_protocol_versions(&[&version::TLS13])
            .map(|builder| builder.with_no_client_auth())
            .and_then(|builder| builder.with_single_cert(chain, private))
            .map(|config| Self(Arc::new(config)))
            .map_err(|e| EncryptionError::Pair {
                certificate: certificate.to_owned(),
                key: key.to_owned(),
                reason: e.to_string(),
            })
    }

    pub(crate) fn acceptor(&self) -> TlsAcceptor {
        TlsAcceptor::from(Arc::clone(&self.0))
    }
}

impl fmt::Debug for Encryption {
    // A key is not for logs.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Encryption")
    }
}

/// Makes a self-signed certificate for hosts and addresses and writes it with its key; the
/// certificate is also what clients trust (`--tls-ca`). The key can be read by its owner only.
///
/// # Errors
/// [`EncryptionError`]; a file that is there already is not overwritten.
pub fn make_certificate(
    names: &[String],
    certificate: &Path,
    key: &Path,
) -> Result<(), EncryptionError> {
    let made = rcgen::generate_simple_self_signed(names.to_vec())
        .map_err(|e| EncryptionError::Names { names: names.join(","), reason: e.to_string() })?;
    write_new(key, &made.signing_key.serialize_pem(), 0o600)?;
    write_new(certificate, &made.cert.pem(), 0o644)
}

fn write_new(path: &Path, text: &str, mode: u32) -> Result<(), EncryptionError> {
    use std::io::Write;
    let mut options = std::fs::OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, mode);
    #[cfg(not(unix))]
    let _ = mode;
    options
        .open(path)
        .and_then(|mut file| file.write_all(text.as_bytes()).and_then(|()| file.sync_all()))
        .map_err(|source| EncryptionError::Write { path: path.to_owned(), source })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pair(folder: &Path) -> (PathBuf, PathBuf) {
        (folder.join("certificate.pem"), folder.join("key.pem"))
    }

    #[test]
    fn a_pair_that_was_made_can_be_served_and_is_not_overwritten() {
        let folder = tempfile::tempdir().unwrap();
        let (certificate, key) = pair(folder.path());
        let names = ["lab.example".to_owned(), "192.168.1.5".to_owned()];
        make_certificate(&names, &certificate, &key).unwrap();
        Encryption::read(&certificate, &key).unwrap();
        let again = make_certificate(&names, &certificate, &key);
        assert!(matches!(again, Err(EncryptionError::Write { .. })), "{again:?}");
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            let mode = std::fs::metadata(&key).unwrap().permissions().mode();
            assert_eq!(mode & 0o777, 0o600);
        }
    }

    #[test]
    fn files_that_are_no_pair_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let (certificate, key) = pair(folder.path());
        make_certificate(&["a".to_owned()], &certificate, &key).unwrap();
        let (other, other_key) = (folder.path().join("other"), folder.path().join("other-key"));
        make_certificate(&["a".to_owned()], &other, &other_key).unwrap();
        let mixed = Encryption::read(&certificate, &other_key);
        assert!(matches!(mixed, Err(EncryptionError::Pair { .. })), "{mixed:?}");
        let swapped = Encryption::read(&key, &certificate);
        assert!(matches!(swapped, Err(EncryptionError::File { what: "certificate", .. })));
        let missing = Encryption::read(&certificate, &folder.path().join("none"));
        assert!(matches!(missing, Err(EncryptionError::File { what: "key", .. })));
    }
}
