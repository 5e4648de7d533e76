//! The options of the `fea-server` program, and the settings they make.

use std::net::{SocketAddr, ToSocketAddrs};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use anyhow::Context;
use clap::{Parser, ValueEnum};
use softgrasp_core::solve::memory::Bytes;

use crate::cluster::{Cluster, ClusterEndpoint, EndpointError};
use crate::config::ServerConfig;
use crate::encryption::Encryption;
use crate::engine::Engine;
use crate::tokens::Tokens;

/// Finite element server of Softgrasp: solves deformations over TCP, once per frame.
#[derive(Parser)]
#[command(name = "fea-server", version)]
pub struct Arguments {
    /// Address to listen on, HOST:PORT; port 0 picks a free one.
    #[arg(long, default_value = "127.0.0.1:7878", value_name = "ADDR")]
    listen: String,
    /// Threads that solve, exactly as many [default: one per processor]. Frames on what is prepared
    /// have as many of their own, so that they do not wait behind a factor.
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
    /// Ask for real-time scheduling of the thread that reads, answers small frames and writes, so that
    /// they need not wait for other work; for machines on which all clients are trusted.
    #[arg(long)]
    real_time: bool,
    /// Form of the log on standard error; RUST_LOG sets how much.
    #[arg(long, value_enum, default_value_t = LogForm::Text)]
    pub log: LogForm,
    /// Address of the pages /metrics, /health and /ready, HOST:PORT; port 0 picks a free one.
    #[arg(long, value_name = "ADDR")]
    metrics: Option<String>,
    /// Seconds for which sessions may go on after SIGTERM or Ctrl-C; a second signal ends at once.
    #[arg(long, value_name = "S", default_value = "0", value_parser = seconds)]
    pub drain: Duration,
    /// End, as after SIGTERM, when standard input is closed: with the program that holds its other end,
    /// however that ends. What is written to it is passed over.
    #[arg(long)]
    pub end_with_input: bool,
    #[command(flatten)]
    limits: LimitArguments,
    /// Who may come.
    #[command(flatten)]
    pub access: AccessArguments,
    #[command(flatten)]
    cluster: ClusterArguments,
}

/// Who answers what is too large for this server.
#[derive(clap::Args)]
#[command(next_help_heading = "Cluster")]
struct ClusterArguments {
    /// Hand what does not fit into memory over to the fea-worker at this address.
    #[arg(long, value_name = "HOST:PORT")]
    cluster: Option<String>,
    /// File whose first line is the token that the cluster wants.
    #[arg(long, value_name = "F", requires = "cluster")]
    cluster_token_file: Option<PathBuf>,
    /// Encrypt what goes to the cluster, and trust the certificates of this PEM file.
    #[arg(long, value_name = "F", requires = "cluster")]
    cluster_tls_ca: Option<PathBuf>,
}

impl ClusterArguments {
    fn engine(&self) -> Result<Option<Arc<dyn Engine>>, EndpointError> {
        let Some(address) = &self.cluster else { return Ok(None) };
        let (token, tls) = (self.cluster_token_file.as_deref(), self.cluster_tls_ca.as_deref());
        Ok(Some(Arc::new(Cluster::new(ClusterEndpoint::read(address, token, tls)?))))
    }
}

/// Everything that a client can use up, and how far.
#[derive(clap::Args)]
#[command(next_help_heading = "Limits")]
struct LimitArguments {
    /// Nodes of a mesh.
    #[arg(long, value_name = "N", default_value_t = ServerConfig::default().max_nodes)]
    max_nodes: u32,
    /// Elements of a mesh, and at most eight for each node of --max-nodes.
    #[arg(long, value_name = "N", default_value_t = ServerConfig::default().max_elements)]
    max_elements: u32,
    /// Size of one message: bytes, or 64MiB.
    #[arg(long, value_name = "BYTES", default_value = "256MiB")]
    max_frame: Bytes,
    /// Sessions at the same time; one more is turned away.
    #[arg(long, value_name = "N", default_value_t = ServerConfig::default().max_sessions)]
    max_sessions: usize,
    /// Sessions at the same time from one address, other than this machine's own.
    #[arg(long, value_name = "N", default_value_t = ServerConfig::default().max_sessions_per_address)]
    max_sessions_per_address: usize,
    /// Requests of all sessions that wait or are worked on; the next one waits in its connection.
    #[arg(long, value_name = "N", default_value_t = ServerConfig::default().max_queue)]
    max_queue: usize,
    /// Memory for everything that is kept and worked on: bytes, or 8GiB, 512MiB. What needs more is
    /// refused before it is made.
    #[arg(long, value_name = "BYTES", default_value = "8GiB")]
    memory_limit: Bytes,
    /// Memory for the compliance columns kept per model: bytes, or 1GiB, 512MiB.
    #[arg(long, value_name = "BYTES", default_value = "1GiB")]
    column_cache: Bytes,
    /// Seconds after which a model that no session holds is forgotten.
    #[arg(long, value_name = "S", default_value = "600", value_parser = seconds)]
    model_idle_limit: Duration,
    /// Seconds for the first message from the beginning, and for each header from its first byte.
    #[arg(long, value_name = "S", default_value = "10", value_parser = seconds)]
    greeting_limit: Duration,
    /// Seconds without a byte inside a message.
    #[arg(long, value_name = "S", default_value = "30", value_parser = seconds)]
    stall_limit: Duration,
    /// Seconds without a message; without this option a client may rest as long as its machine answers
    /// (it is asked after 30 s and every 10 s).
    #[arg(long, value_name = "S", value_parser = seconds)]
    idle_limit: Option<Duration>,
    /// Seconds for a client to take its reply, and one more for every 64 KiB of it.
    #[arg(long, value_name = "S", default_value = "60", value_parser = seconds)]
    reply_limit: Duration,
}

