//! The page that explains mouse and keys (F1), and the hint that a newcomer sees first.

use egui::{Align2, Context, Grid, RichText, Ui};
use softgrasp_hand::hand_choice::HandChoice;

use super::theme;

/// What mouse and keys do whatever hand acts.
const ALWAYS: [(&str, &str); 13] = [
    ("right button", "menu"),
    ("drag", "turn the view; with a mouse hand, drag the object itself to turn it"),
    ("wheel", "zoom"),
    ("middle drag", "pan"),
    ("double click, F", "frame the scene"),
    ("K / Ctrl+Z", "keep the shape / go back to the one before"),
    ("Backspace / Home", "detach the object / return it to the origin"),
    ("Ctrl+O / Ctrl+S", "read a file / save as"),
    ("C", "next colouring: displacement, strain, stress, error"),
    ("W G H L O N", "elements, shape at rest, hand, colliders, contacts, forces"),
    ("T", "next level of the sphere tree"),
    ("P / R", "snapshot / record pictures"),
    ("F1 F2 F3", "this page, information, timings"),
];

/// What they do besides for a hand that is played.
const PLAYED: [(&str, &str); 3] =
    [("Enter", "play or pause"), (". ", "one tick"), (", ", "from the beginning")];

/// What they do besides for a hand that the mouse moves.
const MOUSE: [(&str, &str); 6] = [
    ("Space / X", "close / open all fingers (hold)"),
    ("1 … 5 (Shift)", "close (open) thumb, index, middle, ring, little finger"),
    ("drag the hand", "move it; with Shift, turn it"),
    ("wheel on the hand", "move it away or nearer"),
    ("A D, Q E, arrows", "turn and move it without the mouse"),
    ("Tab", "aim from another side"),
];

/// Shows the page.
pub fn show(context: &Context, hand: HandChoice) {
    theme::card(context, "help", Align2::CENTER_CENTER, [0.0, 0.0], |ui| {
        ui.heading("Mouse and keys");
        ui.add_space(4.0);
        rows(ui, "always", &ALWAYS);
        ui.separator();
        match hand {
            HandChoice::Scripted(_) | HandChoice::Replay => rows(ui, "played", &PLAYED),
            HandChoice::Mouse => rows(ui, "mouse", &MOUSE),
            HandChoice::Live => {}
        }
        ui.add_space(4.0);
        ui.label(theme::quiet("F1 closes this page."));
    });
}

fn rows(ui: &mut Ui, name: &str, rows: &[(&str, &str)]) {
    Grid::new(name).num_columns(2).spacing([18.0, 4.0]).show(ui, |ui| {
        for (keys, what) in rows {
            ui.label(RichText::new(*keys).strong());
            ui.label(*what);
            ui.end_row();
        }
    });
}

/// One line at the top for whoever sees the window for the first time.
pub fn hint(context: &Context, hand: HandChoice) {
    let text = match hand {
        HandChoice::Mouse => {
            "Press Reach, then hold Space or draw “close all” to grasp.  Right button: menu.  F1: help."
        }
        HandChoice::Live => {
            "Touch with index, middle and ring finger to hold, with all five to squeeze.  Right button: menu.  F1: help."
        }
        HandChoice::Replay => "A recording is played again.  Right button: menu.  F1: help.",
        HandChoice::Scripted(_) => {
            "A scripted hand grasps. Right button: menu.  Menu Hand, Mouse and keyboard: do it yourself.  F1: help."
        }
    };
    let offset = [0.0, theme::MARGIN + 48.0];
    theme::card(context, "hint", Align2::CENTER_TOP, offset, |ui| ui.label(text));
}
