//! `glove-client inspect F [--json]`: what is in a mesh file and whether it can be used.

use std::collections::BTreeMap;
use std::path::PathBuf;

use clap::Args;
use serde::Serialize;
use softgrasp_core::fem::StiffnessPattern;
use softgrasp_core::mesh::{Bodies, Quality, Surface};
use softgrasp_core::mesh_io::MeshFile;
use softgrasp_core::solve::Method;

use super::output::print;
use crate::mesh_file::read_mesh_file;
use crate::progress::Progress;
use crate::solve_report::SCHEMA;

/// Tell what is in a mesh file and whether it can be used.
#[derive(Args)]
pub struct InspectCommand {
    /// Mesh file; the format is recognised by its content.
    file: PathBuf,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// What `inspect` prints.
#[derive(Serialize)]
struct Inspection {
    schema: u32,
    command: &'static str,
    file: String,
    usable: bool,
    format: String,
    nodes: usize,
    tets: usize,
    tets_in_file: usize,
    higher_order_tets: usize,
    other_cells: BTreeMap<String, usize>,
    labels_mapped: bool,
    regions: usize,
    region_labels: Vec<String>,
    flipped: usize,
    degenerate_dropped: usize,
    orphans: usize,
    surface_triangles: usize,
    surface_nodes: usize,
    non_manifold_edges: usize,
    bodies_by_node: usize,
    pieces_by_face: usize,
    dihedral_min_deg: f64,
    dihedral_max_deg: f64,
    worst_radius_ratio: f64,
    worst_tets: Vec<usize>,
    volume: f64,
    bounding_box: BoundingBox,
    modelled: Modelled,
    skipped_sections: Vec<String>,
    notes: Vec<String>,
    remarks: Vec<String>,
}

#[derive(Serialize)]
struct BoundingBox {
    low: [f64; 3],
    high: [f64; 3],
}

/// What would be modelled, and the size of the work it predicts.
#[derive(Serialize)]
struct Modelled {
    element: &'static str,
    nodes: usize,
    dofs: usize,
    stiffness_bytes: u64,
    dense_inverse_bytes: u64,
    gauss_jordan_operations: f64,
    recommended_method: &'static str,
}

/// Worst elements listed.
const WORST_LISTED: usize = 5;

impl InspectCommand {
    /// Reads and tells.
    ///
    /// # Errors
    /// A file that cannot be read or used, in one line.
    pub fn run(&self) -> anyhow::Result<()> {
        let inspection = {
            let _progress = Progress::start("reading the mesh");
            inspect(self.file.display().to_string(), read_mesh_file(&self.file)?)
        };
        match self.json {
            true => print(&format!("{}\n", serde_json::to_string_pretty(&inspection)?)),
            false => print(&describe(&inspection)),
        }
    }
}

fn inspect(file: String, read: MeshFile) -> Inspection {
    let MeshFile { format, mesh, findings } = read;
    let surface = Surface::from_mesh(&mesh);
    let bodies = Bodies::from_mesh(&mesh);
    let quality = Quality::from_mesh(&mesh, WORST_LISTED);
    let (low, high) = mesh.bounds();
    let nodes = mesh.node_count() - findings.orphans;
    let dofs = 3 * nodes;
    let blocks = StiffnessPattern::new(&mesh).block_count() as u64;
    let non_manifold_edges = surface.non_manifold_edges();
    let mut inspection = Inspection {
        schema: SCHEMA,
        command: "inspect",
        file,
        usable: true,
        format: format.to_string(),
        nodes: mesh.node_count(),
        tets: mesh.tets().len(),
        tets_in_file: findings.file_tets,
        higher_order_tets: findings.higher_order,
        other_cells: findings.other_cells,
        labels_mapped: findings.labels_mapped,
        regions: mesh.regions().iter().max().map_or(1, |&r| r as usize + 1),
        region_labels: findings.region_labels,
        flipped: findings.flipped.len(),
        degenerate_dropped: findings.degenerate.len(),
        orphans: findings.orphans,
        surface_triangles: surface.triangles.len(),
        surface_nodes: surface.nodes.len(),
        non_manifold_edges,
        bodies_by_node: bodies.count(),
        pieces_by_face: bodies.piece_count(),
        dihedral_min_deg: quality.dihedral_min.to_degrees(),
        dihedral_max_deg: quality.dihedral_max.to_degrees(),
        worst_radius_ratio: quality.radius_ratio_min,
        worst_tets: quality.worst,
        volume: quality.volume,
        bounding_box: BoundingBox { low: low.into(), high: high.into() },
        modelled: Modelled {
            element: "t4",
            nodes,
            dofs,
            stiffness_bytes: blocks * 76,
            dense_inverse_bytes: Method::DenseInverse.dense_bytes(dofs).unwrap_or(0),
            // Thesis (C.5) with one processor.
            gauss_jordan_operations: 2.0 * (dofs as f64).powi(2) * (3.0 * dofs as f64 - 1.0),
            recommended_method: Method::Front.name(),
        },
        skipped_sections: findings.skipped_sections,
        notes: findings.notes,
        remarks: Vec::new(),
    };
    inspection.remarks = remarks(&inspection);
    inspection
}

/// Sentences a user should read before trusting an answer.
fn remarks(i: &Inspection) -> Vec<String> {
    let mut remarks = Vec::new();
    let mut say = |when: bool, text: String| {
        if when {
            remarks.push(text);
        }
    };
    say(
        i.bodies_by_node > 1,
        format!("{} separate bodies: each needs known displacements of its own", i.bodies_by_node),
    );
    say(
        i.pieces_by_face > i.bodies_by_node,
        format!(
            "{} pieces hang together by single edges or nodes: these are hinges, and a piece that \
             is not held can turn about them",
            i.pieces_by_face
        ),
    );
    say(
        i.dihedral_min_deg < 5.0,
        format!(
            "slivers down to {:.2} degrees: answers stay exact, but stresses there mean little",
            i.dihedral_min_deg
        ),
    );
    say(
        i.non_manifold_edges > 0,
        format!("{} surface edges meet more than two triangles", i.non_manifold_edges),
    );
    say(i.flipped > 0, format!("{} inverted tetrahedra will be turned", i.flipped));
    say(
        i.degenerate_dropped > 0,
        format!("{} tetrahedra without volume will be left out", i.degenerate_dropped),
    );
    say(i.orphans > 0, format!("{} nodes belong to no tetrahedron and will not move", i.orphans));
    remarks
}

fn describe(i: &Inspection) -> String {
    let others: Vec<String> =
        i.other_cells.iter().map(|(kind, count)| format!("{count} {kind}")).collect();
    let b = &i.bounding_box;
    let mut text = format!(
        "{}\n  format        {}\n  nodes         {} ({} on the surface, {} in no tetrahedron)\n  \
         tetrahedra    {} ({} inverted ones turned, {} without volume dropped, {} of higher order)\n  \
         other cells   {}\n  regions       {}\n  surface       {} triangles\n  bodies        {} by \
         node, {} by face\n  dihedral      {:.2} to {:.2} degrees, worst radius ratio {:.4}\n  \
         box           ({:.6}, {:.6}, {:.6}) to ({:.6}, {:.6}, {:.6})\n  modelled      {} nodes, {} \
         degrees of freedom, linear tetrahedra\n  work          stiffness {}, dense inverse {}, \
         Gauss-Jordan {:.1e} operations; use {}\n",
        i.file,
        i.format,
        i.nodes,
        i.surface_nodes,
        i.orphans,
        i.tets,
        i.flipped,
        i.degenerate_dropped,
        i.higher_order_tets,
        if others.is_empty() { "none".to_owned() } else { others.join(", ") },
        i.regions,
        i.surface_triangles,
        i.bodies_by_node,
        i.pieces_by_face,
        i.dihedral_min_deg,
        i.dihedral_max_deg,
        i.worst_radius_ratio,
        b.low[0],
        b.low[1],
        b.low[2],
        b.high[0],
        b.high[1],
        b.high[2],
        i.modelled.nodes,
        i.modelled.dofs,
        mebibytes(i.modelled.stiffness_bytes),
        mebibytes(i.modelled.dense_inverse_bytes),
        i.modelled.gauss_jordan_operations,
        i.modelled.recommended_method,
    );
    if !i.skipped_sections.is_empty() {
        text.push_str(&format!("  not looked at {}\n", i.skipped_sections.join(", ")));
    }
    for note in i.notes.iter().chain(&i.remarks) {
        text.push_str(&format!("  note          {note}\n"));
    }
    text.push_str("  can be used   yes\n");
    text
}

fn mebibytes(bytes: u64) -> String {
    format!("{:.1} MiB", bytes as f64 / (1024.0 * 1024.0))
}
