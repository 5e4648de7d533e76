//! Turns the bytes of glove and tracker into the pose of the hand.

use nalgebra::Isometry3;
use softgrasp_grasp::hand::{HandPose, Handedness, pose};

use crate::devices::calibration::sensor_name;
use crate::devices::cyberglove::{
    GloveEvent, GloveParser, GloveRecord, RecordOptions, SensorCount, SensorHealth, SensorSet,
};
use crate::devices::fastrak::{Encoding, FastrakEvent, FastrakFormat, FastrakParser, OutputList};
use crate::devices::{Detected, Freshness, HandSample, Heard, PoseGate, SampleHold, SensorGate};
use crate::even_motion::{EvenMotion, MeasuredHand};
use crate::hand_setup::HandSetup;
use crate::joints::JointsRecord;
use crate::joints_reader::{FitErrors, JointsReader};
use crate::notice::Notice;
use crate::sent::{Arrival, Device};

/// Reads a hand from its devices' bytes.
pub struct HandReader {
    setup: HandSetup,
    glove: Detected<GloveParser>,
    tracker: Detected<FastrakParser>,
    joints: JointsReader,
    hold: SampleHold,
    health: SensorHealth,
    /// What keeps out readings that no hand brings about; `None` for devices without a line.
    gates: Option<Gates>,
    /// Dead sensors of which the person has been told.
    dead: SensorSet,
    /// When the first bytes of a device came, s.
    first_s: Option<f64>,
    news: Vec<Notice>,
    /// What has come over the lines of glove and tracker.
    heard: [Heard; 2],
    faults: DeviceFaults,
    /// Whether the tracker takes the receiver for its mirror image through the transmitter.
    is_flipped: bool,
    /// Time from tick to tick of a hand that moves evenly between its samples, s; `None` for one that is
    /// always where its newest sample has it.
    even_tick_s: Option<f64>,
    /// Even motion, from the first sample on.
    motion: Option<EvenMotion>,
}

/// The gates that keep out what a damaged line brings.
#[derive(Default)]
struct Gates {
    glove: SensorGate,
    tracker: PoseGate,
}

/// Counts of what the devices sent that was no good record, or was not taken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DeviceFaults {
    /// Number of faults of the glove's line.
    pub glove: u64,
    /// Number of faults of the tracker's line.
    pub tracker: u64,
    /// Number of jumps of the tracker to the opposite side of its field.
    pub hemisphere_flips: u64,
    /// Readings of sensors that no finger can have brought about, and were not taken.
    pub glove_jumps: u64,
    /// Poses of the tracker that no hand can have come to, and were not taken.
    pub tracker_jumps: u64,
    /// Bad lines of joints, and lines that no hand fits.
    pub joints: u64,
}

/// A sample that is older than this is stale: the hand is held where it was, s.
pub const SAMPLE_AGE_MAX_S: f64 = 0.25;
/// A device may take so long to speak after the other one did: a glove restarts in 2.5 s, s.
const START_MAX_S: f64 = 5.0;

impl HandReader {
    /// A reader that has heard nothing yet, for devices that send what the set-up says.
    pub fn new(setup: HandSetup) -> Self {
        let glove = Detected::known(GloveParser::new(setup.sensors, RecordOptions::default()));
        let tracker = Detected::known(FastrakParser::new(setup.tracker));
        Self::with(setup, glove, tracker, None)
    }

    /// A reader for devices that may not send what they were told to: the number of the glove's
    /// sensors, bytes or text, angles or quaternion are taken from what comes.
    ///
    /// Frame: `world_from_sender` places a sender of joints; `None` places its first hand before the
    /// object.
    pub fn of_devices(setup: HandSetup, world_from_sender: Option<Isometry3<f64>>) -> Self {
        let other = match setup.sensors {
            SensorCount::Eighteen => SensorCount::TwentyTwo,
            SensorCount::TwentyTwo => SensorCount::Eighteen,
        };
        let counts = [setup.sensors, other];
        let in_bytes = counts.map(|count| GloveParser::new(count, setup.glove_options));
        let in_lines = counts.map(GloveParser::of_lines);
        let glove = Detected::one_of(in_bytes.into_iter().chain(in_lines));
        let told = setup.tracker;
        let encodings = [Encoding::Binary, Encoding::Ascii].into_iter();
        let lists = [OutputList::PositionQuaternion, OutputList::PositionEuler];
        let others = encodings.flat_map(|encoding| lists.map(|output| (encoding, output)));
        let others = others.map(|(encoding, output)| FastrakFormat { encoding, output, ..told });
        let formats = std::iter::once(told).chain(others.filter(|format| *format != told));
        let tracker = Detected::one_of(formats.map(FastrakParser::new));
        let gates = Some(Gates::default());
        Self { gates, ..Self::with(setup, glove, tracker, world_from_sender) }
    }

