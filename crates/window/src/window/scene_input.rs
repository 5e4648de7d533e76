//! What mouse and keys do to scene, hand and window.

use std::time::Instant;

use kiss3d::prelude::{Action as Press, Key, Modifiers, WindowEvent};
use nalgebra::Vector2;
use softgrasp_hand::hand_choice::HandChoice;
use softgrasp_hand::mouse::MouseInput;

use super::app::App;
use super::grips::Grip;
use super::input::{DragButton, Gesture, wish_of_key};

impl App {
    /// Takes mouse and keys.
    pub(super) fn take_events(&mut self) {
        let mut events: Vec<WindowEvent> = Vec::new();
        let mut ctrl = [Key::LControl, Key::RControl]
            .into_iter()
            .any(|key| self.window.get_key(key) == Press::Press);
        for mut event in self.window.events().iter() {
            // A shortcut is no letter, also where its keys are up again before it is heard of.
            if let WindowEvent::Key(_, Press::Press, modifiers) = event.value {
                ctrl |= modifiers.contains(Modifiers::Control);
            }
            event.inhibited |= ctrl && matches!(event.value, WindowEvent::Char(_));
            events.push(event.value);
        }
        let on_panel = self.window.is_egui_capturing_mouse();
        // What is typed into a dialog is not meant for the scene.
        let typing = self.window.is_egui_capturing_keyboard() || !self.panels.dialog.is_closed();
        if !events.is_empty() {
            self.touched = Instant::now();
            self.story.was_touched(self.touched);
        }
        for event in events {
            if let Some(gesture) = self.mouse.take(&event, on_panel) {
                self.follow(gesture);
            }
            match event {
                WindowEvent::Close => self.ends = true,
                WindowEvent::Key(key, press, modifiers) => {
                    let is_first = self.keys.take(key, press, modifiers, typing);
                    if is_first && !typing {
                        self.take_key(key, modifiers);
                    }
                }
                _ => {}
            }
        }
        let is_mouse = self.running.as_ref().is_some_and(|r| r.about.hand == HandChoice::Mouse);
        if is_mouse {
            let axes = self.camera.axes();
            let goes_by_itself = self.hand_is_on_its_way();
            for input in self.keys.inputs(axes) {
                // Fingers close when the hand is there.
                if goes_by_itself && matches!(input, MouseInput::CloseBy(..)) {
                    continue;
                }
                if let MouseInput::CloseBy(digits, by) = input {
                    self.panels.sliders.step(digits, by);
                    self.panels.hide_hint();
                }
                self.move_hand(input);
            }
        }
    }

    fn take_key(&mut self, key: Key, modifiers: kiss3d::prelude::Modifiers) {
        let is_mouse = self.running.as_ref().is_some_and(|r| r.about.hand == HandChoice::Mouse);
        match key {
            Key::Escape if self.panels.escape() => {}
            Key::Space if self.is_scripted() => self.take_hand(),
            Key::Tab if is_mouse => {
                self.panels.sliders.open();
                self.move_hand(MouseInput::AimElsewhere);
            }
            _ => {
                if let Some(action) = wish_of_key(key, modifiers) {
                    self.act(action);
                }
            }
        }
    }

    fn is_scripted(&self) -> bool {
        let hand = self.running.as_ref().map(|running| running.about.hand);
        matches!(hand, Some(HandChoice::Scripted(_)))
    }

    /// Does what the mouse did to the scene.
    fn follow(&mut self, gesture: Gesture) {
        match gesture {
            Gesture::MenuAsked(at) => {
                let panels = &mut self.panels;
                self.window.draw_ui(|context| panels.open_menu(context, at));
            }
            Gesture::DoubleClicked => self.frame_all(),
            Gesture::Began(DragButton::Left, at) => {
                let grip = self.grip_at(at);
                self.grips.begin(grip);
            }
            Gesture::Began(DragButton::Middle, _) => self.grips.begin(Grip::Pan),
            Gesture::Ended => self.grips.end(),
            Gesture::Dragged(_, by, shift) => {
                let height = f64::from(self.window.height().max(1));
                let before = self.camera;
                let wish = self.grips.drag(&mut self.camera, by / height, shift);
                if self.camera != before {
                    self.director.eye_is_chosen();
                }
                if let (Some(control), Some(running)) = (wish, &self.running) {
                    running.ask(control);
                }
            }
            Gesture::Scrolled(notches, at) => {
                if self.grip_at(at) == Grip::Hand {
                    let [_, _, towards_eye] = self.camera.axes();
                    self.move_hand(MouseInput::Move(towards_eye * (-0.006 * notches)));
                } else {
                    self.director.eye_is_chosen();
                    self.camera.zoom(notches);
                }
            }
        }
    }

    /// What a drag that begins at a place in the window moves.
    fn grip_at(&self, at: Vector2<f64>) -> Grip {
        let Some(running) = &self.running else { return Grip::View };
        let Some(frame) = running.frame().filter(|_| running.about.hand == HandChoice::Mouse)
        else {
            return Grip::View;
        };
        let size = Vector2::new(self.window.width(), self.window.height()).map(f64::from);
        Grip::at(frame, &self.camera, at, size)
    }
}
