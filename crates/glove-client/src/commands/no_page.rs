//! Stand-in for the page in a build without the feature `xr`: opening it fails with a sentence.

use std::sync::mpsc::{Receiver, Sender};

use anyhow::bail;
use softgrasp_hand::joints::JointsFeed;
use softgrasp_hand::notice::Notice;
use softgrasp_window::view::control::Control;
#[cfg(feature = "window")]
use softgrasp_window::view::frame::ViewFrame;

use super::run_arguments::RunArguments;
use super::run_plan::RunPlan;
use crate::pace::Due;
use crate::run::session::Session;
use crate::run::tick_outcome::TickOutcome;

/// Type without a value: this build has no page.
pub(super) enum RunPage {}

/// Stand-in for the channels between page and ticks.
#[expect(dead_code, reason = "this build has no page that would read them")]
pub(super) struct PageTalk {
    pub(super) controls: Sender<Control>,
    pub(super) notices: Receiver<Notice>,
    pub(super) has_window: bool,
}

impl RunPage {
    /// `None`, because this build has no page.
    ///
    /// # Errors
    /// Sentence if a page was asked for.
    pub(super) fn open(arguments: &RunArguments, _: &RunPlan) -> anyhow::Result<Option<Self>> {
        if arguments.page.xr.is_some() {
            bail!(
                "this build serves no page; build glove-client with its feature `xr`, which is there \
                 by default"
            );
        }
        Ok(None)
    }

    /// Unreachable: there is no page.
    pub(super) fn joints(&self) -> JointsFeed {
        match *self {}
    }

    /// Unreachable: there is no page.
    pub(super) fn begin(
        &mut self,
        _: &RunArguments,
        _: &RunPlan,
        _: PageTalk,
    ) -> anyhow::Result<()> {
        match *self {}
    }

    /// Unreachable: there is no page.
    pub(super) fn add(&mut self, _: Due, _: f64, _: &TickOutcome, _: &Session) {
        match *self {}
    }

    /// Unreachable: there is no page.
    #[cfg(feature = "window")]
    pub(super) fn show(&mut self, _: &ViewFrame) {
        match *self {}
    }
}
