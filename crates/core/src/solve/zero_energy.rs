//! Motions that cost no energy: one rigid motion per face-connected piece, equal at shared nodes.
//!
//! An element stores no energy only when it moves rigidly, and elements that share a face must
//! then share the motion. Where pieces share an edge or a node only, they are hinged. So the
//! motions without energy are the null space of a small linear system, body by body.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, Point3, Vector3};

use crate::contact::Mask;
use crate::mesh::{Bodies, TetMesh};

/// Relative singular value below which a motion counts as free. Above it the support may be weak,
/// which shows in the condition of the answer, but it is there.
pub(super) const FREE_BELOW: f64 = 1e-10;

/// Hinged bodies with more parts than this are left to the pivots of the factor.
const PARTS_MAX: usize = 100;

/// For every node the rigid parts that meet there, ascending.
pub(super) struct Parts {
    of_node: Vec<Vec<u32>>,
}

/// Face-connected pieces, joined further where two share three nodes that are not in line.
pub(super) fn rigid_parts(mesh: &TetMesh, bodies: &Bodies) -> Parts {
    let mut of_node: Vec<Vec<u32>> = vec![Vec::new(); mesh.node_count()];
    for (tet, &piece) in mesh.tets().iter().zip(&bodies.piece_of_tet) {
        for &n in tet {
            let list = &mut of_node[n as usize];
            if let Err(at) = list.binary_search(&piece) {
                list.insert(at, piece);
            }
        }
    }
    loop {
        let mut shared: BTreeMap<(u32, u32), Vec<u32>> = BTreeMap::new();
        for (node, list) in of_node.iter().enumerate() {
            for (i, &a) in list.iter().enumerate() {
                for &b in &list[i + 1..] {
                    shared.entry((a, b)).or_default().push(node as u32);
                }
            }
        }
        let joined = shared.into_iter().find(|(_, nodes)| spans_a_plane(mesh, nodes));
        let Some(((kept, gone), _)) = joined else { return Parts { of_node } };
        for list in &mut of_node {
            if let Ok(at) = list.binary_search(&gone) {
                list.remove(at);
                if let Err(at) = list.binary_search(&kept) {
                    list.insert(at, kept);
                }
            }
        }
    }
}

/// Whether three of the nodes are not in line.
fn spans_a_plane(mesh: &TetMesh, nodes: &[u32]) -> bool {
    let Some((&first, rest)) = nodes.split_first() else { return false };
    let p0 = mesh.vertices()[first as usize];
    let arms: Vec<Vector3<f64>> = rest.iter().map(|&n| mesh.vertices()[n as usize] - p0).collect();
    let Some(longest) = arms.iter().copied().max_by(|a, b| a.norm().total_cmp(&b.norm())) else {
        return false;
    };
    arms.iter().any(|a| longest.cross(a).norm() > FREE_BELOW * longest.norm_squared())
}

/// The motions of one body that cost no energy and leave its held degrees of freedom in place.
pub(super) struct BodyMotions {
    /// Names of its rigid parts, ascending.
    parts: Vec<u32>,
    /// Centre of its nodes.
    pub centre: Point3<f64>,
    /// Distance of its furthest node from the centre.
    pub size: f64,
    /// Orthonormal basis: (t, ω) per part, ω per `size`.
    pub basis: Vec<DVector<f64>>,
}

impl BodyMotions {
    /// Motions of the body made of `nodes` when `held` degrees of freedom of it and the means of
    /// `masks` on it are in place; `None` if it has too many hinged parts to tell.
    pub fn of_body(
        mesh: &TetMesh,
        parts: &Parts,
        nodes: &[u32],
        held: &[u32],
        masks: &[&Mask],
    ) -> Option<Self> {
        let mut names: Vec<u32> =
            nodes.iter().flat_map(|&n| parts.of_node[n as usize].iter().copied()).collect();
        names.sort_unstable();
        names.dedup();
        if names.len() > PARTS_MAX {
            return None;
        }
        let centre = Point3::from(
            nodes.iter().map(|&n| mesh.vertices()[n as usize].coords).sum::<Vector3<f64>>()
                / nodes.len() as f64,
        );
        let size = nodes
            .iter()
            .map(|&n| (mesh.vertices()[n as usize] - centre).norm())
            .fold(f64::MIN_POSITIVE, f64::max);
        let mut motions = Self { parts: names, centre, size, basis: Vec::new() };
        let mut rows = Rows::new(6 * motions.parts.len());
        for &dof in held {
            let (node, axis) = (dof / 3, dof as usize % 3);
            let part = parts.of_node[node as usize][0];
            rows.push(motions.row(mesh, node, axis, &[(part, 1.0)]));
        }
        for mask in masks {
            for axis in 0..3 {
                let mut mean = DVector::zeros(6 * motions.parts.len());
                for &(node, weight) in mask.entries() {
                    let part = parts.of_node[node as usize][0];
                    mean += motions.row(mesh, node, axis, &[(part, weight)]);
                }
                rows.push(mean);
            }
        }
        for &node in nodes {
            if let Some((&first, others)) = parts.of_node[node as usize].split_first() {
                for &other in others {
                    let joint = [(first, 1.0), (other, -1.0)];
                    (0..3).for_each(|axis| rows.push(motions.row(mesh, node, axis, &joint)));
                }
            }
        }
        motions.basis = rows.null_space();
        Some(motions)
    }

