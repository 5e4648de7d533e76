//! Figures 5.1 and 5.2: the share of time of each procedure of the system and each stage of the
//! analysis.

use std::time::Duration;

use glove_client::ask::connection::{Host, ServerChoice, unexpected};
use nalgebra::{Isometry3, Point3, Vector3};
use softgrasp_core::mesh::BuiltIn;
use softgrasp_core::solve::Method;
use softgrasp_grasp::hand::{HandColliders, HandDimensions, JointAngles, pose};
use softgrasp_grasp::sphere_tree::{SphereTree, tip_hits, vertex_normals};
use softgrasp_protocol::{Reply, Request};

use crate::reference::{Reference, error_rel};
use crate::report::{ReportError, check, progress};
use crate::sample::{Competitor, Effort, Spread, take_turns, timed_ms};
use crate::scene::Pressed;
use crate::stages::StageTimes;
use crate::table::{Cell, Table};
use crate::thesis;
use crate::threads::pool;

/// Times of one round, ms.
#[derive(Clone, Copy, Debug, Default)]
struct Round {
    hand: f64,
    collision: f64,
    analysis: f64,
    transfer: f64,
    shape: f64,
    error_rel: f64,
}

const ROUNDS: Effort =
    Effort { warm_up_rounds: 2, rounds_min: 5, rounds_max: 40, budget: Duration::from_secs(20) };

/// Figure 5.1 measured again: one request as in the thesis at 267 nodes, and the client's work around it.
///
/// # Errors
/// [`ReportError`].
pub(super) fn procedures(nodes: usize, threads: usize) -> Result<Table, ReportError> {
    progress("scaling", "procedures of the system");
    let scene = Pressed::try_new(BuiltIn::Cube, nodes)?;
    let title = format!("Figure 5.1 again: procedures of the system, cube of {nodes} nodes");
    let mut table = Table::new("scaling-procedures", title, &PROCEDURE_COLUMNS);
    for method in [Method::GaussJordan, Method::SparseCholesky] {
        let rounds = rounds(&scene, method, threads)?;
        let of = |f: fn(&Round) -> f64| Spread::of(rounds.iter().map(f));
        let parts = [
            ("hand pose and colliders", of(|r| r.hand)),
            ("collision: refit, search, exact test", of(|r| r.collision)),
            ("finite element analysis", of(|r| r.analysis)),
            ("data communication", of(|r| r.transfer)),
            ("deformed shape and normals", of(|r| r.shape)),
        ];
        let all: f64 = parts.iter().map(|(_, spread)| spread.median).sum();
        for (name, spread) in parts {
            let row: [Cell; 7] = [
                method.name().into(),
                name.into(),
                spread.median.into(),
                spread.min.into(),
                spread.max.into(),
                (100.0 * spread.median / all).into(),
                of(|r| r.error_rel).max.into(),
            ];
            table.push(row);
        }
    }
    Ok(table)
}

