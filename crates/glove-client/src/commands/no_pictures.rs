//! Stand-in for pictures in a build without the feature `window`: asking for them fails with a sentence.

use anyhow::bail;

use super::run_arguments::RunArguments;
use super::run_plan::RunPlan;
use crate::pace::Due;
use crate::run::session::Session;
use crate::run::tick_outcome::TickOutcome;

/// Type without a value: this build draws no pictures.
pub(super) enum RunPictures {}

impl RunPictures {
    /// `None`, because this build draws no pictures.
    ///
    /// # Errors
    /// Sentence if pictures were asked for.
    pub(super) fn start(arguments: &RunArguments, _: &RunPlan) -> anyhow::Result<Option<Self>> {
        if arguments.shown.wants_pictures() {
            bail!(
                "this build draws no pictures; build glove-client with its feature `window`, which \
                 is there by default"
            );
        }
        Ok(None)
    }

    /// Unreachable: no pictures are drawn.
    pub(super) fn add(
        &mut self,
        _: Due,
        _: f64,
        _: &TickOutcome,
        _: &Session,
    ) -> anyhow::Result<()> {
        match *self {}
    }

    /// Unreachable: no pictures are drawn.
    pub(super) fn finish(self) -> anyhow::Result<()> {
        match self {}
    }
}
