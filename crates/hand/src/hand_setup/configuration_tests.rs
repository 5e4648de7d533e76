//! The file of a hand: round trips, the example of the documentation, refused texts.

use nalgebra::{Isometry3, Vector3};
use proptest::prelude::*;

use super::super::{GloveMode, Hemisphere};
use super::*;
use crate::devices::calibration::{Calibration, CalibrationHeader, toml_text, virtual_hand_text};
use crate::devices::fastrak::FastrakFormat;

/// Everything that the file says, to compare two configurations.
fn said(c: &HandConfiguration) -> impl PartialEq + std::fmt::Debug + use<> {
    let setup = &c.setup;
    let poses = (setup.mount, setup.world_from_stand);
    let devices = (setup.sensors, setup.tracker, c.glove, c.tracker);
    (setup.dimensions, devices, poses, c.calibration_file.clone(), setup.calibration.hand)
}

fn any_pose(reach: f64) -> impl Strategy<Value = Isometry3<f64>> {
    (prop::array::uniform3(-reach..reach), prop::array::uniform3(-3.0..3.0f64))
        .prop_map(|(shift, turn)| Isometry3::new(shift.into(), turn.into()))
}

proptest! {
    #[test]
    fn a_configuration_survives_its_text(
        size in (0.15..0.22f64, 0.07..0.1f64, any::<bool>()),
        poses in (any_pose(0.2), any_pose(5.0), any::<bool>()),
        choices in (0..GLOVE_BAUDS.len(), 0..TRACKER_BAUDS.len(), 1..=4u8, 0..6usize),
        words in prop::array::uniform5(any::<bool>()),
        path in prop::option::of("[a-zäöü \"'\\\\]{1,12}\\.cal"),
    ) {
        let hand = if size.2 { Handedness::Left } else { Handedness::Right };
        let [streamed, text, angles, inches, eighteen] = words;
        let mut configuration = HandConfiguration::default();
        configuration.setup.dimensions =
            HandDimensions::scaled(size.0, size.1).unwrap().with_handedness(hand);
        configuration.setup.calibration.hand = hand;
        configuration.setup.mount = match poses.2 {
            true => ReceiverMount::Hand { receiver_from_palm: poses.0 },
            false => ReceiverMount::Forearm { receiver_from_forearm: poses.0 },
        };
        configuration.setup.world_from_stand = poses.1;
        if eighteen {
            configuration.setup.sensors = SensorCount::Eighteen;
        }
        configuration.setup.tracker = FastrakFormat {
            encoding: if text { Encoding::Ascii } else { Encoding::Binary },
            output: if angles { OutputList::PositionEuler } else { OutputList::PositionQuaternion },
            units: if inches { LengthUnit::Inches } else { LengthUnit::Centimetres },
        };
        configuration.glove = GloveLine {
            baud: GLOVE_BAUDS[choices.0],
            mode: if streamed { GloveMode::Streamed } else { GloveMode::Polled },
        };
        configuration.tracker = TrackerLine {
            baud: TRACKER_BAUDS[choices.1],
            station: Station::try_new(choices.2).unwrap(),
            hemisphere: [
                Hemisphere::Forward, Hemisphere::Back, Hemisphere::Right,
                Hemisphere::Left, Hemisphere::Lower, Hemisphere::Upper,
            ][choices.3],
        };
        configuration.calibration_file = path.map(PathBuf::from);
        let back = HandConfiguration::read(&configuration.to_text()).unwrap();
        // A quaternion whose length is 1 up to rounding may be rounded once more.
        let near = |a: &Isometry3<f64>, b: &Isometry3<f64>| {
            a.translation == b.translation && (a.rotation.coords - b.rotation.coords).norm() < 1e-15
        };
        let pose = |c: &HandConfiguration| match c.setup.mount {
            ReceiverMount::Hand { receiver_from_palm: p }
            | ReceiverMount::Forearm { receiver_from_forearm: p } => p,
        };
        prop_assert!(near(&pose(&back), &pose(&configuration)));
        prop_assert!(near(&back.setup.world_from_stand, &configuration.setup.world_from_stand));
        let mut same = back;
        same.setup.mount = configuration.setup.mount;
        same.setup.world_from_stand = configuration.setup.world_from_stand;
        prop_assert_eq!(said(&same), said(&configuration));
    }

    #[test]
    fn damaged_texts_are_read_or_refused(
        place in any::<prop::sample::Index>(), byte in any::<u8>(),
    ) {
        let mut bytes = HandConfiguration::default().to_text().into_bytes();
        let place = place.index(bytes.len());
        bytes[place] = byte;
        if let Ok(read) = HandConfiguration::read(&String::from_utf8_lossy(&bytes)) {
            prop_assert!(HandConfiguration::read(&read.to_text()).is_ok());
        }
    }
}

