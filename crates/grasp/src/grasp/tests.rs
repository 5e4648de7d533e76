//! Tests of the state machine alone: every small input, random steps, noise, single rules.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use proptest::prelude::*;

use super::event::{Command, GraspEvent, StepInput};
use super::sense::FingerInput;
use super::state::{Contact, GraspState, Hold, StateName};
use super::step::{Grasp, GraspError};
use super::table::{Case, grasp_in, transition_table};
use crate::hand::Finger;
use crate::sphere_tree::ContactHit;

const COMMANDS: [Option<Command>; 4] =
    [None, Some(Command::KeepShape), Some(Command::Release), Some(Command::ReturnHome)];

#[test]
fn transition_table_is_the_one_in_the_documentation() {
    let documented = include_str!("../../../../docs/grasp.md");
    assert!(documented.contains(&transition_table()), "put this in:\n{}", transition_table());
}

/// Every state the machine can be in, as far as the rules tell states apart.
fn all_states() -> Vec<Grasp> {
    use StateName::{Avoiding, Deforming, Detached, Free};
    let mut states: Vec<Grasp> = [Free, Avoiding, Deforming, Detached].map(grasp_in).into();
    for code in 0..3_usize.pow(5) {
        let mut grasp = grasp_in(StateName::Attached);
        if let GraspState::Attached { holds, recalled, .. } = &mut grasp.state {
            *holds = std::array::from_fn(|f| match code / 3_usize.pow(f as u32) % 3 {
                0 => Hold::Open,
                1 => Hold::Left,
                _ => Hold::Held(Contact {
                    node: f as u32,
                    tip_at_contact_in_object: Point3::origin(),
                    normal_in_object: Vector3::z(),
                }),
            });
            *recalled = holds.map(|hold| if hold == Hold::Open { 0 } else { 3 });
        }
        if holds_a_reachable_attachment(&grasp) {
            states.push(grasp);
        }
    }
    states
}

fn held(grasp: &Grasp) -> u8 {
    let set = |contacts: [bool; 5]| (0..5).map(|f| u8::from(contacts[f]) << f).sum();
    match &grasp.state {
        GraspState::Attached { holds, .. } => set(holds.map(|h| h.contact().is_some())),
        GraspState::Deforming { .. } => 0b11111,
        _ => 0,
    }
}

fn holds_a_reachable_attachment(grasp: &Grasp) -> bool {
    held(grasp) & 0b01110 != 0 && held(grasp) != 0b11111
}

/// The rules again, in sets of fingers and nothing else.
fn expected_state(grasp: &Grasp, case: &Case) -> (StateName, u8) {
    use StateName::{Attached, Avoiding, Deforming, Detached, Free};
    let name = grasp.state.name();
    let holding = matches!(name, Attached | Deforming);
    match case.command {
        Some(Command::ReturnHome) => return (Detached, 0),
        Some(Command::Release) if holding => return (Detached, 0),
        Some(Command::KeepShape) if name == Deforming => return (Detached, 0),
        _ => {}
    }
    let touching = case.inside | case.collide;
    if holding {
        let GraspState::Attached { holds, .. } = &grasp.state else {
            let now = 0b11111 & !case.out;
            return match now {
                0b11111 => (Deforming, now),
                _ if now & 0b01110 == 0 => (Detached, 0),
                _ => (Attached, now),
            };
        };
        let open: u8 = (0..5).map(|f| u8::from(holds[f] == Hold::Open) << f).sum();
        let now = held(grasp) & !case.out | open & case.inside;
        return match now {
            0b11111 => (Deforming, now),
            _ if now & 0b01110 == 0 => (Detached, 0),
            _ => (Attached, now),
        };
    }
    match name {
        Detached if touching | case.near == 0 => (Free, 0),
        Detached => (Detached, 0),
        _ if case.inside & 0b01110 == 0b01110 => (Attached, 0b01110),
        Avoiding if (touching | case.near) & 0b10 != 0 || touching != 0 => (Avoiding, 0),
        Free if touching != 0 => (Avoiding, 0),
        _ => (Free, 0),
    }
}

