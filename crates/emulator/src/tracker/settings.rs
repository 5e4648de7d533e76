//! The settings of the tracker: what its commands change and its read-backs tell.

use nalgebra::{UnitQuaternion, Vector3};
use softgrasp_hand::devices::fastrak::{Encoding, LengthUnit, Station};

use super::command::Field;
use super::record::Item;

/// Settings of one receiver.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct StationSettings {
    pub(super) active: bool,
    pub(super) items: Vec<Item>,
    /// Points into the half of space where the receiver is; zero follows it.
    pub(super) hemisphere: Vector3<f64>,
    /// Rotation that turns the attitude that was boresighted into none.
    pub(super) boresight: UnitQuaternion<f64>,
}

/// Settings of the tracker.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Settings {
    pub(super) encoding: Encoding,
    pub(super) units: LengthUnit,
    pub(super) compensation: bool,
    pub(super) continuous: bool,
    pub(super) stations: [StationSettings; 4],
    /// Sensitivity, low, high, factor of the position and the attitude filter.
    pub(super) filters: [[f64; 4]; 2],
    pub(super) id: String,
}

/// Why a command is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Refusal {
    MissingField = -1,
    NotNumeric = -2,
    OutOfRange = -3,
    Unknown = -99,
}

/// What the filters are after power-up: the manual says both this and "disabled".
const FILTER: [f64; 4] = [0.2, 0.2, 0.8, 0.95];

impl Settings {
    /// The settings from the factory; the receivers that are plugged in are active.
    pub(super) fn factory(plugged: [bool; 4]) -> Self {
        Self {
            encoding: Encoding::Ascii,
            units: LengthUnit::Inches,
            compensation: false,
            continuous: false,
            stations: plugged.map(|active| StationSettings {
                active,
                items: vec![Item::Position, Item::Angles, Item::LineEnd],
                hemisphere: Vector3::x(),
                boresight: UnitQuaternion::identity(),
            }),
            filters: [FILTER; 2],
            id: String::new(),
        }
    }

    /// The active stations in numeric order.
    pub(super) fn active(&self) -> impl Iterator<Item = Station> {
        self.stations
            .iter()
            .zip(1..)
            .filter(|(station, _)| station.active)
            .filter_map(|(_, number)| Station::try_new(number).ok())
    }

    /// The status record of 55 bytes.
    pub(super) fn status(&self) -> Vec<u8> {
        let bits = [
            self.encoding == Encoding::Binary,
            self.units == LengthUnit::Centimetres,
            self.compensation,
            self.continuous,
        ];
        let low = bits.iter().zip(0..).fold(0, |all, (&on, k)| all | u16::from(on) << k);
        let map = self.active().fold(0, |all, station| all | 1u8 << station.index());
        let word = 0x3F0 | low;
        let version = "2.10";
        let id = &self.id;
        format!("21S{word:03X}    F3{map:X}  {version:<6.6}{id:<32.32}\r\n").into_bytes()
    }

    /// Carries out a command with fields; returns the reply, which most commands do not have.
    pub(super) fn obey(&mut self, letter: u8, fields: &[Field]) -> Result<Vec<u8>, Refusal> {
        if fields.contains(&Field::NotNumeric) {
            return Err(Refusal::NotNumeric);
        }
        match letter {
            b'x' => return self.filter(0, letter, fields),
            b'v' => return self.filter(1, letter, fields),
            // The speed of a pseudo-terminal is the client's; the rest is not emulated.
            b'A' | b'R' | b'r' | b'N' | b'V' | b'Q' | b'I' | b'e' | b'G' | b'o' => {
                return Ok(Vec::new());
            }
            _ => {}
        }
        let index = station_index(fields)?;
        let number = index + 1;
        let values = &fields[1..];
        let station = &mut self.stations[index];
        match letter {
            b'O' if values.is_empty() => {
                let items = station.items.iter().map(|item| f64::from(item.number()));
                return Ok(read_back(number, letter, items, 0));
            }
            b'O' => {
                let items = values.iter().map(|field| {
                    let number = field.number().ok_or(Refusal::MissingField)?;
                    Item::with_number(number).ok_or(Refusal::OutOfRange)
                });
                let items: Vec<Item> = items.collect::<Result<_, _>>()?;
                if items.len() > 32 {
                    return Err(Refusal::OutOfRange);
                }
                station.items = items;
            }
            b'H' if values.is_empty() => {
                let vector = station.hemisphere.iter().copied();
                return Ok(read_back(number, letter, vector, 2));
            }
            b'H' => {
                for (slot, field) in station.hemisphere.iter_mut().zip(values) {
                    *slot = field.number().unwrap_or(*slot);
                }
            }
            b'b' => station.boresight = UnitQuaternion::identity(),
            b'l' => match values.first().and_then(|field| field.number()) {
                None => {
                    let on = self.stations.each_ref().map(|s| if s.active { '1' } else { '0' });
                    let digits: String = on.iter().collect();
                    return Ok(format!("2{number}l{digits}\r\n").into_bytes());
                }
                Some(on) if on == 0.0 || on == 1.0 => station.active = on == 1.0,
                Some(_) => return Err(Refusal::OutOfRange),
            },
            _ => return Err(Refusal::Unknown),
        }
        Ok(Vec::new())
    }

