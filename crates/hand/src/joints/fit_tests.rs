//! Tests of the fit: hands that are known, noise, joints that are not tracked, jumps.

use nalgebra::{Point3, Vector3};
use proptest::prelude::*;
use softgrasp_grasp::hand::{ANGLE_COUNT, Finger, HandPose, pose};

use super::*;
use crate::joints::places::record_of_hand;
use crate::joints::record::{JOINT_COUNT, PALM, WRIST, digit_joints};
use crate::joints::{JointsEvent, JointsParser};

/// Angles anywhere within the limits of the fit.
fn any_angles() -> impl Strategy<Value = JointAngles> {
    prop::array::uniform23(0.0..1.0f64).prop_map(|shares| {
        let limits = AngleLimits::default();
        let mut angles = [0.0; ANGLE_COUNT];
        for (slot, share) in shares.into_iter().enumerate() {
            angles[slot] = limits.low[slot] + share * (limits.high[slot] - limits.low[slot]);
        }
        JointAngles::from_array(&angles)
    })
}

/// Any place and any turn, half turns and full ones among them.
fn any_palm() -> impl Strategy<Value = Isometry3<f64>> {
    let triple = |most: f64| prop::array::uniform3(-most..most);
    (triple(2.0), triple(4.0)).prop_map(|(shift, turn)| Isometry3::new(shift.into(), turn.into()))
}

fn hand_of(left: bool) -> HandDimensions {
    let side = if left { Handedness::Left } else { Handedness::Right };
    HandDimensions::default().with_handedness(side)
}

fn posed(hand: &HandDimensions, fitted: &FittedHand) -> HandPose {
    pose(hand, &fitted.angles, fitted.world_from_palm)
}

/// Largest distance between fingertips of two hands, m.
fn tip_error(a: &HandPose, b: &HandPose) -> f64 {
    let tips = a.fingers.iter().zip(&b.fingers);
    tips.map(|(a, b)| (a.tip() - b.tip()).norm()).fold(0.0, f64::max)
}

