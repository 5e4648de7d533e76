//! Displacements of a few nodes of a free body under forces at a few nodes: what contact asks for.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::base::{Base, Block, SurfaceNodes};
use super::columns::{Columns, ContactColumns};
use super::error::CondensedError;
use super::free_body::{FreeBody, Relief};
use super::free_tangent::FreeTangent;
use super::touched::Contact;

/// A force at a node, N, in the object's frame.
pub type NodeForce = (u32, Vector3<f64>);

/// The elastic part of a free body: factor, rigid motions, and the cache of columns.
#[derive(Clone, Copy)]
pub struct Elasticity<'a> {
    /// The held base and its factor.
    pub base: &'a Base,
    /// What nothing holds.
    pub body: &'a FreeBody,
    /// Columns of the compliance.
    pub columns: &'a Columns,
}

/// The elastic part about a deformed shape: to first order its shape is `offset + C f`.
#[derive(Clone, Copy)]
pub struct ShapeResponse<'a> {
    /// The base, whose order the tangent is factored in.
    pub base: &'a Base,
    /// What nothing holds.
    pub body: &'a FreeBody,
    /// Compliance C of the deformed shape.
    pub tangent: &'a FreeTangent,
    /// The displacement that is left where no forces act, to first order; 3N, m.
    pub offset: &'a [f64],
}

/// Stiffness that columns and displacements follow from.
#[derive(Clone, Copy)]
enum Source<'a> {
    Linear(Elasticity<'a>),
    Shape(ShapeResponse<'a>),
}

impl<'a> Source<'a> {
    fn base(&self) -> &'a Base {
        match self {
            Source::Linear(elasticity) => elasticity.base,
            Source::Shape(shape) => shape.base,
        }
    }
}

/// The response of some nodes (rows) to forces at nodes that are added as they are needed.
///
/// Shapes: one 3 × 3 block for each row and each node with a force.
pub struct Response<'a> {
    source: Source<'a>,
    rows: Vec<u32>,
    /// The row of each node of the surface; `NO_ROW` for none.
    row_at: Vec<u32>,
    /// Columns of the held compliance, by node of the force.
    columns: BTreeMap<u32, Arc<ContactColumns>>,
}

/// Nodes whose displacement one task sums.
const TASK_NODES: usize = 128;
/// Says that a node is none of the rows.
const NO_ROW: u32 = u32::MAX;

impl<'a> Response<'a> {
    /// Shapes: `rows` ascending nodes.
    pub fn new(elasticity: Elasticity<'a>, rows: Vec<u32>) -> Self {
        Self::from(Source::Linear(elasticity), rows)
    }

    /// The response of a shape that is deformed already, to first order about it.
    ///
    /// Shapes: `rows` ascending nodes.
    pub fn about(shape: ShapeResponse<'a>, rows: Vec<u32>) -> Self {
        Self::from(Source::Shape(shape), rows)
    }

    fn from(source: Source<'a>, rows: Vec<u32>) -> Self {
        let surface = &source.base().surface;
        let mut row_at = vec![NO_ROW; surface.len()];
        for (row, &node) in (0..).zip(&rows) {
            if let Some(place) = surface.place_of(node) {
                row_at[place] = row;
            }
        }
        Self { source, rows, row_at, columns: BTreeMap::new() }
    }

    /// The response of other nodes, with the columns that are there.
    ///
    /// Shapes: `rows` ascending nodes.
    pub fn of_rows(&self, rows: Vec<u32>) -> Self {
        Self { columns: self.columns.clone(), ..Self::from(self.source, rows) }
    }

    /// The nodes whose displacement can be asked for, ascending.
    pub fn rows(&self) -> &[u32] {
        &self.rows
    }

    /// Position of a node among the rows.
    pub fn row_of(&self, node: u32) -> Option<usize> {
        match self.source.base().surface.place_of(node) {
            Some(place) => (self.row_at[place] != NO_ROW).then_some(self.row_at[place] as usize),
            None => self.rows.binary_search(&node).ok(),
        }
    }

