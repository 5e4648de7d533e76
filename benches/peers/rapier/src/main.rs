//! Rapier's side of the table: time steps of a soft body on a mesh that Softgrasp wrote.
//!
//! A request as a JSON line in, an answer as a JSON line out; `../README.md` lists them. Threads
//! are those of rayon (`RAYON_NUM_THREADS`).

use std::error::Error;
use std::io::{BufRead, Write};
use std::path::{Path, PathBuf};
use std::time::Instant;

use rapier3d::prelude::*;

#[derive(serde::Deserialize)]
#[serde(tag = "ask", rename_all = "kebab-case")]
enum Request {
    /// A world with the mesh as one soft body, scaled to an edge of one metre.
    Load { folder: PathBuf, method: String, scene: Scene },
    /// So many time steps; where the nodes are then.
    Steps { count: usize },
    /// Version of the peer.
    About,
}

#[derive(Clone, Copy, serde::Deserialize)]
struct Scene {
    young_pa: f32,
    poisson: f32,
    mass_kg: f32,
    gravity_m_s2: f32,
    /// Factor from the lengths of the mesh to metres of the scene.
    scale: f32,
}

struct Body {
    world: PhysicsWorld,
    handle: SoftBodyHandle,
    rest: Vec<Vector>,
    folder: PathBuf,
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut body: Option<Body> = None;
    for line in std::io::stdin().lock().lines() {
        let answer = match serde_json::from_str(&line?)? {
            Request::Load { folder, method, scene } => {
                body = Some(Body::load(folder, &method, scene)?);
                serde_json::json!({})
            }
            Request::Steps { count } => body.as_mut().ok_or("load a mesh first")?.steps(count)?,
            Request::About => {
                serde_json::json!({ "versions": [format!("Rapier {}", rapier3d::VERSION)] })
            }
        };
        let mut out = std::io::stdout().lock();
        writeln!(out, "{answer}")?;
        out.flush()?;
    }
    Ok(())
}

impl Body {
    fn load(folder: PathBuf, method: &str, scene: Scene) -> Result<Self, Box<dyn Error>> {
        let vertices = numbers(&folder, "vertex.f64", f64::from_le_bytes)?;
        let rest: Vec<Vector> = vertices
            .chunks_exact(3)
            .map(|p| Vector::new(p[0] as f32, p[1] as f32, p[2] as f32) * scene.scale)
            .collect();
        let tets = numbers(&folder, "tet.u32", u32::from_le_bytes)?;
        // Rapier wants the fourth corner on the other side of the first three.
        let cells = tets.chunks_exact(4).map(|t| oriented([t[0], t[1], t[2], t[3]], &rest));
        let solver = match method {
            "fem" => SoftBodySolver::Fem,
            "constraints" => SoftBodySolver::Constraints,
            other => return Err(format!("no solver is called {other}").into()),
        };
        let material = SoftBodyMaterial {
            young_modulus: scene.young_pa,
            poisson_ratio: scene.poisson,
            ..Default::default()
        };
        let builder = SoftBodyBuilder::new(rest.clone())
            .cells(cells.collect())
            .cell_model(SoftBodyCellModel::Corotational)
            .material(material)
            .solver(solver)
            .mass(scene.mass_kg)
            .pinned_particles(numbers(&folder, "held.u32", u32::from_le_bytes)?)
            .no_surface_collider()
            .can_sleep(false);
        let mut world = PhysicsWorld::new();
        world.gravity = Vector::new(0.0, -scene.gravity_m_s2, 0.0);
        let handle = world.insert_soft_body(builder);
        Ok(Self { world, handle, rest, folder })
    }

    fn steps(&mut self, count: usize) -> Result<serde_json::Value, Box<dyn Error>> {
        let times: Vec<f64> = (0..count)
            .map(|_| {
                let start = Instant::now();
                self.world.step();
                start.elapsed().as_secs_f64() * 1e3
            })
            .collect();
        let soft = &self.world.soft_bodies[self.handle];
        let moved = soft.particle_positions().zip(&self.rest).flat_map(|(now, rest)| {
            let u = now - *rest;
            [u.x, u.y, u.z].map(f64::from)
        });
        let bytes: Vec<u8> = moved.flat_map(f64::to_le_bytes).collect();
        std::fs::write(self.folder.join("moved.f64"), bytes)?;
        let step_s = self.world.integration_parameters.dt;
        Ok(serde_json::json!({ "step_ms": times, "step_s": step_s }))
    }
}

fn oriented(tet: [u32; 4], vertices: &[Vector]) -> [u32; 4] {
    let [a, b, c, d] = tet.map(|v| vertices[v as usize]);
    match (b - a).cross(c - a).dot(d - a) < 0.0 {
        true => [tet[1], tet[0], tet[2], tet[3]],
        false => tet,
    }
}

fn numbers<T, const N: usize>(
    folder: &Path,
    name: &str,
    from_bytes: fn([u8; N]) -> T,
) -> std::io::Result<Vec<T>> {
    let bytes = std::fs::read(folder.join(name))?;
    let (whole, _) = bytes.as_chunks::<N>();
    Ok(whole.iter().map(|&b| from_bytes(b)).collect())
}