/// Largest distance between joints that both records have, m.
fn joint_error(a: &JointsRecord, b: &JointsRecord) -> f64 {
    let pairs = (0..JOINT_COUNT).filter_map(|j| Some((a.position(j)?, b.position(j)?)));
    pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

/// Numbers with mean 0 and deviation 1, the same for the same seed (sum of twelve uniform ones).
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        let uniform = || {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (self.0 >> 11) as f64 / (1u64 << 53) as f64
        };
        std::iter::repeat_with(uniform).take(12).sum::<f64>() - 6.0
    }

    fn added_to(&mut self, record: &JointsRecord, deviation_m: f64) -> JointsRecord {
        let mut noisy = *record;
        for joint in noisy.joints.iter_mut().flatten() {
            joint.position += Vector3::from_fn(|_, _| self.next()) * deviation_m;
        }
        noisy
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn a_hand_comes_back_from_its_joints(
        angles in any_angles(), world_from_palm in any_palm(), left in any::<bool>(),
        webxr in any::<bool>(),
    ) {
        let hand = hand_of(left);
        let record = record_of_hand(&hand, &angles, &world_from_palm);
        let line = if webxr { record.to_webxr_line() } else { record.to_line() };
        let mut parser = JointsParser::new();
        let mut events = Vec::new();
        parser.feed_all(line.as_bytes(), |event| events.push(event));
        let [JointsEvent::Record(read)] = &events[..] else { panic!("{events:?}") };
        let mut fit = HandFit::new(hand);
        let fitted = fit.fit(read).unwrap();
        let again = record_of_hand(&hand, &fitted.angles, &fitted.world_from_palm);
        prop_assert!(joint_error(&record, &again) < 1e-6, "{fitted:?}");
        prop_assert!(fitted.fit_error_max_m < 1e-6);
        prop_assert_eq!(fitted.joints_used, 21);
        let truth = pose(&hand, &angles, world_from_palm);
        prop_assert!(tip_error(&truth, &posed(&hand, &fitted)) < 1e-6);
    }

    #[test]
    fn noise_of_a_millimetre_moves_fingertips_by_about_that(
        angles in any_angles(), world_from_palm in any_palm(), left in any::<bool>(),
        seed in any::<u64>(),
    ) {
        let hand = hand_of(left);
        let record = record_of_hand(&hand, &angles, &world_from_palm);
        let noisy = Noise(seed).added_to(&record, 1e-3);
        let fitted = HandFit::new(hand).fit(&noisy).unwrap();
        let truth = pose(&hand, &angles, world_from_palm);
        let found = posed(&hand, &fitted);
        // A noisy fingertip itself is 1.7 mm away in the mean.
        let tips = truth.fingers.iter().zip(&found.fingers);
        let squares: f64 = tips.map(|(a, b)| (a.tip() - b.tip()).norm_squared()).sum();
        prop_assert!((squares / 5.0).sqrt() < 3.5e-3);
        prop_assert!(tip_error(&truth, &found) < 8e-3);
        prop_assert!(fitted.fit_error_rms_m < 2.5e-3);
    }

    #[test]
    fn digits_that_are_not_tracked_cost_nothing_but_themselves(
        angles in any_angles(), world_from_palm in any_palm(), left in any::<bool>(),
        lost in prop::array::uniform5(any::<bool>()), wrist_is_lost in any::<bool>(),
    ) {
        let hand = hand_of(left);
        let whole = record_of_hand(&hand, &angles, &world_from_palm);
        let mut record = whole;
        for (finger, _) in Finger::ALL.into_iter().zip(lost).filter(|(_, is_lost)| *is_lost) {
            for joint in digit_joints(finger) {
                record.joints[joint] = None;
            }
        }
        if wrist_is_lost {
            record.joints[WRIST] = None;
        }
        let knuckles = lost[1..].iter().filter(|is_lost| !**is_lost).count();
        let beside = usize::from(!wrist_is_lost) + usize::from(!lost[0]);
        let fitted = HandFit::new(hand).fit(&record);
        prop_assert_eq!(fitted.is_ok(), beside > 0 && knuckles + beside >= 3);
        let Ok(fitted) = fitted else { return Ok(()) };
        // One or two knuckles hardly tell the palm's turn from its arch: once in some thousand
        // hands the fit ends beside the joints.
        let bound = if knuckles > 2 { 1e-6 } else { 0.03 };
        prop_assert!(fitted.fit_error_max_m < bound, "{fitted:?}");
        let digits = lost.iter().filter(|is_lost| !**is_lost).count();
        prop_assert_eq!(fitted.joints_used, 4 * digits + usize::from(!wrist_is_lost));
    }

    #[test]
    fn the_next_fit_begins_at_the_last_and_ends_where_a_cold_one_ends(
        angles in any_angles(), other in any_angles(), world_from_palm in any_palm(),
        shift in prop::array::uniform3(-0.1..0.1f64), turn in prop::array::uniform3(-0.3..0.3f64),
        left in any::<bool>(),
    ) {
        let hand = hand_of(left);
        let mut fit = HandFit::new(hand);
        fit.fit(&record_of_hand(&hand, &angles, &world_from_palm)).unwrap();
        let next_angles = angles.lerp(&other, 0.1);
        let next_palm = Isometry3::new(shift.into(), turn.into()) * world_from_palm;
        let next = record_of_hand(&hand, &next_angles, &next_palm);
        let warm = fit.fit(&next).unwrap();
        prop_assert!(warm.fit_error_max_m < 1e-6, "{warm:?}");
        let truth = pose(&hand, &next_angles, next_palm);
        prop_assert!(tip_error(&truth, &posed(&hand, &warm)) < 1e-6);
    }
}

