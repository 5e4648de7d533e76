//! Building the tree: bounding cube, Morton codes, cells, spheres (thesis 4.1–4.6).

use nalgebra::{Point3, Vector3};

use super::node::{LeafRest, TreeError, TreeNode, check_positions};
use crate::shape::Sphere;

/// The spheres of a tree, breadth first, and the vertices in Morton order.
pub(super) struct Cells {
    pub(super) nodes: Vec<TreeNode>,
    /// Number of the mesh node in each slot.
    pub(super) vertices: Vec<u32>,
    /// Position of the node in each slot.
    pub(super) points: Vec<Point3<f64>>,
}

/// Subdivides the cube around the surface's vertices.
///
/// # Errors
/// [`TreeError`] if there is no vertex, an index is out of range or a coordinate is not finite.
///
/// Source: thesis 4.3.2–4.3.3, (4.1)–(4.6).
pub(super) fn cells(positions: &[Point3<f64>], surface_nodes: &[u32]) -> Result<Cells, TreeError> {
    if surface_nodes.is_empty() {
        return Err(TreeError::NoVertices);
    }
    if surface_nodes.len() > VERTEX_COUNT_MAX {
        let count = surface_nodes.len();
        return Err(TreeError::TooMany { count, limit: VERTEX_COUNT_MAX });
    }
    check_positions(positions, surface_nodes)?;

    let cube = BoundingCube::around(surface_nodes.iter().map(|&n| positions[n as usize]));
    let mut keyed: Vec<(u64, u32)> =
        surface_nodes.iter().map(|&n| (cube.morton_code(&positions[n as usize]), n)).collect();
    // Ties (one cell) fall in node order, so the input's order never shows.
    keyed.sort_unstable();
    keyed.dedup();

    let codes: Vec<u64> = keyed.iter().map(|&(code, _)| code).collect();
    let vertices: Vec<u32> = keyed.iter().map(|&(_, node)| node).collect();
    let points: Vec<Point3<f64>> = vertices.iter().map(|&n| positions[n as usize]).collect();
    let nodes = subdivide(&cube, &codes, &points);
    Ok(Cells { nodes, vertices, points })
}

/// Cube around the object; the cells are its subdivisions.
struct BoundingCube {
    low: Point3<f64>,
    edge: f64,
    /// Finest cells per unit of length; 0 for a cube without extent.
    cells_per_length: f64,
    /// What rounding may cost one containment test.
    slack: f64,
}

impl BoundingCube {
    /// Centre of the bounding box (4.1), edge the longest of its three lengths (4.2).
    fn around(points: impl Iterator<Item = Point3<f64>> + Clone) -> Self {
        let mut low = Point3::from([f64::INFINITY; 3]);
        let mut high = Point3::from([f64::NEG_INFINITY; 3]);
        for p in points {
            low = low.inf(&p);
            high = high.sup(&p);
        }
        let edge = (high - low).max();
        let centre = low + (high - low) / 2.0;
        let cells_per_length = f64::from(1_u32 << LEVELS) / edge;
        Self {
            low: centre - Vector3::repeat(edge / 2.0),
            edge,
            cells_per_length: if cells_per_length.is_finite() { cells_per_length } else { 0.0 },
            slack: 8.0 * f64::EPSILON * (low.coords.amax().max(high.coords.amax()) + edge),
        }
    }

    /// Interleaved bits of the finest cell that holds `point`; the three top bits split the cube.
    fn morton_code(&self, point: &Point3<f64>) -> u64 {
        let cell = (point - self.low) * self.cells_per_length;
        // The cast saturates at 0; the far faces of the cube belong to the last cell.
        let bits = cell.map(|c| spread((c as u64).min((1 << LEVELS) - 1)));
        bits.x << 2 | bits.y << 1 | bits.z
    }

    /// Sphere around the cell at `level` that holds `code`.
    ///
    /// Closed form of the recursion (4.4)–(4.6): edge halved and centre moved by ±edge/4 per level.
    fn cell_sphere(&self, code: u64, level: u32) -> Sphere {
        let edge = self.edge / f64::from(1_u32 << level);
        let cell = Vector3::new(code >> 2, code >> 1, code)
            .map(|bits| (gather(bits) >> (LEVELS - level)) as f64 + 0.5);
        // More slack towards the root keeps parents around children although they touch inside.
        let slack = self.slack * f64::from(LEVELS + 2 - level);
        let radius = edge * 0.75_f64.sqrt() + slack;
        Sphere { centre: self.low + cell * edge, radius }
    }
}

/// All tree nodes, breadth first, from sorted codes.
fn subdivide(cube: &BoundingCube, codes: &[u64], points: &[Point3<f64>]) -> Vec<TreeNode> {
    // A tree without single-child chains has fewer inner nodes than leaves.
    let mut nodes = Vec::with_capacity(2 * codes.len());
    let mut levels = Vec::with_capacity(2 * codes.len());
    push_cell(cube, codes, points, 0..codes.len(), 0, &mut nodes, &mut levels);
    let mut next = 0;
    while next < nodes.len() {
        let TreeNode { first_slot, slots, .. } = nodes[next];
        let level: u32 = levels[next];
        let first_child = nodes.len();
        if slots > 1 && level < LEVELS {
            let mut start = first_slot as usize;
            let end = start + slots as usize;
            while start < end {
                let octant = octant(codes[start], level);
                let run = codes[start..end].partition_point(|&c| self::octant(c, level) == octant);
                let cell = start..start + run;
                push_cell(cube, codes, points, cell, level + 1, &mut nodes, &mut levels);
                start += run;
            }
        }
        nodes[next].first_child = first_child as u32;
        nodes[next].children = (nodes.len() - first_child) as u32;
        next += 1;
    }
    nodes
}

