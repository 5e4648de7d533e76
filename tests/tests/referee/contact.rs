//! Contact with friction against CalculiX: a soft object between two plates, pressed and sheared.

use std::fmt::Write as _;
use std::path::Path;

use clap::Parser;
use glove_client::commands::press::PressCommand;
use serde_json::Value;
use softgrasp_core::fem::QuadraticMesh;

use crate::ccx::Ccx;
use crate::contact_deck::{INCREMENTS, Press, STICK_OF_PENALTY};
use crate::object::{self, Object};

const YOUNG: f64 = 2.0e4;
/// Stiffness of CalculiX's penalty, relative to Young's modulus over the object's size.
const PENALTY: f64 = 1e4;
/// That for ten-node elements, where CalculiX takes a node of a face to stand for less of it.
const PENALTY_OF_TEN: f64 = 1e6;

/// Object, nodes of an element, Poisson's ratio, friction, and the way of the lid over the object's height.
type Case<'a> = (&'a str, usize, f64, f64, &'a [[f64; 2]]);

/// Displacement of every node, m, and force of the upper plate on the object, N.
struct Found {
    displacement: Vec<[f64; 3]>,
    force: [f64; 3],
}

#[derive(Parser)]
struct PressArguments {
    #[command(flatten)]
    press: PressCommand,
}

/// Result of CalculiX at the end of the motion.
fn by_calculix(ccx: &Ccx, folder: &Path, press: &Press<'_>) -> Found {
    let text = ccx.printed(folder, &press.deck()).unwrap_or_else(|said| panic!("{said}"));
    let numbers = |line: &str| -> Vec<f64> {
        line.split_whitespace().map(|word| word.parse().unwrap()).collect()
    };
    let last = |title: &str| text.rfind(title).map(|at| &text[at..]).unwrap();
    let rows = last(" displacements").lines().skip(1).skip_while(|line| line.is_empty());
    let rows: Vec<Vec<f64>> = rows.take_while(|line| !line.is_empty()).map(numbers).collect();
    let nodes: Vec<usize> = rows.iter().map(|row| row[0] as usize).collect();
    assert!(nodes.into_iter().eq(1..=press.mesh.node_count()));
    let force = last(" total force (fx,fy,fz) for set LID").lines().nth(2).map(numbers).unwrap();
    Found {
        displacement: rows.iter().map(|row| [row[1], row[2], row[3]]).collect(),
        force: [force[0], force[1], force[2]],
    }
}

/// Result of `glove-client press`, after some steps at rest; the object has almost no weight.
fn by_press(folder: &Path, object: &Object, press: &Press<'_>) -> Found {
    let [low, high] = press.heights();
    let mut poses = format!("[0, 0, 0, {high:e}, 1, 0, 0, 0]");
    for (piece, [along, down]) in (1..).zip(press.way) {
        write!(poses, ", [{piece}, {along:e}, 0, {:e}, 1, 0, 0, 0]", high - down).unwrap();
    }
    let end = press.way.len() as f64 + 0.5;
    let bodies = format!(
        "end = {end:?}\n\
         [[body]]\nname = \"floor\"\nshape = \"plane\"\nnormal = [0, 0, 1]\n\
         poses = [[0, 0, 0, {low:e}, 1, 0, 0, 0]]\n\
         [[body]]\nname = \"lid\"\nshape = \"plane\"\nnormal = [0, 0, -1]\nposes = [{poses}]\n"
    );
    let path = |name: &str| folder.join(name).to_str().unwrap().to_owned();
    std::fs::write(path("B.toml"), bodies).unwrap();
    let (out, report) = (path("P.csv"), path("P.json"));
    let (step, friction) = (1.0 / INCREMENTS as f64, press.friction.to_string());
    let mut arguments = vec!["press", "--mesh", object.file.to_str().unwrap()];
    let (step, young, poisson) =
        (step.to_string(), press.young.to_string(), press.poisson.to_string());
    let bodies = path("B.toml");
    arguments.extend(["--bodies", &bodies, "--gravity", "0,0,0", "--density", "1"]);
    arguments.extend(["--step", &step, "--young", &young, "--poisson", &poisson]);
    arguments.extend(["--friction", &friction, "--out", &out, "--report", &report]);
    let is_linear = press.mesh.mid_edge_nodes().is_empty();
    arguments.extend(["--element", if is_linear { "t4" } else { "t10" }]);
    PressArguments::parse_from(arguments).press.run().unwrap();
    let report: Value = serde_json::from_slice(&std::fs::read(report).unwrap()).unwrap();
    assert_eq!(report["steps_not_converged"], 0, "{}", object.name);
    let last = report["steps"].as_array().unwrap().last().unwrap();
    let force = &last["bodies"]["lid"]["force"];
    let text = std::fs::read_to_string(out).unwrap();
    let row = |line: &str| {
        let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        [cells[1], cells[2], cells[3]]
    };
    Found {
        displacement: text.lines().skip(1).map(row).collect(),
        force: [0, 1, 2].map(|axis: usize| force[axis].as_f64().unwrap()),
    }
}

