//! `glove-client run`: the main job. A hand grasps and squeezes an object, the server solves.

use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::{Duration, Instant};

use anyhow::{Context, bail};
use clap::Args;
use nalgebra::Isometry3;
use softgrasp_core::fem::Element;
use softgrasp_core::grasp::{Grasp, GraspEvent, StateName};
use softgrasp_core::mesh_io::{PointField, write_vtu};
use softgrasp_core::solve::choose::cheapest_element;
use softgrasp_protocol::{ElementChoice, ElementName, Material, MethodName};

use super::output::{print, write_file, write_json};
use crate::connection::{Host, ServerChoice};
use crate::contact_model::ContactModel;
use crate::grasp_loop::{GraspLoop, LoopEvent, Pace, SolveSettings, Subscription, TickOutcome};
use crate::hand_reader::{HandReader, HandSetup};
use crate::interruption;
use crate::link::Link;
use crate::pace::{be_urgent, wait_until};
use crate::progress::Progress;
use crate::run_report::{ObjectSummary, RunReport};
use crate::scene::{NODES_DEFAULT, ObjectChoice, SceneFile, SceneObject, load_object};
use crate::scripted::{NoGrasp, ScriptName, ScriptedHand, Seen};
use crate::soft_object::SoftObject;
use crate::status_line::StatusLine;

/// Grasp and squeeze an object (the main job; also what `glove-client` alone does).
#[derive(Args, Default)]
pub struct RunCommand {
    /// Scene file (TOML); flags win over it.
    #[arg(long, value_name = "F.toml")]
    scene: Option<PathBuf>,
    /// cube, sphere, strawberry, toothpaste, or a mesh file [default: strawberry].
    #[arg(long, value_name = "FILE|SHAPE")]
    object: Option<ObjectChoice>,
    /// Nodes of a built-in object [default: 1000].
    #[arg(long, value_name = "N")]
    nodes: Option<usize>,
    /// Longest extent of the object, m [default: 0.08 for a mesh file, its own for a built-in].
    #[arg(long, value_name = "M")]
    object_size: Option<f64>,
    /// The hand: scripted[:approach|attach|squeeze|release|regrasp].
    #[arg(long, value_name = "SOURCE")]
    hand: Option<HandChoice>,
    /// Where to solve: HOST:PORT, or embedded [default: embedded].
    #[arg(long, value_name = "ADDR|embedded")]
    server: Option<ServerChoice>,
    /// Threads of the embedded server [default: one per processor].
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
    /// Method, or auto.
    #[arg(long, value_name = "NAME|auto")]
    method: Option<MethodName>,
    /// Element: t4, t4-anp (does not lock when Poisson's ratio nears 0.5), or auto: t4 below 0.45,
    /// t4-anp from there on [default: auto].
    #[arg(long, value_name = "t4|t4-anp|auto")]
    element: Option<ElementChoice>,
    /// What a fingertip holds: vertex (the node it touched, as in the thesis), patch (every surface
    /// node under it) or mask (their mean, weighted by the tip's pressure) [default: mask].
    #[arg(long, value_name = "vertex|patch|mask")]
    contact: Option<ContactModel>,
    /// Young's modulus, Pa [default: 20000, a soft fruit].
    #[arg(long, value_name = "PA")]
    young: Option<f64>,
    /// Poisson's ratio [default: 0.4].
    #[arg(long, value_name = "NU")]
    poisson: Option<f64>,
    /// Ticks per second, in real time; without it a scripted hand waits for each answer.
    #[arg(long, value_name = "HZ")]
    rate: Option<f64>,
    /// Ticks to play [default: until the script ends].
    #[arg(long, value_name = "N")]
    frames: Option<u64>,
    /// No window.
    #[arg(long)]
    headless: bool,
    /// Folder for the deformed object at key frames (VTU).
    #[arg(long, value_name = "D")]
    out_dir: Option<PathBuf>,
    /// File for a JSON report.
    #[arg(long, value_name = "F.json")]
    report: Option<PathBuf>,
}

/// Where the hand comes from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum HandChoice {
    /// Played by the program, as device bytes.
    Scripted(ScriptName),
}

impl FromStr for HandChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.split_once(':').unwrap_or((text, "")) {
            ("scripted", "") => Ok(Self::Scripted(ScriptName::default())),
            ("scripted", name) => Ok(Self::Scripted(name.parse().map_err(|e| format!("{e}"))?)),
            _ => {
                Err("there is scripted and scripted:NAME; gloves and recordings come later".into())
            }
        }
    }
}