/// Rounds of the same request to an embedded server, and of the client's work around it.
fn rounds(scene: &Pressed, method: Method, threads: usize) -> Result<Vec<Round>, ReportError> {
    let (model, known) = scene.model()?;
    let reference = Reference::of(&model, &known)?;
    let host = Host::open(&ServerChoice::Embedded, Some(threads))?;
    let mut connection = host.connect()?;
    let request = Request::from(scene.whole_request(method));
    let rest = scene.mesh.vertices();
    let mut tree = SphereTree::try_build(rest, &scene.surface.nodes)?;
    let (mut normals, mut found) = (Vec::new(), Vec::new());
    let mut shape: Vec<Point3<f64>> = rest.to_vec();
    vertex_normals(&shape, &scene.surface.triangles, &mut normals)?;
    let round = || -> Result<Round, ReportError> {
        let (hand_ms, hand) = timed_ms(closing_hand);
        let (collision, refitted) = timed_ms(|| {
            found.clear();
            let refitted = tree.refit(&shape);
            for finger in &hand.fingers {
                finger.cylinders.iter().for_each(|c| tree.search_cylinder(c, &mut found));
                let hits = tip_hits(&tree, &normals, &finger.tip, &finger.contact_point);
                found.extend(hits.iter().flatten().map(|hit| hit.node));
            }
            refitted
        });
        refitted?;
        let (round_trip, reply) = timed_ms(|| connection.ask(&request));
        let answer = match reply? {
            Reply::Answer(answer) => answer,
            other => return Err(unexpected("Ask", &other).into()),
        };
        let stages = answer.report.stage_ms;
        let analysis = stages.assemble + stages.order + stages.factor + stages.solve;
        let displacement = answer.displacements.into_f64();
        let pairs = displacement.iter().flatten().copied();
        let error_rel = error_rel(pairs.zip(reference.displacement.iter().copied()));
        check(|| format!("{method} over the wire"), error_rel, 1e-9)?;
        let (shape_ms, moved) = timed_ms(|| {
            let all = shape.iter_mut().zip(rest).zip(&displacement);
            all.for_each(|((p, r), u)| *p = r + Vector3::from(*u));
            vertex_normals(&shape, &scene.surface.triangles, &mut normals)
        });
        moved?;
        let transfer = round_trip - analysis;
        Ok(Round { hand: hand_ms, collision, analysis, transfer, shape: shape_ms, error_rel })
    };
    let mut only: [Competitor<'_, Round, ReportError>; 1] = [Box::new(round)];
    Ok(take_turns(&ROUNDS, &mut only)?.remove(0))
}

/// Half closed hand over the object.
fn closing_hand() -> HandColliders {
    let dimensions = HandDimensions::default();
    let angles = JointAngles::flat().lerp(&JointAngles::fist(), 0.5);
    let object_from_palm = Isometry3::translation(0.0, -0.105, 0.045);
    HandColliders::new(&dimensions, &pose(&dimensions, &angles, object_from_palm))
}

/// Figure 5.2 measured again: stages of the analysis by Gauss–Jordan elimination, on one processor and on
/// all.
///
/// # Errors
/// [`ReportError`].
pub(super) fn stages(nodes: usize, thread_counts: &[usize]) -> Result<Table, ReportError> {
    progress("scaling", "stages of the analysis");
    let scene = Pressed::try_new(BuiltIn::Cube, nodes)?;
    let (model, known) = scene.model()?;
    let reference = Reference::of(&model, &known)?;
    let title = format!("Figure 5.2 again: stages of gauss-jordan, cube of {nodes} nodes");
    let mut table = Table::new("scaling-stages", title, &STAGE_COLUMNS);
    let pools = thread_counts.iter().map(|&t| pool(t)).collect::<Result<Vec<_>, _>>()?;
    let mut competitors: Vec<Competitor<'_, (StageTimes, f64), ReportError>> = Vec::new();
    for pool in &pools {
        let (scene, reference) = (&scene, &reference);
        competitors.push(Box::new(move || {
            let (times, solution) = pool.install(|| scene.analyse(Method::GaussJordan))?;
            let error = reference.error_of(solution.displacement.iter().copied(), 1.0);
            check(|| "gauss-jordan by stage".to_owned(), error, 1e-9)?;
            Ok((times, error))
        }));
    }
    let results = take_turns(&ROUNDS, &mut competitors)?;
    for (runs, &threads) in results.iter().zip(thread_counts) {
        let of = |f: fn(&StageTimes) -> f64| Spread::of(runs.iter().map(|r| f(&r.0))).median;
        let share = of(|t| 100.0 * t.factor / t.total);
        let row: [Cell; 8] = [
            threads.into(),
            of(|t| t.assemble).into(),
            of(|t| t.factor).into(),
            of(|t| t.solve).into(),
            of(|t| t.total).into(),
            share.into(),
            (100.0 * thesis::INVERSE_SHARE).into(),
            Spread::of(runs.iter().map(|r| r.1)).max.into(),
        ];
        table.push(row);
    }
    Ok(table)
}

const PROCEDURE_COLUMNS: [&str; 7] =
    ["method", "procedure", "median_ms", "min_ms", "max_ms", "share_percent", "error_rel"];

const STAGE_COLUMNS: [&str; 8] = [
    "processors",
    "assemble_ms",
    "inverse_ms",
    "product_ms",
    "total_ms",
    "inverse_percent",
    "inverse_1998_percent",
    "error_rel",
];
