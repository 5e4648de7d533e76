//! The levels as datagrams, as a bridge hears them.

use std::net::UdpSocket;
use std::time::Duration;

use serde_json::Value;
use softgrasp_force::{Renderer, Target};

use crate::spring::{Spring, press_until};

#[test]
fn a_bridge_hears_levels_of_the_fingers_and_zeros_at_the_end() {
    let bridge = UdpSocket::bind("127.0.0.1:0").unwrap();
    bridge.set_nonblocking(true).unwrap();
    let address = bridge.local_addr().unwrap().to_string();
    let renderer = Renderer::start(format!("level:{address}").parse::<Target>().unwrap()).unwrap();
    let mut newest = None;
    let mut hear = || {
        let mut bytes = [0u8; 512];
        while let Ok(count) = bridge.recv(&mut bytes) {
            let message: Value = serde_json::from_slice(&bytes[..count]).unwrap();
            assert!(message["t"].as_f64().unwrap() >= 0.0);
            let levels = message["levels"].as_array().unwrap();
            let levels: Vec<f64> = levels.iter().map(|level| level.as_f64().unwrap()).collect();
            assert!(levels.len() == 5 && levels.iter().all(|l| (0.0..=1.0).contains(l)));
            newest = Some(levels);
        }
        newest.clone()
    };
    let spring = Spring { stiffness: 500.0, port: 4 };
    press_until(spring, renderer.newest(), 5e-3, |_| hear() == Some(vec![0.0, 0.0, 0.0, 0.0, 0.5]));
    renderer.finish();
    std::thread::sleep(Duration::from_millis(20));
    assert_eq!(hear(), Some(vec![0.0; 5]));
}