    /// Gets the columns of nodes at which forces act, from the cache or by solves.
    ///
    /// # Errors
    /// [`CondensedError::CacheTooSmall`].
    pub fn need(&mut self, nodes: impl IntoIterator<Item = u32>) -> Result<(), CondensedError> {
        let mut missing: Vec<u32> =
            nodes.into_iter().filter(|node| !self.columns.contains_key(node)).collect();
        missing.sort_unstable();
        missing.dedup();
        if missing.is_empty() {
            return Ok(());
        }
        let found = match self.source {
            Source::Linear(Elasticity { base, columns, .. }) => {
                let contacts: Vec<Contact> =
                    missing.iter().map(|&node| Contact::Node(node)).collect();
                columns.of_contacts(base, &contacts)?
            }
            Source::Shape(ShapeResponse { base, body, tangent, .. }) => {
                tangent.columns(base, body, &missing)?
            }
        };
        self.columns.extend(missing.into_iter().zip(found));
        Ok(())
    }

    /// Held compliance of all nodes under forces at one.
    ///
    /// # Panics
    /// If the node was not named to [`Response::need`].
    pub fn held(&self, node: u32) -> HeldCompliance<'_> {
        HeldCompliance::new(&self.source.base().surface, &self.columns[&node])
    }

    /// What inertia takes from the compliance between points whose columns are asked for; nothing where
    /// the columns are those of the free body.
    pub fn relief_of(&self, nodes: &[u32; 3], weights: &[f64; 3]) -> Relief {
        match self.source {
            Source::Linear(elasticity) => elasticity.body.relief_of(nodes, weights),
            Source::Shape(_) => Relief::none(),
        }
    }

    /// Takes from the displacement that the columns give to some nodes what inertia relieves.
    fn relieve(&self, forces: &[NodeForce], nodes: &[u32], displacement: &mut [[f64; 3]]) {
        // Columns about a shape are those of the free body.
        if let Source::Linear(elasticity) = self.source {
            elasticity.body.relieve(forces, nodes, displacement);
        }
    }

    /// Adds the displacement that is left without forces.
    fn add_offset(&self, nodes: &[u32], displacement: &mut [[f64; 3]]) {
        let Source::Shape(shape) = self.source else { return };
        for (u, &node) in displacement.iter_mut().zip(nodes) {
            let offset = &shape.offset[3 * node as usize..3 * node as usize + 3];
            u.iter_mut().zip(offset).for_each(|(u, offset)| *u += offset);
        }
    }

    /// Displacement of the rows under forces at needed nodes, in balance with inertia.
    ///
    /// Units: N, m. Frame: the object's.
    pub fn displacement(&self, forces: &[NodeForce]) -> Vec<Vector3<f64>> {
        let mut u = self.moved_rows(forces);
        self.add_offset(&self.rows, &mut u);
        u.into_iter().map(Vector3::from).collect()
    }

    /// The part of [`Response::displacement`] that is in proportion to the forces.
    ///
    /// Units: N, m. Frame: the object's.
    pub fn moved(&self, forces: &[NodeForce]) -> Vec<Vector3<f64>> {
        self.moved_rows(forces).into_iter().map(Vector3::from).collect()
    }

    fn moved_rows(&self, forces: &[NodeForce]) -> Vec<[f64; 3]> {
        let mut u = self.summed(&self.rows, forces);
        self.relieve(forces, &self.rows, &mut u);
        u
    }

    /// Sum of the columns of forces at some nodes, on the current rayon pool: every node is summed by one task,
    /// in the order of the forces.
    fn summed(&self, nodes: &[u32], forces: &[NodeForce]) -> Vec<[f64; 3]> {
        let surface = &self.source.base().surface;
        let places: Vec<Option<usize>> = nodes.iter().map(|&node| surface.place_of(node)).collect();
        let columns: Vec<(HeldCompliance<'_>, &Vector3<f64>)> =
            forces.iter().map(|(node, force)| (self.held(*node), force)).collect();
        let mut u = vec![[0.0; 3]; nodes.len()];
        let tasks = u
            .par_chunks_mut(TASK_NODES)
            .zip(nodes.par_chunks(TASK_NODES).zip(places.par_chunks(TASK_NODES)));
        tasks.for_each(|(u, at)| columns.iter().for_each(|(held, force)| held.add(force, at, u)));
        u
    }

    /// Displacement of any nodes under forces at needed nodes, on the current rayon pool.
    ///
    /// Units: N, m. Frame: the object's.
    pub fn displacement_of(&self, nodes: &[u32], forces: &[NodeForce]) -> Vec<[f64; 3]> {
        let mut u = self.summed(nodes, forces);
        self.relieve(forces, nodes, &mut u);
        self.add_offset(nodes, &mut u);
        u
    }

    /// `‖K u − P f‖ / ‖f‖` at most, by the residuals of the columns as computed; of a linear body.
    pub fn residual_rel(&self, forces: &[NodeForce]) -> f64 {
        let Source::Linear(elasticity) = self.source else { return f64::NAN };
        let (mut residual, mut square) = (0.0, 0.0);
        for (node, force) in forces {
            let columns = &self.columns[node];
            residual += (0..3).map(|c| force[c].abs() * columns.residuals[c]).sum::<f64>();
            square += force.norm_squared();
        }
        residual += elasticity.body.residual(forces);
        if square > 0.0 { residual / square.sqrt() } else { 0.0 }
    }
}