    fn with(
        setup: HandSetup,
        glove: Detected<GloveParser>,
        tracker: Detected<FastrakParser>,
        world_from_sender: Option<Isometry3<f64>>,
    ) -> Self {
        let joints = JointsReader::new(setup.dimensions, world_from_sender);
        Self {
            setup,
            glove,
            tracker,
            joints,
            hold: SampleHold::default(),
            health: SensorHealth::default(),
            gates: None,
            dead: SensorSet::EMPTY,
            first_s: None,
            news: Vec::new(),
            heard: Default::default(),
            faults: DeviceFaults::default(),
            is_flipped: false,
            even_tick_s: None,
            motion: None,
        }
    }

    /// The reader of a hand that moves evenly between its samples, in ticks of this length, s.
    #[must_use]
    pub fn evened(self, tick_s: f64) -> Self {
        Self { even_tick_s: Some(tick_s), ..self }
    }

    /// Set-up of hand, glove and tracker.
    pub fn setup(&self) -> &HandSetup {
        &self.setup
    }

    /// Counts of faults since the start.
    pub fn faults(&self) -> DeviceFaults {
        let gates = self.gates.as_ref();
        DeviceFaults {
            glove_jumps: gates.map_or(0, |gates| gates.glove.refused()),
            tracker_jumps: gates.map_or(0, |gates| gates.tracker.refused()),
            joints: self.joints.faults(),
            ..self.faults
        }
    }

    /// How well the kinematic hand fits a sender's joints.
    pub fn fit_errors(&self) -> FitErrors {
        self.joints.fit_errors()
    }

    /// Number that a sender of joints gave the newest record which the hand has come to.
    pub fn joints_number(&self, now_s: f64) -> Option<u64> {
        match &self.motion {
            Some(motion) if !motion.has_arrived(now_s) => self.joints.number_before(),
            _ => self.joints.number(),
        }
    }

    /// Takes bytes of the devices, in the order in which they came.
    ///
    /// Units: `now_s` s on the client's clock, the time of bytes that come with the tick.
    pub fn feed(&mut self, arrivals: &[Arrival], now_s: f64) {
        for Arrival { device, at_s, is_datagram, bytes, .. } in arrivals {
            let time_s = at_s.unwrap_or(now_s);
            self.first_s.get_or_insert(time_s);
            self.take_samples(*device, time_s, |reader| match device {
                Device::Glove => reader.feed_glove(bytes, time_s),
                Device::Tracker => reader.feed_tracker(bytes, time_s),
                Device::Joints => {
                    let told = reader.joints.feed(bytes, *is_datagram, time_s);
                    reader.meet_sender(told);
                }
            });
        }
    }

    /// Takes what a device sent at a time, s, and begins the way to its sample if that is a new one.
    fn take_samples(&mut self, device: Device, time_s: f64, take: impl FnOnce(&mut Self)) {
        let before = self.sample_of(device);
        take(self);
        if self.sample_of(device) != before {
            self.move_on(device, time_s);
        }
    }

    /// What tells the samples of a device apart: how many, or when the newest one came, s.
    fn sample_of(&self, device: Device) -> Option<f64> {
        let sample = self.hold.sample(0.0);
        match device {
            Device::Glove => sample.glove.map(|glove| glove.time_s),
            Device::Tracker => sample.tracker.map(|tracker| tracker.time_s),
            Device::Joints => Some(self.joints.fit_errors().records as f64),
        }
    }

    /// Begins the way to a sample of a device that came at a time, s.
    fn move_on(&mut self, device: Device, time_s: f64) {
        let Some((tick_s, newest)) = self.even_tick_s.zip(self.newest(time_s)) else { return };
        match &mut self.motion {
            Some(motion) => motion.meet(device, newest, time_s),
            None => self.motion = Some(EvenMotion::begin(tick_s, device, newest, time_s)),
        }
    }

    /// Takes records of this hand's joints that came in the stream of the other one, at a time, s.
    pub(crate) fn take_joints(&mut self, records: &[JointsRecord], time_s: f64) {
        for record in records {
            self.take_samples(Device::Joints, time_s, |reader| {
                let told = reader.joints.take(record, time_s);
                reader.meet_sender(told);
            });
        }
    }

