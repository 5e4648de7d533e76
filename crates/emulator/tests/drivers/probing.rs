//! Which device answers on a port, and at which speed.

use std::path::Path;
use std::time::Instant;

use softgrasp_emulator::emulation::PseudoTerminal;
use softgrasp_emulator::{EmulatedGloveKind, EmulatedTrackerKind};
use softgrasp_hand::devices::cyberglove::SensorCount;
use softgrasp_hand::serial::probe::{Found, probe};

use super::served::{HANG, glove_line, tracker_line};

/// The device that is found on a port; one that is not served in time is asked again.
fn find(path: &Path, wanted: impl Fn(&Found) -> bool) -> Option<Found> {
    let begun = Instant::now();
    loop {
        let found = probe(path).unwrap();
        if found.as_ref().is_some_and(&wanted) || begun.elapsed() > HANG {
            return found;
        }
    }
}

#[test]
fn devices_are_recognised_at_their_own_speed_only() {
    let kind = EmulatedGloveKind {
        baud: 38_400,
        sensors: SensorCount::Eighteen,
        ..EmulatedGloveKind::default()
    };
    let glove = glove_line(kind, None);
    let found = find(&glove.path, |found| matches!(found, Found::Glove { identity: Some(_), .. }));
    let Some(Found::Glove { baud: 38_400, sensors: Some(18), identity: Some(identity) }) = found
    else {
        panic!("{found:?}")
    };
    assert!(identity.contains("CyberGlove"), "{identity}");
    let tracker = tracker_line(EmulatedTrackerKind { baud: 9600, ..Default::default() }, None);
    let found = find(&tracker.path, |found| match found {
        Found::Tracker { status, .. } => status.starts_with("21S"),
        Found::Glove { .. } => true,
    });
    let Some(Found::Tracker { baud: 9600, status }) = found else { panic!("{found:?}") };
    assert!(status.starts_with("21S3F0"), "{status}");
    drop((glove.end(), tracker.end()));
    let nobody = PseudoTerminal::open(None).unwrap();
    assert_eq!(probe(nobody.path()), Ok(None));
    assert!(probe(Path::new("/dev/there-is-none")).unwrap_err().contains("there is no"));
}
