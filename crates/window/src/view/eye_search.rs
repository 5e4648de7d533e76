//! The eye that sees most of a squeeze: thumb, fingers, and the object between them.

use nalgebra::{Isometry3, Point3, Vector3};
use softgrasp_grasp::hand::HandColliders;
use softgrasp_grasp::object::RestShape;

use super::camera::ViewCamera;
use super::frame::HandView;
use super::ray_hit::ray_hit;

/// Directions that are tried: so many around, at these heights above the horizon, rad.
const AROUND: usize = 36;
const PITCHES: [f64; 4] = [0.10, 0.25, 0.42, 0.60];
/// A height that shows the ground and the sides of things, rad.
const PITCH_LIKED: f64 = 0.30;
/// Triangles of the object that are looked at; of a finer mesh every so many-th is.
const TRIANGLES_MAX: usize = 6000;
/// Places of the object's surface that are to be seen.
const PLACES: usize = 40;
/// The palm as a line from wrist to knuckles with a radius, m, in its own frame.
const PALM: (f64, f64, f64) = (0.0, 0.085, 0.034);
/// Radius of the ball around object and hand that fills the picture, m.
const SEEN_RADIUS_M: f64 = 0.068;

/// Number of what hides as a finger does and is none.
const NO_FINGER: usize = 5;

/// Weights in the sum that the best eye maximises: what each thing that is seen is worth.
const THUMB: f64 = 1.6;
const FINGER: f64 = 1.0;
const OPPOSED: f64 = 1.5;
const SURFACE: f64 = 1.4;
const OFF_PITCH: f64 = 0.8;

/// The eye that sees most of a hand which squeezes an object, past other objects, each in a ball.
///
/// Units: m. Frames: `squeezing` and the balls in the world.
pub fn eye_on_squeeze(
    rest: &RestShape,
    world_from_object: &Isometry3<f64>,
    squeezing: &HandView,
    others: &[(Point3<f64>, f64)],
) -> ViewCamera {
    let mut scene = Scene::new(rest, world_from_object, squeezing);
    let balls = others.iter().map(|(centre, radius)| (*centre, *centre, *radius, NO_FINGER));
    scene.bones.extend(balls);
    let mut best = (f64::NEG_INFINITY, ViewCamera::default());
    for step in 0..AROUND {
        for pitch in PITCHES {
            let yaw = std::f64::consts::TAU * step as f64 / AROUND as f64;
            let mut eye = ViewCamera { yaw, pitch, ..ViewCamera::default() };
            eye.frame(scene.middle, SEEN_RADIUS_M.max(0.6 * rest.mesh().size()));
            let worth = scene.worth(&eye);
            if worth > best.0 {
                best = (worth, eye);
            }
        }
    }
    best.1
}

/// What can be seen and what hides it, in the world.
struct Scene {
    middle: Point3<f64>,
    triangles: Vec<[Point3<f64>; 3]>,
    /// Positions of the fingernails, thumb first, m.
    tips: [Point3<f64>; 5],
    /// Positions on the object's surface, m, and their normals.
    places: Vec<(Point3<f64>, Vector3<f64>)>,
    /// Segments of fingers, the palm and balls around other objects: both ends and radius, m, and the
    /// digit's number.
    bones: Vec<(Point3<f64>, Point3<f64>, f64, usize)>,
}

impl Scene {
    fn new(rest: &RestShape, world_from_object: &Isometry3<f64>, hand: &HandView) -> Self {
        let surface = rest.surface();
        let every = surface.triangles.len().div_ceil(TRIANGLES_MAX).max(1);
        let vertices = rest.mesh().vertices();
        let corner = |node: u32| world_from_object * vertices[node as usize];
        let triangles: Vec<_> =
            surface.triangles.iter().step_by(every).map(|t| t.map(corner)).collect();
        let place_every = (triangles.len() / PLACES).max(1);
        let places = triangles.iter().step_by(place_every).filter_map(|[a, b, c]| {
            let middle = Point3::from((a.coords + b.coords + c.coords) / 3.0);
            Some((middle, (b - a).cross(&(c - a)).try_normalize(1e-12)?))
        });
        let places = places.collect();
        let colliders = hand.colliders();
        let centre = world_from_object * rest.centre();
        let tips = colliders
            .fingers
            .each_ref()
            .map(|finger| finger.tip.centre + 0.5 * (finger.tip.centre - finger.contact_point));
        let middle = (centre.coords * 2.0 + tips[0].coords + tips[2].coords) / 4.0;
        Self {
            middle: Point3::from(middle),
            triangles,
            tips,
            places,
            bones: bones(&colliders, &hand.world_from_palm),
        }
    }

    fn worth(&self, eye: &ViewCamera) -> f64 {
        let at = eye.eye();
        let sees = |finger: usize| {
            let tip = &self.tips[finger];
            f64::from(!self.is_behind_object(tip, &at) && !self.is_behind_hand(tip, &at, finger))
        };
        let fingers: f64 = (1..5).map(sees).sum();
        let towards = at - self.middle;
        let [right, up, _] = eye.axes();
        let others = self.tips[1..].iter().map(|tip| tip.coords).sum::<Vector3<f64>>() / 4.0;
        let apart = self.tips[0].coords - others;
        let opposed = apart.dot(&right).hypot(apart.dot(&up)) / apart.norm().max(1e-9);
        let mut faced = 0.0;
        let mut seen = 0.0;
        for (place, normal) in &self.places {
            if normal.dot(&towards) > 0.0 {
                faced += 1.0;
                seen += f64::from(!self.is_behind_hand(place, &at, usize::MAX));
            }
        }
        THUMB * sees(0)
            + FINGER * fingers
            + OPPOSED * opposed
            + SURFACE * seen / f64::max(faced, 1.0)
            - OFF_PITCH * (eye.pitch - PITCH_LIKED).abs()
    }

