//! Random contacts and random displacements of them.

use softgrasp_core::contact::Mask;
use softgrasp_core::solve::condensed::Touched;

use super::scenes::Scene;
use softgrasp_bench::random::Random;

/// Kind of contacts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Vertices,
    SingleAxes,
    NearlyInLine,
    Masks,
    OverlappingMasks,
    Mixed,
}

impl Kind {
    pub const ALL: [Self; 6] = [
        Self::Vertices,
        Self::SingleAxes,
        Self::NearlyInLine,
        Self::Masks,
        Self::OverlappingMasks,
        Self::Mixed,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Self::Vertices => "vertices",
            Self::SingleAxes => "single axes",
            Self::NearlyInLine => "nearly in line",
            Self::Masks => "masks",
            Self::OverlappingMasks => "overlapping masks",
            Self::Mixed => "masks and vertices",
        }
    }
}

/// Contacts of one kind; they may still be refused as dependent or as not holding the body.
pub(super) fn contacts(scene: &Scene, kind: Kind, random: &mut Random) -> Touched {
    let node_count = scene.model.mesh().node_count();
    let count = 3 + random.below(3);
    let any: Vec<u32> = (0..count).map(|_| random.below(node_count) as u32).collect();
    let (nodes, masks) = match kind {
        Kind::Vertices | Kind::SingleAxes => (any, vec![]),
        Kind::NearlyInLine => (in_line(scene, random), vec![]),
        Kind::Masks => (vec![], any.iter().map(|&n| mask(scene, n, random)).collect()),
        Kind::OverlappingMasks => {
            let twice = any[..2].iter().flat_map(|&n| [n, n]).chain([any[2]]);
            (vec![], twice.map(|n| mask(scene, n, random)).collect())
        }
        Kind::Mixed => {
            (any[..2].to_vec(), any[2..].iter().map(|&n| mask(scene, n, random)).collect())
        }
    };
    let masks: Vec<Mask> = masks.into_iter().flatten().collect();
    let mut dofs: Vec<u32> = nodes.iter().flat_map(|n| 3 * n..3 * n + 3).collect();
    if kind == Kind::SingleAxes {
        dofs = (0..7 + random.below(6)).map(|_| random.below(3 * node_count) as u32).collect();
    }
    dofs.sort_unstable();
    dofs.dedup();
    dofs.retain(|dof| scene.model.fixed().binary_search(dof).is_err());
    Touched { dofs, masks }
}

/// Displacements of the contacts, m: any, or nearly one and the same, or of one of them alone.
pub(super) fn pushes(scene: &Scene, touched: &Touched, random: &mut Random) -> Vec<f64> {
    let count = touched.force_count();
    let size = 0.1 * scene.length * 10f64.powf(-3.0 * random.share());
    let common: [f64; 3] = std::array::from_fn(|_| random.share() - 0.5);
    let axis_of = |i: usize| match touched.dofs.get(i) {
        Some(dof) => *dof as usize % 3,
        None => (i - touched.dofs.len()) % 3,
    };
    let only = random.below(count.max(1));
    let form = random.below(4);
    (0..count)
        .map(|i| {
            let any = random.share() - 0.5;
            size * match form {
                0 => common[axis_of(i)] + 1e-3 * any,
                1 if i != only => 0.0,
                _ => any,
            }
        })
        .collect()
}

/// Mask of some of the nodes nearest to one, with any weights.
fn mask(scene: &Scene, around: u32, random: &mut Random) -> Option<Mask> {
    let vertices = scene.model.mesh().vertices();
    let centre = vertices[around as usize];
    let mut near: Vec<(f64, u32)> =
        (0u32..).zip(vertices).map(|(node, p)| ((p - centre).norm(), node)).collect();
    near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let count = 2 + random.below(8);
    let entries = near.iter().take(count).map(|&(_, node)| (node, 0.05 + random.share()));
    Mask::try_new(entries.collect()).ok()
}

/// Three nodes almost on one line, the flattest of some random triples, and perhaps one more node near
/// them.
fn in_line(scene: &Scene, random: &mut Random) -> Vec<u32> {
    let vertices = scene.model.mesh().vertices();
    let (mut flattest, mut found) = (f64::INFINITY, vec![0, 1, 2]);
    for _ in 0..60 {
        let triple: [usize; 3] = std::array::from_fn(|_| random.below(vertices.len()));
        let [a, b, c] = triple.map(|node| vertices[node]);
        let (along, across) = (b - a, c - a);
        let longest = along.norm().max(across.norm()).max((c - b).norm());
        let flatness = along.cross(&across).norm() / (longest * longest);
        if flatness > 1e-12 && flatness < flattest {
            (flattest, found) = (flatness, triple.map(|node| node as u32).to_vec());
        }
    }
    found
}