    /// Takes over the dimensions of the sender's hand, and what is told of it.
    fn meet_sender(&mut self, told: Option<String>) {
        if self.gates.is_some() {
            self.news.extend(told.map(Notice::done));
        }
        if self.joints.side().is_some() {
            self.setup.dimensions = *self.joints.dimensions();
        }
    }

    /// Reader of the joints of another program.
    pub(crate) fn joints_mut(&mut self) -> &mut JointsReader {
        &mut self.joints
    }

    /// Side of the hand, once it is known: a sender of joints says it, glove and tracker have that of the
    /// set-up.
    pub fn side(&self) -> Option<Handedness> {
        let sample = self.hold.sample(0.0);
        let has_devices = sample.glove.is_some() || sample.tracker.is_some();
        let of_setup = has_devices.then_some(self.setup.dimensions.handedness);
        self.joints.side().or(of_setup)
    }

    fn feed_glove(&mut self, bytes: &[u8], time_s: f64) {
        self.heard[0].bytes(bytes);
        let read = |parser: &mut GloveParser| {
            let mut events = Vec::new();
            parser.feed_all(bytes, |event| events.push(event));
            events
        };
        for event in self.glove.feed(read, |event| matches!(event, GloveEvent::Record(_))) {
            match event {
                GloveEvent::Record(record) => self.take_glove(record, time_s),
                GloveEvent::Fault(fault) => {
                    tracing::debug!(?fault, "glove");
                    self.faults.glove += 1;
                }
            }
        }
    }

    fn take_glove(&mut self, record: GloveRecord, time_s: f64) {
        if let Some(rate) = self.heard[0].record(time_s).filter(|_| self.gates.is_some()) {
            let sensors = record.sensors.count().number();
            let text = format!("a glove of {sensors} sensors, {rate:.0} records a second");
            self.news.push(Notice::done(text));
        }
        self.health.observe(&record.sensors);
        let Some(Gates { glove, .. }) = &mut self.gates else {
            return self.hold.on_glove(&record, time_s);
        };
        let sensors = glove.take(&record.sensors, time_s);
        self.hold.on_glove(&GloveRecord { sensors, ..record }, time_s);
        self.news.extend(glove.take_news());
        let dead = self.health.dead();
        for sensor in dead.iter().filter(|sensor| !self.dead.contains(*sensor)) {
            self.news.push(Notice::refused(format!(
                "the glove's sensor {} has shown one end of its range only and counts as dead: its \
                 joint is held at rest",
                sensor_name(sensor)
            )));
        }
        self.dead = dead;
    }

    /// What is wrong with what the devices send, a sentence each; none while all is as it should be.
    pub fn complaints(&self) -> Vec<String> {
        let of_lines = [Device::Glove, Device::Tracker].into_iter().zip(&self.heard);
        let of_lines = of_lines.filter_map(|(device, heard)| heard.complaint(device));
        of_lines.chain(self.joints.doubt()).collect()
    }

    /// What is to be told of the devices since the last call, a sentence each: what speaks, and what is
    /// wrong with it.
    pub fn take_news(&mut self) -> Vec<Notice> {
        std::mem::take(&mut self.news)
    }

    fn feed_tracker(&mut self, bytes: &[u8], time_s: f64) {
        self.heard[1].bytes(bytes);
        let read = |parser: &mut FastrakParser| {
            let mut events = Vec::new();
            parser.feed_all(bytes, |event| events.push(event));
            events
        };
        for event in self.tracker.feed(read, |event| matches!(event, FastrakEvent::Record(_))) {
            match event {
                FastrakEvent::Record(record) => {
                    if let Some(rate) =
                        self.heard[1].record(time_s).filter(|_| self.gates.is_some())
                    {
                        let unit = self.setup.tracker.units.name();
                        let text = format!("a tracker, {unit}, {rate:.0} records a second");
                        self.news.push(Notice::done(text));
                    }
                    let record = if self.is_flipped { record.mirrored() } else { record };
                    let gate = self.gates.as_mut().map(|gates| &mut gates.tracker);
                    let goes_on = |gate: &mut PoseGate| {
                        gate.take(record.world_from_receiver(), time_s).is_some()
                    };
                    // A failed self-test is not taken either, and is no place to compare with.
                    if record.error.is_some() || gate.is_none_or(goes_on) {
                        self.hold.on_tracker(&record, time_s);
                    }
                }
                FastrakEvent::HemisphereFlip(flip) => {
                    tracing::warn!(?flip, "the tracker jumped to the opposite side of its field");
                    self.faults.hemisphere_flips += 1;
                    // The field is the same at p and −p, and so is the attitude: the hand goes on
                    // where it was.
                    self.is_flipped = !self.is_flipped;
                }
                FastrakEvent::Reply(text) => tracing::debug!(text, "tracker"),
                FastrakEvent::Fault(fault) => {
                    tracing::debug!(?fault, "tracker");
                    self.faults.tracker += 1;
                }
            }
        }
    }

