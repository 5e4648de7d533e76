//! Tests of the scripted hand.

use super::*;
use softgrasp_core::mesh::{BuiltIn, generate};

fn cube() -> SoftObject {
    SoftObject::try_new(generate(BuiltIn::Cube, 216).unwrap()).unwrap()
}

fn hand(name: ScriptName, object: &SoftObject) -> ScriptedHand {
    ScriptedHand::try_new(name, HandSetup::default(), object).unwrap()
}

#[test]
fn hand_is_where_it_is_now_however_many_ticks_were_missed() {
    let (object, seen) = (cube(), Seen::default());
    let mut played = hand(ScriptName::Approach, &object);
    let mut missed = hand(ScriptName::Approach, &object);
    for ticks in [1, 7, 30, 20] {
        let all: Vec<Sent> = (0..ticks).map(|_| played.next(&seen, &object)).collect();
        assert!(missed.next_after(ticks, &seen, &object) == *all.last().unwrap());
    }
}

#[test]
fn hand_does_not_jump_back_in_the_last_tick_of_a_step() {
    let (object, seen) = (cube(), Seen::default());
    let mut hand = hand(ScriptName::Approach, &object);
    let mut reader = crate::hand_reader::HandReader::new(HandSetup::default());
    let mut before: Option<Isometry3<f64>> = None;
    for tick in 0..95 {
        let sent = hand.next(&seen, &object);
        let now_s = f64::from(tick) / 60.0;
        reader.feed(&sent.arrivals, now_s);
        let palm = reader.hand(now_s).unwrap().world_from_palm;
        if let Some(before) = before {
            let moved = (palm.translation.vector - before.translation.vector).norm();
            // The way back is 22 cm in 25 ticks, at most 1.5 times as fast in the middle.
            assert!(moved < 0.02, "{moved} m in tick {tick}");
        }
        before = Some(palm);
    }
}

/// An object that lies on its table, where it has sunk by a hair, counted as lost, and the hand came again.
#[test]
fn hand_that_only_approaches_an_object_with_weight_comes_once() {
    let object = cube();
    let world_from_object = Isometry3::translation(0.0, -1e-5, 0.0);
    let seen = Seen { friction: 0.8, table_force_n: 1.0, world_from_object, ..Seen::default() };
    let mut hand = hand(ScriptName::Approach, &object);
    let ticks = (0..1000).take_while(|_| !hand.next(&seen, &object).over).count();
    assert!(ticks < 120, "{ticks} ticks");
}

#[test]
fn story_of_a_large_mesh_does_not_begin_before_the_model_is_there() {
    let object = cube();
    let awaited = Seen { object_awaited: true, ..Seen::default() };
    let mut hand = hand(ScriptName::Squeeze, &object);
    let first = hand.next(&awaited, &object);
    for _ in 0..2 * REST_MAX {
        assert!(hand.next(&awaited, &object) == first, "the hand reaches for nothing");
    }
    hand.next(&Seen::default(), &object);
    // Once it reaches it does not stop on its way.
    assert!(hand.next(&awaited, &object) != first);
}

#[test]
fn squeeze_for_a_person_who_watches_takes_three_times_as_long() {
    let object = cube();
    let deforming =
        Seen { state: Some(StateName::Deforming), inside: [true; 5], ..Seen::default() };
    let ticks = |mut hand: ScriptedHand| {
        (0..1000).take_while(|_| !hand.next(&deforming, &object).over).count() as u32
    };
    let squeeze = Step::Press.ticks_max() + Step::Hold.ticks_max();
    let brief = ticks(hand(ScriptName::Squeeze, &object));
    let long = ticks(hand(ScriptName::Squeeze, &object).squeezing_longer(3));
    assert_eq!(long, brief + 2 * squeeze);
}

#[test]
fn hand_rests_and_sends_while_the_shape_is_kept_but_not_for_ever() {
    let object = cube();
    let mut hand = hand(ScriptName::Regrasp, &object);
    let (free, keeping) = (Seen::default(), Seen { keeping: true, ..Seen::default() });
    let first = hand.next(&free, &object);
    let resting: Vec<Sent> = (0..REST_MAX).map(|_| hand.next(&keeping, &object)).collect();
    assert!(resting.iter().all(|sent| !sent.arrivals.is_empty() && *sent == resting[0]));
    assert!(resting[0].arrivals == first.arrivals);
    assert!(hand.next(&keeping, &object).arrivals != first.arrivals);
}

#[test]
fn lift_comes_to_its_end_when_the_server_is_gone() {
    let object = cube();
    let mut hand = hand(ScriptName::Lift, &object);
    let late = Seen { is_late: true, is_still: true, ..Seen::default() };
    let over = (0..60 * REST_MAX).any(|_| hand.next(&late, &object).over);
    assert!(over, "the hand waits for ever");
}
