//! The settings of the glove's interface unit: what its commands change and its queries tell.

use softgrasp_grasp::hand::Handedness;
use softgrasp_hand::devices::cyberglove::{Sensor, SensorCount};

/// Settings of the interface unit, and the glove that is plugged into it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Unit {
    pub(super) hardware: SensorCount,
    pub(super) hand: Handedness,
    pub(super) timestamp: bool,
    pub(super) status: bool,
    pub(super) filter: bool,
    pub(super) light_control: bool,
    pub(super) light: bool,
    pub(super) switch: bool,
    pub(super) quantised: bool,
    /// Slots that are sent, of 24.
    pub(super) mask: u32,
    /// Number of sensors that are sent: the first ones of the mask.
    pub(super) sent: usize,
    /// The two words of the stream's period.
    pub(super) period: [u16; 2],
}

impl Unit {
    /// The settings after power-up.
    pub(super) fn new(hardware: SensorCount, hand: Handedness) -> Self {
        Self {
            hardware,
            hand,
            timestamp: false,
            status: false,
            filter: true,
            light_control: true,
            light: false,
            switch: false,
            quantised: false,
            mask: hardware_mask(hardware),
            sent: hardware.number(),
            period: [1152, 1],
        }
    }

    /// The sensors of a record, in its order.
    pub(super) fn sensors(&self) -> impl Iterator<Item = Sensor> {
        let mask = self.mask;
        let masked = self.hardware.wire_order().filter(move |s| mask & (1 << slot(*s)) != 0);
        masked.take(self.sent)
    }

    /// The payload of a query, `None` if there is no such query. `plugged_in` is the glove's state.
    pub(super) fn answer(&self, letter: u8, plugged_in: bool) -> Option<Vec<u8>> {
        let flag = |on: bool| vec![u8::from(on)];
        Some(match letter {
            // Bit 0 initialised, bit 1 glove there.
            b'G' => vec![0x01 | u8::from(plugged_in) << 1],
            b'S' => vec![self.hardware.number() as u8],
            b'N' => vec![self.sent as u8],
            b'K' => three_bytes(hardware_mask(self.hardware)),
            b'M' => three_bytes(self.mask),
            b'P' => self.flags(plugged_in).to_vec(),
            b'R' => flag(self.hand == Handedness::Right),
            b'T' => self.period.iter().flat_map(|word| word.to_be_bytes()).collect(),
            b'W' => flag(self.switch),
            b'L' => flag(self.light),
            b'D' => flag(self.timestamp),
            b'F' => flag(self.filter),
            b'J' => flag(self.light_control),
            b'U' => flag(self.status),
            b'Q' => flag(self.quantised),
            _ => return None,
        })
    }

    /// The flags of `P`.
    pub(super) fn flags(&self, plugged_in: bool) -> [u8; 3] {
        let bits = |flags: &[(bool, u8)]| {
            flags.iter().filter(|(on, _)| *on).fold(0, |byte, (_, k)| byte | 1u8 << k)
        };
        let right = self.hand == Handedness::Right;
        [
            bits(&[(plugged_in, 0), (self.switch, 1), (self.light, 2), (true, 7)]),
            bits(&[
                (self.status, 2),
                (self.light_control, 3),
                (self.filter, 4),
                (self.timestamp, 5),
                (right, 6),
                (plugged_in, 7),
            ]),
            bits(&[(self.quantised, 0)]),
        ]
    }

    /// Sets what a capital letter sets; returns whether there is such a setting.
    pub(super) fn set_bytes(&mut self, letter: u8, bytes: &[u8]) -> bool {
        match (letter, bytes) {
            (b'T', &[a, b, c, d]) => {
                self.period = [u16::from_be_bytes([a, b]), u16::from_be_bytes([c, d])];
            }
            (b'M', &[a, b, c]) => self.set_mask(u32::from_le_bytes([a, b, c, 0])),
            (b'P', &[_, one, two]) => self.set_flags(one, two),
            // The meaning of the divider is not public; the calibration inside the unit does not
            // change what the sensors of this one measure.
            (b'B', &[_]) | (b'C', _) => {}
            (letter, &[value]) => return self.set_number(letter, u32::from(value)),
            _ => return false,
        }
        true
    }

