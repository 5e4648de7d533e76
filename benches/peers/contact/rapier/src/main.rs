//! Rapier's side of the lift: a rigid or a soft ball, two fingertips on springs, frame by frame.
//!
//! A request as a JSON line in, an answer as a JSON line out; `lift.py` beside this folder asks.

mod scene;
mod world;

use std::error::Error;
use std::io::{BufRead, Write};

use scene::Request;
use world::Lift;

fn main() -> Result<(), Box<dyn Error>> {
    for line in std::io::stdin().lock().lines() {
        let answer = match serde_json::from_str(&line?)? {
            Request::About => {
                serde_json::json!({ "version": format!("Rapier {}", rapier3d_f64::VERSION) })
            }
            Request::Play(scene) => {
                let mut lift = Lift::new(&scene)?;
                let frames: Vec<_> =
                    (0..scene.tips.len() - 1).map(|k| lift.frame(&scene, k)).collect();
                serde_json::json!({ "frames": frames })
            }
        };
        let mut out = std::io::stdout().lock();
        writeln!(out, "{answer}")?;
        out.flush()?;
    }
    Ok(())
}
