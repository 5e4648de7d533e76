//! Notices when the tracker mistakes a receiver for its mirror image through the transmitter.

use nalgebra::Vector3;

use super::record::Station;

/// A receiver jumped to about the opposite position: it crossed into the other hemisphere.
///
/// Units: m. Frame: transmitter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HemisphereFlip {
    /// Station number of the receiver.
    pub station: Station,
    /// Position in the record before.
    pub before: Vector3<f64>,
    /// Position in this record, about `-before`.
    pub after: Vector3<f64>,
}

/// Compares each position of a station with the one before.
#[derive(Clone, Debug, Default)]
pub struct FlipWatch {
    last: [Option<Vector3<f64>>; 4],
}

impl FlipWatch {
    /// Closer to the transmitter than this a hand can really cross over within a record, in m.
    pub const NEAR: f64 = 0.05;
    /// How far from the exact opposite the new position may be, as a share of its distance.
    pub const TOLERANCE: f64 = 0.25;

    /// Takes the next position of a station, in m, and says whether it is a flip.
    ///
    /// The field of the transmitter is the same at p and −p, so only the history can tell.
    pub fn observe(&mut self, station: Station, position: Vector3<f64>) -> Option<HemisphereFlip> {
        let before = self.last[station.index()].replace(position)?;
        let distance = before.norm();
        let opposite = (position + before).norm() <= Self::TOLERANCE * distance;
        (distance >= Self::NEAR && opposite).then_some(HemisphereFlip {
            station,
            before,
            after: position,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_jump_to_the_opposite_is_a_flip_there_and_back() {
        let station = Station::try_new(1).unwrap();
        let mut watch = FlipWatch::default();
        let p = Vector3::new(0.3, -0.1, 0.2);
        assert_eq!(watch.observe(station, p), None);
        let flip = watch.observe(station, -p * 1.02).unwrap();
        assert_eq!((flip.before, flip.after), (p, -p * 1.02));
        assert_eq!(watch.observe(station, -p), None);
        assert!(watch.observe(station, p).is_some());
    }

    #[test]
    fn crossing_near_the_transmitter_or_moving_fast_is_no_flip() {
        let station = Station::try_new(4).unwrap();
        let mut watch = FlipWatch::default();
        let near = Vector3::new(0.02, 0.01, 0.0);
        assert_eq!(watch.observe(station, near), None);
        assert_eq!(watch.observe(station, -near), None);
        assert_eq!(watch.observe(station, Vector3::new(0.3, 0.0, 0.0)), None);
        assert_eq!(watch.observe(station, Vector3::new(0.0, 0.3, 0.0)), None);
    }

    #[test]
    fn stations_are_watched_apart() {
        let mut watch = FlipWatch::default();
        let p = Vector3::new(0.3, -0.1, 0.2);
        assert_eq!(watch.observe(Station::try_new(1).unwrap(), p), None);
        assert_eq!(watch.observe(Station::try_new(2).unwrap(), -p), None);
    }
}
