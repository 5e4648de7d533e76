//! Shows on a terminal that long work goes on; writes nothing into a pipe or a file.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};

/// Shows what is being done until it is dropped.
pub struct Progress {
    bar: ProgressBar,
}

impl Progress {
    /// Begins; nothing is shown when standard error is not a terminal.
    pub fn start(what: &str) -> Self {
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
        if let Ok(style) = ProgressStyle::with_template("{spinner} {msg} ({elapsed})") {
            bar.set_style(style);
        }
        bar.set_message(what.to_owned());
        bar.enable_steady_tick(Duration::from_millis(120));
        Self { bar }
    }

    /// Shows behind the message what `now` returns, and asks it again whenever the line is drawn.
    pub fn watch(&self, now: impl Fn() -> &'static str + Send + Sync + Clone + 'static) {
        let template = ProgressStyle::with_template("{spinner} {msg} {now} ({elapsed})");
        if let Ok(style) = template {
            let write = move |_: &ProgressState, text: &mut dyn std::fmt::Write| {
                // A bar that cannot be drawn is no reason to stop.
                let _ = text.write_str(now());
            };
            self.bar.set_style(style.with_key("now", write));
        }
    }

    /// Says what is done now.
    pub fn now(&self, what: &str) {
        self.bar.set_message(what.to_owned());
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
