//! Mouse and keys: from the window's events to gestures and wishes.

use std::time::{Duration, Instant};

use kiss3d::prelude::{Action as Press, Key, Modifiers, MouseButton, WindowEvent};
use nalgebra::Vector2;

use crate::view::action::Action;
use crate::view::toggle::{Page, Toggle};

/// What the mouse did to the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Gesture {
    /// A button went down at a place; what lies there decides what a drag moves.
    Began(DragButton, Vector2<f64>),
    /// The mouse was dragged by so much, with Shift or without.
    Dragged(DragButton, Vector2<f64>, bool),
    /// The button went up.
    Ended,
    /// The right button was clicked.
    MenuAsked(Vector2<f64>),
    /// The left button was clicked twice.
    DoubleClicked,
    /// The wheel was turned by so many notches, over a place.
    Scrolled(f64, Vector2<f64>),
}

/// Mouse buttons that drag.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DragButton {
    /// The left button: it turns.
    Left,
    /// The middle button: it pans.
    Middle,
}

/// State of the mouse: buttons that are down, and the last click.
#[derive(Default)]
pub struct Mouse {
    at: Vector2<f64>,
    dragged: Option<DragButton>,
    /// Where the right button went down.
    right_down: Option<Vector2<f64>>,
    clicked: Option<(Instant, Vector2<f64>)>,
}

/// Two clicks within this time are a double click.
const DOUBLE_CLICK: Duration = Duration::from_millis(350);
/// Largest way of the mouse that is still a click, pixels.
const CLICK_MOVES_MAX: f64 = 5.0;
/// Amount that the window reports for one notch of the wheel.
const NOTCH: f64 = 10.0;

impl Mouse {
    /// Takes an event of the window and returns its gesture; `is_taken` if a menu or card lies under the
    /// pointer.
    pub fn take(&mut self, event: &WindowEvent, is_taken: bool) -> Option<Gesture> {
        match *event {
            WindowEvent::CursorPos(x, y, modifiers) => {
                let at = Vector2::new(x, y);
                let by = at - self.at;
                self.at = at;
                let shift = modifiers.contains(Modifiers::Shift);
                self.dragged.map(|button| Gesture::Dragged(button, by, shift))
            }
            WindowEvent::MouseButton(button, Press::Press, _) if !is_taken => self.press(button),
            WindowEvent::MouseButton(button, Press::Release, _) => self.release(button),
            WindowEvent::Scroll(_, y, _) if !is_taken => {
                Some(Gesture::Scrolled(y / NOTCH, self.at))
            }
            _ => None,
        }
    }

    fn press(&mut self, button: MouseButton) -> Option<Gesture> {
        match button {
            MouseButton::Button1 => {
                let double = self.clicked.take().is_some_and(|(then, at)| {
                    then.elapsed() < DOUBLE_CLICK && (at - self.at).norm() < CLICK_MOVES_MAX
                });
                if double {
                    return Some(Gesture::DoubleClicked);
                }
                self.clicked = Some((Instant::now(), self.at));
                self.dragged = Some(DragButton::Left);
                Some(Gesture::Began(DragButton::Left, self.at))
            }
            MouseButton::Button3 => {
                self.dragged = Some(DragButton::Middle);
                Some(Gesture::Began(DragButton::Middle, self.at))
            }
            MouseButton::Button2 => {
                self.right_down = Some(self.at);
                None
            }
            _ => None,
        }
    }

    fn release(&mut self, button: MouseButton) -> Option<Gesture> {
        if button == MouseButton::Button2 {
            let down = self.right_down.take()?;
            let is_click = (down - self.at).norm() < CLICK_MOVES_MAX;
            return is_click.then_some(Gesture::MenuAsked(self.at));
        }
        self.dragged.take().map(|_| Gesture::Ended)
    }
}

