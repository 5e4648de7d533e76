//! Hands that others recorded pick things up; skipped where the recordings are absent.

use glove_client::ask::link::Link;
use glove_client::ask::solve_settings::SolveSettings;
use glove_client::object::object_place::ObjectPlace;
use glove_client::pace::Pace;
use glove_client::pace::tick_budget::Priority;
use glove_client::run::contact_grasp::ContactScene;
use glove_client::run::grasp_loop::GraspLoop;
use nalgebra::{Isometry3, Vector3};
use serde_json::Value;
use softgrasp_core::mesh::BuiltIn;
use softgrasp_grasp::grasp::{Grasp, StateName};
use softgrasp_grasp::object::{ContactModel, SoftObject};
use softgrasp_hand::hand_reader::HandReader;
use softgrasp_hand::hand_setup::HandSetup;
use softgrasp_hand::joints::{JOINT_NAMES, WRIST};
use softgrasp_hand::sent::Sent;
use softgrasp_hand::sent::{Arrival, Device, WhichHand};
use softgrasp_tests::shared::shared;

use crate::settings::{linear_settings, sized};
use crate::start::server;

/// Positions of the 25 joints of a recorded pose, m.
fn places(poses: &Value, name: &str) -> Vec<Vector3<f64>> {
    let joints = &poses["poses"][name]["joints"];
    let place = |joint: &&str| {
        let matrix = &joints[*joint]["matrix"];
        Vector3::from_fn(|axis, _| matrix[12 + axis].as_f64().unwrap())
    };
    JOINT_NAMES[WRIST..].iter().map(place).collect()
}

/// What a ball did that a hand was to lift.
#[derive(Debug)]
struct Lifted {
    deforming_ticks: u32,
    /// Number of ticks in which it was higher than 5 cm.
    lifted_ticks: u32,
}

/// A ball between the fingers of a recorded relaxed hand, which closes most of the way to the recorded pinch
/// and goes up by 8 cm: what the ball does where the hand is seen every so many ticks. `None` where the
/// recordings are absent.
fn pinched_and_lifted(reader: HandReader, every: u64) -> Option<Lifted> {
    let folder = shared("hand")?;
    let text = std::fs::read_to_string(folder.join("webxr/iwer_hand_poses.json")).unwrap();
    let poses: Value = serde_json::from_str(&text).unwrap();
    let (relaxed, pinch) = (places(&poses, "relaxed"), places(&poses, "pinch"));
    let object = SoftObject::try_new(sized(BuiltIn::Sphere, 300, 0.04)).unwrap();
    let table_y = Some(object.rest_shape().bottom());
    let server = server(1);
    let settings = SolveSettings { contact: ContactModel::Friction, ..linear_settings() };
    let grasp = Grasp::try_new(Isometry3::identity(), Grasp::RELEASE_MARGIN_M).unwrap();
    let link = Link::start(server.address().to_string(), Priority::Ordinary).unwrap();
    let mut grasp_loop =
        GraspLoop::try_new(reader, object, grasp, link, settings, Pace::Lockstep).unwrap();
    grasp_loop.grasp_with_friction(ContactScene { table_y, ..ContactScene::default() });
    grasp_loop.put_object(ObjectPlace::Hand);
    let share = |tick: u64, from: f64, lasts: f64| {
        let t = ((tick as f64 - from) / lasts).clamp(0.0, 1.0);
        t * t * (3.0 - 2.0 * t)
    };
    let (mut lay, mut lifted) = (None, Lifted { deforming_ticks: 0, lifted_ticks: 0 });
    for tick in 0..420 {
        // The hand is measured, then closes, then goes up.
        let close = 0.7 * share(tick, 120.0, 90.0);
        let lift = 0.08 * share(tick, 240.0, 120.0);
        let joints: Vec<[f64; 3]> = relaxed
            .iter()
            .zip(&pinch)
            .map(|(a, b)| (a.lerp(b, close) + lift * Vector3::y()).into())
            .collect();
        let line = serde_json::json!({"hand": "left", "joints": joints}).to_string();
        let arrival = Arrival {
            hand: WhichHand::First,
            device: Device::Joints,
            at_s: None,
            is_datagram: true,
            bytes: format!("{line}\n").into_bytes(),
        };
        let is_seen = tick % every == 0;
        let arrivals = is_seen.then_some(arrival).into_iter().collect();
        let sent = Sent { arrivals, ..Sent::default() };
        let outcome = grasp_loop.tick(tick, tick as f64 / 60.0, &sent).unwrap();
        let height = grasp_loop.world_from_object().translation.y;
        let lay = *lay.get_or_insert(height);
        lifted.deforming_ticks += u32::from(outcome.state == Some(StateName::Deforming));
        lifted.lifted_ticks += u32::from(height - lay > 0.05);
    }
    Some(lifted)
}

#[test]
fn pinch_of_a_recorded_hand_lifts_a_ball_that_is_put_where_the_hand_closes() {
    let reader = HandReader::of_devices(HandSetup::default(), None);
    let Some(lifted) = pinched_and_lifted(reader, 1) else { return };
    assert!(lifted.deforming_ticks > 150 && lifted.lifted_ticks > 60, "{lifted:?}");
}

/// A headset on a busy machine shows the hand a few times a second: it must not let the ball go because of that.
#[test]
fn ball_does_not_slip_from_a_hand_that_is_seen_five_times_a_second() {
    for every in [4, 12] {
        let reader = HandReader::of_devices(HandSetup::default(), None).evened(1.0 / 60.0);
        let Some(lifted) = pinched_and_lifted(reader, every) else { return };
        assert!(
            lifted.deforming_ticks > 150 && lifted.lifted_ticks > 60,
            "seen every {every} ticks: {lifted:?}"
        );
    }
}
