//! The measurement itself: build, refit and search, in turns, checked against brute force.

use std::time::Duration;

use nalgebra::{Point3, Vector3};
use parry3d::bounding_volume::Aabb;
use softgrasp_core::hand::HandColliders;
use softgrasp_core::mesh::BuiltIn;
use softgrasp_core::sphere_tree::{SphereTree, tip_hits, vertex_normals};

use super::brute::Inside;
use super::hand_poses::{Poses, poses};
use super::peer::{Leaf, Peer, PeerPoints, collider_boxes, peer_points};
use super::skin::Skin;
use crate::report::{Options, Report, ReportError, check, progress};
use crate::sample::{Competitor, Effort, Spread, take_turns, timed_ms};
use crate::table::{Cell, Table};

/// A shape of the surface, and what is inside every pose of the hand then.
struct Frame {
    points: Vec<Point3<f64>>,
    peer_points: PeerPoints,
    normals: Vec<Vector3<f64>>,
    inside: Vec<Inside>,
}

/// A surface at rest (first) and deformed (the others), and the hands that search it.
struct Task {
    skin: Skin,
    poses: Poses,
    boxes: Vec<[Aabb; 20]>,
    frames: Vec<Frame>,
}

/// One round of one competitor; times in µs, the search per pose of the hand.
#[derive(Clone, Copy, Debug, Default)]
struct Run {
    build: f64,
    refit: f64,
    refit_in_place: Option<f64>,
    search: f64,
    /// Leaves or vertices reported per pose.
    candidates: f64,
    /// Vertices inside a collider, or contacts of a tip, that were not reported.
    missed: usize,
}

const NAMES: [&str; 4] =
    ["sphere tree", "parry3d Bvh, triangles", "parry3d Bvh, vertices", "brute force"];
/// Deformed shapes, taken in turn.
const DEFORMED: usize = 5;
/// What a ratio may be, and from how many vertices on it counts (objects come near 10 000).
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
    let mut ratios = Table::new("collision-ratios", "Sphere tree over its peers", &RATIO_COLUMNS);
    for &(shape, vertices) in surfaces {
        progress("collision", &format!("{shape}, about {vertices} surface vertices"));
        let task = Task::try_new(shape, vertices)?;
        let runs = run_all(&task, options.is_quick)?;
        add_times(&mut times, &task, &runs);
        add_ratios(&mut ratios, &task, &runs);
    }
    report.text(INTRODUCTION);
    report.table(ratios);
    report.table(times);
    Ok(report)
}

impl Task {
    fn try_new(shape: BuiltIn, vertices: usize) -> Result<Self, ReportError> {
        let skin = Skin::try_new(shape, vertices)?;
        let mut normals = Vec::new();
        vertex_normals(&skin.points, &skin.triangles, &mut normals)?;
        let poses = poses(&skin.points, &normals);
        let boxes = poses.iter().map(collider_boxes).collect();
        let frame = |step: usize| -> Result<Frame, ReportError> {
            let points = skin.deformed(step as f64 / DEFORMED as f64);
            let mut normals = Vec::new();
            vertex_normals(&points, &skin.triangles, &mut normals)?;
            let inside = poses.iter().map(|hand| Inside::of(hand, &points, &normals)).collect();
            Ok(Frame { peer_points: peer_points(&points), points, normals, inside })
        };
        let frames = (0..=DEFORMED).map(frame).collect::<Result<_, _>>()?;
        Ok(Self { skin, poses, boxes, frames })
    }

    /// Pairs of collider and vertex inside it, per pose, over the deformed shapes.
    fn inside_per_pose(&self) -> f64 {
        let all = self.frames[1..].iter().flat_map(|f| &f.inside);
        all.map(Inside::count).sum::<usize>() as f64 / (DEFORMED * self.poses.len()) as f64
    }

    fn contacts(&self) -> usize {
        let all = self.frames[1..].iter().flat_map(|f| &f.inside);
        all.map(|inside| inside.contacts.iter().flatten().count()).sum()
    }

    /// Build on the rest shape, refit to a deformed one, search it with every pose.
    fn run_sphere_tree(&self, round: usize) -> Result<Run, ReportError> {
        let (rest, frame) = (&self.frames[0], &self.frames[1 + round % DEFORMED]);
        let nodes: Vec<u32> = (0..).take(rest.points.len()).collect();
        let (build, tree) = timed_ms(|| SphereTree::try_build(&rest.points, &nodes));
        let mut tree = tree?;
        let mut missed = self.missed_by_tree(&tree, rest);
        let (refit, refitted) = timed_ms(|| tree.refit(&frame.points));
        refitted?;
        let mut found = Vec::new();
        let (search, candidates) = timed_ms(|| {
            let mut candidates = 0;
            for hand in &self.poses {
                found.clear();
                search_hand(&tree, hand, |_| {}, &mut found);
                candidates += found.len();
            }
            candidates
        });
        missed += self.missed_by_tree(&tree, frame);
        Ok(self.run(build, refit, search, candidates, missed))
    }

