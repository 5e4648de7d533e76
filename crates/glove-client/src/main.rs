//! The `glove-client` program: arguments, exit codes, the one place that prints errors.

use std::io::IsTerminal as _;
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use glove_client::commands::align::AlignCommand;
use glove_client::commands::calibrate::CalibrateCommand;
use glove_client::commands::devices::DevicesCommand;
use glove_client::commands::emulate::EmulateCommand;
use glove_client::commands::inspect::InspectCommand;
use glove_client::commands::interruption;
use glove_client::commands::mesh::MeshCommand;
use glove_client::commands::press::PressCommand;
use glove_client::commands::record::RecordCommand;
use glove_client::commands::replay::ReplayCommand;
use glove_client::commands::run::RunCommand;
use glove_client::commands::solve::SolveCommand;
use softgrasp_os::one_line;

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
    Press(PressCommand),
    Record(RecordCommand),
    Replay(ReplayCommand),
    Devices(DevicesCommand),
    Emulate(EmulateCommand),
    Calibrate(CalibrateCommand),
    Align(AlignCommand),
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
        Command::Press(command) => command.run(),
        Command::Record(command) => command.run(),
        Command::Replay(command) => command.run(),
        Command::Devices(command) => command.run(),
        Command::Emulate(command) => command.run(),
        Command::Calibrate(command) => command.run(),
        Command::Align(command) => command.run(),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("glove-client: {}", one_line(error.as_ref()));
            ExitCode::FAILURE
        }
    }
}

/// Warnings on standard error, in colour on a terminal only; `RUST_LOG` shows more.
fn start_log() {
    let is_terminal = std::io::stderr().is_terminal();
    let filter = tracing_subscriber::EnvFilter::try_from_default_env()
        .unwrap_or_else(|_| tracing_subscriber::EnvFilter::new("warn"));
    tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_ansi(is_terminal)
        .with_writer(std::io::stderr)
        .init();
}
