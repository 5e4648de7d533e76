//! The emulated LucidGlove brakes the finger that presses, and frees it at the end.

use softgrasp_force::{Renderer, Target};

use crate::emulated_lucid::EmulatedLucid;
use crate::spring::{Spring, WAIT_MAX, press_until};

#[test]
fn the_finger_that_presses_is_braked_in_proportion_and_freed_at_the_end() {
    let glove = EmulatedLucid::start();
    let renderer = Renderer::start(Target::Lucid { port: glove.path.clone() }).unwrap();
    // 500 N/m over 5 mm are 2.5 N: half of a firm pinch.
    let spring = Spring { stiffness: 500.0, port: 1 };
    press_until(spring, renderer.newest(), 5e-3, |height| {
        height == -5e-3 && glove.servos() == Some([0, 500, 0, 0, 0])
    });
    let report = renderer.finish();
    assert!((report.force_max_n - 2.5).abs() < 1e-6, "{report:?}");
    let began = std::time::Instant::now();
    while glove.servos() != Some([0; 5]) {
        assert!(began.elapsed() < WAIT_MAX, "the finger is not freed: {:?}", glove.servos());
        std::thread::yield_now();
    }
}

#[test]
fn a_port_that_is_none_is_refused() {
    let refused = Renderer::start(Target::Lucid { port: "no/such/port".into() });
    let text = refused.unwrap_err().to_string();
    assert!(text.contains("no/such/port cannot be opened"), "{text}");
}