/// The example of `docs/devices.md`.
fn documented() -> String {
    let page = include_str!("../../../../docs/devices.md");
    let start = page.find("```toml\n# hand.toml").expect("the page has an example") + 8;
    page[start..].split("```").next().unwrap().to_owned()
}

#[test]
fn the_documented_example_is_the_default_hand() {
    let mut example = HandConfiguration::read(&documented()).unwrap();
    assert_eq!(example.calibration_file.take(), Some(PathBuf::from("me.cal")));
    let default = HandConfiguration::default();
    let pose = |c: &HandConfiguration| {
        c.setup.mount.world_from_palm(
            &Isometry3::identity(),
            &softgrasp_grasp::hand::JointAngles::flat(),
            Handedness::Right,
        )
    };
    let (found, wanted) = (pose(&example), pose(&default));
    assert!((found.translation.vector - wanted.translation.vector).norm() < 1e-9);
    assert!(found.rotation.angle_to(&wanted.rotation) < 1e-6);
    assert!(matches!(example.setup.mount, ReceiverMount::Forearm { .. }));
    example.setup.mount = default.setup.mount;
    assert_eq!(said(&example), said(&default));
}

#[test]
fn absent_tables_have_the_default_values() {
    let read = HandConfiguration::read("format = 1").unwrap();
    assert_eq!(said(&read), said(&HandConfiguration::default()));
}

#[test]
fn a_rotation_may_be_an_axis_in_degrees() {
    let text = "format = 1\n[world_from_stand]\ntranslation_m = [0, 0.0, 0.6]\n\
                rotation_vector_deg = [0.0, 90.0, 0]\n";
    let stand = HandConfiguration::read(text).unwrap().setup.world_from_stand;
    assert!((stand * Vector3::x() + Vector3::z()).norm() < 1e-12);
}

#[test]
fn refused_texts_say_which_key_and_why() {
    let refused = |from: &str, to: &str| {
        let default = HandConfiguration::default().to_text();
        let changed = default.replacen(from, to, 1);
        assert_ne!(changed, default, "{from} is in the text");
        HandConfiguration::read(&changed).unwrap_err().to_string()
    };
    for (from, to, part) in [
        ("length_m", "lenght_m", "unknown field `lenght_m`"),
        ("[glove]", "[gloves]", "unknown field `gloves`"),
        ("side = \"right\"", "side = \"both\"", "unknown variant `both`"),
        ("format = 1", "format = 2", "format 2, this program reads 1"),
        ("length_m = 0.185", "length_m = 185", "hand length 185 m is outside 0.10 to 0.30 m"),
        ("breadth_m = 0.084", "breadth_m = nan", "hand breadth NaN m is outside"),
        ("sensors = 22", "sensors = 20", "glove.sensors is 20; it must be 18 or 22"),
        ("baud = 115200\nmode", "baud = 115201\nmode", "glove.baud is 115201"),
        ("baud = 115200\nstation", "baud = 600\nstation", "tracker.baud is 600"),
        ("station = 1", "station = 5", "tracker.station is 5; it must be 1 to 4"),
        ("hemisphere = \"forward\"", "hemisphere = \"up\"", "unknown variant `up`"),
        ("translation_m = [", "translation_m = [7.0, 0.0, 0.0] #", "at most 0.5 m"),
        ("quaternion_wxyz = [", "quaternion_wxyz = [2.0, 0.0, 0.0, 0.0] #", "of length 1"),
        ("quaternion_wxyz", "rotation_vector_deg = [0, 0, 1]\nquaternion_wxyz", "it has 2"),
        ("quaternion_wxyz", "# quaternion_wxyz", "[mount] needs one of"),
    ] {
        let error = refused(from, to);
        assert!(error.contains(part), "{from} → {to}: {error}");
    }
}

#[test]
fn a_calibration_must_be_for_the_same_hand() {
    let header = CalibrationHeader {
        program: "test",
        date: "2026-11-22",
        sensors: SensorCount::TwentyTwo,
        hand_size_m: None,
    };
    let right = Calibration::default();
    let mut left = right.clone();
    left.hand = Handedness::Left;
    let mut configuration = HandConfiguration::read("format = 1\n[hand]\nside = \"left\"").unwrap();
    let form = configuration.take_calibration(&virtual_hand_text(&left, &header)).unwrap();
    assert_eq!((form, &configuration.setup.calibration), (Form::VirtualHand, &left));
    let error = configuration.take_calibration(&toml_text(&right).unwrap()).unwrap_err();
    assert_eq!(
        error.to_string(),
        "the calibration is for a right hand, the configuration for a left one"
    );
    let mut other = HandConfiguration::default();
    assert!(matches!(
        other.take_calibration(&virtual_hand_text(&left, &header)),
        Err(HandFileError::OtherHand { .. })
    ));
    assert!(matches!(other.take_calibration("hello"), Err(HandFileError::Calibration(_))));
}
