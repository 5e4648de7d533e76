//! Motions that cost no energy: one rigid motion per face-connected piece, equal at shared nodes.
//!
//! An element stores no energy only when it moves rigidly, and elements that share a face must
//! then share the motion. Where pieces share an edge or a node only, they are hinged. So the
//! motions without energy are the null space of a small linear system, body by body.
//!
//! Also which degrees of freedom to hold so that a stiffness that leaves motions free has a factor.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, Point3, Vector3};

use crate::contact::Mask;
use crate::mesh::{Bodies, TetMesh};

/// Relative singular value below which a motion counts as free. Above it the support may be weak,
/// which shows in the condition of the answer, but it is there.
pub(super) const FREE_BELOW: f64 = 1e-10;

/// Hinged bodies with more parts than this are left to the pivots of the factor.
const PARTS_MAX: usize = 100;

/// The rigid parts of every body: what of the motions depends on the shape alone.
///
/// Shapes: one part per node, one body per body of the mesh.
pub struct RigidBodies {
    /// The first of the parts that meet at a node.
    part_of_node: Vec<u32>,
    bodies: Vec<RigidBody>,
}

/// One body and the parts it is made of.
pub(super) struct RigidBody {
    /// Its nodes, ascending.
    pub nodes: Vec<u32>,
    /// Names of its rigid parts, ascending.
    parts: Vec<u32>,
    /// Nodes where parts meet, and the parts, ascending.
    joints: Vec<(u32, Vec<u32>)>,
    /// Centre of its nodes.
    pub centre: Point3<f64>,
    /// Distance of its furthest node from the centre.
    pub size: f64,
}

impl RigidBodies {
    /// Finds the parts of a mesh.
    pub fn new(mesh: &TetMesh, bodies: &Bodies) -> Self {
        let parts_of_node = rigid_parts(mesh, bodies);
        let mut nodes_of_body = vec![Vec::new(); bodies.count()];
        for (node, body) in bodies.of_node.iter().enumerate() {
            if let Some(body) = body {
                nodes_of_body[*body as usize].push(node as u32);
            }
        }
        let of_nodes = |nodes| RigidBody::new(mesh, &parts_of_node, nodes);
        let bodies = nodes_of_body.into_iter().map(of_nodes).collect();
        // Orphans have none and are never asked for.
        let first = |parts: &Vec<u32>| parts.first().copied().unwrap_or(0);
        Self { part_of_node: parts_of_node.iter().map(first).collect(), bodies }
    }
}

impl RigidBody {
    fn new(mesh: &TetMesh, parts_of_node: &[Vec<u32>], nodes: Vec<u32>) -> Self {
        let parts_at = |node: u32| &parts_of_node[node as usize];
        let mut parts: Vec<u32> = nodes.iter().flat_map(|&n| parts_at(n)).copied().collect();
        parts.sort_unstable();
        parts.dedup();
        let at = |node: &u32| mesh.vertices()[*node as usize];
        let sum: Vector3<f64> = nodes.iter().map(|n| at(n).coords).sum();
        let centre = Point3::from(sum / nodes.len() as f64);
        let arms = nodes.iter().map(|n| (at(n) - centre).norm());
        let size = arms.fold(f64::MIN_POSITIVE, f64::max);
        let meets = |&&node: &&u32| parts_at(node).len() > 1;
        let joints = nodes.iter().filter(meets).map(|&n| (n, parts_at(n).clone())).collect();
        Self { nodes, parts, joints, centre, size }
    }
}

