//! The tables of a hand's configuration as they stand in the file; absent keys have defaults.

use std::path::PathBuf;

use serde::Deserialize;

use super::device_lines::{GloveMode, Hemisphere};

/// The whole file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct HandText {
    pub(super) format: u32,
    #[serde(default)]
    pub(super) hand: SizeText,
    #[serde(default)]
    pub(super) glove: GloveText,
    #[serde(default)]
    pub(super) tracker: TrackerText,
    pub(super) mount: Option<MountText>,
    pub(super) world_from_stand: Option<StandText>,
}

/// Table `[hand]`.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SizeText {
    pub(super) side: Option<Side>,
    pub(super) length_m: Option<f64>,
    pub(super) breadth_m: Option<f64>,
    pub(super) calibration: Option<PathBuf>,
}

/// Right or left hand.
#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Side {
    Right,
    Left,
}

/// Table `[glove]`.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct GloveText {
    pub(super) sensors: Option<u32>,
    pub(super) baud: Option<u32>,
    pub(super) mode: Option<GloveMode>,
}

/// Table `[tracker]`.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TrackerText {
    pub(super) baud: Option<u32>,
    pub(super) station: Option<u8>,
    pub(super) output: Option<OutputWord>,
    pub(super) units: Option<UnitWord>,
    pub(super) encoding: Option<EncodingWord>,
    pub(super) hemisphere: Option<Hemisphere>,
}

/// Items of a record.
#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum OutputWord {
    Angles,
    Quaternion,
}

/// Unit of a record's position.
#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum UnitWord {
    Inches,
    Centimetres,
}

/// How a record is written.
#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum EncodingWord {
    Text,
    Binary,
}

/// Table `[mount]`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MountText {
    pub(super) on: PartWord,
    pub(super) translation_m: [f64; 3],
    pub(super) quaternion_wxyz: Option<[f64; 4]>,
    pub(super) rotation_vector_deg: Option<[f64; 3]>,
}

/// The part of the arm that carries the receiver.
#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum PartWord {
    Hand,
    Forearm,
}

/// Table `[world_from_stand]`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct StandText {
    pub(super) translation_m: [f64; 3],
    pub(super) quaternion_wxyz: Option<[f64; 4]>,
    pub(super) rotation_vector_deg: Option<[f64; 3]>,
}
