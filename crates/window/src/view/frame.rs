//! What there is to see of one tick: the object, the hand, the grasp and the server.

use std::sync::Arc;

use nalgebra::{Isometry3, Point3, Vector3};
use softgrasp_core::fem::Material;
use softgrasp_grasp::grasp::{Contact, HandSegments, StateName};
use softgrasp_grasp::hand::{HandColliders, HandDimensions, HandPose, pose_of_segments};
use softgrasp_grasp::object::RestShape;
use softgrasp_hand::sent::SilentDevice;
use softgrasp_protocol::solve_report::SolveSummary;

use super::camera::ViewCamera;
use super::object_skin::Look;

/// One tick as the window sees it; a copy, so that the ticks go on while it is drawn.
#[derive(Clone)]
pub struct ViewFrame {
    /// Number of the tick.
    pub tick: u64,
    /// Time of the tick on the client's clock, s.
    pub at_s: f64,
    /// The object in this tick; of several that which a hand touched last.
    pub object: ObjectView,
    /// The other objects on the table; none in a run of one.
    pub others: Vec<ObjectView>,
    /// The hand; `None` until both devices have spoken.
    pub hand: Option<HandView>,
    /// The second hand; `None` in a run of one, and until its devices have spoken.
    pub second_hand: Option<HandView>,
    /// State and contacts of the grasp.
    pub grasp: GraspView,
    /// State of the server and its newest answer.
    pub server: ServerView,
    /// What the hand does by itself.
    pub acts: HandActs,
    /// News since the tick that was seen before this one, oldest first.
    pub news: Vec<News>,
    /// Times of the answers that came since the tick that was seen before this one, oldest first.
    pub timings: Vec<TickTiming>,
}

/// The object as it is in a tick.
///
/// Units: m. Frame: the object's own.
#[derive(Clone)]
pub struct ObjectView {
    /// Number of the object among those on the table, from 0.
    pub number: usize,
    /// Name, look and material of one of several objects; `None` where the run has one, whose look is that
    /// of the run.
    pub own: Option<OwnLook>,
    /// Rest shape, to which the object returns when nothing holds it.
    pub rest: Arc<RestShape>,
    /// Number of rest shapes so far; another number is another shape.
    pub rest_shapes: u64,
    /// Number of rest shapes before this one that can be gone back to.
    pub kept: usize,
    /// Displacement of every node from the rest shape.
    pub displacement: Vec<[f64; 3]>,
    /// Whether the nodes inside have their displacement too, and not only the surface.
    pub whole: bool,
    /// Pose of the object in the world.
    pub world_from_object: Isometry3<f64>,
    /// Height of the table that it can lie on, y of the world; `None` where it has no weight.
    pub table_y: Option<f64>,
}

/// Name, look and material of one of several objects.
#[derive(Clone, Debug, PartialEq)]
pub struct OwnLook {
    /// Name of a built-in object, or its file.
    pub name: Arc<str>,
    /// Look of its skin.
    pub look: Look,
    /// Material, from which stresses for the colours are computed.
    pub material: Material,
}

impl ObjectView {
    /// Positions of all vertices as they are shown.
    ///
    /// Units: m. Frame: the object's.
    pub fn shape(&self) -> Vec<Point3<f64>> {
        let rest = self.rest.mesh().vertices().iter();
        rest.zip(&self.displacement).map(|(p, u)| p + Vector3::from(*u)).collect()
    }

    /// Centre and radius of a ball around the rest shape, m, in the world frame.
    pub fn ball(&self) -> (Point3<f64>, f64) {
        let sphere = self.rest.tree().bounding_sphere();
        (self.world_from_object * sphere.centre, sphere.radius)
    }
}

/// The hand as it is shown: segments that may not enter the object stay outside it.
#[derive(Clone)]
pub struct HandView {
    /// Dimensions of the hand.
    pub dimensions: HandDimensions,
    /// Measured pose of the palm.
    pub world_from_palm: Isometry3<f64>,
    /// Poses of the segments in the world, as the grasp shows them.
    pub world_from_segment: HandSegments,
    /// Number that a sender of joints gave the record which the hand follows.
    pub record: Option<u64>,
}

