//! The arguments of `glove-client run` that serve a page for browsers and headsets.

use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::PathBuf;

use clap::Args;

/// The page.
#[derive(Args, Clone, Default)]
pub struct PageArguments {
    /// Serve a page that shows the run in any browser, and lets a headset's hand take part with
    /// --hand xr: IP:PORT or localhost:PORT.
    #[arg(long, value_name = "ADDR", value_parser = page_address)]
    pub(super) xr: Option<SocketAddr>,
    /// Encrypt the page with a pair that is made at the start: headsets track hands over https only.
    #[arg(long, requires = "xr")]
    pub(super) xr_tls: bool,
    /// Certificate to encrypt the page with (PEM).
    #[arg(long, value_name = "F.pem", requires_all = ["xr", "xr_key"], conflicts_with = "xr_tls")]
    pub(super) xr_cert: Option<PathBuf>,
    /// Its key (PEM).
    #[arg(long, value_name = "F.pem", requires_all = ["xr", "xr_cert"])]
    pub(super) xr_key: Option<PathBuf>,
}

/// Parses the address that the page is served at.
fn page_address(text: &str) -> Result<SocketAddr, String> {
    let port = text.strip_prefix("localhost:").and_then(|port| port.parse().ok());
    let local = port.map(|port| SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), port));
    let address = local.or_else(|| text.parse().ok());
    address.ok_or_else(|| {
        format!("'{text}' is not IP:PORT or localhost:PORT, such as 127.0.0.1:8080 or 0.0.0.0:8080")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn address_has_an_ip_or_localhost_and_a_port() {
        for (text, address) in [
            ("localhost:8080", "127.0.0.1:8080"),
            ("0.0.0.0:1", "0.0.0.0:1"),
            ("[::1]:9", "[::1]:9"),
        ] {
            assert_eq!(page_address(text).unwrap().to_string(), address);
        }
        for text in ["8080", "localhost", "localhost:x", "somewhere:80", "127.0.0.1:70000", ""] {
            assert!(page_address(text).unwrap_err().contains("IP:PORT"), "{text}");
        }
    }
}
