//! Planning a pinch: the opening between thumb and fingers is laid around opposed places of the object's
//! surface, as a person does who looks where a thing is narrow.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use softgrasp_grasp::hand::{HandBody, hand_bodies, pose};
use softgrasp_grasp::object::RestShape;

use super::approach::PalmPath;
use super::grasp_plan::{GraspPlan, is_over, outline_without_thumb};
use super::opposed::{OpposedPair, PinchedSurface, STRAIGHT_MIN};
use super::posture::{Posture, angles};
use super::tip_paths::{STEPS, Tip, TipPath, closures, finger_paths, thumb_paths, tips};
use crate::hand_setup::HandSetup;

/// How far the fingers are gathered.
const GATHERS: [f64; 3] = [0.0, 0.5, 1.0];
/// How far the outer joints bend with the knuckles: a hand that curls, and one with long fingers where that
/// finds no grip better than this score.
const CURLS: [f64; 2] = [1.0, 0.35];
const GOOD: f64 = 6.5;
/// Closures of the fingers at which an opening is looked at.
const FINGER_CLOSURES: [f64; 10] = [0.16, 0.22, 0.28, 0.34, 0.40, 0.46, 0.52, 0.58, 0.64, 0.70];
/// Closure of the first and the last touch that count: there must be room to open and to press.
const TOUCH_RANGE: (f64, f64) = (0.05, 0.85);
/// A tip touches where it was expected to, within this closure: else something else is in its way.
const EXPECTED: f64 = 0.15;
/// A tip that meets the surface at a flatter angle than this would slide and not press.
const STRAIGHT_MOTION_MIN: f64 = 0.25;
/// A finger that does not touch closes by this share of what the middle finger does.
const ALONG: f64 = 0.8;
/// The palm of a hand above a table looks up by no more than this (sine of the angle).
const GAZE_UP_MAX: f64 = 0.3;
/// The hand comes with its fingers closed by this share of what it takes to touch.
const REACH: f64 = 0.6;
/// Turns of the hand about the line between its tips.
const ROLLS: usize = 24;
/// Depth in the object that is no collision, m.
const ROOM: f64 = 1e-3;
/// Height of the tips above a table, m.
const TIPS_ABOVE: f64 = 2e-3;
/// Way between the points of a segment whose distance from the surface is looked at, m.
const SAMPLE_WAY: f64 = 0.006;
/// Longest way of a tip in one step of its path, m: so far from the object, steps are passed over.
const STEP_WAY: f64 = 0.007;

/// Plans a pinch that friction can hold, above a table at the height `table_y` (m, world).
///
/// Units: `depth` m: how far the tips move on after their touch. Frame: the object's is the world's.
pub(super) fn plan_pinch(
    object: &RestShape,
    setup: &HandSetup,
    (depth, table_y): (f64, f64),
) -> Option<GraspPlan> {
    let surface = PinchedSurface::try_new(object).ok()?;
    let pairs = surface.pairs(object);
    let sought = Sought { object, setup, surface: &surface, pairs: &pairs, depth, table_y };
    let mut best: Option<(f64, GraspPlan)> = None;
    for curl in CURLS {
        if best.is_some_and(|(score, _)| score > GOOD) {
            break;
        }
        let thumbs = thumb_paths(setup, curl);
        for gather in GATHERS {
            sought.improve(&GatheredHand::new(setup, (gather, curl), &thumbs), &mut best);
        }
    }
    best.map(|(_, plan)| plan)
}

/// The object, the hand and the wish that a pinch is sought for.
struct Sought<'a> {
    object: &'a RestShape,
    setup: &'a HandSetup,
    surface: &'a PinchedSurface,
    pairs: &'a [OpposedPair],
    depth: f64,
    table_y: f64,
}

impl Sought<'_> {
    /// Lays every opening of a hand around every pair that is as wide, and keeps the best plan.
    fn improve(&self, hand: &GatheredHand<'_>, best: &mut Option<(f64, GraspPlan)>) {
        let openings = hand.openings();
        for pair in self.pairs.iter().flat_map(|pair| [*pair, pair.exchanged()]) {
            for opening in openings.iter().filter(|opening| opening.fits(&pair)) {
                for roll in 0..ROLLS {
                    let palm = opening.palm(&pair, roll, self.table_y);
                    let least = best.as_ref().map_or(f64::NEG_INFINITY, |(score, _)| *score);
                    let trial = Trial { sought: self, hand, palm };
                    if let Some(found) = trial.plan(opening, least) {
                        *best = Some(found);
                    }
                }
            }
        }
    }
}