impl HandView {
    /// A hand of a size in a pose.
    pub fn of_pose(dimensions: HandDimensions, pose: &HandPose) -> Self {
        Self {
            dimensions,
            world_from_palm: pose.world_from_palm,
            world_from_segment: pose
                .fingers
                .map(|finger| finger.segments.map(|segment| segment.world_from_segment)),
            record: None,
        }
    }

    /// Colliders of the hand as it is shown, in the world.
    pub fn colliders(&self) -> HandColliders {
        let pose =
            pose_of_segments(&self.dimensions, self.world_from_palm, &self.world_from_segment);
        HandColliders::new(&self.dimensions, &pose)
    }
}

/// State of the grasp and what each fingertip holds.
#[derive(Clone, Default)]
pub struct GraspView {
    /// State of the grasp after the tick.
    pub state: Option<StateName>,
    /// Whether each tip holds or touches, thumb first.
    pub tips: [bool; 5],
    /// Whether each tip of the second hand touches, thumb first.
    pub second_tips: [bool; 5],
    /// Contact that each tip holds, thumb first.
    pub contacts: [Option<Contact>; 5],
    /// Force of each tip on the object, N, object frame; `None` where none is known.
    pub forces: Option<[Vector3<f64>; 5]>,
    /// Whether the shape is being made the next rest shape.
    pub keeping: bool,
    /// Devices that are silent: the hand is held where it was.
    pub silent: Vec<SilentDevice>,
}

/// What the hand does by itself.
#[derive(Clone, Default)]
pub struct HandActs {
    /// Whether the script of the hand is over.
    pub story_is_over: bool,
    /// Whether the hand goes somewhere because a person asked for that, and takes no other wish.
    pub is_on_its_way: bool,
    /// The hand as it will squeeze the object, where it has a plan; another one when it has another.
    pub squeezing: Option<Arc<HandView>>,
    /// Number of the object that the hand goes to by itself.
    pub aimed: usize,
}

/// State of the link to the server, and of what came over it.
#[derive(Clone, Default)]
pub struct ServerView {
    /// State of the link: whether the server is there and answers in time.
    pub link: LinkHealth,
    /// Whether the server is preparing the model of a new rest shape.
    pub is_preparing: bool,
    /// Summary of the newest answer.
    pub solve: Option<SolveSummary>,
    /// Tick whose answer the object shows; `None` while it shows none of this grip.
    pub shown_tick: Option<u64>,
    /// Number of ticks that were due too late and were not played, so far.
    pub ticks_skipped: u64,
    /// Number of faults of glove and tracker, so far.
    pub device_faults: u64,
    /// What was heard of the server last, in its own words.
    pub said: Option<String>,
}

/// Whether the server is there and keeps up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LinkHealth {
    /// The server has not been reached yet, or is being looked for again.
    #[default]
    Reconnecting,
    /// The server is there, and what the object shows is as new as it can be.
    Connected,
    /// The server is there, but the object shows an answer that is more than a tick late.
    Late,
}

impl LinkHealth {
    /// Name of the state, in a word or two.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Reconnecting => "looking for the server",
            Self::Connected => "connected",
            Self::Late => "late",
        }
    }
}

/// A piece of news: something that happened in a tick.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct News {
    /// Number of the tick.
    pub tick: u64,
    /// What happened, in words.
    pub text: String,
    /// Kind of the news.
    pub kind: NewsKind,
}

/// Kind of a piece of news: what it is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NewsKind {
    /// The grasp: marked on the time line.
    Grasp,
    /// The server, or a job that was done.
    Information,
    /// A wish that cannot be carried out.
    Refusal,
}

