//! `glove-client align --setup F`: where the receiver sits and where the transmitter stands.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use nalgebra::{Isometry3, Point3};
use softgrasp_hand::devices::ReceiverMount;
use softgrasp_hand::devices::alignment::{
    AlignmentError, AveragedPose, FlatHand, MountPart, Pivot, StandTilt, aligned_mount,
    aligned_stand, average_pose, find_pivot,
};
use softgrasp_hand::hand_setup::HandConfiguration;
use softgrasp_hand::serial::SerialSource;

use super::arm_recording::{ArmRecording, ArmSource, Held, record_arm};
use super::collecting::Patience;
use super::hand_files::{read_configuration, write_configuration};
use super::live_samples::live_arm;
use super::numbers::place;
use super::output::print;

/// Align the tracker: receiver to wrist, transmitter to world.
#[derive(Args)]
pub struct AlignCommand {
    /// Configuration of the hand (hand.toml), brought up to date.
    #[arg(long, value_name = "F")]
    setup: PathBuf,
    /// What to find.
    #[arg(long, value_enum, default_value_t = Step::Both)]
    step: Step,
    /// Place of the wrist crease of the flat hand in the world, m: X right, Y up, Z backward.
    #[arg(
        long, value_name = "X,Y,Z", value_parser = place, default_value = "0,0,0",
        allow_hyphen_values = true
    )]
    at: Point3<f64>,
    /// The transmitter does not stand level: take all of its attitude from the hand.
    #[arg(long)]
    tilted: bool,
    /// Where the receiver is worn; without it, where the configuration says.
    #[arg(long, value_enum)]
    on: Option<Part>,
    /// Serial ports: glove=PATH[@BAUD],tracker=PATH[@BAUD].
    #[arg(long, value_name = "PORTS")]
    ports: Option<SerialSource>,
    /// Folder with recorded bytes: flat.tracker.bin, turn.tracker.bin, and maybe flat.glove.bin.
    #[arg(long, value_name = "FOLDER")]
    from: Option<PathBuf>,
}

/// The steps of an alignment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Step {
    /// Where the receiver sits on the arm.
    Receiver,
    /// Where the transmitter stands in the world.
    Transmitter,
    /// First the receiver, then the transmitter.
    Both,
}

/// Where a receiver is worn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Part {
    /// On the back of the hand.
    Hand,
    /// On the forearm.
    Forearm,
}

/// Result of an alignment, and its errors.
struct Found {
    flat: AveragedPose,
    pivot: Option<Pivot>,
    tilt_deg: Option<f64>,
}

impl AlignCommand {
    /// Records, fits, writes the configuration, and tells the errors.
    ///
    /// # Errors
    /// One line each: a silent device, a hand that moved, a file that cannot be read or written.
    pub fn run(&self) -> anyhow::Result<()> {
        let mut configuration = read_configuration(&self.setup)?;
        let mut source = match &self.from {
            Some(folder) => ArmSource::Recorded(folder.clone()),
            None => ArmSource::Live(live_arm(&configuration, self.ports.as_ref())?),
        };
        let mut record = |held| {
            let told = &mut std::io::stderr();
            record_arm(held, &mut source, &configuration, &Patience::PERSON, told)
        };
        let turning = match self.step {
            Step::Transmitter => None,
            Step::Receiver | Step::Both => Some(record(Held::Turning)?.poses),
        };
        let flat = record(Held::Flat)?;
        let found = self.align(&mut configuration, turning.as_deref(), &flat)?;
        write_configuration(&self.setup, &configuration)?;
        print(&self.summary(&found, &configuration))
    }

    /// Fits the recordings, and puts the result into the configuration.
    fn align(
        &self,
        configuration: &mut HandConfiguration,
        turning: Option<&[Isometry3<f64>]>,
        recording: &ArmRecording,
    ) -> Result<Found, AlignmentError> {
        let setup = &mut configuration.setup;
        let average = average_pose(&recording.poses)?;
        let flat = FlatHand {
            stand_from_receiver: average.pose,
            angles: &recording.angles,
            hand: setup.dimensions.handedness,
        };
        let pivot = turning.map(find_pivot).transpose()?;
        if let Some(pivot) = &pivot {
            let part = match self.on {
                None => MountPart::of(&setup.mount),
                Some(Part::Hand) => MountPart::Hand,
                Some(Part::Forearm) => MountPart::Forearm,
            };
            setup.mount = aligned_mount(&flat, part, &setup.world_from_stand, pivot.in_receiver);
        }
        let mut tilt_deg = None;
        if self.step != Step::Receiver {
            let tilt = if self.tilted { StandTilt::Free } else { StandTilt::Level };
            let stand = aligned_stand(&flat, &setup.mount, self.at, tilt)?;
            setup.world_from_stand = stand.world_from_stand;
            tilt_deg = Some(stand.tilt_rad.to_degrees());
        }
        Ok(Found { flat: average, pivot, tilt_deg })
    }

