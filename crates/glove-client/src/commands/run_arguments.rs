//! The arguments of `glove-client run`, and the run that they and the scene file describe.

use std::io::IsTerminal as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context, bail};
use clap::{Args, ValueEnum};
use nalgebra::Isometry3;
use softgrasp_core::fem::Material as ElasticMaterial;
use softgrasp_grasp::object::ObjectChoice;
use softgrasp_hand::foreign_recording::is_foreign;
use softgrasp_hand::hand_reader::HandSetup;
#[cfg(any(feature = "window", feature = "xr"))]
use softgrasp_hand::hand_request::HandChoice;
use softgrasp_hand::hand_request::HandRequest;
use softgrasp_hand::hand_setup::HandConfiguration;
use softgrasp_hand::recording::{Recording, read_recording};
use softgrasp_hand::scripted::ScriptName;
use softgrasp_protocol::{ElementChoice, ElementName, Material, MethodName};

use super::access_arguments::AccessArguments;
use super::contact_arguments::{ContactArguments, GraspRule};
use super::display_arguments::DisplayArguments;
use super::elasticity_arguments::ElasticityArguments;
use super::force_arguments::ForceArguments;
use super::hand_arguments::{HandArguments, SecondHand};
use super::numbers::{count, poisson, positive, speed, ticks};
use super::page_arguments::PageArguments;
use super::recorded_object::recorded_object;
use super::recorded_settings::{
    recorded_hand, recorded_place, recorded_regions, recorded_scene, recorded_second_hand,
    recorded_settings,
};
use super::region_arguments::RegionArguments;
use crate::ask::connection::ServerChoice;
use crate::ask::endpoint::Endpoint;
use crate::ask::solve_settings::Elasticity;
use crate::ask::solve_settings::{SolveSettings, Subscription, element_for_frames};
use crate::object::loading::ObjectRequest;
use crate::object::object_place::ObjectPlace;
use crate::object::region_choice::RegionChoice;
use crate::object::scene::{NODES_DEFAULT, SceneFile, size_to_hold};
use crate::pace::Pace;
use crate::run::contact_grasp::ContactScene;

