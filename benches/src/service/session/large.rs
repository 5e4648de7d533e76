//! The largest object: one answer by the real program, checked against the equations.

use std::ffi::OsStr;
use std::fmt::Write as _;
use std::path::Path;

use serde_json::Value;
use softgrasp_core::fem::Material;
use softgrasp_core::mesh::{BuiltIn, Surface, generate};
use softgrasp_core::model::{Element, Model};

use crate::balance::imbalance;
use crate::programs::Programs;
use crate::report::{ReportError, check, progress};
use crate::scene::presses;
use crate::table::{Cell, Table};

/// Largest force on a free node, relative to the largest on a held one, with which a time is reported.
const RESIDUAL_ALLOWED: f64 = 1e-9;
/// Memory limit that is too small for the object.
const SMALL_LIMIT: &str = "1GiB";
/// Material of `solve` by default: Young's modulus, Pa, and Poisson's ratio.
const USUAL_MATERIAL: (f64, f64) = (1.0e5, 0.3);
const GIB: f64 = 1_073_741_824.0;

/// Solves a sphere of about so many nodes within the default limits, and asks for it within a limit that
/// is too small.
///
/// # Errors
/// [`ReportError`], also for an answer whose forces do not balance.
pub(super) fn measure(
    programs: &Programs,
    nodes: usize,
    folder: &Path,
) -> Result<Table, ReportError> {
    let title = "One answer about a large sphere held at five nodes, by `solve`";
    let mut table = Table::new("service-session-large", title, &COLUMNS);
    progress("session", &format!("sphere of {nodes} nodes"));
    let paths = ["sphere.msh", "known.csv", "answer.csv", "answer.json"];
    let [mesh_file, known_file, out, report] = paths.map(|name| folder.join(name));
    let count = nodes.to_string();
    let arguments = ["mesh", "sphere", "--nodes", &count, "--out"].map(OsStr::new);
    programs
        .ask(&[&arguments[..], &[mesh_file.as_os_str()]].concat(), folder, "mesh")?
        .succeed()?;
    let mesh = generate(BuiltIn::Sphere, nodes)?;
    let surface = Surface::from_mesh(&mesh);
    let known = presses(&mesh, &surface);
    write(&known_file, known_csv(&known))?;
    let mut solve: Vec<&OsStr> =
        vec![OsStr::new("solve"), OsStr::new("--mesh"), mesh_file.as_os_str()];
    solve.extend([OsStr::new("--known"), known_file.as_os_str()]);
    solve.extend([OsStr::new("--out"), out.as_os_str()]);
    solve.extend([OsStr::new("--report"), report.as_os_str()]);
    let lasted = programs.ask(&solve, folder, "solve")?.succeed()?;
    let unreadable = |why: String| ReportError::Unreadable { path: report.clone(), why };
    let bytes = std::fs::read(&report).map_err(|error| unreadable(error.to_string()))?;
    let json: Value =
        serde_json::from_slice(&bytes).map_err(|error| unreadable(error.to_string()))?;
    let (young, poisson) = USUAL_MATERIAL;
    let material = Material::try_new(young, poisson)?;
    let tets = mesh.tets().len();
    let node_count = mesh.node_count();
    let model = Model::try_new(mesh, Element::Tet4, &[material], Vec::new(), &mut |_| {})?;
    let residual = imbalance(&model, &known, &answer(&out)?);
    check(|| "the answer about the sphere".to_owned(), residual, RESIDUAL_ALLOWED)?;
    drop(model);
    let peak = json["peak_rss_bytes"].as_f64();
    table.push([
        node_count.into(),
        tets.into(),
        "usual".into(),
        json["method"].as_str().unwrap_or("").into(),
        "answered".into(),
        lasted.as_secs_f64().into(),
        peak.map(|bytes| bytes / GIB).into(),
        json["error_estimate_rel"].as_f64().into(),
        residual.into(),
    ]);
    solve.extend(["--memory-limit", SMALL_LIMIT].map(OsStr::new));
    let begun = std::time::Instant::now();
    let ended = programs.ask(&solve, folder, "refused")?.wait()?;
    let outcome = match &ended {
        Ok(_) => "answered".to_owned(),
        Err(said) => said.lines().next().unwrap_or("failed").to_owned(),
    };
    table.push([
        node_count.into(),
        tets.into(),
        SMALL_LIMIT.into(),
        Cell::Blank,
        outcome.into(),
        begun.elapsed().as_secs_f64().into(),
    ]);
    Ok(table)
}

/// Known displacements as a table for `solve`; the three directions of each node follow one another.
fn known_csv(known: &[(u32, f64)]) -> String {
    let mut text = "node,ux,uy,uz\n".to_owned();
    for three in known.chunks(3) {
        let node = three.first().map_or(0, |(dof, _)| dof / 3);
        let values: Vec<String> = three.iter().map(|(_, u)| format!("{u:e}")).collect();
        let _ = writeln!(text, "{node},{}", values.join(","));
    }
    text
}

/// Displacements of all nodes, m.
fn answer(path: &Path) -> Result<Vec<f64>, ReportError> {
    let unreadable =
        |why: &str| ReportError::Unreadable { path: path.to_owned(), why: why.to_owned() };
    let text = std::fs::read_to_string(path).map_err(|error| unreadable(&error.to_string()))?;
    let mut displacement = Vec::new();
    for line in text.lines().skip(1) {
        for value in line.split(',').skip(1) {
            displacement
                .push(value.trim().parse().map_err(|_| unreadable("a value is no number"))?);
        }
    }
    Ok(displacement)
}

fn write(path: &Path, text: String) -> Result<(), ReportError> {
    std::fs::write(path, text)
        .map_err(|source| ReportError::Write { path: path.to_owned(), source })
}

const COLUMNS: [&str; 9] = [
    "nodes",
    "tetrahedra",
    "memory_limit",
    "method",
    "outcome",
    "wall_s",
    "peak_memory_gib",
    "error_estimate_rel",
    "residual_rel",
];
