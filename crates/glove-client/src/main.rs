//! The `glove-client` program: arguments, exit codes, the one place that prints errors.

use std::io::IsTerminal as _;
use std::process::ExitCode;

use clap::{CommandFactory as _, Parser as _};
use glove_client::commands::arguments::Arguments;
use glove_client::commands::command_line::with_command;
use glove_client::commands::interruption;
use softgrasp_os::one_line;

fn main() -> ExitCode {
    let commands = Arguments::command();
    let is_command = |word: &str| commands.find_subcommand(word).is_some();
    let arguments = Arguments::parse_from(with_command(std::env::args_os(), is_command));
    start_log();
    interruption::watch();
    let _export = softgrasp_telemetry::start_or_warn("glove-client", env!("CARGO_PKG_VERSION"));
    match arguments.run() {
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
