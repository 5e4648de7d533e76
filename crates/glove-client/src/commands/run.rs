//! `glove-client run`: the main job. A hand grasps and squeezes an object, the server solves.

use std::io::IsTerminal as _;
use std::time::{Duration, Instant};

use anyhow::{Context, bail};
use clap::Args;
use nalgebra::Isometry3;
use softgrasp_core::grasp::Grasp;

use super::key_frames::KeyFrames;
use super::output::{print, write_json};
use super::run_arguments::{RunArguments, RunPlan};
use crate::connection::Host;
use crate::grasp_loop::GraspLoop;
use crate::hand_reader::{HandReader, HandSetup};
use crate::interruption;
use crate::link::Link;
use crate::pace::{Due, Pace, Schedule, wait_until};
use crate::progress::Progress;
use crate::run_report::{ObjectSummary, RunReport};
use crate::scene::{ObjectChoice, SceneObject, load_object};
use crate::scripted::{NoGrasp, Planner, ScriptedHand};
use crate::session::{Session, priority_for};
use crate::soft_object::SoftObject;
use crate::status_line::StatusLine;
use crate::tick_budget::Priority;

/// Grasp and squeeze an object (the main job; also what `glove-client` alone does).
#[derive(Args, Default)]
pub struct RunCommand {
    #[command(flatten)]
    arguments: RunArguments,
}

/// Longest wait for the server to prepare the object before a lockstep run begins.
const START_WAIT_MAX: Duration = Duration::from_secs(60);

/// Factor by which an imported object grows while the hand finds no grip, and where it ends, m.
const ENLARGE: f64 = 1.25;
const ENLARGED_MAX_M: f64 = 0.2;
/// Ticks per second of a scripted hand without `--rate`, on the client's clock.
const LOCKSTEP_RATE_HZ: f64 = 60.0;

impl RunCommand {
    /// Plays the scene.
    ///
    /// # Errors
    /// One line each: what happened, where, and what to do. A run in which answers were asked for
    /// and none came is a failure too; its report is written and its summary printed.
    pub fn run(&self) -> anyhow::Result<()> {
        let plan = self.arguments.plan()?;
        if !self.arguments.headless {
            eprintln!("glove-client: this build has no window yet; running without one");
        }
        let progress = Progress::start("preparing the object");
        let setup = HandSetup::default();
        let (object, mut soft, hand) = prepare(&plan, &setup)?;
        let key_frames = match &self.arguments.out_dir {
            Some(folder) => Some(KeyFrames::start(folder, &soft)?),
            None => None,
        };
        let (hand, priority) = match plan.pace {
            Pace::Lockstep => (hand, Priority::Ordinary),
            Pace::Free => {
                let planner = Planner::beside().context("cannot start the planner's thread")?;
                (hand.with_planner(planner), priority_for(&mut soft)?)
            }
        };
        progress.now("starting the server");
        let host = Host::open(&plan.server, self.arguments.threads)?;
        // A wrong address is a wrong address; a server that goes later is survived.
        drop(host.connect(None)?);
        let link =
            Link::start(host.address(), priority).context("cannot start the link to the server")?;
        drop(progress);
        if std::io::stderr().is_terminal() {
            object.notes.iter().for_each(|note| eprintln!("glove-client: {note}"));
        }
        let report = RunReport::new(
            object,
            format!("scripted:{}", plan.script),
            plan.server.to_string(),
            plan.pace,
            plan.settings.contact,
        );
        let grasp = Grasp::try_new(Isometry3::identity(), Grasp::RELEASE_MARGIN_M)?;
        let reader = HandReader::new(setup);
        let grasp_loop = GraspLoop::try_new(reader, soft, grasp, link, plan.settings, plan.pace)
            .context("cannot start a thread beside the ticks")?;
        let ends_with_script = self.arguments.frames.is_none();
        let session = Session::new(grasp_loop, hand, report, priority, ends_with_script);
        let report = self.play(session, plan.period, key_frames)?;
        if let Some(path) = &self.arguments.report {
            write_json(path, &report)?;
        }
        // The reason comes first: whoever reads standard error and standard output together sees it.
        match report.failure() {
            Some(failure) => {
                print(&report.describe())?;
                bail!(failure)
            }
            None => print(&report.describe()),
        }
    }

    /// Plays to the end of the script, or as many ticks as asked for.
    fn play(
        &self,
        mut session: Session,
        period: Option<Duration>,
        mut key_frames: Option<KeyFrames>,
    ) -> anyhow::Result<RunReport> {
        if period.is_none() {
            // From the first tick on the server is there, so that every run tells the same story.
            session.wait_idle(START_WAIT_MAX);
        }
        interruption::hear();
        let mut status = StatusLine::start();
        let start = Instant::now();
        let mut schedule = period.map(Schedule::new);
        let (mut played, ticks_max) = (0, self.arguments.frames.unwrap_or(u64::MAX));
        let interrupted = loop {
            let (due, now_s) = match &mut schedule {
                Some(schedule) => {
                    let elapsed = start.elapsed();
                    (schedule.due(elapsed), elapsed.as_secs_f64())
                }
                None => (Due { tick: played, skipped: 0 }, played as f64 / LOCKSTEP_RATE_HZ),
            };
            if due.tick >= ticks_max {
                session.skip(due.skipped.min(ticks_max - played));
                break false;
            }
            if interruption::asked() {
                session.skip(due.skipped);
                break true;
            }
            let Some(outcome) = session.play(due, now_s)? else { break false };
            played = due.tick + 1;
            status.show(due.tick, &outcome);
            if let Some(key_frames) = &mut key_frames {
                key_frames.add(due.tick, &outcome, session.grasp_loop().object())?;
            }
            if let Some(schedule) = &schedule {
                wait_until(start + schedule.next_at());
            }
        };
        if let Some(key_frames) = key_frames {
            key_frames.finish()?;
        }
        Ok(session.finish(interrupted)?)
    }
}

/// The object, and a hand that knows how to grasp it.
///
/// An imported object whose size was not asked for is enlarged until the hand finds a grip.
fn prepare(
    plan: &RunPlan,
    setup: &HandSetup,
) -> anyhow::Result<(ObjectSummary, SoftObject, ScriptedHand)> {
    let mut size = plan.object_size;
    loop {
        let SceneObject { mesh, notes } = load_object(&plan.object, plan.nodes, size)?;
        let object = ObjectSummary {
            name: plan.object.to_string(),
            nodes: mesh.node_count(),
            tets: mesh.tets().len(),
            size_m: mesh.size(),
            notes,
        };
        let soft = SoftObject::try_new(mesh)?;
        match ScriptedHand::try_new(plan.script, setup.clone(), &soft) {
            Ok(hand) => return Ok((object, soft, hand)),
            Err(NoGrasp::OutOfReach { extent_m })
                if plan.object_size.is_none()
                    && matches!(plan.object, ObjectChoice::File(_))
                    && extent_m < ENLARGED_MAX_M =>
            {
                size = Some(ENLARGE * extent_m);
            }
            Err(error) => return Err(error.into()),
        }
    }
}
