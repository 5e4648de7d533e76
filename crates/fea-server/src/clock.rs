//! Measures the time of each stage of a request.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};
use std::time::Instant;

use softgrasp_core::solve::Stage;
use softgrasp_protocol::StageMs;

use crate::awaited::Awaited;

/// Stage of the newest request, to be read from outside the server.
#[derive(Clone, Debug, Default)]
pub struct StageWatch(Arc<AtomicU8>);

impl StageWatch {
    /// Name of the present stage; empty while no request is worked on.
    pub fn now(&self) -> &'static str {
        match self.0.load(Ordering::Relaxed) {
            1 => "assembling",
            2 => "ordering",
            3 => "factoring",
            4 => "solving",
            _ => "",
        }
    }

    fn set(&self, stage: Option<Stage>) {
        let number = match stage {
            None => 0,
            Some(Stage::Assemble) => 1,
            Some(Stage::Order) => 2,
            Some(Stage::Factor) => 3,
            Some(Stage::Solve) => 4,
        };
        self.0.store(number, Ordering::Relaxed);
    }
}

/// Measures the stages that the core announces, and ends work whose client has gone.
#[derive(Clone)]
pub(crate) struct StageClock {
    decoded: Instant,
    stage_ms: StageMs,
    running: Option<(Stage, Instant)>,
    watch: StageWatch,
    awaited: Awaited,
}

impl StageClock {
    /// Clock that starts with the times measured before the core was called.
    pub fn new(decode_ms: f64, queued: Instant, watch: StageWatch, awaited: Awaited) -> Self {
        let queue = ms_since(queued);
        let stage_ms = StageMs { decode: decode_ms, queue, ..StageMs::default() };
        Self { decoded: queued, stage_ms, running: None, watch, awaited }
    }

    /// Ends the running stage and begins another; unwinds if no client waits any more.
    pub fn begin(&mut self, stage: Stage) {
        self.end();
        self.awaited.go_on();
        self.watch.set(Some(stage));
        self.running = Some((stage, Instant::now()));
    }

    /// Ends the running stage.
    pub fn end(&mut self) {
        if let Some((stage, start)) = self.running.take() {
            self.watch.set(None);
            let ms = ms_since(start);
            match stage {
                Stage::Assemble => self.stage_ms.assemble += ms,
                Stage::Order => self.stage_ms.order += ms,
                Stage::Factor => self.stage_ms.factor += ms,
                Stage::Solve => self.stage_ms.solve += ms,
            }
        }
    }

    /// Returns if a client still waits for the answer; unwinds otherwise.
    pub fn go_on(&self) {
        self.awaited.go_on();
    }

    /// Whether work ends at the best that it has: its deadline is over, or no client waits any more.
    ///
    /// Units: ms since the request came; `None` for no deadline.
    pub fn is_late(&self, deadline_ms: Option<f64>) -> bool {
        self.is_abandoned() || deadline_ms.is_some_and(|deadline| self.elapsed_ms() > deadline)
    }

    /// Whether no client waits for the answer any more.
    pub fn is_abandoned(&self) -> bool {
        self.awaited.is_over()
    }

    /// Milliseconds since the request came.
    pub fn elapsed_ms(&self) -> f64 {
        self.stage_ms.decode + ms_since(self.decoded)
    }

    /// Times of all stages.
    pub fn finish(mut self) -> StageMs {
        self.end();
        self.stage_ms
    }
}

/// Milliseconds since an instant.
pub(crate) fn ms_since(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}

#[cfg(test)]
mod tests {
    use std::panic::{AssertUnwindSafe, catch_unwind};

    use super::*;
    use crate::awaited::{Abandoned, Waiting};

    #[test]
    fn stage_of_work_that_nobody_waits_for_does_not_begin() {
        let waiting = Waiting::default();
        let (queued, watch) = (Instant::now(), StageWatch::default());
        let mut clock = StageClock::new(0.0, queued, watch.clone(), waiting.awaited());
        clock.begin(Stage::Assemble);
        assert_eq!(watch.now(), "assembling");
        drop(waiting);
        let ended = catch_unwind(AssertUnwindSafe(|| clock.begin(Stage::Factor))).unwrap_err();
        assert!(ended.is::<Abandoned>());
        assert_eq!(watch.now(), "");
    }
}
