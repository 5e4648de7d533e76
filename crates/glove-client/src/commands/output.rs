//! Prints the results and progress of a command, and writes its reports.

use std::io::Write as _;
use std::path::Path;
use std::time::Duration;

use anyhow::Context;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};

use crate::object::file_writing::write_file_by;

/// Writes a value as indented JSON with a final newline.
///
/// # Errors
/// Error of the operating system, with the path.
pub(crate) fn write_json(path: &Path, value: &impl serde::Serialize) -> anyhow::Result<()> {
    Ok(write_file_by(path, |file| {
        serde_json::to_writer_pretty(&mut *file, value)?;
        file.write_all(b"\n")
    })?)
}

/// Prints to standard output; a closed pipe (`| head`) is no error.
///
/// # Errors
/// Any other failure to write.
pub(crate) fn print(text: &str) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(error).context("cannot write to standard output")
        }
        _ => Ok(()),
    }
}

/// Shows the present stage of the work until it is dropped.
pub struct Progress {
    bar: ProgressBar,
}

impl Progress {
    /// Begins to show `what`; nothing is shown if standard error is not a terminal.
    pub fn start(what: &str) -> Self {
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
        if let Ok(style) = ProgressStyle::with_template("{spinner} {msg} ({elapsed})") {
            bar.set_style(style);
        }
        bar.set_message(what.to_owned());
        bar.enable_steady_tick(Duration::from_millis(120));
        Self { bar }
    }

    /// Shows the result of `now` behind the message, and calls it again whenever the line is drawn.
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

    /// Changes the message.
    pub fn now(&self, what: &str) {
        self.bar.set_message(what.to_owned());
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
