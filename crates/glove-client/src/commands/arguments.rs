//! The whole command line of `glove-client`: its commands, and what each of them is given to do.

use clap::{Parser, Subcommand};

use super::align::AlignCommand;
use super::calibrate::CalibrateCommand;
use super::devices::DevicesCommand;
use super::emulate::EmulateCommand;
use super::fill::FillCommand;
use super::inspect::InspectCommand;
use super::mesh::MeshCommand;
use super::press::PressCommand;
use super::record::RecordCommand;
use super::replay::ReplayCommand;
use super::run::RunCommand;
use super::solve::SolveCommand;

/// Grasp and squeeze a soft object with an instrumented glove.
///
/// Without a command it is `run`: `glove-client`, `glove-client --rate 8`, `glove-client mesh.msh`.
#[derive(Parser)]
#[command(name = "glove-client", version)]
pub struct Arguments {
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

impl Arguments {
    /// Does what the command says.
    ///
    /// # Errors
    /// What the command tells, as one line.
    pub fn run(self) -> anyhow::Result<()> {
        match self.command.unwrap_or_else(|| Command::Run(RunCommand::default())) {
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
        }
    }
}
