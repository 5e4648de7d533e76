//! A spring of known stiffness as answers of a server, and a hand that presses it.

use std::time::{Duration, Instant};

use nalgebra::{DMatrix, Isometry3, Point3, Vector3};
use softgrasp_force::{Newest, SmallContact, SmallSystem};

/// Longest time that a test waits for what must come.
pub const WAIT_MAX: Duration = Duration::from_secs(30);

/// A spring below the origin that a finger presses down on; places are heights.
#[derive(Clone, Copy, Debug)]
pub struct Spring {
    /// Stiffness, N/m.
    pub stiffness: f64,
    /// Port of the device that feels it.
    pub port: usize,
}

impl Spring {
    /// The answer to a finger at a height, m: nothing above zero.
    pub fn answer(&self, height: f64) -> SmallSystem {
        if height >= 0.0 {
            return SmallSystem::empty();
        }
        let contact = SmallContact {
            body: 0,
            port: Some(self.port),
            place_in_body: Point3::origin(),
            place: Point3::new(0.0, height, 0.0),
            normal: -Vector3::y(),
            force: Vector3::y() * (self.stiffness * height),
            friction: 0.5,
        };
        let compliance = DMatrix::identity(3, 3) / self.stiffness;
        SmallSystem::try_new(vec![contact], compliance).expect("a spring makes a system")
    }

    /// Hands the answer to a finger at a height over, and that it is there now.
    pub fn press(&self, newest: &Newest, height: f64) {
        let now = Instant::now();
        newest.hand(vec![Isometry3::translation(0.0, height, 0.0)], now);
        newest.answer(self.answer(height), now);
    }
}

/// Plays a finger that rests above the spring until the forces have risen, and then goes down slowly to a
/// depth, and stays; until `is_enough`, at a rate of a hundred answers a second.
pub fn press_until(
    spring: Spring,
    newest: &Newest,
    depth: f64,
    mut is_enough: impl FnMut(f64) -> bool,
) {
    let began = Instant::now();
    loop {
        let seconds = began.elapsed().as_secs_f64();
        let height = -depth * (seconds - 2.3).clamp(0.0, 1.0);
        spring.press(newest, height);
        if is_enough(height) {
            return;
        }
        assert!(began.elapsed() < WAIT_MAX, "it never came, at the height {height}");
        std::thread::sleep(Duration::from_millis(10));
    }
}
