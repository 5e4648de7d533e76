//! `glove-client run`: the main job. A hand grasps and squeezes an object, the server solves.

use std::sync::mpsc::channel;
use std::time::Duration;

use anyhow::{Context as _, bail};
use clap::Args;

use super::device_sentences::DeviceSentences;
use super::key_frames::KeyFrames;
use super::run_arguments::RunArguments;
use super::run_page::{PageTalk, RunPage};
use super::run_pictures::RunPictures;
use super::run_plan::RunPlan;
use super::run_series::RunSeries;
use super::run_setup::{ReadyRun, Setup, SetupStage, make_ready};
#[cfg(feature = "window")]
use super::run_window;
use super::tell_report::tell;
use crate::commands::interruption;
use crate::commands::output::Progress;
use crate::pace::{Due, Pace};
use crate::run::run_report::RunReport;
use crate::run::session::Session;
use crate::run::status_line::StatusLine;
use crate::run::tick_loop::{TickLoop, Timing};
use crate::run::tick_outcome::TickOutcome;
use softgrasp_hand::hand_request::HandRequest;
use softgrasp_window::view::control::Control;

/// Files that a run without a window writes beside its ticks.
struct RunFiles {
    key_frames: Option<KeyFrames>,
    series: Option<RunSeries>,
    pictures: Option<RunPictures>,
}

impl RunFiles {
    /// Adds what is wanted of a tick.
    fn add(
        &mut self,
        due: Due,
        now_s: f64,
        outcome: &TickOutcome,
        session: &Session,
    ) -> anyhow::Result<()> {
        if let Some(pictures) = &mut self.pictures {
            pictures.add(due, now_s, outcome, session)?;
        }
        if let Some(series) = &mut self.series {
            series.add(due.tick, session.grasp_loop())?;
        }
        match &mut self.key_frames {
            Some(frames) => frames.add(due.tick, outcome, session.grasp_loop().object()),
            None => Ok(()),
        }
    }

    /// Waits until all files are written.
    fn finish(self) -> anyhow::Result<()> {
        let Self { key_frames, series, pictures } = self;
        key_frames.map_or(Ok(()), KeyFrames::finish)?;
        series.map_or(Ok(()), RunSeries::finish)?;
        pictures.map_or(Ok(()), RunPictures::finish)
    }
}

/// Grasp and squeeze an object (the main job; also what `glove-client` alone does).
#[derive(Args, Default)]
pub struct RunCommand {
    #[command(flatten)]
    pub(super) arguments: RunArguments,
}

/// Longest wait for the server to prepare the object before a lockstep run begins.
const START_WAIT_MAX: Duration = Duration::from_secs(60);

impl RunCommand {
    /// Plays the run and writes its report.
    ///
    /// # Errors
    /// One line each: what happened, where, and what to do. A run in which answers were asked for
    /// and none came is a failure too; its report is written and its summary printed.
    pub fn run(&self) -> anyhow::Result<()> {
        let plan = self.arguments.plan()?;
        let mut page = RunPage::open(&self.arguments, &plan)?;
        match self.in_window(&plan, &mut page)? {
            Shown::InWindow(Some(report)) => tell(self.arguments.report.as_deref(), &report),
            Shown::InWindow(None) => Ok(()),
            Shown::Not => {
                let report = self.without_window(&plan, page)?;
                tell(self.arguments.report.as_deref(), &report)
            }
        }
    }

    #[cfg(feature = "window")]
    fn in_window(&self, plan: &RunPlan, page: &mut Option<RunPage>) -> anyhow::Result<Shown> {
        if self.arguments.is_without_window() {
            return Ok(Shown::Not);
        }
        let opened = run_window::show(&self.arguments, plan, page)?;
        Ok(opened.map_or(Shown::Not, |report| Shown::InWindow(report.map(Box::new))))
    }

