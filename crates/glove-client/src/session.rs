//! A run from its first tick to its report: hand, grasp loop and report, one tick at a time.

use std::time::Duration;

use crate::grasp_loop::GraspLoop;
use crate::pace::Due;
use crate::rest_shape::ObjectError;
use crate::run_report::RunReport;
use crate::scripted::{ScriptedHand, Seen};
use crate::soft_object::SoftObject;
use crate::tick_budget::{LIMIT, Priority, TickBudget};
use crate::tick_outcome::TickOutcome;

/// A run of a scripted hand. It has no clock: whoever plays it says which tick is due.
pub struct Session {
    grasp_loop: GraspLoop,
    hand: ScriptedHand,
    seen: Seen,
    report: RunReport,
    budget: TickBudget,
    ends_with_script: bool,
}

impl Session {
    /// A run that has not begun. The thread that plays it gets the priority with the first tick.
    /// It ends with the script, or goes on with a hand that rests.
    pub fn new(
        grasp_loop: GraspLoop,
        hand: ScriptedHand,
        report: RunReport,
        priority: Priority,
        ends_with_script: bool,
    ) -> Self {
        let (seen, budget) = (Seen::default(), TickBudget::new(priority));
        Self { grasp_loop, hand, seen, report, budget, ends_with_script }
    }

    /// Plays the tick that is due; `None` when the script is over. Ticks that were missed are
    /// counted; the hand is where it is now.
    ///
    /// Units: `now_s` s on the client's clock.
    ///
    /// # Errors
    /// [`ObjectError`] when the object cannot be shown any more.
    pub fn play(&mut self, due: Due, now_s: f64) -> Result<Option<TickOutcome>, ObjectError> {
        self.budget.begin();
        let object = self.grasp_loop.object();
        let sent = self.hand.next_after(due.skipped + 1, &self.seen, object);
        if sent.over && self.ends_with_script {
            self.report.add_skipped(due.skipped);
            return Ok(None);
        }
        let outcome = self.grasp_loop.tick(due.tick, now_s, &sent)?;
        self.seen = outcome.seen;
        self.report.add(due, now_s, &outcome);
        let computed = self.budget.end();
        self.report.add_computed(computed);
        Ok(Some(outcome))
    }

    /// Counts ticks that were missed at the end, after which none is played.
    pub fn skip(&mut self, ticks: u64) {
        self.report.add_skipped(ticks);
    }

    /// The grasp loop.
    pub fn grasp_loop(&self) -> &GraspLoop {
        &self.grasp_loop
    }

    /// The hand.
    pub fn hand(&self) -> &ScriptedHand {
        &self.hand
    }

    /// Waits until the server has answered all, at most so long.
    pub fn wait_idle(&self, at_most: Duration) -> bool {
        self.grasp_loop.wait_idle(at_most)
    }

    /// Waits until nothing is under way but the planning of the hand; see [`GraspLoop::settle`].
    pub fn settle(&mut self, at_most: Duration) {
        self.grasp_loop.settle(at_most);
    }

    /// Ends the run; `interrupted` if the user did.
    ///
    /// # Errors
    /// As [`Session::play`].
    pub fn finish(mut self, interrupted: bool) -> Result<RunReport, ObjectError> {
        self.report.add_last(&self.grasp_loop.take_last()?);
        self.report.interrupted = interrupted;
        self.report.finish(self.grasp_loop.reader().faults(), &self.budget);
        Ok(self.report)
    }
}

/// Real-time priority for the ticks of an object that follows its answers within half of what such
/// a thread may compute at a time; the other half is for all else that a tick does.
///
/// # Errors
/// [`ObjectError`] when the object cannot be shown.
pub fn priority_for(object: &mut SoftObject) -> Result<Priority, ObjectError> {
    let mut trial = TickBudget::new(Priority::Ordinary);
    let still = vec![[0.0; 3]; object.surface().nodes.len()];
    // The second time the memory is there.
    for _ in 0..2 {
        trial.begin();
        object.apply_to_surface(&still)?;
        let computed = trial.end();
        object.relax()?;
        if computed <= LIMIT / 2 {
            return Ok(Priority::RealTime);
        }
    }
    Ok(Priority::Ordinary)
}
