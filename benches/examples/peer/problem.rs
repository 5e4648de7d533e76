//! One problem: a mesh held at five nodes, its `K11`, right-hand sides and the right answers.

use std::path::{Path, PathBuf};

use rayon::prelude::*;
use softgrasp_bench::reference::Reference;
use softgrasp_bench::scene::presses;
use softgrasp_core::fem::{Material, Stiffness};
use softgrasp_core::mesh::{BuiltIn, Surface, TetMesh, generate};
use softgrasp_core::model::{Element, Known, Model};
use softgrasp_core::solve::{Loads, Method, Partition};

use crate::answers::{write_f64, write_u32};

/// Right-hand sides of the wide solve.
pub const COLUMNS: usize = 21;
pub const YOUNG: f64 = 1.0e5;
pub const POISSON: f64 = 0.3;

/// What all sides solve.
///
/// Shapes: `q_known` and `reference` one per column, `b` n × [`COLUMNS`] by columns. Units: m, Pa.
pub struct Problem {
    folder: PathBuf,
    pub model: Model,
    pub surface: Surface,
    pub known: Known,
    pub partition: Partition,
    pub q_known: Vec<Vec<f64>>,
    pub b: Vec<f64>,
    /// Right answer of the scene's own load, all degrees of freedom.
    pub reference: Vec<Reference>,
}

impl Problem {
    /// The lattice cube of about so many nodes.
    pub fn cube(nodes: usize, folder: &Path) -> anyhow::Result<Self> {
        Self::of_mesh(generate(BuiltIn::Cube, nodes)?, folder)
    }

    /// A mesh file of any known format; its regions count as one material.
    pub fn of_file(mesh: &Path, folder: &Path) -> anyhow::Result<Self> {
        let mesh = glove_client::object::mesh_file::read_mesh_file(mesh)?.mesh;
        let one_region = TetMesh::try_new(mesh.vertices().to_vec(), mesh.tets().to_vec(), vec![])?;
        Self::of_mesh(one_region, folder)
    }

    fn of_mesh(mesh: TetMesh, folder: &Path) -> anyhow::Result<Self> {
        let surface = Surface::from_mesh(&mesh);
        let pairs = presses(&mesh, &surface);
        let push = 0.01 * mesh.size();
        let material = Material::try_new(YOUNG, POISSON)?;
        let model = Model::try_new(mesh, Element::Tet4, &[material], Vec::new(), &mut |_| {})?;
        let known = model.known(pairs)?;
        let partition = model.held_partition(&known.dofs)?;
        let count = known.dofs.len();
        let other = |column: usize| -> Vec<f64> {
            (0..count).map(|i| push * (0.37 * (count * column + i) as f64).sin()).collect()
        };
        let mut q_known = vec![known.q_known.clone()];
        q_known.extend((1..COLUMNS).map(other));
        let b = q_known.iter().flat_map(|q| right_hand_side(model.stiffness(), &partition, q));
        let b = b.collect();
        let factored = model.factor(&known.dofs, Method::SparseCholesky, &mut |_| {})?;
        let refined = q_known.par_iter().map(|q_known| {
            let loads = Loads { q_known, ..Loads::default() };
            Reference::refined(model.stiffness(), &factored, loads)
        });
        let reference = refined.collect::<Result<_, _>>()?;
        let folder = folder.to_owned();
        Ok(Self { folder, surface, known, partition, q_known, b, reference, model })
    }

