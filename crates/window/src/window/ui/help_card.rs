//! The page that explains mouse and keys (F1), and the hint that a newcomer sees first.

use egui::{Context, Grid, RichText, ScrollArea, Ui};
use softgrasp_hand::hand_request::HandChoice;

use super::theme;

/// What mouse and keys do with every hand.
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
    ("T (Shift)", "next (previous) level of the sphere tree"),
    ("P / R", "snapshot / record pictures"),
    ("F1 F2 F3 F4", "this page, information, timings, softness and size"),
];

/// What they do besides with a hand that is played.
const PLAYED: [(&str, &str); 4] = [
    ("Space (hold)", "take the hand yourself"),
    ("Enter", "play or pause"),
    (". ", "one tick"),
    (", ", "from the beginning"),
];

/// What they do besides with a hand that the mouse moves.
const MOUSE: [(&str, &str); 6] = [
    ("Space / X", "close / open all fingers (hold)"),
    ("1 … 5 (Shift)", "close (open) thumb, index, middle, ring, little finger"),
    ("drag the hand", "move it; with Shift, turn it"),
    ("wheel on the hand", "move it away or nearer"),
    ("A D, Q E, arrows", "turn and move it without the mouse"),
    ("Tab", "aim from another side"),
];

/// Shows the page of help.
pub fn show(context: &Context, hand: HandChoice) {
    let height_max = context.content_rect().height() - 130.0;
    theme::dialog(context, "help", |ui| {
        ui.heading("Mouse and keys");
        ui.add_space(4.0);
        ScrollArea::vertical().max_height(height_max).show(ui, |ui| {
            match hand {
                HandChoice::Scripted(_) | HandChoice::Replay => rows(ui, "played", &PLAYED),
                HandChoice::Mouse => rows(ui, "mouse", &MOUSE),
                HandChoice::Live => {}
            }
            ui.separator();
            rows(ui, "always", &ALWAYS);
        });
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

/// Shows what a newcomer has to know of a hand, and of an object that `is_lifted` by friction or glued to
/// the fingertips.
pub fn hint(ui: &mut Ui, hand: HandChoice, is_lifted: bool) {
    let first = match (hand, is_lifted) {
        (HandChoice::Mouse, true) => {
            "Press Reach, hold Space to pinch it, then drag the hand up to lift it."
        }
        (HandChoice::Mouse, false) => {
            "Press Reach, then hold Space or draw “close all” to squeeze."
        }
        (HandChoice::Live, true) => "Pinch it with thumb and fingers, and lift it.",
        (HandChoice::Live, false) => {
            "Touch with index, middle and ring finger to hold, with all five to squeeze."
        }
        (HandChoice::Replay, _) => "A recording is played again.",
        (HandChoice::Scripted(_), true) => {
            "A hand lifts it by itself.  Hold Space: do it yourself."
        }
        (HandChoice::Scripted(_), false) => {
            "A hand squeezes by itself.  Hold Space: do it yourself."
        }
    };
    theme::sheet(ui, |ui| ui.label(format!("{first}  Right button: menu.  F1: help.")));
}
