//! Marks of the contacts: where each fingertip holds, what it covers, and how hard it presses.

use kiss3d::prelude::{Color, SceneNode3d};
use nalgebra::{Isometry3, Point3, Vector3};

use super::units::{UNITS_PER_M, drawn_point, rotation_from_y};
use crate::view::frame::{HandView, ViewFrame};
use crate::view::steady_range::SteadyRange;

/// One mark for each fingertip, thumb first.
pub struct DrawnMarks {
    marks: Vec<Mark>,
    /// Force that an arrow of full length stands for, N.
    newtons: SteadyRange,
}

/// The marks of one fingertip.
struct Mark {
    /// Ball on the node that the tip holds.
    node: SceneNode3d,
    /// Disc on what the tip covers.
    patch: SceneNode3d,
    shaft: SceneNode3d,
    head: SceneNode3d,
}

const NODE: Color = Color::new(1.0, 0.85, 0.1, 1.0);
const PATCH: Color = Color::new(1.0, 0.80, 0.1, 0.35);
const FORCE: Color = Color::new(0.10, 0.35, 0.95, 1.0);
const NODE_RADIUS_M: f32 = 0.0010;
const SHAFT_RADIUS_M: f32 = 0.0011;
const HEAD_LENGTH_M: f64 = 0.006;
/// Length of the longest arrow, m.
const ARROW_M: f64 = 0.05;
/// An arrow ends so many radii of the fingertip before the place: outside the finger.
const OUTSIDE: f64 = 2.2;
/// Smallest force that an arrow of full length stands for, N.
const LEAST_NEWTONS: f64 = 0.05;

impl DrawnMarks {
    /// Marks that are hidden before the first tick is shown.
    pub fn new(scene: &mut SceneNode3d) -> Self {
        let mark = |_| {
            let mut node = scene.add_sphere(NODE_RADIUS_M * UNITS_PER_M);
            node.set_color(NODE).set_emissive(Color::new(0.35, 0.28, 0.02, 1.0));
            let mut patch = scene.add_sphere(1.0);
            patch.set_color(PATCH).set_casts_shadows(false);
            let (mut shaft, mut head) = (scene.add_cylinder(1.0, 1.0), scene.add_cone(1.0, 1.0));
            for part in [&mut shaft, &mut head] {
                part.set_color(FORCE).set_roughness(0.4);
            }
            let mut mark = Mark { node, patch, shaft, head };
            mark.hide();
            mark
        };
        Self { marks: (0..5).map(mark).collect(), newtons: SteadyRange::new(LEAST_NEWTONS) }
    }

    /// Force that a metre of arrow stands for, N/m.
    pub fn newtons_per_m(&self) -> f64 {
        self.newtons.most() / ARROW_M
    }

    /// Shows the contacts and forces of a tick, as far as they are to be seen.
    ///
    /// Units: `shape` m, object frame.
    pub fn follow(
        &mut self,
        frame: &ViewFrame,
        shape: &[Point3<f64>],
        contacts: bool,
        forces: bool,
    ) {
        let world_from_object = &frame.object.world_from_object;
        if let Some(all) = &frame.grasp.forces {
            let largest = all.iter().map(Vector3::norm).fold(0.0, f64::max);
            self.newtons.follow(largest, frame.at_s);
        }
        let scale = self.newtons.most();
        for (finger, mark) in self.marks.iter_mut().enumerate() {
            let radius = frame.hand.as_ref().map_or(0.006, |hand| tip_radius(hand, finger));
            let contact = frame.grasp.contacts[finger];
            let held = contact.and_then(|contact| shape.get(contact.node as usize));
            let held = held.map(|place| world_from_object * place);
            mark.hide();
            if let (true, Some(place), Some(contact)) = (contacts, &held, contact) {
                mark.show_contact(place, &(world_from_object * contact.normal_in_object), radius);
            }
            if let (true, Some(all)) = (forces, &frame.grasp.forces) {
                let arrow = arrow(&all[finger], scale, world_from_object);
                if let Some(place) = pressed_place(frame, finger, held, &arrow) {
                    mark.show_force(&place, &arrow, OUTSIDE * radius);
                }
            }
        }
    }
}

/// The place where a fingertip presses: the node that it is glued to, or the foremost point of the tip in
/// the direction of its force.
fn pressed_place(
    frame: &ViewFrame,
    finger: usize,
    held: Option<Point3<f64>>,
    arrow: &Vector3<f64>,
) -> Option<Point3<f64>> {
    held.or_else(|| {
        let towards = arrow.try_normalize(1e-9)?;
        let tip = frame.hand.as_ref()?.colliders().fingers[finger].tip;
        Some(tip.centre + tip.radius * towards)
    })
}

fn tip_radius(hand: &HandView, finger: usize) -> f64 {
    hand.dimensions.tip_radii()[finger]
}

/// The arrow of a force in the world, m.
fn arrow(
    force_in_object: &Vector3<f64>,
    newtons: f64,
    world_from_object: &Isometry3<f64>,
) -> Vector3<f64> {
    world_from_object * force_in_object * (ARROW_M / newtons)
}

