//! Recordings for `align`: the arm held flat, and the arm turning about its wrist crease.

use std::io::Write;
use std::path::PathBuf;

use anyhow::Context;
use nalgebra::Isometry3;
use softgrasp_grasp::hand::JointAngles;
use softgrasp_hand::devices::cyberglove::{RawSensors, SensorSet};
use softgrasp_hand::hand_setup::HandConfiguration;

use super::collecting::{Patience, Phase, collect};
use super::live_samples::{ArmSample, NextArmSample};
use super::recorded_samples::{recorded_poses, recorded_readings};

/// Source of the samples of an arm.
pub(super) enum ArmSource {
    /// Folder with raw bytes: `flat.tracker.bin`, `turn.tracker.bin`, and for the wrist's angles
    /// `flat.glove.bin`; without the last one the wrist counts as straight.
    Recorded(PathBuf),
    /// Devices on a person's arm.
    Live(NextArmSample),
}

/// Gesture of the arm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Held {
    /// The hand lies flat at a known position.
    Flat,
    /// The hand turns about the wrist crease.
    Turning,
}

impl Held {
    fn instruction(self) -> &'static str {
        match self {
            Self::Flat => {
                "Lay the hand flat, palm down, fingers pointing forward, the wrist crease at the \
                 stated place, and hold still."
            }
            Self::Turning => {
                "Press the wrist crease against an edge so that it rests, and turn the part with \
                 the receiver about it: up and down, to both sides, 20 degrees and more."
            }
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Flat => "flat hand",
            Self::Turning => "turn about the crease",
        }
    }

    /// Number of samples of a live recording: 2 s and 10 s of a tracker with two receivers.
    fn samples(self) -> usize {
        match self {
            Self::Flat => 120,
            Self::Turning => 600,
        }
    }
}

/// Recording of the arm.
pub(super) struct ArmRecording {
    /// Poses of the receiver in the transmitter's Y-up frame, m.
    pub(super) poses: Vec<Isometry3<f64>>,
    /// Mean joint angles of the glove; those of a flat hand without a glove.
    pub(super) angles: JointAngles,
}

/// Records the arm in one gesture.
///
/// # Errors
/// A sentence for a file that cannot be read or a device that is silent.
pub(super) fn record_arm(
    held: Held,
    source: &mut ArmSource,
    configuration: &HandConfiguration,
    patience: &Patience,
    told: &mut impl Write,
) -> anyhow::Result<ArmRecording> {
    let next = match source {
        ArmSource::Recorded(folder) => {
            let stem = if held == Held::Flat { "flat" } else { "turn" };
            let poses = recorded_poses(&folder.join(format!("{stem}.tracker.bin")), configuration)?;
            let glove = folder.join(format!("{stem}.glove.bin"));
            let readings = match glove.exists() {
                true => recorded_readings(&glove, configuration.setup.sensors)
                    .context("the wrist's angles are wanted")?,
                false => Vec::new(),
            };
            return Ok(ArmRecording { poses, angles: mean_angles(&readings, configuration) });
        }
        ArmSource::Live(next) => next,
    };
    // Nobody can be told that the terminal is closed.
    let _ = writeln!(told, "{}", held.instruction());
    let mut shown = None;
    let samples: Vec<ArmSample> = collect(&mut **next, held.samples(), patience, |phase, _| {
        let line = match phase {
            Phase::GetReady { seconds } => format!("get ready, {seconds} s"),
            Phase::Hold { left } => format!("{left} records to go", left = left.div_ceil(60) * 60),
        };
        if shown.as_ref() != Some(&line) {
            let _ = writeln!(told, "{}: {line}", held.name());
            shown = Some(line);
        }
    })?;
    let readings: Vec<RawSensors> = samples.iter().filter_map(|sample| sample.glove).collect();
    Ok(ArmRecording {
        poses: samples.iter().map(|sample| sample.stand_from_receiver).collect(),
        angles: mean_angles(&readings, configuration),
    })
}

/// Mean of the joint angles of some readings.
fn mean_angles(readings: &[RawSensors], configuration: &HandConfiguration) -> JointAngles {
    let mut sum = JointAngles::flat().to_array();
    for raw in readings {
        let angles = configuration.setup.calibration.angles(raw, SensorSet::EMPTY).to_array();
        for (sum, angle) in sum.iter_mut().zip(angles) {
            *sum += angle / readings.len() as f64;
        }
    }
    JointAngles::from_array(&sum)
}
