//! The options of the `fea-worker` program.

use std::net::{SocketAddr, ToSocketAddrs};
use std::path::PathBuf;

use anyhow::Context;
use clap::Parser;
use fea_server::{Encryption, ServerConfig, Tokens};
use softgrasp_core::solve::memory::Bytes;
use softgrasp_protocol::Limits;

use crate::settings::Settings;

/// Finite element server of Softgrasp over many processes, to be started by mpirun: rank 0 listens.
#[derive(Parser)]
#[command(name = "fea-worker", version)]
pub struct Arguments {
    /// Address that rank 0 listens on, HOST:PORT; port 0 picks a free one.
    #[arg(long, default_value = "127.0.0.1:7900", value_name = "ADDR")]
    listen: String,
    /// Memory that each rank may take: bytes, or 12GiB, 512MiB. What is predicted to need more than all
    /// ranks have is refused before it is made.
    #[arg(long, value_name = "BYTES", default_value = "4GiB")]
    memory_per_rank: Bytes,
    /// Threads of each rank that assemble.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub threads: usize,
    /// Nodes of a mesh.
    #[arg(long, value_name = "N", default_value_t = Limits::LARGEST.node_count_max)]
    max_nodes: u32,
    /// Answers that have the same bits each time on the same number of ranks, at about twice the time.
    #[arg(long)]
    repeatable: bool,
    /// Log a digest of each matrix: it is the same for any number of ranks.
    #[arg(long)]
    digest: bool,
    /// Options of PETSc, as on the command line of its own programs.
    #[arg(long, value_name = "TEXT", default_value = "", allow_hyphen_values = true)]
    pub petsc_options: String,
    /// File whose first line is the token that a client must show.
    #[arg(long, value_name = "F")]
    token_file: Option<PathBuf>,
    /// Encrypt with this certificate (chain), PEM.
    #[arg(long, value_name = "F", requires = "tls_key")]
    tls_cert: Option<PathBuf>,
    /// Key of the certificate, PEM.
    #[arg(long, value_name = "F", requires = "tls_cert")]
    tls_key: Option<PathBuf>,
    /// Listen on an address that other machines can reach without token and encryption.
    #[arg(long)]
    insecure: bool,
}

impl Arguments {
    /// Settings of the job.
    pub fn settings(&self) -> Settings {
        Settings {
            memory_per_rank: self.memory_per_rank,
            is_repeatable: self.repeatable,
            has_digest: self.digest,
        }
    }

    /// Settings of rank 0's server, without the engine.
    ///
    /// # Errors
    /// An address that is none, and files that cannot be used.
    pub fn server(&self) -> anyhow::Result<ServerConfig> {
        let encryption = match (&self.tls_cert, &self.tls_key) {
            (Some(certificate), Some(key)) => Some(Encryption::read(certificate, key)?),
            _ => None,
        };
        Ok(ServerConfig {
            listen: address(&self.listen)?,
            threads: self.threads,
            max_nodes: self.max_nodes,
            max_elements: Limits::LARGEST.tet_count_max,
            max_frame: Limits::LARGEST.payload_len_max,
            memory_limit: self.memory_per_rank.0,
            tokens: self.token_file.as_deref().map(Tokens::read).transpose()?,
            encryption,
            is_insecure: self.insecure,
            ..ServerConfig::default()
        })
    }
}

fn address(text: &str) -> anyhow::Result<SocketAddr> {
    let mut found = text
        .to_socket_addrs()
        .with_context(|| format!("--listen {text} is no address; write HOST:PORT"))?;
    found.next().with_context(|| format!("--listen {text} names no address"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_become_settings() {
        let line = "fea-worker --listen 127.0.0.1:0 --memory-per-rank 512MiB --repeatable";
        let arguments = Arguments::parse_from(line.split(' '));
        let (settings, server) = (arguments.settings(), arguments.server().unwrap());
        assert_eq!(settings.memory_per_rank, Bytes(512 << 20));
        assert!(settings.is_repeatable && !settings.has_digest);
        assert_eq!(server.memory_limit, 512 << 20);
        assert!(Arguments::parse_from(["fea-worker", "--listen", "nowhere"]).server().is_err());
    }
}
