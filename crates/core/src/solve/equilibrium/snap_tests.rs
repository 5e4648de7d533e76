//! A shallow arch that is pressed through: its branch of equilibria ends, and it snaps to another.

use std::sync::Arc;

use super::*;
use crate::fem::hyperelastic::Law;
use crate::fem::{Element, Material};
use crate::mesh::{BuiltIn, generate};
use crate::model::Model;

/// An arch of length 1, rise 0.06, thickness 0.02, clamped at both ends.
struct Arch {
    model: Model,
    clamped: Vec<u32>,
    /// Nodes along the crown line.
    crown: Vec<usize>,
}

impl Arch {
    fn new() -> Self {
        let cube = generate(BuiltIn::Cube, 125).unwrap();
        let (low, high) = cube.bounds();
        let bent = cube.vertices().iter().map(|p| {
            let [x, y, z] = [0, 1, 2].map(|i| (p[i] - low[i]) / (high[i] - low[i]) - 0.5);
            nalgebra::Point3::new(x, 0.02 * y + 0.06 * (1.0 - 4.0 * x * x), 0.1 * z)
        });
        let mesh = cube.with_vertices(bent.collect()).unwrap();
        let nodes = || mesh.vertices().iter().enumerate();
        let ends = nodes().filter(|(_, p)| p.x.abs() > 0.499);
        let clamped = ends.flat_map(|(n, _)| (0..3).map(move |axis| (3 * n + axis) as u32));
        let clamped = clamped.collect();
        let crown = nodes().filter(|(_, p)| p.x.abs() < 0.01).map(|(n, _)| n).collect();
        let material = Material::try_new(1.0e6, 0.3).unwrap();
        let model = Model::try_new(mesh, Element::Tet10, &[material], vec![], &mut |_| {}).unwrap();
        Self { model, clamped, crown }
    }

    fn path(&self) -> Path {
        let hold = self.model.hold(&self.clamped, Vec::new(), None).unwrap();
        let elements = Arc::new(self.model.hyperelastic(Law::NeoHookean).unwrap());
        let rest = vec![0.0; 3 * self.model.system_node_count()];
        Path::new(elements, self.model.stiffness(), Arc::new(hold), rest, false)
    }

    /// Presses the crown down with a force in all.
    fn pressed(&self, path: &mut Path, force: f64) -> Result<Equilibrium, NoEquilibrium> {
        let mut forces = vec![0.0; 3 * self.model.system_node_count()];
        for node in &self.crown {
            forces[3 * node + 1] = -force / self.crown.len() as f64;
        }
        let q_known = vec![0.0; self.clamped.len()];
        let goal = Goal { q_known: &q_known, mask_q: &[], forces: &forces };
        path.advance(&goal, &Wish { error_rel: Some(1e-6), ..Wish::EXACT })
    }

    fn sunk(&self, path: &Path) -> f64 {
        let down = self.crown.iter().map(|n| -path.displacement()[3 * n + 1]);
        down.sum::<f64>() / self.crown.len() as f64
    }
}

#[test]
fn an_arch_pressed_through_snaps_once_and_says_so() {
    let arch = Arch::new();
    let mut path = arch.path();
    let (mut jumps, mut before) = (Vec::new(), 0.0);
    for step in 1..=40 {
        let force = 0.1 * f64::from(step);
        let found = arch.pressed(&mut path, force).unwrap();
        assert!(found.residual_rel < 1e-4 && found.jacobian_min > 0.0, "{force}: {found:?}");
        assert!(path.displacement().iter().all(|u| u.is_finite()));
        let sunk = arch.sunk(&path);
        if found.jumped {
            jumps.push((before, sunk));
        }
        before = sunk;
    }
    let [(from, to)] = jumps[..] else { panic!("it snaps once: {jumps:?}") };
    assert!(from < 0.06 && to > 0.08, "from above its ends to below them: {from} to {to}");
}