/// Longest wait for the server to prepare the object before a lockstep run begins.
const START_WAIT_MAX: Duration = Duration::from_secs(60);

/// Factor by which an imported object grows while the hand finds no grip, and where it ends, m.
const ENLARGE: f64 = 1.25;
const ENLARGED_MAX_M: f64 = 0.2;

/// The element that frames are solved with; frames need one whose system is condensed.
fn element_for_frames(choice: ElementChoice, poisson: f64) -> anyhow::Result<ElementName> {
    match choice {
        ElementChoice::T4 => Ok(ElementName::T4),
        ElementChoice::T4Anp => Ok(ElementName::T4Anp),
        ElementChoice::Auto => Ok(match cheapest_element(poisson) {
            Element::Tet4 => ElementName::T4,
            Element::Tet4Anp => ElementName::T4Anp,
            Element::Tet10 => ElementName::T10,
        }),
        ElementChoice::T10 => bail!(
            "run has no ten-node elements: a frame would take as long as a whole solve; take t4, \
             t4-anp or auto, or solve one request with `glove-client solve --element t10`"
        ),
    }
}

/// A scene after flags and file have been put together.
struct Plan {
    object: ObjectChoice,
    nodes: usize,
    object_size: Option<f64>,
    settings: SolveSettings,
    server: ServerChoice,
    script: ScriptName,
    pace: Pace,
    period: Option<Duration>,
}

impl RunCommand {
    /// Plays the scene.
    ///
    /// # Errors
    /// One line each: what happened, where, and what to do.
    pub fn run(&self) -> anyhow::Result<()> {
        let plan = self.plan()?;
        if let Some(folder) = &self.out_dir {
            std::fs::create_dir_all(folder)
                .with_context(|| format!("cannot make the folder {}", folder.display()))?;
        }
        if !self.headless {
            eprintln!("glove-client: this build has no window yet; running without one");
        }
        let progress = Progress::start("preparing the object");
        let setup = HandSetup::default();
        let (object, soft, mut hand) = prepare(&plan, &setup)?;
        progress.now("starting the server");
        let host = Host::open(&plan.server, self.threads)?;
        // A wrong address is a wrong address; a server that goes later is survived.
        drop(host.connect(None)?);
        let link = Link::start(host.address()).context("cannot start the link to the server")?;
        drop(progress);
        for note in &object.notes {
            eprintln!("glove-client: {note}");
        }
        let grasp = Grasp::try_new(Isometry3::identity(), Grasp::RELEASE_MARGIN_M)?;
        let pace_name = match plan.pace {
            Pace::Lockstep => "lockstep",
            Pace::Free => "free",
        };
        let mut report = RunReport::new(
            object,
            format!("scripted:{}", plan.script),
            plan.server.to_string(),
            pace_name,
            plan.settings.contact,
        );
        let mut grasp_loop =
            GraspLoop::new(HandReader::new(setup), soft, grasp, link, plan.settings, plan.pace);
        if plan.pace == Pace::Lockstep {
            // From the first tick on the server is there, so that every run tells the same story.
            grasp_loop.wait_idle(START_WAIT_MAX);
        }
        self.play(&mut grasp_loop, &mut hand, plan.period, &mut report)?;
        report.finish(grasp_loop.reader().faults());
        if let Some(path) = &self.report {
            write_json(path, &report)?;
        }
        print(&report.describe())
    }

