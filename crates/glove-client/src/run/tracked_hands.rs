//! The hands of a run: how they were measured, how they are shown, and which devices are silent.

use nalgebra::Isometry3;
use softgrasp_grasp::grasp::HandSegments;
use softgrasp_grasp::hand::{HandPose, above_table};
use softgrasp_hand::hand_readers::HandReaders;
use softgrasp_hand::notice::Notice;
use softgrasp_hand::sent::{SilentDevice, WhichHand};

use crate::run::friction::TickHand;
use crate::run::tick_outcome::{LoopEvent, TickOutcome};

/// The hands of a run, one or two.
pub(crate) struct TrackedHands {
    pub(crate) readers: HandReaders,
    /// Hands of the last tick, as measured, but never below the table of a grasp by friction.
    poses: [Option<HandPose>; 2],
    /// Segments of the hands as the last tick shows them, in the world.
    shown: [HandSegments; 2],
    /// Devices that were silent in the last tick.
    silent: Vec<SilentDevice>,
}

impl TrackedHands {
    /// Hands that have not been heard of yet.
    pub(crate) fn new(readers: HandReaders) -> Self {
        let shown = [[[Isometry3::identity(); 3]; 5]; 2];
        Self { readers, poses: [None; 2], shown, silent: Vec::new() }
    }

    /// Hand of the last tick.
    pub(crate) fn pose(&self, which: WhichHand) -> Option<&HandPose> {
        self.poses[which.index()].as_ref()
    }

    /// Segments of a hand as the last tick shows them.
    pub(crate) fn shown(&self, which: WhichHand) -> &HandSegments {
        &self.shown[which.index()]
    }

    /// Sets the hands of a tick, and their segments as they are shown.
    pub(crate) fn show(&mut self, hands: &[Option<TickHand>; 2], shown: [Option<HandSegments>; 2]) {
        self.poses = hands.map(|hand| hand.map(|hand| hand.pose));
        for (now, shown) in self.shown.iter_mut().zip(shown) {
            *now = shown.unwrap_or(*now);
        }
    }

    /// Hands as they are measured now; a table at a height `table_y`, m, stops a hand as it stops an object.
    pub(crate) fn measured(&self, now_s: f64, table_y: Option<f64>) -> [Option<TickHand>; 2] {
        WhichHand::ALL.map(|which| {
            let reader = self.readers.of(which)?;
            let (measured, dimensions) = (reader.hand(now_s)?, reader.setup().dimensions);
            let held_up = |table_y| above_table(&dimensions, &measured, table_y);
            Some(TickHand { pose: table_y.map_or(measured, held_up), dimensions })
        })
    }

    /// Reports devices that fall silent, and those that speak again. A hand without samples keeps its
    /// pose, and so does the object that it holds.
    pub(crate) fn look_at_devices(&mut self, now_s: f64, outcome: &mut TickOutcome) {
        outcome.silent = self.readers.silent(now_s);
        let silent = &outcome.silent;
        let fallen = silent.iter().filter(|device| !self.silent.contains(device));
        let tell = |device: &SilentDevice| {
            let what = match self.is_there(device, now_s) {
                true => "the hand is held where it was",
                false => "there is no hand yet",
            };
            Notice::refused(format!("the {} is silent: {what}", device.name()))
        };
        outcome.events.extend(fallen.map(tell).map(LoopEvent::Device));
        let back = self.silent.iter().filter(|device| !silent.contains(device));
        let tell =
            |device: &SilentDevice| Notice::done(format!("the {} speaks again", device.name()));
        outcome.events.extend(back.map(tell).map(LoopEvent::Device));
        self.silent.clone_from(&outcome.silent);
        outcome.events.extend(self.readers.take_news().into_iter().map(LoopEvent::Device));
    }

    /// Whether there is a pose of the hand of a device.
    fn is_there(&self, device: &SilentDevice, now_s: f64) -> bool {
        let readers = WhichHand::ALL.into_iter().filter_map(|which| self.readers.of(which));
        let is_of = |side| device.side.is_none_or(|of_device| of_device == side);
        readers
            .filter(|reader| is_of(reader.setup().dimensions.handedness))
            .any(|reader| reader.measured(now_s).is_some())
    }
}
