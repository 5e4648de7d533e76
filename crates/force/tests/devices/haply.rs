//! The emulated Haply feels a spring in newtons, follows its own place between the answers, and is freed.

use std::cell::Cell;

use softgrasp_force::{Renderer, Target};

use crate::emulated_haply::EmulatedHaply;
use crate::spring::{Spring, press_until};

const SPRING: Spring = Spring { stiffness: 200.0, port: 0 };

fn renderer(haply: &EmulatedHaply) -> Renderer {
    Renderer::start(Target::Haply { url: haply.url.clone() }).expect("the thread starts")
}

/// Moves the cursor with the hand: up is the third axis of the service.
fn follow(haply: &EmulatedHaply, height: f64) {
    haply.change(|state| state.place = [0.0, -0.1, 0.2 + height]);
}

#[test]
fn a_spring_of_200_newtons_a_metre_gives_one_newton_at_5_millimetres() {
    let haply = EmulatedHaply::start();
    let renderer = renderer(&haply);
    let steady = Cell::new(0);
    press_until(SPRING, renderer.newest(), 5e-3, |height| {
        follow(&haply, height);
        let [x, y, up] = haply.state().force;
        let is_right = (up - 1.0).abs() < 1e-3 && x.abs() < 1e-3 && y.abs() < 1e-3;
        steady.set(if height == -5e-3 && is_right { steady.get() + 1 } else { 0 });
        assert!(up < 1.0 + 1e-2, "more than the spring has: {up} N");
        steady.get() > 10
    });
    let report = renderer.finish();
    assert!((report.force_max_n - 1.0).abs() < 1e-2, "{report:?}");
    // What rounding and late ticks leave, and no more than the reserve.
    assert!(report.energy_created_j <= 1e-3 + 1e-6, "{report:?}");
    assert_eq!(report.softened_max, 0.0);
    let freed = haply.state().force;
    assert_eq!(freed, [0.0; 3], "the device is freed at the end");
}

#[test]
fn the_device_moves_on_between_two_answers() {
    let haply = EmulatedHaply::start();
    let renderer = renderer(&haply);
    let steady = Cell::new(0);
    // The run's hand is slower than the device: the cursor is a millimetre deeper than the newest hand.
    press_until(SPRING, renderer.newest(), 5e-3, |height| {
        let told = Cell::new(height);
        if height < -4.9e-3 {
            told.set(height - 1e-3);
        }
        std::thread::sleep(std::time::Duration::from_millis(2));
        follow(&haply, told.get());
        std::thread::sleep(std::time::Duration::from_millis(5));
        let up = haply.state().force[2];
        // In the second half of each period the cursor has gone on by a millimetre.
        steady.set(if (up - 1.2).abs() < 5e-3 { steady.get() + 1 } else { steady.get() });
        follow(&haply, height);
        std::thread::sleep(std::time::Duration::from_millis(5));
        steady.get() > 3
    });
}

#[test]
fn a_silent_device_and_a_lost_server_release_the_force() {
    let haply = EmulatedHaply::start();
    let renderer = renderer(&haply);
    press_until(SPRING, renderer.newest(), 5e-3, |height| {
        follow(&haply, height);
        haply.state().force[2] > 0.9
    });
    renderer.newest().server(true);
    press_until(SPRING, renderer.newest(), 5e-3, |_| haply.state().force == [0.0; 3]);
    renderer.newest().server(false);
    press_until(SPRING, renderer.newest(), 5e-3, |height| {
        follow(&haply, height);
        haply.state().force[2] > 0.9
    });
    haply.change(|state| state.is_silent = true);
    std::thread::sleep(std::time::Duration::from_millis(300));
    haply.change(|state| state.is_silent = false);
    let report = renderer.finish();
    let why: Vec<&str> = report.releases.iter().map(|release| release.why).collect();
    assert!(why.contains(&"the server was lost"), "{why:?}");
    assert!(why.contains(&"the device did not answer"), "{why:?}");
}

#[test]
fn a_service_that_is_not_there_gives_no_force_and_is_told() {
    let gone = {
        let haply = EmulatedHaply::start();
        haply.url.clone()
    };
    let renderer = Renderer::start(Target::Haply { url: gone }).unwrap();
    let mut looks = 0;
    press_until(SPRING, renderer.newest(), 5e-3, |_| {
        looks += 1;
        looks > 40
    });
    let report = renderer.finish();
    assert_eq!(report.force_max_n, 0.0);
    assert!(report.device_failed.is_some(), "{report:?}");
}
