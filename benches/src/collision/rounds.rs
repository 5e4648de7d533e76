//! One round of every competitor: build, refit and search, timed and checked against brute force.

use std::hint::black_box;
use std::time::Duration;

use nalgebra::{Point3, Vector3};
use parry3d::bounding_volume::Aabb;
use softgrasp_core::mesh::BuiltIn;
use softgrasp_grasp::hand::HandColliders;
use softgrasp_grasp::sphere_tree::{SphereTree, vertex_normals};

use super::brute::Inside;
use super::felt::{self, SurfaceOf};
use super::hand_poses::{Poses, poses};
use super::peer::{Leaf, Peer, PeerPoints, collider_boxes, peer_points};
use super::skin::Skin;
use crate::report::{ReportError, check};
use crate::sample::{Competitor, Effort, take_turns, timed_ms};

/// Names of the competitors, in the order of their runs.
pub(super) const NAMES: [&str; 4] =
    ["sphere tree", "parry3d Bvh, vertices", "parry3d Bvh, triangles", "brute force"];
/// Number of deformed shapes, which take turns.
const DEFORMED: usize = 5;

/// Shape of the surface, and the vertices inside each pose of the hand.
struct Frame {
    points: Vec<Point3<f64>>,
    peer_points: PeerPoints,
    normals: Vec<Vector3<f64>>,
    inside: Vec<Inside>,
}

/// Surface at rest (first) and deformed (the others), and the hands that search it.
pub(super) struct Task {
    pub skin: Skin,
    poses: Poses,
    boxes: Vec<[Aabb; 20]>,
    frames: Vec<Frame>,
}

/// One round of one competitor; times in µs, those of searches for each pose of the hand.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Run {
    pub build: f64,
    pub refit: f64,
    /// Time of the peer's other way to refit, µs.
    pub refit_in_place: Option<f64>,
    pub search: Search,
    /// Number of vertices inside a collider that were not reported, and of wrong results.
    pub missed: usize,
}

/// Times of the searches of one pose, µs.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Search {
    /// Time of the whole search for a hand in a tick.
    pub grasp: f64,
    /// Time of the search for contacts of the fingertips only.
    pub tips: f64,
    /// Time of collecting the vertices near each segment and tip, as the thesis does.
    pub near: f64,
    /// Number of leaves or vertices that the last search reports.
    pub reported: f64,
}

