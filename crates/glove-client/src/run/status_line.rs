//! Shows tick, grasp state and the last solve on one line of the terminal during a run, and sentences
//! above it.

use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use softgrasp_protocol::solve_report::SolveSummary;

use crate::run::tick_outcome::TickOutcome;

/// Status line of a run; nothing is written if standard error is not a terminal.
pub struct StatusLine {
    bar: ProgressBar,
    drawn: Option<Instant>,
    last_solve: Option<SolveSummary>,
}

/// Shortest time between two drawings, as fast as a person reads.
const DRAW_EVERY: Duration = Duration::from_millis(50);

impl StatusLine {
    /// Empty status line.
    pub fn start() -> Self {
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
        if let Ok(style) = ProgressStyle::with_template("{msg}") {
            bar.set_style(style);
        }
        Self { bar, drawn: None, last_solve: None }
    }

    /// Function that writes sentences above the line.
    pub fn speaker(&self) -> impl Fn(&str) + Send + 'static {
        let bar = self.bar.clone();
        move |text| bar.suspend(|| eprintln!("glove-client: {text}"))
    }

    /// Shows the state after a tick; of several objects that of the one that was touched last.
    pub fn show(&mut self, tick: u64, outcome: &TickOutcome) {
        let outcome = outcome.part(outcome.touched);
        if let Some((_, solve)) = outcome.answers.last() {
            self.last_solve = Some(solve.clone());
        }
        if self.bar.is_hidden() || self.drawn.is_some_and(|drawn| drawn.elapsed() < DRAW_EVERY) {
            return;
        }
        self.drawn = Some(Instant::now());
        let state = outcome.state.map_or("waiting for the hand".to_owned(), |s| s.to_string());
        // One letter a finger that touches, a dot for one that does not.
        let letters = |tips: [bool; 5]| -> String {
            "TIMRL".chars().zip(tips).map(|(c, on)| if on { c } else { '.' }).collect()
        };
        let mut tips = letters(outcome.tips);
        if outcome.second_tips.contains(&true) {
            tips = format!("{tips} {}", letters(outcome.second_tips));
        }
        let solver = self.last_solve.as_ref().map_or("no solve yet".to_owned(), |s| {
            let report = &s.report;
            format!(
                "{}  {:.2} ms  residual {:.1e}",
                report.method, s.round_trip_ms, report.residual_rel
            )
        });
        self.bar.set_message(format!("tick {tick:>5}  {state:<10} tips {tips}  {solver}"));
    }
}

impl Drop for StatusLine {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
