//! `glove-client calibrate --out F`: guides through the gestures and writes the calibration.

use std::path::PathBuf;

use anyhow::{Context, bail, ensure};
use clap::Args;
use softgrasp_grasp::hand::{HandDimensions, Handedness};
use softgrasp_hand::devices::calibration::{
    Calibration, CalibrationHeader, FitReport, SensorFit, ThumbFit, read_calibration, sensor_name,
    toml_text, virtual_hand_text,
};
use softgrasp_hand::devices::cyberglove::{SensorCount, SensorSet};
use softgrasp_hand::hand_setup::HandConfiguration;
use softgrasp_hand::serial::SerialSource;

use super::collecting::Patience;
use super::gestures::{GloveSource, Plan, take_gestures};
use super::hand_files::{read_text, relative_to, today, write_configuration};
use super::live_samples::live_glove;
use super::numbers::positive;
use super::output::print;
use super::sensor_bars::SensorBars;
use crate::object::file_writing::write_file;

/// Calibrate a glove: flat hand, fist, and if wanted the thumb.
#[derive(Args)]
pub struct CalibrateCommand {
    /// File to write: .cal (VirtualHand), or .toml.
    #[arg(long, value_name = "F")]
    out: PathBuf,
    /// Configuration of the hand (hand.toml), made or brought up to date.
    #[arg(long, value_name = "F")]
    setup: Option<PathBuf>,
    /// Length of the hand in m: wrist crease to tip of the middle finger.
    #[arg(long, value_name = "M", value_parser = positive, allow_hyphen_values = true)]
    hand_length: Option<f64>,
    /// Breadth of the hand in m: across the knuckles, without the thumb.
    #[arg(long, value_name = "M", value_parser = positive, allow_hyphen_values = true)]
    hand_breadth: Option<f64>,
    /// The glove is for the left hand.
    #[arg(long)]
    left: bool,
    /// Sensors of the glove: 18 or 22.
    #[arg(long, value_name = "N", value_parser = sensor_count, allow_hyphen_values = true)]
    sensors: Option<SensorCount>,
    /// Show the thumb as a third gesture, so that its two sensors are told apart.
    #[arg(long)]
    thumb: bool,
    /// Serial ports: glove=PATH[@BAUD],tracker=PATH[@BAUD].
    #[arg(long, value_name = "PORTS")]
    ports: Option<SerialSource>,
    /// Folder with recorded bytes of the glove: flat.bin, fist.bin, and with --thumb thumb.bin.
    #[arg(long, value_name = "FOLDER")]
    from: Option<PathBuf>,
}

/// Parses the number of sensors: 18 or 22.
fn sensor_count(text: &str) -> Result<SensorCount, String> {
    match text {
        "18" => Ok(SensorCount::Eighteen),
        "22" => Ok(SensorCount::TwentyTwo),
        _ => Err("it must be 18 or 22".to_owned()),
    }
}

impl CalibrateCommand {
    /// Takes the gestures, writes the files, and tells how good the calibration is.
    ///
    /// # Errors
    /// One line each: a wrong size, a silent glove, gestures that make no calibration, a file that
    /// cannot be read or written. Without a calibration older files stay as they are.
    pub fn run(&self) -> anyhow::Result<()> {
        let mut configuration = self.configuration()?;
        let setup = &configuration.setup;
        let mut source = match &self.from {
            Some(folder) => GloveSource::Recorded(folder.clone()),
            None => GloveSource::Live(live_glove(&configuration, self.ports.as_ref())?),
        };
        let mut start = Calibration::default();
        start.hand = setup.dimensions.handedness;
        let plan = Plan::new(setup.sensors, self.thumb);
        let mut bars = SensorBars::on_standard_error();
        let report = take_gestures(&start, &mut source, &plan, &Patience::PERSON, &mut bars)?;
        if let Some(refusal) = report.refusal() {
            bail!("no calibration, and no file was written: {refusal}");
        }
        self.write(&report.calibration, &configuration)?;
        if let Some(path) = &self.setup {
            configuration.calibration_file = Some(relative_to(path, &self.out));
            write_configuration(path, &configuration)?;
        }
        print(&self.summary(&report, &configuration))
    }

