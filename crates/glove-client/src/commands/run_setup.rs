//! Prepares a run: the object, the hand, the server, and the session that plays them.

use std::io::IsTerminal as _;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use anyhow::Context;
use nalgebra::Isometry3;
use softgrasp_force::Renderer;
use softgrasp_grasp::grasp::Grasp;
use softgrasp_grasp::object::SoftObject;
use softgrasp_hand::foreign_recording::{ForeignHand, is_foreign};
use softgrasp_hand::hand_reader::HandReader;
use softgrasp_hand::hand_readers::HandReaders;
use softgrasp_hand::hand_request::HandRequest;
use softgrasp_hand::hand_setup::HandConfiguration;
use softgrasp_hand::hand_source::HandSource;
use softgrasp_hand::joints::{JointsFeed, JointsListener};
use softgrasp_hand::live_hand::LiveHand;
use softgrasp_hand::loaded_object::{LoadStage, LoadedObject};
use softgrasp_hand::mouse::MouseHand;
use softgrasp_hand::recording::ReplayHand;
use softgrasp_hand::scripted::{GraspPlan, NoGrasp, PlanRequest, Planner, ScriptedHand};
use softgrasp_hand::sent::WhichHand;
use softgrasp_hand::serial::{SerialDevices, settings_of_hand};
use softgrasp_hand::xr_runtime::RuntimeHands;
#[cfg(any(feature = "window", feature = "xr"))]
use softgrasp_window::view::loading::LoadObject;

use super::further_setup::FurtherObjects;
use super::hand_arguments::SecondHand;
use super::run_plan::RunPlan;
use super::run_recording::{check_object, start_recorder};
use crate::ask::connection::Host;
use crate::ask::link::Link;
use crate::commands::interruption;
#[cfg(any(feature = "window", feature = "xr"))]
use crate::object::loading::ObjectRequest;
use crate::object::loading::load;
use crate::pace::Pace;
use crate::pace::tick_budget::Priority;
use crate::run::contact_grasp::ContactScene;
use crate::run::grasp_loop::GraspLoop;
use crate::run::run_report::RunReport;
use crate::run::session::Session;
use crate::run::tick_priority::priority_for;

/// Run that can be played.
pub(super) struct ReadyRun {
    /// Session that plays the run.
    pub(super) session: Session,
    /// Server, if it runs in this process; it must live as long as the run.
    pub(super) host: Host,
}

/// Stage of the preparation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SetupStage {
    /// The object is prepared.
    Object(LoadStage),
    /// The server is started and connected.
    Server,
}

/// Settings of the preparation.
pub(super) struct Setup {
    /// File that the run is recorded to.
    pub(super) record: Option<PathBuf>,
    /// File for a report of every tick.
    pub(super) report: Option<PathBuf>,
    /// Number of threads of an embedded server; `None` takes one per processor.
    pub(super) threads: Option<usize>,
    /// Whether the run ends with the script.
    pub(super) ends_with_script: bool,
    /// Factor by which a script squeezes and holds longer.
    pub(super) squeeze_times: u32,
    /// Feed of the joints of a headset's hand, if there is a page.
    pub(super) joints: Option<JointsFeed>,
}

