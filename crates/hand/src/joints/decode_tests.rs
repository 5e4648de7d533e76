//! Tests of the JSON line: every form of a joint, every fault.

use super::*;

/// A line whose joints are `count` times `other`, except the first, which is `first`.
fn line(first: &str, other: &str, count: usize) -> String {
    let mut entries = vec![other; count];
    entries[0] = first;
    format!("{{\"joints\":[{}]}}", entries.join(","))
}

fn decode(text: &str) -> Result<JointsRecord, JointsFaultKind> {
    decode_line(text.as_bytes())
}

fn first_joint(text: &str) -> Option<JointSample> {
    decode(&line(text, "null", JOINT_COUNT)).unwrap().joints[0]
}

fn fault(first: &str) -> JointsFaultKind {
    decode(&line(first, "null", WEBXR_JOINT_COUNT)).unwrap_err()
}

#[test]
fn every_form_of_a_joint_gives_the_same_place() {
    let place = Point3::new(0.25, 1.5, -0.5);
    // A quarter turn about Y takes X to −Z and Z to X.
    let quarter =
        UnitQuaternion::from_axis_angle(&nalgebra::Vector3::y_axis(), std::f64::consts::FRAC_PI_2);
    let h = std::f64::consts::FRAC_1_SQRT_2;
    assert_eq!(first_joint("[0.25,1.5,-0.5]").unwrap(), JointSample::at(place));
    let forms = [
        format!("[0.25,1.5,-0.5,0,{h},0,{h}]"),
        "[0,0,-1,0, 0,1,0,0, 1,0,0,0, 0.25,1.5,-0.5,1]".to_owned(),
        format!("{{\"position\":[0.25,1.5,-0.5],\"orientation\":[0,{h},0,{h}],\"radius\":0.01}}"),
    ];
    for form in forms {
        let joint = first_joint(&form).unwrap();
        assert_eq!(joint.position, place, "{form}");
        assert!(joint.orientation.unwrap().angle_to(&quarter) < 1e-7, "{form}");
        assert_eq!(joint.radius_m, form.contains("radius").then_some(0.01));
    }
}

#[test]
fn joints_that_are_not_tracked_have_many_forms() {
    let nan_matrix = format!("[{}]", ["null"; 16].join(","));
    for form in
        ["null", "{}", "{\"position\":null,\"radius\":null}", "[null,null,null]", &nan_matrix]
    {
        assert_eq!(first_joint(form), None, "{form}");
    }
}

#[test]
fn a_list_without_the_palm_begins_at_the_wrist() {
    let record = decode(&line("[1,2,3]", "null", WEBXR_JOINT_COUNT)).unwrap();
    assert_eq!(record.joints[0], None);
    assert_eq!(record.position(1), Some(Point3::new(1.0, 2.0, 3.0)));
}

#[test]
fn other_fields_are_read_or_passed_over() {
    let joints = vec!["null"; JOINT_COUNT].join(",");
    let text = format!(
        " {{\"frame\":12,\"app\":{{\"a\":[1]}},\"joints\":[{joints}],\"time\":1.5,\
         \"hand\":\"left\"}}\r"
    );
    let record = decode(&text).unwrap();
    assert_eq!((record.hand, record.time_s, record.frame), (Handedness::Left, Some(1.5), Some(12)));
    assert_eq!(decode(&line("null", "null", 26)).unwrap().hand, Handedness::Right);
}

#[test]
fn what_is_wrong_with_a_joint_is_named() {
    for (form, kind) in [
        ("[1,2]", JointsFaultKind::EntryLength { entry: 0, got: 2 }),
        ("[1,2,3,4,5,6]", JointsFaultKind::EntryLength { entry: 0, got: 6 }),
        ("[]", JointsFaultKind::EntryLength { entry: 0, got: 0 }),
        ("[null]", JointsFaultKind::EntryLength { entry: 0, got: 1 }),
        ("[1,2,101]", JointsFaultKind::Range { entry: 0 }),
        ("[1,-1e300,1]", JointsFaultKind::Range { entry: 0 }),
        ("[1,1,1,0,0,0,0]", JointsFaultKind::Orientation { entry: 0 }),
        ("[1,1,1,1e300,0,0,1e300]", JointsFaultKind::Orientation { entry: 0 }),
        ("{\"position\":[1,1,1],\"radius\":-0.1}", JointsFaultKind::Radius { entry: 0 }),
        ("[1,0,0,0,0,1,0,0,0,0,-1,0,0,0,0,1]", JointsFaultKind::Matrix { entry: 0 }),
        ("[1,0,0,0,0,1,0,0,0,0,1,1,0,0,0,1]", JointsFaultKind::Matrix { entry: 0 }),
        ("[2,0,0,0,0,1,0,0,0,0,0.5,0,0,0,0,1]", JointsFaultKind::Matrix { entry: 0 }),
    ] {
        assert_eq!(fault(form), kind, "{form}");
    }
    let long = format!("[{}]", ["0"; 100].join(","));
    assert_eq!(fault(&long), JointsFaultKind::EntryLength { entry: 0, got: 100 });
}

#[test]
fn what_is_wrong_with_a_line_is_named() {
    for count in [1, 21, 24, 27, 4000] {
        let text = line("null", "null", count);
        assert_eq!(decode(&text).unwrap_err(), JointsFaultKind::JointCount { got: count });
    }
    for text in ["{", "joints", "{\"joints\":[1e999]}", "\u{feff}{}", "{} {}", "[[[["] {
        let kind = decode(text).unwrap_err();
        let is_named =
            matches!(kind, JointsFaultKind::NotJson { .. } | JointsFaultKind::NotARecord { .. });
        assert!(is_named, "{text}: {kind:?}");
    }
    let joints = vec!["null"; JOINT_COUNT].join(",");
    for fields in [
        "\"hand\":\"both\"",
        "\"hand\":3",
        "\"time\":\"now\"",
        "\"frame\":-1",
        "\"frame\":1,\"frame\":2",
    ] {
        let kind = decode(&format!("{{{fields},\"joints\":[{joints}]}}")).unwrap_err();
        assert!(matches!(kind, JointsFaultKind::NotARecord { .. }), "{fields}: {kind:?}");
    }
    for text in ["{}", "3", "{\"joints\":7}", "{\"joints\":[true]}", "{\"joints\":[[\"x\"]]}"] {
        let kind = decode(text).unwrap_err();
        assert!(matches!(kind, JointsFaultKind::NotARecord { .. }), "{text}: {kind:?}");
    }
}

#[test]
fn a_reason_is_short_and_printable() {
    let text = format!("\\u001b[31m{}", "x".repeat(5000));
    let joints = vec!["null"; JOINT_COUNT].join(",");
    let kind = decode(&format!("{{\"time\":\"{text}\",\"joints\":[{joints}]}}")).unwrap_err();
    let JointsFaultKind::NotARecord { reason } = kind else { panic!("{kind:?}") };
    assert!(reason.len() <= REASON_MAX && reason.bytes().all(|b| (32..127).contains(&b)));
}