    /// Present configuration, with the changes of the command line.
    fn configuration(&self) -> anyhow::Result<HandConfiguration> {
        let mut configuration = match &self.setup {
            // Its calibration is about to be made anew, so an old or lost one is no matter.
            Some(path) if path.exists() => HandConfiguration::read(&read_text(path)?)
                .with_context(|| format!("cannot use {}", path.display()))?,
            _ => HandConfiguration::default(),
        };
        let setup = &mut configuration.setup;
        let old = setup.dimensions;
        let size = HandDimensions::scaled(
            self.hand_length.unwrap_or(old.hand_length),
            self.hand_breadth.unwrap_or(old.hand_breadth),
        )?;
        let hand = if self.left { Handedness::Left } else { old.handedness };
        setup.dimensions = size.with_handedness(hand);
        setup.sensors = self.sensors.unwrap_or(setup.sensors);
        Ok(configuration)
    }

    /// Writes the calibration and reads the file back.
    fn write(
        &self,
        calibration: &Calibration,
        configuration: &HandConfiguration,
    ) -> anyhow::Result<()> {
        let dimensions = &configuration.setup.dimensions;
        let header = CalibrationHeader {
            program: concat!("glove-client ", env!("CARGO_PKG_VERSION")),
            date: &today(),
            sensors: configuration.setup.sensors,
            hand_size_m: Some([dimensions.hand_length, dimensions.hand_breadth]),
        };
        let text = match self.out.extension().is_some_and(|extension| extension == "toml") {
            true => toml_text(calibration)?,
            false => virtual_hand_text(calibration, &header),
        };
        write_file(&self.out, text.as_bytes())?;
        // A device or a pipe cannot be read again; its text can.
        let written = if self.out.is_file() { read_text(&self.out)? } else { text };
        let (back, _) = read_calibration(&written)
            .with_context(|| format!("{} cannot be read back", self.out.display()))?;
        ensure!(
            back == *calibration,
            "{} holds another calibration than was written",
            self.out.display()
        );
        Ok(())
    }

    fn summary(&self, report: &FitReport, configuration: &HandConfiguration) -> String {
        let names = |set: SensorSet| set.iter().map(sensor_name).collect::<Vec<_>>().join(", ");
        let mut lines = Vec::new();
        for (outcome, what) in [
            (SensorFit::Unmoved, "hardly moved and keep their default gain"),
            (SensorFit::Reversed, "went the wrong way and keep their default gain and offset"),
            (SensorFit::Dead, "are dead and held at rest"),
        ] {
            let set = report.with_outcome(outcome);
            if !set.is_empty() {
                lines.push(format!("sensors that {what}: {}", names(set)));
            }
        }
        lines.extend(report.complaints().iter().map(|complaint| format!("warning: {complaint}")));
        if report.thumb == ThumbFit::Unread {
            lines
                .push("warning: a sensor of the thumb is dead, so the thumb is not coupled".into());
        }
        lines.push(format!(
            "{} of {} sensors have new gains and offsets; written to {} and read back",
            report.with_outcome(SensorFit::Full).iter().count(),
            configuration.setup.sensors.number(),
            self.out.display()
        ));
        if let Some(path) = &self.setup {
            lines.push(format!("{} names it", path.display()));
        }
        lines.join("\n") + "\n"
    }
}

