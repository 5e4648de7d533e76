//! The times of the answers, stage by stage, as a small running graph (F3).

use std::collections::VecDeque;

use egui::{Align2, Color32, Pos2, Rect, Sense, Shape, Stroke, Ui, Vec2};

use super::theme;
use crate::view::frame::TickTiming;
use crate::view::nice_number::nice_above;

/// The newest times of answers, and their graph.
#[derive(Default)]
pub struct Timings {
    newest: VecDeque<TickTiming>,
}

/// Number of answers in the graph.
const KEPT: usize = 240;
/// Colour and name of each stage, in the order in which they happen.
const STAGES: [(Color32, &str); 6] = [
    (Color32::from_rgb(0x9A, 0xA5, 0xB1), "way"),
    (Color32::from_rgb(0xE0, 0xA0, 0x30), "queue"),
    (Color32::from_rgb(0x6A, 0x51, 0xA3), "assemble, order"),
    (Color32::from_rgb(0xC6, 0x4B, 0x38), "factor"),
    (Color32::from_rgb(0x1F, 0x78, 0xB4), "solve"),
    (Color32::from_rgb(0x4D, 0xA6, 0x6E), "decode, encode"),
];

impl Timings {
    /// Adds the times of answers.
    pub fn add(&mut self, timings: &[TickTiming]) {
        self.newest.extend(timings);
        while self.newest.len() > KEPT {
            self.newest.pop_front();
        }
    }

    /// Shows the graph.
    pub fn show(&self, ui: &mut Ui, fps: f64) {
        theme::sheet(ui, |ui| {
            ui.set_width(300.0);
            ui.horizontal(|ui| {
                ui.strong("Times of the answers");
                ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                    ui.label(theme::quiet(format!("{fps:.0} pictures/s")));
                });
            });
            match self.newest.back() {
                Some(last) => {
                    let median = self.median();
                    let text = format!("last {:.2} ms, median {median:.2} ms", last.round_trip);
                    ui.label(theme::quiet(text));
                    self.graph(ui);
                    legend(ui);
                }
                None => {
                    ui.label(theme::quiet("no answer yet: nothing is being deformed"));
                }
            }
        });
    }

    fn median(&self) -> f64 {
        let mut all: Vec<f64> = self.newest.iter().map(|t| t.round_trip).collect();
        all.sort_by(f64::total_cmp);
        all.get(all.len() / 2).copied().unwrap_or(0.0)
    }

    fn graph(&self, ui: &mut Ui) {
        let (rect, _) = ui.allocate_exact_size(Vec2::new(300.0, 90.0), Sense::hover());
        let painter = ui.painter_at(rect);
        painter.rect_filled(rect, 3.0, Color32::from_rgb(0xF3, 0xF5, 0xF8));
        let top = self.top_ms();
        let width = rect.width() / KEPT as f32;
        for (place, timing) in self.newest.iter().enumerate() {
            let left = rect.right() - width * (self.newest.len() - place) as f32;
            let mut base = rect.bottom();
            for (ms, (colour, _)) in stages(timing).into_iter().zip(STAGES) {
                let height = (ms / top) as f32 * rect.height();
                let bar = Rect::from_min_max(
                    Pos2::new(left, base - height),
                    Pos2::new(left + width.max(1.0), base),
                );
                painter.rect_filled(bar, 0.0, colour);
                base -= height;
            }
        }
        let line = rect.top() + 0.5;
        painter.add(Shape::line_segment(
            [Pos2::new(rect.left(), line), Pos2::new(rect.right(), line)],
            Stroke::new(1.0, Color32::from_gray(205)),
        ));
        let font = egui::FontId::proportional(11.0);
        let at = rect.left_top() + Vec2::new(4.0, 2.0);
        painter.text(at, Align2::LEFT_TOP, format!("{top} ms"), font, theme::QUIET);
    }

    /// Height of the graph: the next of 1, 2, 5 × 10ⁿ above nearly all answers.
    fn top_ms(&self) -> f64 {
        let mut all: Vec<f64> = self.newest.iter().map(|t| t.round_trip).collect();
        all.sort_by(f64::total_cmp);
        nice_above(all.get(all.len() * 49 / 50).copied().unwrap_or(1.0).max(0.01))
    }
}

fn stages(timing: &TickTiming) -> [f64; 6] {
    [timing.way(), timing.queue, timing.prepare, timing.factor, timing.solve, timing.codec]
}

fn legend(ui: &mut Ui) {
    ui.horizontal_wrapped(|ui| {
        for (colour, name) in STAGES {
            let (rect, _) = ui.allocate_exact_size(Vec2::splat(10.0), Sense::hover());
            ui.painter().rect_filled(rect, 2.0, colour);
            ui.label(theme::quiet(name).small());
        }
    });
}
