//! What becomes of an object that has flowed when the hand lets go: it springs back a little, and what
//! is left is its next rest shape.

use nalgebra::{Point3, Vector3};
use softgrasp_grasp::object::ObjectError;
use softgrasp_protocol::{DofValue, NodeChoice, Question, Want};

use crate::ask::link::Reached;
use crate::object::object_work::KeptShape;
use crate::run::grasp_loop::GraspLoop;
use crate::run::keep::Keep;
use crate::run::tick_outcome::{LoopEvent, TickOutcome};

/// Stands for the tick of a question about the shape that an object springs back to. Recordings
/// hold it; every reader of JSON can represent it.
pub const SPRINGBACK: u64 = (1 << 53) - 1;

impl GraspLoop {
    /// Whether the object will not go back to its rest shape when the hand lets go now.
    pub(crate) fn springs_back(&self) -> bool {
        self.has_flowed && matches!(self.keep, Keep::NotWanted | Keep::WhenWhole)
    }

    /// Asks for the shape without the hand. Until it is known the object stays as it is.
    pub(crate) fn begin_to_spring_back(
        &mut self,
        grip: u64,
        outcome: &mut TickOutcome,
    ) -> Result<(), ObjectError> {
        self.refuse_to_save_half(outcome);
        self.deforming_since = None;
        (self.shown_tick, self.shown_forces) = (None, None);
        (self.keep, self.has_flowed) = (Keep::SpringsBack, false);
        let question = Question {
            known: self.support(),
            want: Want { nodes: NodeChoice::All, ..Want::default() },
            // No budget: the shape stays for good.
            max_error: None,
            ..Question::default()
        };
        self.link.ask(SPRINGBACK, grip, question, self.large_ask());
        self.wait_in_lockstep(outcome)
    }

    /// Three nodes of the surface, held where they are just so that the object cannot move as a
    /// whole: no force is needed for that.
    fn support(&self) -> Vec<DofValue> {
        let nodes = &self.object.surface().nodes;
        let places: Vec<Point3<f64>> =
            nodes.iter().map(|&n| self.object.rest().vertices()[n as usize]).collect();
        let held = determinate_support(&places).into_iter().map(|(place, axis)| {
            let node = nodes[place];
            let value = self.object.displacement()[node as usize][axis];
            DofValue { dof: 3 * node + axis as u32, value }
        });
        let mut held: Vec<DofValue> = held.collect();
        held.sort_unstable_by_key(|known| known.dof);
        held
    }

    /// Takes the shape that the object has sprung back to.
    pub(crate) fn take_springback(
        &mut self,
        reached: Reached,
        outcome: &mut TickOutcome,
    ) -> Result<(), ObjectError> {
        outcome.sprung_back = true;
        if !matches!(self.keep, Keep::SpringsBack)
            || reached.rest_shape != self.object.rest_shapes()
        {
            return Ok(());
        }
        // A server that was started anew knows nothing of what has flowed.
        if !reached.large.is_some_and(|large| large.plastic_strain > 0.0) {
            return self.go_back_to_rest("the server has forgotten what has flowed", outcome);
        }
        self.object.apply(reached.displacement)?;
        self.keep = Keep::BecomesDent;
        self.make_next_rest_shape();
        self.take_work(outcome);
        Ok(())
    }

    /// There is no shape without the hand.
    pub(crate) fn refuse_springback(
        &mut self,
        outcome: &mut TickOutcome,
    ) -> Result<(), ObjectError> {
        outcome.sprung_back = true;
        match self.keep {
            Keep::SpringsBack => self.go_back_to_rest("the server gave no such shape", outcome),
            _ => Ok(()),
        }
    }

    /// Puts the dented object in the place of the one that was squeezed.
    pub(crate) fn show_dent(
        &mut self,
        made: Result<Box<KeptShape>, ObjectError>,
        outcome: &mut TickOutcome,
    ) {
        self.keep = Keep::NotWanted;
        match made {
            Ok(dented) => {
                self.changes.history.push(std::sync::Arc::clone(self.object.rest_shape()));
                self.show_from_now_on(*dented);
                self.deforming_since = None;
                let text = "the object has sprung back as far as it does, and stays dented";
                outcome.events.push(LoopEvent::Shape(text.to_owned()));
            }
            Err(error) => outcome.events.push(LoopEvent::KeepRefused(error.to_string())),
        }
    }

    fn go_back_to_rest(&mut self, why: &str, outcome: &mut TickOutcome) -> Result<(), ObjectError> {
        self.keep = Keep::NotWanted;
        outcome.springback_refused = true;
        let text = format!("the object goes back to its rest shape without a dent: {why}");
        outcome.events.push(LoopEvent::Shape(text));
        self.object.relax()
    }
}

/// Places and axes that just hold a body: all three axes of one place, two of another, one of a
/// third. Whatever equilibrium the body has, they carry no force.
///
/// # Panics
/// If there is no place.
fn determinate_support(places: &[Point3<f64>]) -> [(usize, usize); 6] {
    let farthest = |distance: &dyn Fn(&Point3<f64>) -> f64| {
        let all = (0..places.len())
            .max_by(|&a, &b| distance(&places[a]).total_cmp(&distance(&places[b])));
        all.expect("a surface has nodes")
    };
    let first = farthest(&|p| (p - places[0]).norm());
    let a = places[first];
    let second = farthest(&|p| (p - a).norm());
    let along = places[second] - a;
    let third = farthest(&|p| (p - a).cross(&along).norm());
    let across = (places[third] - a).cross(&along);
    // The second may move along the line of both, which is the axis nearest to it.
    let free = axis_nearest(&along);
    let [u, v] = [(free + 1) % 3, (free + 2) % 3];
    let turned = axis_nearest(&across);
    [(first, 0), (first, 1), (first, 2), (second, u), (second, v), (third, turned)]
}

fn axis_nearest(direction: &Vector3<f64>) -> usize {
    direction.iamax()
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix6, UnitQuaternion};

    use super::*;

    /// The support holds a body if no rigid motion leaves all six where they are.
    #[test]
    fn support_holds_a_body_however_it_is_turned() {
        for turn in 0..50 {
            let t = f64::from(turn);
            let rotation = UnitQuaternion::from_euler_angles(0.3 * t, 0.7 * t, 1.1 * t);
            let corner = |i: u32| {
                let [x, y, z] = [i & 1, i >> 1 & 1, i >> 2].map(f64::from);
                rotation * Point3::new(x, 1.7 * y, 0.4 * z)
            };
            let places: Vec<Point3<f64>> = (0..8).map(corner).collect();
            let support = determinate_support(&places);
            let rows = Matrix6::from_fn(|row, column| {
                let (place, axis) = support[row];
                let moved = match column {
                    0..3 => Vector3::ith(column, 1.0),
                    _ => Vector3::ith(column - 3, 1.0).cross(&places[place].coords),
                };
                moved[axis]
            });
            let smallest = rows.singular_values().min();
            assert!(smallest > 0.05, "turn {turn}: {smallest}");
        }
    }
}