#[cfg(test)]
mod tests {
    use super::super::hand_files::read_configuration;
    use super::*;
    use clap::Parser;
    use softgrasp_grasp::hand::JointAngles;
    use softgrasp_hand::devices::calibration::thumb_across;
    use softgrasp_hand::devices::cyberglove::{GloveRecord, RecordKind, encode_record};

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        command: CalibrateCommand,
    }

    fn recorded(folder: &std::path::Path, sensors: SensorCount) {
        let calibration = Calibration::default();
        for (file, gesture) in [
            ("flat.bin", JointAngles::flat()),
            ("fist.bin", JointAngles::fist()),
            ("thumb.bin", thumb_across()),
        ] {
            let sensors = calibration.raw_from_angles(&gesture, sensors);
            let kind = RecordKind::Polled;
            let record = GloveRecord { kind, sensors, timestamp: None, status: None };
            std::fs::write(folder.join(file), encode_record(&record).repeat(30)).unwrap();
        }
    }

    fn run(folder: &std::path::Path, words: &str) -> anyhow::Result<()> {
        let path = |word: &str| word.replace('@', &format!("{}/", folder.display()));
        let words = words.split_whitespace().map(path);
        Line::try_parse_from(std::iter::once("calibrate".to_owned()).chain(words))?.command.run()
    }

    #[test]
    fn recorded_gestures_become_a_calibration_and_a_configuration() {
        let folder = tempfile::tempdir().unwrap();
        recorded(folder.path(), SensorCount::Eighteen);
        run(
            folder.path(),
            "--from @ --out @me.cal --setup @hand.toml --left --sensors 18 --thumb \
             --hand-length 0.19 --hand-breadth 0.08",
        )
        .unwrap();
        let configuration = read_configuration(&folder.path().join("hand.toml")).unwrap();
        let setup = &configuration.setup;
        assert_eq!(configuration.calibration_file, Some(PathBuf::from("me.cal")));
        assert_eq!(
            (setup.dimensions.handedness, setup.calibration.hand),
            (Handedness::Left, Handedness::Left)
        );
        assert_eq!((setup.dimensions.hand_length, setup.sensors), (0.19, SensorCount::Eighteen));
        let raw = Calibration::default().raw_from_angles(&JointAngles::fist(), setup.sensors);
        let back = setup.calibration.angles(&raw, SensorSet::EMPTY);
        assert!((back.ring.pip_flexion - JointAngles::fist().ring.pip_flexion).abs() < 1e-9);
        assert!(!setup.calibration.thumb_coupling.is_none());
        // Once more: sizes, hand and sensors are those of the file now.
        run(folder.path(), "--from @ --out @me.toml --setup @hand.toml").unwrap();
        let again = read_configuration(&folder.path().join("hand.toml")).unwrap();
        assert_eq!(again.setup.dimensions, setup.dimensions);
        assert_eq!(again.calibration_file, Some(PathBuf::from("me.toml")));
    }

    #[test]
    fn swapped_gestures_and_a_hand_that_never_moved_write_no_file_and_leave_older_ones_alone() {
        let folder = tempfile::tempdir().unwrap();
        recorded(folder.path(), SensorCount::TwentyTwo);
        let file = |name: &str| folder.path().join(name);
        run(folder.path(), "--from @ --out @me.cal --setup @hand.toml").unwrap();
        let before = ["me.cal", "hand.toml"].map(|name| std::fs::read(file(name)).unwrap());
        let [flat, fist] = ["flat.bin", "fist.bin"].map(|name| std::fs::read(file(name)).unwrap());
        for (first, second, words) in
            [(&fist, &flat, "in the wrong order"), (&flat, &flat, "only 0 of the 8 sensors")]
        {
            std::fs::write(file("flat.bin"), first).unwrap();
            std::fs::write(file("fist.bin"), second).unwrap();
            let words_of = "--from @ --out @me.cal --setup @hand.toml";
            let error = run(folder.path(), words_of).unwrap_err().to_string();
            assert!(error.contains(words) && error.contains("no file was written"), "{error}");
            let error = run(folder.path(), "--from @ --out @new.cal").unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
            let after = ["me.cal", "hand.toml"].map(|name| std::fs::read(file(name)).unwrap());
            assert!(before == after, "older files are as they were");
            assert!(!file("new.cal").exists());
        }
    }

    #[test]
    fn what_cannot_work_is_refused_with_a_sentence() {
        let folder = tempfile::tempdir().unwrap();
        recorded(folder.path(), SensorCount::TwentyTwo);
        let refused = |words: &str| run(folder.path(), words).unwrap_err().to_string();
        assert!(
            refused("--from @ --out @me.cal --sensors 18").contains("no record of a glove with 18")
        );
        assert!(refused("--from @ --out @me.cal --sensors 20").contains("it must be 18 or 22"));
        assert!(
            refused("--from @ --out @me.cal --hand-length 190").contains("outside 0.10 to 0.30 m")
        );
        assert!(refused("--from @nowhere --out @me.cal").contains("cannot read"));
        assert!(!folder.path().join("me.cal").exists());
    }
}
