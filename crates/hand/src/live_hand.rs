//! A person's own hand: glove and tracker on serial ports, a stream of joints, or a runtime of OpenXR.

use std::time::Instant;

use crate::joints::{ArrivedBytes, JointsFeed, JointsListener};
use crate::notice::Notice;
use crate::sent::{Arrival, Device, WhichHand};
use crate::serial::{DeviceState, SerialDevices};
use crate::xr_runtime::RuntimeHands;

/// Devices that are open, and whose bytes come by themselves.
pub struct LiveHand {
    source: Source,
    name: String,
}

enum Source {
    Serial(Box<SerialDevices>),
    Joints(JointsListener),
    Fed(JointsFeed),
    Runtime(RuntimeHands),
}

impl LiveHand {
    /// The hand that glove and tracker on serial ports measure; `name` stands in reports.
    pub fn serial(devices: SerialDevices, name: String) -> Self {
        Self { source: Source::Serial(Box::new(devices)), name }
    }

    /// The hand that a stream of joints shows; `name` stands in reports.
    pub fn joints(listener: JointsListener, name: String) -> Self {
        Self { source: Source::Joints(listener), name }
    }

    /// The hand whose joints another part of the program hands on; `name` stands in reports.
    pub fn fed(feed: JointsFeed, name: String) -> Self {
        Self { source: Source::Fed(feed), name }
    }

    /// The hand that an OpenXR runtime tracks; `name` stands in reports.
    pub fn runtime(hands: RuntimeHands, name: String) -> Self {
        Self { source: Source::Runtime(hands), name }
    }

    /// Name of the hand in reports.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Bytes of the devices that have come since the last call; never waits.
    ///
    /// Units: `now_s` s on the client's clock, now.
    pub fn take(&mut self, now_s: f64) -> Vec<Arrival> {
        let now = Instant::now();
        let at =
            |arrived: Instant| Some(now_s - now.saturating_duration_since(arrived).as_secs_f64());
        match &mut self.source {
            Source::Serial(devices) => {
                let pieces = devices.take().into_iter();
                let arrival = |piece: crate::serial::Arrived| Arrival {
                    hand: WhichHand::First,
                    device: piece.device,
                    at_s: at(piece.arrived),
                    is_datagram: false,
                    bytes: piece.bytes,
                };
                pieces.map(arrival).collect()
            }
            Source::Joints(listener) => joints(listener.take(), at),
            Source::Fed(feed) => joints(feed.take(), at),
            Source::Runtime(hands) => joints(hands.take(), at),
        }
    }

    /// Number of pieces that were dropped because no tick took them in time.
    pub fn dropped(&self) -> u64 {
        match &self.source {
            Source::Serial(devices) => devices.dropped(),
            Source::Joints(listener) => listener.dropped(),
            Source::Fed(feed) => feed.dropped(),
            Source::Runtime(hands) => hands.dropped(),
        }
    }

    /// What is wrong with the devices, or what they wait for, a sentence each; none while all talk. `hands`
    /// is the number of hands that have been heard of: each may have a sender of its own.
    pub fn complaints(&self, hands: usize) -> Vec<Notice> {
        match &self.source {
            Source::Serial(devices) => {
                let states = devices.states().into_iter();
                let named = states.zip([Device::Glove, Device::Tracker]);
                let states = named.filter_map(|(state, device)| complaint(device, &state));
                let disobeys = devices.tracker_facts().disobeys;
                let told = disobeys.map(|why| format!("the tracker is set up wrongly: {why}"));
                states.chain(told.map(Notice::refused)).collect()
            }
            Source::Joints(listener) if listener.senders() == 0 => {
                let address = listener.local_addr();
                vec![Notice::waits(format!("nobody sends joints to {address}"))]
            }
            Source::Joints(listener) if listener.senders() > hands.max(1) => {
                let (senders, address) = (listener.senders(), listener.local_addr());
                let followed = if hands > 1 { "two hands are" } else { "one hand is" };
                vec![Notice::refused(format!(
                    "{senders} senders send joints to {address}: {followed} followed, end the others"
                ))]
            }
            Source::Fed(feed) if feed.senders() == 0 => {
                let text = "no headset sends a hand: open the page in its browser and enter";
                vec![Notice::waits(text)]
            }
            Source::Runtime(hands) => hands.complaint().into_iter().collect(),
            Source::Joints(_) | Source::Fed(_) => Vec::new(),
        }
    }
}

/// Pieces of a stream of joints; `at` has the time of a moment on the client's clock, s.
fn joints(pieces: Vec<ArrivedBytes>, at: impl Fn(Instant) -> Option<f64>) -> Vec<Arrival> {
    let arrival = |piece: ArrivedBytes| Arrival {
        hand: WhichHand::First,
        device: Device::Joints,
        at_s: at(piece.arrived),
        is_datagram: piece.datagram,
        bytes: piece.bytes,
    };
    pieces.into_iter().map(arrival).collect()
}

/// The notice that a person needs about the state of a device; `None` while it works.
fn complaint(device: Device, state: &DeviceState) -> Option<Notice> {
    let name = device.name();
    Some(match state {
        // A device that falls silent is told by its samples.
        DeviceState::NotUsed | DeviceState::Talking | DeviceState::Silent { .. } => return None,
        DeviceState::Absent { why } => Notice::refused(format!("the {name} is not there: {why}")),
        DeviceState::SettingUp => Notice::waits(format!("the {name} is being set up")),
        DeviceState::Lost { why } => Notice::refused(format!("the {name} is lost: {why}")),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::net::UdpSocket;
    use std::time::Duration;

    #[test]
    fn second_sender_of_joints_is_told() {
        let listener = JointsListener::bind("127.0.0.1:0".parse().unwrap()).unwrap();
        let address = listener.local_addr();
        let mut hand = LiveHand::joints(listener, "joints".to_owned());
        assert!(hand.complaints(0)[0].text.contains("nobody sends joints"));
        let senders = [(); 2].map(|()| UdpSocket::bind("127.0.0.1:0").unwrap());
        let told = (0..500).any(|_| {
            for sender in &senders {
                sender.send_to(b"{\"joints\":[]}\n", address).unwrap();
            }
            std::thread::sleep(Duration::from_millis(10));
            hand.take(0.0);
            hand.complaints(1).iter().any(|told| told.text.starts_with("2 senders send joints"))
        });
        assert!(told, "{:?}", hand.complaints(1));
        assert_eq!(hand.complaints(2), [], "a left and a right hand may have a sender each");
    }
}
