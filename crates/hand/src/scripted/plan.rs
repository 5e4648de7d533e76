//! Finding a palm pose from which all five fingertips reach the object, as a person does by eye.
//!
//! The paths of the fingertips in the palm's frame are the same for every palm pose, so they are
//! worked out once, with the angles that survive the glove's sensors, and then only moved.

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};
use softgrasp_grasp::object::RestShape;
use softgrasp_grasp::shape::Sphere;
use softgrasp_grasp::sphere_tree::{ContactHit, tip_hits};

use super::approach::PalmPath;
use super::grasp_plan::{GraspPlan, is_over, outline_without_thumb};
use super::pinch::plan_pinch;
use super::posture::Posture;
use super::tip_paths::{STEPS, TipPath, closures, finger_paths, thumb_paths, tips};
use crate::hand_setup::HandSetup;

/// Closure of the first and the last contact that count: there must be room to open and to press.
const TOUCH_RANGE: (f64, f64) = (0.08, 0.80);
/// A tip that meets the surface at a flatter angle than this would slide and not press.
const STRAIGHT_MIN: f64 = 0.3;
/// A finger that does not touch closes by this share of what the middle finger does.
const ALONG: f64 = 0.8;
/// The line between thumb and fingers meets the surface at least so straight (cosine): well within the cone
/// of friction of a dry skin.
const GRIP_STRAIGHT_MIN: f64 = 0.85;
/// The palm of a hand above a table looks up by no more than this (sine of the angle).
const GAZE_UP_MAX: f64 = 0.3;
/// How far the fingers are gathered.
const GATHERS: [f64; 3] = [0.0, 0.5, 1.0];
/// Tilts of the palm against the axes of the object, rad: the few that suffice for a round object,
/// and the many that a thin or a branched one may need.
const TILTS_FEW: [f64; 2] = [0.0, 0.45];
const TILTS_MANY: [f64; 4] = [0.0, 0.25, 0.5, 0.75];

/// Requirements of a grasp that is planned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GraspWish {
    /// How far the tips move on after their touch, m.
    pub press_depth: f64,
    /// Direction of an earlier grasp: the palm will look at least 60° away from it.
    pub avoid_gaze: Option<Vector3<f64>>,
    /// Height (y, world) of the table that the object lies on, m: no part of the hand goes below it, from
    /// the reach to the press.
    pub table_y: Option<f64>,
    /// Whether only grasps count that friction can hold.
    pub holds_well: bool,
    /// Whether opposed places of the surface are looked for first, to pinch the object there.
    pub pinches_first: bool,
}

/// Best palm pose for grasping an object whose frame is the world's, or `None` if no pose tried
/// lets all five tips touch.
pub fn plan_grasp(object: &RestShape, setup: &HandSetup, wish: &GraspWish) -> Option<GraspPlan> {
    // Five tips on five different nodes.
    if object.surface().nodes.len() < 5 {
        return None;
    }
    let pinch = || plan_pinch(object, setup, (wish.press_depth, wish.table_y?));
    let searched = || {
        let few = search(object, setup, wish, &TILTS_FEW);
        few.or_else(|| search(object, setup, wish, &TILTS_MANY))
    };
    let found = match wish.pinches_first {
        true => pinch().or_else(searched),
        // A pinch avoids no side; who wants another one asks again without that wish.
        false => searched().or_else(|| {
            let may_pinch = wish.holds_well && wish.avoid_gaze.is_none();
            may_pinch.then(pinch)?
        }),
    };
    // An object that friction cannot hold in this hand is grasped as it can be.
    found.or_else(|| {
        let anyhow = GraspWish { holds_well: false, pinches_first: false, ..*wish };
        wish.holds_well.then(|| plan_grasp(object, setup, &anyhow))?
    })
}

fn search(
    object: &RestShape,
    setup: &HandSetup,
    wish: &GraspWish,
    tilts: &[f64],
) -> Option<GraspPlan> {
    let (centre, size) = (object.centre(), object.mesh().size());
    let thumbs = thumb_paths(setup, 1.0);
    let orientations = orientations(tilts);
    let mut best: Option<(f64, GraspPlan)> = None;
    for gather in GATHERS {
        let fingers = finger_paths(setup, gather, 1.0);
        let outline = outline_without_thumb(setup, Posture { gather, ..Posture::OPEN }, 0.0);
        for &rotation in &orientations {
            let gaze = rotation * -Vector3::z();
            if wish.table_y.is_some() && gaze.y > GAZE_UP_MAX {
                continue;
            }
            if wish.avoid_gaze.is_some_and(|avoid| gaze.dot(&avoid) > 0.5) {
                continue;
            }
            for object_in_palm in places(object) {
                let path = PalmPath { world_from_palm_rotation: rotation, object_in_palm };
                let world_from_palm = path.world_from_palm(centre);
                // Most poses end here: the open hand would be in the table.
                if wish.table_y.is_some_and(|y| !is_over(&outline, &world_from_palm, y)) {
                    continue;
                }
                let reach = Reach { object, object_from_palm: world_from_palm, centre, size };
                let touches = match wish.table_y {
                    Some(_) => reach.pinch(&fingers),
                    None => reach.touches(&fingers),
                };
                let Some(touches) = touches else { continue };
                let Some((score, found)) = reach.oppose(&touches, &thumbs, wish) else { continue };
                if best.as_ref().is_some_and(|(best_score, _)| score <= *best_score) {
                    continue;
                }
                let posture = Posture { gather, ..found.0 };
                let touch = found.1.map(|t| t.closure);
                let opened = [0.0; 5];
                let holds_by_friction = wish.holds_well;
                let touching = GraspPlan {
                    path,
                    posture,
                    reach: opened,
                    touch,
                    press: touch,
                    holds_by_friction,
                };
                let is_possible =
                    |y| touching.is_above(setup, centre, y) && touching.has_room(setup, object);
                if !wish.table_y.is_none_or(is_possible) {
                    continue;
                }
                let Some(press) = reach.press(setup, posture, &found.1, wish.press_depth) else {
                    continue;
                };
                let plan = GraspPlan { press, ..touching };
                if wish.table_y.is_none_or(|y| plan.is_above(setup, centre, y)) {
                    best = Some((score, plan));
                }
            }
        }
    }
    best.map(|(_, plan)| plan)
}