/// Times that one answer took, stage by stage, ms.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TickTiming {
    /// Number of the tick that asked.
    pub tick: u64,
    /// From sending the request to having the answer, on the client.
    pub round_trip: f64,
    /// Time that the request waited for the server's threads.
    pub queue: f64,
    /// Time of assembling and ordering.
    pub prepare: f64,
    /// Time of the factor, or of the columns of a new grip.
    pub factor: f64,
    /// Time of solving.
    pub solve: f64,
    /// Time of decoding and encoding.
    pub codec: f64,
}

impl TickTiming {
    /// The times of an answer.
    pub fn new(tick: u64, solve: &SolveSummary) -> Self {
        let ms = &solve.report.stage_ms;
        Self {
            tick,
            round_trip: solve.round_trip_ms,
            queue: ms.queue,
            prepare: ms.assemble + ms.order,
            factor: ms.factor,
            solve: ms.solve,
            codec: ms.decode + ms.encode,
        }
    }

    /// Time of the round trip besides the server's stages: the way there and back.
    pub fn way(&self) -> f64 {
        let stages = self.queue + self.prepare + self.factor + self.solve + self.codec;
        (self.round_trip - stages).max(0.0)
    }
}

impl ViewFrame {
    /// How hard the hand grips, N: the force of the fingers against that of the thumb, half of what
    /// all fingertips exert together. `None` where no force is known, or none is felt.
    pub fn grip_newtons(&self) -> Option<f64> {
        let forces = self.grasp.forces.as_ref()?;
        let newtons = 0.5 * forces.iter().map(Vector3::norm).sum::<f64>();
        (newtons >= GRIP_LEAST_N).then_some(newtons)
    }

    /// The hands that are there.
    pub fn hands(&self) -> impl Iterator<Item = &HandView> {
        self.hand.iter().chain(&self.second_hand)
    }

    /// Positions of all vertices as they are shown.
    ///
    /// Units: m. Frame: the object's.
    pub fn shape(&self) -> Vec<Point3<f64>> {
        self.object.shape()
    }

    /// All objects on the table, that which was touched last first.
    pub fn objects(&self) -> impl Iterator<Item = &ObjectView> {
        std::iter::once(&self.object).chain(&self.others)
    }

    /// The object that the hand goes to by itself, which the eye looks at.
    pub fn aimed(&self) -> &ObjectView {
        self.objects().find(|object| object.number == self.acts.aimed).unwrap_or(&self.object)
    }

    /// Whether there is a deformed shape that can be kept.
    pub fn can_keep(&self) -> bool {
        self.grasp.state == Some(StateName::Deforming) && !self.grasp.keeping
    }

    /// Whether the object can be turned, because nothing holds it.
    pub fn can_be_turned(&self) -> bool {
        !matches!(self.grasp.state, Some(StateName::Attached | StateName::Deforming))
    }

    /// An eye that sees the hand and what it is about to grasp; `None` without a hand.
    pub fn eye_beside_hand(&self) -> Option<ViewCamera> {
        let hand = self.hands().next()?;
        let aimed = self.aimed();
        let object = aimed.world_from_object * aimed.rest.centre();
        Some(ViewCamera::beside_hand(object, &hand.world_from_palm, hand.dimensions.handedness))
    }

    /// Age in ticks of the shape that the object shows; `None` while nothing deforms it.
    pub fn answer_age_ticks(&self) -> Option<u64> {
        let deforming = self.grasp.state == Some(StateName::Deforming);
        self.server.shown_tick.filter(|_| deforming).map(|shown| self.tick.saturating_sub(shown))
    }

    /// Whether the shape is visibly older than the hand. An answer that was asked for in the last
    /// tick is as new as one can be that no tick waits for.
    pub fn answer_is_old(&self) -> bool {
        match (self.grasp.state, self.answer_age_ticks()) {
            (Some(StateName::Deforming), Some(age)) => age > 1,
            (Some(StateName::Deforming), None) => true,
            _ => false,
        }
    }

