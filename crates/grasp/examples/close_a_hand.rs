//! A hand closes around a ball: the sphere tree finds what each fingertip touches, and the rules of the
//! thesis say when the ball is held and deformed.
//!
//!     cargo run --release -p softgrasp-grasp --example close_a_hand

#![allow(clippy::print_stdout, reason = "it shows what it found")]

use nalgebra::{Isometry3, Vector3};
use softgrasp_core::mesh::{BuiltIn, generate};
use softgrasp_grasp::grasp::{Grasp, StepInput, sense};
use softgrasp_grasp::hand::{HandColliders, HandDimensions, JointAngles, pose};
use softgrasp_grasp::object::SoftObject;

/// Distance within which a fingertip has not left its contact, m.
const RELEASE_MARGIN: f64 = 0.003;
/// Ticks in which the hand closes.
const TICKS: u32 = 60;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let ball = SoftObject::try_new(generate(BuiltIn::Sphere, 2000)?)?;
    let dimensions = HandDimensions::default();
    let (flat, fist) = (JointAngles::flat(), JointAngles::fist());
    let palm = Isometry3::identity();
    // The ball lies where the tips of the half closed hand meet.
    let half = pose(&dimensions, &flat.lerp(&fist, 0.5), palm);
    let tips = half.fingers.iter().map(|finger| finger.contact_point.coords);
    let middle = tips.sum::<Vector3<f64>>() / 5.0;
    let in_hand = Isometry3::from_parts(middle.into(), Default::default());
    let mut grasp = Grasp::try_new(in_hand, RELEASE_MARGIN)?;
    for tick in 0..=TICKS {
        let angles = flat.lerp(&fist, f64::from(tick) / f64::from(TICKS));
        let hand = pose(&dimensions, &angles, palm);
        let colliders = HandColliders::new(&dimensions, &hand);
        let object = grasp.world_from_object(&palm);
        let fingers = sense(ball.tree(), ball.normals(), &colliders, &object, RELEASE_MARGIN);
        let world_from_segment = hand
            .fingers
            .each_ref()
            .map(|finger| finger.segments.each_ref().map(|s| s.world_from_segment));
        let done = grasp.step(&StepInput {
            world_from_palm: palm,
            world_from_segment,
            fingers,
            command: None,
        });
        for event in &done.events {
            println!("tick {tick:>2}: {event}");
        }
        if let Some(known) = done.known {
            let most =
                known.iter().map(|node| node.displacement_in_object.norm()).fold(0.0, f64::max);
            println!("tick {tick:>2}: five nodes are prescribed, up to {:.1} mm", 1e3 * most);
        }
    }
    println!("{} vertices in {} spheres", ball.tree().vertex_count(), ball.tree().sphere_count());
    Ok(())
}
