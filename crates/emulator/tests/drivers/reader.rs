//! A client that reads the numbers of the records from what the drivers hand over.

use std::time::{Duration, Instant};

use softgrasp_hand::devices::cyberglove::{GloveEvent, GloveParser, RecordOptions, SensorCount};
use softgrasp_hand::devices::fastrak::{
    Encoding, FastrakEvent, FastrakFormat, FastrakParser, LengthUnit, OutputList,
};
use softgrasp_hand::sent::Device;
use softgrasp_hand::serial::{DeviceState, SerialDevices};

use super::served::{HANG, number_of};

/// What a client reads: the numbers of the records.
pub(super) struct Reader {
    pub(super) devices: SerialDevices,
    pub(super) glove: GloveParser,
    pub(super) tracker: FastrakParser,
    pub(super) numbers: Vec<usize>,
    pub(super) pieces: usize,
    /// Arrival of the last piece of each device.
    pub(super) last: [Option<Instant>; 2],
    /// Longest time between two pieces of a device since its first record.
    pub(super) longest_gap: Duration,
}

impl Reader {
    pub(super) fn of(devices: SerialDevices, glove: GloveParser, format: FastrakFormat) -> Self {
        let tracker = FastrakParser::new(format);
        let (numbers, longest_gap) = (Vec::new(), Duration::ZERO);
        Self { devices, glove, tracker, numbers, pieces: 0, last: [None; 2], longest_gap }
    }

    pub(super) fn of_glove(devices: SerialDevices, count: SensorCount) -> Self {
        Self::of(devices, GloveParser::new(count, RecordOptions::default()), FORMATS[3])
    }

    pub(super) fn of_tracker(devices: SerialDevices, format: FastrakFormat) -> Self {
        let glove = GloveParser::new(SensorCount::TwentyTwo, RecordOptions::default());
        Self::of(devices, glove, format)
    }

    pub(super) fn read(&mut self) {
        let Self { glove, tracker, numbers, .. } = self;
        for arrived in self.devices.take() {
            let last = &mut self.last[usize::from(arrived.device == Device::Tracker)];
            assert!(last.is_none_or(|last| last <= arrived.arrived));
            if let (Some(last), false) = (*last, numbers.is_empty()) {
                self.longest_gap = self.longest_gap.max(arrived.arrived - last);
            }
            *last = Some(arrived.arrived);
            self.pieces += 1;
            match arrived.device {
                Device::Glove => glove.feed_all(&arrived.bytes, |event| match event {
                    GloveEvent::Record(record) => numbers.extend(number_of(&record)),
                    GloveEvent::Fault(_) => {}
                }),
                Device::Tracker => tracker.feed_all(&arrived.bytes, |event| match event {
                    FastrakEvent::Record(record) if record.error.is_none() => {
                        let place = record.world_from_receiver().translation;
                        if (place.z + 0.4).abs() < 1e-3 && (place.y - 0.05).abs() < 1e-3 {
                            numbers.push((place.x * 1e3).round() as usize);
                        }
                    }
                    _ => {}
                }),
                Device::Joints => panic!("nobody sends joints over a serial line"),
            }
        }
    }

    /// Reads until a condition holds, or nothing has come for so long; returns whether it holds.
    pub(super) fn within(&mut self, quiet: Duration, holds: impl Fn(&Self) -> bool) -> bool {
        let (mut pieces, mut since) = (self.pieces, Instant::now());
        loop {
            self.read();
            if holds(self) {
                return true;
            }
            if self.pieces > pieces {
                (pieces, since) = (self.pieces, Instant::now());
            }
            if since.elapsed() > quiet {
                return false;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    /// Reads until a condition holds.
    pub(super) fn until(&mut self, what: &str, mut holds: impl FnMut(&Self) -> bool) {
        let begun = Instant::now();
        loop {
            self.read();
            if holds(self) {
                return;
            }
            assert!(begun.elapsed() < HANG, "{what}: {:?}", self.devices.states());
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    pub(super) fn until_number(&mut self, what: &str, number: usize) {
        self.until(what, |reader| reader.numbers.last().is_some_and(|last| *last >= number));
    }

    pub(super) fn until_talking(&mut self, device: usize) {
        self.until("talking", |r| r.devices.states()[device] == DeviceState::Talking);
    }
}

pub(super) const FORMATS: [FastrakFormat; 4] = [
    format(Encoding::Ascii, OutputList::PositionEuler, LengthUnit::Inches),
    format(Encoding::Ascii, OutputList::PositionQuaternion, LengthUnit::Centimetres),
    format(Encoding::Binary, OutputList::PositionEuler, LengthUnit::Centimetres),
    format(Encoding::Binary, OutputList::PositionQuaternion, LengthUnit::Centimetres),
];

pub(super) const fn format(
    encoding: Encoding,
    output: OutputList,
    units: LengthUnit,
) -> FastrakFormat {
    FastrakFormat { encoding, output, units }
}
