//! A run in a window: the window on the main thread, the ticks on one of their own.

use std::path::PathBuf;
use std::process::exit;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Duration;

use anyhow::{Context, anyhow};
use softgrasp_hand::hand_setup::HandSetup;
use softgrasp_hand::loaded_object::LoadStage;
use softgrasp_hand::notice::Notice;
use softgrasp_os::one_line;
use softgrasp_window::view::control::Control;
use softgrasp_window::view::outlet::outlet;
use softgrasp_window::window::{
    About, App, End, Opening, SQUEEZE_TIMES, Start, Started, Ticks, WhenLost,
};

use super::device_sentences::DeviceSentences;
use super::run_arguments::RunArguments;
use super::run_page::{PageTalk, RunPage};
use super::run_plan::RunPlan;
use super::run_setup::{ReadyRun, Setup, SetupStage, load_beside, make_ready};
use super::tell_report::tell;
use crate::ask::connection::{Host, ServerChoice};
use crate::commands::interruption;
use crate::run::observer::{Foresight, Observer};
use crate::run::run_report::RunReport;
use crate::run::run_words::{words_of_contact, words_of_server};
use crate::run::tick_loop::Timing;
use crate::run::tick_thread::TickThread;

/// Time between two frames that are offered to the window.
const FRAMES_EVERY: Duration = Duration::from_millis(7);
/// Time between two looks at a run without its window.
const LOOK_EVERY: Duration = Duration::from_millis(20);

/// Shows a run until the window is closed; returns its report, if it began. `None` if no window can be
/// opened, which is told in a sentence.
///
/// # Errors
/// One line: why the run could not begin, or ended early.
pub(super) fn show(
    arguments: &RunArguments,
    plan: &RunPlan,
    page: &mut Option<RunPage>,
) -> anyhow::Result<Option<Option<RunReport>>> {
    let opening = Opening {
        display: arguments.shown.display(),
        camera: arguments.shown.camera(),
        eye_is_chosen: arguments.shown.eye.is_some(),
        shading_is_chosen: arguments.shown.shading.is_some(),
        level_is_chosen: arguments.shown.light.is_some(),
        object: plan.first.object.clone(),
        contact: plan.first.settings.contact,
        load: load_beside(plan.first.request(&HandSetup::default())),
        material: plan.elastic_material()?,
    };
    let app = match App::open(opening) {
        Ok(app) => app,
        Err(error) => {
            eprintln!("glove-client: {error}; running without a window");
            return Ok(None);
        }
    };
    interruption::hear();
    let (begun, threads) = channel();
    let start = start(arguments, plan, begun, page.take());
    let start = start.context("cannot start the thread that begins the run")?;
    app.show(start, interruption::asked)?;
    // It is there if the run began.
    Ok(Some(threads.try_recv().ok().map(TickThread::join).transpose()?))
}

/// The window's ends of the channels to the ticks.
fn in_window(
    thread: &mut TickThread,
    report: Option<PathBuf>,
    page: Option<PageWays>,
) -> std::io::Result<Ticks> {
    let end = thread.run_end();
    // Nobody has taken the sentences before.
    let mut notices = thread.take_notices().unwrap_or_else(|| channel().1);
    if let Some(page) = page {
        notices = page.connect(thread, notices)?;
    }
    Ok(Ticks {
        controls: thread.controls(),
        notices,
        is_over: Box::new(move || end.is_there()),
        when_lost: Some(when_lost(thread, report)),
    })
}

/// Channels between page and ticks, for a page beside the window.
struct PageWays {
    asked: Receiver<Control>,
    to_tell: Sender<Notice>,
}

impl PageWays {
    /// Passes the page's wishes to the ticks, and sentences to both; returns the receiver for the window.
    fn connect(
        self,
        thread: &TickThread,
        notices: Receiver<Notice>,
    ) -> std::io::Result<Receiver<Notice>> {
        let Self { asked, to_tell } = self;
        let controls = thread.controls();
        std::thread::Builder::new().name("page wishes".to_owned()).spawn(move || {
            // It ends with the page, or with the run.
            asked.iter().try_for_each(|control| controls.send(control))
        })?;
        let (to_window, for_window) = channel();
        std::thread::Builder::new().name("page notices".to_owned()).spawn(move || {
            for notice in notices {
                // Whoever has gone hears nothing.
                let _ = to_tell.send(notice.clone());
                let _ = to_window.send(notice);
            }
        })?;
        Ok(for_window)
    }
}