    fn filter(&mut self, which: usize, letter: u8, fields: &[Field]) -> Result<Vec<u8>, Refusal> {
        let filter = &mut self.filters[which];
        if fields.is_empty() {
            let values = filter.iter().copied();
            return Ok(read_back_of_all(letter, values, 2));
        }
        if let &[Field::Number(choice)] = fields {
            *filter = match choice {
                2.0 => [0.0, 1.0, 0.0, 0.0],
                3.0 => [0.2, 0.8, 0.8, 0.95],
                4.0 => FILTER,
                5.0 => [0.2, 0.05, 0.8, 0.95],
                _ => return Err(Refusal::OutOfRange),
            };
            return Ok(Vec::new());
        }
        for (slot, field) in filter.iter_mut().zip(fields) {
            match field.number() {
                Some(value) if (0.0..=1.0).contains(&value) => *slot = value,
                Some(_) => return Err(Refusal::OutOfRange),
                None => {}
            }
        }
        Ok(Vec::new())
    }
}

/// Index of the station that the first field names.
pub(super) fn station_index(fields: &[Field]) -> Result<usize, Refusal> {
    match fields.first().copied() {
        None | Some(Field::Omitted) => Err(Refusal::MissingField),
        Some(Field::NotNumeric) => Err(Refusal::NotNumeric),
        Some(Field::Number(number)) => (1u8..=4)
            .find(|station| f64::from(*station) == number)
            .map(|station| usize::from(station) - 1)
            .ok_or(Refusal::OutOfRange),
    }
}

fn read_back(
    station: usize,
    letter: u8,
    values: impl Iterator<Item = f64>,
    decimals: usize,
) -> Vec<u8> {
    let values: String = values.map(|value| format!("{value:7.decimals$}")).collect();
    format!("2{station}{}{values}\r\n", char::from(letter)).into_bytes()
}

fn read_back_of_all(letter: u8, values: impl Iterator<Item = f64>, decimals: usize) -> Vec<u8> {
    let mut bytes = read_back(0, letter, values, decimals);
    bytes[1] = b' ';
    bytes
}

/// The error record about a command that was refused.
pub(super) fn error_record(letter: u8, refusal: Refusal, station: u8) -> Vec<u8> {
    let shown = if letter.is_ascii_graphic() { char::from(letter) } else { '.' };
    let code = refusal as i32;
    let text = format!("2 E*ERROR*{shown}*ERROR* EC {code}*PS1*FL1*ST{station}\r\n");
    text.into_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(values: &[f64]) -> Vec<Field> {
        values.iter().map(|&value| Field::Number(value)).collect()
    }

    #[test]
    fn status_record_is_the_documented_one() {
        let mut settings = Settings::factory([true, false, true, false]);
        let status = String::from_utf8(settings.status()).unwrap();
        assert_eq!(status.len(), 55);
        assert!(status.starts_with("21S3F0    F35  2.10  "), "{status}");
        assert!(status.ends_with("\r\n"));
        settings.encoding = Encoding::Binary;
        settings.units = LengthUnit::Centimetres;
        settings.compensation = true;
        settings.continuous = true;
        settings.id = "a text that is much longer than the thirty-two columns".to_owned();
        let status = String::from_utf8(settings.status()).unwrap();
        assert_eq!((status.len(), &status[3..6]), (55, "3FF"));
    }

    #[test]
    fn filters_are_read_back_in_33_bytes() {
        let mut settings = Settings::factory([true; 4]);
        assert_eq!(settings.obey(b'x', &numbers(&[0.2, 0.2, 0.8, 0.8])), Ok(Vec::new()));
        let read = settings.obey(b'x', &[]).unwrap();
        assert_eq!(read, b"2 x   0.20   0.20   0.80   0.80\r\n");
        assert_eq!(read.len(), 33);
        let disabled = [Field::Omitted, Field::Number(1.0)];
        assert_eq!(settings.obey(b'v', &disabled), Ok(Vec::new()));
        assert_eq!(settings.filters[1][1], 1.0);
        assert_eq!(settings.obey(b'x', &numbers(&[7.0])), Err(Refusal::OutOfRange));
    }

    #[test]
    fn stations_are_switched_and_read_back() {
        let mut settings = Settings::factory([true; 4]);
        assert_eq!(settings.obey(b'l', &numbers(&[3.0, 0.0])), Ok(Vec::new()));
        assert_eq!(settings.obey(b'l', &numbers(&[1.0])).unwrap(), b"21l1101\r\n");
        let active: Vec<u8> = settings.active().map(Station::number).collect();
        assert_eq!(active, [1, 2, 4]);
        assert_eq!(settings.obey(b'l', &numbers(&[5.0, 0.0])), Err(Refusal::OutOfRange));
        assert_eq!(settings.obey(b'l', &[]), Err(Refusal::MissingField));
        assert_eq!(settings.obey(b'H', &[Field::NotNumeric]), Err(Refusal::NotNumeric));
    }

    #[test]
    fn output_lists_of_unknown_items_are_refused_and_change_nothing() {
        let mut settings = Settings::factory([true; 4]);
        let before = settings.clone();
        assert_eq!(settings.obey(b'O', &numbers(&[1.0, 2.0, 99.0])), Err(Refusal::OutOfRange));
        assert_eq!(settings, before);
        assert_eq!(settings.obey(b'O', &numbers(&[1.0, 2.0, 11.0, 1.0])), Ok(Vec::new()));
        let read = settings.obey(b'O', &numbers(&[1.0])).unwrap();
        assert_eq!(read, b"21O      2     11      1\r\n");
    }
}
