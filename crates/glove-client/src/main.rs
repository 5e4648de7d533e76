//! The `glove-client` program: arguments, exit codes, the one place that prints errors.

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use glove_client::commands::inspect::InspectCommand;
use glove_client::commands::mesh::MeshCommand;
use glove_client::commands::run::RunCommand;
use glove_client::commands::solve::SolveCommand;
use glove_client::interruption;

/// Grasp and squeeze a soft object with an instrumented glove.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Subcommand)]
enum Command {
    Run(RunCommand),
    Solve(SolveCommand),
    Inspect(InspectCommand),
    Mesh(MeshCommand),
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    start_log();
    interruption::watch();
    let outcome = match arguments.command.unwrap_or_else(|| Command::Run(RunCommand::default())) {
        Command::Run(command) => command.run(),
        Command::Solve(command) => command.run(),
        Command::Inspect(command) => command.run(),
        Command::Mesh(command) => command.run(),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("glove-client: {}", one_line(&error));
            ExitCode::FAILURE
        }
    }
}

/// Warnings on standard error; `RUST_LOG` shows more.
fn start_log() {
    let filter = tracing_subscriber::EnvFilter::try_from_default_env()
        .unwrap_or_else(|_| tracing_subscriber::EnvFilter::new("warn"));
    tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).init();
}

/// The error and its causes in one line; a cause that the line already tells is left out.
fn one_line(error: &anyhow::Error) -> String {
    error.chain().fold(String::new(), |line, cause| match cause.to_string() {
        told if line.contains(&told) => line,
        cause if line.is_empty() => cause,
        cause => format!("{line}: {cause}"),
    })
}
