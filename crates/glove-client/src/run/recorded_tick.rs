//! What a recording keeps of a tick, in plain numbers.

use softgrasp_hand::recording::{
    AnswerSeen, EventSeen, PoseSeen, StageDigests, TickNews, TickSeen,
};

use crate::ask::digest::Digest;
use crate::pace::Due;
use crate::run::grasp_loop::GraspLoop;
use crate::run::springback::SPRINGBACK;
use crate::run::tick_outcome::TickOutcome;

/// What a tick made; the recorder adds what it took.
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

/// What happened in a tick, or while none was played, and which answers were taken.
pub fn news(outcome: &TickOutcome) -> TickNews {
    let of_ticks = outcome.answers.iter().map(|(tick, solve)| AnswerSeen {
        tick: *tick,
        method: solve.method.clone(),
        element: solve.element.to_owned(),
        residual_rel: solve.residual_rel,
        round_trip_ms: solve.round_trip_ms,
    });
    let springback = outcome.sprung_back.then(|| AnswerSeen {
        tick: SPRINGBACK,
        method: "springback".to_owned(),
        element: String::new(),
        residual_rel: 0.0,
        round_trip_ms: 0.0,
    });
    let events = outcome.events.iter().map(|event| {
        let (kind, what) = event.kind_and_words();
        EventSeen { kind, what }
    });
    TickNews {
        events: events.collect(),
        answers: of_ticks.chain(springback).collect(),
        took_work: outcome.took_work,
    }
}

/// Where hand and object are after a tick; `None` until both devices have spoken.
pub fn pose(tick: u64, grasp_loop: &GraspLoop) -> Option<PoseSeen> {
    let hand = grasp_loop.hand()?;
    let (palm, object) = (hand.world_from_palm, grasp_loop.world_from_object());
    Some(PoseSeen {
        tick,
        palm_m: palm.translation.vector.into(),
        palm_xyzw: palm.rotation.coords.into(),
        fingertips_m: hand.fingers.map(|finger| finger.tip().into()),
        object_m: object.translation.vector.into(),
        object_xyzw: object.rotation.coords.into(),
    })
}

/// Digests of a tick that has just been played.
pub fn stage_digests(grasp_loop: &GraspLoop, outcome: &TickOutcome) -> StageDigests {
    let Some(hand) = grasp_loop.hand() else { return StageDigests::default() };
    let mut pose = Digest::default();
    pose.isometry(&hand.world_from_palm);
    for segment in hand.fingers.iter().flat_map(|finger| &finger.segments) {
        pose.isometry(&segment.world_from_segment);
    }
    let mut contacts = Digest::default();
    contacts.text(&outcome.state.map_or(String::new(), |state| state.to_string()));
    for contact in grasp_loop.contacts() {
        contacts.count(contact.map_or(u64::MAX, |contact| u64::from(contact.node)));
    }
    contacts.isometry(grasp_loop.world_from_object());
    grasp_loop.shown_segments().iter().flatten().for_each(|s| contacts.isometry(s));
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
