//! Frames with a proven bound: five surface nodes of a strawberry are moved a little further in every
//! frame, as fingertips do.
//!
//!     cargo run --release -p softgrasp-core --example frames [NODES]

#![allow(clippy::print_stdout, reason = "it shows what it found")]

use std::time::Instant;

use nalgebra::Vector3;
use softgrasp_core::mesh::{BuiltIn, Surface, generate};
use softgrasp_core::{Inexactness, LoadCase, Material, SoftBody};

/// Frames played.
const FRAMES: u32 = 1000;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let nodes = std::env::args().nth(1).map_or(Ok(1000), |text| text.parse())?;
    let mesh = generate(BuiltIn::Strawberry, nodes)?;
    let surface = Surface::from_mesh(&mesh).nodes;
    let tips: Vec<u32> = (0..5).map(|tip| surface[tip * surface.len() / 5]).collect();
    let towards_middle: Vec<Vector3<f64>> =
        tips.iter().map(|&tip| -mesh.vertices()[tip as usize].coords.normalize()).collect();

    let body = SoftBody::try_new(mesh, Material::try_new(2.0e4, 0.4)?)?;
    let mut frames = body.frames()?;
    let (mut slowest_ms, mut worst) = (0.0f64, 0.0f64);
    let begun = Instant::now();
    for frame in 1..=FRAMES {
        let depth = 1e-3 * f64::from(frame) / f64::from(FRAMES);
        let mut squeeze = LoadCase::new();
        for (tip, inward) in tips.iter().zip(&towards_middle) {
            squeeze.prescribe(*tip, depth * inward);
        }
        let asked = Instant::now();
        let answer = frames.answer(&squeeze)?;
        // The first frame makes the columns of the five nodes.
        if frame > 1 {
            slowest_ms = slowest_ms.max(1e3 * asked.elapsed().as_secs_f64());
        }
        match answer.inexactness {
            Inexactness::Proven(error) => worst = worst.max(error),
            other => println!("frame {frame}: {other:?}"),
        }
    }
    let each_ms = 1e3 * begun.elapsed().as_secs_f64() / f64::from(FRAMES);
    println!("nodes            {nodes}");
    println!("a frame          {each_ms:.3} ms (mean), {slowest_ms:.3} ms (slowest but the first)");
    println!("error, proven    {worst:.1e} at most");
    Ok(())
}