    fn is_behind_object(&self, place: &Point3<f64>, eye: &Point3<f64>) -> bool {
        let towards = eye - place;
        self.triangles.iter().any(|triangle| ray_hit(triangle, place, &towards).is_some())
    }

    /// Whether a finger other than `own`, or the palm, is between a place and the eye.
    fn is_behind_hand(&self, place: &Point3<f64>, eye: &Point3<f64>, own: usize) -> bool {
        let others = self.bones.iter().filter(|(.., finger)| *finger != own);
        let mut others = others.map(|(begin, end, radius, _)| (begin, end, radius));
        others.any(|(begin, end, radius)| gap(place, eye, begin, end) < *radius)
    }
}

fn bones(
    colliders: &HandColliders,
    world_from_palm: &Isometry3<f64>,
) -> Vec<(Point3<f64>, Point3<f64>, f64, usize)> {
    let (wrist, knuckles, radius) = PALM;
    let palm = |y: f64| world_from_palm * Point3::new(0.0, y, 0.0);
    let mut all = vec![(palm(wrist), palm(knuckles), radius, NO_FINGER)];
    for (finger, of_finger) in colliders.fingers.iter().enumerate() {
        all.extend(of_finger.cylinders.iter().map(|bone| {
            (bone.base, bone.base + bone.axis.into_inner() * bone.length, bone.radius, finger)
        }));
    }
    all
}

/// Smallest distance between two segments, m.
///
/// Source: Ericson, Real-Time Collision Detection (2005), 5.1.9.
fn gap(p: &Point3<f64>, q: &Point3<f64>, r: &Point3<f64>, s: &Point3<f64>) -> f64 {
    let (along, across, between) = (q - p, s - r, p - r);
    let (a, e, f) = (along.norm_squared(), across.norm_squared(), across.dot(&between));
    let (b, c) = (along.dot(&across), along.dot(&between));
    let denominator = a * e - b * b;
    let share =
        if denominator > 1e-15 { ((b * f - c * e) / denominator).clamp(0.0, 1.0) } else { 0.0 };
    let other = ((b * share + f) / e.max(1e-15)).clamp(0.0, 1.0);
    let share = ((b * other - c) / a.max(1e-15)).clamp(0.0, 1.0);
    ((p + along * share) - (r + across * other)).norm()
}

#[cfg(test)]
mod tests {
    use softgrasp_core::mesh::{BuiltIn, generate};
    use softgrasp_grasp::object::ContactModel;
    use softgrasp_hand::hand_setup::HandSetup;
    use softgrasp_hand::scripted::PlanRequest;
    use std::sync::Arc;

    use super::*;

    #[test]
    fn squeeze_is_not_hidden_from_the_first_eye() {
        for shape in [BuiltIn::Strawberry, BuiltIn::Cube] {
            let mesh = generate(shape, 400).unwrap();
            let factor = 0.08 / mesh.size();
            let scaled = mesh.vertices().iter().map(|p| p * factor).collect();
            let rest = Arc::new(RestShape::try_new(mesh.with_vertices(scaled).unwrap()).unwrap());
            let setup = HandSetup::default();
            let (object, contact) = (Arc::clone(&rest), ContactModel::default());
            let request = PlanRequest::new(object, setup.clone(), contact);
            let pose = request.grip().unwrap().squeezing(&setup, rest.centre());
            let hand = HandView::of_pose(setup.dimensions, &pose);
            let eye = eye_on_squeeze(&rest, &Isometry3::identity(), &hand, &[]);
            let scene = Scene::new(&rest, &Isometry3::identity(), &hand);
            let seen = (0..5).filter(|&finger| {
                let tip = &scene.tips[finger];
                !scene.is_behind_object(tip, &eye.eye())
                    && !scene.is_behind_hand(tip, &eye.eye(), finger)
            });
            let seen: Vec<usize> = seen.collect();
            assert!(seen.contains(&0) && seen.len() >= 2, "{shape:?}: {seen:?} are seen");
            assert!(eye.pitch > 0.0);
        }
    }

    #[test]
    fn gap_of_crossing_and_of_parallel_segments() {
        let p = |x: f64, y: f64, z: f64| Point3::new(x, y, z);
        let crossing =
            gap(&p(-1.0, 0.0, 0.0), &p(1.0, 0.0, 0.0), &p(0.0, -1.0, 0.5), &p(0.0, 1.0, 0.5));
        let parallel =
            gap(&p(0.0, 0.0, 0.0), &p(1.0, 0.0, 0.0), &p(3.0, 0.0, 0.0), &p(4.0, 0.0, 0.0));
        assert!((crossing - 0.5).abs() < 1e-12 && (parallel - 2.0).abs() < 1e-12);
    }
}
