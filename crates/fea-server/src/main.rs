//! The `fea-server` program: arguments, log, signals.

use std::io::{IsTerminal, Write};
use std::net::{SocketAddr, ToSocketAddrs};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use anyhow::Context;
use clap::{Parser, ValueEnum};
use fea_server::{Encryption, ServerConfig, StartError, make_certificate};
use softgrasp_core::solve::memory::Bytes;
use tokio::sync::watch;

/// Finite element server of Softgrasp: solves deformations over TCP, once per frame.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    /// Address to listen on, HOST:PORT; port 0 picks a free one.
    #[arg(long, default_value = "127.0.0.1:7878", value_name = "ADDR")]
    listen: String,
    /// Threads that solve, exactly as many [default: one per processor].
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
    /// Largest number of nodes of a mesh.
    #[arg(long, value_name = "N", default_value_t = ServerConfig::default().max_nodes)]
    max_nodes: u32,
    /// Sessions at the same time.
    #[arg(long, value_name = "N", default_value_t = ServerConfig::default().max_sessions)]
    max_sessions: usize,
    /// Sessions at the same time from one address, other than this machine's own.
    #[arg(long, value_name = "N", default_value_t = ServerConfig::default().max_sessions_per_address)]
    max_sessions_per_address: usize,
    /// Memory for everything that is kept and worked on: bytes, or 8GiB, 512MiB. What needs more is
    /// refused before it is made.
    #[arg(long, value_name = "BYTES", default_value = "8GiB")]
    memory_limit: Bytes,
    /// Memory for the compliance columns kept per model: bytes, or 1GiB, 512MiB.
    #[arg(long, value_name = "BYTES", default_value = "1GiB")]
    column_cache: Bytes,
    /// Ask for real-time scheduling of the thread that reads, answers small frames and writes, so that
    /// they need not wait for other work; for machines on which all clients are trusted.
    #[arg(long)]
    real_time: bool,
    /// File whose first line is the token a client must show.
    #[arg(long, value_name = "F")]
    token_file: Option<PathBuf>,
    /// Encrypt with this certificate (chain), PEM.
    #[arg(long, value_name = "F", requires = "tls_key")]
    tls_cert: Option<PathBuf>,
    /// Key of the certificate, PEM.
    #[arg(long, value_name = "F", requires = "tls_cert")]
    tls_key: Option<PathBuf>,
    /// Make a self-signed certificate for these hosts and addresses, write it and its key to the files
    /// of --tls-cert and --tls-key, and end; clients trust the same file (--tls-ca).
    #[arg(long, value_name = "HOST,...", value_delimiter = ',', requires = "tls_cert")]
    make_certificate: Vec<String>,
    /// Listen on an address that other machines can reach without token and encryption: whoever reaches
    /// it can use this server and read what others send.
    #[arg(long)]
    insecure: bool,
    /// Form of the log on standard error; RUST_LOG sets how much.
    #[arg(long, value_enum, default_value_t = LogForm::Text)]
    log: LogForm,
}

#[derive(Clone, Copy, ValueEnum)]
enum LogForm {
    Text,
    Json,
}

/// The server has ended so long after it was asked to, whatever its threads are at.
const END_MAX: Duration = Duration::from_millis(2700);
/// Exit code for options that make no sense, as clap's own.
const WRONG_USAGE: u8 = 2;

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    start_log(arguments.log);
    match run(arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("fea-server: {}", softgrasp_os::one_line(error.as_ref()));
            match error.downcast_ref() {
                Some(StartError::Config(_)) => ExitCode::from(WRONG_USAGE),
                _ => ExitCode::FAILURE,
            }
        }
    }
}

fn start_log(form: LogForm) {
    let filter = tracing_subscriber::EnvFilter::try_from_default_env()
        .unwrap_or_else(|_| tracing_subscriber::EnvFilter::new("info"));
    // Colour is for a person at a terminal; a file or another program gets plain text.
    let log = tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_ansi(std::io::stderr().is_terminal())
        .with_writer(std::io::stderr);
    match form {
        LogForm::Text => log.init(),
        LogForm::Json => log.json().init(),
    }
}

fn run(arguments: Arguments) -> anyhow::Result<()> {
    if let (false, Some(certificate), Some(key)) =
        (arguments.make_certificate.is_empty(), &arguments.tls_cert, &arguments.tls_key)
    {
        return Ok(make_certificate(&arguments.make_certificate, certificate, key)?);
    }
    let config = config(&arguments)?;
    let (stop, stopped) = watch::channel(false);
    // Before the first thread: all of them leave these signals to the one that waits.
    softgrasp_os::on_end_signal(false, move |signal| {
        tracing::info!(signal = signal.name, "asked to end");
        let _ = stop.send(true);
        softgrasp_os::end_within(END_MAX);
    })
    .context("cannot wait for the signals that end the server")?;
    let runtime =
        fea_server::sockets_runtime(&config).context("cannot start the server's sockets")?;
    let served = runtime.block_on(fea_server::serve(config, announce, stopped));
    // Whatever the threads are at, a stop does not wait for them.
    runtime.shutdown_background();
    served?;
    tracing::info!("stopped");
    Ok(())
}

fn config(arguments: &Arguments) -> anyhow::Result<ServerConfig> {
    let usual = ServerConfig::default();
    let token_file = arguments.token_file.as_deref();
    let token = token_file.map(softgrasp_os::read_token).transpose()?;
    let encryption = match (&arguments.tls_cert, &arguments.tls_key) {
        (Some(certificate), Some(key)) => Some(Encryption::read(certificate, key)?),
        _ => None,
    };
    Ok(ServerConfig {
        listen: address(&arguments.listen)?,
        threads: arguments.threads.unwrap_or(usual.threads),
        max_nodes: arguments.max_nodes,
        max_sessions: arguments.max_sessions,
        max_sessions_per_address: arguments.max_sessions_per_address,
        memory_limit: arguments.memory_limit.0,
        column_cache: arguments.column_cache.0,
        token,
        encryption,
        is_insecure: arguments.insecure,
        measure_at_start: true,
        real_time: arguments.real_time,
        ..usual
    })
}

fn address(text: &str) -> anyhow::Result<SocketAddr> {
    let mut found = text.to_socket_addrs().with_context(|| {
        format!("--listen {text} is no address; write HOST:PORT, for example 127.0.0.1:7878")
    })?;
    found.next().with_context(|| format!("--listen {text} names no address"))
}

/// The contract's first line on standard output.
fn announce(address: SocketAddr) {
    let mut out = std::io::stdout();
    // A closed standard output is no reason not to serve.
    let _ = writeln!(out, "listening on {address}").and_then(|()| out.flush());
    tracing::info!(%address, "ready");
}