#[test]
fn every_state_answers_every_input_as_the_rules_in_sets_say() {
    let states = all_states();
    assert_eq!(states.len(), 4 + 3 * 3 * (27 - 8) - 1);
    let mut reached = std::collections::BTreeSet::new();
    let collisions = [(0, 0), (0, 0b11111), (0b11111, 0), (0b00010, 0b01000), (0b10000, 0)];
    for grasp in &states {
        for (inside, out) in (0..32).flat_map(|i| (0..32).map(move |o| (i, o))) {
            for ((collide, near), command) in
                collisions.into_iter().flat_map(|c| COMMANDS.map(|k| (c, k)))
            {
                let case = Case { inside, out, collide, near, command };
                let mut after = grasp.clone();
                let output = after.step(&case.input());
                let (name, now_held) = expected_state(grasp, &case);
                assert_eq!((output.state, held(&after)), (name, now_held), "{grasp:?} {case:?}");
                let entered = output.events.contains(&GraspEvent::Entered(name));
                assert_eq!(entered, name != grasp.state.name());
                assert_consistent(&after, &output);
                reached.insert((grasp.state.name(), name));
            }
        }
    }
    // 5 × 5, less those no tick can do: Free or Avoiding to Deforming, Attached to Free or
    // Avoiding, Deforming likewise, Detached to any but Free and itself.
    assert_eq!(reached.len(), 25 - 2 - 2 - 2 - 3);
}

/// What must hold after every tick that was not ignored.
fn assert_consistent(grasp: &Grasp, output: &super::StepOutput) {
    assert!(output.events.is_sorted(), "{:?}", output.events);
    assert_eq!(output.state, grasp.state.name());
    assert_eq!(output.known.is_some(), output.state == StateName::Deforming);
    if let Some(known) = &output.known {
        let mut nodes = known.map(|k| k.node);
        nodes.sort_unstable();
        assert!(nodes.is_sorted_by(|a, b| a < b), "{nodes:?}");
    }
    match &grasp.state {
        GraspState::Attached { holds, recalled, .. } => {
            let mut nodes: Vec<u32> =
                holds.iter().filter_map(|h| h.contact()).map(|c| c.node).collect();
            nodes.sort_unstable();
            assert!(nodes.is_sorted_by(|a, b| a < b), "{nodes:?}");
            assert!(holds_a_reachable_attachment(grasp));
            assert!((0..5).all(|f| holds[f].contact().is_none() || recalled[f] == 3));
        }
        GraspState::Avoiding { recalled, .. } => {
            assert!(recalled.iter().any(|&r| r > 0) && recalled.iter().all(|&r| r <= 3));
        }
        GraspState::Free { .. } | GraspState::Deforming { .. } | GraspState::Detached => {
            assert_eq!(output.recalled, [0; 5]);
        }
    }
}

fn isometry() -> impl Strategy<Value = Isometry3<f64>> {
    (prop::array::uniform3(-0.5..0.5_f64), prop::array::uniform3(-2.0..2.0_f64)).prop_map(
        |(at, turn)| {
            Isometry3::from_parts(Translation3::from(at), UnitQuaternion::new(turn.into()))
        },
    )
}

/// Fingers that touch often, on few nodes, so that they quarrel about them.
fn finger() -> impl Strategy<Value = FingerInput> {
    let hits = prop::collection::vec((0..8_u32, 0.0..0.01_f64), 0..5);
    let tip = prop::array::uniform3(-0.004..0.004_f64);
    (hits, prop::array::uniform3(0..6_u8), any::<bool>(), tip).prop_map(
        |(mut hits, collide, clear, tip)| {
            hits.sort_by(|a, b| a.1.total_cmp(&b.1));
            let mut tip_hits = [None; 5];
            for (slot, (node, distance)) in tip_hits.iter_mut().zip(hits) {
                *slot = Some(ContactHit { node, distance, normal: Vector3::y() });
            }
            FingerInput {
                segments_collide: collide.map(|c| c == 0),
                clear,
                tip_hits,
                tip_in_object: tip.into(),
            }
        },
    )
}

