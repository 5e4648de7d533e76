//! The `fea-server` program: log, signals, exit code.

mod credentials;

use std::io::{IsTerminal, Write};
use std::process::ExitCode;
use std::time::Duration;

use anyhow::Context;
use clap::Parser;
use credentials::{Credentials, Renewal};
use fea_server::arguments::{Arguments, LogForm};
use fea_server::{Listening, StartError, make_certificate};
use tokio::sync::watch;

/// Time from the request to end, without the draining, after which the process ends in any case.
const END_MAX: Duration = Duration::from_millis(2700);
/// Exit code for invalid options, the same as clap's.
const WRONG_USAGE: u8 = 2;

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    // What `--memory-limit` counts is what the system sees.
    softgrasp_os::give_back_large_pieces_at_once();
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
        // Of the session around a line once is enough.
        LogForm::Json => log.json().with_span_list(false).init(),
    }
}

fn run(arguments: Arguments) -> anyhow::Result<()> {
    let access = &arguments.access;
    if let (false, Some(certificate), Some(key)) =
        (access.make_certificate.is_empty(), &access.tls_cert, &access.tls_key)
    {
        let (names, days) = (&access.make_certificate, access.certificate_days);
        return Ok(make_certificate(names, days, certificate, key)?);
    }
    let Credentials { tokens, encryption } = Credentials::read(access)?;
    let config = arguments.config(tokens, encryption)?;
    let (stop, stopped) = watch::channel(false);
    let mut ends_in = arguments.drain + END_MAX;
    let input_ended = {
        let stop = stop.clone();
        move || {
            tracing::info!("standard input is closed: asked to end");
            let _ = stop.send(true);
            softgrasp_os::end_within(ends_in);
        }
    };
    let renewal = Renewal::of(access, &config);
    // Before the first thread: all of them leave these signals to the one that waits.
    softgrasp_os::on_end_signal(true, move |signal| {
        if let (true, Some(renewal)) = (signal.is_hang_up, &renewal) {
            return renewal.read_again();
        }
        tracing::info!(signal = signal.name, "asked to end");
        let _ = stop.send(true);
        softgrasp_os::end_within(ends_in);
        // Whoever asks twice does not want to wait.
        ends_in = Duration::ZERO;
    })
    .context("cannot wait for the signals that end the server")?;
    if arguments.end_with_input {
        std::thread::Builder::new()
            .name("input".to_owned())
            .spawn(move || {
                // What cannot be read has ended too.
                let _ = std::io::copy(&mut std::io::stdin(), &mut std::io::sink());
                input_ended();
            })
            .context("cannot wait for the end of standard input")?;
    }
    let _export = softgrasp_telemetry::start_or_warn("fea-server", env!("CARGO_PKG_VERSION"));
    let runtime =
        fea_server::sockets_runtime(&config).context("cannot start the server's sockets")?;
    let served = runtime.block_on(fea_server::serve(config, announce, stopped));
    // Whatever the threads are at, a stop does not wait for them.
    runtime.shutdown_background();
    served?;
    tracing::info!("stopped");
    Ok(())
}

/// Prints the line that tells the address listened on, and that of the status pages, if there are any.
fn announce(listening: Listening) {
    let Listening { address, metrics } = listening;
    let mut out = std::io::stdout();
    // A closed standard output is no reason not to serve.
    let _ = writeln!(out, "listening on {address}");
    if let Some(metrics) = metrics {
        let _ = writeln!(out, "metrics on {metrics}");
    }
    let _ = out.flush();
    tracing::info!(%address, "ready");
}
