//! Puts single nodes into the middle of inner edges, to reach an exact node count.

use nalgebra::Point3;

use crate::mesh::Incidence;
use crate::stuffing::{Stuffing, least_sine};

/// Splits up to `count` inner edges, spread over the solid, no two at one element.
///
/// Only edges whose halved elements keep all dihedral sines at `sine_min` or above are split;
/// the number of splits made is returned.
pub(super) fn split_inner_edges(stuffing: &mut Stuffing, count: usize, sine_min: f64) -> usize {
    if count == 0 {
        return 0;
    }
    let around = Incidence::new(stuffing.vertices.len(), &stuffing.tets);
    let tet_count = stuffing.tets.len();
    let mut is_touched = vec![false; tet_count];
    let mut made = 0;
    for step in 0..tet_count as u64 {
        // A stride without a common factor visits every element once, far from the last one.
        let tet = (step * SCATTER % tet_count as u64) as usize;
        if is_touched[tet] {
            continue;
        }
        for [i, j] in EDGES {
            let corners = stuffing.tets[tet];
            let ends = [corners[i], corners[j]];
            let ring: Vec<u32> = around
                .tets(ends[0])
                .iter()
                .copied()
                .filter(|t| stuffing.tets[*t as usize].contains(&ends[1]))
                .collect();
            if ring.iter().all(|t| !is_touched[*t as usize])
                && is_closed(stuffing, &ring, ends)
                && split(stuffing, &ring, ends, sine_min)
            {
                ring.iter().for_each(|t| is_touched[*t as usize] = true);
                made += 1;
                break;
            }
        }
        if made == count {
            break;
        }
    }
    made
}

/// Whether the elements of `ring` close around their common edge, so that it is an inner one.
fn is_closed(stuffing: &Stuffing, ring: &[u32], ends: [u32; 2]) -> bool {
    let mut others: Vec<u32> = ring
        .iter()
        .flat_map(|t| stuffing.tets[*t as usize])
        .filter(|n| !ends.contains(n))
        .collect();
    others.sort_unstable();
    others.dedup();
    // An open fan of k elements has k + 1 outer nodes.
    others.len() == ring.len()
}

/// Halves the elements of `ring` at the middle of their common edge, if that keeps them good.
fn split(stuffing: &mut Stuffing, ring: &[u32], ends: [u32; 2], sine_min: f64) -> bool {
    let at = |n: u32| stuffing.vertices[n as usize];
    let middle = Point3::from((at(ends[0]).coords + at(ends[1]).coords) * 0.5);
    let is_good = ring.iter().all(|t| {
        ends.iter().all(|end| {
            let half = stuffing.tets[*t as usize].map(|n| if n == *end { middle } else { at(n) });
            least_sine(&half) >= sine_min
        })
    });
    if !is_good {
        return false;
    }
    let node = u32::try_from(stuffing.vertices.len()).expect("node counts are far below u32");
    stuffing.vertices.push(middle);
    for t in ring {
        let whole = stuffing.tets[*t as usize];
        stuffing.tets[*t as usize] = whole.map(|n| if n == ends[0] { node } else { n });
        stuffing.tets.push(whole.map(|n| if n == ends[1] { node } else { n }));
    }
    true
}

/// A prime above every element count, so without a common factor with any.
const SCATTER: u64 = 1_000_000_007;

/// The six edges of an element by its corners.
const EDGES: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{BuiltIn, Quality, Surface, TetMesh, generate};

    #[test]
    fn splits_keep_the_surface_and_the_volume() {
        let mesh = generate(BuiltIn::Cube, 1000).unwrap();
        let mut stuffing =
            Stuffing { vertices: mesh.vertices().to_vec(), tets: mesh.tets().to_vec() };
        assert_eq!(split_inner_edges(&mut stuffing, 50, 0.3), 50);
        let split = TetMesh::try_new(stuffing.vertices, stuffing.tets, Vec::new()).unwrap();
        assert_eq!(split.node_count(), 1050);
        let volume = |m: &TetMesh| Quality::from_mesh(m, 0).volume;
        assert!((volume(&split) - volume(&mesh)).abs() < 1e-15);
        let triangles = |m: &TetMesh| Surface::from_mesh(m).triangles.len();
        assert_eq!(triangles(&split), triangles(&mesh));
        assert_eq!(Surface::overused_faces(&split), 0);
        assert!(Quality::from_mesh(&split, 0).dihedral_min.sin() >= 0.3);
    }

    #[test]
    fn nothing_is_split_where_no_edge_is_inside() {
        let vertices = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0; 3]];
        let mut stuffing =
            Stuffing { vertices: vertices.map(Point3::from).to_vec(), tets: vec![[0, 1, 2, 3]] };
        assert_eq!(split_inner_edges(&mut stuffing, 3, 0.0), 0);
        assert_eq!(stuffing.vertices.len(), 4);
    }
}
