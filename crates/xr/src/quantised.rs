//! Positions as 16-bit counts within a box, and directions as two such numbers, with stated errors.

/// Box in which positions are counted in equal steps along each axis.
///
/// Units: m. The numbers are those that go over the wire, so both ends compute with the same.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QuantisedBox {
    /// Lowest corner of the box, m.
    pub origin: [f32; 3],
    /// Length of one step, m.
    pub step: f32,
    /// Largest error of a coordinate, m.
    pub error: f32,
}

/// Shortest step, m: an error of 5 µm is less than a screen shows, and what does not move stays the same.
const STEP_MIN_M: f64 = 1e-5;
/// Largest number of steps that a box spans: somewhat fewer than 16 bits count.
const STEPS_MAX: f64 = 65_500.0;
/// Room around the positions that a box is made for, as a share of their longest extent.
const ROOM: f64 = 0.5;

impl QuantisedBox {
    /// Box around some positions, with room; `None` if there is no position or one is not finite.
    pub fn around(places: &[[f32; 3]]) -> Option<Self> {
        let first = places.first()?;
        let (mut low, mut high) = (first.map(f64::from), first.map(f64::from));
        for place in places {
            for axis in 0..3 {
                let x = f64::from(place[axis]);
                if !x.is_finite() {
                    return None;
                }
                (low[axis], high[axis]) = (low[axis].min(x), high[axis].max(x));
            }
        }
        let longest = (0..3).map(|axis| high[axis] - low[axis]).fold(0.0, f64::max);
        let room = ROOM * longest + STEP_MIN_M;
        let step = STEP_MIN_M.max((longest + 2.0 * room) / STEPS_MAX) as f32;
        let origin = low.map(|x| (x - room) as f32);
        let most = origin.map(f32::abs).into_iter().fold(0.0, f32::max);
        // Half a step, and the rounding of a product and a sum in single precision.
        let rounding = f64::from(f32::EPSILON) * (f64::from(most) + 65_535.0 * f64::from(step));
        let error = (0.5 * f64::from(step) + rounding) as f32 * (1.0 + f32::EPSILON);
        let sound = step.is_finite() && origin.iter().all(|x| x.is_finite());
        sound.then_some(Self { origin, step, error })
    }

    /// Counts of a position; `None` outside the box.
    pub fn numbers(&self, place: [f32; 3]) -> Option<[u16; 3]> {
        let mut numbers = [0; 3];
        for axis in 0..3 {
            let from_origin = f64::from(place[axis]) - f64::from(self.origin[axis]);
            let number = (from_origin / f64::from(self.step)).round();
            if !(0.0..=65_535.0).contains(&number) {
                return None;
            }
            numbers[axis] = number as u16;
        }
        Some(numbers)
    }

    /// Position that the page draws for some counts, in its own arithmetic.
    pub fn place(&self, numbers: [u16; 3]) -> [f32; 3] {
        std::array::from_fn(|axis| self.origin[axis] + f32::from(numbers[axis]) * self.step)
    }
}

/// Largest error of a direction, rad.
pub const DIRECTION_ERROR: f64 = 1e-4;

/// Direction as a point of an octahedron that is unfolded into a square; a zero vector points up.
pub fn folded(direction: [f32; 3]) -> [i16; 2] {
    let [x, y, z] = direction.map(f64::from);
    let sum = x.abs() + y.abs() + z.abs();
    if !(sum > 0.0 && sum.is_finite()) {
        return [0, i16::MAX];
    }
    let (u, v) = (x / sum, z / sum);
    let sign = |a: f64| if a < 0.0 { -1.0 } else { 1.0 };
    let (u, v) = match y < 0.0 {
        true => ((1.0 - v.abs()) * sign(u), (1.0 - u.abs()) * sign(v)),
        false => (u, v),
    };
    [u, v].map(|a| (a * 32_767.0).round() as i16)
}

/// The direction that the page draws for a folded one; of length 1.
pub fn unfolded(folded: [i16; 2]) -> [f32; 3] {
    let [u, v] = folded.map(|a| f32::from(a) / 32_767.0);
    let y = 1.0 - u.abs() - v.abs();
    let under = (-y).max(0.0);
    let x = u - under.copysign(u);
    let z = v - under.copysign(v);
    let length = (x * x + y * y + z * z).sqrt();
    [x / length, y / length, z / length]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn no_place_of_the_box_comes_back_further_off_than_stated(
            scale in -3.0..2.0f64,
            shift in prop::array::uniform3(-1.0..1.0f32),
            places in prop::collection::vec(prop::array::uniform3(-1.0..1.0f32), 1..50),
        ) {
            let scale = 10f64.powf(scale) as f32;
            let places: Vec<[f32; 3]> =
                places.iter().map(|p| std::array::from_fn(|i| shift[i] + scale * p[i])).collect();
            let space = QuantisedBox::around(&places).unwrap();
            for place in places {
                let back = space.place(space.numbers(place).unwrap());
                for axis in 0..3 {
                    let off = (f64::from(back[axis]) - f64::from(place[axis])).abs();
                    prop_assert!(off <= f64::from(space.error), "{off} m, stated {} m", space.error);
                }
            }
        }

        #[test]
        fn no_direction_comes_back_further_off_than_stated(d in prop::array::uniform3(-1.0..1.0f32)) {
            let length = d.iter().map(|x| f64::from(*x).powi(2)).sum::<f64>().sqrt();
            prop_assume!(length > 1e-3);
            let back = unfolded(folded(d));
            let off = (0..3).map(|i| (f64::from(back[i]) - f64::from(d[i]) / length).powi(2));
            let off = off.sum::<f64>().sqrt();
            prop_assert!(off <= DIRECTION_ERROR, "{off}");
        }
    }

    #[test]
    fn stated_error_of_a_fruit_is_five_micrometres_and_places_outside_have_no_numbers() {
        let space = QuantisedBox::around(&[[-0.04, 0.0, -0.02], [0.04, 0.05, 0.02]]).unwrap();
        assert!((4.9e-6..6.0e-6).contains(&space.error), "{}", space.error);
        assert_eq!(space.numbers([-0.1, 0.0, 0.0]), None);
        assert_eq!(space.numbers([f32::NAN, 0.0, 0.0]), None);
        assert!(QuantisedBox::around(&[]).is_none());
        assert!(QuantisedBox::around(&[[f32::INFINITY, 0.0, 0.0]]).is_none());
    }
}
