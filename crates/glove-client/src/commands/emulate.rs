//! `glove-client emulate`: a glove and a tracker behind pseudo-terminals.

use std::path::PathBuf;

use clap::Args;
use softgrasp_emulator::FaultSetting;
use softgrasp_grasp::object::ObjectChoice;
use softgrasp_hand::scripted::ScriptName;

use super::numbers::{count, positive};

/// Emulate a glove and a tracker: prints the path of each, which can be opened as a serial port, and
/// serves until it is stopped.
#[derive(Args)]
pub struct EmulateCommand {
    /// What the hand does: approach, attach, squeeze, release or regrasp, from the moment on when
    /// both devices are asked [default: regrasp].
    #[arg(long, value_name = "NAME", conflicts_with = "replay")]
    script: Option<ScriptName>,
    /// Recording of a tracker to play: .traj (4 × 4 matrices); the hand stays flat.
    #[arg(long, value_name = "FILE")]
    replay: Option<PathBuf>,
    /// Fault of the devices, and the share of records that it hits: dead-sensor, zero-byte,
    /// not-plugged-in, too-fast, hemisphere-flip, station-error, error-record, truncated, noise,
    /// duplicate, burst, silence. May be repeated.
    #[arg(long, value_name = "NAME[:RATE]")]
    fault: Vec<FaultSetting>,
    /// Decides which records the faults hit.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Sensors of the glove: 18 or 22 [default: 22].
    #[arg(long, value_name = "18|22", value_parser = ["18", "22"])]
    sensors: Option<String>,
    /// A left hand.
    #[arg(long)]
    left: bool,
    /// Speed of both lines; a client with another speed hears noise.
    #[arg(long, value_name = "BAUD", default_value_t = 115_200,
        value_parser = clap::value_parser!(u32).range(300..=4_000_000))]
    baud: u32,
    /// Folder for links with lasting names, `glove` and `tracker`.
    #[arg(long, value_name = "D")]
    link_dir: Option<PathBuf>,
    /// End after so many records of the glove.
    #[arg(long, value_name = "N", value_parser = count, allow_hyphen_values = true)]
    frames: Option<usize>,
    /// End after so many seconds.
    #[arg(long, value_name = "S", value_parser = positive, allow_hyphen_values = true)]
    seconds: Option<f64>,
    /// Object that the script grasps, as for `run` [default: strawberry].
    #[arg(long, value_name = "FILE|SHAPE")]
    object: Option<ObjectChoice>,
    /// Nodes of a built-in object [default: 1000].
    #[arg(long, value_name = "N", value_parser = count, allow_hyphen_values = true)]
    nodes: Option<usize>,
    /// Longest extent of the object, m.
    #[arg(long, value_name = "M", value_parser = positive, allow_hyphen_values = true)]
    object_size: Option<f64>,
}

#[cfg(unix)]
mod serving {
    //! Where there are pseudo-terminals.

    use std::path::Path;
    use std::time::Duration;

    use anyhow::{Context, bail};
    use softgrasp_core::mesh::BuiltIn;
    use softgrasp_grasp::hand::Handedness;

    use super::EmulateCommand;
    use crate::commands::interruption;
    use crate::commands::output::Progress;
    use crate::commands::output::print;
    use crate::commands::recorded_settings::recorded_hand;
    use crate::object::loading::{ObjectRequest, load};
    use crate::object::scene::{NODES_DEFAULT, size_to_hold};
    use softgrasp_emulator::emulation::{Emulation, GloveLine, PseudoTerminal, TrackerLine};
    use softgrasp_emulator::{
        EmulatedGlove, EmulatedGloveKind, EmulatedTracker, EmulatedTrackerKind,
    };
    use softgrasp_grasp::object::ContactModel;
    use softgrasp_grasp::object::ObjectChoice;
    use softgrasp_hand::devices::cyberglove::SensorCount;
    use softgrasp_hand::devices::recordings::Trajectory;
    use softgrasp_hand::hand_setup::HandSetup;
    use softgrasp_hand::recording::read_recording;
    use softgrasp_hand::scripted::Rehearsal;
    use softgrasp_hand::serial::motion::Motion;
    use softgrasp_protocol::ElementName;