/// Single joints inside a digit may be missing; then an angle may be found on the wrong side of a
/// limit, and seldom is.
#[test]
fn hands_with_a_quarter_of_their_joints_lost_are_nearly_always_found() {
    let limits = AngleLimits::default();
    let mut noise = Noise(11);
    let (mut fits, mut found, mut worst) = (0, 0, 0.0_f64);
    for i in 0..2000 {
        let hand = hand_of(i % 2 == 0);
        let mut angles = [0.0; ANGLE_COUNT];
        for (slot, angle) in angles.iter_mut().enumerate() {
            let share = 0.5 + 0.25 * noise.next();
            *angle = limits.low[slot] + share * (limits.high[slot] - limits.low[slot]);
        }
        let angles = limits.clamp(&JointAngles::from_array(&angles));
        let mut record = record_of_hand(&hand, &angles, &Isometry3::identity());
        for joint in &mut record.joints {
            if noise.next() > 0.67 {
                *joint = None;
            }
        }
        let Ok(fitted) = HandFit::new(hand).fit(&record) else { continue };
        fits += 1;
        found += usize::from(fitted.fit_error_max_m < 1e-4);
        worst = worst.max(fitted.fit_error_rms_m);
    }
    println!("lost joints: {found} of {fits} found, the worst {:.1} mm rms", 1e3 * worst);
    assert!(fits > 1700 && found as f64 > 0.95 * fits as f64, "{found} of {fits}");
    assert!(worst < 3e-3, "{worst}");
}

/// A hand that closes and opens while it moves, and loses a finger on the way.
fn grasping(hand: &HandDimensions, frames: usize) -> Vec<JointsRecord> {
    let mut noise = Noise(7);
    let record = |frame: usize| {
        let t = frame as f64 / 60.0;
        let closed = 0.5 - 0.5 * (2.0 * t).cos();
        let angles = JointAngles::flat().lerp(&JointAngles::fist(), closed);
        let turn = Vector3::new(0.3, 0.5 * t, 0.1);
        let palm = Isometry3::new(Vector3::new(0.2 * t.sin(), 0.1, 0.3), turn);
        let mut record = noise.added_to(&record_of_hand(hand, &angles, &palm), 5e-4);
        if (40..60).contains(&frame) {
            for joint in digit_joints(Finger::Ring) {
                record.joints[joint] = None;
            }
        }
        record
    };
    (0..frames).map(record).collect()
}

#[test]
fn the_same_records_give_the_same_bits() {
    for left in [false, true] {
        let hand = hand_of(left);
        let records = grasping(&hand, 90);
        let run = || {
            let mut fit = HandFit::new(hand);
            records.iter().map(|record| fit.fit(record).unwrap()).collect::<Vec<_>>()
        };
        let (first, second) = (run(), run());
        assert_eq!(first, second);
        let bits = |fitted: &FittedHand| fitted.angles.to_array().map(f64::to_bits);
        assert!(first.iter().zip(&second).all(|(a, b)| bits(a) == bits(b)));
    }
}

#[test]
fn a_fit_depends_on_the_last_one_only() {
    let hand = hand_of(false);
    let records = grasping(&hand, 30);
    let mut long = HandFit::new(hand);
    for record in &records[..29] {
        long.fit(record).unwrap();
    }
    let mut short = HandFit { last: long.last, ..HandFit::new(hand) };
    assert_eq!(long.fit(&records[29]), short.fit(&records[29]));
}

#[test]
fn warm_fits_take_few_steps_and_lost_joints_hold_their_angles() {
    let hand = hand_of(true);
    let mut fit = HandFit::new(hand);
    let mut steps = Vec::new();
    let mut ring_before = None;
    let started = softgrasp_os::thread_cpu_time();
    for (frame, record) in grasping(&hand, 200).iter().enumerate() {
        let fitted = fit.fit(record).unwrap();
        assert!(fitted.fit_error_rms_m < 1.2e-3, "{frame}: {fitted:?}");
        if frame > 0 && frame != 60 {
            assert!(fitted.is_warm, "{frame}: {fitted:?}");
            steps.push(fitted.iterations);
        }
        let ring = fitted.angles.ring.pip_flexion;
        if (40..60).contains(&frame) {
            assert_eq!(ring_before, Some(ring), "{frame}");
        }
        ring_before = Some(ring);
    }
    let mean = steps.iter().sum::<usize>() as f64 / steps.len() as f64;
    let most = steps.iter().max().unwrap();
    if let (Some(started), Some(ended)) = (started, softgrasp_os::thread_cpu_time()) {
        let each = (ended - started) / 200;
        println!("warm fits: {mean:.1} steps, at most {most}; {each:?} each in this build");
    }
    assert!(mean < 8.0 && *most <= 20, "{steps:?}");
}