/// The 24 rotations of a cube, each straight and tilted; palm down and fingers forward comes first.
fn orientations(tilts: &[f64]) -> Vec<UnitQuaternion<f64>> {
    let quarter = std::f64::consts::FRAC_PI_2;
    // Palm frame +Z (back of the hand) up, +Y (fingers) away from the viewer (−Z).
    let natural = Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0);
    let natural = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(natural));
    let turn = |axis, n: i32| UnitQuaternion::from_axis_angle(&axis, quarter * f64::from(n));
    let mut straight: Vec<UnitQuaternion<f64>> = Vec::new();
    for (x, y, z) in (0..4).flat_map(|x| (0..4).flat_map(move |y| (0..4).map(move |z| (x, y, z)))) {
        let rotation = turn(Vector3::z_axis(), z)
            * turn(Vector3::y_axis(), y)
            * turn(Vector3::x_axis(), x)
            * natural;
        if straight.iter().all(|known| known.angle_to(&rotation) > 0.1) {
            straight.push(rotation);
        }
    }
    let signed = |tilt: &f64| if *tilt == 0.0 { vec![0.0] } else { vec![*tilt, -tilt] };
    let angles: Vec<f64> = tilts.iter().flat_map(signed).collect();
    let mut all = Vec::new();
    for &about_y in &angles {
        for &about_z in &angles {
            let tilt = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), about_y)
                * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), about_z);
            all.extend(straight.iter().map(|rotation| rotation * tilt));
        }
    }
    all
}

/// Places of the object's centre in front of the palm, nearest to a natural grip first.
fn places(object: &RestShape) -> Vec<Vector3<f64>> {
    let half = 0.5 * object.mesh().size();
    let mut all = Vec::new();
    for z in 0..6 {
        for y in 0..6 {
            for x in [0.0, 0.012, -0.012] {
                let depth = 0.3 * half + 0.015 + 0.012 * f64::from(z);
                all.push(Vector3::new(x, 0.08 + 0.013 * f64::from(y), -depth));
            }
        }
    }
    all
}

/// One palm pose under trial.
struct Reach<'a> {
    object: &'a RestShape,
    object_from_palm: Isometry3<f64>,
    /// Centre and extent of the object.
    centre: Point3<f64>,
    size: f64,
}

/// A tip's first touch.
#[derive(Clone, Copy)]
struct Touch {
    closure: f64,
    hit: ContactHit,
    tip: Point3<f64>,
    /// Cosine between the tip's motion and straight into the object.
    straight: f64,
    /// Whether the tip touches at all: of a pinch, ring and little finger need not.
    holds: bool,
}