/// Prepares a run and tells the stages. `seen` is shown the object before the first tick.
///
/// # Errors
/// One line each: what happened, where, and what to do.
pub(super) fn make_ready(
    plan: &RunPlan,
    setup: &Setup,
    at: impl Fn(SetupStage),
    seen: impl FnOnce(&SoftObject) -> anyhow::Result<()>,
) -> anyhow::Result<ReadyRun> {
    let hand_setup = plan.hand_configuration.setup.clone();
    let goes_on = |stage| {
        at(SetupStage::Object(stage));
        true
    };
    let loaded = load(&plan.first.request(&hand_setup), goes_on)?;
    let loaded = loaded.context("the object was called off")?;
    if let Some(recording) = &plan.recording {
        check_object(&recording.setup, &loaded)?;
    }
    let recorder = setup.record.as_deref();
    let recorder = recorder.map(|path| start_recorder(path, plan, &loaded)).transpose()?;
    let LoadedObject { summary, mut object, plan: grip, .. } = loaded;
    seen(&object)?;
    let further = FurtherObjects::load(plan, &hand_setup, &object, goes_on)?;
    let aim = further.get(plan.aim);
    let grip = aim.map_or(grip, |aim| aim.plan.clone());
    let first = Acting { request: &plan.hand, configuration: &plan.hand_configuration };
    let hand = hand_of(plan, setup, first, || grip)?;
    let aimed = aim.map_or(&object, |aim| &aim.object);
    let second = plan.second.as_ref().map(|hand| second_of(plan, setup, hand, aimed));
    let second = second.transpose()?.flatten();
    let priority = match plan.pace {
        Pace::Lockstep => Priority::Ordinary,
        Pace::Free => priority_for(&mut object)?,
    };
    at(SetupStage::Server);
    let host = match &plan.endpoint {
        Some(endpoint) => Host::at(endpoint.clone()),
        None => Host::open(&plan.server, setup.threads)?,
    };
    // A wrong address is a wrong address; a server that goes later is survived.
    drop(host.connect()?);
    // From here on an interruption ends the run with its report.
    interruption::hear();
    let link =
        Link::start(host.endpoint(), priority).context("cannot start the link to the server")?;
    if std::io::stderr().is_terminal() {
        let notes = summary.notes.iter().chain(further.notes());
        notes.for_each(|note| eprintln!("glove-client: {note}"));
    }
    let names = std::iter::once(&hand).chain(&second).map(HandSource::name);
    let mut report = RunReport::new(
        summary,
        names.collect::<Vec<_>>().join(" + "),
        plan.server.to_string(),
        plan.pace,
        plan.first.settings.contact,
    );
    if let Some(path) = &setup.report {
        report.played.keep_older(path);
    }
    let mut grasp_loop = grasp_loop_of(plan, object, link)?;
    report.further_objects = further.lay(plan, &host, priority, &mut grasp_loop)?;
    WhichHand::ALL.into_iter().for_each(|which| grasp_loop.aim(which, plan.aim));
    grasp_loop.put_object(plan.place);
    if let Some(period) = plan.period {
        grasp_loop.tick_every(period);
    }
    let mut session = Session::new(grasp_loop, hand, report, priority, setup.ends_with_script);
    if let Some(second) = second {
        session.act_with(second);
    }
    if let Some(recorder) = recorder {
        session.record_to(recorder);
    }
    Ok(ReadyRun { session, host })
}

/// Loop around the first object, at home and on its table where the plan has one.
fn grasp_loop_of(plan: &RunPlan, object: SoftObject, link: Link) -> anyhow::Result<GraspLoop> {
    let grasp = Grasp::try_new(Isometry3::identity(), Grasp::RELEASE_MARGIN_M)?;
    let settings = plan.first.settings.clone();
    let readers = readers_of(plan);
    let mut grasp_loop = GraspLoop::try_new(readers, object, grasp, link, settings, plan.pace)
        .context("cannot start a thread beside the ticks")?;
    if let Some(scene) = plan.first.contact_scene {
        let table_y = Some(grasp_loop.object().rest_shape().bottom());
        grasp_loop.grasp_with_friction(ContactScene { table_y, ..scene });
        if let Some(target) = plan.force.clone() {
            grasp_loop.feel(Renderer::start(target).context("the hand cannot feel")?);
        }
    }
    Ok(grasp_loop)
}

/// Loads other objects of the same size.
#[cfg(any(feature = "window", feature = "xr"))]
pub(super) fn load_beside(request: ObjectRequest) -> LoadObject {
    Arc::new(move |wish, goes_on| {
        // Another object has other regions.
        let is_other = wish.choice != request.choice;
        let request = ObjectRequest {
            regions: if is_other { Vec::new() } else { request.regions.clone() },
            choice: wish.choice,
            nodes: wish.nodes.unwrap_or(request.nodes),
            size_m: wish.size_m.or(request.size_m),
            ..request.clone()
        };
        load(&request, goes_on).map_err(|error| error.to_string()).transpose()
    })
}

