//! Tetrahedra over the cubes of an octree: centres are joined across faces, as in a centred lattice.
//!
//! Source: Labelle and Shewchuk, "Isosurface stuffing", SIGGRAPH 2007: between cubes of one
//! size two centres and an edge of their face; where that edge is halved, two halves; between a cube
//! and the four smaller ones at its face, eight quarters on its side and two half pyramids on each
//! of theirs.

use nalgebra::Point3;

use super::octree::{Key, Octree};

/// Points and tetrahedra that fill the cubes of an octree without gap or overlap, but for the outer
/// half of the outermost cubes.
///
/// Shapes: `spacings` (the edge of the smallest cube at a point) and `parities` one entry a point.
#[derive(Clone, Debug, Default)]
pub(super) struct Grid {
    pub(super) points: Vec<Point3<f64>>,
    pub(super) spacings: Vec<f64>,
    /// 0 or 1, different for the two ends of an edge between cubes of one size along an axis.
    pub(super) parities: Vec<u8>,
    pub(super) tets: Vec<[u32; 4]>,
    keys: Vec<Key>,
}

impl Grid {
    /// Makes the grid of an octree.
    pub(super) fn new(tree: &Octree) -> Self {
        let mut places: Vec<(Key, i32)> = tree
            .leaves()
            .flat_map(|(key, level)| {
                let length = Octree::length(level);
                let corners =
                    (0..8).map(move |c| [0, 1, 2].map(|d| key[d] + (c >> d & 1) * length));
                corners.chain([key.map(|i| i + length / 2)]).map(move |place| (place, length))
            })
            .collect();
        places.sort_unstable();
        places.dedup_by_key(|(key, _)| *key);
        let mut grid = Self::default();
        for (key, length) in places {
            grid.keys.push(key);
            grid.points.push(tree.position(key));
            grid.spacings.push(f64::from(length) * tree.edge(0) / f64::from(Octree::length(0)));
            let cell: i32 = key.iter().map(|i| i.div_euclid(length)).sum();
            grid.parities.push(cell.rem_euclid(2) as u8);
        }
        for (key, level) in tree.leaves() {
            for axis in 0..3 {
                for forward in [false, true] {
                    grid.add_face(tree, key, level, axis, forward);
                }
            }
        }
        grid
    }

    /// The point at a place, if the octree has a corner or a centre there.
    fn find(&self, place: Key) -> Option<u32> {
        self.keys.binary_search(&place).ok().map(|i| i as u32)
    }

    /// Adds the tetrahedra of one face of a cube.
    fn add_face(&mut self, tree: &Octree, key: Key, level: u8, axis: usize, forward: bool) {
        let length = Octree::length(level);
        let mut beyond = key.map(|i| i + length / 2);
        beyond[axis] += if forward { length } else { -length };
        let Some((other, other_level)) = tree.leaf_at(beyond) else { return };
        let mut low = key;
        low[axis] += if forward { length } else { 0 };
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let at = |a: i32, b: i32| {
            let mut place = low;
            place[u] += a * length / 2;
            place[v] += b * length / 2;
            place
        };
        // Round the face: corners at even places, middles of edges at odd ones.
        let ring = [(0, 0), (1, 0), (2, 0), (2, 1), (2, 2), (1, 2), (0, 2), (0, 1)];
        let ring = ring.map(|(a, b)| self.find(at(a, b)));
        let centre = self.find(key.map(|i| i + length / 2));
        let corner = |i: usize| ring[2 * i % 8];
        let Some(centre) = centre else { return };
        if other_level == level {
            // Each pair of cubes once.
            if !forward {
                return;
            }
            let opposite = self.find(other.map(|i| i + length / 2));
            for side in 0..4 {
                let ends = (corner(side), corner(side + 1), opposite);
                let (Some(a), Some(b), Some(opposite)) = ends else { continue };
                match ring[2 * side + 1] {
                    Some(m) => {
                        self.tets.push([centre, opposite, a, m]);
                        self.tets.push([centre, opposite, m, b]);
                    }
                    None => self.tets.push([centre, opposite, a, b]),
                }
            }
        } else if other_level > level {
            let middle = self.find(at(1, 1));
            for i in 0..8 {
                let (Some(a), Some(b), Some(middle)) = (ring[i], ring[(i + 1) % 8], middle) else {
                    continue;
                };
                self.tets.push([centre, middle, a, b]);
            }
        } else {
            // The corner that is the middle of the larger cube's face begins the diagonal.
            let mut middle = other.map(|i| i + length);
            middle[axis] = low[axis];
            let start = (0..4).find(|i| corner(*i).is_some() && corner(*i) == self.find(middle));
            let Some(start) = start else { return };
            let quad = [0, 1, 2, 3].map(|i| corner(start + i));
            let [Some(a), Some(b), Some(c), Some(d)] = quad else { return };
            self.tets.push([centre, a, b, c]);
            self.tets.push([centre, a, c, d]);
        }
    }

    /// Whether two points differ along one axis only.
    pub(super) fn is_along_axis(&self, a: usize, b: usize) -> bool {
        (0..3).filter(|d| self.keys[a][*d] != self.keys[b][*d]).count() == 1
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::mesh::{Quality, Surface, TetMesh, signed_volume};

    #[test]
    fn graded_tetrahedra_fit_together_and_have_good_angles() {
        let bounds = (Point3::origin(), Point3::new(1.0, 0.9, 0.8));
        let tree = Octree::new(bounds, 0.1, [0.4, 0.2, 0.7], |p, distance| {
            let off = Vector3::new(p.x - 0.5, p.y - 0.45, p.z - 0.4).norm() - 0.35;
            match off.abs() < distance {
                true if p.x < 0.4 => 0.04,
                true => 0.1,
                false => f64::INFINITY,
            }
        });
        let grid = Grid::new(&tree);
        let positive = |t: &[u32; 4]| {
            let volume = signed_volume(&t.map(|n| grid.points[n as usize]));
            assert!(volume.abs() > 1e-9);
            if volume > 0.0 { *t } else { [t[1], t[0], t[2], t[3]] }
        };
        let tets = grid.tets.iter().map(positive).collect();
        let mesh = TetMesh::try_new(grid.points.clone(), tets, vec![]).unwrap();
        let quality = Quality::from_mesh(&mesh, 0);
        assert!(quality.dihedral_min.to_degrees() > 44.9, "{}", quality.dihedral_min.to_degrees());
        assert!(quality.dihedral_max.to_degrees() < 120.1);
        assert_eq!(Surface::overused_faces(&mesh), 0);
        // No face is left open inside: the surface's volume is that of the elements, and it is closed.
        let surface = Surface::from_mesh(&mesh);
        assert_eq!(surface.non_manifold_edges(), 0);
        let corner = |n: u32| mesh.vertices()[n as usize].coords;
        let around: f64 = surface
            .triangles
            .iter()
            .map(|t| corner(t[0]).dot(&corner(t[1]).cross(&corner(t[2]))) / 6.0)
            .sum();
        assert!((around - quality.volume).abs() < 1e-12 * around);
        assert_eq!(surface.euler_characteristic(), 2);
    }
}
