//! Pictures in a build without the feature `window`: there are none, and whoever asks is told so.

use anyhow::bail;

use super::run_arguments::{RunArguments, RunPlan};
use crate::pace::Due;
use crate::run::session::Session;
use crate::run::tick_outcome::TickOutcome;

/// Never made.
pub(super) enum RunPictures {}

impl RunPictures {
    /// None.
    ///
    /// # Errors
    /// A sentence, where pictures were asked for.
    pub(super) fn start(arguments: &RunArguments, _: &RunPlan) -> anyhow::Result<Option<Self>> {
        if arguments.shown.wants_pictures() {
            bail!(
                "this build draws no pictures; build glove-client with its feature `window`, which \
                 is there by default"
            );
        }
        Ok(None)
    }

    /// Never called.
    pub(super) fn add(
        &mut self,
        _: Due,
        _: f64,
        _: &TickOutcome,
        _: &Session,
    ) -> anyhow::Result<()> {
        match *self {}
    }

    /// Never called.
    pub(super) fn finish(self) -> anyhow::Result<()> {
        match self {}
    }
}
