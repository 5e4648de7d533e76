//! Tests of frames that must be answered in time (bounded work, balanced shapes, honest estimates), and of a
//! shallow arch that is pressed through: its branch of equilibria ends, and it snaps to another.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use nalgebra::Vector3;

use super::*;
use crate::contact::Mask;
use crate::fem::hyperelastic::Law;
use crate::fem::{Element, Material};
use crate::mesh::{BuiltIn, generate};
use crate::model::Model;
use crate::solve::vectors::node_max;

/// Looks at the clock after which a frame is late.
const LOOKS: u32 = 6;
/// Solves after which a frame that is late must have been answered.
const SOLVES_MAX: u32 = 40;

/// A flat body under two tips that press it together and far to one side, at once.
struct Jump {
    model: Model,
    masks: Vec<Mask>,
    mask_q: Vec<f64>,
}

impl Jump {
    fn new() -> Self {
        let mesh = generate(BuiltIn::Toothpaste, 400).unwrap();
        let material = Material::try_new(2.0e4, 0.4).unwrap();
        let model = Model::try_new(mesh, Element::Tet4, &[material], vec![], &mut |_| {}).unwrap();
        let mesh = model.mesh();
        let (low, high) = mesh.bounds();
        let (centre, extent) = (nalgebra::center(&low, &high), high - low);
        let mut masks = Vec::new();
        let mut mask_q = Vec::new();
        let tips = [[0.0, 0.0, 1.0], [0.3, 0.0, -1.0], [1.0, 0.0, 0.0], [-1.0, 0.2, 0.0]];
        for (i, direction) in tips.map(Vector3::from).iter().enumerate() {
            let along =
                |n: &usize| (mesh.vertices()[*n] - centre).component_div(&extent).dot(direction);
            let tip = (0..mesh.node_count()).max_by(|a, b| along(a).total_cmp(&along(b))).unwrap();
            let tip = mesh.vertices()[tip];
            let mut near: Vec<usize> = (0..mesh.node_count()).collect();
            near.sort_by(|a, b| {
                let far = |n: &usize| (mesh.vertices()[*n] - tip).norm();
                far(a).total_cmp(&far(b))
            });
            masks
                .push(Mask::try_new(near[..6].iter().map(|&n| (n as u32, 1.0)).collect()).unwrap());
            let way = -direction.component_mul(&extent) * 0.12
                + Vector3::new(0.0, 0.1, 0.05) * (i as f64 - 1.5) * extent.min();
            mask_q.extend(<[f64; 3]>::from(way * 0.4));
        }
        Self { model, masks, mask_q }
    }

    fn path(&self) -> Path {
        let hold = self.model.hold(&[], self.masks.clone(), None).unwrap();
        let elements = Arc::new(self.model.hyperelastic(Law::NeoHookean).unwrap());
        let rest = vec![0.0; 3 * self.model.system_node_count()];
        Path::new(elements, self.model.stiffness(), Arc::new(hold), rest, true)
    }

    fn goal(&self) -> Goal<'_> {
        Goal { q_known: &[], mask_q: &self.mask_q, forces: &[] }
    }
}

fn off(a: &[f64], b: &[f64]) -> f64 {
    let difference: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
    node_max(&difference)
}

#[test]
fn a_jump_of_the_hand_is_followed_over_several_frames_and_none_keeps_the_hand_waiting() {
    let jump = Jump::new();
    let goal = jump.goal();
    let mut exact = jump.path();
    exact.advance(&goal, &Wish::EXACT).unwrap();
    let right = exact.displacement().to_vec();
    let mut path = jump.path();
    let (mut frames, mut arrived) = (0, false);
    while !arrived && frames < 60 {
        let looks = AtomicU32::new(0);
        let is_late = || looks.fetch_add(1, Ordering::Relaxed) >= LOOKS;
        let wish = Wish {
            error_rel: Some(2e-3),
            is_late: &is_late,
            may_factor: &|| false,
            part_will_do: true,
        };
        let found = path.advance(&goal, &wish).expect("a part of the way will do");
        frames += 1;
        assert!(
            found.linear_solves <= SOLVES_MAX,
            "frame {frames}: {} solves",
            found.linear_solves
        );
        assert!(found.factors <= u32::from(frames == 1), "frame {frames} waited for a factor");
        assert!(found.jacobian_min > 0.0 && found.residual_rel.is_finite());
        // A shape that has hardly set out is measured by the way that the masks have to go.
        let means = path.hold().means(path.displacement());
        let missing = jump.mask_q.iter().zip(means).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let size = node_max(path.displacement()).max(missing);
        let error = off(path.displacement(), &right) / size;
        let said = found.error_estimate_rel;
        // What is missing is told of the masks; the body between them may have more to go.
        assert!(error <= 4.0 * said + 1e-9, "frame {frames}: off by {error:.1e}, said {said:.1e}");
        arrived = said <= 2e-3;
        if let Some(renewal) = path.renewal() {
            path.install(renewal.make(), 1);
        }
    }
    assert!(arrived, "still on the way after {frames} frames");
    assert!(frames > 1, "one frame was enough: that is no jump");
    assert!(off(path.displacement(), &right) <= 4e-3 * node_max(&right));
}

#[test]
fn an_answer_that_is_late_tells_all_of_what_is_missing() {
    let jump = Jump::new();
    let mut path = jump.path();
    let wish = Wish { error_rel: Some(2e-3), is_late: &|| true, part_will_do: true, ..Wish::EXACT };
    let found = path.advance(&jump.goal(), &wish).unwrap();
    let means = path.hold().means(path.displacement());
    let missing = jump.mask_q.iter().zip(means).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let size = node_max(path.displacement()).max(missing);
    let said = found.error_estimate_rel * size;
    assert!(missing > 0.0 && said >= 0.999 * missing, "{said:.2e} m said, {missing:.2e} m missing");
}

#[test]
fn a_body_that_was_let_go_of_begins_its_next_grip_at_rest() {
    let jump = Jump::new();
    let mut path = jump.path();
    path.advance(&jump.goal(), &Wish::EXACT).unwrap();
    path.spring_back();
    let still = vec![0.0; jump.mask_q.len()];
    let goal = Goal { mask_q: &still, ..jump.goal() };
    let found = path.advance(&goal, &Wish { error_rel: Some(2e-3), ..Wish::EXACT }).unwrap();
    assert!(found.linear_solves <= 1, "{} solves", found.linear_solves);
    assert_eq!(node_max(path.displacement()), 0.0);
}

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
