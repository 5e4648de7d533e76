//! The page in a build without the feature `xr`: there is none, and whoever asks is told so.

use std::sync::mpsc::{Receiver, Sender};

use anyhow::bail;
use softgrasp_hand::joints::JointsFeed;
use softgrasp_hand::notice::Notice;
use softgrasp_window::view::control::Control;
#[cfg(feature = "window")]
use softgrasp_window::view::frame::ViewFrame;

use super::run_arguments::{RunArguments, RunPlan};
use crate::pace::Due;
use crate::run::session::Session;
use crate::run::tick_outcome::TickOutcome;

/// Never made.
pub(super) enum RunPage {}

/// Nobody to talk to.
#[expect(dead_code, reason = "this build has no page that would read them")]
pub(super) struct PageTalk {
    pub(super) controls: Sender<Control>,
    pub(super) notices: Receiver<Notice>,
    pub(super) has_window: bool,
}

impl RunPage {
    /// None.
    ///
    /// # Errors
    /// A sentence, where a page was asked for.
    pub(super) fn open(arguments: &RunArguments, _: &RunPlan) -> anyhow::Result<Option<Self>> {
        if arguments.page.xr.is_some() {
            bail!(
                "this build serves no page; build glove-client with its feature `xr`, which is there \
                 by default"
            );
        }
        Ok(None)
    }

    /// Never called.
    pub(super) fn joints(&self) -> JointsFeed {
        match *self {}
    }

    /// Never called.
    pub(super) fn begin(
        &mut self,
        _: &RunArguments,
        _: &RunPlan,
        _: PageTalk,
    ) -> anyhow::Result<()> {
        match *self {}
    }

    /// Never called.
    pub(super) fn add(&mut self, _: Due, _: f64, _: &TickOutcome, _: &Session) {
        match *self {}
    }

    /// Never called.
    #[cfg(feature = "window")]
    pub(super) fn show(&mut self, _: &ViewFrame) {
        match *self {}
    }
}
