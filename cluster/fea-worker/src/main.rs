//! The `fea-worker` program: all ranks start here; rank 0 listens and leads, the others follow.

use std::process::ExitCode;

#[cfg(not(petsc))]
fn main() -> ExitCode {
    use clap::Parser;

    // Usage and version are told all the same.
    let _ = fea_worker::arguments::Arguments::parse();
    eprintln!(
        "fea-worker: it was built without {}; install that and build it again (docs/cluster.md)",
        env!("MISSING")
    );
    ExitCode::FAILURE
}

#[cfg(petsc)]
fn main() -> ExitCode {
    match ranked::run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("fea-worker: {}", softgrasp_os::one_line(error.as_ref()));
            ExitCode::FAILURE
        }
    }
}

#[cfg(petsc)]
mod ranked {
    use std::io::{IsTerminal, Write};
    use std::sync::Arc;

    use anyhow::Context;
    use clap::Parser;
    use fea_server::ServerConfig;
    use fea_worker::arguments::Arguments;
    use fea_worker::job::{Job, follow, lead};
    use fea_worker::petsc::Ranks;

    pub fn run() -> anyhow::Result<()> {
        let arguments = Arguments::parse();
        softgrasp_os::give_back_large_pieces_at_once();
        start_log();
        // What is wrong with the options is known before any rank waits for another.
        let config = arguments.server()?;
        config.check()?;
        let threads = arguments.threads.max(1);
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build_global()
            .context("cannot start the threads that assemble")?;
        let mut ranks = Ranks::start(&arguments.petsc_options)?;
        let worked = match ranks.rank() {
            0 => listen_and_lead(&mut ranks, &arguments, config),
            _ => follow(&mut ranks).map_err(anyhow::Error::from),
        };
        if let Err(error) = worked {
            tracing::error!(rank = ranks.rank(), %error, "the job ends");
            // The others wait for this rank; whoever started the job starts it again.
            ranks.abort();
            return Err(error);
        }
        Ok(ranks.end()?)
    }

    fn listen_and_lead(
        ranks: &mut Ranks,
        arguments: &Arguments,
        config: ServerConfig,
    ) -> anyhow::Result<()> {
        // Rank 0 alone talks to others.
        let _export = softgrasp_telemetry::start_or_warn("fea-worker", env!("CARGO_PKG_VERSION"));
        let (job, asked) = Job::new();
        let server = fea_server::start(ServerConfig { engine: Some(Arc::new(job)), ..config })?;
        let mut out = std::io::stdout();
        // A closed standard output is no reason not to serve.
        let _ = writeln!(out, "listening on {}", server.address());
        let _ = out.flush();
        tracing::info!(address = %server.address(), ranks = ranks.size(), "ready");
        Ok(lead(ranks, &arguments.settings(), &asked)?)
    }

    fn start_log() {
        let filter = tracing_subscriber::EnvFilter::try_from_default_env()
            .unwrap_or_else(|_| tracing_subscriber::EnvFilter::new("info"));
        tracing_subscriber::fmt()
            .with_env_filter(filter)
            .with_ansi(std::io::stderr().is_terminal())
            .with_writer(std::io::stderr)
            .init();
    }
}