    fn run_peer(&self, leaf: Leaf, round: usize) -> Run {
        let (rest, frame) = (&self.frames[0], &self.frames[1 + round % DEFORMED]);
        let triangles = &self.skin.triangles;
        let (build, mut peer) = timed_ms(|| Peer::build(leaf, &rest.peer_points, triangles));
        let mut missed = self.missed_by_peer(&peer, rest);
        let (in_place, ()) = timed_ms(|| peer.refit_in_place(&frame.peer_points, triangles));
        missed += self.missed_by_peer(&peer, frame);
        // Back, so that the other way to refit has the same to do.
        peer.refit_in_place(&rest.peer_points, triangles);
        let (refit, ()) = timed_ms(|| peer.refit(&frame.peer_points, triangles));
        let mut found = Vec::new();
        let (search, candidates) = timed_ms(|| {
            let mut candidates = 0;
            for boxes in &self.boxes {
                found.clear();
                boxes.iter().for_each(|aabb| peer.query(aabb, &mut found));
                candidates += found.len();
            }
            candidates
        });
        missed += self.missed_by_peer(&peer, frame);
        let refit_in_place = Some(1e3 * in_place);
        Run { refit_in_place, ..self.run(build, refit, search, candidates, missed) }
    }

    fn run_brute_force(&self, round: usize) -> Run {
        let frame = &self.frames[1 + round % DEFORMED];
        let (search, inside) = timed_ms(|| {
            let all = self.poses.iter().map(|h| Inside::of(h, &frame.points, &frame.normals));
            all.map(|inside| inside.count()).sum()
        });
        self.run(0.0, 0.0, search, inside, 0)
    }

    /// From ms for all poses to µs a pose.
    fn run(&self, build: f64, refit: f64, search: f64, candidates: usize, missed: usize) -> Run {
        let poses = self.poses.len() as f64;
        Run {
            build: 1e3 * build,
            refit: 1e3 * refit,
            refit_in_place: None,
            search: 1e3 * search / poses,
            candidates: candidates as f64 / poses,
            missed,
        }
    }

    /// Vertices inside a collider that its search does not report, and contacts that the exact
    /// test does not put first.
    fn missed_by_tree(&self, tree: &SphereTree, frame: &Frame) -> usize {
        let mut missed = 0;
        for (hand, inside) in self.poses.iter().zip(&frame.inside) {
            let (mut found, mut ends) = (Vec::new(), vec![0]);
            search_hand(tree, hand, |end| ends.push(end), &mut found);
            for (range, expected) in ends.windows(2).zip(&inside.by_collider) {
                let mut reported = found[range[0]..range[1]].to_vec();
                reported.sort_unstable();
                missed += expected.iter().filter(|v| reported.binary_search(v).is_err()).count();
            }
            for (finger, contact) in hand.fingers.iter().zip(inside.contacts) {
                let hits = tip_hits(tree, &frame.normals, &finger.tip, &finger.contact_point);
                let first = hits[0].map(|hit| hit.node);
                missed += usize::from(contact.is_some() && first != contact);
            }
        }
        missed
    }

    fn missed_by_peer(&self, peer: &Peer, frame: &Frame) -> usize {
        let mut missed = 0;
        for (boxes, inside) in self.boxes.iter().zip(&frame.inside) {
            for (aabb, expected) in boxes.iter().zip(&inside.by_collider) {
                let mut leaves = Vec::new();
                peer.query(aabb, &mut leaves);
                let reported = peer.vertices_of(&leaves, &self.skin.triangles);
                missed += expected.iter().filter(|v| reported.binary_search(v).is_err()).count();
            }
        }
        missed
    }
}

/// Searches with the fifteen cylinders and then the five tips; `ended` hears the length of `found`
/// after each.
fn search_hand(
    tree: &SphereTree,
    hand: &HandColliders,
    mut ended: impl FnMut(usize),
    found: &mut Vec<u32>,
) {
    for cylinder in hand.fingers.iter().flat_map(|finger| &finger.cylinders) {
        tree.search_cylinder(cylinder, found);
        ended(found.len());
    }
    for finger in &hand.fingers {
        tree.search_sphere(&finger.tip, found);
        ended(found.len());
    }
}

