//! Turns triangles so that neighbours agree which side is outside, and shells so that it is.

use nalgebra::{Point3, Vector3};

use super::moments::winding_of_triangle;
use crate::mesh::DisjointSets;

/// Triangles and shells that were turned, and what the edges say.
#[derive(Clone, Debug, Default)]
pub(super) struct Turned {
    /// Triangles turned against the most of their shell.
    pub(super) triangles: usize,
    /// Shells that were inside out as a whole.
    pub(super) shells: usize,
    /// Shells: triangles joined by edges.
    pub(super) shell_count: usize,
    /// Edges that belong to one triangle only.
    pub(super) open_edges: Vec<[u32; 2]>,
    /// Number of edges of three and more triangles.
    pub(super) crowded_edges: usize,
}

/// One triangle's use of an edge: ends ascending, the triangle, whether it runs upwards.
type Use = ([u32; 2], u32, bool);

/// Turns triangles in place.
///
/// Within a shell the side that most of the area takes for outside is outside; a shell whose volume
/// is negative is turned as a whole, unless it is a cavity: inside the other shells.
pub(super) fn orient(points: &[Point3<f64>], triangles: &mut [[u32; 3]]) -> Turned {
    let uses = sorted_uses(triangles);
    let mut turned = Turned::default();
    let mut shells = DisjointSets::new(triangles.len());
    let mut pairs: Vec<(u32, u32, bool)> = Vec::new();
    for same in uses.chunk_by(|a, b| a.0 == b.0) {
        for pair in same.windows(2) {
            shells.join(pair[0].1 as usize, pair[1].1 as usize);
        }
        match same {
            [one] => turned.open_edges.push(one.0),
            [one, two] => {
                // Neighbours that agree run along their edge in opposite senses.
                let agree = one.2 != two.2;
                pairs.push((one.1, two.1, agree));
                pairs.push((two.1, one.1, agree));
            }
            _ => turned.crowded_edges += 1,
        }
    }
    pairs.sort_unstable();
    turned.triangles = turn_minorities(points, triangles, &pairs);
    let mut by_shell: Vec<(usize, u32)> =
        (0..triangles.len()).map(|t| (shells.root(t), t as u32)).collect();
    by_shell.sort_unstable();
    let mut members: Vec<Vec<u32>> = by_shell
        .chunk_by(|a, b| a.0 == b.0)
        .map(|shell| shell.iter().map(|(_, t)| *t).collect())
        .collect();
    turned.shell_count = members.len();
    members.sort_by_key(|shell| std::cmp::Reverse(shell.len()));
    for shell in members.iter().take(SHELLS_JUDGED) {
        if is_inside_out(points, triangles, shell) {
            shell.iter().for_each(|t| triangles[*t as usize].swap(1, 2));
            turned.shells += 1;
        }
    }
    turned
}

fn sorted_uses(triangles: &[[u32; 3]]) -> Vec<Use> {
    let mut uses: Vec<Use> = (0u32..)
        .zip(triangles)
        .flat_map(|(t, &[a, b, c])| {
            [(a, b), (b, c), (c, a)].map(|(from, to)| ([from.min(to), from.max(to)], t, from < to))
        })
        .collect();
    uses.sort_unstable();
    uses
}

/// Spreads one sense over each patch of neighbours, then turns the part with less area.
fn turn_minorities(
    points: &[Point3<f64>],
    triangles: &mut [[u32; 3]],
    pairs: &[(u32, u32, bool)],
) -> usize {
    let neighbours = |t: u32| {
        let first = pairs.partition_point(|p| p.0 < t);
        pairs[first..].iter().take_while(move |p| p.0 == t)
    };
    let mut is_turned: Vec<Option<bool>> = vec![None; triangles.len()];
    let mut count = 0;
    for start in 0..triangles.len() as u32 {
        if is_turned[start as usize].is_some() {
            continue;
        }
        is_turned[start as usize] = Some(false);
        let mut patch = vec![start];
        let mut at = 0;
        while let Some(&t) = patch.get(at) {
            at += 1;
            let own = is_turned[t as usize] == Some(true);
            for &(_, other, agree) in neighbours(t) {
                if is_turned[other as usize].is_none() {
                    is_turned[other as usize] = Some(own == agree);
                    patch.push(other);
                }
            }
        }
        let area = |t: &u32| area_vector(points, &triangles[*t as usize]).norm();
        let turned = |t: &&u32| is_turned[**t as usize] == Some(true);
        let minority: f64 = patch.iter().filter(turned).map(area).sum();
        let whole: f64 = patch.iter().map(area).sum();
        let side = minority <= 0.5 * whole;
        for t in patch {
            if is_turned[t as usize] == Some(side) {
                triangles[t as usize].swap(1, 2);
                count += 1;
            }
        }
    }
    count
}

/// Whether the volume of a shell is clearly negative and the shell is not inside the others.
fn is_inside_out(points: &[Point3<f64>], triangles: &[[u32; 3]], shell: &[u32]) -> bool {
    let corners = |t: u32| triangles[t as usize].map(|n| points[n as usize]);
    let middle = shell.iter().map(|t| corners(*t)[0].coords).sum::<Vector3<f64>>();
    let middle = Point3::from(middle / shell.len() as f64);
    let (mut volume, mut area) = (0.0, 0.0);
    for t in shell {
        let [a, b, c] = corners(*t).map(|p| p - middle);
        volume += a.dot(&b.cross(&c)) / 6.0;
        area += area_vector(points, &triangles[*t as usize]).norm();
    }
    if volume >= -FLAT * area.powf(1.5) {
        return false;
    }
    let place = corners(shell[0])[0];
    let others = (0..triangles.len() as u32).filter(|t| shell.binary_search(t).is_err());
    let around: f64 = others.map(|t| winding_of_triangle(&corners(t), &place)).sum();
    around.abs() < 0.5
}

fn area_vector(points: &[Point3<f64>], triangle: &[u32; 3]) -> Vector3<f64> {
    let [a, b, c] = triangle.map(|n| points[n as usize]);
    (b - a).cross(&(c - a)) * 0.5
}

/// Shells that are judged, largest first: each takes a sum over all others.
const SHELLS_JUDGED: usize = 64;
/// Volume over area to the power 1.5 below which a shell encloses nothing that could be judged; a
/// sphere has 0.094.
const FLAT: f64 = 1e-3;
