//! The `glove-client` program: arguments, exit codes, the one place that prints errors.

use std::io::IsTerminal as _;
use std::process::ExitCode;

use clap::{CommandFactory as _, Parser, Subcommand};
use glove_client::commands::align::AlignCommand;
use glove_client::commands::calibrate::CalibrateCommand;
use glove_client::commands::command_line::with_command;
use glove_client::commands::devices::DevicesCommand;
use glove_client::commands::emulate::EmulateCommand;
use glove_client::commands::fill::FillCommand;
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
///
/// Without a command it is `run`: `glove-client`, `glove-client --rate 8`, `glove-client mesh.msh`.
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
    Fill(FillCommand),
    Press(PressCommand),
    Record(RecordCommand),
    Replay(ReplayCommand),
    Devices(DevicesCommand),
    Emulate(EmulateCommand),
    Calibrate(CalibrateCommand),
    Align(AlignCommand),
}

fn main() -> ExitCode {
    let commands = Arguments::command();
    let is_command = |word: &str| commands.find_subcommand(word).is_some();
    let arguments = Arguments::parse_from(with_command(std::env::args_os(), is_command));
    start_log();
    interruption::watch();
    let outcome = match arguments.command.unwrap_or_else(|| Command::Run(RunCommand::default())) {
        Command::Run(command) => command.run(),
        Command::Solve(command) => command.run(),
        Command::Inspect(command) => command.run(),
        Command::Mesh(command) => command.run(),
        Command::Fill(command) => command.run(),
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

/// Log filter by default: warnings, but not those of the window's libraries.
const WARNINGS: &str = "warn,winit=off,wgpu=off,wgpu_core=off,wgpu_hal=off,naga=off,kiss3d=off,\
                        egui=off,rfd=off,ashpd=off,zbus=off,sctk=off";

/// Starts the log: warnings on standard error, in colour on a terminal only; `RUST_LOG` shows more. The
/// window's libraries warn of displays and drivers that work all the same.
fn start_log() {
    let is_terminal = std::io::stderr().is_terminal();
    let filter = tracing_subscriber::EnvFilter::try_from_default_env()
        .unwrap_or_else(|_| tracing_subscriber::EnvFilter::new(WARNINGS));
    tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_ansi(is_terminal)
        .with_writer(std::io::stderr)
        .init();
}
