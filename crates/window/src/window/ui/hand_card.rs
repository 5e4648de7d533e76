//! The panel that moves the mouse hand: aim, reach, close the fingers.

use egui::{Response, Slider, Ui};
use softgrasp_grasp::hand::Finger;
use softgrasp_hand::mouse::{CLOSING_MAX, Digits, MouseInput};

use super::{places, theme};

/// How far each finger is to be closed, thumb first; see [`MouseInput`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FingerSliders {
    closing: [f64; 5],
}

impl FingerSliders {
    /// Moves the sliders of fingers that were closed by keys.
    pub fn step(&mut self, digits: Digits, by: f64) {
        for finger in Finger::ALL {
            if matches!(digits, Digits::All) || digits == Digits::One(finger) {
                let closing = &mut self.closing[finger.index()];
                *closing = (*closing + by).clamp(0.0, CLOSING_MAX);
            }
        }
    }

    /// Sets all sliders to open: the hand goes somewhere else.
    pub fn open(&mut self) {
        *self = Self::default();
    }

    fn mean(&self) -> f64 {
        self.closing.iter().sum::<f64>() / 5.0
    }

    /// Closes or opens all fingers together: those that hold something keep their lead over those that do
    /// not, until all are open or closed.
    fn shift_to(&mut self, mean: f64) {
        let by = mean - self.mean();
        let is_at_end = mean <= 0.0 || mean >= CLOSING_MAX;
        for closing in &mut self.closing {
            *closing = if is_at_end { mean } else { *closing + by }.clamp(0.0, CLOSING_MAX);
        }
    }

    /// Shows the panel; returns what was asked for.
    pub fn show(&mut self, ui: &mut Ui) -> Vec<MouseInput> {
        let mut wishes = Vec::new();
        theme::sheet(ui, |ui| {
            ui.set_width(190.0);
            ui.strong("Your hand");
            let go = [
                ("Reach", MouseInput::Reach, "goes to the object and opens"),
                ("Back off", MouseInput::Retreat, "opens and goes away"),
                ("Other side", MouseInput::AimElsewhere, "aims from another side"),
            ];
            for (name, wish, about) in go {
                if button(ui, name).on_hover_text(about).clicked() {
                    self.open();
                    wishes.push(wish);
                }
            }
            ui.separator();
            self.all(ui, &mut wishes);
            ui.separator();
            for finger in Finger::ALL {
                let name = finger.to_string();
                let closing = &mut self.closing[finger.index()];
                if slider(ui, &name, closing) {
                    wishes.push(MouseInput::CloseTo(Digits::One(finger), *closing));
                }
            }
        });
        wishes
    }

    /// Shows one slider for all fingers, which stands at their mean.
    fn all(&mut self, ui: &mut Ui, wishes: &mut Vec<MouseInput>) {
        let mut mean = self.mean();
        if slider(ui, "close all", &mut mean) {
            self.shift_to(mean);
            wishes.extend(Finger::ALL.map(|finger| {
                MouseInput::CloseTo(Digits::One(finger), self.closing[finger.index()])
            }));
        }
        ui.label(theme::quiet("1 touches, 2 squeezes").small());
    }
}

fn button(ui: &mut Ui, name: &str) -> Response {
    let wide = egui::Vec2::new(ui.available_width(), 0.0);
    let response = ui.add(egui::Button::new(name).min_size(wide));
    places::tell(ui.ctx(), name, &response);
    response
}

fn slider(ui: &mut Ui, name: &str, closing: &mut f64) -> bool {
    ui.horizontal(|ui| {
        ui.spacing_mut().slider_width = 96.0;
        let slider = Slider::new(closing, 0.0..=CLOSING_MAX).show_value(false);
        let response = ui.add(slider);
        places::tell(ui.ctx(), name, &response);
        ui.label(name);
        response.changed()
    })
    .inner
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn closing_all_does_not_open_the_three_fingers_that_hold() {
        let mut sliders = FingerSliders { closing: [0.0, 1.5, 1.5, 1.5, 0.0] };
        sliders.shift_to(sliders.mean() + 0.25);
        for (closing, expected) in sliders.closing.iter().zip([0.25, 1.75, 1.75, 1.75, 0.25]) {
            assert!((closing - expected).abs() < 1e-12, "{sliders:?}");
        }
        sliders.shift_to(0.0);
        assert_eq!(sliders.closing, [0.0; 5]);
        sliders.shift_to(CLOSING_MAX);
        assert_eq!(sliders.closing, [CLOSING_MAX; 5]);
    }
}
