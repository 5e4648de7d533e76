//! What the scripted hand does, step by step, and the device bytes it sends while doing it.

use std::fmt;
use std::str::FromStr;

use nalgebra::{Isometry3, Point3, Vector3};
use softgrasp_core::grasp::{Command, StateName};
use softgrasp_core::hand::Finger;

use super::approach::PalmPath;
use super::plan::{GraspPlan, Posture, angles, centre_of, plan_grasp};
use crate::hand_reader::HandSetup;
use crate::soft_object::SoftObject;

/// Which part of the story is played.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ScriptName {
    /// Reach for the object and go back.
    Approach,
    /// Touch with index, middle and ring finger, then let go.
    Attach,
    /// Grasp with five fingertips, squeeze, and hold to the end.
    Squeeze,
    /// Grasp, squeeze, and open the hand: the object springs back.
    Release,
    /// Grasp, squeeze, keep the shape, grasp again from another side, squeeze, open (thesis 4.6).
    #[default]
    Regrasp,
}

/// A name that is no script's.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no script is called '{0}'; there are approach, attach, squeeze, release and regrasp")]
pub struct UnknownScript(String);

impl FromStr for ScriptName {
    type Err = UnknownScript;

    fn from_str(name: &str) -> Result<Self, UnknownScript> {
        Ok(match name {
            "approach" => Self::Approach,
            "attach" => Self::Attach,
            "squeeze" => Self::Squeeze,
            "release" => Self::Release,
            "regrasp" => Self::Regrasp,
            _ => return Err(UnknownScript(name.to_owned())),
        })
    }
}

impl fmt::Display for ScriptName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Approach => "approach",
            Self::Attach => "attach",
            Self::Squeeze => "squeeze",
            Self::Release => "release",
            Self::Regrasp => "regrasp",
        })
    }
}

/// One thing the hand does.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Step {
    Reach,
    CloseThree,
    CloseOthers,
    Press,
    Hold,
    Keep,
    Open,
    Retreat,
    TurnToOtherSide,
}

impl Step {
    /// Ticks after which the hand goes on in any case.
    const fn ticks_max(self) -> u32 {
        match self {
            Self::Reach => 50,
            Self::CloseThree | Self::CloseOthers => 90,
            Self::Press => 50,
            Self::Hold => 15,
            Self::Keep => 1,
            Self::Open => 20,
            Self::Retreat => 25,
            Self::TurnToOtherSide => 40,
        }
    }
}

impl ScriptName {
    fn steps(self) -> Vec<Step> {
        use Step::{CloseOthers, CloseThree, Hold, Keep, Open, Press, Reach, Retreat};
        let squeeze = [Reach, CloseThree, CloseOthers, Press, Hold];
        match self {
            Self::Approach => vec![Reach, Hold, Retreat],
            Self::Attach => vec![Reach, CloseThree, Hold, Open, Retreat],
            Self::Squeeze => squeeze.to_vec(),
            Self::Release => [&squeeze[..], &[Open, Retreat]].concat(),
            Self::Regrasp => [
                &squeeze[..],
                &[Keep, Open, Retreat, Step::TurnToOtherSide],
                &squeeze[..],
                &[Open, Retreat],
            ]
            .concat(),
        }
    }
}

/// What the person behind the hand sees before moving on.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Seen {
    /// Whether each tip is inside the object, thumb first.
    pub inside: [bool; 5],
    /// State of the grasp, once there is one.
    pub state: Option<StateName>,
}

/// What the devices send in one tick, and what the person asks for.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sent {
    /// Bytes of the glove.
    pub glove: Vec<u8>,
    /// Bytes of the tracker.
    pub tracker: Vec<u8>,
    /// Menu command.
    pub command: Option<Command>,
    /// The script is over; the hand rests.
    pub over: bool,
}

