//! Where several objects lie on one table: beside each other, with room for fingers between them.

use nalgebra::Point3;

/// Rectangle that an object covers, seen from above.
///
/// Units: m. Frame: x to the right and z toward the user, of the object or of the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Footprint {
    low: [f64; 2],
    high: [f64; 2],
}

/// An object that is to lie on the table.
#[derive(Clone, Debug)]
pub struct Laid {
    /// Name of the object, for refusals.
    pub name: String,
    /// Rectangle that it covers around its origin.
    pub footprint: Footprint,
    /// Place of its origin on the table (x, z), m; `None` leaves it to the table.
    pub at_m: Option<[f64; 2]>,
}

/// Why objects cannot lie as they were asked to.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LayoutError {
    /// The first object was asked to lie elsewhere than at the origin.
    #[error("object 1, {name}, lies at the middle of the table: leave its at_m out")]
    FirstMoved {
        /// Name of the object.
        name: String,
    },
    /// Two objects would lie in each other.
    #[error(
        "object {one}, {one_name}, and object {other}, {other_name}, would lie in each other: their boxes \
         overlap by {overlap_m:.3} m; give them other places (at_m) or sizes"
    )]
    Overlap {
        /// Number of the first of the two, from 1.
        one: usize,
        /// Its name.
        one_name: String,
        /// Number of the second.
        other: usize,
        /// Its name.
        other_name: String,
        /// Length by which one of them has to move along an axis, m.
        overlap_m: f64,
    },
    /// An object would lie where no hand comes.
    #[error(
        "object {number}, {name}, would lie {away_m:.2} m from the middle of the table; a hand reaches \
         {REACH_M} m"
    )]
    OutOfReach {
        /// Number of the object, from 1.
        number: usize,
        /// Its name.
        name: String,
        /// Distance of its origin from the middle, m.
        away_m: f64,
    },
}

/// Room between two objects that lie where the table puts them, m: an open hand is set down between them.
pub const ROOM_M: f64 = 0.09;
/// Distance from the middle of the table that a hand reaches, m.
const REACH_M: f64 = 0.4;

impl Footprint {
    /// Rectangle around points; a single point at the origin where there are none.
    pub fn of(points: impl IntoIterator<Item = Point3<f64>>) -> Self {
        let nothing = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        let (low, high) = points.into_iter().fold(nothing, |(low, high), point| {
            let at = [point.x, point.z];
            let axes = [0, 1];
            (axes.map(|i| at[i].min(low[i])), axes.map(|i| at[i].max(high[i])))
        });
        if low[0] > high[0] { Self { low: [0.0; 2], high: [0.0; 2] } } else { Self { low, high } }
    }

    /// The rectangle with the object's origin at a place of the table.
    fn at(&self, [x, z]: [f64; 2]) -> Self {
        let moved = |[a, b]: [f64; 2]| [a + x, b + z];
        Self { low: moved(self.low), high: moved(self.high) }
    }

    /// Whether two rectangles have points inside both.
    pub fn overlaps(&self, other: &Self) -> bool {
        self.overlap_m(other) > 0.0
    }

    /// Shortest way along an axis that parts two rectangles, m; not above 0 for two that are apart.
    fn overlap_m(&self, other: &Self) -> f64 {
        let along = |i: usize| self.high[i].min(other.high[i]) - self.low[i].max(other.low[i]);
        along(0).min(along(1))
    }
}

/// Places of the objects' origins on the table (x, z), m: the first in the middle, the others where they
/// were asked to lie, or in turn to the right and to the left of all that lie there.
///
/// # Errors
/// [`LayoutError`] for objects that would lie in each other, or out of reach.
pub fn lay_out(objects: &[Laid]) -> Result<Vec<[f64; 2]>, LayoutError> {
    let Some((first, _)) = objects.split_first() else { return Ok(Vec::new()) };
    if first.at_m.is_some_and(|at| at != [0.0; 2]) {
        return Err(LayoutError::FirstMoved { name: first.name.clone() });
    }
    let mut places: Vec<Option<[f64; 2]>> = objects.iter().map(|object| object.at_m).collect();
    places[0] = Some([0.0; 2]);
    let mut to_the_right = true;
    for number in 1..objects.len() {
        if places[number].is_some() {
            continue;
        }
        let there: Vec<Footprint> = objects
            .iter()
            .zip(&places)
            .filter_map(|(object, place)| Some(object.footprint.at((*place)?)))
            .collect();
        let footprint = &objects[number].footprint;
        let x = if to_the_right {
            let edge = there.iter().map(|other| other.high[0]).fold(f64::NEG_INFINITY, f64::max);
            edge + ROOM_M - footprint.low[0]
        } else {
            let edge = there.iter().map(|other| other.low[0]).fold(f64::INFINITY, f64::min);
            edge - ROOM_M - footprint.high[0]
        };
        places[number] = Some([x, 0.0]);
        to_the_right = !to_the_right;
    }
    let places: Vec<[f64; 2]> = places.into_iter().flatten().collect();
    check(objects, &places)?;
    Ok(places)
}

