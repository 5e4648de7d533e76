//! Server to connect to: its address, the token it requires, and the certificates that are trusted.

use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, ServerName};
use rustls::{ClientConfig, ClientConnection, RootCertStore, crypto, version};

/// Server, with token and trusted certificates.
#[derive(Clone, Debug)]
pub struct Endpoint {
    /// Address `HOST:PORT` of the server.
    pub address: String,
    /// Token to be shown to the server; `None` for none.
    pub token: Option<String>,
    /// Certificates that are trusted; `None`: no encryption.
    pub trust: Option<Trust>,
}

impl From<&str> for Endpoint {
    fn from(address: &str) -> Self {
        Self { address: address.to_owned(), token: None, trust: None }
    }
}

impl From<&String> for Endpoint {
    fn from(address: &String) -> Self {
        Self::from(address.as_str())
    }
}

impl From<String> for Endpoint {
    fn from(address: String) -> Self {
        Self { address, token: None, trust: None }
    }
}

impl From<&Self> for Endpoint {
    fn from(endpoint: &Self) -> Self {
        endpoint.clone()
    }
}

impl Endpoint {
    /// The same server with a token.
    #[must_use]
    pub fn with_token(self, token: Option<&str>) -> Self {
        Self { token: token.map(str::to_owned), ..self }
    }

    /// Host of the address, without its port.
    pub fn host(&self) -> &str {
        let host = self.address.rsplit_once(':').map_or(self.address.as_str(), |(host, _)| host);
        host.trim_start_matches('[').trim_end_matches(']')
    }
}

/// Certificates that the server's certificate is checked against.
#[derive(Clone)]
pub struct Trust(Arc<ClientConfig>);

impl fmt::Debug for Trust {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Trust")
    }
}

/// Why a server cannot be trusted.
#[derive(Debug, thiserror::Error)]
pub enum TrustError {
    /// The file contains no certificate that can be used.
    #[error("--tls-ca {path} cannot be used: {reason}; a PEM file with certificates is expected")]
    File {
        /// Path of the file.
        path: PathBuf,
        /// Reason given by the PEM reader.
        reason: String,
    },
    /// The TLS library refuses the settings.
    #[error("TLS cannot be used here: {0}")]
    Tls(#[from] rustls::Error),
    /// The host is none that a certificate can name.
    #[error("no certificate can name the host {host}; write a host name or an address")]
    Host {
        /// Host as it was given.
        host: String,
    },
}

impl Trust {
    /// Trusts the certificates of a PEM file: an authority's, or a server's own self-signed one.
    ///
    /// # Errors
    /// [`TrustError`] if the file contains no certificate that can be used.
    pub fn read(path: &Path) -> Result<Self, TrustError> {
        let wrong = |reason: String| TrustError::File { path: path.to_owned(), reason };
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
            .with_protocol_versions(&[&version::TLS13])?
            .with_root_certificates(roots)
            .with_no_client_auth();
        Ok(Self(Arc::new(config)))
    }

    /// Client's side of a TLS connection to a host.
    ///
    /// # Errors
    /// [`TrustError`] if no certificate can name the host.
    pub fn session(&self, host: &str) -> Result<ClientConnection, TrustError> {
        let name = ServerName::try_from(host.to_owned())
            .map_err(|_| TrustError::Host { host: host.to_owned() })?;
        Ok(ClientConnection::new(Arc::clone(&self.0), name)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn host_is_the_address_without_port_and_brackets() {
        for (address, host) in
            [("lab.example:7878", "lab.example"), ("[::1]:7878", "::1"), ("10.0.0.1:1", "10.0.0.1")]
        {
            assert_eq!(Endpoint::from(address).host(), host);
        }
    }

    #[test]
    fn files_without_certificates_are_refused_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let empty = folder.path().join("empty.pem");
        std::fs::write(&empty, "no certificate").unwrap();
        for path in [empty, folder.path().join("missing.pem")] {
            let error = Trust::read(&path).unwrap_err().to_string();
            assert!(error.contains(&path.display().to_string()), "{error}");
        }
    }
}