fn step_input() -> impl Strategy<Value = StepInput> {
    let command = prop_oneof![40 => Just(0_usize), 1 => 1..4_usize];
    (isometry(), isometry(), prop::array::uniform5(finger()), command).prop_map(
        |(world_from_palm, palm_from_finger, fingers, command)| StepInput {
            world_from_palm,
            world_from_segment: [[world_from_palm * palm_from_finger; 3]; 5],
            fingers,
            command: COMMANDS[command],
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    #[test]
    fn a_thousand_random_steps_keep_every_invariant(
        home in isometry(),
        inputs in prop::collection::vec(step_input(), 1000),
    ) {
        let mut grasp = Grasp::try_new(home, 0.003).unwrap();
        for input in &inputs {
            let before = grasp.clone();
            let pose_before = before.world_from_object(&input.world_from_palm);
            let output = grasp.step(input);
            assert_consistent(&grasp, &output);
            let homeward = output.events.iter().any(|event| {
                matches!(event, GraspEvent::ShapeKept | GraspEvent::ReturnedHome)
            });
            // The object moves with the palm while it is held, jumps only home, and else rests.
            let expected = if homeward { home } else { pose_before };
            prop_assert_eq!(output.world_from_object, expected);
            let after = grasp.world_from_object(&input.world_from_palm);
            prop_assert!((after.inverse() * expected).translation.vector.norm() < 1e-12);
        }
    }

    #[test]
    fn noise_below_the_margin_makes_no_event_in_any_state(
        start in prop::sample::select(vec![
            StateName::Free,
            StateName::Avoiding,
            StateName::Attached,
            StateName::Deforming,
            StateName::Detached,
        ]),
        ticks in prop::collection::vec((prop::array::uniform5(-0.001..0.001_f64), 0..32_u8), 300),
    ) {
        let mut grasp = grasp_in(start);
        for (noise, set) in ticks {
            // Noise lets fingers at the surface appear inside or only near, from tick to tick.
            let case = match start {
                StateName::Free => Case { near: set, ..Case::NONE },
                StateName::Avoiding | StateName::Detached => {
                    Case { collide: set & 0b11, near: 0b11111, ..Case::NONE }
                }
                StateName::Attached => {
                    Case { inside: set & 0b01110, near: 0b01110, ..Case::NONE }
                }
                StateName::Deforming => Case { inside: set, near: 0b11111, ..Case::NONE },
            };
            let mut input = case.input();
            for (finger, noise) in input.fingers.iter_mut().zip(noise) {
                finger.tip_in_object.z += noise;
            }
            let output = grasp.step(&input);
            prop_assert_eq!(output.events, vec![]);
        }
        prop_assert_eq!(grasp.state().name(), start);
    }
}

#[test]
fn a_margin_that_is_no_distance_is_refused() {
    for metres in [-1e-9, f64::INFINITY] {
        let error = Grasp::try_new(Isometry3::identity(), metres).unwrap_err();
        assert_eq!(error, GraspError::Margin { metres });
    }
    assert!(Grasp::try_new(Isometry3::identity(), f64::NAN).is_err());
}

#[test]
fn a_tick_that_is_not_finite_changes_nothing() {
    let mut grasp = grasp_in(StateName::Deforming);
    let before = grasp.clone();
    let mut inputs = vec![Case { out: 0b11111, ..Case::NONE }.input(); 3];
    inputs[0].fingers[4].tip_in_object.x = f64::NAN;
    inputs[1].world_from_palm.translation.vector.y = f64::INFINITY;
    inputs[2].world_from_segment[0][1].translation.vector.z = f64::NAN;
    inputs[2].command = Some(Command::Release);
    for input in &inputs {
        let output = grasp.step(input);
        assert_eq!(output.events[0], GraspEvent::InputIgnored);
        assert_eq!(output.known, None);
        assert_eq!(grasp, before);
    }
}

#[test]
fn displacements_count_from_each_tips_own_contact() {
    let mut grasp = grasp_in(StateName::Attached);
    let mut input = Case { inside: 0b11111, ..Case::NONE }.input();
    for (finger, depth) in input.fingers.iter_mut().zip([0.01, 0.02, 0.03, 0.04, 0.05]) {
        finger.tip_in_object.z = -depth;
    }
    let depths = |grasp: &mut Grasp, input: &StepInput| {
        grasp.step(input).known.unwrap().map(|k| -k.displacement_in_object.z)
    };
    // The three have moved since the attachment; thumb and little touch now.
    assert_eq!(depths(&mut grasp, &input), [0.0, 0.02, 0.03, 0.04, 0.0]);
    input.fingers[0].tip_in_object.z = -0.015;
    input.fingers[4].tip_in_object.z = -0.049;
    let [thumb, .., little] = depths(&mut grasp, &input);
    assert!((thumb - 0.005).abs() < 1e-15 && (little + 0.001).abs() < 1e-15);
}

#[test]
fn of_two_tips_on_one_node_the_nearer_keeps_it_and_the_other_takes_its_next() {
    let mut input = Case { inside: 0b01110, ..Case::NONE }.input();
    let hit = |node, distance| Some(ContactHit { node, distance, normal: Vector3::z() });
    input.fingers[1].tip_hits = [hit(7, 0.002), hit(8, 0.003), None, None, None];
    input.fingers[2].tip_hits = [hit(7, 0.001), hit(9, 0.004), None, None, None];
    let mut grasp = grasp_in(StateName::Free);
    let touched: Vec<_> = grasp.step(&input).events;
    assert_eq!(
        touched,
        [
            GraspEvent::TipTouched(Finger::Index, 8),
            GraspEvent::TipTouched(Finger::Middle, 7),
            GraspEvent::TipTouched(Finger::Ring, 3),
            GraspEvent::Entered(StateName::Attached),
        ]
    );
    // Without a next one the finger is refused, and two fingers do not attach.
    input.fingers[1].tip_hits = [hit(7, 0.002), None, None, None, None];
    let mut grasp = grasp_in(StateName::Free);
    assert_eq!(grasp.step(&input).state, StateName::Avoiding);
}

#[test]
fn a_tip_that_left_while_still_inside_must_come_out_before_it_touches_again() {
    let mut grasp = grasp_in(StateName::Deforming);
    let left = Case { inside: 0b11111, out: 0b00001, ..Case::NONE };
    assert_eq!(grasp.step(&left.input()).state, StateName::Attached);
    assert_eq!(grasp.step(&left.input()).events, []);
    let outside = Case { inside: 0b11110, ..left };
    assert_eq!(grasp.step(&outside.input()).events, []);
    let again = grasp.step(&left.input()).events;
    assert_eq!(
        again,
        [GraspEvent::TipTouched(Finger::Thumb, 0), GraspEvent::Entered(StateName::Deforming)]
    );
}

#[test]
fn a_colliding_segment_takes_the_lower_ones_to_their_last_free_pose() {
    let at = |x: f64| Isometry3::translation(x, 0.0, 0.0);
    let mut grasp = grasp_in(StateName::Free);
    let mut input = Case::NONE.input();
    input.world_from_segment = [[at(1.0); 3]; 5];
    grasp.step(&input);
    let mut input = Case { collide: 0b00100, ..Case::NONE }.input();
    input.world_from_segment = [[at(2.0); 3]; 5];
    let output = grasp.step(&input);
    assert_eq!(output.recalled, [0, 0, 2, 0, 0]);
    assert_eq!(output.world_from_segment[2], [at(1.0), at(1.0), at(2.0)]);
    assert_eq!(output.world_from_segment[1], [at(2.0); 3]);

    // Near the surface it stays recalled; clear of it, it is free again.
    let mut input = Case { near: 0b00100, ..Case::NONE }.input();
    input.world_from_segment = [[at(3.0); 3]; 5];
    assert_eq!(grasp.step(&input).recalled, [0, 0, 2, 0, 0]);
    input.fingers[2].clear = true;
    assert_eq!(grasp.step(&input).world_from_segment[2], [at(3.0); 3]);
}

#[test]
fn recalled_fingers_travel_with_the_attached_object() {
    let mut grasp = grasp_in(StateName::Attached);
    let mut input = Case { inside: 0b01110, ..Case::NONE }.input();
    input.world_from_palm = Isometry3::translation(0.0, 0.5, 0.0);
    input.world_from_segment = [[Isometry3::translation(0.0, 0.6, 0.0); 3]; 5];
    let output = grasp.step(&input);
    assert_eq!(output.recalled, [0, 3, 3, 3, 0]);
    assert_eq!(output.world_from_object, input.world_from_palm);
    assert_eq!(output.world_from_segment[1], [input.world_from_palm; 3]);
    assert_eq!(output.world_from_segment[0], input.world_from_segment[0]);
}
