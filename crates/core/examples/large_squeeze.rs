//! A large squeeze: a cube is pressed to two thirds of its height between plates that stick to it, by
//! linear elasticity and by the equilibrium of the deformed body.
//!
//!     cargo run --release -p softgrasp-core --example large_squeeze

#![allow(clippy::print_stdout, reason = "it shows what it found")]

use nalgebra::Vector3;
use softgrasp_core::mesh::{BuiltIn, generate};
use softgrasp_core::{Law, LoadCase, Material, SoftBody};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mesh = generate(BuiltIn::Cube, 1000)?;
    let (low, high) = mesh.bounds();
    let height = high.z - low.z;
    let body = SoftBody::try_new(mesh.clone(), Material::try_new(2.0e4, 0.3)?)?;
    println!("pressed by   linear N   large N   error, estimated   smallest volume");
    for percent in [1u32, 5, 10, 20, 33] {
        let mut press = LoadCase::new();
        let down = Vector3::new(0.0, 0.0, -0.01 * f64::from(percent) * height);
        for (place, node) in mesh.vertices().iter().zip(0..) {
            if place.z < low.z + 1e-9 {
                press.hold([node]);
            } else if place.z > high.z - 1e-9 {
                press.prescribe(node, down);
            }
        }
        let force = |reactions: &std::collections::BTreeMap<u32, Vector3<f64>>| -> f64 {
            reactions.values().map(|force| force.z.max(0.0)).sum()
        };
        let linear = body.solve(&press)?;
        let large = body.equilibrium(&press, Law::NeoHookean)?;
        println!(
            "{percent:>6} %   {:>10.3} {:>9.3}   {:>16.1e}   {:>15.2}",
            force(&linear.reactions),
            force(&large.answer.reactions),
            large.answer.inexactness.relative(),
            large.volume_ratio_min,
        );
    }
    Ok(())
}