    fn plan(&self) -> anyhow::Result<Plan> {
        let scene = match &self.scene {
            Some(path) => SceneFile::read(path)?,
            None => SceneFile::default(),
        };
        let object = match (&self.object, &scene.object) {
            (Some(choice), _) => choice.clone(),
            (None, Some(name)) => name.parse()?,
            (None, None) => "strawberry".parse()?,
        };
        let method = match (&self.method, &scene.method) {
            (Some(method), _) => method.clone(),
            (None, Some(name)) => name.parse().context("the scene's method")?,
            (None, None) => MethodName::auto(),
        };
        let element = match (self.element, &scene.element) {
            (Some(element), _) => element,
            (None, Some(name)) => name.parse().context("the scene's element")?,
            (None, None) => ElementChoice::Auto,
        };
        let poisson = self.poisson.or(scene.poisson).unwrap_or(0.4);
        let contact = match (self.contact, &scene.contact) {
            (Some(contact), _) => contact,
            (None, Some(name)) => name.parse().context("the scene's contact")?,
            (None, None) => ContactModel::default(),
        };
        let period = match self.rate {
            Some(rate) if !(rate.is_finite() && rate > 0.0) => {
                bail!("--rate is {rate}; it must be a number above 0 (ticks per second)")
            }
            rate => rate.map(|rate| Duration::from_secs_f64(1.0 / rate)),
        };
        let HandChoice::Scripted(script) =
            self.hand.clone().unwrap_or(HandChoice::Scripted(ScriptName::default()));
        // A person at a terminal watches; a pipe wants the result.
        let watched = console_is_watched() && !self.headless;
        let period = period.or(watched.then_some(Duration::from_micros(16_667)));
        Ok(Plan {
            object,
            nodes: self.nodes.or(scene.nodes).unwrap_or(NODES_DEFAULT),
            object_size: self.object_size.or(scene.object_size_m),
            settings: SolveSettings {
                material: Material {
                    young: self.young.or(scene.young_pa).unwrap_or(2.0e4),
                    poisson,
                },
                element: element_for_frames(element, poisson)?,
                method,
                contact,
                subscription: match self.out_dir {
                    Some(_) => Subscription::Whole,
                    None => Subscription::Surface,
                },
            },
            server: self.server.clone().unwrap_or(ServerChoice::Embedded),
            script,
            pace: if period.is_some() { Pace::Free } else { Pace::Lockstep },
            period,
        })
    }

    fn play(
        &self,
        grasp_loop: &mut GraspLoop,
        hand: &mut ScriptedHand,
        period: Option<Duration>,
        report: &mut RunReport,
    ) -> anyhow::Result<()> {
        interruption::hear();
        if period.is_some() {
            be_urgent();
        }
        let mut status = StatusLine::start();
        let mut seen = Seen::default();
        let start = Instant::now();
        // With `--frames` as many ticks as asked for; else until the script is over.
        for tick in 0..self.frames.unwrap_or(u64::MAX) {
            let sent = hand.next(&seen, grasp_loop.object());
            if interruption::asked() || (sent.over && self.frames.is_none()) {
                report.interrupted = !sent.over;
                break;
            }
            let before = grasp_loop.object().displacement().to_vec();
            let outcome = grasp_loop.tick(tick, start.elapsed().as_secs_f64(), &sent)?;
            seen = outcome.seen;
            report.add(tick, &outcome);
            status.show(tick, &outcome);
            if let Some(folder) = &self.out_dir {
                write_key_frames(folder, tick, &outcome, grasp_loop, &before)?;
            }
            if let Some(period) = period {
                wait_until(start + period.mul_f64((tick + 1) as f64));
            }
        }
        Ok(())
    }
}

/// The object, and a hand that knows how to grasp it.
///
/// An imported object whose size was not asked for is enlarged until the hand finds a grip.
fn prepare(
    plan: &Plan,
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

fn console_is_watched() -> bool {
    use std::io::IsTerminal as _;
    std::io::stderr().is_terminal()
}

/// Writes the object when it starts to deform, just before its shape is kept or let go, and after.
fn write_key_frames(
    folder: &Path,
    tick: u64,
    outcome: &TickOutcome,
    grasp_loop: &GraspLoop,
    before: &[[f64; 3]],
) -> anyhow::Result<()> {
    for event in &outcome.events {
        let LoopEvent::Grasp(event) = event else { continue };
        let (name, displacement) = match event {
            GraspEvent::Entered(StateName::Deforming) => {
                ("deforming", grasp_loop.object().displacement())
            }
            // The rest shape has just become the kept one: it is the squeezed shape.
            GraspEvent::ShapeKept => ("kept", grasp_loop.object().displacement()),
            GraspEvent::Released | GraspEvent::TipLeft(_)
                if before.iter().flatten().any(|&u| u != 0.0) =>
            {
                ("squeezed", before)
            }
            GraspEvent::Entered(StateName::Detached) => {
                ("detached", grasp_loop.object().displacement())
            }
            _ => continue,
        };
        let field = PointField { name: "displacement", values: displacement };
        let vtu = write_vtu(grasp_loop.object().rest(), &[field])?;
        write_file(&folder.join(format!("{tick:05}-{name}.vtu")), &vtu)?;
    }
    Ok(())
}
