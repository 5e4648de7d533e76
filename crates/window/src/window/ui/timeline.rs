//! The time line of a run that is played: play, pause, one tick, and any tick that was seen.

use egui::{Align2, Color32, Context, Pos2, Rect, RichText, Sense, Stroke, Ui, Vec2};

use super::{places, theme};
use crate::view::action::Action;
use crate::view::frame::News;
use crate::view::history::History;

/// State of the run that the time line shows.
pub struct Playing {
    /// Whether the run is paused.
    pub is_paused: bool,
    /// Number of the tick that is looked at, where it is not the newest.
    pub looked_at: Option<u64>,
    /// Number of the tick from which the person counts.
    pub first_tick: u64,
}

/// What the person asked for on the time line.
pub enum TimelineWish {
    /// An action, such as play, pause or one tick.
    Do(Action),
    /// To look at the tick of this number.
    LookAt(u64),
    /// To look at the newest tick again.
    Newest,
}

/// Width that the card's own buttons take beside the track, points.
const TAKEN: f32 = 340.0;
/// Width of the number of the tick, points.
const TICKS_WIDTH: f32 = 48.0;
/// Height of the card with its margin, points: what stands at the bottom stands above it.
pub const HEIGHT: f32 = 62.0;

/// Shows the time line at the bottom; returns what the person asked for.
pub fn show(context: &Context, history: &History, playing: &Playing) -> Option<TimelineWish> {
    let (first, last) = history.ticks()?;
    let offset = [0.0, -theme::MARGIN];
    theme::card(context, "time line", Align2::CENTER_BOTTOM, offset, |ui| {
        let mut wish = None;
        ui.horizontal(|ui| {
            let mut button = |ui: &mut Ui, sign: &str, action: Action| {
                let response = ui.button(sign).on_hover_text(action.label());
                places::tell(ui.ctx(), &action.label(), &response);
                if response.clicked() {
                    wish = Some(TimelineWish::Do(action));
                }
            };
            button(ui, "⏮", Action::Restart);
            button(ui, if playing.is_paused { "▶" } else { "⏸" }, Action::PlayOrPause);
            button(ui, "⏭", Action::Step);
            let now = playing.looked_at.unwrap_or(last);
            if let Some(tick) = track(ui, history.marks(), (first, last), now, playing.first_tick) {
                wish = Some(TimelineWish::LookAt(tick));
            }
            // Of one width, so that the line stays where it is while the ticks are counted.
            let ticks = format!("{}", now.saturating_sub(playing.first_tick));
            ui.add_sized([TICKS_WIDTH, 20.0], egui::Label::new(RichText::new(ticks).monospace()));
            let newest = ui.add_enabled(playing.looked_at.is_some(), egui::Button::new("newest"));
            if newest.clicked() {
                wish = Some(TimelineWish::Newest);
            }
        });
        wish
    })
}

/// Shows the line with its marks; returns the tick that was dragged to.
fn track(
    ui: &mut Ui,
    marks: &[News],
    (first, last): (u64, u64),
    now: u64,
    first_tick: u64,
) -> Option<u64> {
    let width = (ui.ctx().content_rect().width() - TAKEN).clamp(120.0, 1400.0);
    let (rect, response) = ui.allocate_exact_size(Vec2::new(width, 26.0), Sense::click_and_drag());
    places::tell(ui.ctx(), "time line", &response);
    let span = (last - first).max(1) as f32;
    let x = |tick: u64| rect.left() + rect.width() * tick.saturating_sub(first) as f32 / span;
    let painter = ui.painter();
    let line = Rect::from_center_size(rect.center(), Vec2::new(rect.width(), 4.0));
    painter.rect_filled(line, 2.0, theme::IDLE);
    let done = Rect::from_min_max(line.min, Pos2::new(x(now), line.max.y));
    painter.rect_filled(done, 2.0, theme::ACCENT);
    for mark in marks {
        let at = x(mark.tick.clamp(first, last));
        let stroke = Stroke::new(2.0, colour(&mark.text));
        painter.line_segment(
            [Pos2::new(at, rect.top() + 3.0), Pos2::new(at, rect.bottom() - 3.0)],
            stroke,
        );
    }
    painter.circle(
        Pos2::new(x(now), rect.center().y),
        7.0,
        Color32::WHITE,
        Stroke::new(2.0, theme::ACCENT),
    );
    let pointer = response.interact_pointer_pos();
    let near = response
        .hover_pos()
        .and_then(|at| marks.iter().rfind(|mark| (x(mark.tick) - at.x).abs() < 5.0));
    if let Some(mark) = near {
        response.on_hover_text(format!(
            "tick {}: {}",
            mark.tick.saturating_sub(first_tick),
            mark.text
        ));
    }
    let share = (pointer?.x - rect.left()) / rect.width();
    Some(first + (f64::from(share.clamp(0.0, 1.0)) * (last - first) as f64).round() as u64)
}

/// Colour of a mark: entering a state, touching and leaving look different.
fn colour(text: &str) -> Color32 {
    match text {
        _ if text.starts_with("entered") => theme::ACCENT,
        _ if text.ends_with("left") || text == "released" => theme::CAUTION,
        "shape kept" => theme::GOOD,
        _ => Color32::from_rgb(0x8C, 0x96, 0xA3),
    }
}
