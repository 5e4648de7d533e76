//! Guides a person through the gestures of a calibration and judges them.

use std::io::Write;
use std::path::PathBuf;

use softgrasp_grasp::hand::JointAngles;
use softgrasp_hand::devices::calibration::{
    Calibration, FitReport, Gesture, fit_gestures, thumb_across,
};
use softgrasp_hand::devices::cyberglove::{RawSensors, SensorCount};

use super::collecting::{Patience, Phase, collect};
use super::live_samples::NextReading;
use super::recorded_samples::recorded_readings;
use super::sensor_bars::SensorBars;

/// Source of the readings of a gesture.
pub(super) enum GloveSource {
    /// Folder with the glove's raw bytes: `flat.bin`, `fist.bin`, `thumb.bin`.
    Recorded(PathBuf),
    /// Glove on a person's hand.
    Live(NextReading),
}

/// Gesture that a person is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shown {
    /// Flat hand.
    Flat,
    /// Fist.
    Fist,
    /// Thumb in front of the palm.
    Thumb,
}

impl Shown {
    fn name(self) -> &'static str {
        match self {
            Self::Flat => "flat hand",
            Self::Fist => "fist",
            Self::Thumb => "thumb across",
        }
    }

    fn file(self) -> &'static str {
        match self {
            Self::Flat => "flat.bin",
            Self::Fist => "fist.bin",
            Self::Thumb => "thumb.bin",
        }
    }

    fn instruction(self) -> &'static str {
        match self {
            Self::Flat => {
                "Lay the hand flat on a table: fingers straight and together, thumb beside the \
                 palm, wrist straight."
            }
            Self::Fist => {
                "Make a tight fist: all fingers bent as far as they go, the thumb over them, wrist \
                 straight."
            }
            Self::Thumb => {
                "Hold the fingers flat and swing the straight thumb in front of the palm, away \
                 from it, as around a jar."
            }
        }
    }

    /// Joint angles that the gesture is assumed to have.
    fn angles(self) -> JointAngles {
        match self {
            Self::Flat => JointAngles::flat(),
            Self::Fist => JointAngles::fist(),
            Self::Thumb => thumb_across(),
        }
    }
}

/// Gestures that a person is asked for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plan {
    /// Number of sensors of the glove.
    pub(super) sensors: SensorCount,
    /// Whether the thumb is shown as a third gesture.
    pub(super) with_thumb: bool,
    /// Number of readings of a live gesture.
    pub(super) readings: usize,
    /// Number of times that live gestures may be shown before the last ones are taken as they are.
    pub(super) rounds: usize,
}

impl Plan {
    /// Plan with about a second of a polled glove for each gesture, and three rounds at most.
    pub(super) fn new(sensors: SensorCount, with_thumb: bool) -> Self {
        Self { sensors, with_thumb, readings: 100, rounds: 3 }
    }

    fn gestures(&self) -> &'static [Shown] {
        match self.with_thumb {
            false => &[Shown::Flat, Shown::Fist],
            true => &[Shown::Flat, Shown::Fist, Shown::Thumb],
        }
    }
}

/// Takes all gestures and fits the calibration; asks again for live gestures that are not good enough.
///
/// Faults that remain are in the report's complaints.
///
/// # Errors
/// A sentence for a file that cannot be read or a glove that is silent.
pub(super) fn take_gestures(
    start: &Calibration,
    source: &mut GloveSource,
    plan: &Plan,
    patience: &Patience,
    bars: &mut SensorBars<impl Write>,
) -> anyhow::Result<FitReport> {
    let mut round = 1;
    loop {
        let mut held = Vec::new();
        for &shown in plan.gestures() {
            held.push((shown.angles(), hold(shown, source, plan, patience, bars)?));
        }
        let report = fit(start, &held);
        let complaints = report.complaints();
        if complaints.is_empty() || matches!(source, GloveSource::Recorded(_)) {
            return Ok(report);
        }
        for complaint in &complaints {
            bars.say(&format!("  {complaint}"));
        }
        if round >= plan.rounds {
            return Ok(report);
        }
        round += 1;
        bars.say("Once more from the start.");
    }
}