/// For every node the rigid parts that meet there, ascending: face-connected pieces, joined further
/// where two share three nodes that are not in line.
fn rigid_parts(mesh: &TetMesh, bodies: &Bodies) -> Vec<Vec<u32>> {
    let mut of_node: Vec<Vec<u32>> = vec![Vec::new(); mesh.node_count()];
    let mid_edge = mesh.mid_edge_nodes().iter().map(<[u32; 6]>::as_slice);
    let nodes = mesh.tets().iter().map(<[u32; 4]>::as_slice).zip(&bodies.piece_of_tet);
    for (nodes, &piece) in nodes.chain(mid_edge.zip(&bodies.piece_of_tet)) {
        for &n in nodes {
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
        let Some(((kept, gone), _)) = joined else { return of_node };
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
pub(super) struct BodyMotions<'a> {
    mesh: &'a TetMesh,
    part_of_node: &'a [u32],
    pub body: &'a RigidBody,
    /// Orthonormal basis: (t, ω) per part, ω per size of the body.
    pub basis: Vec<DVector<f64>>,
}

impl<'a> BodyMotions<'a> {
    /// Motions of a body when `held` degrees of freedom of it and the means of `masks` on it are in
    /// place; `None` if it has too many hinged parts to tell.
    pub fn of_body(
        mesh: &'a TetMesh,
        rigid: &'a RigidBodies,
        body: usize,
        held: &[u32],
        masks: &[&Mask],
    ) -> Option<Self> {
        let body = rigid.bodies.get(body)?;
        if body.parts.len() > PARTS_MAX {
            return None;
        }
        let part_of_node = rigid.part_of_node.as_slice();
        let mut motions = Self { mesh, part_of_node, body, basis: Vec::new() };
        let mut rows = Rows::new(6 * body.parts.len());
        for &dof in held {
            let (node, axis) = (dof / 3, dof as usize % 3);
            rows.push(motions.row(node, axis, &[(motions.part_of(node), 1.0)]));
        }
        for mask in masks {
            for axis in 0..3 {
                let mut mean = DVector::zeros(6 * body.parts.len());
                for &(node, weight) in mask.entries() {
                    mean += motions.row(node, axis, &[(motions.part_of(node), weight)]);
                }
                rows.push(mean);
            }
        }
        for (node, parts) in &body.joints {
            if let Some((&first, others)) = parts.split_first() {
                for &other in others {
                    let joint = [(first, 1.0), (other, -1.0)];
                    (0..3).for_each(|axis| rows.push(motions.row(*node, axis, &joint)));
                }
            }
        }
        motions.basis = rows.null_space();
        Some(motions)
    }

    fn part_of(&self, node: u32) -> u32 {
        self.part_of_node[node as usize]
    }

    /// Displacement of a node along an axis, as a row on the motions of some parts.
    fn row(&self, node: u32, axis: usize, parts: &[(u32, f64)]) -> DVector<f64> {
        let names = &self.body.parts;
        let mut row = DVector::zeros(6 * names.len());
        let r = (self.mesh.vertices()[node as usize] - self.body.centre) / self.body.size;
        for &(part, sign) in parts {
            let c = 6 * names.partition_point(|&p| p < part);
            row[c + axis] += sign;
            // (ω × r)_axis = ω_{axis+1} r_{axis+2} − ω_{axis+2} r_{axis+1}.
            let (next, after) = ((axis + 1) % 3, (axis + 2) % 3);
            row[c + 3 + next] += sign * r[after];
            row[c + 3 + after] -= sign * r[next];
        }
        row
    }

    /// Adds one motion of the basis to a displacement field.
    pub fn add_field(&self, motion: &DVector<f64>, field: &mut [f64]) {
        for &node in &self.body.nodes {
            for axis in 0..3 {
                let row = self.row(node, axis, &[(self.part_of(node), 1.0)]);
                field[3 * node as usize + axis] += row.dot(motion);
            }
        }
    }
}

/// The given degrees of freedom of every body, in the order given.
pub(super) fn dofs_by_body(bodies: &Bodies, dofs: &[u32]) -> Vec<Vec<u32>> {
    let mut by_body = vec![Vec::new(); bodies.count()];
    for &dof in dofs {
        if let Some(Some(body)) = bodies.of_node.get(dof as usize / 3) {
            by_body[*body as usize].push(dof);
        }
    }
    by_body
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

/// Fields of all motions without energy that leave the fixed degrees of freedom in place.
pub(super) fn motions(
    mesh: &TetMesh,
    bodies: &Bodies,
    rigid: &RigidBodies,
    fixed: &[u32],
) -> Result<Vec<Vec<f64>>, usize> {
    let mut fields = Vec::new();
    for (body, held) in dofs_by_body(bodies, fixed).into_iter().enumerate() {
        let motions = BodyMotions::of_body(mesh, rigid, body, &held, &[]).ok_or(body)?;
        for motion in &motions.basis {
            let mut field = vec![0.0; 3 * mesh.node_count()];
            motions.add_field(motion, &mut field);
            for &dof in fixed {
                field[dof as usize] = 0.0;
            }
            fields.push(field);
        }
    }
    Ok(fields)
}

/// As many degrees of freedom as there are motions, so that none is left: the one that moves most,
/// then the one that moves most in what is left, and so on (pivoted orthogonalisation of rows).
pub(super) fn hold(fields: &[Vec<f64>], fixed: &[u32]) -> Vec<u32> {
    let z = fields.len();
    let Some(dofs) = fields.first().map(Vec::len) else { return Vec::new() };
    let mut rows: Vec<f64> = (0..dofs).flat_map(|d| fields.iter().map(move |f| f[d])).collect();
    for &dof in fixed {
        rows[dof as usize * z..(dof as usize + 1) * z].fill(0.0);
    }
    let mut held = Vec::with_capacity(z);
    for _ in 0..z {
        let size = |d: usize| rows[d * z..(d + 1) * z].iter().map(|x| x * x).sum::<f64>();
        // The first of equals, so that the choice does not depend on rounding of equal sums.
        let most = (0..dofs).map(size).fold(0.0, f64::max);
        let Some(dof) = (0..dofs).find(|&d| size(d) >= most * (1.0 - 1e-9)) else { break };
        let direction: Vec<f64> =
            rows[dof * z..(dof + 1) * z].iter().map(|x| x / most.sqrt()).collect();
        for row in rows.chunks_exact_mut(z) {
            let along: f64 = row.iter().zip(&direction).map(|(r, d)| r * d).sum();
            row.iter_mut().zip(&direction).for_each(|(r, d)| *r -= along * d);
        }
        held.push(dof as u32);
    }
    held.sort_unstable();
    held
}

/// Degrees of freedom to hold besides the known ones; none where a body has too many hinged parts to
/// say.
///
/// Shapes: `known` ascending; result ascending.
pub(super) fn held_for_definiteness(
    mesh: &TetMesh,
    bodies: &Bodies,
    rigid: &RigidBodies,
    known: &[u32],
) -> Vec<u32> {
    motions(mesh, bodies, rigid, known).map_or_else(|_| Vec::new(), |fields| hold(&fields, known))
}