    /// Writes `K11` (upper triangle by rows), right-hand sides, right answers, mesh and the answer
    /// to one newton of weight; what a reader of the files has to know besides.
    pub fn write(&self) -> anyhow::Result<serde_json::Value> {
        let folder = &self.folder;
        std::fs::create_dir_all(folder)?;
        let (starts, columns, values) = upper_triangle(self.model.stiffness(), &self.partition);
        write_u32(folder, "row_start.u32", &starts)?;
        write_u32(folder, "column.u32", &columns)?;
        write_f64(folder, "value.f64", &values)?;
        write_f64(folder, "b.f64", &self.b)?;
        let right: Vec<f64> =
            self.reference.iter().flat_map(|r| self.unknown_of(&r.displacement)).collect();
        write_f64(folder, "right.f64", &right)?;
        let mesh = self.model.mesh();
        let vertices: Vec<f64> = mesh.vertices().iter().flat_map(|p| [p.x, p.y, p.z]).collect();
        write_f64(folder, "vertex.f64", &vertices)?;
        write_u32(folder, "tet.u32", mesh.tets().as_flattened())?;
        let held: Vec<u32> = self.known.dofs.iter().step_by(3).map(|d| d / 3).collect();
        write_u32(folder, "held.u32", &held)?;
        write_f64(folder, "sag.f64", &self.sag()?.displacement)?;
        let (low, high) = mesh.bounds();
        let edge = (high - low).max();
        let settled = self.reference.iter().map(|r| r.last_correction_rel);
        Ok(serde_json::json!({
            "nodes": mesh.node_count(),
            "unknown_dofs": self.partition.unknown().len(),
            "entries": values.len(),
            "edge_m": edge,
            "young_pa": YOUNG,
            "poisson": POISSON,
            "reference_settled_rel": settled.fold(0.0, f64::max),
        }))
    }

    /// Writes what one side answered: the single column, then all of them.
    pub fn write_answers(&self, answers: &[f64]) -> std::io::Result<()> {
        write_f64(&self.folder, "answer.f64", answers)
    }

    /// Entries of the unknown degrees of freedom.
    pub fn unknown_of(&self, displacement: &[f64]) -> Vec<f64> {
        self.partition.unknown().iter().map(|&dof| displacement[dof as usize]).collect()
    }

    /// Displacements under a weight of one newton, the same on every node, down the y axis, with
    /// the five nodes held still.
    fn sag(&self) -> anyhow::Result<Reference> {
        let mut forces = vec![0.0; self.partition.dof_count()];
        let weight = 1.0 / self.model.mesh().node_count() as f64;
        for &dof in self.partition.unknown().iter().filter(|d| **d % 3 == 1) {
            forces[dof as usize] = -weight;
        }
        let q_known = vec![0.0; self.known.dofs.len()];
        let loads = Loads { q_known: &q_known, forces: &forces, ..Loads::default() };
        let factored = self.model.factor(&self.known.dofs, Method::Front, &mut |_| {})?;
        Ok(Reference::refined(self.model.stiffness(), &factored, loads)?)
    }
}

/// `−K12 Q_k`.
fn right_hand_side(stiffness: &Stiffness, partition: &Partition, q_known: &[f64]) -> Vec<f64> {
    let mut q = vec![0.0; partition.dof_count()];
    for (&dof, &u) in partition.known().iter().zip(q_known) {
        q[dof as usize] = u;
    }
    let f = stiffness.mul(&q);
    partition.unknown().iter().map(|&dof| -f[dof as usize]).collect()
}

/// Row starts, columns and values of the upper triangle of `K11`.
fn upper_triangle(stiffness: &Stiffness, partition: &Partition) -> (Vec<u32>, Vec<u32>, Vec<f64>) {
    let (mut starts, mut columns, mut values) = (vec![0], Vec::new(), Vec::new());
    for (row, &dof) in partition.unknown().iter().enumerate() {
        let (node, axis) = (dof as usize / 3, dof as usize % 3);
        for (column_node, block) in stiffness.row(node) {
            for c in 0..3 {
                if let Some(column) = partition.row_of(3 * column_node + c).filter(|&c| c >= row) {
                    columns.push(column as u32);
                    values.push(block[3 * axis + c]);
                }
            }
        }
        starts.push(columns.len() as u32);
    }
    (starts, columns, values)
}
