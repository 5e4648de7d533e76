//! The arguments that say which hands act in a run, and the hands that they describe.

use std::path::PathBuf;

use anyhow::bail;
use clap::Args;
use nalgebra::{Isometry3, Point3, Translation3};
use softgrasp_grasp::hand::HandDimensions;
use softgrasp_hand::foreign_recording::is_foreign;
use softgrasp_hand::hand_request::HandRequest;
use softgrasp_hand::hand_setup::HandConfiguration;
use softgrasp_hand::xr_runtime::WantedHands;

use super::hand_files::read_configuration;
use super::numbers::{place, positive};

/// The hands of a run.
#[derive(Args, Clone, Default)]
pub(super) struct HandArguments {
    /// The hand: scripted[:lift|approach|attach|squeeze|release|regrasp], mouse (in a window),
    /// serial:glove=PATH[@BAUD],tracker=PATH[@BAUD], joints:IP:PORT, xr (with --xr),
    /// openxr[:left|:right] (a build with the feature openxr), or replay:F.mcap. Given twice, a right and a left hand act at once (with --grasp contact).
    #[arg(long = "hand", value_name = "SOURCE")]
    pub(super) hands: Vec<HandRequest>,
    /// Configuration of the hand, its glove and its tracker (hand.toml, made by `calibrate` and
    /// `align`); the second one is that of the second --hand.
    #[arg(long = "hand-setup", value_name = "F.toml")]
    setups: Vec<PathBuf>,
    /// Length of the hand, m: wrist crease to tip of the middle finger [default: 0.185].
    #[arg(long = "hand-length", value_name = "M", value_parser = positive, allow_hyphen_values = true)]
    length: Option<f64>,
    /// Breadth of the hand, m: across the knuckles, without the thumb [default: 0.084].
    #[arg(long = "hand-breadth", value_name = "M", value_parser = positive, allow_hyphen_values = true)]
    breadth: Option<f64>,
    /// Place of the object in the frame of a sender of joints, m [default: before its first hand].
    #[arg(long, value_name = "X,Y,Z", value_parser = place, allow_hyphen_values = true)]
    joints_origin: Option<Point3<f64>>,
}

/// The second hand of a run.
#[derive(Clone)]
pub(super) struct SecondHand {
    /// Source of its own; `None` where the first one's stream of joints, or a recording, carries both.
    pub(super) request: Option<HandRequest>,
    /// Whether it comes in the first one's stream of joints.
    pub(super) shares_stream: bool,
    /// Configuration of the hand, its glove and its tracker.
    pub(super) configuration: HandConfiguration,
    /// Whether its samples come from live devices.
    pub(super) is_live: bool,
    /// Whether the hand moves evenly between its samples.
    pub(super) is_even: bool,
    /// Pose in the world of a sender of its joints, where that is known.
    pub(super) world_from_sender: Option<Isometry3<f64>>,
}

impl HandArguments {
    /// A hand of one source.
    pub(super) fn of(hand: HandRequest) -> Self {
        Self { hands: vec![hand], ..Self::default() }
    }

    /// The first hand, if one was named.
    pub(super) fn first(&self) -> Option<&HandRequest> {
        self.hands.first()
    }

    /// Whether two hands were named.
    pub(super) fn are_two(&self) -> bool {
        self.hands.len() > 1
    }

    /// Checks that the sources can act together.
    ///
    /// # Errors
    /// Sentence: what cannot be, and what to do.
    pub(super) fn check(&self) -> anyhow::Result<()> {
        let (first, second) = match &self.hands[..] {
            [] | [_] => return self.check_setups(),
            [first, second] => (first, second),
            more => {
                bail!("--hand was given {} times: there is a right and a left hand", more.len())
            }
        };
        let is_recording =
            |hand: &HandRequest| matches!(hand, HandRequest::Replay(path) if !is_foreign(path));
        if [first, second].into_iter().any(is_recording) {
            bail!("a recording of a run carries all its hands: replay it alone");
        }
        match (first, second) {
            (HandRequest::Mouse, HandRequest::Mouse) => {
                bail!("one mouse moves one hand: name another source for the second")
            }
            (HandRequest::Xr, HandRequest::Xr) => {
                bail!("--hand xr brings both hands of a headset: name it once")
            }
            (HandRequest::OpenXr(_), HandRequest::OpenXr(_)) => {
                bail!("--hand openxr brings both hands of a runtime: name it once")
            }
            (HandRequest::Joints(a), HandRequest::Joints(b)) if a == b => {
                bail!("--hand joints:{a} brings both hands of its senders: name it once")
            }
            (HandRequest::Serial(a), HandRequest::Serial(b)) => {
                let ports = [&a.glove, &a.tracker].into_iter().flatten();
                let others = || [&b.glove, &b.tracker].into_iter().flatten();
                let mut shared = ports.filter(|port| others().any(|other| other.path == port.path));
                if let Some(port) = shared.next() {
                    bail!("both hands cannot share the port {}", port.path.display());
                }
            }
            _ => {}
        }
        self.check_setups()
    }