    impl EmulateCommand {
        /// Prints the paths of the devices and serves until it is stopped.
        ///
        /// # Errors
        /// A recording that cannot be read, an object that cannot be grasped, a system without
        /// pseudo-terminals, links that cannot be made.
        pub fn run(&self) -> anyhow::Result<()> {
            let setup = self.setup();
            let motion = self.motion(&setup)?;
            let glove = EmulatedGlove::new(EmulatedGloveKind {
                sensors: setup.sensors,
                hand: setup.dimensions.handedness,
                baud: self.baud,
                faults: self.fault.clone(),
                seed: self.seed,
                ..EmulatedGloveKind::default()
            });
            let tracker = EmulatedTracker::new(EmulatedTrackerKind {
                baud: self.baud,
                faults: self.fault.clone(),
                seed: self.seed.wrapping_add(1),
                ..EmulatedTrackerKind::default()
            });
            let terminal = |name: &str| -> anyhow::Result<PseudoTerminal> {
                let link = self.link_dir.as_ref().map(|folder| folder.join(name));
                Ok(PseudoTerminal::open(link.as_deref())?)
            };
            if let Some(folder) = &self.link_dir {
                std::fs::create_dir_all(folder)
                    .with_context(|| format!("cannot make the folder {}", folder.display()))?;
            }
            let glove = GloveLine { terminal: terminal("glove")?, glove };
            let tracker = TrackerLine { terminal: terminal("tracker")?, tracker };
            interruption::hear();
            print(&format!(
                "glove {}\ntracker {}\n",
                glove.terminal.path().display(),
                tracker.terminal.path().display()
            ))?;
            self.serve(Emulation::new(glove, tracker, motion));
            Ok(())
        }

        fn serve(&self, mut emulation: Emulation) {
            let frames = self.frames.map_or(u64::MAX, |frames| frames as u64);
            let seconds = self.seconds.unwrap_or(f64::INFINITY);
            while !interruption::asked()
                && emulation.glove_records() < frames
                && emulation.on_for_s() < seconds
            {
                emulation.step();
                std::thread::sleep(Duration::from_millis(1));
            }
            // The last record is still on its line.
            std::thread::sleep(Duration::from_millis(5));
            emulation.step();
        }

        fn setup(&self) -> HandSetup {
            let mut setup = HandSetup::default();
            if self.sensors.as_deref() == Some("18") {
                setup.sensors = SensorCount::Eighteen;
            }
            if self.left {
                setup.dimensions.handedness = Handedness::Left;
                setup.calibration.hand = Handedness::Left;
            }
            setup
        }

        fn motion(&self, setup: &HandSetup) -> anyhow::Result<Motion> {
            if let Some(path) = &self.replay {
                return replay(path, setup);
            }
            let _progress = Progress::start("looking for a grip");
            let strawberry = ObjectChoice::BuiltIn(BuiltIn::Strawberry);
            let choice = self.object.clone().unwrap_or(strawberry);
            let request = ObjectRequest {
                regions: Vec::new(),
                nodes: self.nodes.unwrap_or(NODES_DEFAULT),
                size_m: self.object_size.or_else(|| size_to_hold(&choice)),
                setup: setup.clone(),
                contact: ContactModel::default(),
                element: ElementName::T4,
                choice,
            };
            let loaded = load(&request, |_| true)?.context("the object was called off")?;
            let script = self.script.unwrap_or_default();
            let rehearsal = Rehearsal::of(script, setup.clone(), loaded.plan?, &loaded.object);
            Ok(Motion::script(setup.clone(), rehearsal))
        }
    }

    fn replay(path: &Path, setup: &HandSetup) -> anyhow::Result<Motion> {
        match path.extension().and_then(|extension| extension.to_str()) {
            Some("traj") => {
                let text = std::fs::read_to_string(path)
                    .with_context(|| format!("cannot read {}", path.display()))?;
                let trajectory =
                    Trajectory::parse(&text).with_context(|| format!("{}", path.display()))?;
                Ok(Motion::trajectory(setup.clone(), &trajectory))
            }
            Some("mcap") => {
                let recording = read_recording(path)?;
                let recorded = recorded_hand(&recording.setup)?.setup;
                Motion::recorded(&recording, recorded).with_context(|| {
                    format!("{} has no bytes of a glove and a tracker", path.display())
                })
            }
            _ => bail!(
                "{} is no recording that can be played; there are .traj and .mcap",
                path.display()
            ),
        }
    }
}

#[cfg(not(unix))]
impl EmulateCommand {
    /// Fails, because this system has no pseudo-terminals.
    ///
    /// # Errors
    /// Always.
    pub fn run(&self) -> anyhow::Result<()> {
        anyhow::bail!("this system has no pseudo-terminals, so no device can be emulated here")
    }
}