fn fit(start: &Calibration, held: &[(JointAngles, Vec<RawSensors>)]) -> FitReport {
    let gesture =
        |place: usize| held.get(place).map(|(angles, readings)| Gesture { angles, readings });
    let none = Gesture { angles: &JointAngles::flat(), readings: &[] };
    fit_gestures(start, gesture(0).unwrap_or(none), gesture(1).unwrap_or(none), gesture(2))
}

fn hold(
    shown: Shown,
    source: &mut GloveSource,
    plan: &Plan,
    patience: &Patience,
    bars: &mut SensorBars<impl Write>,
) -> anyhow::Result<Vec<RawSensors>> {
    let next = match source {
        GloveSource::Recorded(folder) => {
            return recorded_readings(&folder.join(shown.file()), plan.sensors);
        }
        GloveSource::Live(next) => next,
    };
    bars.say(shown.instruction());
    let readings = collect(&mut **next, plan.readings, patience, |phase, raw| {
        let title = match phase {
            Phase::GetReady { seconds } => format!("{}: get ready, {seconds} s", shown.name()),
            Phase::Hold { .. } => format!("{}: hold it", shown.name()),
        };
        bars.show(&title, raw);
    })?;
    bars.say(&format!("{}: {} readings.", shown.name(), readings.len()));
    Ok(readings)
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use softgrasp_hand::devices::calibration::{SensorFit, ThumbFit};
    use softgrasp_hand::devices::cyberglove::Sensor;

    const AT_ONCE: Patience = Patience {
        get_ready: Duration::ZERO,
        gap: Duration::from_secs(30),
        silence: Duration::from_secs(30),
    };

    /// Glove that shows gestures in turn, each for `readings` readings.
    fn glove(gestures: Vec<JointAngles>, readings: usize) -> GloveSource {
        let calibration = Calibration::default();
        let mut count = 0;
        GloveSource::Live(Box::new(move || {
            let gesture = &gestures[(count / readings).min(gestures.len() - 1)];
            count += 1;
            Some(calibration.raw_from_angles(gesture, SensorCount::TwentyTwo))
        }))
    }

    fn take(source: &mut GloveSource, with_thumb: bool) -> (FitReport, String) {
        let plan = Plan { readings: 20, ..Plan::new(SensorCount::TwentyTwo, with_thumb) };
        let mut told = Vec::new();
        let mut bars = SensorBars::new(&mut told, false);
        let start = Calibration::default();
        let report = take_gestures(&start, source, &plan, &AT_ONCE, &mut bars).unwrap();
        (report, String::from_utf8(told).unwrap())
    }

    #[test]
    fn good_gestures_are_taken_at_once() {
        let shown = vec![JointAngles::flat(), JointAngles::fist(), thumb_across()];
        let (report, told) = take(&mut glove(shown, 20), true);
        assert_eq!((report.complaints().len(), report.thumb), (0, ThumbFit::Coupled));
        assert_eq!(report.with_outcome(SensorFit::Full).iter().count(), 17);
        for part in ["Lay the hand flat", "tight fist", "around a jar", "fist: hold it: "] {
            assert!(told.contains(part), "{part} in {told}");
        }
        assert!(!told.contains("Once more"));
    }

    #[test]
    fn a_loose_fist_is_told_and_asked_for_again() {
        let mut loose = JointAngles::fist();
        loose.index.mcp_flexion = 0.05;
        let shown = vec![JointAngles::flat(), loose, JointAngles::flat(), JointAngles::fist()];
        let (report, told) = take(&mut glove(shown, 20), false);
        assert!(report.complaints().is_empty());
        let sentence = "index MPJ moved by 3 counts only; hold a tighter fist and try again";
        assert!(told.contains(sentence), "{told}");
        assert_eq!(told.matches("Once more").count(), 1);
        assert!(
            (report.calibration.sensor(Sensor::IndexMcp).gain_rad_per_count - 0.01616).abs() < 2e-4
        );
    }

    #[test]
    fn after_three_rounds_the_complaints_stay_in_the_report() {
        let (report, told) = take(&mut glove(vec![JointAngles::flat()], 20), false);
        assert!(!report.complaints().is_empty());
        assert_eq!(told.matches("Once more").count(), 2);
    }
}
