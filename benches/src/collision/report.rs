//! Writes the page: first the ratios of comparable operations, then the times.

use softgrasp_core::mesh::BuiltIn;

use super::rounds::{NAMES, Run, Task, run_all};
use crate::report::{Options, Report, ReportError, progress};
use crate::sample::Spread;
use crate::table::{Cell, Table};

/// Largest ratio to the peer with triangles, and the number of vertices from which on it counts (objects
/// have up to about 10 000).
const BAR: f64 = 0.5;
const BAR_VERTICES: usize = 9000;

/// Measures the sphere tree and its peers.
///
/// # Errors
/// [`ReportError`]; a missed vertex or contact of the sphere tree is one.
pub fn measure(options: &Options) -> Result<Report, ReportError> {
    let surfaces: &[(BuiltIn, usize)] = match options.is_quick {
        true => &[(BuiltIn::Sphere, 300)],
        false => &[
            (BuiltIn::Sphere, 1000),
            (BuiltIn::Sphere, 10_000),
            (BuiltIn::Strawberry, 1000),
            (BuiltIn::Strawberry, 10_000),
        ],
    };
    let title = "Collision: build, refit and search";
    let mut report = Report::begin("collision", title, "1", options);
    let mut times = Table::new("collision", "Times", &TIME_COLUMNS);
    let like = "Sphere tree over parry3d, vertices against vertices";
    let mut like = Table::new("collision-like", like, &RATIO_COLUMNS);
    let triangles = "Sphere tree over parry3d, vertices against triangles";
    let mut triangles = Table::new("collision-triangles", triangles, &RATIO_COLUMNS);
    for &(shape, vertices) in surfaces {
        progress("collision", &format!("{shape}, about {vertices} surface vertices"));
        let task = Task::try_new(shape, vertices)?;
        let runs = run_all(&task, options.is_quick)?;
        add_times(&mut times, &task, &runs);
        add_ratios(&mut like, &task, &runs, 1);
        add_ratios(&mut triangles, &task, &runs, 2);
    }
    report.text(INTRODUCTION);
    report.table(like);
    report.table(triangles);
    report.table(times);
    Ok(report)
}

/// Time of one operation in a run, µs; `None` if a competitor has no such operation.
type Of = fn(&Run) -> Option<f64>;

/// Adds the times of every operation and competitor.
fn add_times(table: &mut Table, task: &Task, runs: &[Vec<Run>]) {
    let operations: [(&str, Of); 6] = [
        ("build", |r| Some(r.build)),
        ("refit", |r| Some(r.refit)),
        ("refit, nodes left in place", |r| r.refit_in_place),
        (GRASP, |r| Some(r.search.grasp)),
        (TIPS, |r| Some(r.search.tips)),
        (NEAR, |r| Some(r.search.near)),
    ];
    for (operation, of) in operations {
        for (name, runs) in NAMES.iter().zip(runs) {
            let spread = Spread::of(runs.iter().filter_map(of).filter(|&us| us > 0.0));
            if spread.count == 0 {
                continue;
            }
            let reported = Spread::of(runs.iter().map(|r| r.search.reported)).median;
            let of_near = |value: f64| (operation == NEAR).then_some(value);
            let row: [Cell; 11] = [
                task.skin.shape.name().into(),
                task.skin.points.len().into(),
                operation.into(),
                (*name).into(),
                spread.median.into(),
                spread.min.into(),
                spread.max.into(),
                missed(runs).into(),
                of_near(reported).into(),
                of_near(task.inside_per_pose()).into(),
                spread.count.into(),
            ];
            table.push(row);
        }
    }
}

