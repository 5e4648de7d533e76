//! What has been done and what cannot be, in a sentence that stays for a while.

use std::time::{Duration, Instant};

use egui::{RichText, Ui};

use super::theme;

/// Sentences on the screen.
#[derive(Default)]
pub struct Notices {
    shown: Vec<(Instant, String, bool)>,
}

/// Time for which a sentence stays.
const STAYS: Duration = Duration::from_secs(7);
/// Most sentences that are shown at once.
const SHOWN_MAX: usize = 4;

impl Notices {
    /// Adds a sentence; `is_refusal` if something cannot be done.
    pub fn add(&mut self, text: impl Into<String>, is_refusal: bool) {
        let text = text.into();
        tracing::info!(text, is_refusal, "notice");
        self.shown.retain(|(_, shown, _)| *shown != text);
        self.shown.push((Instant::now(), text, is_refusal));
        let too_many = self.shown.len().saturating_sub(SHOWN_MAX);
        self.shown.drain(..too_many);
    }

    /// Adds the sentence of a result: what was done, or why it failed.
    pub fn add_result(&mut self, result: anyhow::Result<String>) {
        match result {
            Ok(text) => self.add(text, false),
            Err(error) => self.add(format!("{error:#}"), true),
        }
    }

    /// Shows the sentences; a click takes them away.
    pub fn show(&mut self, ui: &mut Ui) {
        self.shown.retain(|(since, _, _)| since.elapsed() < STAYS);
        if self.shown.is_empty() {
            return;
        }
        let clicked = theme::sheet(ui, |ui| {
            for (_, text, is_refusal) in &self.shown {
                let colour = if *is_refusal { theme::BAD } else { theme::GOOD };
                ui.label(RichText::new(text).color(colour));
            }
            ui.ui_contains_pointer() && ui.input(|input| input.pointer.primary_clicked())
        });
        if clicked {
            self.shown.clear();
        }
    }
}