/// All competitors in turn; a miss of the sphere tree ends the report.
fn run_all(task: &Task, is_quick: bool) -> Result<Vec<Vec<Run>>, ReportError> {
    let effort = Effort {
        warm_up_rounds: 2,
        rounds_min: if is_quick { 5 } else { 40 },
        rounds_max: if is_quick { 10 } else { 400 },
        budget: Duration::from_secs(if is_quick { 2 } else { 40 }),
    };
    type Work<'a> = Box<dyn FnMut(usize) -> Result<Run, ReportError> + 'a>;
    let work: [Work<'_>; 4] = [
        Box::new(|round| task.run_sphere_tree(round)),
        Box::new(|round| Ok(task.run_peer(Leaf::Triangle, round))),
        Box::new(|round| Ok(task.run_peer(Leaf::Vertex, round))),
        Box::new(|round| Ok(task.run_brute_force(round))),
    ];
    let mut competitors: Vec<Competitor<'_, Run, ReportError>> = Vec::new();
    for mut work in work {
        let mut round = 0;
        competitors.push(Box::new(move || {
            round += 1;
            work(round)
        }));
    }
    let runs = take_turns(&effort, &mut competitors)?;
    drop(competitors);
    let missed: usize = runs[0].iter().map(|run| run.missed).sum();
    check(|| format!("sphere tree on {}: vertices missed", task.skin.shape), missed as f64, 0.0)?;
    Ok(runs)
}

fn add_times(table: &mut Table, task: &Task, runs: &[Vec<Run>]) {
    type Of = fn(&Run) -> Option<f64>;
    let operations: [(&str, Of); 4] = [
        ("build", |r| Some(r.build)),
        ("refit", |r| Some(r.refit)),
        ("refit, nodes left in place", |r| r.refit_in_place),
        ("search of the hand", |r| Some(r.search)),
    ];
    for (operation, of) in operations {
        for (name, runs) in NAMES.iter().zip(runs) {
            let spread = Spread::of(runs.iter().filter_map(of).filter(|&us| us > 0.0));
            if spread.count == 0 {
                continue;
            }
            let candidates = Spread::of(runs.iter().map(|r| r.candidates)).median;
            let is_search = operation.starts_with("search");
            let row: [Cell; 11] = [
                task.skin.shape.name().into(),
                task.skin.points.len().into(),
                operation.into(),
                (*name).into(),
                spread.median.into(),
                spread.min.into(),
                spread.max.into(),
                runs.iter().map(|r| r.missed).sum::<usize>().into(),
                if is_search { candidates.into() } else { Cell::Blank },
                if is_search { task.inside_per_pose().into() } else { Cell::Blank },
                spread.count.into(),
            ];
            table.push(row);
        }
    }
}

fn add_ratios(table: &mut Table, task: &Task, runs: &[Vec<Run>]) {
    type Of = fn(&Run) -> f64;
    let operations: [(&str, Of); 2] = [
        ("build", |r| r.build),
        // The faster of the peer's two ways to refit.
        ("refit + search", |r| r.refit.min(r.refit_in_place.unwrap_or(r.refit)) + r.search),
    ];
    let ours = &runs[0];
    for (operation, of) in operations {
        for (name, peer) in NAMES.iter().zip(runs).skip(1).take(2) {
            let times = |runs: &[Run]| runs.iter().map(of).collect::<Vec<f64>>();
            let ratio = Spread::of_ratio(&times(ours), &times(peer));
            let is_judged = task.skin.points.len() >= BAR_VERTICES && *name == NAMES[1];
            let verdict = match (is_judged, ratio.median <= BAR) {
                (false, _) => "",
                (true, true) => "reached",
                (true, false) => "**not reached**",
            };
            let row: [Cell; 11] = [
                task.skin.shape.name().into(),
                task.skin.points.len().into(),
                operation.into(),
                (*name).into(),
                ratio.median.into(),
                ratio.p10.into(),
                ratio.p90.into(),
                if is_judged { BAR.into() } else { Cell::Blank },
                verdict.into(),
                ours.iter().map(|r| r.missed).sum::<usize>().into(),
                task.contacts().into(),
            ];
            table.push(row);
        }
    }
}

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

const RATIO_COLUMNS: [&str; 11] = [
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
    "contacts_checked",
];

const INTRODUCTION: &str = "\
A hand of fifteen cylinders and five fingertips closes around the object, from four sides and until \
its fingertips are in it: 32 poses. Each round every competitor builds its tree over the surface at rest, refits it to one of \
five deformed shapes, and searches it with every pose; each round another one begins. One thread. \
Ratios are medians of the quotients of the same round, with the values that a tenth of the rounds \
are below and above. The bar is for 10 000 vertices and the peer with triangles, as its users have \
them.

The peer is `Bvh` of parry3d 0.31, single precision, default build strategy: `from_leaves`, \
`insert_or_update_partially` of every leaf and `refit`, `intersect_aabb` with the boxes of the same \
colliders. It gets its points already converted; the boxes of its leaves are part of its time. It \
has leaves of triangles, or of vertices, as ours are. For the ratio it refits in \
the faster of its two ways. Its search reports boxes that meet boxes, ours vertices whose leaf \
sphere meets the cylinder or the tip itself, so ours has less left for the exact test.

`missed` counts, over all rounds, poses and shapes, right after the build and after the refit, the \
vertices that brute force finds inside a collider and the search does not report; for the sphere \
tree also the contacts of a fingertip that `tip_hits` does not put first: the vertex of the whole \
surface that is nearest to the contact point, if it lies in the tip and the contact point is not \
outside its tangent plane (4.10). One miss of the sphere tree ends the report.";