/// Adds the ratios to one peer for every operation.
fn add_ratios(table: &mut Table, task: &Task, runs: &[Vec<Run>], peer: usize) {
    // The faster of the peer's two ways to refit.
    let operations: [(&str, Of, bool); 8] = [
        ("build", |r| Some(r.build), true),
        ("refit", |r| Some(refit(r)), false),
        (GRASP, |r| Some(r.search.grasp), false),
        (TIPS, |r| Some(r.search.tips), false),
        (NEAR, |r| Some(r.search.near), false),
        ("refit + all that the grasp asks", |r| Some(refit(r) + r.search.grasp), true),
        ("refit + contacts of the tips", |r| Some(refit(r) + r.search.tips), false),
        ("refit + vertices near the hand", |r| Some(refit(r) + r.search.near), true),
    ];
    let ours = &runs[0];
    for (operation, of, has_bar) in operations {
        let times = |runs: &[Run]| runs.iter().filter_map(of).collect::<Vec<f64>>();
        let ratio = Spread::of_ratio(&times(ours), &times(&runs[peer]));
        let is_judged =
            has_bar && task.skin.points.len() >= BAR_VERTICES && NAMES[peer].ends_with("triangles");
        let verdict = match (is_judged, ratio.median <= BAR) {
            (false, _) => "",
            (true, true) => "reached",
            (true, false) => "**not reached**",
        };
        let row: [Cell; 12] = [
            task.skin.shape.name().into(),
            task.skin.points.len().into(),
            operation.into(),
            NAMES[peer].into(),
            ratio.median.into(),
            ratio.p10.into(),
            ratio.p90.into(),
            is_judged.then_some(BAR).into(),
            verdict.into(),
            missed(ours).into(),
            missed(&runs[peer]).into(),
            task.contacts().into(),
        ];
        table.push(row);
    }
}

fn refit(run: &Run) -> f64 {
    run.refit.min(run.refit_in_place.unwrap_or(run.refit))
}

fn missed(runs: &[Run]) -> usize {
    runs.iter().map(|run| run.missed).sum()
}

const GRASP: &str = "all that the grasp asks";
const TIPS: &str = "contacts of the tips";
const NEAR: &str = "vertices near the hand";

const TIME_COLUMNS: [&str; 11] = [
    "surface",
    "vertices",
    "operation",
    "competitor",
    "median_us",
    "min_us",
    "max_us",
    "missed",
    "reported_per_hand",
    "inside_per_hand",
    "rounds",
];

const RATIO_COLUMNS: [&str; 12] = [
    "surface",
    "vertices",
    "operation",
    "peer",
    "ratio",
    "ratio_p10",
    "ratio_p90",
    "bar",
    "verdict",
    "missed",
    "missed_by_peer",
    "contacts_checked",
];

const INTRODUCTION: &str = "\
A hand of fifteen cylinders and five fingertips closes around the object, from four sides and until \
its fingertips are in it: 32 poses. Each round every competitor builds its tree over the surface at \
rest, refits it to one of five deformed shapes, and searches it with every pose; each round another \
one begins. One thread. Ratios are medians of the quotients of the same round, with the values that a \
tenth of the rounds are below and above: below 1 the sphere tree is faster. Every ratio is stated, \
those above 1 too.

The peer is `Bvh` of parry3d 0.31, single precision, default build strategy: `from_leaves`, \
`insert_or_update_partially` of every leaf and `refit`, `intersect_aabb` with the boxes of the same \
colliders. It gets its points already converted; the boxes of its leaves are part of its time, and \
for the ratio it refits in the faster of its two ways. First like with like: its leaves are the \
vertices, as ours are. Then its leaves are triangles, as its users have them; the bar is for those, at \
10 000 vertices.

Three searches. *All that the grasp asks* is what each tick of `run` asks: for each of 15 cylinders \
and 5 tips whether a vertex is inside, within the release margin, or neither, and which vertex each \
tip touches (`sense`). *Contacts of the tips* is the last part of it (`tip_hits`). The peer finds the \
leaves by boxes, and the same exact tests decide, which end at the first vertex inside as ours do. \
*Vertices near the hand* collects every vertex near a segment (thesis 4.4.3), which the grasp does not \
need: the peer's search reports boxes that meet boxes, ours vertices whose leaf sphere meets the \
cylinder or the tip itself, so ours has less left for an exact test.

`missed` counts, over all rounds, poses and shapes, right after the build and after the refit, what \
brute force contradicts: vertices inside a collider that are not reported, segments with or without a \
vertex inside that are said to be otherwise, and contacts that are certain and not found (the vertex \
of the whole surface that is nearest to the contact point, if it lies in the tip and the contact point \
is not outside its tangent plane (4.10)). One miss of the sphere tree ends the report.";