/// Grasp and squeeze an object (the main job; also what `glove-client` alone does).
#[derive(Args, Clone, Default)]
pub struct RunArguments {
    /// Scene file (TOML); flags win over it.
    #[arg(long, value_name = "F.toml")]
    pub(super) scene: Option<PathBuf>,
    /// cube, sphere, strawberry, toothpaste, or a mesh file [default: strawberry].
    #[arg(value_name = "FILE|SHAPE", conflicts_with = "object")]
    pub(super) named_object: Option<ObjectChoice>,
    /// The same as an option.
    #[arg(long, value_name = "FILE|SHAPE")]
    pub(super) object: Option<ObjectChoice>,
    /// Nodes of a built-in object [default: 1000].
    #[arg(long, value_name = "N", value_parser = count, allow_hyphen_values = true)]
    pub(super) nodes: Option<usize>,
    /// Longest extent of the object, m [default: 0.08 for a strawberry and a mesh file, its own for
    /// other built-ins].
    #[arg(long, value_name = "M", value_parser = positive, allow_hyphen_values = true)]
    pub(super) object_size: Option<f64>,
    /// The hands that act.
    #[command(flatten)]
    pub(super) hand: HandArguments,
    /// Where the object is put: home, or hand, between thumb and fingers of the first hand that is heard
    /// of [default: home].
    #[arg(long, value_name = "home|hand")]
    pub(super) place: Option<PlaceChoice>,
    /// Where to solve: HOST:PORT, or embedded [default: embedded].
    #[arg(long, value_name = "ADDR|embedded")]
    pub(super) server: Option<ServerChoice>,
    #[command(flatten)]
    pub(super) access: AccessArguments,
    /// Threads of the embedded server [default: one per processor].
    #[arg(long, value_name = "N", value_parser = count, allow_hyphen_values = true)]
    pub(super) threads: Option<usize>,
    /// Method, or auto.
    #[arg(long, value_name = "NAME|auto")]
    pub(super) method: Option<MethodName>,
    /// Element: t4, t4-anp (does not lock when Poisson's ratio nears 0.5), or auto: t4 below 0.45,
    /// t4-anp from there on [default: auto].
    #[arg(long, value_name = "t4|t4-anp|auto")]
    pub(super) element: Option<ElementChoice>,
    #[command(flatten)]
    pub(super) grasp: ContactArguments,
    /// Young's modulus, Pa [default: 20000, a soft fruit].
    #[arg(long, value_name = "PA", value_parser = positive, allow_hyphen_values = true)]
    pub(super) young: Option<f64>,
    /// Poisson's ratio [default: 0.4].
    #[arg(long, value_name = "NU", value_parser = poisson, allow_hyphen_values = true)]
    pub(super) poisson: Option<f64>,
    #[command(flatten)]
    pub(super) regions: RegionArguments,
    #[command(flatten)]
    pub(super) elasticity: ElasticityArguments,
    /// Largest relative error of an answer wanted [default: at large deformation 2e-3].
    #[arg(long, value_name = "REL", value_parser = positive, allow_hyphen_values = true)]
    pub(super) max_error: Option<f64>,
    /// Ticks per second, in real time; without it a scripted hand waits for each answer.
    #[arg(long, value_name = "HZ", value_parser = positive, allow_hyphen_values = true)]
    pub(super) rate: Option<f64>,
    /// How fast a recording is played again: 1 as it was, 0 as fast as it goes [default: 1 where a
    /// person watches, else 0].
    #[arg(long, value_name = "FACTOR", value_parser = speed, allow_hyphen_values = true)]
    pub(super) speed: Option<f64>,
    /// Ticks to play [default: until the script ends].
    #[arg(long, visible_alias = "frames", value_name = "N", value_parser = ticks, allow_hyphen_values = true)]
    pub(super) ticks: Option<u64>,
    /// No window.
    #[arg(long)]
    pub(super) headless: bool,
    /// What is seen.
    #[command(flatten)]
    pub(super) shown: DisplayArguments,
    #[command(flatten)]
    pub(super) page: PageArguments,
    #[command(flatten)]
    pub(super) felt: ForceArguments,
    /// Folder for the deformed object at key frames (VTU).
    #[arg(long, value_name = "D")]
    pub(super) out_dir: Option<PathBuf>,
    /// Folder for the object at every tick, as VTU files where it is in the world and a PVD file that ParaView
    /// plays; without a window.
    #[arg(long, value_name = "DIR")]
    pub(super) series: Option<PathBuf>,
    /// Records the run: device bytes, poses, contacts, requests, answers (MCAP).
    #[arg(long, value_name = "F.mcap")]
    pub(super) record: Option<PathBuf>,
    /// File for a JSON report.
    #[arg(long, value_name = "F.json")]
    pub(super) report: Option<PathBuf>,
}

/// Where the object is put.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum PlaceChoice {
    /// At its home.
    Home,
    /// In front of the first hand.
    Hand,
}

impl PlaceChoice {
    fn place(self) -> ObjectPlace {
        match self {
            Self::Home => ObjectPlace::Home,
            Self::Hand => ObjectPlace::Hand,
        }
    }
}

/// Element for the ticks; it must be one that `condensed` can solve.
fn chosen_element(choice: ElementChoice, poisson: f64) -> anyhow::Result<ElementName> {
    match choice {
        ElementChoice::T4 => Ok(ElementName::T4),
        ElementChoice::T4Anp => Ok(ElementName::T4Anp),
        ElementChoice::Auto => Ok(element_for_frames(poisson)),
        ElementChoice::T10 => bail!(
            "run has no ten-node elements: a frame would take as long as a whole solve; take t4, \
             t4-anp or auto, or solve one request with `glove-client solve --element t10`"
        ),
    }
}

