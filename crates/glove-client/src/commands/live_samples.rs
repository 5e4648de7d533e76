//! Samples of live devices for `calibrate` and `align`: the one place that opens ports for them.

use std::time::{Duration, Instant};

use anyhow::bail;
use nalgebra::Isometry3;
use softgrasp_hand::devices::HandSample;
use softgrasp_hand::devices::cyberglove::RawSensors;
use softgrasp_hand::hand_reader::HandReader;
use softgrasp_hand::hand_setup::HandConfiguration;
use softgrasp_hand::sent::{Arrival, WhichHand};
use softgrasp_hand::serial::{SerialDevices, SerialSource, settings_of_hand};

/// Returns the next reading of the glove; `None` if none came within a short time.
pub(super) type NextReading = Box<dyn FnMut() -> Option<RawSensors>>;

/// Returns the next sample of the arm; `None` if none came within a short time.
pub(super) type NextArmSample = Box<dyn FnMut() -> Option<ArmSample>>;

/// Sample of the arm at one time.
#[derive(Clone, Copy, Debug)]
pub(super) struct ArmSample {
    /// Pose of the receiver in the transmitter's Y-up frame, m.
    pub(super) stand_from_receiver: Isometry3<f64>,
    /// Reading of the glove, if there is one.
    pub(super) glove: Option<RawSensors>,
}

/// Time without a reading after which a device counts as silent for now.
const WAIT: Duration = Duration::from_millis(300);
/// Time between two looks at the devices.
const LOOK_EVERY: Duration = Duration::from_millis(2);

/// Glove and tracker on their ports, and a reader of what they send.
struct Live {
    devices: SerialDevices,
    reader: HandReader,
    begun: Instant,
}

impl Live {
    fn open(
        configuration: &HandConfiguration,
        ports: Option<&SerialSource>,
    ) -> anyhow::Result<Self> {
        let Some(ports) = ports else {
            bail!(
                "name the ports, --ports glove=PATH[@BAUD],tracker=PATH[@BAUD] (`glove-client \
                 devices` lists them), or recorded bytes, --from FOLDER"
            )
        };
        let devices = SerialDevices::open(settings_of_hand(ports, configuration))?;
        let reader = HandReader::of_devices(configuration.setup.clone(), None);
        Ok(Self { devices, reader, begun: Instant::now() })
    }

    /// Takes what has come: the newest sample of each device, with its time.
    fn sample(&mut self) -> HandSample {
        let at = |arrived: Instant| arrived.saturating_duration_since(self.begun).as_secs_f64();
        let arrivals: Vec<Arrival> = self
            .devices
            .take()
            .into_iter()
            .map(|piece| Arrival {
                hand: WhichHand::First,
                device: piece.device,
                at_s: Some(at(piece.arrived)),
                is_datagram: false,
                bytes: piece.bytes,
            })
            .collect();
        let now_s = self.begun.elapsed().as_secs_f64();
        self.reader.feed(&arrivals, now_s);
        self.reader.sample(now_s)
    }

    /// Waits for a sample that is newer than the last one.
    fn next<T>(&mut self, mut newer: impl FnMut(&HandSample) -> Option<T>) -> Option<T> {
        let until = Instant::now() + WAIT;
        loop {
            let sample = self.sample();
            if let Some(found) = newer(&sample) {
                return Some(found);
            }
            if Instant::now() >= until {
                return None;
            }
            std::thread::sleep(LOOK_EVERY);
        }
    }
}

/// Opens the glove's port.
///
/// # Errors
/// Sentence if no port is named or the system starts no thread. A glove that is not connected is waited
/// for.
pub(super) fn live_glove(
    configuration: &HandConfiguration,
    ports: Option<&SerialSource>,
) -> anyhow::Result<NextReading> {
    let mut live = Live::open(configuration, ports)?;
    let mut last_s = f64::NEG_INFINITY;
    Ok(Box::new(move || {
        live.next(|sample| {
            let reading = sample.glove.filter(|reading| reading.time_s > last_s)?;
            last_s = reading.time_s;
            Some(reading.sensors)
        })
    }))
}

/// Opens the ports of tracker and glove.
///
/// # Errors
/// The same as those of [`live_glove`].
pub(super) fn live_arm(
    configuration: &HandConfiguration,
    ports: Option<&SerialSource>,
) -> anyhow::Result<NextArmSample> {
    let mut live = Live::open(configuration, ports)?;
    let mut last_s = f64::NEG_INFINITY;
    Ok(Box::new(move || {
        live.next(|sample| {
            let reading = sample.tracker.filter(|reading| reading.time_s > last_s)?;
            last_s = reading.time_s;
            // Readings are in the transmitter's Y-up frame until the stand places them.
            let stand_from_receiver = reading.world_from_receiver;
            Some(ArmSample { stand_from_receiver, glove: sample.glove.map(|g| g.sensors) })
        })
    }))
}
