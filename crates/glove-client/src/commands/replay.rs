//! `glove-client replay`: plays a recording again, and tells whether the results are the same.

use std::path::PathBuf;

use anyhow::bail;
use clap::Args;
use softgrasp_grasp::object::ObjectChoice;
use softgrasp_hand::hand_request::HandRequest;

use super::access_arguments::AccessArguments;
use super::hand_arguments::HandArguments;
use super::numbers::{count, speed};
use super::run::RunCommand;
use super::run_arguments::RunArguments;
use super::tell_report::tell;
use crate::ask::connection::ServerChoice;

/// Play a recording again without a window, and hold what comes out against it.
#[derive(Args)]
pub struct ReplayCommand {
    /// The recording (MCAP), made with `run --record`.
    #[arg(value_name = "F.mcap")]
    recording: PathBuf,
    /// Ends with exit code 1 if anything differs, and names the tick and the first stage that does:
    /// pose, contacts, request or displacement; also if the recording is damaged or not complete.
    #[arg(long)]
    check: bool,
    /// How fast: 1 as it was, 0 as fast as it goes.
    #[arg(long, value_name = "FACTOR", value_parser = speed, default_value = "0", allow_hyphen_values = true)]
    speed: f64,
    /// The recorded object, where its mesh file is not below the recording's folder any more.
    #[arg(long, value_name = "FILE|SHAPE")]
    object: Option<ObjectChoice>,
    /// Where to solve: HOST:PORT, or embedded [default: embedded].
    #[arg(long, value_name = "ADDR|embedded")]
    server: Option<ServerChoice>,
    #[command(flatten)]
    access: AccessArguments,
    /// Threads of the embedded server [default: one per processor].
    #[arg(long, value_name = "N", value_parser = count, allow_hyphen_values = true)]
    threads: Option<usize>,
    /// File for a JSON report.
    #[arg(long, value_name = "F.json")]
    report: Option<PathBuf>,
}

impl ReplayCommand {
    /// Plays the recording and compares.
    ///
    /// # Errors
    /// One line: why the recording cannot be played, or what differs.
    pub fn run(&self) -> anyhow::Result<()> {
        let arguments = RunArguments {
            hand: HandArguments::of(HandRequest::Replay(self.recording.clone())),
            speed: Some(self.speed),
            object: self.object.iter().cloned().collect(),
            server: self.server.clone(),
            access: self.access.clone(),
            threads: self.threads,
            report: self.report.clone(),
            headless: true,
            ..RunArguments::default()
        };
        let run = RunCommand { arguments };
        let report = run.without_window(&run.arguments.plan()?, None)?;
        tell(self.report.as_deref(), &report)?;
        match report.replay.as_ref().and_then(|replay| replay.failed(report.interrupted)) {
            Some(failed) if self.check => bail!(failed),
            Some(_) | None => Ok(()),
        }
    }
}