/// Appends the node for the vertices in `slots`, which share a cell at `level`.
fn push_cell(
    cube: &BoundingCube,
    codes: &[u64],
    points: &[Point3<f64>],
    slots: std::ops::Range<usize>,
    level: u32,
    nodes: &mut Vec<TreeNode>,
    levels: &mut Vec<u32>,
) {
    let (first, last) = (codes[slots.start], codes[slots.end - 1]);
    // Several vertices: straight to the smallest cell that holds them all. One vertex: a leaf of
    // the size at which it became alone, as in the thesis, so that it reaches its neighbours.
    let level = if slots.len() > 1 { shared_level(first, last) } else { level };
    let mut sphere = cube.cell_sphere(first, level);
    if slots.len() > 1 && level == LEVELS {
        for point in &points[slots.clone()] {
            sphere.radius = sphere.radius.max((point - sphere.centre).norm() * ROUND_UP);
        }
    }
    let (first_slot, slots) = (slots.start as u32, slots.len() as u32);
    nodes.push(TreeNode { sphere, first_child: 0, children: 0, first_slot, slots });
    levels.push(level);
}

/// The leaves, with their spheres relative to their first vertices.
pub(super) fn leaves(nodes: &[TreeNode], points: &[Point3<f64>]) -> Vec<LeafRest> {
    let leaves = (0..).zip(nodes).filter(|(_, node)| node.is_leaf());
    leaves
        .map(|(node, &TreeNode { sphere, first_slot, slots, .. })| LeafRest {
            node,
            first_slot,
            slots,
            centre_from_vertex: sphere.centre - points[first_slot as usize],
            radius: sphere.radius,
        })
        .collect()
}

/// Which of the eight children of a cell at `level` holds `code`.
fn octant(code: u64, level: u32) -> u64 {
    code >> (3 * (LEVELS - 1 - level)) & 7
}

/// Deepest level at which two codes lie in one cell.
fn shared_level(a: u64, b: u64) -> u32 {
    // Codes have 63 bits, so bit 63 is always a shared zero.
    ((a ^ b).leading_zeros() - 1) / 3
}

/// Moves bit i of a 21-bit number to bit 3i.
fn spread(x: u64) -> u64 {
    SPREAD.iter().fold(x, |x, &(shift, mask)| (x | x << shift) & mask)
}

/// Inverse of [`spread`]; bits that are not at multiples of three are dropped.
fn gather(x: u64) -> u64 {
    let x = x & SPREAD[4].1;
    let steps = [(2, SPREAD[3].1), (4, SPREAD[2].1), (8, SPREAD[1].1), (16, SPREAD[0].1)];
    let x = steps.iter().fold(x, |x, &(shift, mask)| (x | x >> shift) & mask);
    (x | x >> 32) & ((1 << LEVELS) - 1)
}

/// Depth limit, the most that three times fits 64 bits.
const LEVELS: u32 = 21;

/// Node indices are 32 bits and there are fewer than two nodes per vertex.
const VERTEX_COUNT_MAX: usize = 1 << 30;

/// Factor that covers the rounding of a distance.
const ROUND_UP: f64 = 1.0 + 8.0 * f64::EPSILON;

/// Each step halves the size of the groups of bits that still lie together.
const SPREAD: [(u32, u64); 5] = [
    (32, 0x001F_0000_0000_FFFF),
    (16, 0x001F_0000_FF00_00FF),
    (8, 0x100F_00F0_0F00_F00F),
    (4, 0x10C3_0C30_C30C_30C3),
    (2, 0x1249_2492_4924_9249),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spread_moves_each_bit_to_three_times_its_place_and_gather_brings_it_back() {
        for bit in 0..LEVELS {
            assert_eq!(spread(1 << bit), 1 << (3 * bit));
        }
        for x in [0, 1, 0x1F_FFFF, 0x15_5555, 0x0A_AAAA, 0x12_3456] {
            assert_eq!(gather(spread(x)), x);
            assert_eq!(gather(spread(x) | spread(!x & 0x1F_FFFF) << 1), x);
        }
    }

    /// The recursion as the thesis writes it, one level after the other.
    #[test]
    fn cells_are_those_of_the_recursion_4_4_to_4_6() {
        let corners = [Point3::new(-0.2, 0.1, 0.3), Point3::new(0.5, 0.3, 0.35)];
        let cube = BoundingCube::around(corners.into_iter());
        let point = Point3::new(0.123, 0.21, 0.32);
        let code = cube.morton_code(&point);
        let mut centre = Point3::new(0.15, 0.2, 0.325);
        let (mut edge, mut radius) = (0.7, 0.7 * 0.75_f64.sqrt());
        for level in 0..=LEVELS {
            let sphere = cube.cell_sphere(code, level);
            assert!((sphere.centre - centre).norm() < 1e-14, "level {level}");
            assert!((sphere.radius - radius).abs() < 1e-13, "level {level}");
            let side = (point - centre).map(|d| if d < 0.0 { -edge / 4.0 } else { edge / 4.0 });
            centre += side;
            edge /= 2.0;
            radius /= 2.0;
        }
    }
}