    /// Displacement of a node along an axis, as a row on the motions of some parts.
    fn row(&self, mesh: &TetMesh, node: u32, axis: usize, parts: &[(u32, f64)]) -> DVector<f64> {
        let mut row = DVector::zeros(6 * self.parts.len());
        let r = (mesh.vertices()[node as usize] - self.centre) / self.size;
        for &(part, sign) in parts {
            let c = 6 * self.parts.partition_point(|&p| p < part);
            row[c + axis] += sign;
            // (ω × r)_axis = ω_{axis+1} r_{axis+2} − ω_{axis+2} r_{axis+1}.
            let (next, after) = ((axis + 1) % 3, (axis + 2) % 3);
            row[c + 3 + next] += sign * r[after];
            row[c + 3 + after] -= sign * r[next];
        }
        row
    }

    /// Adds one motion of the basis to a displacement field.
    pub fn add_field(
        &self,
        mesh: &TetMesh,
        parts: &Parts,
        nodes: &[u32],
        motion: &DVector<f64>,
        field: &mut [f64],
    ) {
        for &node in nodes {
            let part = parts.of_node[node as usize][0];
            for axis in 0..3 {
                field[3 * node as usize + axis] +=
                    self.row(mesh, node, axis, &[(part, 1.0)]).dot(motion);
            }
        }
    }
}

/// Nodes of every body, and those of the given degrees of freedom that are on it, in one pass.
pub(super) fn nodes_and_dofs_by_body(bodies: &Bodies, dofs: &[u32]) -> Vec<(Vec<u32>, Vec<u32>)> {
    let mut parts = vec![(Vec::new(), Vec::new()); bodies.count()];
    for (node, body) in bodies.of_node.iter().enumerate() {
        if let Some(body) = body {
            parts[*body as usize].0.push(node as u32);
        }
    }
    for &dof in dofs {
        if let Some(Some(body)) = bodies.of_node.get(dof as usize / 3) {
            parts[*body as usize].1.push(dof);
        }
    }
    parts
}

/// Conditions on the motions, kept as a triangle: thousands of them take no more room than a few,
/// and the condition is not squared.
struct Rows {
    columns: usize,
    /// Rows not yet in the triangle, and the triangle itself in front of them.
    waiting: Vec<DVector<f64>>,
}

impl Rows {
    fn new(columns: usize) -> Self {
        Self { columns, waiting: Vec::new() }
    }

    fn push(&mut self, row: DVector<f64>) {
        self.waiting.push(row);
        if self.waiting.len() >= 4 * self.columns {
            let r = self.triangle();
            self.waiting = r.row_iter().map(|row| row.transpose()).collect();
        }
    }

    /// Square R of a QR decomposition of all rows so far.
    fn triangle(&self) -> DMatrix<f64> {
        let mut a = DMatrix::zeros(self.waiting.len().max(self.columns), self.columns);
        for (i, row) in self.waiting.iter().enumerate() {
            a.row_mut(i).copy_from(&row.transpose());
        }
        a.qr().r()
    }

    /// Orthonormal basis of what all rows annihilate to [`FREE_BELOW`], smallest singular value
    /// first.
    fn null_space(&self) -> Vec<DVector<f64>> {
        let svd = self.triangle().svd(false, true);
        let Some(v_t) = svd.v_t else { return Vec::new() };
        let largest = svd.singular_values.max();
        let mut order: Vec<usize> = (0..self.columns).collect();
        order.sort_by(|&a, &b| svd.singular_values[a].total_cmp(&svd.singular_values[b]));
        order
            .into_iter()
            .take_while(|&i| svd.singular_values[i] <= FREE_BELOW * largest)
            .map(|i| v_t.row(i).transpose())
            .collect()
    }
}