/// Settings of a run, from flags and scene file.
#[derive(Clone)]
pub(super) struct RunPlan {
    /// Object that is grasped.
    pub(super) object: ObjectChoice,
    /// Number of nodes of a built-in object.
    pub(super) nodes: usize,
    /// Longest extent of the object, m; `None` where the hand may choose it.
    pub(super) object_size: Option<f64>,
    /// Regions of a material of their own.
    pub(super) regions: Vec<RegionChoice>,
    /// Material, and settings of the solves.
    pub(super) settings: SolveSettings,
    /// Constants of a grasp by friction; `None` for the thesis's rules.
    pub(super) contact_scene: Option<ContactScene>,
    /// Device that takes the forces.
    pub(super) force: Option<softgrasp_force::Target>,
    /// Place where the object is put.
    pub(super) place: ObjectPlace,
    /// Server that solves.
    pub(super) server: ServerChoice,
    /// Endpoint of the server, with token and encryption; `None` for the embedded one.
    pub(super) endpoint: Option<Endpoint>,
    /// Hand that is asked for; the first of two.
    pub(super) hand: HandRequest,
    /// Second hand, or one that the stream of the first may carry.
    pub(super) second: Option<SecondHand>,
    /// Whether ticks wait for answers.
    pub(super) pace: Pace,
    /// Time from tick to tick, in real time; `None` for as fast as possible.
    pub(super) period: Option<Duration>,
    /// Configuration of the hand, its glove and its tracker.
    pub(super) hand_configuration: HandConfiguration,
    /// Whether the samples come from live devices.
    pub(super) is_live: bool,
    /// Pose in the world of a sender of joints; `None` puts its first hand before the object.
    pub(super) world_from_sender: Option<Isometry3<f64>>,
    /// Recording that is replayed.
    pub(super) recording: Option<Arc<Recording>>,
}

/// Rules of the grasp, equations, and configuration of the hand.
struct Grasping {
    rule: GraspRule,
    elasticity: Elasticity,
    hand: HandRequest,
}

/// Ticks per second if a person watches.
const WATCHED_RATE_HZ: f64 = 60.0;
/// Longest time from tick to tick, s.
const PERIOD_MAX_S: f64 = 3600.0;

impl RunArguments {
    /// Whether the run is played without a window, because pictures are drawn tick by tick.
    pub(super) fn is_without_window(&self) -> bool {
        self.headless || self.series.is_some() || self.shown.wants_pictures()
    }

    /// Whether a person watches: on a terminal beside the window, or on the page.
    fn is_watched(&self) -> bool {
        (console_is_watched() && !self.is_without_window()) || self.page.xr.is_some()
    }

    /// Whether something that is written or shown needs the nodes inside the object.
    fn needs_whole(&self) -> bool {
        self.out_dir.is_some() || self.series.is_some() || self.shown.needs_inside()
    }

    /// Object that was named, with or without `--object`.
    pub(super) fn asked_object(&self) -> Option<&ObjectChoice> {
        self.object.as_ref().or(self.named_object.as_ref())
    }

    /// Settings of the run, from flags and scene file.
    ///
    /// # Errors
    /// A scene that cannot be read, or settings that do not go together.
    pub(super) fn plan(&self) -> anyhow::Result<RunPlan> {
        self.hand.check()?;
        if let Some(HandRequest::Replay(path)) = self.hand.first()
            && !is_foreign(path)
        {
            return self.plan_of_recording(path);
        }
        let scene = self.scene.as_deref().map(SceneFile::read).transpose()?.unwrap_or_default();
        let object = self.chosen_object(&scene)?;
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
        let material = Material {
            young: self.young.or(scene.young_pa).unwrap_or(2.0e4),
            poisson: self.poisson.or(scene.poisson).unwrap_or(0.4),
        };
        // Flags have been checked; what is wrong here stands in the scene file.
        ElasticMaterial::try_new(material.young, material.poisson)
            .context("the scene's material")?;
        let regions = self.chosen_regions(&scene)?;
        let largest = regions.iter().map(|region| region.poisson).fold(material.poisson, f64::max);
        let Grasping { rule, elasticity, hand } = self.grasping(&scene, &method)?;
        let is_xr = self.takes_headset(&hand)?;
        let (force, contact_scene) = self.felt.of_run(rule.scene)?;
        let hand_configuration = self.hand.configuration()?;
        // The thesis's rules know one hand.
        let of_two = rule.scene.map(|_| self.hand.second(&hand, &hand_configuration));
        let second = of_two.transpose()?.flatten();
        // Devices have a time of their own.
        let is_timed = hand.is_live() || second.as_ref().is_some_and(|second| second.is_live);
        let period = self.period(is_timed || force.is_some());
        let object_size =
            self.object_size.or(scene.object_size_m).or_else(|| size_to_hold(&object));
        let server = self.server.clone().unwrap_or(ServerChoice::Embedded);
        Ok(RunPlan {
            object,
            nodes: self.nodes.or(scene.nodes).unwrap_or(NODES_DEFAULT),
            object_size,
            regions,
            settings: SolveSettings {
                material,
                element: chosen_element(element, largest)?,
                method,
                contact: rule.contact,
                subscription: match self.needs_whole() {
                    false => Subscription::Surface,
                    true => Subscription::Whole,
                },
                elasticity,
                max_error: self.max_error,
            },
            contact_scene,
            force,
            place: self.place.map_or(ObjectPlace::Home, PlaceChoice::place),
            endpoint: self.access.to(&server)?,
            server,
            pace: if period.is_some() { Pace::Free } else { Pace::Lockstep },
            period,
            is_live: hand.is_live(),
            hand,
            second,
            hand_configuration,
            world_from_sender: self.hand.world_from_sender(is_xr),
            recording: None,
        })
    }