impl Mark {
    fn hide(&mut self) {
        for part in [&mut self.node, &mut self.patch, &mut self.shaft, &mut self.head] {
            part.set_visible(false);
        }
    }

    /// A ball on the node and a flat disc on what the tip covers.
    fn show_contact(&mut self, place: &Point3<f64>, normal: &Vector3<f64>, radius: f64) {
        self.node.set_visible(true).set_position(drawn_point(place));
        self.patch.set_visible(true).set_position(drawn_point(place));
        self.patch.set_rotation(rotation_from_y(normal));
        set_size(&mut self.patch, radius as f32, 0.24 * radius as f32);
    }

    /// An arrow that points at the place and ends so far before it, outside the finger: what is inside
    /// it is not seen.
    ///
    /// Units: `before` m.
    fn show_force(&mut self, place: &Point3<f64>, arrow: &Vector3<f64>, before: f64) {
        let Some([tail, neck, tip]) = arrow_places(place, arrow, before) else { return };
        let rotation = rotation_from_y(arrow);
        let middle = |a: &Point3<f64>, b: &Point3<f64>| drawn_point(&nalgebra::center(a, b));
        self.head.set_visible(true).set_rotation(rotation).set_position(middle(&neck, &tip));
        set_size(&mut self.head, 2.6 * SHAFT_RADIUS_M, (tip - neck).norm() as f32);
        self.shaft.set_visible(true).set_rotation(rotation).set_position(middle(&tail, &neck));
        set_size(&mut self.shaft, SHAFT_RADIUS_M, (neck - tail).norm() as f32);
    }
}

/// Tail, neck and tip of an arrow that points at a place and ends so far before it; `None` for a force that
/// is not to be seen.
///
/// Units: m.
fn arrow_places(
    place: &Point3<f64>,
    arrow: &Vector3<f64>,
    before: f64,
) -> Option<[Point3<f64>; 3]> {
    let length = arrow.norm();
    if length < 1e-4 {
        return None;
    }
    let towards = arrow / length;
    let tip = place - towards * before;
    let head = HEAD_LENGTH_M.min(0.6 * length);
    Some([tip - arrow, tip - towards * head, tip])
}

/// Sizes a round body along Y; the renderer's own have the diameter 1 and the height 1.
///
/// Units: m.
fn set_size(node: &mut SceneNode3d, radius: f32, height: f32) {
    let (wide, high) = (2.0 * radius * UNITS_PER_M, height * UNITS_PER_M);
    node.set_local_scale(wide, high, wide);
}

#[cfg(test)]
mod tests {
    use softgrasp_grasp::hand::{HandDimensions, JointAngles, pose};

    use super::*;
    use crate::view::frame::samples::frame;

    #[test]
    fn arrow_of_a_force_is_no_stub_behind_the_nail_but_lies_outside_the_finger() {
        // A fingertip that presses down on a place: all of the finger is within two radii of it.
        let (radius, place) = (0.008, Point3::new(0.01, 0.02, 0.03));
        for newtons in [0.02, 0.5, 2.0] {
            let force = Vector3::new(0.0, -newtons, 0.0);
            let arrow = arrow(&force, 2.0, &Isometry3::identity());
            let [tail, neck, tip] = arrow_places(&place, &arrow, OUTSIDE * radius).unwrap();
            for end in [tail, neck, tip] {
                assert!(end.y - place.y > 2.0 * radius, "{newtons} N: {end} is in the finger");
            }
            let length = (tip - tail).norm();
            assert!((length - ARROW_M * newtons / 2.0).abs() < 1e-12, "{newtons} N: {length} m");
            assert!(tail.y > neck.y && neck.y > tip.y, "it points at the place");
        }
        assert_eq!(arrow_places(&place, &Vector3::zeros(), 0.01), None);
    }

    #[test]
    fn finger_that_presses_with_friction_has_an_arrow_though_it_is_glued_to_no_node() {
        let mut frame = frame(1);
        let (dimensions, palm) = (HandDimensions::default(), Isometry3::translation(0.0, 0.1, 0.2));
        let hand = pose(&dimensions, &JointAngles::flat(), palm);
        frame.hand = Some(HandView::of_pose(dimensions, &hand));
        let (arrow, tip) = (Vector3::new(0.0, -0.02, 0.0), hand.fingers[1].tip());
        let place = pressed_place(&frame, 1, None, &arrow).unwrap();
        let radius = dimensions.tip_radii()[1];
        assert!((place - tip).norm() < 2.5 * radius, "{place} is not at the fingertip {tip}");
        let node = Point3::new(0.01, 0.02, 0.03);
        assert_eq!(pressed_place(&frame, 1, Some(node), &arrow), Some(node), "it is glued to it");
        assert_eq!(pressed_place(&frame, 1, None, &Vector3::zeros()), None, "it does not press");
        frame.hand = None;
        assert_eq!(pressed_place(&frame, 1, None, &arrow), None);
    }
}
