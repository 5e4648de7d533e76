//! How far each finger of the mouse hand is closed, and how fast it closes.

use super::input::Digits;
use crate::scripted::GraspPlan;

/// Closing of each finger, thumb first: as it is wished for, and as it is now. See [`super::MouseInput`]
/// for what the numbers mean.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Grip {
    wished: [f64; 5],
    closing: [f64; 5],
    /// Closure of each finger's joints, 0 open to 1 closed, as of the scripted hand.
    closure: [f64; 5],
}

/// Largest closing of a finger: twice as deep as planned.
pub const CLOSING_MAX: f64 = 3.0;
/// Closing per second, far from the touch and from shortly before it, where a tip that comes slowly
/// is felt before it is deep.
const FAST: f64 = 2.5;
const SLOW: f64 = 0.6;
const NEAR: f64 = 0.85;
/// Largest closure of the joints per second: a new plan must not make a finger jump.
const CLOSURE_RATE: f64 = 2.5;
/// Largest closure of the joints; beyond it a finger would go through the palm.
const CLOSURE_MAX: f64 = 1.15;
/// Closures at touch and at full press of a finger that has no plan.
const UNPLANNED: (f64, f64) = (0.5, 0.65);

impl Grip {
    /// Closes the named fingers by so much more; a negative amount opens them.
    pub fn close_by(&mut self, digits: Digits, by: f64) {
        for (digit, wished) in self.wished.iter_mut().enumerate() {
            if digits.contain(digit) {
                *wished = (*wished + by).clamp(0.0, CLOSING_MAX);
            }
        }
    }

    /// Sets how far the named fingers are to close.
    pub fn close_to(&mut self, digits: Digits, to: f64) {
        for (digit, wished) in self.wished.iter_mut().enumerate() {
            if digits.contain(digit) {
                *wished = to.clamp(0.0, CLOSING_MAX);
            }
        }
    }

    /// Moves the fingers for some time toward the closing wished for. Fingers that are wished as closed
    /// as each other arrive together, at the touch and at the full press.
    ///
    /// Units: s.
    pub fn advance(&mut self, seconds: f64, plan: Option<&GraspPlan>) {
        for digit in 0..5 {
            let (now, wished) = (self.closing[digit], self.wished[digit]);
            let rate = if wished > now && now >= NEAR { SLOW } else { FAST };
            self.closing[digit] = toward(now, wished, rate * seconds);
            let closure = closure(plan, digit, self.closing[digit]);
            self.closure[digit] = toward(self.closure[digit], closure, CLOSURE_RATE * seconds);
        }
    }

    /// Closing that is wished for, of each finger, thumb first.
    pub fn wished(&self) -> [f64; 5] {
        self.wished
    }

    /// Closure of each finger's joints now, thumb first, 0 open to 1 closed.
    pub fn closure(&self) -> &[f64; 5] {
        &self.closure
    }

    /// Whether every finger is open.
    pub fn is_open(&self) -> bool {
        self.closure.iter().all(|&closure| closure < 1e-9)
    }
}

/// Closure of a finger by the plan: all fingers touch at 1 and have pressed at 2.
fn closure(plan: Option<&GraspPlan>, digit: usize, closing: f64) -> f64 {
    let (touch, press) = plan.map_or(UNPLANNED, |plan| (plan.touch[digit], plan.press[digit]));
    let beyond = (closing - 1.0).max(0.0);
    (touch * closing.min(1.0) + (press - touch) * beyond).min(CLOSURE_MAX)
}

fn toward(from: f64, to: f64, by: f64) -> f64 {
    from + (to - from).clamp(-by, by)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scripted::{PalmPath, Posture};
    use nalgebra::{UnitQuaternion, Vector3};
    use softgrasp_grasp::hand::Finger;

    fn plan() -> GraspPlan {
        GraspPlan {
            path: PalmPath {
                world_from_palm_rotation: UnitQuaternion::identity(),
                object_in_palm: Vector3::zeros(),
            },
            posture: Posture::OPEN,
            reach: [0.0; 5],
            touch: [0.3, 0.5, 0.6, 0.4, 0.7],
            press: [0.4, 0.55, 0.7, 0.5, 0.72],
            holds_by_friction: true,
        }
    }

    #[test]
    fn all_fingers_touch_together_and_press_together() {
        let (plan, mut grip) = (plan(), Grip::default());
        for (closing, expected) in [(1.0, plan.touch), (2.0, plan.press), (0.0, [0.0; 5])] {
            grip.close_to(Digits::All, closing);
            for _ in 0..300 {
                grip.advance(1.0 / 60.0, Some(&plan));
            }
            for (got, expected) in grip.closure().iter().zip(expected) {
                assert!((got - expected).abs() < 1e-12, "{got} for {expected}");
            }
        }
        assert!(grip.is_open());
    }

    #[test]
    fn one_finger_closes_alone_and_no_further_than_it_can() {
        let (plan, mut grip) = (plan(), Grip::default());
        grip.close_by(Digits::One(Finger::Ring), 50.0);
        for _ in 0..600 {
            grip.advance(1.0 / 60.0, Some(&plan));
        }
        assert_eq!(grip.wished(), [0.0, 0.0, 0.0, CLOSING_MAX, 0.0]);
        let ring = Finger::Ring.index();
        assert!((grip.closure()[ring] - 0.6).abs() < 1e-12);
        assert!(grip.closure().iter().enumerate().all(|(d, &c)| d == ring || c == 0.0));
    }

    #[test]
    fn no_finger_jumps_when_the_plan_changes() {
        let (plan, mut grip) = (plan(), Grip::default());
        grip.close_to(Digits::All, 2.0);
        for tick in 0..400 {
            let before = *grip.closure();
            grip.advance(1.0 / 60.0, (tick > 200).then_some(&plan));
            for (now, before) in grip.closure().iter().zip(before) {
                assert!((now - before).abs() <= CLOSURE_RATE / 60.0 + 1e-12);
            }
        }
    }
}