/// Displacements of all nodes of the held body under a unit force along each axis at one node.
///
/// Units: m/N.
#[derive(Clone, Copy)]
pub struct HeldCompliance<'a> {
    nodes: &'a SurfaceNodes,
    surface: &'a [Block],
    fields: [&'a [f64]; 3],
}

impl<'a> HeldCompliance<'a> {
    fn new(nodes: &'a SurfaceNodes, columns: &'a ContactColumns) -> Self {
        let fields = columns.fields.each_ref().map(Vec::as_slice);
        Self { nodes, surface: columns.surface(nodes), fields }
    }

    /// Displacement of a node, rows, by axis of the force, columns.
    pub fn at(&self, node: u32) -> Matrix3<f64> {
        Matrix3::from_column_slice(&self.block(node))
    }

    /// What unit forces along x, y and z do to a node: from its block if it is one of the surface.
    fn block(&self, node: u32) -> Block {
        match self.nodes.place_of(node) {
            Some(place) => self.surface[place],
            None => {
                let at = 3 * node as usize;
                std::array::from_fn(|k| self.fields[k / 3][at + k % 3])
            }
        }
    }

    /// Adds what a force does to some nodes, whose places among those of the surface are known.
    fn add(
        &self,
        force: &Vector3<f64>,
        (nodes, places): (&[u32], &[Option<usize>]),
        displacement: &mut [[f64; 3]],
    ) {
        for ((u, &node), place) in displacement.iter_mut().zip(nodes).zip(places) {
            match place {
                Some(place) => add_moved(u, force, &self.surface[*place]),
                None => add_moved(u, force, &self.block(node)),
            }
        }
    }
}

/// Adds what a force does to a node, from what unit forces along x, y and z do to it.
#[inline]
fn add_moved(u: &mut [f64; 3], force: &Vector3<f64>, block: &Block) {
    let [xx, xy, xz, yx, yy, yz, zx, zy, zz] = block;
    u[0] += force.x * xx + force.y * yx + force.z * zx;
    u[1] += force.x * xy + force.y * yy + force.z * zy;
    u[2] += force.x * xz + force.y * yz + force.z * zz;
}