    fn summary(&self, found: &Found, configuration: &HandConfiguration) -> String {
        let Found { flat, pivot, tilt_deg } = found;
        let mut lines = vec![format!(
            "flat hand: {} records, {} left out, within {:.1} mm and {:.2} degrees of their mean",
            flat.used,
            flat.left_out,
            1e3 * flat.spread_m,
            flat.spread_rad.to_degrees()
        )];
        if let Some(pivot) = pivot {
            lines.push(format!(
                "turns: {} records, {} left out; the crease moved by {:.1} mm (root mean square), \
                 its place in the receiver's frame is certain to {:.1} mm",
                pivot.used,
                pivot.left_out,
                1e3 * pivot.residual_m,
                1e3 * pivot.uncertainty_m
            ));
            let (part, pose) = match &configuration.setup.mount {
                ReceiverMount::Hand { receiver_from_palm } => ("hand", receiver_from_palm),
                ReceiverMount::Forearm { receiver_from_forearm } => {
                    ("forearm", receiver_from_forearm)
                }
            };
            lines.push(format!("receiver on the {part}, crease at {}", millimetres(pose)));
        }
        if let Some(tilt_deg) = tilt_deg {
            let stand = &configuration.setup.world_from_stand;
            lines.push(format!("transmitter in the world at {}", millimetres(stand)));
            if !self.tilted && *tilt_deg > 5.0 {
                lines.push(format!(
                    "the hand was {tilt_deg:.0} degrees askew; a transmitter that does not stand \
                     level needs --tilted"
                ));
            }
        }
        lines.push(format!("written to {}", self.setup.display()));
        lines.join("\n") + "\n"
    }
}