    fn check_setups(&self) -> anyhow::Result<()> {
        if self.setups.len() > self.hands.len().max(1) {
            bail!("--hand-setup was given {} times: name as many hands", self.setups.len());
        }
        Ok(())
    }

    /// Pose in the world of a sender of joints; a page sends its hands in the world frame.
    pub(super) fn world_from_sender(&self, is_xr: bool) -> Option<Isometry3<f64>> {
        let chosen = self.joints_origin.map(|at| Translation3::from(-at.coords).into());
        chosen.or(is_xr.then(Isometry3::identity))
    }

    /// Configuration of the first hand from its file, with the size of the command line.
    ///
    /// # Errors
    /// A file that cannot be used, or a size that no hand has.
    pub(super) fn configuration(&self) -> anyhow::Result<HandConfiguration> {
        let configuration = match self.setups.first() {
            Some(path) => read_configuration(path)?,
            None => HandConfiguration::default(),
        };
        self.sized(configuration)
    }

    /// The second hand of a run whose first one has this source and configuration: that of the second
    /// `--hand`, or the one that a stream of joints may carry too. `None` for a run of one hand.
    ///
    /// # Errors
    /// As [`HandArguments::configuration`], and two hands of one side.
    pub(super) fn second(
        &self,
        first: &HandRequest,
        of_first: &HandConfiguration,
    ) -> anyhow::Result<Option<SecondHand>> {
        let request = self.hands.get(1).cloned();
        let carries_both = match first {
            HandRequest::Joints(_) | HandRequest::Xr => true,
            HandRequest::OpenXr(wanted) => *wanted == WantedHands::Both,
            _ => false,
        };
        if request.is_none() && !carries_both {
            return Ok(None);
        }
        let configuration = match self.setups.get(1) {
            Some(path) => self.sized(read_configuration(path)?)?,
            None => of_first.of_other_hand(),
        };
        let side = configuration.setup.dimensions.handedness;
        if side == of_first.setup.dimensions.handedness {
            bail!(
                "both hands are {0} hands by their --hand-setup: one of them must say the other side",
                side.name()
            );
        }
        let source = request.as_ref().unwrap_or(first);
        Ok(Some(SecondHand {
            shares_stream: request.is_none(),
            configuration,
            is_live: source.is_live(),
            is_even: source.is_even(),
            world_from_sender: self.world_from_sender(*source == HandRequest::Xr),
            request,
        }))
    }

    fn sized(&self, mut configuration: HandConfiguration) -> anyhow::Result<HandConfiguration> {
        let old = configuration.setup.dimensions;
        if self.length.is_some() || self.breadth.is_some() {
            let length_m = self.length.unwrap_or(old.hand_length);
            let size = HandDimensions::scaled(length_m, self.breadth.unwrap_or(old.hand_breadth))?;
            configuration.setup.dimensions = size.with_handedness(old.handedness);
        }
        Ok(configuration)
    }
}

#[cfg(test)]
mod tests {
    use softgrasp_grasp::hand::Handedness;

    use super::*;

    #[test]
    fn runtime_brings_both_hands_unless_one_is_named() {
        let of_first = HandConfiguration::default();
        let second = |wanted| {
            let hands = HandArguments::of(HandRequest::OpenXr(wanted));
            hands.check().unwrap();
            hands.second(&hands.hands[0], &of_first).unwrap()
        };
        let both = second(WantedHands::Both).unwrap();
        assert!(both.shares_stream && both.is_live && both.request.is_none());
        assert_eq!(both.world_from_sender, None, "the first hand places the runtime's space");
        assert!(second(WantedHands::One(Handedness::Left)).is_none());
        let left = HandRequest::OpenXr(WantedHands::One(Handedness::Left));
        let mut hands = HandArguments::of(left.clone());
        hands.hands.push(HandRequest::Mouse);
        hands.check().unwrap();
        assert!(hands.second(&left, &of_first).unwrap().is_some_and(|hand| !hand.shares_stream));
        hands.hands[1] = HandRequest::OpenXr(WantedHands::One(Handedness::Right));
        assert!(hands.check().unwrap_err().to_string().contains("name it once"));
    }
}
