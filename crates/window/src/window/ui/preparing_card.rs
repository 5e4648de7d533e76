//! The card that says what the server does to an object before it can be squeezed.

use std::time::Duration;

use egui::Ui;

use super::{places, theme};

/// What a card of a server that prepares says.
pub struct Preparing<'a> {
    /// The object.
    pub object: &'a str,
    /// Nodes of its mesh.
    pub nodes: usize,
    /// What the server is at, in a word.
    pub stage: &'a str,
    /// How long it has been at it.
    pub since: Duration,
    /// Whether a script waits for it.
    pub is_awaited: bool,
}

/// A server that is done within this time is not told of.
pub const BRIEF: Duration = Duration::from_millis(700);

/// Shows the card.
pub fn show(ui: &mut Ui, preparing: &Preparing<'_>) {
    let Preparing { object, nodes, stage, since, is_awaited } = preparing;
    theme::sheet(ui, |ui| {
        ui.horizontal(|ui| {
            ui.spinner();
            let text = format!("Preparing the {object} ({nodes} nodes): {} s", since.as_secs());
            let response = ui.strong(text);
            places::tell(ui.ctx(), "preparing", &response);
        });
        if !stage.is_empty() {
            ui.label(theme::quiet(format!("The server is {stage}.")));
        }
        if *is_awaited {
            ui.label(theme::quiet("The hand waits until the object can be squeezed."));
        }
    });
}
