//! The cards of what is waited for: a new object on its way, the server that prepares it, the person whose
//! turn it is.

use std::time::Duration;

use egui::{Context, RichText, Ui};

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

/// Shows the card of an object that is being loaded; returns whether it was called off.
///
/// `step` counts in [`STEPS`].
pub fn loading(context: &Context, name: &str, step: usize) -> bool {
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

/// What the card of a server that prepares an object says.
pub struct Preparing<'a> {
    /// Name of the object.
    pub object: &'a str,
    /// Number of nodes of its mesh.
    pub nodes: usize,
    /// Stage of the server's work, in a word.
    pub stage: &'a str,
    /// Time for which the server has been preparing.
    pub since: Duration,
    /// Whether a script waits for the object.
    pub is_awaited: bool,
}

/// Time within which a server that prepares is not told of.
pub const BRIEF: Duration = Duration::from_millis(700);

/// Shows the card of a server that prepares an object.
pub fn preparing(ui: &mut Ui, preparing: &Preparing<'_>) {
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

/// Shows the card of the person's turn; returns whether the person takes the hand. `begins_in` is the
/// time until the script begins anew, where it does.
pub fn turn(ui: &mut Ui, object: &str, begins_in: Option<Duration>) -> bool {
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
