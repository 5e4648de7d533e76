//! The card at the end of a script: it is the person's turn.

use std::time::Duration;

use egui::Ui;

use super::{places, theme};

/// Shows the card; whether the person takes the hand. `begins_in` is how long it is until the script
/// begins anew, where it does.
pub fn show(ui: &mut Ui, object: &str, begins_in: Option<Duration>) -> bool {
    theme::sheet(ui, |ui| {
        ui.heading("Your turn");
        ui.label(format!(
            "Hold Space: the hand goes to the {object} and squeezes it, for as long as you hold."
        ));
        ui.label(theme::quiet("F4: softer, stiffer, larger."));
        ui.horizontal_wrapped(|ui| {
            let response = ui.button("Take the hand");
            places::tell(ui.ctx(), "Take the hand", &response);
            if let Some(left) = begins_in {
                let text = format!("The story begins again in {} s.", left.as_secs() + 1);
                ui.label(theme::quiet(text));
            }
            response.clicked()
        })
        .inner
    })
}