/// The hand found no way to grasp.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NoGrasp {
    /// No palm pose is good.
    #[error(
        "the scripted hand found no palm pose from which all five fingertips reach this object \
         ({extent_m:.3} m long); try another --object-size"
    )]
    OutOfReach {
        /// Longest extent of the object.
        extent_m: f64,
    },
    /// Five tips need five nodes.
    #[error("the object has {nodes} surface nodes; five fingertips need five different ones")]
    TooFewNodes {
        /// Nodes on its surface.
        nodes: usize,
    },
}

/// The scripted hand.
pub struct ScriptedHand {
    setup: HandSetup,
    steps: Vec<Step>,
    at: usize,
    step_tick: u32,
    plan: GraspPlan,
    /// Where the palm came from when the hand turns to the other side.
    turned_from: PalmPath,
    closure: [f64; 5],
    closure_before: [f64; 5],
    lift: f64,
}

/// How far the hand keeps away while it is not grasping, m.
const BACK_OFF: f64 = 0.22;
/// How far the hand lifts the object while it squeezes, m.
const LIFT: f64 = 0.03;
/// Closure per tick far from and near the expected touch.
const CLOSE_FAST: f64 = 0.03;
const CLOSE_SLOW: f64 = 0.008;
/// How much further than expected a finger closes while it looks for the touch.
const CLOSE_BEYOND: f64 = 0.15;
/// A squeeze presses this share of the object's extent …
const PRESS_SHARE: f64 = 0.05;
/// … but not more than this share of the spacing of its nodes: one node pushed past its
/// neighbours would turn elements inside out.
const PRESS_SPACING_SHARE: f64 = 0.45;

impl ScriptedHand {
    /// A hand that has looked at the object and knows how to grasp it.
    ///
    /// # Errors
    /// [`NoGrasp`] if it cannot be grasped by this hand.
    pub fn try_new(
        name: ScriptName,
        setup: HandSetup,
        object: &SoftObject,
    ) -> Result<Self, NoGrasp> {
        let plan =
            plan_grasp(object, &setup, press_depth(object), None).ok_or_else(|| {
                match object.surface().nodes.len() {
                    nodes @ ..5 => NoGrasp::TooFewNodes { nodes },
                    _ => NoGrasp::OutOfReach { extent_m: object.rest().size() },
                }
            })?;
        Ok(Self {
            setup,
            steps: name.steps(),
            at: 0,
            step_tick: 0,
            plan,
            turned_from: plan.path,
            closure: [0.0; 5],
            closure_before: [0.0; 5],
            lift: 0.0,
        })
    }

    /// The plan being followed.
    pub fn plan(&self) -> &GraspPlan {
        &self.plan
    }

    /// Moves on by one tick and says what the devices send.
    pub fn next(&mut self, seen: &Seen, object: &SoftObject) -> Sent {
        let step = self.steps.get(self.at).copied();
        let mut command = None;
        if let Some(step) = step {
            if self.step_tick == 0 {
                self.begin(step, object);
            }
            self.step_tick += 1;
            if step == Step::Keep {
                command = Some(Command::KeepShape);
            }
            self.close(step, seen);
            if self.step_tick >= step.ticks_max() || is_done(step, seen) {
                self.at += 1;
                self.step_tick = 0;
            }
        }
        let world_from_palm = self.world_from_palm(step, centre_of(object));
        let joint_angles = angles(&self.closure, self.posture(step));
        let (glove, tracker) = self.setup.bytes_of(&joint_angles, &world_from_palm);
        Sent { glove, tracker, command, over: step.is_none() }
    }

    fn begin(&mut self, step: Step, object: &SoftObject) {
        self.closure_before = self.closure;
        if step == Step::TurnToOtherSide {
            self.turned_from = self.plan.path;
            let avoid = Some(self.plan.path.gaze());
            // A shape that cannot be grasped from another side is grasped from the same one.
            let depth = press_depth(object);
            let plan = plan_grasp(object, &self.setup, depth, avoid);
            let plan = plan.or_else(|| plan_grasp(object, &self.setup, depth, None));
            self.plan = plan.unwrap_or(self.plan);
        }
    }