/// Lets a run whose window was lost go on to the end of its script, prints its summary, and ends the
/// process: with the run's exit code if the display was lost, with 1 if the window failed.
fn when_lost(thread: &TickThread, report: Option<PathBuf>) -> WhenLost {
    let (controls, end) = (thread.controls(), thread.run_end());
    Box::new(move |window| {
        // A run that is over does not hear it.
        let _ = controls.send(Control::EndWithScript);
        while !end.is_there() {
            if interruption::asked() {
                let _ = controls.send(Control::Stop);
            }
            std::thread::sleep(LOOK_EVERY);
        }
        let ended = end.wait().map_err(anyhow::Error::from);
        let told = ended.and_then(|mut ran| {
            // Nobody has closed the window.
            ran.interrupted &= interruption::asked();
            tell(report.as_deref(), &ran)
        });
        let told = told.and_then(|()| match window {
            End::DisplayLost => Ok(()),
            End::Failed(why) => Err(anyhow!("{why}; this is a fault of the program")),
        });
        if let Err(error) = &told {
            eprintln!("glove-client: {}", one_line(error.as_ref()));
        }
        exit(i32::from(told.is_err()))
    })
}

/// Begins the run beside the window; `begun` receives its thread.
fn start(
    arguments: &RunArguments,
    plan: &RunPlan,
    begun: Sender<TickThread>,
    mut page: Option<RunPage>,
) -> std::io::Result<Start> {
    let plan = plan.for_window();
    let arguments_of_page = arguments.clone();
    let report = arguments.report.clone();
    let record = arguments.record.clone();
    let setup = Setup {
        record,
        report: arguments.report.clone(),
        threads: arguments.threads,
        ends_with_script: false,
        squeeze_times: SQUEEZE_TIMES,
        joints: page.as_ref().map(RunPage::joints),
    };
    let timing = Timing { period: plan.period, ticks_max: arguments.ticks };
    let begins_anew = arguments.begins_anew(&plan);
    Start::begin(move |at| {
        let ReadyRun { mut session, host } =
            make_ready(&plan, &setup, |stage| at(step(stage)), |_| Ok(()))?;
        session.await_model();
        let about = About {
            object: plan.first.object.to_string(),
            server: words_of_server(&plan.server.to_string()),
            contact: words_of_contact(&plan.first.settings.contact.to_string()),
            is_lifted: plan.first.contact_scene.is_some(),
            material: plan.elastic_material()?,
            hand: plan.choice(),
            method: plan.first.settings.method.to_string(),
            max_error: None,
            tick_s: plan.tick_s(),
            begins_anew,
            server_stage: server_stage(&plan.server, &host),
        };
        let mut ways = None;
        if let Some(page) = &mut page {
            let ((controls, asked), (to_tell, notices)) = (channel(), channel());
            let talk = PageTalk { controls, notices, has_window: true };
            page.begin(&arguments_of_page, &plan, talk)?;
            ways = Some(PageWays { asked, to_tell });
        }
        let (mut out, inlet) = outlet(FRAMES_EVERY);
        let (mut observer, mut foresight) = (Observer::default(), Foresight::default());
        let mut sentences = DeviceSentences::start(|text| eprintln!("glove-client: {text}"))
            .context("cannot start a thread beside the ticks")?;
        let sink = move |session: &crate::run::session::Session, outcome: &_, due, now_s| {
            // The server lives as long as the ticks.
            let _ = &host;
            observer.note(due, outcome);
            sentences.hear(outcome);
            if out.is_due() {
                let mut frame = observer.frame(due, now_s, outcome, session.grasp_loop());
                frame.acts = foresight.acts(session.hand(), session.grasp_loop());
                if let Some(page) = &mut page {
                    page.show(&frame);
                }
                out.publish(Box::new(frame));
            }
        };
        let play = move || {
            let mut thread = TickThread::start(session, timing, || false, sink)?;
            let ticks = in_window(&mut thread, report, ways)?;
            // Whoever shows the window waits for it.
            let _ = begun.send(thread);
            Ok(ticks)
        };
        Ok(Started { play: Box::new(play), inlet, about })
    })
}

/// Position of a stage on the loading card.
fn step(stage: SetupStage) -> usize {
    match stage {
        SetupStage::Object(stage) => stage as usize,
        SetupStage::Server => LoadStage::Ready as usize,
    }
}

/// Stage of the server; known only of one in this process.
fn server_stage(choice: &ServerChoice, host: &Host) -> Box<dyn Fn() -> &'static str + Send> {
    match choice {
        ServerChoice::Embedded => Box::new(host.stage()),
        ServerChoice::At(_) => Box::new(|| "assemble, order, factor"),
    }
}
