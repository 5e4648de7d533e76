//! Content of a recording about a tick, in plain numbers.

use softgrasp_core::mesh::Surface;
use softgrasp_grasp::hand::HandPose;
use softgrasp_grasp::object::SoftObject;
use softgrasp_hand::recording::{
    AnswerSeen, EventSeen, HandSeen, PoseSeen, SPRINGBACK_REFUSED, SceneSeen, StageDigests,
    SurfaceSeen, TickNews, TickSeen,
};
use softgrasp_hand::sent::WhichHand;

use crate::ask::digest::Digest;
use crate::pace::Due;
use crate::run::grasp_loop::GraspLoop;
use crate::run::questions::SPRINGBACK;
use crate::run::tick_outcome::TickOutcome;

/// Results of a tick for a recording; the recorder adds the bytes that it used.
///
/// Units: `now_s` s on the client's clock.
pub fn tick_seen(
    due: Due,
    now_s: f64,
    grasp_loop: &GraspLoop,
    outcome: &TickOutcome,
    stages: StageDigests,
) -> TickSeen {
    TickSeen {
        tick: due.tick,
        skipped: due.skipped,
        now_s,
        state: outcome.state.map(|state| state.to_string()),
        contacts: grasp_loop.contacts().map(|contact| contact.map(|c| c.node)),
        stages,
        ..TickSeen::default()
    }
}

/// Events of a tick, or of the time without one, and the answers that were taken.
pub fn news(outcome: &TickOutcome) -> TickNews {
    let of_ticks = outcome.answers.iter().map(|(tick, solve)| AnswerSeen {
        tick: *tick,
        method: solve.report.method.clone(),
        element: solve.report.element.to_string(),
        residual_rel: solve.report.residual_rel,
        round_trip_ms: solve.round_trip_ms,
        from_rest: outcome.from_rest.contains(tick),
    });
    let springback = outcome.sprung_back.then(|| AnswerSeen {
        tick: SPRINGBACK,
        method: match outcome.springback_refused {
            true => SPRINGBACK_REFUSED.to_owned(),
            false => "springback".to_owned(),
        },
        element: String::new(),
        residual_rel: 0.0,
        round_trip_ms: 0.0,
        from_rest: false,
    });
    let events = outcome.events.iter().map(|event| {
        let (kind, what) = event.kind_and_words();
        EventSeen { kind, what }
    });
    TickNews {
        events: events.collect(),
        answers: of_ticks.chain(springback).collect(),
        took_work: outcome.took_work,
        gave_up_step: outcome.gave_up_step,
    }
}

/// Hands and object after a tick, with the object's surface if `with_surface`; `None` until the devices of
/// a hand have sent samples.
///
/// Units: `now_s` s on the client's clock.
pub fn scene(
    tick: u64,
    now_s: f64,
    grasp_loop: &GraspLoop,
    with_surface: bool,
) -> Option<SceneSeen> {
    let hands = WhichHand::ALL.map(|which| hand_seen(grasp_loop, which, now_s));
    hands.iter().any(Option::is_some).then(|| SceneSeen {
        pose: grasp_loop.hand().map(|hand| pose(tick, hand, grasp_loop)),
        hands,
        world_from_object: *grasp_loop.world_from_object(),
        surface: with_surface.then(|| surface(grasp_loop.object())),
    })
}

fn hand_seen(grasp_loop: &GraspLoop, which: WhichHand, now_s: f64) -> Option<HandSeen> {
    let (hand, _) = grasp_loop.shown_hand(which)?;
    let reader = grasp_loop.readers().of(which)?;
    let (angles, _) = reader.measured(now_s)?;
    Some(HandSeen {
        world_from_palm: hand.world_from_palm,
        world_from_segments: hand.fingers.map(|f| f.segments.map(|s| s.world_from_segment)),
        angles_rad: angles.to_array(),
        dimensions: reader.setup().dimensions,
    })
}

/// Deformed surface, with its own numbering of nodes.
fn surface(object: &SoftObject) -> SurfaceSeen {
    let Surface { nodes, triangles, .. } = object.surface();
    let place_of = |node: &u32| nodes.binary_search(node).map_or(0, |place| place as u32);
    SurfaceSeen {
        points: nodes.iter().map(|&node| object.shape()[node as usize]).collect(),
        triangles: triangles.iter().map(|t| [0, 1, 2].map(|corner| place_of(&t[corner]))).collect(),
    }
}

fn pose(tick: u64, hand: &HandPose, grasp_loop: &GraspLoop) -> PoseSeen {
    let (palm, object) = (hand.world_from_palm, grasp_loop.world_from_object());
    PoseSeen {
        tick,
        palm_m: palm.translation.vector.into(),
        palm_xyzw: palm.rotation.coords.into(),
        fingertips_m: hand.fingers.map(|finger| finger.tip().into()),
        object_m: object.translation.vector.into(),
        object_xyzw: object.rotation.coords.into(),
    }
}

/// Digests of the stages of a tick that has just been played.
pub fn stage_digests(grasp_loop: &GraspLoop, outcome: &TickOutcome) -> StageDigests {
    let hands = WhichHand::ALL.map(|which| grasp_loop.shown_hand(which));
    if hands.iter().all(Option::is_none) {
        return StageDigests::default();
    }
    let mut pose = Digest::default();
    for (hand, _) in hands.iter().flatten() {
        pose.isometry(&hand.world_from_palm);
        for segment in hand.fingers.iter().flat_map(|finger| &finger.segments) {
            pose.isometry(&segment.world_from_segment);
        }
    }
    let mut contacts = Digest::default();
    contacts.text(&outcome.state.map_or(String::new(), |state| state.to_string()));
    for contact in grasp_loop.contacts() {
        contacts.count(contact.map_or(u64::MAX, |contact| u64::from(contact.node)));
    }
    contacts.isometry(grasp_loop.world_from_object());
    for (_, shown) in hands.iter().flatten() {
        shown.iter().flatten().for_each(|segment| contacts.isometry(segment));
    }
    let mut displacement = Digest::default();
    displacement.count(grasp_loop.object().rest_shapes());
    grasp_loop.object().displacement().iter().for_each(|u| displacement.numbers(u));
    StageDigests {
        pose: pose.end(),
        contacts: contacts.end(),
        request: outcome.request_digest.clone().unwrap_or_default(),
        displacement: displacement.end(),
    }
}