    /// Share of the step that is over, from 0 to 1, gently at both ends.
    fn progress(&self, step: Step) -> f64 {
        let t = (f64::from(self.step_tick) / f64::from(step.ticks_max())).min(1.0);
        t * t * (3.0 - 2.0 * t)
    }

    fn close(&mut self, step: Step, seen: &Seen) {
        let progress = self.progress(step);
        let plan = self.plan;
        match step {
            Step::CloseThree => self.close_until_touch(seen, |finger| finger.attaches()),
            Step::CloseOthers => self.close_until_touch(seen, |finger| !finger.attaches()),
            Step::Press => {
                for digit in 0..5 {
                    let more = plan.press[digit] - plan.touch[digit];
                    self.closure[digit] = self.closure_before[digit] + progress * more;
                }
                self.lift = LIFT * progress;
            }
            Step::Open => {
                for digit in 0..5 {
                    self.closure[digit] = self.closure_before[digit] * (1.0 - progress);
                }
            }
            Step::TurnToOtherSide => self.lift = self.lift.min(LIFT * (1.0 - progress)),
            Step::Reach | Step::Hold | Step::Keep | Step::Retreat => {}
        }
    }

    fn close_until_touch(&mut self, seen: &Seen, moves: impl Fn(Finger) -> bool) {
        for finger in Finger::ALL.into_iter().filter(|f| moves(*f)) {
            let digit = finger.index();
            let touch = self.plan.touch[digit];
            if seen.inside[digit] {
                continue;
            }
            let speed = if self.closure[digit] < touch - 0.06 { CLOSE_FAST } else { CLOSE_SLOW };
            self.closure[digit] =
                (self.closure[digit] + speed).min((touch + CLOSE_BEYOND).min(1.0));
        }
    }

    fn posture(&self, step: Option<Step>) -> Posture {
        // The hand is set for the grasp while it is still away, and opened after it.
        let set = match step {
            Some(Step::Reach) => self.progress(Step::Reach),
            Some(Step::Retreat) => 1.0 - self.progress(Step::Retreat),
            Some(Step::TurnToOtherSide) | None => 0.0,
            Some(_) => 1.0,
        };
        Posture::OPEN.toward(&self.plan.posture, set)
    }

    fn world_from_palm(&self, step: Option<Step>, centre: Point3<f64>) -> Isometry3<f64> {
        let path = match step {
            Some(Step::Reach) => {
                self.plan.path.backed_off(BACK_OFF * (1.0 - self.progress(Step::Reach)))
            }
            Some(Step::Retreat) => {
                self.plan.path.backed_off(BACK_OFF * self.progress(Step::Retreat))
            }
            Some(Step::TurnToOtherSide) => {
                let share = self.progress(Step::TurnToOtherSide);
                self.turned_from
                    .backed_off(BACK_OFF)
                    .toward(&self.plan.path.backed_off(BACK_OFF), share)
            }
            None if self.steps.last() == Some(&Step::Retreat) => {
                self.plan.path.backed_off(BACK_OFF)
            }
            _ => self.plan.path,
        };
        path.world_from_palm(centre + Vector3::new(0.0, self.lift, 0.0))
    }
}

/// Whether the person sees that the step has done what it was for.
fn is_done(step: Step, seen: &Seen) -> bool {
    match step {
        Step::CloseThree => {
            matches!(seen.state, Some(StateName::Attached | StateName::Deforming))
        }
        Step::CloseOthers => seen.state == Some(StateName::Deforming),
        _ => false,
    }
}

/// How far a squeeze presses, m.
fn press_depth(object: &SoftObject) -> f64 {
    let mesh = object.rest();
    let edges = mesh.tets().iter().map(|t| {
        let (a, b) = (mesh.vertices()[t[0] as usize], mesh.vertices()[t[1] as usize]);
        (a - b).norm()
    });
    let spacing = edges.sum::<f64>() / mesh.tets().len() as f64;
    (PRESS_SHARE * mesh.size()).min(PRESS_SPACING_SHARE * spacing)
}