/// Checks that no two objects lie in each other and that a hand reaches all of them.
fn check(objects: &[Laid], places: &[[f64; 2]]) -> Result<(), LayoutError> {
    let laid: Vec<_> = objects.iter().zip(places).collect();
    for (other, (object, place)) in laid.iter().enumerate() {
        let away_m = place[0].hypot(place[1]);
        // A place that is no number is out of reach too.
        if away_m.is_nan() || away_m > REACH_M {
            let name = object.name.clone();
            return Err(LayoutError::OutOfReach { number: other + 1, name, away_m });
        }
        for (one, (before, its_place)) in laid[..other].iter().enumerate() {
            let overlap_m =
                before.footprint.at(**its_place).overlap_m(&object.footprint.at(**place));
            if overlap_m > 0.0 {
                return Err(LayoutError::Overlap {
                    one: one + 1,
                    one_name: before.name.clone(),
                    other: other + 1,
                    other_name: object.name.clone(),
                    overlap_m,
                });
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn laid(name: &str, half_m: f64, at_m: Option<[f64; 2]>) -> Laid {
        let corners = [-half_m, half_m].map(|x| Point3::new(x, 0.3, x));
        Laid { name: name.to_owned(), footprint: Footprint::of(corners), at_m }
    }

    #[test]
    fn objects_lie_in_turn_to_the_right_and_to_the_left_with_room_between_their_boxes() {
        let all = [0.04, 0.03, 0.02, 0.01].map(|half| laid("ball", half, None));
        let places = lay_out(&all).unwrap();
        assert_eq!(places[0], [0.0, 0.0]);
        let x: Vec<f64> = places.iter().map(|place| place[0]).collect();
        let right = 0.04 + ROOM_M + 0.03;
        let expected = [0.0, right, -(0.04 + ROOM_M + 0.02), right + 0.03 + ROOM_M + 0.01];
        for (x, expected) in x.iter().zip(expected) {
            assert!((x - expected).abs() < 1e-12, "{x} instead of {expected}");
        }
    }

    #[test]
    fn place_that_was_asked_for_is_kept_and_the_others_keep_away_from_it() {
        let all =
            [laid("a", 0.03, None), laid("b", 0.03, None), laid("c", 0.03, Some([0.2, -0.1]))];
        let places = lay_out(&all).unwrap();
        assert_eq!(places[2], [0.2, -0.1]);
        assert!((places[1][0] - (0.23 + ROOM_M + 0.03)).abs() < 1e-12, "{places:?}");
    }

    #[test]
    fn objects_whose_boxes_overlap_are_refused_by_name_and_by_how_much() {
        let all = [laid("pear", 0.04, None), laid("tube", 0.03, Some([0.05, 0.0]))];
        let said = lay_out(&all).unwrap_err().to_string();
        assert!(said.contains("object 1, pear, and object 2, tube"), "{said}");
        assert!(said.contains("by 0.020 m"), "{said}");
        // Boxes that touch in a plane have no point inside both.
        let beside = [laid("pear", 0.04, None), laid("tube", 0.03, Some([0.07, 0.0]))];
        assert!(lay_out(&beside).is_ok());
    }

    #[test]
    fn object_out_of_reach_and_a_first_one_elsewhere_are_refused_by_name() {
        for far in [0.5, f64::NAN] {
            let all = [laid("pear", 0.04, None), laid("tube", 0.03, Some([far, 0.0]))];
            let said = lay_out(&all).unwrap_err().to_string();
            assert!(said.contains("object 2, tube") && said.contains("a hand reaches"), "{said}");
        }
        let said = lay_out(&[laid("pear", 0.04, Some([0.1, 0.0]))]).unwrap_err().to_string();
        assert!(said.contains("object 1, pear"), "{said}");
        assert!(lay_out(&[]).unwrap().is_empty());
    }
}
