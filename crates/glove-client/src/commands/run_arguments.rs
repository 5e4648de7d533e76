//! The arguments of `glove-client run`, and the run that they and the scene file describe.

use std::io::IsTerminal as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context, bail};
use clap::{Args, ValueEnum};
use softgrasp_grasp::object::ObjectChoice;
use softgrasp_hand::foreign_recording::is_foreign;
use softgrasp_hand::hand_request::HandRequest;
use softgrasp_hand::recording::read_recording;
use softgrasp_hand::scripted::ScriptName;
use softgrasp_hand::sent::TICKS_PER_S;
use softgrasp_protocol::{ElementChoice, MethodName};

use super::access_arguments::AccessArguments;
use super::contact_arguments::{ContactArguments, GraspRule};
use super::display_arguments::DisplayArguments;
use super::elasticity_arguments::ElasticityArguments;
use super::force_arguments::ForceArguments;
use super::hand_arguments::HandArguments;
use super::numbers::{count, poisson, positive, speed, ticks};
use super::object_plan::{Laying, ObjectFlags, ObjectPlan};
use super::page_arguments::PageArguments;
use super::recorded_object::recorded_object;
use super::recorded_settings::{
    recorded_hand, recorded_place, recorded_regions, recorded_scene, recorded_second_hand,
    recorded_settings,
};
use super::region_arguments::RegionArguments;
use super::run_plan::RunPlan;
use crate::ask::connection::ServerChoice;
use crate::ask::solve_settings::{Elasticity, Subscription};
use crate::object::object_place::ObjectPlace;
use crate::object::scene::SceneFile;
use crate::object::scene_objects::SceneEntry;
use crate::pace::Pace;

