//! The keys that move the mouse hand while they are held.

use std::time::Instant;

use kiss3d::prelude::{Action as Press, Key, Modifiers};
use nalgebra::{Unit, UnitQuaternion, Vector3};
use softgrasp_grasp::hand::Finger;
use softgrasp_hand::mouse::{Digits, MouseInput};

/// Keys that are down, and for how long.
#[derive(Default)]
pub struct FingerKeys {
    down: Vec<Key>,
    /// All keys that are down, also those that move nothing.
    held: Vec<Key>,
    shift: bool,
    last: Option<Instant>,
}

/// Closing of a finger per second: from open to touching in about one.
const CLOSING_SPEED: f64 = 1.0;
/// Speed of the hand, m/s, and of its turn, rad/s.
const SPEED_M: f64 = 0.12;
const TURN_SPEED: f64 = 1.2;
/// Longest time that counts for a key that is held through a stall of the window, s.
const PERIOD_MAX_S: f64 = 0.1;

const FINGERS: [(Key, Finger); 5] = [
    (Key::Key1, Finger::Thumb),
    (Key::Key2, Finger::Index),
    (Key::Key3, Finger::Middle),
    (Key::Key4, Finger::Ring),
    (Key::Key5, Finger::Little),
];

impl FingerKeys {
    /// Takes a key that went down or up; returns whether it went down and was not down before: a key that
    /// is held is reported again and again. Keys that are `typed` into a field move nothing.
    pub fn take(&mut self, key: Key, press: Press, modifiers: Modifiers, typed: bool) -> bool {
        self.shift = modifiers.contains(Modifiers::Shift);
        if press == Press::Release {
            self.down.retain(|down| *down != key);
            self.held.retain(|held| *held != key);
            return false;
        }
        let is_first = !self.held.contains(&key);
        if is_first {
            self.held.push(key);
        }
        let moves = !typed && !modifiers.contains(Modifiers::Control);
        if is_first && moves {
            self.down.push(key);
        }
        is_first
    }

    /// Wishes to the mouse hand from the keys that were down since the last call.
    ///
    /// Frame: `axes` are right, up and towards the eye in the world.
    pub fn inputs(&mut self, axes: [Vector3<f64>; 3]) -> Vec<MouseInput> {
        let now = Instant::now();
        let period = self.last.map_or(0.0, |last| (now - last).as_secs_f64().min(PERIOD_MAX_S));
        self.last = Some(now);
        self.down.iter().filter_map(|key| self.input(*key, axes, period)).collect()
    }

    fn input(&self, key: Key, axes: [Vector3<f64>; 3], period: f64) -> Option<MouseInput> {
        let [right, up, towards_eye] = axes;
        let go = |along: Vector3<f64>| Some(MouseInput::Move(along * (SPEED_M * period)));
        let turn = |about: Vector3<f64>| {
            let axis = Unit::try_new(about, 1e-9)?;
            Some(MouseInput::Turn(UnitQuaternion::from_axis_angle(&axis, TURN_SPEED * period)))
        };
        let close = CLOSING_SPEED * period;
        if let Some((_, finger)) = FINGERS.into_iter().find(|(of, _)| *of == key) {
            let by = if self.shift { -close } else { close };
            return Some(MouseInput::CloseBy(Digits::One(finger), by));
        }
        match key {
            Key::Space => Some(MouseInput::CloseBy(Digits::All, close)),
            Key::X => Some(MouseInput::CloseBy(Digits::All, -close)),
            Key::Left => go(-right),
            Key::Right => go(right),
            Key::Up => go(up),
            Key::Down => go(-up),
            Key::PageUp => go(-towards_eye),
            Key::PageDown => go(towards_eye),
            Key::A => turn(up),
            Key::D => turn(-up),
            Key::Q => turn(towards_eye),
            Key::E => turn(-towards_eye),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn key_that_is_held_is_pressed_once_and_moves_until_it_is_let_go() {
        let (mut keys, none) = (FingerKeys::default(), Modifiers::empty());
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
        assert!(keys.take(Key::Space, Press::Press, none, false));
        assert!(!keys.take(Key::Space, Press::Press, none, false), "repeated, not pressed again");
        assert!(matches!(keys.inputs(axes)[..], [MouseInput::CloseBy(Digits::All, _)]));
        assert!(!keys.take(Key::Space, Press::Release, none, false));
        assert!(keys.inputs(axes).is_empty());
        assert!(keys.take(Key::Space, Press::Press, none, true));
        assert!(keys.inputs(axes).is_empty(), "typed into a field");
    }
}