    #[cfg(not(feature = "window"))]
    #[expect(clippy::unnecessary_wraps, reason = "a build with a window can fail here")]
    fn in_window(&self, _plan: &RunPlan, _: &mut Option<RunPage>) -> anyhow::Result<Shown> {
        if !self.arguments.headless {
            eprintln!("glove-client: this build has no window; running without one");
        }
        Ok(Shown::Not)
    }

    /// Plays without a window; shows a status line on a terminal.
    pub(super) fn without_window(
        &self,
        plan: &RunPlan,
        mut page: Option<RunPage>,
    ) -> anyhow::Result<RunReport> {
        if plan.sources().any(|source| *source == HandRequest::Mouse) {
            bail!(
                "--hand mouse needs the window: a run without one has nothing to be moved by; \
                   take --hand scripted"
            );
        }
        let pictures = RunPictures::start(&self.arguments, plan)?;
        let progress = Progress::start("preparing the object");
        let setup = self.setup(plan, page.as_ref());
        let at = |stage| match stage {
            SetupStage::Object(_) => {}
            SetupStage::Server => progress.now("starting the server"),
        };
        let mut key_frames = None;
        let ReadyRun { session, host: _host } = make_ready(plan, &setup, at, |object| {
            if let Some(folder) = &self.arguments.out_dir {
                key_frames = Some(KeyFrames::start(folder, object)?);
            }
            Ok(())
        })?;
        drop(progress);
        let series = self.arguments.series.as_deref();
        let series = series.map(|folder| RunSeries::start(folder, plan.tick_s())).transpose()?;
        let mut session = session;
        session.apply(Control::SetForces(pictures.is_some()));
        let mut files = RunFiles { key_frames, series, pictures };
        if plan.pace == Pace::Lockstep {
            // From the first tick on the server is there, so that every run tells the same story.
            session.wait_idle(START_WAIT_MAX);
        }
        let mut status = StatusLine::start();
        let mut sentences = DeviceSentences::start(status.speaker())
            .context("cannot start a thread beside the ticks")?;
        let timing = Timing { period: plan.period, ticks_max: self.arguments.ticks };
        // Without a window and a page nobody asks for anything and nobody is told.
        let (controls, to_obey) = channel();
        let (to_tell, notices) = channel();
        if let Some(page) = &mut page {
            session.await_model();
            let controls = controls.clone();
            page.begin(&self.arguments, plan, PageTalk { controls, notices, has_window: false })?;
        }
        let ticks = TickLoop::new(&mut session, timing, &to_obey, &to_tell);
        let interrupted = ticks.play(interruption::asked, |session, outcome, due, now_s| {
            status.show(due.tick, outcome);
            sentences.hear(outcome);
            if let Some(page) = &mut page {
                page.add(due, now_s, outcome, session);
            }
            files.add(due, now_s, outcome, session)
        })?;
        drop(sentences);
        drop(status);
        drop((page, controls));
        files.finish()?;
        Ok(session.finish(interrupted)?)
    }

    /// Setup of a run without a window.
    fn setup(&self, plan: &RunPlan, page: Option<&RunPage>) -> Setup {
        let shown_slowly = self.arguments.shown.animation.is_some() || page.is_some();
        Setup {
            record: self.arguments.record.clone(),
            report: self.arguments.report.clone(),
            threads: self.arguments.threads,
            // Whoever looks at the page sees the story again.
            ends_with_script: self.arguments.ticks.is_none()
                && (page.is_none() || !self.arguments.begins_anew(plan)),
            squeeze_times: if shown_slowly { 3 } else { 1 },
            joints: page.map(RunPage::joints),
        }
    }
}

/// Whether a window has shown the run.
enum Shown {
    /// A window has shown the run; its report, if it began.
    #[cfg_attr(not(feature = "window"), expect(dead_code, reason = "this build has no window"))]
    InWindow(Option<Box<RunReport>>),
    /// No window has shown the run.
    Not,
}