/// Who may come, and what others can read.
#[derive(Clone, clap::Args)]
#[command(next_help_heading = "Access")]
pub struct AccessArguments {
    /// File whose first line is the token a client must show; or of lines with several tokens, each
    /// name=NAME token=TOKEN [sessions=N]. SIGHUP reads it again.
    #[arg(long, value_name = "F")]
    pub token_file: Option<PathBuf>,
    /// Encrypt with this certificate (chain), PEM. SIGHUP reads it and its key again.
    #[arg(long, value_name = "F", requires = "tls_key")]
    pub tls_cert: Option<PathBuf>,
    /// Key of the certificate, PEM.
    #[arg(long, value_name = "F", requires = "tls_cert")]
    pub tls_key: Option<PathBuf>,
    /// Make a self-signed certificate for these hosts and addresses, write it and its key to the files
    /// of --tls-cert and --tls-key, and end; clients trust the same file (--tls-ca).
    #[arg(long, value_name = "HOST,...", value_delimiter = ',', requires = "tls_cert")]
    pub make_certificate: Vec<String>,
    /// Days for which that certificate is valid.
    #[arg(long, value_name = "N", default_value = "730", requires = "make_certificate",
        value_parser = clap::value_parser!(u32).range(1..=36_500))]
    pub certificate_days: u32,
    /// Listen on an address that other machines can reach without token and encryption: whoever reaches
    /// it can use this server and read what others send.
    #[arg(long)]
    insecure: bool,
}

/// Form of the log: lines for a person, or one object in a line for programs.
#[derive(Clone, Copy, ValueEnum)]
#[allow(missing_docs, reason = "a sentence here would be one more in --help")]
pub enum LogForm {
    Text,
    Json,
}

/// No limit in time is longer than a year.
const SECONDS_MAX: f64 = 365.0 * 86_400.0;

fn seconds(text: &str) -> Result<Duration, String> {
    match text.parse::<f64>() {
        Ok(seconds) if (0.0..=SECONDS_MAX).contains(&seconds) => {
            Ok(Duration::from_secs_f64(seconds))
        }
        _ => Err("write seconds from 0 to a year's, as 10 or 0.5".to_owned()),
    }
}

impl Arguments {
    /// The settings, with what the files of [`AccessArguments`] held.
    ///
    /// # Errors
    /// An address that is none, and files of `--cluster` that cannot be used.
    pub fn config(
        &self,
        tokens: Option<Tokens>,
        encryption: Option<Encryption>,
    ) -> anyhow::Result<ServerConfig> {
        let usual = ServerConfig::default();
        let Self { limits, access, .. } = self;
        let metrics = self.metrics.as_deref().map(|text| address("--metrics", text)).transpose()?;
        Ok(ServerConfig {
            listen: address("--listen", &self.listen)?,
            threads: self.threads.unwrap_or(usual.threads),
            max_nodes: limits.max_nodes,
            max_elements: limits.max_elements,
            max_frame: u32::try_from(limits.max_frame.0).unwrap_or(u32::MAX),
            max_sessions: limits.max_sessions,
            max_sessions_per_address: limits.max_sessions_per_address,
            max_queue: limits.max_queue,
            memory_limit: limits.memory_limit.0,
            column_cache: limits.column_cache.0,
            model_idle_limit: limits.model_idle_limit,
            greeting_limit: limits.greeting_limit,
            stall_limit: limits.stall_limit,
            idle_limit: limits.idle_limit,
            reply_limit: limits.reply_limit,
            drain: self.drain,
            metrics,
            tokens,
            encryption,
            is_insecure: access.insecure,
            measure_at_start: true,
            real_time: self.real_time,
            engine: self.cluster.engine()?,
            ..usual
        })
    }
}

fn address(option: &str, text: &str) -> anyhow::Result<SocketAddr> {
    let mut found = text.to_socket_addrs().with_context(|| {
        format!("{option} {text} is no address; write HOST:PORT, for example 127.0.0.1:7878")
    })?;
    found.next().with_context(|| format!("{option} {text} names no address"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_left_out_are_the_settings_of_the_library() {
        let made = Arguments::parse_from(["fea-server"]).config(None, None).unwrap();
        let usual = ServerConfig { measure_at_start: true, ..ServerConfig::default() };
        assert_eq!(format!("{made:?}"), format!("{usual:?}"));
    }

    #[test]
    fn seconds_are_not_negative_and_no_words() {
        assert_eq!(seconds("0.5"), Ok(Duration::from_millis(500)));
        for text in ["-1", "nan", "inf", "1e300", "ten", ""] {
            assert!(seconds(text).is_err(), "{text}");
        }
    }
}
