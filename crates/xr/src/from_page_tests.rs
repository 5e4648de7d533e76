//! Tests of messages that a page sends: hands, acknowledgements, wishes, and bytes that are none of them.

use proptest::prelude::*;

use super::*;

/// A hand whose joints lie on a line.
fn hand() -> Vec<u8> {
    let mut bytes = vec![JOINTS, 1, 25, 0];
    bytes.extend(7_u32.to_le_bytes());
    bytes.extend(2500_f64.to_le_bytes());
    for joint in 0..25_u8 {
        for number in [0.01 * f32::from(joint), 1.0, -0.5, 0.0, 0.0, 0.0, 1.0] {
            bytes.extend(number.to_le_bytes());
        }
    }
    bytes
}

fn put(bytes: &mut [u8], at: usize, number: f32) {
    bytes[at..at + 4].copy_from_slice(&number.to_le_bytes());
}

#[test]
fn hand_is_read_with_side_number_time_and_joints() {
    let FromPage::Joints(record) = FromPage::read(&hand()).unwrap() else { panic!("no hand") };
    assert_eq!(record.hand, Handedness::Right);
    assert_eq!((record.frame, record.time_s), (Some(7), Some(2.5)));
    assert_eq!(record.joints[0], None, "the palm is no joint of WebXR");
    let tip = record.position(WRIST + 24).unwrap();
    assert!((tip - Point3::new(0.24, 1.0, -0.5)).norm() < 1e-6);
}

#[test]
fn joint_that_is_not_tracked_is_none_and_costs_no_other() {
    let mut bytes = hand();
    put(&mut bytes, 16 + 28 * 3, f32::NAN);
    let FromPage::Joints(record) = FromPage::read(&bytes).unwrap() else { panic!("no hand") };
    assert_eq!(record.joints.iter().flatten().count(), 24);
}

#[test]
fn malformed_hands_are_refused_with_what_is_wrong() {
    let refused = |change: &dyn Fn(&mut Vec<u8>)| {
        let mut bytes = hand();
        change(&mut bytes);
        FromPage::read(&bytes).unwrap_err().to_string()
    };
    type Change = dyn Fn(&mut Vec<u8>);
    let cases: [(&Change, &str); 8] = [
        (&|b| b.clear(), "no message begins with 0"),
        (&|b| b[0] = 9, "no message begins with 9"),
        (&|b| b.truncate(300), "716 bytes, not 300"),
        (&|b| b.push(0), "716 bytes, not 717"),
        (&|b| b[1] = 2, "not 2 with 25"),
        (&|b| b[2] = 26, "not 1 with 26"),
        (&|b| put(b, 16, 1e4), "joint 0: further away"),
        (&|b| put(b, 16 + 24, 3.0), "joint 0: its orientation"),
    ];
    for (change, part) in cases {
        let told = refused(change);
        assert!(told.contains(part), "{told}");
    }
    assert!(refused(&|b| put(b, 16, f32::INFINITY)).contains("further away"));
}

#[test]
fn wishes_are_read_and_others_are_refused() {
    let read = |text| Ask::read(text);
    assert_eq!(read(r#"{"ask":"keep-shape"}"#), Ok(Ask::KeepShape));
    assert_eq!(read(r#"{"ask":"pause","stands":true}"#), Ok(Ask::Pause { stands: true }));
    let name = "a.msh".to_owned();
    assert_eq!(read(r#"{"ask":"save","name":"a.msh"}"#), Ok(Ask::Save { name }));
    for wrong in ["", "{}", "[]", r#"{"ask":"format-disk"}"#, r#"{"ask":"save"}"#] {
        assert!(read(wrong).is_err(), "{wrong}");
    }
}

proptest! {
    #[test]
    fn any_bytes_are_read_or_refused(
        kind in prop::sample::select(vec![ACK, JOINTS, 0]),
        mut bytes in prop::collection::vec(any::<u8>(), 1..JOINTS_BYTES + 2),
        whole in any::<bool>(),
    ) {
        bytes[0] = kind;
        if whole {
            bytes.resize(if kind == ACK { ACK_BYTES } else { JOINTS_BYTES }, 0);
        }
        if let Ok(FromPage::Joints(record)) = FromPage::read(&bytes) {
            let near = |s: &JointSample| s.position.coords.amax() <= RANGE_M;
            prop_assert!(record.joints.iter().flatten().all(near));
        }
        let _ = Ask::read(&String::from_utf8_lossy(&bytes));
    }
}
