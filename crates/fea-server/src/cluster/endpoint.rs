//! Where a cluster listens, the token it wants, and the certificates that are trusted.

use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use softgrasp_os::{TokenFileError, read_token};
use tokio_rustls::TlsConnector;
use tokio_rustls::rustls::pki_types::pem::PemObject;
use tokio_rustls::rustls::pki_types::{CertificateDer, ServerName};
use tokio_rustls::rustls::{ClientConfig, RootCertStore, crypto, version};

/// Address of a cluster, with token and trusted certificates.
#[derive(Clone)]
pub struct ClusterEndpoint {
    pub(super) address: String,
    pub(super) token: Option<String>,
    pub(super) tls: Option<(TlsConnector, ServerName<'static>)>,
}

/// Why a cluster cannot be talked to.
#[derive(Debug, thiserror::Error)]
pub enum EndpointError {
    /// The address has no port.
    #[error("--cluster {address} is no address; write HOST:PORT")]
    Address {
        /// Address as it was given.
        address: String,
    },
    /// The token cannot be read.
    #[error("--cluster-token-file: {0}")]
    Token(#[from] TokenFileError),
    /// The certificates cannot be used.
    #[error(
        "--cluster-tls-ca {path} cannot be used: {reason}; a PEM file with certificates is expected"
    )]
    Certificates {
        /// Path of the file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// The host is none that a certificate can name.
    #[error("no certificate can name the host of --cluster {address}")]
    Host {
        /// Address as it was given.
        address: String,
    },
}

impl ClusterEndpoint {
    /// The cluster at `HOST:PORT`; reads token and certificates if files are named.
    ///
    /// # Errors
    /// [`EndpointError`] that names the option.
    pub fn read(
        address: &str,
        token_file: Option<&Path>,
        tls_ca: Option<&Path>,
    ) -> Result<Self, EndpointError> {
        let named = || address.to_owned();
        let (host, port) =
            address.rsplit_once(':').ok_or_else(|| EndpointError::Address { address: named() })?;
        if host.is_empty() || port.parse::<u16>().is_err() {
            return Err(EndpointError::Address { address: named() });
        }
        let token = token_file.map(read_token).transpose()?;
        let tls = match tls_ca {
            None => None,
            Some(path) => {
                let host = host.trim_start_matches('[').trim_end_matches(']').to_owned();
                let name = ServerName::try_from(host)
                    .map_err(|_| EndpointError::Host { address: named() })?;
                Some((connector(path)?, name))
            }
        };
        Ok(Self { address: named(), token, tls })
    }
}

impl fmt::Debug for ClusterEndpoint {
    // A token is not for logs.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ClusterEndpoint")
            .field("address", &self.address)
            .field("encrypted", &self.tls.is_some())
            .finish_non_exhaustive()
    }
}

fn connector(path: &Path) -> Result<TlsConnector, EndpointError> {
    let wrong = |reason: String| EndpointError::Certificates { path: path.to_owned(), reason };
    let mut roots = RootCertStore::empty();
    let certificates = CertificateDer::pem_file_iter(path).map_err(|e| wrong(e.to_string()))?;
    for certificate in certificates {
        let certificate = certificate.map_err(|e| wrong(e.to_string()))?;
        roots.add(certificate).map_err(|e| wrong(e.to_string()))?;
    }
    if roots.is_empty() {
        return Err(wrong("it holds no certificate".to_owned()));
    }
    let provider = Arc::new(crypto::ring::default_provider());
    let config = ClientConfig::builder_with_provider(provider)
        .with_protocol_versions(&[&version::TLS13])
        .map_err(|e| wrong(e.to_string()))?
        .with_root_certificates(roots)
        .with_no_client_auth();
    Ok(TlsConnector::from(Arc::new(config)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_address_and_files_without_use_are_named() {
        for address in ["lab", ":7900", "lab:", "lab:seventy"] {
            let error = ClusterEndpoint::read(address, None, None).unwrap_err().to_string();
            assert!(error.contains("--cluster") && error.contains(address), "{error}");
        }
        let folder = tempfile::tempdir().unwrap();
        let empty = folder.path().join("empty");
        std::fs::write(&empty, "\n").unwrap();
        let token = ClusterEndpoint::read("lab:1", Some(&empty), None).unwrap_err().to_string();
        assert!(token.contains("--cluster-token-file"), "{token}");
        let trusted = ClusterEndpoint::read("lab:1", None, Some(&empty)).unwrap_err().to_string();
        assert!(trusted.contains("--cluster-tls-ca"), "{trusted}");
        std::fs::write(&empty, "hush hush\n").unwrap();
        let read = ClusterEndpoint::read("[::1]:7900", Some(&empty), None).unwrap();
        assert_eq!(read.token.as_deref(), Some("hush hush"));
        assert!(!format!("{read:?}").contains("hush"));
    }
}
