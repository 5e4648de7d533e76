//! What came over a serial line: told in a sentence where it is not what the device there would send.

use crate::devices::cyberglove::{GloveEvent, GloveParser, RecordOptions, SensorCount};
use crate::devices::fastrak::{
    Encoding, FastrakEvent, FastrakFormat, FastrakParser, LengthUnit, OutputList,
};
use crate::sent::Device;

/// What has come over the serial line of one device: how many bytes and records, and the first bytes.
#[derive(Clone, Debug, Default)]
pub struct Heard {
    bytes: u64,
    /// The first bytes, kept until a record comes: they tell which other device sends them.
    beginning: Vec<u8>,
    records: u64,
    first_record_s: Option<f64>,
}

/// Another device that may send on the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stranger {
    Glove,
    Tracker,
    /// A receiver of satellite navigation: sentences of NMEA 0183.
    Navigation,
}

/// Most first bytes that are kept to recognise another device.
const BEGINNING_MAX: usize = 4096;
/// Bytes without a record before anything is said: a device that is being set up sends replies.
const BYTES_MIN: u64 = 600;
/// Records of another device by which it is recognised.
const RECORDS_MIN: usize = 3;
/// Bytes of an unknown device that the sentence shows.
const SHOWN: usize = 24;
/// Time for which records are counted before their rate is told, s.
const COUNTED_S: f64 = 2.0;

impl Heard {
    /// Takes bytes that came over the line.
    pub fn bytes(&mut self, bytes: &[u8]) {
        self.bytes += bytes.len() as u64;
        if self.records == 0 {
            let room = BEGINNING_MAX - self.beginning.len();
            self.beginning.extend_from_slice(&bytes[..bytes.len().min(room)]);
        }
    }

    /// Counts a good record that came at a time, s; the rate in records per second, once, when it is
    /// known.
    pub fn record(&mut self, time_s: f64) -> Option<f64> {
        self.records += 1;
        self.beginning = Vec::new();
        let first_s = *self.first_record_s.get_or_insert(time_s);
        let counted_s = time_s - first_s;
        if first_s.is_infinite() || counted_s < COUNTED_S {
            return None;
        }
        // Told once.
        self.first_record_s = Some(f64::INFINITY);
        Some((self.records - 1) as f64 / counted_s)
    }

    /// What is wrong with what came on the port of this device; `None` while nothing seems to be.
    pub fn complaint(&self, device: Device) -> Option<String> {
        if self.records > 0 || self.bytes < BYTES_MIN {
            return None;
        }
        let name = device.name();
        let stranger = who_speaks(&self.beginning);
        Some(match (device, stranger) {
            (Device::Glove, Some(Stranger::Tracker)) => {
                "a FASTRAK speaks on the glove's port: glove and tracker are swapped".to_owned()
            }
            (Device::Tracker, Some(Stranger::Glove)) => {
                "a CyberGlove speaks on the tracker's port: glove and tracker are swapped"
                    .to_owned()
            }
            (_, Some(Stranger::Navigation)) => format!(
                "a receiver of satellite navigation (NMEA) speaks on the {name}'s port; name the port \
                 of the {name} (`glove-client devices` lists them)"
            ),
            _ => format!(
                "what comes on the {name}'s port is no record of a {name} (it begins with {}): another \
                 device, or another speed of the line (PATH@BAUD)",
                shown(&self.beginning),
            ),
        })
    }
}

/// The device that sends these bytes, if it is a known one.
fn who_speaks(bytes: &[u8]) -> Option<Stranger> {
    let is_sentence = |six: &[u8]| {
        six[0] == b'$' && six[1..6].iter().all(u8::is_ascii_uppercase) && six[1..3] != *b"PX"
    };
    if bytes.windows(6).filter(|six| is_sentence(six)).count() >= RECORDS_MIN {
        return Some(Stranger::Navigation);
    }
    if glove_records(bytes) >= RECORDS_MIN {
        return Some(Stranger::Glove);
    }
    // A FASTRAK answers what a glove is asked with records of its status and of errors.
    let replies = [&b"*ERROR*"[..], b"ERROR *"]
        .map(|reply| bytes.windows(reply.len()).filter(|window| *window == reply).count());
    let is_tracker = replies.iter().sum::<usize>() >= RECORDS_MIN
        || status_records(bytes) >= RECORDS_MIN
        || tracker_records(bytes) >= RECORDS_MIN;
    is_tracker.then_some(Stranger::Tracker)
}