    /// Adds the news and times of an older tick that nobody saw to those of this one.
    pub fn carry_over(&mut self, unseen: Self) {
        let Self { mut news, mut timings, .. } = unseen;
        news.append(&mut self.news);
        timings.append(&mut self.timings);
        // A window that is not drawn must not let the news grow without end.
        news.drain(..news.len().saturating_sub(NEWS_MAX));
        timings.drain(..timings.len().saturating_sub(TIMINGS_MAX));
        (self.news, self.timings) = (news, timings);
    }
}

/// Most news that wait to be seen; the oldest are dropped.
const NEWS_MAX: usize = 256;
/// Smallest grip force that is shown, N: a smaller one would read 0.00 N.
const GRIP_LEAST_N: f64 = 0.005;
/// Most times of answers that wait to be seen; the oldest are dropped.
const TIMINGS_MAX: usize = 1024;

#[cfg(test)]
pub(crate) mod samples {
    //! Views of ticks for tests.

    use softgrasp_core::mesh::{BuiltIn, generate};

    use super::*;

    /// A tick with a small cube at rest.
    pub fn frame(tick: u64) -> ViewFrame {
        let rest = RestShape::try_new(generate(BuiltIn::Cube, 27).unwrap()).unwrap();
        let displacement = vec![[0.0; 3]; rest.mesh().node_count()];
        ViewFrame {
            tick,
            at_s: tick as f64 / 60.0,
            object: ObjectView {
                number: 0,
                own: None,
                rest: Arc::new(rest),
                rest_shapes: 1,
                kept: 0,
                displacement,
                whole: true,
                world_from_object: Isometry3::identity(),
                table_y: None,
            },
            others: Vec::new(),
            hand: None,
            second_hand: None,
            grasp: GraspView::default(),
            server: ServerView::default(),
            acts: HandActs::default(),
            news: Vec::new(),
            timings: Vec::new(),
        }
    }

    /// A tick with a piece of news.
    pub fn frame_with_news(tick: u64, text: &str) -> ViewFrame {
        let news = vec![News { tick, text: text.to_owned(), kind: NewsKind::Grasp }];
        ViewFrame { news, ..frame(tick) }
    }
}

#[cfg(test)]
mod tests {
    use super::samples::frame;
    use super::*;

    #[test]
    fn answer_of_the_last_tick_is_new_and_one_before_it_is_old() {
        let mut frame = frame(9);
        assert!(!frame.answer_is_old(), "nothing is deformed");
        frame.grasp.state = Some(StateName::Deforming);
        assert!(frame.answer_is_old(), "nothing is shown of this grip");
        for (shown, old) in [(9, false), (8, false), (7, true)] {
            frame.server.shown_tick = Some(shown);
            assert_eq!(frame.answer_is_old(), old, "{shown}");
        }
    }

    #[test]
    fn hand_that_touches_nothing_is_not_said_to_grip_with_0_00_newtons() {
        let mut frame = frame(9);
        for (each, told) in [(0.0, None), (1e-3, None), (0.4, Some(1.0))] {
            frame.grasp.forces = Some([Vector3::new(0.0, each, 0.0); 5]);
            assert_eq!(frame.grip_newtons(), told, "{each} N at each finger");
        }
    }

    #[test]
    fn stages_and_the_way_add_up_to_the_round_trip() {
        let report = softgrasp_protocol::SolveReport {
            stage_ms: softgrasp_protocol::StageMs {
                decode: 0.1,
                assemble: 0.2,
                order: 0.3,
                factor: 0.4,
                solve: 0.5,
                encode: 0.6,
                queue: 0.7,
            },
            ..Default::default()
        };
        let t = TickTiming::new(3, &SolveSummary::new(report, None, 5.0));
        let sum = t.way() + t.queue + t.prepare + t.factor + t.solve + t.codec;
        assert!((sum - 5.0).abs() < 1e-12 && (t.way() - 2.2).abs() < 1e-12);
    }
}
