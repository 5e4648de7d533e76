//! `glove-client record`: a run that is recorded.

use std::path::PathBuf;

use clap::Args;

use super::run::RunCommand;
use super::run_arguments::RunArguments;

/// Record a run: the same as `run --record F.mcap`.
#[derive(Args)]
pub struct RecordCommand {
    /// The recording to write (MCAP).
    #[arg(value_name = "F.mcap")]
    recording: PathBuf,
    #[command(flatten)]
    run: RunCommand,
}

impl RecordCommand {
    /// Plays the scene and records it.
    ///
    /// # Errors
    /// The same as those of [`RunCommand::run`].
    pub fn run(&self) -> anyhow::Result<()> {
        let record = Some(self.recording.clone());
        RunCommand { arguments: RunArguments { record, ..self.run.arguments.clone() } }.run()
    }
}
