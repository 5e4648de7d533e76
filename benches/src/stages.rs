//! Measures the time of each stage that the core announces.

use std::time::Instant;

use softgrasp_core::solve::Stage;

/// Time by stage, ms; `total` also contains the work of no stage (checks, copies).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StageTimes {
    /// Assembling the stiffness matrix.
    pub assemble: f64,
    /// Fill-reducing order and symbolic analysis.
    pub order: f64,
    /// Factor or inverse.
    pub factor: f64,
    /// Right-hand side, substitution, refinement, reactions.
    pub solve: f64,
    /// Time from the beginning to the end.
    pub total: f64,
}

/// Clock that measures stages.
#[derive(Debug)]
pub struct StageWatch {
    start: Instant,
    running: Option<(Stage, Instant)>,
    times: StageTimes,
}

impl StageWatch {
    /// Clock that starts now, outside any stage.
    pub fn start() -> Self {
        Self { start: Instant::now(), running: None, times: StageTimes::default() }
    }

    /// Ends the running stage and begins another.
    pub fn begin(&mut self, stage: Stage) {
        self.end();
        self.running = Some((stage, Instant::now()));
    }

    /// Ends the running stage.
    pub fn end(&mut self) {
        if let Some((stage, start)) = self.running.take() {
            let times = &mut self.times;
            let sum = match stage {
                Stage::Assemble => &mut times.assemble,
                Stage::Order => &mut times.order,
                Stage::Factor => &mut times.factor,
                Stage::Solve => &mut times.solve,
            };
            *sum += start.elapsed().as_secs_f64() * 1e3;
        }
    }

    /// Stops the clock; returns the times.
    pub fn finish(mut self) -> StageTimes {
        self.end();
        StageTimes { total: self.start.elapsed().as_secs_f64() * 1e3, ..self.times }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_add_up_to_no_more_than_the_total() {
        let mut watch = StageWatch::start();
        let mut work = 0.0f64;
        for stage in [Stage::Assemble, Stage::Factor, Stage::Solve, Stage::Factor] {
            watch.begin(stage);
            work += (0..20_000).map(|i| f64::from(i).sqrt()).sum::<f64>();
        }
        let times = watch.finish();
        assert!(work > 0.0);
        assert_eq!(times.order, 0.0);
        assert!(times.assemble > 0.0 && times.factor > 0.0 && times.solve > 0.0);
        assert!(times.assemble + times.factor + times.solve <= times.total);
    }
}
