//! The status: state of the grasp, fingertips, answer, link; red where the shape is old.

use egui::{Align2, Color32, Context, Grid, RichText, Sense, Stroke, Ui, Vec2};
use softgrasp_grasp::grasp::StateName;
use softgrasp_grasp::hand::Finger;

use super::theme::{self, ACCENT, BAD, CAUTION, GOOD, IDLE, QUIET};
use crate::view::frame::{LinkHealth, ViewFrame};

/// What the card tells besides the frame.
pub struct Told<'a> {
    /// From tick to tick, s.
    pub tick_s: f64,
    /// What the server does to a new object meanwhile.
    pub preparing: &'a str,
    /// Force that a metre of arrow stands for, N/m, where arrows are shown.
    pub newtons_per_m: Option<f64>,
}

/// Shows the card at the lower left.
pub fn show(context: &Context, frame: &ViewFrame, told: &Told<'_>) {
    let Told { tick_s, preparing, newtons_per_m } = *told;
    let offset = [theme::MARGIN, -theme::MARGIN];
    theme::card(context, "status", Align2::LEFT_BOTTOM, offset, |ui| {
        ui.horizontal(|ui| {
            let (name, ground) = state(frame);
            theme::chip(ui, name, ground);
            fingertips(ui, frame.grasp.tips);
        });
        for device in &frame.grasp.silent {
            let text = format!("● the {} is silent: the hand is held", device.name());
            ui.label(RichText::new(text).color(BAD).strong());
        }
        if frame.answer_is_old() {
            let text = match frame.answer_age_ticks() {
                Some(age) => format!(
                    "● the shape is {:.0} ms older than the hand",
                    1e3 * tick_s * age as f64
                ),
                None => "● the shape does not follow the hand yet".to_owned(),
            };
            ui.label(RichText::new(text).color(BAD).strong());
        }
        if frame.server.is_preparing {
            ui.horizontal(|ui| {
                ui.spinner();
                ui.label(format!("the server prepares the object: {preparing}"));
            });
        }
        Grid::new("status grid")
            .num_columns(2)
            .spacing([14.0, 3.0])
            .show(ui, |ui| facts(ui, frame, newtons_per_m));
    });
}

fn state(frame: &ViewFrame) -> (&'static str, Color32) {
    if frame.grasp.keeping {
        return ("keeping the shape", CAUTION);
    }
    match frame.grasp.state {
        None => ("waiting for the hand", QUIET),
        Some(StateName::Free) => ("free", QUIET),
        Some(StateName::Avoiding) => ("avoiding", CAUTION),
        Some(StateName::Attached) => ("attached", ACCENT),
        Some(StateName::Deforming) => ("deforming", GOOD),
        Some(StateName::Detached) => ("detached", QUIET),
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

fn facts(ui: &mut Ui, frame: &ViewFrame, newtons_per_m: Option<f64>) {
    let mut row = |name: &str, value: RichText| {
        ui.label(theme::quiet(name));
        ui.label(value);
        ui.end_row();
    };
    let link = match frame.server.link {
        LinkHealth::Connected => GOOD,
        LinkHealth::Late => CAUTION,
        LinkHealth::Reconnecting => BAD,
    };
    row("server", RichText::new(frame.server.link.name()).color(link).strong());
    if let Some(solve) = &frame.server.solve {
        row("method", RichText::new(format!("{} ({})", solve.method, solve.element)));
        row("round trip", RichText::new(format!("{:.2} ms", solve.round_trip_ms)));
        row("residual", RichText::new(format!("{:.1e}", solve.residual_rel)));
        let bound = match (solve.error_bound_rel, &solve.why) {
            (Some(bound), _) => format!("{bound:.1e} proven"),
            (None, _) => "not proven yet".to_owned(),
        };
        row("error bound", RichText::new(bound));
    }
    if let (Some(forces), Some(per_m)) = (&frame.grasp.forces, newtons_per_m) {
        let strongest = forces.iter().map(|force| force.norm()).fold(0.0, f64::max);
        let per_cm = 0.01 * per_m;
        row(
            "forces",
            RichText::new(format!("up to {strongest:.2} N (1 cm of arrow: {per_cm:.2} N)")),
        );
    }
    let dropped = frame.server.ticks_skipped + frame.server.device_faults;
    row("dropped samples", RichText::new(dropped.to_string()));
    row("tick", RichText::new(format!("{}  ({:.1} s)", frame.tick, frame.at_s)));
}
