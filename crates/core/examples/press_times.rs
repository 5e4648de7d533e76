//! Times of contact steps with friction: five fingertips close on a body, hold it and lift it, by linear
//! elasticity and at large deformation; each step with how well it meets the law of contact.
//!
//! `press_times SHAPE NODES [linear|large] [RESIDUAL] [STEPS]`: SHAPE a built-in object of its own size,
//! RESIDUAL the relative residual that is asked for, STEPS of the hold. `moved_um` is how far the object's
//! place at the end of a phase is from that at its middle.
#![allow(clippy::print_stdout, reason = "a table on standard output is what it is for")]

use std::sync::Arc;
use std::time::Instant;

use nalgebra::{Isometry3, Point3, Vector3};
use softgrasp_core::dynamics::{
    ContactStep, LargeBody, LargeStep, MovingBody, ObjectState, StepOutcome, StepSettings,
    near_triangles,
};
use softgrasp_core::fem::hyperelastic::Law;
use softgrasp_core::fem::{Element, Material};
use softgrasp_core::mesh::{BuiltIn, Surface, generate};
use softgrasp_core::model::Model;
use softgrasp_core::rigid_body::RigidShape;
use softgrasp_core::solve::condensed::{Columns, Elasticity, FreeBody};

/// Radius of a fingertip, m.
const TIP_M: f64 = 0.008;
/// Steps of each phase, 10 ms each.
const PHASES: [&str; 3] = ["close", "hold", "lift"];
const STEPS: usize = 25;
/// Share of the body's breadth that the fingers close by.
const CLOSED_BY: f64 = 0.2;

/// Places of the fingertips at a time of the run in [0, 3]: from just touching to closed, held, lifted.
fn tips(low: &Point3<f64>, high: &Point3<f64>, time: f64) -> Vec<Isometry3<f64>> {
    let middle = nalgebra::center(low, high);
    let half = 0.5 * (high.x - low.x) + TIP_M;
    let x = half * (1.0 - CLOSED_BY * time.min(1.0));
    let lifted = 0.03 * (time - 2.0).clamp(0.0, 1.0);
    let at = |x: f64, y: f64, z: f64| {
        Isometry3::translation(middle.x + x, middle.y + y + lifted, middle.z + z)
    };
    let [y, z] = [0.15 * (high.y - low.y), 0.15 * (high.z - low.z)];
    vec![at(-x, 0.0, 0.0), at(x, y, z), at(x, -y, z), at(x, y, -z), at(x, -y, -z)]
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let shape = arguments.next().unwrap_or_else(|| "strawberry".to_owned());
    let shape: BuiltIn = shape.parse().expect("a built-in object");
    let nodes = arguments.next().map_or(1000, |n| n.parse().expect("a number of nodes"));
    let is_large = arguments.next().is_some_and(|word| word == "large");
    let residual_rel = arguments.next().map_or(1e-9, |r| r.parse().expect("a residual"));
    let hold_steps = arguments.next().map_or(STEPS, |n| n.parse().expect("a number of steps"));
    let mesh = generate(shape, nodes).expect("a mesh");
    let surface = Surface::from_mesh(&mesh);
    let (low, high) = mesh.bounds();
    let material = Material::try_new(2.0e4, 0.4).expect("a material");
    let model = Model::try_new(mesh, Element::Tet4, &[material], vec![], &mut |_| {}).expect("K");
    let base = model.condense(None, &mut |_| {}).expect("a base");
    let body = FreeBody::try_new(model.mesh(), &base).expect("a free body");
    let columns = Columns::new(1 << 30);
    let elements = Arc::new(model.hyperelastic(Law::NeoHookean).expect("elements"));
    let mut large = LargeBody::at_rest(elements, Arc::clone(model.stiffness().pattern()));
    let settings = StepSettings { viscosity: 0.02, residual_rel, ..StepSettings::default() };
    let tip = RigidShape::sphere(TIP_M).expect("a sphere");
    let mut state = ObjectState::at_rest(Isometry3::identity());
    println!(
        "{shape} {} nodes, {} on the surface, {}, residual {residual_rel:e}",
        model.mesh().node_count(),
        surface.nodes.len(),
        if is_large { "large" } else { "linear" }
    );
    println!(
        "phase  p50_ms  p90_ms  max_ms  contacts  shapes  factors  rounds  newton  residual  contact_residual"
    );
    for (number, phase) in PHASES.into_iter().enumerate() {
        let steps = if phase == "hold" { hold_steps } else { STEPS };
        let mut middle = Isometry3::identity();
        let mut found: Vec<(f64, usize, StepOutcome)> = Vec::new();
        // Nothing holds it before the fingers are closed.
        let gravity = if phase == "close" { Vector3::zeros() } else { -9.81 * Vector3::y() };
        let settings = StepSettings { gravity, ..settings };
        for k in 0..steps {
            let [from, to] = [k, k + 1].map(|k| number as f64 + k as f64 / steps as f64);
            let starts = tips(&low, &high, from);
            let bodies: Vec<MovingBody> = starts
                .into_iter()
                .zip(tips(&low, &high, to))
                .map(|(start, end)| MovingBody {
                    world_from_body_start: start,
                    world_from_body_end: end,
                    ..MovingBody::resting(tip.clone(), start, 0.8)
                })
                .collect();
            let vertices = model.mesh().vertices();
            let elasticity = Elasticity { base: &base, body: &body, columns: &columns };
            let triangles = &surface.triangles;
            let candidates =
                near_triangles(vertices, triangles, &state.world_from_object, &bodies, 0.012);
            let step = ContactStep {
                vertices,
                triangles,
                elasticity,
                bodies: &bodies,
                candidates: &candidates,
                settings,
            };
            let (before, begun) = (large.factors(), Instant::now());
            let outcome = match is_large {
                true => LargeStep { step, body: &mut large }.advance(&state, &surface.nodes),
                false => step.advance(&state, &surface.nodes),
            };
            let ms = 1e3 * begun.elapsed().as_secs_f64();
            let outcome = outcome.expect("a step");
            state = outcome.state.clone();
            found.push((ms, large.factors() - before, outcome));
            if k == steps / 2 {
                middle = state.world_from_object;
            }
        }
        let mut ms: Vec<f64> = found.iter().map(|(ms, ..)| *ms).collect();
        ms.sort_by(f64::total_cmp);
        let mean = |of: &dyn Fn(&(f64, usize, StepOutcome)) -> f64| {
            found.iter().map(of).sum::<f64>() / found.len() as f64
        };
        let most = |of: &dyn Fn(&StepOutcome) -> f64| {
            found.iter().map(|(.., outcome)| of(outcome)).fold(0.0, f64::max)
        };
        println!(
            "{phase:<6} {:>6.2}  {:>6.2}  {:>6.2}  {:>8.1}  {:>6.1}  {:>7.2}  {:>6.1}  {:>6.1}  {:>8.1e}  {:>8.1e}  {:.3}",
            ms[ms.len() / 2],
            ms[ms.len() * 9 / 10],
            ms[ms.len() - 1],
            mean(&|f| f.2.state.contacts.len() as f64),
            mean(&|f| f.2.shapes as f64),
            mean(&|f| f.1 as f64),
            mean(&|f| f.2.rounds as f64),
            mean(&|f| f.2.newton_steps as f64),
            most(&|o| o.residual_rel),
            most(&|o| o.contact_residual_rel),
            1e6 * (state.world_from_object.translation.vector - middle.translation.vector).norm(),
        );
    }
}