    /// Sets what a small letter sets; returns whether there is such a setting.
    pub(super) fn set_numbers(&mut self, letter: u8, numbers: &[u32]) -> bool {
        match (letter, numbers) {
            (b't', &[first]) => self.period[0] = first.min(65_535) as u16,
            (b't', &[first, second]) => {
                self.period = [first, second].map(|word| word.min(65_535) as u16);
            }
            (b'm', &[a, b, c]) => self.set_mask((a & 255) | (b & 255) << 8 | (c & 255) << 16),
            (b'p', &[_, one, two]) => self.set_flags(one as u8, two as u8),
            (letter, &[value]) => return self.set_number(letter.to_ascii_uppercase(), value),
            _ => return false,
        }
        true
    }

    fn set_number(&mut self, letter: u8, value: u32) -> bool {
        let on = value != 0;
        match letter {
            b'D' => self.timestamp = on,
            b'F' => self.filter = on,
            b'J' => self.light_control = on,
            b'L' => self.light = on,
            b'Q' => self.quantised = on,
            b'U' => self.status = on,
            b'W' => self.switch = on,
            b'N' => self.sent = (value as usize).min(self.mask.count_ones() as usize),
            _ => return false,
        }
        true
    }

    fn set_mask(&mut self, mask: u32) {
        self.mask = mask & hardware_mask(self.hardware);
        self.sent = self.mask.count_ones() as usize;
    }

    fn set_flags(&mut self, one: u8, two: u8) {
        let bit = |byte: u8, k: u8| byte & (1 << k) != 0;
        self.status = bit(one, 2);
        self.light_control = bit(one, 3);
        self.filter = bit(one, 4);
        self.timestamp = bit(one, 5);
        self.quantised = bit(two, 0);
    }
}

/// Position of a sensor among the 24 slots; slot 7, the index abduction, has none.
fn slot(sensor: Sensor) -> usize {
    sensor.index() + usize::from(sensor.index() >= 7)
}

/// Mask of the slots that a glove has.
pub(super) fn hardware_mask(count: SensorCount) -> u32 {
    count.wire_order().fold(0, |mask, sensor| mask | 1 << slot(sensor))
}

fn three_bytes(mask: u32) -> Vec<u8> {
    mask.to_le_bytes()[..3].to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn masks_are_the_documented_ones() {
        assert_eq!(hardware_mask(SensorCount::TwentyTwo), 0x7F_FF7F);
        assert_eq!(hardware_mask(SensorCount::Eighteen), 0x7B_BB3F);
        let unit = Unit::new(SensorCount::Eighteen, Handedness::Left);
        assert_eq!(unit.answer(b'K', true).unwrap(), [0x3F, 0xBB, 0x7B]);
    }

    #[test]
    fn power_up_flags_are_the_documented_ones() {
        let right = Unit::new(SensorCount::TwentyTwo, Handedness::Right);
        // Always-one bit and glove; light control, filter, right hand, glove.
        assert_eq!(right.flags(true), [0x81, 0b1101_1000, 0]);
        let left = Unit::new(SensorCount::TwentyTwo, Handedness::Left);
        assert_eq!(left.flags(false), [0x80, 0b0001_1000, 0]);
        assert_eq!(left.answer(b'R', true).unwrap(), [0]);
    }

    #[test]
    fn a_mask_of_fewer_sensors_shortens_the_record() {
        let mut unit = Unit::new(SensorCount::TwentyTwo, Handedness::Right);
        assert!(unit.set_bytes(b'M', &[0x87, 0x01, 0xff]));
        let sent: Vec<_> = unit.sensors().map(Sensor::index).collect();
        // Slot 7 is no sensor and slot 23 is unused.
        assert_eq!(sent, [0, 1, 2, 7, 15, 16, 17, 18, 19, 20, 21]);
        assert!(unit.set_numbers(b'n', &[4]));
        assert_eq!(unit.sensors().count(), 4);
        assert_eq!(unit.answer(b'N', true).unwrap(), [4]);
        assert!(!unit.set_numbers(b'z', &[4]));
    }
}
