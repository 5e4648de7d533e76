//! How the object lay that the hand came to lift: where, and with which weight on the table.

use nalgebra::Point3;

use super::seen::Seen;

/// Share of its weight that a lifted object leaves on the table where one end still lies there.
const DRAGS: f64 = 0.03;

/// How an object lay before the hand touched it.
///
/// Units: m, N. Frame: world.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Lay {
    /// Centre of the object; `None` before it was looked at.
    pub centre: Option<Point3<f64>>,
    /// Height of the object's origin.
    origin_y: f64,
    /// Weight of the object, as the table felt it.
    pub weight_n: f64,
}

impl Lay {
    /// Looks where the object lies, until a finger touches it: a hand that went after what it pushes would
    /// push it on.
    ///
    /// Frame: `centre` is that of the object's rest shape.
    pub fn look(&mut self, seen: &Seen, centre: &Point3<f64>) {
        let is_touched = seen.finger_forces_n != [0.0; 5];
        if !is_touched || self.centre.is_none() {
            self.centre = Some(seen.world_from_object * centre);
            self.origin_y = seen.world_from_object.translation.y;
            self.weight_n = seen.table_force_n;
        }
    }

    /// Whether a part of the object still lies on the table; of one that was never looked at nothing is said.
    pub fn drags(&self, seen: &Seen) -> bool {
        self.centre.is_some() && seen.table_force_n > DRAGS * self.weight_n
    }

    /// How far the object has come up since.
    pub fn risen(&self, seen: &Seen) -> f64 {
        seen.world_from_object.translation.y - self.origin_y
    }
}