/// Readers of the hands of a run.
fn readers_of(plan: &RunPlan) -> HandReaders {
    // At whatever speed a recording is played, its hand moves as it did.
    let tick_s = match &plan.recording {
        Some(recording) => recording.setup.tick_s(),
        None => plan.tick_s(),
    };
    let reader = |is_live, is_even, configuration: &HandConfiguration, place| {
        let reader = match is_live {
            true => HandReader::of_devices(configuration.setup.clone(), place),
            false => HandReader::new(configuration.setup.clone()),
        };
        if is_even { reader.evened(tick_s) } else { reader }
    };
    let RunPlan { is_live, is_even, hand_configuration, world_from_sender, .. } = plan;
    let first = reader(*is_live, *is_even, hand_configuration, *world_from_sender);
    match &plan.second {
        None => first.into(),
        Some(SecondHand {
            shares_stream,
            configuration,
            is_live,
            is_even,
            world_from_sender,
            ..
        }) => {
            let second = reader(*is_live, *is_even, configuration, *world_from_sender);
            match shares_stream {
                true => HandReaders::of_stream(first, second),
                false => HandReaders::of_two(first, second),
            }
        }
    }
}

/// A hand of a run: its source and its configuration.
struct Acting<'a> {
    request: &'a HandRequest,
    configuration: &'a HandConfiguration,
}

/// Source of the second hand of a run; `None` where another source carries it.
fn second_of(
    plan: &RunPlan,
    setup: &Setup,
    hand: &SecondHand,
    object: &SoftObject,
) -> anyhow::Result<Option<HandSource>> {
    let SecondHand { request: Some(request), configuration, .. } = hand else { return Ok(None) };
    let grip = || {
        let rest = Arc::clone(object.rest_shape());
        PlanRequest::new(rest, configuration.setup.clone(), plan.first.settings.contact).grip()
    };
    hand_of(plan, setup, Acting { request, configuration }, grip).map(Some)
}

/// Source of a hand of a run; `grip` is the plan by which the scripted one grasps the object.
fn hand_of(
    plan: &RunPlan,
    setup: &Setup,
    Acting { request, configuration }: Acting<'_>,
    grip: impl FnOnce() -> Result<GraspPlan, NoGrasp>,
) -> anyhow::Result<HandSource> {
    let (hand_setup, name) = (&configuration.setup, request.to_string());
    let planner = || Planner::beside().context("cannot start the planner's thread");
    let contact = plan.first.settings.contact;
    Ok(match (request, plan.pace) {
        (HandRequest::Mouse, _) => {
            MouseHand::new(hand_setup.clone(), planner()?, plan.tick_s()).holding(contact).into()
        }
        (HandRequest::Scripted(script), pace) => {
            let hand = ScriptedHand::following(*script, hand_setup.clone(), grip()?);
            let hand = hand.squeezing_longer(setup.squeeze_times).holding(contact);
            match pace {
                Pace::Lockstep => hand.into(),
                Pace::Free => hand.with_planner(planner()?).into(),
            }
        }
        (HandRequest::Serial(source), _) => {
            let settings = settings_of_hand(source, configuration);
            LiveHand::serial(SerialDevices::open(settings)?, name).into()
        }
        (HandRequest::Joints(address), _) => {
            LiveHand::joints(JointsListener::bind(*address)?, name).into()
        }
        (HandRequest::Xr, _) => {
            let feed = setup.joints.clone().context("there is no page that sends a hand")?;
            LiveHand::fed(feed, name).into()
        }
        (HandRequest::OpenXr(wanted), _) => {
            let period = Duration::from_secs_f64(plan.tick_s());
            LiveHand::runtime(RuntimeHands::open(*wanted, period)?, name).into()
        }
        (HandRequest::Replay(path), _) if is_foreign(path) => {
            ForeignHand::read(path, hand_setup, plan.tick_s())?.into()
        }
        (HandRequest::Replay(path), _) => {
            let recording = plan.recording.clone().context("the recording has not been read")?;
            ReplayHand::new(recording, path.display().to_string()).into()
        }
    })
}