/// A hand whose fingers are gathered so far.
struct GatheredHand<'a> {
    gather: f64,
    fingers: [TipPath; 4],
    /// What of the hand may meet the table when it comes, for each closure of the fingers.
    outlines: [Vec<(Point3<f64>, f64)>; FINGER_CLOSURES.len()],
    thumbs: &'a [(Posture, TipPath)],
}

/// Thumb, index and middle finger that have closed so far.
///
/// Units: m. Frame: the palm's.
struct Opening {
    thumb: usize,
    thumb_closure: f64,
    /// Position in [`FINGER_CLOSURES`].
    fingers: usize,
    middle: Point3<f64>,
    /// Unit direction from thumb to fingers.
    across: Vector3<f64>,
    /// Free way between the tips.
    width: f64,
    /// Radii of the thumb's tip and of the fingers'.
    radii: [f64; 2],
}

impl<'a> GatheredHand<'a> {
    fn new(
        setup: &HandSetup,
        (gather, curl): (f64, f64),
        thumbs: &'a [(Posture, TipPath)],
    ) -> Self {
        let posture = Posture { gather, curl, ..Posture::OPEN };
        let outline = |closure| outline_without_thumb(setup, posture, REACH * closure);
        let fingers = finger_paths(setup, gather, curl);
        Self { gather, fingers, outlines: FINGER_CLOSURES.map(outline), thumbs }
    }

    /// Openings of every posture of the thumb.
    fn openings(&self) -> Vec<Opening> {
        let at = |path: &TipPath, closure: f64| path[(closure * STEPS as f64).round() as usize];
        let mut all = Vec::new();
        for (thumb, (_, path)) in self.thumbs.iter().enumerate() {
            for (at_closure, closure) in FINGER_CLOSURES.into_iter().enumerate() {
                let [index, middle] = [0, 1].map(|f| at(&self.fingers[f], closure));
                let fingers = nalgebra::center(&index.sphere.centre, &middle.sphere.centre);
                let radius = 0.5 * (index.sphere.radius + middle.sphere.radius);
                for (tip, thumb_closure) in path.iter().zip(closures()) {
                    let counts = (TOUCH_RANGE.0..TOUCH_RANGE.1).contains(&thumb_closure);
                    let way = fingers - tip.sphere.centre;
                    let width = way.norm() - tip.sphere.radius - radius;
                    if !counts || width <= 0.0 {
                        continue;
                    }
                    let across = way.normalize();
                    let middle = tip.sphere.centre + (tip.sphere.radius + 0.5 * width) * across;
                    all.push(Opening {
                        thumb,
                        thumb_closure,
                        fingers: at_closure,
                        middle,
                        across,
                        width,
                        radii: [tip.sphere.radius, radius],
                    });
                }
            }
        }
        all
    }
}

impl Opening {
    /// Whether a pair is as wide as the opening.
    fn fits(&self, pair: &OpposedPair) -> bool {
        (self.width - pair.width).abs() < 0.002
    }

    /// Palm pose that lays the opening around a pair, turned about the line between them, and raised until
    /// the tips are above the table.
    fn palm(&self, pair: &OpposedPair, roll: usize, table_y: f64) -> Isometry3<f64> {
        let along = UnitQuaternion::rotation_between(&self.across, &pair.across)
            // Opposite directions: half a turn about any axis across.
            .unwrap_or_else(|| {
                let mut axis = Vector3::zeros();
                axis[self.across.iamin()] = 1.0;
                let axis = nalgebra::Unit::new_normalize(self.across.cross(&axis));
                UnitQuaternion::from_axis_angle(&axis, std::f64::consts::PI)
            });
        let angle = std::f64::consts::TAU * roll as f64 / ROLLS as f64;
        let axis = nalgebra::Unit::new_unchecked(pair.across);
        let turn = UnitQuaternion::from_axis_angle(&axis, angle) * along;
        let mut shift = pair.middle().coords - turn * self.middle.coords;
        let [thumb, fingers] = self.radii;
        let tip = |radius: f64, side: f64| {
            (pair.middle() + side * (0.5 * self.width + radius) * pair.across).y - radius
        };
        let lowest = tip(thumb, -1.0).min(tip(fingers, 1.0));
        shift.y += (table_y + TIPS_ABOVE - lowest).max(0.0);
        Isometry3::from_parts(Translation3::from(shift), turn)
    }
}

