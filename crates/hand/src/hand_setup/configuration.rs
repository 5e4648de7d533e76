//! A hand's configuration: read from text with every value checked, and written as text.

use std::path::PathBuf;

use softgrasp_grasp::hand::{HandDimensions, Handedness};

use super::device_lines::{GLOVE_BAUDS, GloveLine, TRACKER_BAUDS, TrackerLine};
use super::error::HandFileError;
use super::pose_text::{PoseNumbers, PoseTable, pose_lines};
use super::reading::{
    EncodingWord, GloveText, HandText, MountText, OutputWord, PartWord, Side, SizeText, StandText,
    TrackerText, UnitWord,
};
use super::setup::HandSetup;
use crate::devices::ReceiverMount;
use crate::devices::calibration::{Calibration, Form, read_calibration};
use crate::devices::cyberglove::SensorCount;
use crate::devices::fastrak::{Encoding, LengthUnit, OutputList, Station};

/// Version of the text; raised when an old reader would misread a new file.
const FORMAT: u32 = 1;

/// Everything that the file of a hand says (`docs/devices.md` has a full example).
#[derive(Clone, Debug, Default)]
pub struct HandConfiguration {
    /// Hand, record formats, mount and stand. The calibration is the default one until
    /// [`HandConfiguration::take_calibration`].
    pub setup: HandSetup,
    /// The file of the calibration, as written: relative to the configuration's own folder.
    pub calibration_file: Option<PathBuf>,
    /// Settings of the serial line to the glove.
    pub glove: GloveLine,
    /// Settings of the serial line to the tracker.
    pub tracker: TrackerLine,
}

impl HandConfiguration {
    /// Reads the text of a configuration; keys that are absent have the default's values.
    ///
    /// # Errors
    /// [`HandFileError`] for an unknown key, a value that cannot be, two rotations or none.
    pub fn read(text: &str) -> Result<Self, HandFileError> {
        let text: HandText =
            toml::from_str(text).map_err(|error| HandFileError::Syntax(error.to_string()))?;
        if text.format != FORMAT {
            return Err(HandFileError::Format { found: text.format, reads: FORMAT });
        }
        let mut configuration = Self::default();
        configuration.take_hand(text.hand)?;
        configuration.take_glove(&text.glove)?;
        configuration.take_tracker(&text.tracker)?;
        if let Some(mount) = text.mount {
            configuration.setup.mount = read_mount(&mount)?;
        }
        if let Some(stand) = text.world_from_stand {
            configuration.setup.world_from_stand = read_stand(&stand)?;
        }
        Ok(configuration)
    }

    fn take_hand(&mut self, text: SizeText) -> Result<(), HandFileError> {
        let dimensions = self.setup.dimensions;
        let length_m = text.length_m.unwrap_or(dimensions.hand_length);
        let breadth_m = text.breadth_m.unwrap_or(dimensions.hand_breadth);
        let hand = match text.side {
            None | Some(Side::Right) => Handedness::Right,
            Some(Side::Left) => Handedness::Left,
        };
        let dimensions = HandDimensions::scaled(length_m, breadth_m)?;
        self.setup.dimensions = dimensions.with_handedness(hand);
        self.setup.calibration.hand = hand;
        if text.calibration.as_ref().is_some_and(|path| path.as_os_str().is_empty()) {
            return Err(HandFileError::value("hand.calibration", "", "the path of a file"));
        }
        self.calibration_file = text.calibration;
        Ok(())
    }

    fn take_glove(&mut self, text: &GloveText) -> Result<(), HandFileError> {
        self.setup.sensors = match text.sensors {
            None => self.setup.sensors,
            Some(18) => SensorCount::Eighteen,
            Some(22) => SensorCount::TwentyTwo,
            Some(other) => return Err(HandFileError::value("glove.sensors", other, "18 or 22")),
        };
        let baud = text.baud.unwrap_or(self.glove.baud);
        if !GLOVE_BAUDS.contains(&baud) {
            let expected = "a speed of the glove: 300 to 115200 bits per second";
            return Err(HandFileError::value("glove.baud", baud, expected));
        }
        self.glove = GloveLine { baud, mode: text.mode.unwrap_or_default() };
        Ok(())
    }

    fn take_tracker(&mut self, text: &TrackerText) -> Result<(), HandFileError> {
        let baud = text.baud.unwrap_or(self.tracker.baud);
        if !TRACKER_BAUDS.contains(&baud) {
            let expected = "a speed of the tracker: 300 to 115200 bits per second";
            return Err(HandFileError::value("tracker.baud", baud, expected));
        }
        let number = text.station.unwrap_or(self.tracker.station.number());
        let station = Station::try_new(number)
            .map_err(|_| HandFileError::value("tracker.station", number, "1 to 4"))?;
        let hemisphere = text.hemisphere.unwrap_or_default();
        self.tracker = TrackerLine { baud, station, hemisphere };
        let format = &mut self.setup.tracker;
        match text.output {
            None => {}
            Some(OutputWord::Angles) => format.output = OutputList::PositionEuler,
            Some(OutputWord::Quaternion) => format.output = OutputList::PositionQuaternion,
        }
        match text.units {
            None => {}
            Some(UnitWord::Inches) => format.units = LengthUnit::Inches,
            Some(UnitWord::Centimetres) => format.units = LengthUnit::Centimetres,
        }
        match text.encoding {
            None => {}
            Some(EncodingWord::Text) => format.encoding = Encoding::Ascii,
            Some(EncodingWord::Binary) => format.encoding = Encoding::Binary,
        }
        Ok(())
    }