/// Grasp and squeeze an object (the main job; also what `glove-client` alone does).
#[derive(Args, Clone, Default)]
pub struct RunArguments {
    /// Scene file (TOML); flags win over it.
    #[arg(long, value_name = "F.toml")]
    pub(super) scene: Option<PathBuf>,
    /// cube, sphere, strawberry, toothpaste, or a mesh file [default: strawberry].
    #[arg(value_name = "FILE|SHAPE", conflicts_with = "object")]
    pub(super) named_object: Option<ObjectChoice>,
    /// The same as an option. Given several times, so many objects lie beside each other on the table
    /// (with --grasp contact); each touches hand and table, not the others.
    #[arg(long, value_name = "FILE|SHAPE")]
    pub(super) object: Vec<ObjectChoice>,
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
    /// Of several objects, number of the one that a scripted hand lifts and that the mouse hand goes to
    /// first [default: 1].
    #[arg(long, value_name = "N", value_parser = count, allow_hyphen_values = true)]
    pub(super) lifts: Option<usize>,
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
    /// Element: t4, t4-anp (does not lock when Poisson's ratio nears 0.5), t10 (with a node in the middle of
    /// every edge: about seven times the nodes), or auto: t4 below 0.45,
    /// t4-anp from there on [default: auto].
    #[arg(long, value_name = "t4|t4-anp|t10|auto")]
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

/// Rules of the grasp, equations, and configuration of the hand.
struct Grasping {
    rule: GraspRule,
    elasticity: Elasticity,
    hand: HandRequest,
}

/// Longest time from tick to tick, s.
const PERIOD_MAX_S: f64 = 3600.0;

/// Most objects on one table: so many are drawn, and each has a link to the server.
const OBJECTS_MAX: usize = 8;

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
        self.object.first().or(self.named_object.as_ref())
    }

    /// Whether the script of a run begins again after its end; not if the run is recorded or has a number
    /// of ticks.
    pub(super) fn begins_anew(&self, plan: &RunPlan) -> bool {
        self.record.is_none() && self.ticks.is_none() && plan.recording.is_none()
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
        let file = self.scene.as_deref().map(SceneFile::read).transpose()?.unwrap_or_default();
        let objects = self.scenes_of_objects(&file)?;
        let is_several = objects.len() > 1;
        let (scene, first_laying) = &objects[0];
        let method = self.chosen_method(scene)?;
        let Grasping { rule, elasticity, hand } = self.grasping(scene, &method, is_several)?;
        let is_xr = self.takes_headset(&hand)?;
        let (force, contact_scene) = self.felt.of_run(rule.scene)?;
        let hand_configuration = self.hand.configuration()?;
        // The thesis's rules know one hand.
        let of_two = rule.scene.map(|_| self.hand.second(&hand, &hand_configuration));
        let second = of_two.transpose()?.flatten();
        // Devices have a time of their own.
        let is_timed = hand.is_live() || second.as_ref().is_some_and(|second| second.is_live);
        let period = self.period(is_timed || force.is_some());
        let server = self.server.clone().unwrap_or(ServerChoice::Embedded);
        let flags = ObjectFlags {
            object: self.asked_object().filter(|_| !is_several),
            nodes: self.nodes,
            size_m: self.object_size,
            young: self.young,
            poisson: self.poisson,
            element: self.element,
            regions: &self.regions.regions,
            method,
            subscription: match self.needs_whole() {
                false => Subscription::Surface,
                true => Subscription::Whole,
            },
            max_error: self.max_error,
        };
        let first = flags.plan(scene, GraspRule { scene: contact_scene, ..rule }, elasticity)?;
        Ok(RunPlan {
            further: self.further(&flags, &objects[1..])?,
            first_laying: first_laying.clone(),
            aim: self.aim(objects.len())?,
            first,
            force,
            place: self.place.map_or(ObjectPlace::Home, PlaceChoice::place),
            endpoint: self.access.to(&server)?,
            server,
            pace: if period.is_some() { Pace::Free } else { Pace::Lockstep },
            period,
            is_live: hand.is_live(),
            is_even: hand.is_even(),
            hand,
            second,
            hand_configuration,
            world_from_sender: self.hand.world_from_sender(is_xr),
            recording: None,
        })
    }

    /// Method that flags or scene name.
    fn chosen_method(&self, scene: &SceneFile) -> anyhow::Result<MethodName> {
        Ok(match (&self.method, &scene.method) {
            (Some(method), _) => method.clone(),
            (None, Some(name)) => name.parse().context("the scene's method")?,
            (None, None) => MethodName::auto(),
        })
    }

    /// Plans of the further objects, each of its own scene.
    fn further(
        &self,
        flags: &ObjectFlags<'_>,
        scenes: &[(SceneFile, Laying)],
    ) -> anyhow::Result<Vec<(ObjectPlan, Laying)>> {
        let plan = |scene: &SceneFile| {
            let rule = self.grasp.of_run(scene, &self.elasticity, false)?;
            flags.plan(scene, rule, self.elasticity.of_contact(scene)?)
        };
        let plans = scenes.iter().enumerate().map(|(at, (scene, laying))| {
            let plan = plan(scene).with_context(|| format!("object {}", at + 2))?;
            Ok((plan, laying.clone()))
        });
        plans.collect()
    }

    /// Scene of each object: those that flags name, or else those of the file, each with what it has of its
    /// own. Several are grasped by contact, unless something else is asked for.
    ///
    /// # Errors
    /// What does not go with several objects.
    fn scenes_of_objects(&self, file: &SceneFile) -> anyhow::Result<Vec<(SceneFile, Laying)>> {
        let named: Vec<SceneEntry> = match &self.object[..] {
            [] if self.named_object.is_none() => file.entries().to_vec(),
            [] | [_] => Vec::new(),
            several => several.iter().map(SceneEntry::of).collect(),
        };
        if named.len() < 2 {
            // A flag replaces a list, and a list of one is one object.
            let alone = named.first().map(|entry| file.of_entry(entry));
            let laying = named.first().map(Laying::of).transpose()?.unwrap_or_default();
            return Ok(vec![(alone.unwrap_or_else(|| file.clone()), laying)]);
        }
        if named.len() > OBJECTS_MAX {
            bail!(
                "{} objects do not lie on one table: there is room for {OBJECTS_MAX}",
                named.len()
            );
        }
        self.check_several(file)?;
        let of_entry = |entry: &SceneEntry| {
            let mut scene = file.of_entry(entry);
            scene.grasp.get_or_insert_with(|| "contact".to_owned());
            Ok((scene, Laying::of(entry)?))
        };
        named.iter().map(of_entry).collect()
    }

    /// Checks that nothing was asked for that several objects do not go with.
    fn check_several(&self, file: &SceneFile) -> anyhow::Result<()> {
        let refused = [
            (self.record.is_some(), "--record: a recording holds one object"),
            (self.series.is_some(), "--series: its files hold one object"),
            (self.out_dir.is_some(), "--out-dir: its files hold one object"),
            (self.felt.force.is_some(), "--force: a hand feels one object"),
            (
                !self.regions.regions.is_empty(),
                "--material-region: write the region under its object, as [[object.region]] of a scene",
            ),
            (
                !file.region.is_empty(),
                "[[region]]: write the region under its object, as [[object.region]]",
            ),
        ];
        match refused.iter().find(|(is_asked, _)| *is_asked) {
            Some((_, what)) => bail!("several objects do not go with {what}"),
            None => Ok(()),
        }
    }

    /// Number, from 0, of the object that a hand goes to by itself.
    fn aim(&self, objects: usize) -> anyhow::Result<usize> {
        match self.lifts.unwrap_or(1) {
            lifts if lifts > objects => {
                bail!("--lifts {lifts}: there are {objects} objects; the first is 1")
            }
            lifts => Ok(lifts.saturating_sub(1)),
        }
    }

    /// Time from tick to tick, if a person watches or the hand `is_timed`.
    fn period(&self, is_timed: bool) -> Option<Duration> {
        let is_timed = is_timed || self.is_watched();
        let rate = self.rate.or(is_timed.then_some(TICKS_PER_S))?;
        Some(Duration::from_secs_f64((1.0 / rate).min(PERIOD_MAX_S)))
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
    fn grasping(
        &self,
        scene: &SceneFile,
        method: &MethodName,
        is_several: bool,
    ) -> anyhow::Result<Grasping> {
        // A run picks its object from a table; only scripts of the thesis's grasp need the thesis's rules.
        let first = self.hand.first();
        let plays_thesis =
            matches!(first, Some(HandRequest::Scripted(s)) if *s != ScriptName::Lift);
        let lifts = self.hand.are_two() || is_several || !plays_thesis;
        let needs_thesis = !lifts || *method != MethodName::auto();
        let rule = self.grasp.of_run(scene, &self.elasticity, needs_thesis)?;
        if self.hand.are_two() && rule.scene.is_none() {
            bail!("two hands need --grasp contact: the rules of the thesis know one hand");
        }
        if is_several && rule.scene.is_none() {
            bail!("several objects need --grasp contact: the rules of the thesis know one object");
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
        if self.object.len() > 1 || self.lifts.is_some() {
            bail!("a recording holds one object: leave out the second --object, and --lifts");
        }
        let recording = read_recording(path)?;
        let setup = &recording.setup;
        let watched = self.is_watched();
        let speed = self.speed.unwrap_or(if watched { 1.0 } else { 0.0 });
        let period = (speed > 0.0).then(|| (setup.tick_s() / speed).min(PERIOD_MAX_S));
        let server = self.server.clone().unwrap_or(ServerChoice::Embedded);
        Ok(RunPlan {
            first: ObjectPlan {
                object: match self.asked_object() {
                    Some(named) => named.clone(),
                    None => recorded_object(path, &setup.object)?,
                },
                nodes: setup.nodes,
                size_m: setup.size_m,
                regions: recorded_regions(setup),
                settings: recorded_settings(setup)?,
                contact_scene: recorded_scene(setup),
            },
            first_laying: Laying::default(),
            further: Vec::new(),
            aim: 0,
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
            is_even: setup.is_even,
            world_from_sender: recorded_place(setup),
            recording: Some(Arc::new(recording)),
        })
    }
}

fn console_is_watched() -> bool {
    std::io::stderr().is_terminal()
}
