//! One solve, from a mesh file to displacements: the lowest nodes are held, the highest are pressed down
//! by a twentieth of the height.
//!
//!     cargo run --release -p softgrasp-core --example first_solve [MESH]

#![allow(clippy::print_stdout, reason = "it shows what it found")]

use nalgebra::Vector3;
use softgrasp_core::mesh::{BuiltIn, TetMesh, generate};
use softgrasp_core::{LoadCase, Material, SoftBody, mesh_io};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mesh: TetMesh = match std::env::args().nth(1) {
        // Formats with a second file (TetGen) would ask for it in the last argument.
        Some(path) => mesh_io::parse(&path, &std::fs::read(&path)?, &mut |_| None)?.mesh,
        None => generate(BuiltIn::Strawberry, 1000)?,
    };
    let (low, high) = mesh.bounds();
    let height = high.z - low.z;
    let used = mesh.used_nodes();

    let mut press = LoadCase::new();
    for (node, place) in (0u32..).zip(mesh.vertices()).filter(|(n, _)| used[*n as usize]) {
        if place.z < low.z + 0.1 * height {
            press.hold([node]);
        } else if place.z > high.z - 0.1 * height {
            press.prescribe(node, Vector3::new(0.0, 0.0, -0.05 * height));
        }
    }

    let body = SoftBody::try_new(mesh, Material::try_new(2.0e4, 0.4)?)?;
    let answer = body.solve(&press)?;

    let farthest = answer.displacements.iter().map(|u| u.norm()).fold(0.0, f64::max);
    let force: Vector3<f64> = answer.reactions.values().filter(|force| force.z < 0.0).sum();
    println!("nodes                {}", answer.displacements.len());
    println!("largest displacement {:.3} mm", 1e3 * farthest);
    println!("force of the press   {:.3} N", -force.z);
    println!("residual             {:.1e}", answer.residual_rel);
    println!("error, estimated     {:.1e}", answer.inexactness.relative());
    Ok(())
}