    /// Configuration of the same person's other hand: of the same size, with the same records from a
    /// transmitter at the same place. Calibration and mount are each hand's own: they are the default ones.
    #[must_use]
    pub fn of_other_hand(&self) -> Self {
        let mut other = Self { calibration_file: None, ..self.clone() };
        let hand = self.setup.dimensions.handedness.other();
        other.setup.dimensions = self.setup.dimensions.with_handedness(hand);
        other.setup.mount = ReceiverMount::default();
        other.setup.calibration = Calibration::default();
        other.setup.calibration.hand = hand;
        other
    }

    /// Takes the text of the calibration's file over.
    ///
    /// Forms that do not say for which hand they are serve the configured one.
    ///
    /// # Errors
    /// [`HandFileError`] for a text that is no calibration, or one for the other hand.
    pub fn take_calibration(&mut self, text: &str) -> Result<Form, HandFileError> {
        let (mut calibration, form) = read_calibration(text)?;
        let hand = self.setup.dimensions.handedness;
        // Right is also what a text that does not say is read as.
        let says_so = form == Form::Toml || calibration.hand == Handedness::Left;
        if says_so && calibration.hand != hand {
            let (calibration, hand) = (calibration.hand.name(), hand.name());
            return Err(HandFileError::OtherHand { calibration, hand });
        }
        calibration.hand = hand;
        self.setup.calibration = calibration;
        Ok(form)
    }

    /// The configuration as text, with a comment on each table; every number comes back exactly.
    pub fn to_text(&self) -> String {
        let HandSetup { dimensions, sensors, tracker, mount, world_from_stand, .. } = &self.setup;
        let calibration = self.calibration_file.as_ref().map_or(String::new(), |path| {
            // The TOML writer knows which characters must be escaped.
            let path = toml::Value::String(path.to_string_lossy().into_owned());
            format!("calibration = {path}\n")
        });
        let (part, receiver_from_part) = match mount {
            ReceiverMount::Hand { receiver_from_palm } => ("hand", receiver_from_palm),
            ReceiverMount::Forearm { receiver_from_forearm } => ("forearm", receiver_from_forearm),
        };
        let output = match tracker.output {
            OutputList::PositionEuler => "angles",
            OutputList::PositionQuaternion => "quaternion",
        };
        let units = tracker.units.name();
        let encoding = match tracker.encoding {
            Encoding::Ascii => "text",
            Encoding::Binary => "binary",
        };
        format!(
            "# A hand, its glove and its tracker. docs/devices.md explains every key.\n\
             format = {FORMAT}\n\n\
             # Length: wrist crease to tip of the middle finger. Breadth: across the knuckles.\n\
             [hand]\nside = \"{}\"\nlength_m = {:?}\nbreadth_m = {:?}\n{calibration}\n\
             [glove]\nsensors = {}\nbaud = {}\nmode = \"{}\"\n\n\
             [tracker]\nbaud = {}\nstation = {}\noutput = \"{output}\"\nunits = \"{units}\"\n\
             encoding = \"{encoding}\"\nhemisphere = \"{}\"\n\n\
             # Palm or forearm in the receiver's frame: the translation is the wrist crease.\n\
             [mount]\non = \"{part}\"\n{}\n\
             # The transmitter's Y-up frame in the world.\n\
             [world_from_stand]\n{}",
            dimensions.handedness.name(),
            dimensions.hand_length,
            dimensions.hand_breadth,
            sensors.number(),
            self.glove.baud,
            self.glove.mode.word(),
            self.tracker.baud,
            self.tracker.station.number(),
            self.tracker.hemisphere.word(),
            pose_lines(receiver_from_part),
            pose_lines(world_from_stand),
        )
    }
}

fn read_mount(text: &MountText) -> Result<ReceiverMount, HandFileError> {
    let pose = PoseTable::MOUNT.pose(&PoseNumbers {
        translation_m: text.translation_m,
        quaternion_wxyz: text.quaternion_wxyz,
        rotation_vector_deg: text.rotation_vector_deg,
    })?;
    Ok(match text.on {
        PartWord::Hand => ReceiverMount::Hand { receiver_from_palm: pose },
        PartWord::Forearm => ReceiverMount::Forearm { receiver_from_forearm: pose },
    })
}

fn read_stand(text: &StandText) -> Result<nalgebra::Isometry3<f64>, HandFileError> {
    PoseTable::STAND.pose(&PoseNumbers {
        translation_m: text.translation_m,
        quaternion_wxyz: text.quaternion_wxyz,
        rotation_vector_deg: text.rotation_vector_deg,
    })
}

#[cfg(test)]
#[path = "configuration_tests.rs"]
mod tests;