/// The wish of a key that was pressed.
pub fn wish_of_key(key: Key, modifiers: Modifiers) -> Option<Action> {
    let ctrl = modifiers.contains(Modifiers::Control);
    Some(match (key, ctrl) {
        (Key::O, true) => Action::ReadFile,
        (Key::S, true) => Action::SaveAs,
        (Key::Z, true) => Action::UndoKeepShape,
        (Key::Q, true) => Action::Exit,
        (_, true) => return None,
        (Key::K, _) => Action::KeepShape,
        (Key::Back, _) => Action::Detach,
        (Key::Home, _) => Action::ReturnHome,
        (Key::P, _) => Action::Snapshot,
        (Key::R, _) => Action::Record,
        (Key::C, _) => Action::NextShading,
        (Key::T, _) if modifiers.contains(Modifiers::Shift) => Action::LastSphereLevel,
        (Key::T, _) => Action::NextSphereLevel,
        (Key::F, _) => Action::FrameAll,
        (Key::Return, _) => Action::PlayOrPause,
        (Key::Period, _) => Action::Step,
        (Key::Comma, _) => Action::Restart,
        (Key::W, _) => Action::Toggle(Toggle::Wireframe),
        (Key::G, _) => Action::Toggle(Toggle::Ghost),
        (Key::H, _) => Action::Toggle(Toggle::Skin),
        (Key::L, _) => Action::Toggle(Toggle::Colliders),
        (Key::O, _) => Action::Toggle(Toggle::Contacts),
        (Key::N, _) => Action::Toggle(Toggle::Forces),
        (Key::F1, _) => Action::Page(Page::Help),
        (Key::F2, _) => Action::Page(Page::Information),
        (Key::F3, _) => Action::Page(Page::Timings),
        (Key::F4, _) => Action::Page(Page::Softness),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f64, y: f64) -> WindowEvent {
        WindowEvent::CursorPos(x, y, Modifiers::empty())
    }

    fn button(button: MouseButton, press: Press) -> WindowEvent {
        WindowEvent::MouseButton(button, press, Modifiers::empty())
    }

    #[test]
    fn right_click_asks_for_the_menu_and_a_right_drag_does_not() {
        let mut mouse = Mouse::default();
        mouse.take(&at(10.0, 10.0), false);
        mouse.take(&button(MouseButton::Button2, Press::Press), false);
        let asked = mouse.take(&button(MouseButton::Button2, Press::Release), false);
        assert_eq!(asked, Some(Gesture::MenuAsked(Vector2::new(10.0, 10.0))));
        mouse.take(&button(MouseButton::Button2, Press::Press), false);
        mouse.take(&at(60.0, 10.0), false);
        assert_eq!(mouse.take(&button(MouseButton::Button2, Press::Release), false), None);
    }

    #[test]
    fn drag_that_began_on_a_card_moves_nothing() {
        let mut mouse = Mouse::default();
        mouse.take(&at(0.0, 0.0), false);
        assert_eq!(mouse.take(&button(MouseButton::Button1, Press::Press), true), None);
        assert_eq!(mouse.take(&at(9.0, 0.0), true), None);
        mouse.take(&button(MouseButton::Button1, Press::Release), true);
        mouse.take(&button(MouseButton::Button1, Press::Press), false);
        let dragged = mouse.take(&at(12.0, 4.0), true);
        let by = Vector2::new(3.0, 4.0);
        assert_eq!(dragged, Some(Gesture::Dragged(DragButton::Left, by, false)));
        assert_eq!(
            mouse.take(&button(MouseButton::Button1, Press::Release), true),
            Some(Gesture::Ended)
        );
        assert_eq!(mouse.take(&at(20.0, 4.0), false), None);
    }

    #[test]
    fn two_clicks_at_one_place_are_a_double_click() {
        let mut mouse = Mouse::default();
        for expected in [Gesture::Began(DragButton::Left, Vector2::zeros()), Gesture::DoubleClicked]
        {
            assert_eq!(
                mouse.take(&button(MouseButton::Button1, Press::Press), false),
                Some(expected)
            );
            mouse.take(&button(MouseButton::Button1, Press::Release), false);
        }
    }
}