    /// When the first byte came of the older of the samples that are used now, s; `None` until all
    /// devices have spoken.
    pub fn sample_time_s(&self, now_s: f64) -> Option<f64> {
        if let Some(time_s) = self.joints.time_s() {
            return Some(time_s);
        }
        let sample = self.hold.sample(now_s);
        Some(sample.glove?.time_s.min(sample.tracker?.time_s))
    }

    /// The newest samples of glove and tracker.
    pub fn sample(&self, now_s: f64) -> HandSample {
        self.hold.sample(now_s)
    }

    /// The devices from which nothing good has come for too long, the glove first; those that have
    /// not spoken yet included, once another one has.
    pub fn silent(&self, now_s: f64) -> Vec<Device> {
        if let Some(time_s) = self.joints.time_s() {
            let is_stale = now_s - time_s > SAMPLE_AGE_MAX_S;
            return is_stale.then_some(Device::Joints).into_iter().collect();
        }
        let sample = self.hold.sample(now_s);
        let ages = [
            (Device::Glove, sample.glove_freshness(SAMPLE_AGE_MAX_S)),
            (Device::Tracker, sample.tracker_freshness(SAMPLE_AGE_MAX_S)),
        ];
        if ages.iter().all(|(_, freshness)| *freshness == Freshness::Missing) {
            return Vec::new();
        }
        // A device that is still being set up is not silent yet.
        let is_starting = self.first_s.is_some_and(|first_s| now_s - first_s < START_MAX_S);
        let silent = ages.iter().filter(|(_, freshness)| match freshness {
            Freshness::Fresh => false,
            Freshness::Stale { .. } => true,
            Freshness::Missing => !is_starting,
        });
        silent.map(|(device, _)| *device).collect()
    }

    /// Pose of the hand by the newest samples, however old; `None` until all devices have spoken.
    pub fn hand(&self, now_s: f64) -> Option<HandPose> {
        let (angles, world_from_palm) = self.measured(now_s)?;
        Some(pose(&self.setup.dimensions, &angles, world_from_palm))
    }

    /// Joint angles and palm in a tick at a time, s, by the samples so far, however old; `None` until all
    /// devices have spoken.
    pub fn measured(&self, now_s: f64) -> Option<MeasuredHand> {
        match &self.motion {
            Some(motion) => Some(motion.at(now_s)),
            None => self.newest(now_s),
        }
    }

    /// Joint angles and palm by the newest samples.
    fn newest(&self, now_s: f64) -> Option<MeasuredHand> {
        if let Some(measured) = self.joints.measured() {
            return Some(measured);
        }
        let sample = self.hold.sample(now_s);
        // A sensor that starts at an end of its range is held at rest until it leaves it, so that the
        // hand does not jump when it is known to be dead.
        let dead = match self.gates {
            Some(_) => self.health.only_at_one_end(),
            None => self.health.dead(),
        };
        let angles = self.setup.calibration.angles(&sample.glove?.sensors, dead);
        let world_from_receiver = self.setup.world_from_stand * sample.tracker?.world_from_receiver;
        let hand = self.setup.dimensions.handedness;
        let world_from_palm = self.setup.mount.world_from_palm(&world_from_receiver, &angles, hand);
        Some((angles, world_from_palm))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;
    use softgrasp_grasp::hand::JointAngles;

    #[test]
    fn scripted_pose_comes_back_through_the_device_bytes() {
        let setup = HandSetup::default();
        let mut reader = HandReader::new(setup.clone());
        let palm = Isometry3::new(Vector3::new(0.1, 0.05, -0.2), Vector3::new(0.4, -0.3, 1.2));
        let mut angles = JointAngles::flat();
        angles.index.mcp_flexion = 0.7;
        let arrivals = setup.arrivals_of(&angles, &palm);
        assert!(reader.hand(0.0).is_none());
        reader.feed(&arrivals, 0.0);
        let hand = reader.hand(0.0).unwrap();
        let expected = pose(&setup.dimensions, &angles, palm);
        for (got, sent) in hand.fingers.iter().zip(&expected.fingers) {
            // One sensor count is about a degree, 1.5 mm at a fingertip.
            assert!((got.tip() - sent.tip()).norm() < 4e-3);
        }
        assert!((hand.world_from_palm.translation.vector - palm.translation.vector).norm() < 1e-3);
        assert_eq!(reader.faults(), DeviceFaults::default());
    }
}
