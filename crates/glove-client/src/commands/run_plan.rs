//! The run that arguments and scene file describe: its objects, its hands, its server and its pace.

use std::sync::Arc;
use std::time::Duration;

use nalgebra::Isometry3;
#[cfg(any(feature = "window", feature = "xr"))]
use softgrasp_core::fem::Material as ElasticMaterial;
#[cfg(any(feature = "window", feature = "xr"))]
use softgrasp_hand::hand_request::HandChoice;
use softgrasp_hand::hand_request::HandRequest;
use softgrasp_hand::hand_setup::HandConfiguration;
use softgrasp_hand::recording::Recording;
use softgrasp_hand::sent::TICKS_PER_S;
#[cfg(any(feature = "window", feature = "xr"))]
use softgrasp_protocol::Material;

use super::hand_arguments::SecondHand;
use super::object_plan::{Laying, ObjectPlan};
use crate::ask::connection::ServerChoice;
use crate::ask::endpoint::Endpoint;
use crate::object::object_place::ObjectPlace;
use crate::pace::Pace;

/// Settings of a run, from flags and scene file.
#[derive(Clone)]
pub(super) struct RunPlan {
    /// The object that is grasped; the first of several.
    pub(super) first: ObjectPlan,
    /// What the first object is painted as, where there are several.
    pub(super) first_laying: Laying,
    /// The further objects on the table, each with its place.
    pub(super) further: Vec<(ObjectPlan, Laying)>,
    /// Number, from 0, of the object that a hand goes to by itself.
    pub(super) aim: usize,
    /// Device that takes the forces.
    pub(super) force: Option<softgrasp_force::Target>,
    /// Place where the object is put.
    pub(super) place: ObjectPlace,
    /// Server that solves.
    pub(super) server: ServerChoice,
    /// Endpoint of the server, with token and encryption; `None` for the embedded one.
    pub(super) endpoint: Option<Endpoint>,
    /// Hand that is asked for; the first of two.
    pub(super) hand: HandRequest,
    /// Second hand, or one that the stream of the first may carry.
    pub(super) second: Option<SecondHand>,
    /// Whether ticks wait for answers.
    pub(super) pace: Pace,
    /// Time from tick to tick, in real time; `None` for as fast as possible.
    pub(super) period: Option<Duration>,
    /// Configuration of the hand, its glove and its tracker.
    pub(super) hand_configuration: HandConfiguration,
    /// Whether the samples come from live devices.
    pub(super) is_live: bool,
    /// Whether the hand moves evenly between its samples.
    pub(super) is_even: bool,
    /// Pose in the world of a sender of joints; `None` puts its first hand before the object.
    pub(super) world_from_sender: Option<Isometry3<f64>>,
    /// Recording that is replayed.
    pub(super) recording: Option<Arc<Recording>>,
}

impl RunPlan {
    /// Time from tick to tick of a hand that a person moves or watches, s.
    pub(super) fn tick_s(&self) -> f64 {
        self.period.map_or(1.0 / TICKS_PER_S, |period| period.as_secs_f64())
    }

    /// The same settings for a person who watches: in real time.
    #[cfg(feature = "window")]
    pub(super) fn for_window(&self) -> Self {
        let period = Some(Duration::from_secs_f64(self.tick_s()));
        let pace = if self.recording.is_some() { self.pace } else { Pace::Free };
        Self { pace, period, ..self.clone() }
    }

    /// Sources of the hands, the second one's where it has its own.
    pub(super) fn sources(&self) -> impl Iterator<Item = &HandRequest> {
        let second = self.second.as_ref().and_then(|second| second.request.as_ref());
        std::iter::once(&self.hand).chain(second)
    }

    /// Kind of the hand that window and page are made for: the mouse, where it moves one of two.
    #[cfg(any(feature = "window", feature = "xr"))]
    pub(super) fn choice(&self) -> HandChoice {
        let mut choices = self.sources().map(HandRequest::choice);
        let is_moved = choices.any(|choice| choice == HandChoice::Mouse);
        if is_moved { HandChoice::Mouse } else { self.hand.choice() }
    }

    /// Name of the sources in reports and recordings.
    pub(super) fn hand_name(&self) -> String {
        self.sources().map(HandRequest::to_string).collect::<Vec<_>>().join(" + ")
    }

    /// Whether a hand is that of a headset.
    #[cfg(feature = "xr")]
    pub(super) fn takes_headset(&self) -> bool {
        self.sources().any(|source| *source == HandRequest::Xr)
    }

    /// Material as the core takes it.
    ///
    /// # Errors
    /// None in practice: the plan was made with a valid material.
    #[cfg(any(feature = "window", feature = "xr"))]
    pub(super) fn elastic_material(&self) -> anyhow::Result<ElasticMaterial> {
        let Material { young, poisson } = self.first.settings.material;
        Ok(ElasticMaterial::try_new(young, poisson)?)
    }
}