/// Where a tip meets the surface.
#[derive(Clone, Copy, Debug)]
struct Meeting {
    closure: f64,
    place: Point3<f64>,
    normal: Vector3<f64>,
    /// Cosine between the tip's motion and straight into the object.
    straight: f64,
    /// Whether the tip touches at all; one that does not closes along.
    holds: bool,
}

/// One palm pose under trial.
struct Trial<'a> {
    sought: &'a Sought<'a>,
    hand: &'a GatheredHand<'a>,
    palm: Isometry3<f64>,
}

impl Trial<'_> {
    /// The plan in this pose and its score, if it can be carried out and is better than `least`.
    fn plan(&self, opening: &Opening, least: f64) -> Option<(f64, GraspPlan)> {
        let Sought { object, setup, depth, table_y, .. } = *self.sought;
        let gaze = self.palm.rotation * -Vector3::z();
        if gaze.y > GAZE_UP_MAX
            || !is_over(&self.hand.outlines[opening.fingers], &self.palm, table_y)
        {
            return None;
        }
        let meetings = self.meetings(opening)?;
        let score = self.score(&meetings, &gaze).filter(|score| *score > least)?;
        let posture = Posture { gather: self.hand.gather, ..self.hand.thumbs[opening.thumb].0 };
        let centre = object.centre();
        let path = PalmPath {
            world_from_palm_rotation: self.palm.rotation,
            object_in_palm: self.palm.inverse_transform_point(&centre).coords,
        };
        let touch = meetings.map(|m| m.closure);
        let reach = touch.map(|touch| REACH * touch);
        let touching =
            GraspPlan { path, posture, reach, touch, press: touch, holds_by_friction: true };
        if !touching.is_above(setup, centre, table_y) {
            return None;
        }
        if !touching.has_room(setup, object) || !self.is_free(&touching, &meetings) {
            return None;
        }
        let plan = GraspPlan { press: self.press(posture, &meetings, depth)?, ..touching };
        plan.is_above(setup, centre, table_y).then_some((score, plan))
    }

    /// Whether nothing of the hand but the tips that hold comes to the surface, as the hand opens around
    /// the object and as it touches.
    fn is_free(&self, plan: &GraspPlan, meetings: &[Meeting; 5]) -> bool {
        let centre = self.sought.object.centre();
        [REACH, 0.5 * (1.0 + REACH), 1.0].iter().all(|share| {
            let closure = plan.touch.map(|touch| share * touch);
            let angles = self.sought.setup.felt(&angles(&closure, plan.posture));
            let hand =
                pose(&self.sought.setup.dimensions, &angles, plan.path.world_from_palm(centre));
            let bodies = hand_bodies(&self.sought.setup.dimensions, &hand);
            // Beyond its knuckle's segment a finger that holds may lie along the surface.
            let holds = |position: usize| {
                position < 15 && !position.is_multiple_of(3) && meetings[position / 3].holds
            };
            let mut others = bodies.iter().enumerate().filter(|(at, _)| !holds(*at));
            others.all(|(_, body)| self.is_clear(body))
        })
    }

    /// Whether a body of the hand is outside of the surface.
    fn is_clear(&self, body: &HandBody) -> bool {
        let [from, to] = body.ends();
        let samples = 1 + (body.length / SAMPLE_WAY).ceil() as usize;
        (0..=samples).all(|k| {
            let at = from + (to - from) * (k as f64 / samples as f64);
            self.sought.surface.tree.closest(&at).distance > body.radius - ROOM
        })
    }

    /// Where thumb and fingers meet the surface; ring and little finger close along where they do not.
    fn meetings(&self, opening: &Opening) -> Option<[Meeting; 5]> {
        let fingers = &self.hand.fingers;
        let is_expected = |m: &Meeting, closure: f64| (m.closure - closure).abs() < EXPECTED;
        let middle = self.meeting(&fingers[1])?;
        let index = self.meeting(&fingers[0])?;
        let thumb = self.meeting(&self.hand.thumbs[opening.thumb].1)?;
        let closure = FINGER_CLOSURES[opening.fingers];
        if !is_expected(&middle, closure)
            || !is_expected(&index, closure)
            || !is_expected(&thumb, opening.thumb_closure)
        {
            return None;
        }
        let along = Meeting { closure: ALONG * middle.closure, holds: false, ..middle };
        let other = |finger: &TipPath| self.meeting(finger).unwrap_or(along);
        Some([thumb, index, middle, other(&fingers[2]), other(&fingers[3])])
    }

    /// First meeting of a tip with the surface along its path, if it is one that presses.
    fn meeting(&self, path: &TipPath) -> Option<Meeting> {
        let place = |tip: &Tip| self.palm * tip.sphere.centre;
        let mut step = 0;
        let mut before: Option<(usize, f64)> = None;
        while step + 1 < path.len() {
            let (tip, centre) = (&path[step], place(&path[step]));
            let closest = self.sought.surface.tree.closest(&centre);
            let gap = closest.distance - tip.sphere.radius;
            if gap > 0.0 {
                before = Some((step, gap));
                step += 1 + (gap / STEP_WAY) as usize;
                continue;
            }
            // Between the last step that was free and this one.
            let (free, free_gap) = before?;
            if free + 1 < step {
                step = free + 1;
                continue;
            }
            let share = free_gap / (free_gap - gap);
            let closure = (free as f64 + share) / STEPS as f64;
            let motion = (place(&path[step + 1]) - place(&path[free])).try_normalize(1e-9)?;
            let normal = self.sought.surface.normals[closest.triangle as usize];
            let straight = -motion.dot(&normal);
            let counts = (TOUCH_RANGE.0..TOUCH_RANGE.1).contains(&closure);
            let place = closest.point;
            return (counts && straight > STRAIGHT_MOTION_MIN).then_some(Meeting {
                closure,
                place,
                normal,
                straight,
                holds: true,
            });
        }
        None
    }

    /// How good it is to hold so; `None` where the line between thumb and fingers leaves the cones of
    /// friction.
    fn score(&self, meetings: &[Meeting; 5], gaze: &Vector3<f64>) -> Option<f64> {
        let [thumb, fingers @ ..] = meetings;
        let held: Vec<&Meeting> = fingers.iter().filter(|m| m.holds).collect();
        let count = held.len() as f64;
        let opposite =
            Point3::from(held.iter().map(|m| m.place.coords).sum::<Vector3<f64>>() / count);
        let across = (opposite - thumb.place).try_normalize(1e-9)?;
        let straight = held.iter().map(|m| m.normal.dot(&across)).fold(1.0, f64::min);
        let straight = straight.min(-thumb.normal.dot(&across));
        if straight < STRAIGHT_MIN {
            return None;
        }
        let middle = nalgebra::center(&thumb.place, &opposite);
        let motion = held.iter().map(|m| m.straight).fold(thumb.straight, f64::min);
        let early = meetings.iter().map(|m| (m.closure - 0.45).abs()).fold(0.0, f64::max);
        // Sides that face up are pressed down onto the table, and slip out of the hand.
        let facing_up = held.iter().map(|m| m.normal.y).fold(thumb.normal.y, f64::max);
        let hold = self.sought.surface.hold(&middle, &across, straight) - 2.0 * facing_up.max(0.0);
        Some(hold + motion + 0.15 * count - 0.5 * early - 0.3 * gaze.y)
    }

    /// Closures at which the tips have moved by `depth` since they met the surface.
    fn press(&self, posture: Posture, meetings: &[Meeting; 5], depth: f64) -> Option<[f64; 5]> {
        let mut press = meetings.map(|m| m.closure);
        for (digit, meeting) in meetings.iter().enumerate().filter(|(_, m)| m.holds) {
            let tip =
                |closure: f64| tips(self.sought.setup, &[closure; 5], posture)[digit].sphere.centre;
            let touching = tip(meeting.closure);
            let closed = (1..=2 * STEPS)
                .map(|step| meeting.closure + step as f64 / (4 * STEPS) as f64)
                .find(|closure| (tip(*closure) - touching).norm() >= depth);
            press[digit] = closed?;
        }
        Some(press)
    }
}
