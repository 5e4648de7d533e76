//! Samples of recorded device bytes for `calibrate` and `align`: one file for each gesture.

use std::path::Path;

use anyhow::{Context, bail};
use nalgebra::Isometry3;
use softgrasp_hand::devices::cyberglove::{
    GloveEvent, GloveParser, RawSensors, RecordOptions, SensorCount,
};
use softgrasp_hand::devices::fastrak::{FastrakEvent, FastrakParser};
use softgrasp_hand::hand_setup::HandConfiguration;

/// Largest length of a gesture's recording, bytes: 20 minutes of a glove.
const MAX_BYTES: u64 = 4 << 20;

/// Readings of the glove in a file of its raw bytes.
///
/// # Errors
/// A sentence for a file that cannot be read or holds no record of this glove.
pub(super) fn recorded_readings(
    path: &Path,
    sensors: SensorCount,
) -> anyhow::Result<Vec<RawSensors>> {
    let bytes = read_limited(path)?;
    let mut parser = GloveParser::new(sensors, RecordOptions { timestamp: false, status: false });
    let (mut readings, mut faults) = (Vec::new(), 0);
    parser.feed_all(&bytes, |event| match event {
        GloveEvent::Record(record) => readings.push(record.sensors),
        GloveEvent::Fault(_) => faults += 1,
    });
    if readings.is_empty() {
        bail!(
            "{}: no record of a glove with {} sensors ({faults} faults)",
            path.display(),
            sensors.number()
        );
    }
    Ok(readings)
}

/// Poses of the receiver in a file of the tracker's raw bytes, in the transmitter's Y-up frame, m.
///
/// # Errors
/// A sentence for a file that cannot be read or holds no record of this tracker and station.
pub(super) fn recorded_poses(
    path: &Path,
    configuration: &HandConfiguration,
) -> anyhow::Result<Vec<Isometry3<f64>>> {
    let bytes = read_limited(path)?;
    let station = configuration.tracker.station;
    let mut parser = FastrakParser::new(configuration.setup.tracker);
    let (mut poses, mut others) = (Vec::new(), 0);
    parser.feed_all(&bytes, |event| match event {
        FastrakEvent::Record(record) if record.station == station && record.error.is_none() => {
            poses.push(record.world_from_receiver());
        }
        FastrakEvent::Record(_) | FastrakEvent::Fault(_) => others += 1,
        FastrakEvent::HemisphereFlip(_) | FastrakEvent::Reply(_) => {}
    });
    if poses.is_empty() {
        bail!(
            "{}: no good record of station {} in the configured format ({others} others)",
            path.display(),
            station.number()
        );
    }
    Ok(poses)
}

fn read_limited(path: &Path) -> anyhow::Result<Vec<u8>> {
    let shown = path.display();
    let length = std::fs::metadata(path).with_context(|| format!("cannot read {shown}"))?.len();
    if length > MAX_BYTES {
        bail!("{shown}: {length} bytes are too many for one gesture (at most {MAX_BYTES})");
    }
    std::fs::read(path).with_context(|| format!("cannot read {shown}"))
}