/// Largest difference between both, m: the penetration that CalculiX's penalty allows, and the sliding
/// that its friction allows at sticking points, on both sides.
fn give_of_penalty(press: &Press<'_>, found: &Found) -> f64 {
    let [low, high] = press.heights();
    let last = press.way.last().unwrap();
    let depth = |(rest, u): (&nalgebra::Point3<f64>, &[f64; 3])| {
        let height = rest.z + u[2];
        (low - height).max(height - (high - last[1]))
    };
    let places = press.mesh.vertices().iter().zip(&found.displacement);
    let deepest = places.map(depth).fold(0.0, f64::max);
    2.0 * deepest * (1.0 + press.friction / STICK_OF_PENALTY)
}

#[test]
fn presses_between_plates_agree_with_calculix_within_the_give_of_its_penalty() {
    let Some(ccx) = Ccx::find() else { return };
    let folder = tempfile::tempdir().unwrap();
    let objects = object::built_in(folder.path(), 150);
    let of = |name: &str| objects.iter().find(|object| object.name == name).unwrap();
    let cases: [Case<'_>; 8] = [
        ("cube", 4, 0.3, 0.0, &[[0.0, 0.01]]),
        ("cube", 4, 0.3, 0.3, &[[0.0, 0.01]]),
        ("sphere", 4, 0.4, 0.5, &[[0.0, 0.03]]),
        ("strawberry", 4, 0.45, 0.4, &[[0.0, 0.02]]),
        ("cube", 4, 0.3, 0.6, &[[0.0, 0.01], [0.001, 0.01]]),
        ("cube", 10, 0.3, 0.3, &[[0.0, 0.01]]),
        ("sphere", 10, 0.4, 0.5, &[[0.0, 0.03]]),
        ("strawberry", 10, 0.45, 0.4, &[[0.0, 0.02]]),
    ];
    for (name, nodes, poisson, friction, way) in cases {
        let object = of(name);
        let mesh = match nodes {
            4 => object.mesh.clone(),
            _ => QuadraticMesh::try_new(&object.mesh).unwrap().to_mesh().unwrap(),
        };
        let (low, high) = object.mesh.bounds();
        let height = high.z - low.z;
        let way: Vec<[f64; 2]> = way.iter().map(|place| place.map(|x| x * height)).collect();
        let penalty = YOUNG / height * if nodes == 4 { PENALTY } else { PENALTY_OF_TEN };
        let press = Press { mesh: &mesh, young: YOUNG, poisson, friction, way: &way, penalty };
        let theirs = by_calculix(&ccx, folder.path(), &press);
        let ours = by_press(folder.path(), object, &press);
        let give = give_of_penalty(&press, &theirs);
        // What may roll is held by next to nothing, and so is what may slide: there only the forces are
        // compared, and how far it is pressed.
        let axes = match (name, friction > 0.0) {
            ("cube", true) => 0..3,
            ("cube", false) => 2..3,
            _ => 0..0,
        };
        let off = |axis: usize| {
            let pairs = ours.displacement.iter().zip(&theirs.displacement);
            pairs.map(|(a, b)| (a[axis] - b[axis]).abs()).fold(0.0, f64::max)
        };
        let off = axes.map(off).fold(0.0, f64::max);
        let depth = way.last().unwrap()[1];
        let force = theirs.force.iter().map(|f| f * f).sum::<f64>().sqrt();
        let forces = ours.force.iter().zip(&theirs.force);
        let force_off = forces.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / force;
        println!(
            "{name}, {nodes} nodes, friction {friction}: force {force:.4} N, differs by {force_off:.1e}; displacements \
             differ by {:.1e} of the depth; the penalty gives way by {:.1e}",
            off / depth,
            give / depth
        );
        assert!(off <= give, "{name}: {off:e} m, give {give:e} m");
        assert!(force_off <= give / depth, "{name}: {force_off:e}, give {:e}", give / depth);
    }
}
