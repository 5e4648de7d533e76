//! Shows how far a new object is on its way to the hand, and lets it be called off.

use egui::{Context, RichText};

use super::{places, theme};

/// The steps of loading, in order: those of [`softgrasp_hand::loaded_object::LoadStage`], then the server's.
pub const STEPS: [&str; 6] = [
    "read and check the mesh",
    "build the sphere tree",
    "look for a way to grasp it",
    "connect to the server",
    "assemble, order, factor",
    "ready",
];

/// Shows the card; whether it was called off.
///
/// `step` counts in [`STEPS`].
pub fn show(context: &Context, name: &str, step: usize) -> bool {
    theme::dialog(context, "loading", |ui| {
        ui.set_min_width(280.0);
        ui.horizontal(|ui| {
            ui.spinner();
            ui.strong(format!("Loading {name}"));
        });
        for (place, what) in STEPS.into_iter().enumerate() {
            let (sign, text) = match place.cmp(&step) {
                std::cmp::Ordering::Less => ("✔", RichText::new(what).color(theme::GOOD)),
                std::cmp::Ordering::Equal => ("▸", RichText::new(what).strong()),
                std::cmp::Ordering::Greater => (" ", theme::quiet(what)),
            };
            ui.horizontal(|ui| {
                ui.monospace(sign);
                ui.label(text);
            });
        }
        let response = ui.button("Cancel");
        places::tell(ui.ctx(), "Cancel loading", &response);
        response.clicked()
    })
}