impl Task {
    /// Task on a surface of about `vertices` vertices, with deformed shapes and the vertices inside every
    /// hand.
    pub fn try_new(shape: BuiltIn, vertices: usize) -> Result<Self, ReportError> {
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
    pub fn inside_per_pose(&self) -> f64 {
        let all = self.frames[1..].iter().flat_map(|f| &f.inside);
        all.map(Inside::count).sum::<usize>() as f64 / (DEFORMED * self.poses.len()) as f64
    }

    /// Number of certain contacts over the deformed shapes.
    pub fn contacts(&self) -> usize {
        let all = self.frames[1..].iter().flat_map(|f| &f.inside);
        all.map(|inside| inside.contacts.iter().flatten().count()).sum()
    }

    fn surface<'a>(&'a self, frame: &'a Frame) -> SurfaceOf<'a> {
        let triangles = &self.skin.triangles;
        SurfaceOf { points: &frame.points, normals: &frame.normals, triangles }
    }

    /// Builds the tree on the rest shape, refits it to a deformed one, and searches it with every pose.
    fn run_sphere_tree(&self, round: usize) -> Result<Run, ReportError> {
        let (rest, frame) = (&self.frames[0], &self.frames[1 + round % DEFORMED]);
        let nodes: Vec<u32> = (0..).take(rest.points.len()).collect();
        let (build, tree) = timed_ms(|| SphereTree::try_build(&rest.points, &nodes));
        let mut tree = tree?;
        let mut missed = self.missed_by_tree(&tree, rest);
        let (refit, refitted) = timed_ms(|| tree.refit(&frame.points));
        refitted?;
        let surface = self.surface(frame);
        let search = self.search(
            |hand| {
                black_box(felt::by_tree(&tree, surface, hand));
            },
            |hand| {
                black_box(felt::contacts_by_tree(&tree, surface, hand));
            },
            |pose, found| search_hand(&tree, &self.poses[pose], |_| {}, found),
        );
        missed += self.missed_by_tree(&tree, frame);
        Ok(Run { build: 1e3 * build, refit: 1e3 * refit, refit_in_place: None, search, missed })
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
        let surface = self.surface(frame);
        let search = self.search(
            |hand| {
                black_box(felt::by_peer(&peer, surface, hand));
            },
            |hand| {
                black_box(felt::contacts_by_peer(&peer, surface, hand));
            },
            |pose, found| self.boxes[pose].iter().for_each(|aabb| peer.query(aabb, found)),
        );
        missed += self.missed_by_peer(&peer, frame);
        let refit_in_place = Some(1e3 * in_place);
        Run { build: 1e3 * build, refit: 1e3 * refit, refit_in_place, search, missed }
    }

    fn run_brute_force(&self, round: usize) -> Run {
        let frame = &self.frames[1 + round % DEFORMED];
        let (near, inside) = timed_ms(|| {
            let all = self.poses.iter().map(|h| Inside::of(h, &frame.points, &frame.normals));
            all.map(|inside| inside.count()).sum::<usize>()
        });
        let poses = self.poses.len() as f64;
        let (near, reported) = (1e3 * near / poses, inside as f64 / poses);
        Run { search: Search { near, reported, ..Search::default() }, ..Run::default() }
    }

    /// Times of the three searches over all poses.
    fn search(
        &self,
        grasp: impl Fn(&HandColliders),
        tips: impl Fn(&HandColliders),
        near: impl Fn(usize, &mut Vec<u32>),
    ) -> Search {
        let poses = self.poses.len() as f64;
        let (grasp, ()) = timed_ms(|| self.poses.iter().for_each(grasp));
        let (tips, ()) = timed_ms(|| self.poses.iter().for_each(tips));
        let mut found = Vec::new();
        let (near, reported) = timed_ms(|| {
            let mut reported = 0;
            for pose in 0..self.poses.len() {
                found.clear();
                near(pose, &mut found);
                reported += found.len();
            }
            reported
        });
        let [grasp, tips, near] = [grasp, tips, near].map(|ms| 1e3 * ms / poses);
        Search { grasp, tips, near, reported: reported as f64 / poses }
    }

    /// Number of vertices inside a collider that the sphere tree does not report, and of results that
    /// brute force contradicts.
    fn missed_by_tree(&self, tree: &SphereTree, frame: &Frame) -> usize {
        let surface = self.surface(frame);
        let mut missed = 0;
        for (hand, inside) in self.poses.iter().zip(&frame.inside) {
            let (mut found, mut ends) = (Vec::new(), vec![0]);
            search_hand(tree, hand, |end| ends.push(end), &mut found);
            for (range, expected) in ends.windows(2).zip(&inside.by_collider) {
                missed += not_among(expected, found[range[0]..range[1]].to_vec());
            }
            missed += felt::wrong(&felt::by_tree(tree, surface, hand), inside);
            let contacts = felt::contacts_by_tree(tree, surface, hand);
            missed += felt::wrong_contacts(&contacts, inside);
        }
        missed
    }

    /// Number of vertices that the peer does not report, and of its results that brute force contradicts.
    fn missed_by_peer(&self, peer: &Peer, frame: &Frame) -> usize {
        let surface = self.surface(frame);
        let mut missed = 0;
        for ((hand, boxes), inside) in self.poses.iter().zip(&self.boxes).zip(&frame.inside) {
            for (aabb, expected) in boxes.iter().zip(&inside.by_collider) {
                let mut leaves = Vec::new();
                peer.query(aabb, &mut leaves);
                missed += not_among(expected, peer.vertices_of(&leaves, &self.skin.triangles));
            }
            missed += felt::wrong(&felt::by_peer(peer, surface, hand), inside);
            let contacts = felt::contacts_by_peer(peer, surface, hand);
            missed += felt::wrong_contacts(&contacts, inside);
        }
        missed
    }
}

/// Number of expected vertices that were not reported.
fn not_among(expected: &[u32], mut reported: Vec<u32>) -> usize {
    reported.sort_unstable();
    expected.iter().filter(|v| reported.binary_search(v).is_err()).count()
}

/// Searches with the fifteen cylinders and then the five tips; `ended` gets the length of `found` after
/// each.
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

/// Runs all competitors in turn, in the order of [`NAMES`].
///
/// # Errors
/// [`ReportError::Wrong`] for a miss of the sphere tree.
pub(super) fn run_all(task: &Task, is_quick: bool) -> Result<Vec<Vec<Run>>, ReportError> {
    let effort = Effort {
        warm_up_rounds: 2,
        rounds_min: if is_quick { 5 } else { 40 },
        rounds_max: if is_quick { 10 } else { 400 },
        budget: Duration::from_secs(if is_quick { 2 } else { 40 }),
    };
    type Work<'a> = Box<dyn FnMut(usize) -> Result<Run, ReportError> + 'a>;
    let work: [Work<'_>; 4] = [
        Box::new(|round| task.run_sphere_tree(round)),
        Box::new(|round| Ok(task.run_peer(Leaf::Vertex, round))),
        Box::new(|round| Ok(task.run_peer(Leaf::Triangle, round))),
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
