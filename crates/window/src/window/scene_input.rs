//! Carries out what mouse and keys do to scene, hand and window.

use std::time::Instant;

use kiss3d::prelude::{Action as Press, Key, Modifiers, Window, WindowEvent};
use nalgebra::Vector2;
use softgrasp_hand::hand_request::HandChoice;
use softgrasp_hand::mouse::MouseInput;

use super::finger_keys::FingerKeys;
use super::grips::{Grip, Grips};
use super::input::{DragButton, Gesture, Mouse, wish_of_key};
use super::window_run::WindowRun;

/// State of mouse and keys: what is held down, and when it was used last.
pub(super) struct SceneInput {
    mouse: Mouse,
    keys: FingerKeys,
    grips: Grips,
    /// Time at which the person moved mouse or keys last.
    touched: Instant,
}

impl SceneInput {
    /// Mouse and keys of which nothing is held down.
    pub(super) fn new() -> Self {
        Self {
            mouse: Mouse::default(),
            keys: FingerKeys::default(),
            grips: Grips::default(),
            touched: Instant::now(),
        }
    }

    /// Time at which the person moved mouse or keys last.
    pub(super) fn touched(&self) -> Instant {
        self.touched
    }

    /// Takes the events of mouse and keys.
    pub(super) fn take_events(&mut self, window: &mut Window, run: &mut WindowRun) {
        let mut events: Vec<WindowEvent> = Vec::new();
        let mut ctrl = [Key::LControl, Key::RControl]
            .into_iter()
            .any(|key| window.get_key(key) == Press::Press);
        for mut event in window.events().iter() {
            // A shortcut is no letter, also where its keys are up again before it is heard of.
            if let WindowEvent::Key(_, Press::Press, modifiers) = event.value {
                ctrl |= modifiers.contains(Modifiers::Control);
            }
            event.inhibited |= ctrl && matches!(event.value, WindowEvent::Char(_));
            events.push(event.value);
        }
        let on_panel = window.is_egui_capturing_mouse();
        // What is typed into a dialog is not meant for the scene.
        let typing = window.is_egui_capturing_keyboard() || !run.panels.dialog.is_closed();
        if !events.is_empty() {
            self.touched = Instant::now();
            run.was_touched(self.touched);
        }
        for event in events {
            if let Some(gesture) = self.mouse.take(&event, on_panel) {
                self.follow(gesture, window, run);
            }
            match event {
                WindowEvent::Close => run.end(),
                WindowEvent::Key(key, press, modifiers) => {
                    let is_first = self.keys.take(key, press, modifiers, typing);
                    if is_first && !typing {
                        take_key(key, modifiers, window, run);
                    }
                }
                _ => {}
            }
        }
        if run.hand() == Some(HandChoice::Mouse) {
            self.move_fingers(run);
        }
    }

    /// Moves hand and fingers by the keys that are down.
    fn move_fingers(&mut self, run: &mut WindowRun) {
        let axes = run.view.camera().axes();
        let goes_by_itself = run.hand_is_on_its_way();
        for input in self.keys.inputs(axes) {
            // Fingers close when the hand is there.
            if goes_by_itself && matches!(input, MouseInput::CloseBy(..)) {
                continue;
            }
            if let MouseInput::CloseBy(digits, by) = input {
                run.panels.sliders.step(digits, by);
                run.panels.hide_hint();
            }
            run.move_hand(input);
        }
    }

    /// Carries out a gesture of the mouse.
    fn follow(&mut self, gesture: Gesture, window: &mut Window, run: &mut WindowRun) {
        match gesture {
            Gesture::MenuAsked(at) => {
                window.draw_ui(|context| run.panels.open_menu(context, at));
            }
            Gesture::DoubleClicked => run.frame_all(),
            Gesture::Began(DragButton::Left, at) => self.grips.begin(grip_at(at, window, run)),
            Gesture::Began(DragButton::Middle, _) => self.grips.begin(Grip::Pan),
            Gesture::Ended => self.grips.end(),
            Gesture::Dragged(_, by, shift) => {
                let height = f64::from(window.height().max(1));
                let grips = &mut self.grips;
                let wish = run.view.move_eye(|camera| grips.drag(camera, by / height, shift));
                if let Some(control) = wish {
                    run.ask(control);
                }
            }
            Gesture::Scrolled(notches, at) => {
                if grip_at(at, window, run) == Grip::Hand {
                    let [_, _, towards_eye] = run.view.camera().axes();
                    run.move_hand(MouseInput::Move(towards_eye * (-0.006 * notches)));
                } else {
                    run.view.move_eye(|camera| camera.zoom(notches));
                }
            }
        }
    }
}

fn take_key(key: Key, modifiers: Modifiers, window: &Window, run: &mut WindowRun) {
    match key {
        Key::Escape if run.panels.escape() => {}
        Key::Space if matches!(run.hand(), Some(HandChoice::Scripted(_))) => run.take_hand(window),
        Key::Tab if run.hand() == Some(HandChoice::Mouse) => {
            run.panels.sliders.open();
            run.move_hand(MouseInput::AimElsewhere);
        }
        _ => {
            if let Some(action) = wish_of_key(key, modifiers) {
                run.act(action, window);
            }
        }
    }
}

/// What a drag moves that begins at a place in the window.
fn grip_at(at: Vector2<f64>, window: &Window, run: &WindowRun) -> Grip {
    let moves_hand = run.hand() == Some(HandChoice::Mouse);
    match run.frame() {
        Some(frame) if moves_hand => {
            let size = Vector2::new(window.width(), window.height()).map(f64::from);
            Grip::at(frame, run.view.camera(), at, size)
        }
        _ => Grip::View,
    }
}