#[test]
fn a_hand_that_was_lost_and_found_elsewhere_begins_anew() {
    let hand = hand_of(false);
    let open = record_of_hand(&hand, &JointAngles::flat(), &Isometry3::identity());
    let elsewhere = Isometry3::new(Vector3::new(1.0, 0.4, -0.3), Vector3::new(0.0, 3.0, 0.0));
    let fist = record_of_hand(&hand, &JointAngles::fist(), &elsewhere);
    let mut fit = HandFit::new(hand);
    assert!(!fit.fit(&open).unwrap().is_warm);
    assert!(fit.fit(&open).unwrap().is_warm);
    let jumped = fit.fit(&fist).unwrap();
    assert!(!jumped.is_warm && jumped.fit_error_max_m < 1e-6, "{jumped:?}");
    assert_eq!(jumped, HandFit::new(hand).fit(&fist).unwrap());
    fit.forget();
    assert!(fit.last().is_none() && !fit.fit(&fist).unwrap().is_warm);
}

#[test]
fn quarter_and_half_turns_about_every_axis_are_fitted() {
    let hand = hand_of(false);
    let mut fit = HandFit::new(hand);
    for axis in [Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()] {
        for quarters in 0..4 {
            let turn = axis.into_inner() * (f64::from(quarters) * std::f64::consts::FRAC_PI_2);
            let palm = Isometry3::new(Vector3::new(0.1, 0.2, 0.3), turn);
            let fitted = fit.fit(&record_of_hand(&hand, &JointAngles::fist(), &palm)).unwrap();
            assert!(fitted.world_from_palm.rotation.angle_to(&palm.rotation) < 1e-5);
            assert!(fitted.fit_error_max_m < 1e-6, "{axis:?} {quarters}: {fitted:?}");
        }
    }
}

#[test]
fn a_palm_that_is_not_determined_is_an_error_and_keeps_the_last_fit() {
    let hand = hand_of(false);
    let whole = record_of_hand(&hand, &JointAngles::fist(), &Isometry3::identity());
    let mut fit = HandFit::new(hand);
    let fitted = fit.fit(&whole).unwrap();
    let mut knuckles_only = whole;
    (knuckles_only.joints[WRIST], knuckles_only.joints[2]) = (None, None);
    let mut two = JointsRecord::empty(hand.handedness);
    (two.joints[WRIST], two.joints[7], two.joints[PALM]) =
        (whole.joints[WRIST], whole.joints[7], whole.joints[PALM]);
    for (record, count) in [(knuckles_only, 4), (two, 2), (JointsRecord::empty(hand.handedness), 0)]
    {
        match fit.fit(&record) {
            Err(FitError::NotEnoughJoints { tracked, .. }) => assert_eq!(tracked, count),
            other => panic!("{other:?}"),
        }
    }
    let left = record_of_hand(&hand_of(true), &JointAngles::fist(), &Isometry3::identity());
    assert!(matches!(fit.fit(&left), Err(FitError::OtherHand { .. })));
    assert_eq!(fit.last(), Some(&fitted));
}

#[test]
fn hostile_places_give_finite_hands() {
    let hand = hand_of(false);
    for scale in [0.0, 1e-9, 1.0, 100.0] {
        let mut noise = Noise(3);
        let mut record = JointsRecord::empty(hand.handedness);
        for joint in &mut record.joints {
            let place = Vector3::from_fn(|_, _| (noise.next() * scale).clamp(-100.0, 100.0));
            *joint = Some(crate::joints::JointSample::at(Point3::from(place)));
        }
        let mut fit = HandFit::new(hand);
        for _ in 0..3 {
            if let Ok(fitted) = fit.fit(&record) {
                assert!(fitted.angles.to_array().iter().all(|angle| angle.is_finite()));
                assert!(fitted.world_from_palm.translation.vector.amax() < 200.0);
            }
        }
    }
}