fn millimetres(pose: &Isometry3<f64>) -> String {
    let [x, y, z] = <[f64; 3]>::from(pose.translation.vector).map(|m| 1e3 * m);
    format!("{x:.0}, {y:.0}, {z:.0} mm")
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use clap::Parser;
    use nalgebra::{UnitQuaternion, Vector3};
    use softgrasp_grasp::hand::{Handedness, JointAngles};
    use softgrasp_hand::devices::alignment::flat_hand_at;
    use softgrasp_hand::devices::fastrak::{FastrakRecord, encode_record};

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        command: AlignCommand,
    }

    fn run(folder: &Path, words: &str) -> anyhow::Result<()> {
        let path = |word: &str| word.replace('@', &format!("{}/", folder.display()));
        let words = words.split_whitespace().map(path);
        Line::try_parse_from(std::iter::once("align".to_owned()).chain(words))?.command.run()
    }

    fn bytes(poses: &[Isometry3<f64>], configuration: &HandConfiguration) -> Vec<u8> {
        let format = configuration.setup.tracker;
        poses
            .iter()
            .flat_map(|pose| {
                let station = configuration.tracker.station;
                let record = FastrakRecord::from_world(station, pose, format.output, format.units);
                encode_record(&record, format.encoding).unwrap()
            })
            .collect()
    }

    /// Files of a hand whose receiver and transmitter are elsewhere than the defaults say.
    fn recorded(folder: &Path) -> (ReceiverMount, Isometry3<f64>) {
        let configuration = HandConfiguration::default();
        write_configuration(&folder.join("hand.toml"), &configuration).unwrap();
        let ReceiverMount::Forearm { receiver_from_forearm } = configuration.setup.mount else {
            unreachable!("the default")
        };
        let moved = Isometry3::new(Vector3::new(0.01, -0.02, 0.004), Vector3::new(0.1, 0.05, -0.2));
        let mount = ReceiverMount::Forearm { receiver_from_forearm: moved * receiver_from_forearm };
        // Level, and directed as the configuration says: its place is not what it says.
        let world_from_stand = Isometry3::translation(0.2, -0.3, 0.7);
        let flat = JointAngles::flat();
        let stand_from_receiver = |palm: &Isometry3<f64>| {
            world_from_stand.inverse() * mount.world_from_receiver(palm, &flat, Handedness::Right)
        };
        let still = vec![stand_from_receiver(&flat_hand_at(Point3::new(0.0, 0.1, 0.0))); 50];
        let turning: Vec<_> = (0..100)
            .map(|i| {
                let t = f64::from(i) * 0.3;
                let turn =
                    Vector3::new(0.4 * t.sin(), 0.3 * (1.7 * t).cos(), 0.4 * (2.3 * t).sin());
                let palm = flat_hand_at(Point3::new(0.05, 0.0, 0.1));
                stand_from_receiver(&(palm * UnitQuaternion::from_scaled_axis(turn)))
            })
            .collect();
        std::fs::write(folder.join("flat.tracker.bin"), bytes(&still, &configuration)).unwrap();
        std::fs::write(folder.join("turn.tracker.bin"), bytes(&turning, &configuration)).unwrap();
        (mount, world_from_stand)
    }

    #[test]
    fn recorded_bytes_align_receiver_and_transmitter() {
        let folder = tempfile::tempdir().unwrap();
        let (mount, world_from_stand) = recorded(folder.path());
        run(folder.path(), "--setup @hand.toml --from @ --at 0,0.1,0").unwrap();
        let found = read_configuration(&folder.path().join("hand.toml")).unwrap().setup;
        let off = |a: &Isometry3<f64>, b: &Isometry3<f64>| {
            let way = (a.translation.vector - b.translation.vector).norm();
            way.max(a.rotation.angle_to(&b.rotation))
        };
        // Records hold 32-bit numbers in centimetres.
        assert!(off(&found.world_from_stand, &world_from_stand) < 1e-4);
        let angles = JointAngles { wrist_pitch: 0.3, ..JointAngles::flat() };
        let palm = Isometry3::new(Vector3::new(0.1, 0.2, -0.1), Vector3::new(0.2, 0.3, 0.4));
        let reading = mount.world_from_receiver(&palm, &angles, Handedness::Right);
        assert!(
            off(&found.mount.world_from_palm(&reading, &angles, Handedness::Right), &palm) < 1e-4
        );
    }

    #[test]
    fn one_step_leaves_the_other_as_it_was() {
        let folder = tempfile::tempdir().unwrap();
        let (_, world_from_stand) = recorded(folder.path());
        let read = || read_configuration(&folder.path().join("hand.toml")).unwrap().setup;
        let before = read();
        run(folder.path(), "--setup @hand.toml --from @ --step receiver --on hand").unwrap();
        let receiver = read();
        assert!(matches!(receiver.mount, ReceiverMount::Hand { .. }));
        assert_eq!(receiver.world_from_stand, before.world_from_stand);
        run(folder.path(), "--setup @hand.toml --from @ --step transmitter --at 0,0.1,0 --tilted")
            .unwrap();
        let both = read();
        assert_eq!(both.mount, receiver.mount);
        let way = both.world_from_stand.translation.vector - world_from_stand.translation.vector;
        assert!(way.norm() < 1e-4);
    }

    #[test]
    fn what_cannot_work_is_refused_and_nothing_is_written() {
        let folder = tempfile::tempdir().unwrap();
        recorded(folder.path());
        let text = || std::fs::read_to_string(folder.path().join("hand.toml")).unwrap();
        let before = text();
        let refused = |words: &str| run(folder.path(), words).unwrap_err().to_string();
        std::fs::copy(
            folder.path().join("flat.tracker.bin"),
            folder.path().join("turn.tracker.bin"),
        )
        .unwrap();
        assert!(refused("--setup @hand.toml --from @").contains("bend the wrist up and down"));
        assert!(refused("--setup @none.toml --from @").contains("cannot read"));
        assert!(refused("--setup @hand.toml --from @none").contains("cannot read"));
        for at in ["1,2", "1,2,3,4", "1,x,3", "0,0,nan", "0,0,11"] {
            assert!(
                refused(&format!("--setup @hand.toml --from @ --at {at}"))
                    .contains("three numbers")
            );
        }
        assert_eq!(text(), before);
    }
}