/// Most records that are read as those of a glove, of any number of sensors.
fn glove_records(bytes: &[u8]) -> usize {
    let records = |mut parser: GloveParser| {
        let mut records = 0;
        parser.feed_all(bytes, |event| {
            records += usize::from(matches!(event, GloveEvent::Record(_)))
        });
        records
    };
    let counts = [SensorCount::Eighteen, SensorCount::TwentyTwo];
    let parsers = counts.map(|count| {
        [GloveParser::new(count, RecordOptions::default()), GloveParser::of_lines(count)]
    });
    parsers.into_iter().flatten().map(records).max().unwrap_or(0)
}

/// Most records that are read as those of a tracker, in any form.
fn tracker_records(bytes: &[u8]) -> usize {
    let mut most = 0;
    for encoding in [Encoding::Binary, Encoding::Ascii] {
        for output in [OutputList::PositionQuaternion, OutputList::PositionEuler] {
            let format = FastrakFormat { encoding, output, units: LengthUnit::Centimetres };
            let mut records = 0;
            FastrakParser::new(format).feed_all(bytes, |event| {
                records += usize::from(matches!(event, FastrakEvent::Record(_)));
            });
            most = most.max(records);
        }
    }
    most
}

/// Status records of a FASTRAK: `2`, a station, `S`, three hexadecimal digits.
fn status_records(bytes: &[u8]) -> usize {
    let is_status = |six: &[u8]| {
        six[0] == b'2'
            && matches!(six[1], b' ' | b'1'..=b'4')
            && six[2] == b'S'
            && six[3..6].iter().all(u8::is_ascii_hexdigit)
    };
    bytes.windows(6).filter(|six| is_status(six)).count()
}

/// The first bytes as text, where they are text, else as hexadecimal numbers.
fn shown(bytes: &[u8]) -> String {
    let bytes = &bytes[..bytes.len().min(SHOWN)];
    if bytes.iter().all(|byte| byte.is_ascii_graphic() || byte.is_ascii_whitespace()) {
        return format!("“{}”", String::from_utf8_lossy(bytes).trim().escape_debug());
    }
    bytes.iter().map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hand_setup::HandSetup;
    use nalgebra::Isometry3;
    use softgrasp_grasp::hand::JointAngles;

    fn heard(bytes: &[u8]) -> Heard {
        let mut heard = Heard::default();
        bytes.chunks(7).for_each(|chunk| heard.bytes(chunk));
        heard
    }

    #[test]
    fn swapped_devices_a_navigation_receiver_and_noise_are_told_by_name() {
        let sent = HandSetup::default().arrivals_of(&JointAngles::flat(), &Isometry3::identity());
        let of = |device| {
            let arrival = sent.iter().find(|arrival| arrival.device == device).unwrap();
            arrival.bytes.repeat(40)
        };
        let (glove, tracker) = (of(Device::Glove), of(Device::Tracker));
        let told = |device, bytes: &[u8]| heard(bytes).complaint(device).unwrap();
        assert!(told(Device::Glove, &tracker).contains("swapped"));
        assert!(told(Device::Tracker, &glove).contains("swapped"));
        let fix = b"$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*47\r\n";
        assert!(told(Device::Glove, &fix.repeat(12)).contains("NMEA"));
        let page = told(Device::Tracker, &b"@PJL INFO STATUS\r\n".repeat(60));
        assert!(page.contains("@PJL INFO"), "{page}");
        let noise: Vec<u8> =
            (0..900u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 9) as u8).collect();
        assert!(told(Device::Glove, &noise).contains("it begins with"));
        // A run tells a sentence once: it stays as it is while more of the same comes.
        let mut more = heard(&noise);
        let first = more.complaint(Device::Glove);
        more.bytes(&noise);
        assert_eq!(more.complaint(Device::Glove), first);
        // Replies of a set-up are too few to say anything.
        assert_eq!(heard(&fix.repeat(3)).complaint(Device::Glove), None);
    }

    #[test]
    fn rate_of_records_is_told_once() {
        let mut heard = Heard::default();
        let told = (0..300).filter_map(|i| heard.record(f64::from(i) / 90.0)).collect::<Vec<_>>();
        assert!(told.len() == 1 && (told[0] - 90.0).abs() < 1.0, "{told:?}");
    }
}
