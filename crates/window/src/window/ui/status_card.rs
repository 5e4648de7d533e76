//! The status: what the hand does, fingertips, grip force; red where the shape is old. Everything
//! that only somebody who measures wants to know is on F2.

use egui::{Align2, Color32, Context, RichText, Sense, Stroke, Ui, Vec2};
use softgrasp_grasp::grasp::StateName;
use softgrasp_grasp::hand::Finger;

use super::theme::{self, ACCENT, BAD, CAUTION, GOOD, IDLE, QUIET};
use crate::view::frame::{LinkHealth, ViewFrame};

/// What the card tells besides the tick.
pub struct Told {
    /// Time from tick to tick, s.
    pub tick_s: f64,
    /// Force that a metre of arrow stands for, N/m, where arrows are shown.
    pub newtons_per_m: Option<f64>,
    /// Height that the time line takes below the card, points.
    pub above: f32,
}

/// Shows the card at the lower left.
pub fn show(context: &Context, frame: &ViewFrame, told: &Told) {
    theme::low_card(context, "status", theme::MARGIN + told.above, |ui| {
        ui.set_max_width(300.0);
        ui.horizontal(|ui| {
            let (name, ground) = state(frame);
            theme::chip(ui, name, ground);
            fingertips(ui, frame.grasp.tips);
            if frame.second_hand.is_some() {
                ui.add_space(4.0);
                fingertips(ui, frame.grasp.second_tips);
            }
        });
        for device in &frame.grasp.silent {
            let mut hands = frame.hands().map(|hand| hand.dimensions.handedness);
            let what = match hands.find(|side| device.side.is_none_or(|silent| silent == *side)) {
                Some(_) => "the hand stays where it was",
                None => "there is no hand yet",
            };
            alarm(ui, format!("The {} is silent: {what}.", device.name()));
        }
        if frame.server.link == LinkHealth::Reconnecting {
            alarm(ui, "Looking for the server. What you see waits for it.".to_owned());
        } else if frame.answer_is_old() {
            alarm(
                ui,
                match frame.answer_age_ticks() {
                    Some(age) => {
                        let age_ms = 1e3 * told.tick_s * age as f64;
                        format!("The shape is {age_ms:.0} ms behind the hand.")
                    }
                    None => "The shape does not follow the hand yet.".to_owned(),
                },
            );
        }
        if let Some(newtons) = frame.grip_newtons() {
            ui.label(RichText::new(format!("grip force {newtons:.2} N")).strong());
            if let Some(per_m) = told.newtons_per_m {
                let text = format!("1 cm of arrow is {:.2} N", 0.01 * per_m);
                ui.label(theme::quiet(text).small());
            }
        }
    });
}

fn alarm(ui: &mut Ui, text: String) {
    ui.label(RichText::new(format!("● {text}")).color(BAD).strong());
}

fn state(frame: &ViewFrame) -> (&'static str, Color32) {
    if frame.grasp.keeping {
        return ("keeping the shape", CAUTION);
    }
    match frame.grasp.state {
        None => ("waiting for the hand", QUIET),
        Some(StateName::Free) => ("not touched", QUIET),
        Some(StateName::Avoiding) => ("close by", CAUTION),
        Some(StateName::Attached) => ("held", ACCENT),
        Some(StateName::Deforming) => ("squeezed", GOOD),
        Some(StateName::Detached) => ("let go", QUIET),
    }
}

/// One dot for each fingertip, filled where it touches.
fn fingertips(ui: &mut Ui, tips: [bool; 5]) {
    for (finger, touches) in Finger::ALL.into_iter().zip(tips) {
        let (rect, response) = ui.allocate_exact_size(Vec2::splat(15.0), Sense::hover());
        let painter = ui.painter();
        let colour = if touches { ACCENT } else { IDLE };
        painter.circle(rect.center(), 6.5, colour, Stroke::NONE);
        let letter = ["T", "I", "M", "R", "L"][finger.index()];
        let on = if touches { Color32::WHITE } else { QUIET };
        let font = egui::FontId::proportional(9.5);
        painter.text(rect.center(), Align2::CENTER_CENTER, letter, font, on);
        let what = if touches { "touches" } else { "touches nothing" };
        response.on_hover_text(format!("{finger}: {what}"));
    }
}