    /// Object that flags or scene name; a strawberry where none does.
    fn chosen_object(&self, scene: &SceneFile) -> anyhow::Result<ObjectChoice> {
        Ok(match (self.asked_object(), &scene.object) {
            (Some(choice), _) => choice.clone(),
            (None, Some(name)) => name.parse()?,
            (None, None) => "strawberry".parse()?,
        })
    }

    /// Time from tick to tick, if a person watches or the hand `is_timed`.
    fn period(&self, is_timed: bool) -> Option<Duration> {
        let is_timed = is_timed || self.is_watched();
        let rate = self.rate.or(is_timed.then_some(WATCHED_RATE_HZ))?;
        Some(Duration::from_secs_f64((1.0 / rate).min(PERIOD_MAX_S)))
    }

    /// Regions of flags and scene; a flag wins over the scene's region of its name, whose place it keeps.
    fn chosen_regions(&self, scene: &SceneFile) -> anyhow::Result<Vec<RegionChoice>> {
        let mut regions = scene.region.clone();
        for region in &self.regions.regions {
            match regions.iter_mut().find(|known| known.name == region.name) {
                Some(known) => {
                    (known.young_pa, known.poisson) = (region.young_pa, region.poisson);
                }
                None => regions.push(region.clone()),
            }
        }
        // Flags have been checked; what is wrong here stands in the scene file.
        regions.iter().try_for_each(|region| region.material().map(drop)).context("the scene")?;
        Ok(regions)
    }

    /// Whether the first hand is that of a headset, which a page must send.
    fn takes_headset(&self, hand: &HandRequest) -> anyhow::Result<bool> {
        let mut all = self.hand.hands.iter().chain([hand]);
        if all.any(|hand| *hand == HandRequest::Xr) && self.page.xr.is_none() {
            bail!(
                "--hand xr takes the hand of a headset from the page: give it an address by --xr"
            );
        }
        Ok(*hand == HandRequest::Xr)
    }

    /// Rules of the grasp, equations, and configuration of the hand.
    fn grasping(&self, scene: &SceneFile, method: &MethodName) -> anyhow::Result<Grasping> {
        // A run of which nothing was said picks a strawberry from a table. Hands that are no script of the
        // thesis's grasp grasp as hands do.
        let lifts = match self.hand.first() {
            _ if self.hand.are_two() => true,
            Some(HandRequest::Scripted(script)) => *script == ScriptName::Lift,
            Some(_) => true,
            None => self.asked_object().is_none() && self.scene.is_none(),
        };
        let needs_thesis = !lifts || *method != MethodName::auto();
        let rule = self.grasp.of_run(scene, &self.elasticity, needs_thesis)?;
        if self.hand.are_two() && rule.scene.is_none() {
            bail!("two hands need --grasp contact: the rules of the thesis know one hand");
        }
        let elasticity = match rule.scene {
            Some(_) => self.elasticity.of_contact(scene)?,
            None => self.elasticity.of_run(scene, method)?,
        };
        let script = if rule.scene.is_some() { ScriptName::Lift } else { ScriptName::default() };
        let hand = self.hand.first().cloned().unwrap_or(HandRequest::Scripted(script));
        if rule.scene.is_none() && hand == HandRequest::Scripted(ScriptName::Lift) {
            bail!("the script lift needs --grasp contact");
        }
        Ok(Grasping { rule, elasticity, hand })
    }

