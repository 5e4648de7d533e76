//! A run in a window: the window on the main thread, the ticks on one of their own.

use std::path::PathBuf;
use std::process::exit;
use std::time::Duration;

use anyhow::Context;
use softgrasp_os::one_line;

use super::run_arguments::{RunArguments, RunPlan};
use super::run_setup::{ReadyRun, Setup, SetupStage, make_ready};
use super::tell_report::tell;
use crate::connection::{Host, ServerChoice};
use crate::hand_reader::HandSetup;
use crate::interruption;
use crate::loading::LoadStage;
use crate::run_report::RunReport;
use crate::tick_loop::Timing;
use crate::tick_thread::TickThread;
use crate::view::observer::Observer;
use crate::view::outlet::outlet;
use crate::window::{About, App, Opening, Start, Started, WhenLost};

/// Frames are offered to the window so often.
const FRAMES_EVERY: Duration = Duration::from_millis(7);

/// Shows a run until the window is closed: its report, if it began; `None` where no window can be
/// opened, which is said in a sentence.
///
/// # Errors
/// One line: why the run could not begin, or broke off.
pub(super) fn show(
    arguments: &RunArguments,
    plan: &RunPlan,
) -> anyhow::Result<Option<Option<RunReport>>> {
    let opening = Opening {
        display: arguments.shown.display(),
        camera: arguments.shown.camera(),
        eye_is_chosen: arguments.shown.eye.is_some(),
        level_is_chosen: arguments.shown.light.is_some(),
        object: plan.object_request(&HandSetup::default()),
        material: plan.elastic_material()?,
        when_lost: when_lost(arguments.report.clone()),
    };
    let app = match App::open(opening) {
        Ok(app) => app,
        Err(error) => {
            eprintln!("glove-client: {error}; running without a window");
            return Ok(None);
        }
    };
    interruption::hear();
    let start = start(arguments, plan).context("cannot start the thread that begins the run")?;
    Ok(Some(app.show(start, interruption::asked)?))
}

/// Tells how a run ended whose display was lost, and ends the process with its exit code.
fn when_lost(report: Option<PathBuf>) -> WhenLost {
    Box::new(move |ended| {
        let told = ended.map_err(anyhow::Error::from).and_then(|ran| tell(report.as_deref(), &ran));
        if let Err(error) = &told {
            eprintln!("glove-client: {}", one_line(error.as_ref()));
        }
        exit(i32::from(told.is_err()))
    })
}

/// Begins the run beside the window.
fn start(arguments: &RunArguments, plan: &RunPlan) -> std::io::Result<Start> {
    let plan = plan.for_window();
    let record = arguments.record.clone();
    let setup = Setup { record, threads: arguments.threads, ends_with_script: false };
    let timing = Timing { period: plan.period, ticks_max: arguments.frames };
    Start::begin(move |at| {
        let ReadyRun { session, host } =
            make_ready(&plan, &setup, |stage| at(step(stage)), |_| Ok(()))?;
        let about = About {
            object: plan.object.to_string(),
            server: plan.server.to_string(),
            contact: plan.settings.contact.to_string(),
            material: plan.elastic_material()?,
            hand: plan.hand.choice(),
            method: plan.settings.method.to_string(),
            max_error: None,
            tick_s: plan.tick_s(),
            server_stage: server_stage(&plan.server, &host),
        };
        let (mut out, inlet) = outlet(FRAMES_EVERY);
        let mut observer = Observer::default();
        let sink = move |session: &crate::session::Session, outcome: &_, due, now_s| {
            // The server lives as long as the ticks.
            let _ = &host;
            observer.note(due, outcome);
            if out.is_due() {
                let frame = observer.frame(due, now_s, outcome, session.grasp_loop());
                out.publish(Box::new(frame));
            }
        };
        let play = move || TickThread::start(session, timing, || false, sink);
        Ok(Started { play: Box::new(play), inlet, about })
    })
}

/// The step of the loading card.
fn step(stage: SetupStage) -> usize {
    match stage {
        SetupStage::Object(stage) => stage as usize,
        SetupStage::Server => LoadStage::Ready as usize,
    }
}

/// What the server is at: known of one in this process only.
fn server_stage(choice: &ServerChoice, host: &Host) -> Box<dyn Fn() -> &'static str + Send> {
    match choice {
        ServerChoice::Embedded => Box::new(host.stage()),
        ServerChoice::At(_) => Box::new(|| "assemble, order, factor"),
    }
}
