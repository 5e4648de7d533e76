//! The legend of the colours: what they show, in which unit, from nothing to the most.

use egui::{Align2, Color32, Pos2, Rect, Sense, Ui, Vec2};

use super::theme;
use crate::view::colour_map::ColourMap;

/// Text of the legend.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LegendText {
    /// Name of the quantity that the colours show.
    pub title: String,
    /// Labels: share of the range, and the text written there.
    pub labels: Vec<(f64, String)>,
    /// A remark below the labels; empty if there is none.
    pub remark: String,
}

const SIZE: Vec2 = Vec2::new(22.0, 180.0);

/// Shows the legend.
pub fn show(ui: &mut Ui, map: &ColourMap, text: &LegendText) {
    theme::sheet(ui, |ui| {
        ui.set_max_width(150.0);
        ui.strong(&text.title);
        ui.add_space(4.0);
        let room = Vec2::new(110.0, SIZE.y + 14.0);
        let (rect, _) = ui.allocate_exact_size(room, Sense::hover());
        let bar = Rect::from_min_size(rect.min + Vec2::new(0.0, 7.0), SIZE);
        let painter = ui.painter();
        let rows = SIZE.y as usize;
        for row in 0..rows {
            let [r, g, b, _] = map.colour(1.0 - row as f64 / (rows - 1) as f64);
            let top = bar.top() + row as f32;
            let line = Rect::from_min_size(Pos2::new(bar.left(), top), Vec2::new(SIZE.x, 1.5));
            painter.rect_filled(line, 0.0, Color32::from_rgb(r, g, b));
        }
        for (share, label) in &text.labels {
            let at = Pos2::new(bar.right() + 8.0, bar.bottom() - *share as f32 * SIZE.y);
            let font = egui::FontId::proportional(13.0);
            painter.text(at, Align2::LEFT_CENTER, label, font, Color32::from_gray(40));
        }
        if !text.remark.is_empty() {
            ui.label(theme::quiet(&text.remark).small());
        }
    });
}