impl Reach<'_> {
    /// First touch along a path, if it is within the range that counts.
    fn touch(&self, path: &TipPath) -> Option<Touch> {
        for (step, (tip, closure)) in path.iter().zip(closures()).enumerate() {
            if closure > TOUCH_RANGE.1 {
                return None;
            }
            let contact_point = self.object_from_palm * tip.contact_point;
            let sphere = Sphere { centre: self.object_from_palm * tip.sphere.centre, ..tip.sphere };
            let (tree, normals) = (self.object.tree(), self.object.normals());
            if let Some(hit) = tip_hits(tree, normals, &sphere, &contact_point)[0] {
                let next = self.object_from_palm * path.get(step + 1)?.contact_point;
                let straight = -(next - contact_point).normalize().dot(&hit.normal);
                let counts = closure >= TOUCH_RANGE.0 && straight >= STRAIGHT_MIN;
                let holds = true;
                return counts.then_some(Touch {
                    closure,
                    hit,
                    tip: contact_point,
                    straight,
                    holds,
                });
            }
        }
        None
    }

    /// Touches of the four fingers, all or none.
    fn touches(&self, fingers: &[TipPath; 4]) -> Option<[Touch; 4]> {
        // The middle finger reaches furthest: if it does not touch, no grasp is near.
        let middle = self.touch(&fingers[1])?;
        let little = self.touch(&fingers[3])?;
        Some([self.touch(&fingers[0])?, middle, self.touch(&fingers[2])?, little])
    }

    /// Touches of index and middle finger; ring and little finger close along where they do not touch.
    fn pinch(&self, fingers: &[TipPath; 4]) -> Option<[Touch; 4]> {
        let middle = self.touch(&fingers[1])?;
        let index = self.touch(&fingers[0])?;
        let along = Touch { closure: ALONG * middle.closure, holds: false, ..middle };
        let other = |finger: &TipPath| self.touch(finger).unwrap_or(along);
        Some([index, middle, other(&fingers[2]), other(&fingers[3])])
    }

    /// The thumb posture that opposes the fingers best, with its score.
    fn oppose(
        &self,
        fingers: &[Touch; 4],
        thumbs: &[(Posture, TipPath)],
        wish: &GraspWish,
    ) -> Option<(f64, (Posture, [Touch; 5]))> {
        let mut best: Option<(f64, (Posture, [Touch; 5]))> = None;
        for (posture, path) in thumbs {
            let Some(thumb) = self.touch(path) else { continue };
            let touches = [thumb, fingers[0], fingers[1], fingers[2], fingers[3]];
            let Some(mut score) = score(&touches) else { continue };
            if wish.holds_well {
                let Some(grip) = self.grip(&touches) else { continue };
                score += grip;
            }
            if best.as_ref().is_none_or(|(b, _)| score > *b) {
                best = Some((score, (*posture, touches)));
            }
        }
        best
    }

    /// How well friction can hold between thumb and fingers, with the object's weight: best where the line
    /// between them is level, goes through the middle of the object and meets the surface straight on both
    /// sides; `None` where it leaves the cones of friction.
    ///
    /// Source: Nguyen (1988), force closure of two contacts with friction.
    fn grip(&self, touches: &[Touch; 5]) -> Option<f64> {
        let [thumb, fingers @ ..] = touches;
        let opposite: Vector3<f64> =
            fingers.iter().map(|t| t.tip.coords).sum::<Vector3<f64>>() / 4.0;
        let normal = fingers.iter().map(|t| t.hit.normal).sum::<Vector3<f64>>();
        let across = opposite - thumb.tip.coords;
        let line = across.try_normalize(f64::MIN_POSITIVE)?;
        let straight = (-line.dot(&thumb.hit.normal)).min(line.dot(&normal.try_normalize(1e-9)?));
        let to_centre = self.centre.coords - thumb.tip.coords;
        let aside = (to_centre - line * line.dot(&to_centre)).norm() / self.size;
        // Tips above the middle press the object onto the table instead of lifting it.
        let tips = nalgebra::center(&thumb.tip, &Point3::from(opposite));
        let above = ((tips.y - self.centre.y) / self.size).max(-0.05);
        let held = 3.0 * straight - 2.0 * line.y.abs() - 20.0 * aside - 10.0 * above;
        (straight > GRIP_STRAIGHT_MIN).then_some(held)
    }

    /// Closures at which the tips have moved by `depth` since their touch.
    fn press(
        &self,
        setup: &HandSetup,
        posture: Posture,
        touches: &[Touch; 5],
        depth: f64,
    ) -> Option<[f64; 5]> {
        let mut press = [0.0; 5];
        for (digit, touch) in touches.iter().enumerate() {
            if !touch.holds {
                press[digit] = touch.closure;
                continue;
            }
            let deep_enough = (1..=2 * STEPS).find_map(|step| {
                let closure = touch.closure + step as f64 / (4 * STEPS) as f64;
                let tip = tips(setup, &[closure; 5], posture)[digit].contact_point;
                let moved = self.object_from_palm * tip - touch.tip;
                (moved.norm() >= depth).then_some(closure)
            });
            press[digit] = deep_enough?;
        }
        Some(press)
    }
}

/// How good a set of touches is to hold with: the thumb opposes the fingers, the nodes differ.
fn score(touches: &[Touch; 5]) -> Option<f64> {
    let held: Vec<&Touch> = touches.iter().filter(|touch| touch.holds).collect();
    for (i, a) in held.iter().enumerate() {
        if held[..i].iter().any(|b| b.hit.node == a.hit.node) {
            return None;
        }
    }
    let (thumb, fingers) = (held[0], &held[1..]);
    let count = fingers.len() as f64;
    let normals: Vector3<f64> = fingers.iter().map(|t| t.hit.normal).sum();
    let opposition = -thumb.hit.normal.dot(&normals) / count;
    // Tips far apart hold a body better than tips in a heap.
    let spread = fingers.iter().map(|t| (t.tip - thumb.tip).norm()).sum::<f64>() / count;
    let early = held.iter().map(|t| (t.closure - 0.45).abs()).fold(0.0, f64::max);
    let straight = held.iter().map(|t| t.straight).fold(1.0, f64::min);
    Some(opposition + 5.0 * spread + straight - 0.5 * early)
}