    /// Settings of the run that is replayed: object, material and solves are the recorded ones, whatever
    /// the scene file says.
    fn plan_of_recording(&self, path: &Path) -> anyhow::Result<RunPlan> {
        let recording = read_recording(path)?;
        let setup = &recording.setup;
        let recorded_s = setup.period_s.unwrap_or(1.0 / WATCHED_RATE_HZ);
        let watched = self.is_watched();
        let speed = self.speed.unwrap_or(if watched { 1.0 } else { 0.0 });
        let period = (speed > 0.0).then(|| (recorded_s / speed).min(PERIOD_MAX_S));
        let server = self.server.clone().unwrap_or(ServerChoice::Embedded);
        Ok(RunPlan {
            object: match self.asked_object() {
                Some(named) => named.clone(),
                None => recorded_object(path, &setup.object)?,
            },
            nodes: setup.nodes,
            object_size: setup.size_m,
            regions: recorded_regions(setup),
            settings: recorded_settings(setup)?,
            contact_scene: recorded_scene(setup),
            force: None,
            place: if setup.placed_in_hand { ObjectPlace::Hand } else { ObjectPlace::Home },
            endpoint: self.access.to(&server)?,
            server,
            hand: HandRequest::Replay(path.to_owned()),
            second: recorded_second_hand(setup)?,
            // Each tick waits for the answers that it took before.
            pace: Pace::Lockstep,
            period: period.map(Duration::from_secs_f64),
            hand_configuration: recorded_hand(setup)?,
            is_live: setup.is_live,
            world_from_sender: recorded_place(setup),
            recording: Some(Arc::new(recording)),
        })
    }
}

impl RunPlan {
    /// Time from tick to tick of a hand that a person moves or watches, s.
    pub(super) fn tick_s(&self) -> f64 {
        self.period.map_or(1.0 / WATCHED_RATE_HZ, |period| period.as_secs_f64())
    }

    /// The same settings for a person who watches: in real time.
    #[cfg(feature = "window")]
    pub(super) fn for_window(&self) -> Self {
        let period = Some(Duration::from_secs_f64(self.tick_s()));
        let pace = if self.recording.is_some() { self.pace } else { Pace::Free };
        Self { pace, period, ..self.clone() }
    }

    /// Sources of the hands, the second one's where it has its own.
    pub(super) fn sources(&self) -> impl Iterator<Item = &HandRequest> {
        let second = self.second.as_ref().and_then(|second| second.request.as_ref());
        std::iter::once(&self.hand).chain(second)
    }

    /// Kind of the hand that window and page are made for: the mouse, where it moves one of two.
    #[cfg(any(feature = "window", feature = "xr"))]
    pub(super) fn choice(&self) -> HandChoice {
        let mut choices = self.sources().map(HandRequest::choice);
        let is_moved = choices.any(|choice| choice == HandChoice::Mouse);
        if is_moved { HandChoice::Mouse } else { self.hand.choice() }
    }

    /// Name of the sources in reports and recordings.
    pub(super) fn hand_name(&self) -> String {
        self.sources().map(HandRequest::to_string).collect::<Vec<_>>().join(" + ")
    }

    /// Whether a hand is that of a headset.
    #[cfg(feature = "xr")]
    pub(super) fn takes_headset(&self) -> bool {
        self.sources().any(|source| *source == HandRequest::Xr)
    }

    /// Whether a script begins again after its end; not if the run is recorded or has a number of ticks.
    pub(super) fn begins_anew(&self, arguments: &RunArguments) -> bool {
        arguments.record.is_none() && arguments.ticks.is_none() && self.recording.is_none()
    }

    /// Material as the core takes it.
    ///
    /// # Errors
    /// None in practice: the plan was made with a valid material.
    #[cfg(any(feature = "window", feature = "xr"))]
    pub(super) fn elastic_material(&self) -> anyhow::Result<ElasticMaterial> {
        let Material { young, poisson } = self.settings.material;
        Ok(ElasticMaterial::try_new(young, poisson)?)
    }

    /// Request for the object, with the hand that is to grasp it.
    pub(super) fn object_request(&self, setup: &HandSetup) -> ObjectRequest {
        ObjectRequest {
            choice: self.object.clone(),
            nodes: self.nodes,
            size_m: self.object_size,
            regions: self.regions.clone(),
            setup: setup.clone(),
            contact: self.settings.contact,
        }
    }
}

fn console_is_watched() -> bool {
    std::io::stderr().is_terminal()
}
