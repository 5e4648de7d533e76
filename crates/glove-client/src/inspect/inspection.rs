//! The report of `inspect` on a mesh file: its content, its faults, and the cost of an answer.

use std::collections::BTreeMap;
use std::fmt;

use serde::Serialize;
use softgrasp_core::fem::StiffnessPattern;
use softgrasp_core::mesh::{Bodies, Folds, Quality, Surface};
use softgrasp_core::mesh_io::MeshFile;
use softgrasp_core::solve::Method;
use softgrasp_core::solve::memory::{BYTES_PER_BLOCK, Bytes, Problem};
use softgrasp_core::solve::work::MeshSize;
use softgrasp_protocol::solve_report::SCHEMA;

use crate::ask::connection::OwnMachine;
use crate::inspect::forecast::Forecast;
use crate::inspect::mending_summary::MendingSummary;

/// Report that `inspect` prints.
#[derive(Debug, Serialize)]
pub struct Inspection {
    schema: u32,
    command: &'static str,
    file: String,
    /// Whether the mesh can be used within the memory limit.
    pub usable: bool,
    /// Reason for which the mesh cannot be used.
    pub refused_because: Option<String>,
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
    repeated_dropped: usize,
    orphans: usize,
    /// Bad elements and what mending them changes; null if there are none.
    mending: Option<MendingSummary>,
    /// Warning of elements that overlap, so that no answer is right; null if there are none.
    folded: Option<String>,
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
    forecast: Forecast,
    skipped_sections: Vec<String>,
    notes: Vec<String>,
    remarks: Vec<String>,
}

#[derive(Debug, Serialize)]
struct BoundingBox {
    low: [f64; 3],
    high: [f64; 3],
}

/// Size of the system that would be solved, and its predicted costs.
#[derive(Debug, Serialize)]
struct Modelled {
    element: &'static str,
    nodes: usize,
    dofs: usize,
    stiffness_bytes: u64,
    dense_inverse_bytes: u64,
    gauss_jordan_operations: f64,
    /// Recommended method; null if none fits in memory.
    recommended_method: Option<&'static str>,
}

/// Number of worst elements that are listed.
const WORST_LISTED: usize = 5;

impl Inspection {
    /// Inspects a mesh that was read.
    ///
    /// Units: `memory_limit_bytes` bytes; `None` takes a server's default.
    pub fn new(
        file: String,
        read: &MeshFile,
        memory_limit_bytes: Option<u64>,
        machine: &OwnMachine,
    ) -> Self {
        let MeshFile { format, mesh, findings } = read;
        let surface = Surface::from_mesh(mesh);
        let bodies = Bodies::from_mesh(mesh);
        let quality = Quality::from_mesh(mesh, WORST_LISTED);
        let (low, high) = mesh.bounds();
        let nodes = mesh.node_count() - findings.orphans;
        let size = MeshSize { nodes, tets: mesh.tets().len() };
        let problem = Problem { size, known_dofs: 0 };
        let forecast = Forecast::new(problem, memory_limit_bytes, machine);
        let refused_because = forecast.refusal();
        let modelled = modelled(nodes, StiffnessPattern::new(mesh).block_count(), &forecast);
        let mut inspection = Self {
            schema: SCHEMA,
            command: "inspect",
            file,
            usable: refused_because.is_none(),
            refused_because,
            format: format.to_string(),
            nodes: mesh.node_count(),
            tets: mesh.tets().len(),
            tets_in_file: findings.file_tets,
            higher_order_tets: findings.higher_order,
            other_cells: findings.other_cells.clone(),
            labels_mapped: findings.labels_mapped,
            regions: mesh.regions().iter().max().map_or(1, |&r| r as usize + 1),
            region_labels: findings.region_labels.clone(),
            flipped: findings.flipped.len(),
            degenerate_dropped: findings.degenerate.len(),
            repeated_dropped: findings.repeated.len(),
            orphans: findings.orphans,
            mending: findings.mending.as_ref().map(MendingSummary::new),
            folded: Folds::from_mesh(mesh).map(|folds| folds.to_string()),
            surface_triangles: surface.triangles.len(),
            surface_nodes: surface.nodes.len(),
            non_manifold_edges: surface.non_manifold_edges(),
            bodies_by_node: bodies.count(),
            pieces_by_face: bodies.piece_count(),
            dihedral_min_deg: quality.dihedral_min.to_degrees(),
            dihedral_max_deg: quality.dihedral_max.to_degrees(),
            worst_radius_ratio: quality.radius_ratio_min,
            worst_tets: quality.worst,
            volume: quality.volume,
            bounding_box: BoundingBox { low: low.into(), high: high.into() },
            modelled,
            forecast,
            skipped_sections: findings.skipped_sections.clone(),
            notes: findings.notes.clone(),
            remarks: Vec::new(),
        };
        inspection.remarks = inspection.remarks();
        inspection
    }

    /// Remarks that a user should read before trusting an answer.
    fn remarks(&self) -> Vec<String> {
        let mut remarks = Vec::new();
        let mut say = |when: bool, text: String| {
            if when {
                remarks.push(text);
            }
        };
        say(
            self.bodies_by_node > 1,
            format!(
                "{} separate bodies: each needs prescribed displacements of its own",
                self.bodies_by_node
            ),
        );
        say(
            self.pieces_by_face > self.bodies_by_node,
            format!(
                "{} pieces hang together by single edges or nodes: these are hinges, and a piece \
                 that is not held can turn about them",
                self.pieces_by_face
            ),
        );
        say(
            self.dihedral_min_deg < 5.0,
            format!(
                "slivers down to {:.2} degrees: answers stay exact, but stresses there mean little",
                self.dihedral_min_deg
            ),
        );
        let edges = self.non_manifold_edges;
        say(edges > 0, format!("{edges} surface edges meet more than two triangles"));
        say(
            self.orphans > 0,
            format!("{} nodes belong to no tetrahedron and will not move", self.orphans),
        );
        remarks
    }
}

fn modelled(nodes: usize, blocks: usize, forecast: &Forecast) -> Modelled {
    let dofs = 3 * nodes;
    Modelled {
        element: "t4",
        nodes,
        dofs,
        stiffness_bytes: (blocks * BYTES_PER_BLOCK) as u64,
        dense_inverse_bytes: Method::DenseInverse.dense_bytes(dofs).unwrap_or(0),
        // Thesis (C.5) with one processor.
        gauss_jordan_operations: 2.0 * (dofs as f64).powi(2) * (3.0 * dofs as f64 - 1.0),
        recommended_method: forecast.recommended().map(|way| way.method),
    }
}

impl fmt::Display for Inspection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let others: Vec<String> =
            self.other_cells.iter().map(|(kind, count)| format!("{count} {kind}")).collect();
        let others = if others.is_empty() { "none".to_owned() } else { others.join(", ") };
        let BoundingBox { low: [x, y, z], high: [right, back, top] } = self.bounding_box;
        writeln!(
            f,
            "{}\n  format        {}\n  nodes         {} ({} on the surface, {} in no tetrahedron)",
            self.file, self.format, self.nodes, self.surface_nodes, self.orphans
        )?;
        writeln!(
            f,
            "  tetrahedra    {} ({} inverted ones turned, {} without volume dropped, {} repeated \
             dropped, {} of higher order)",
            self.tets,
            self.flipped,
            self.degenerate_dropped,
            self.repeated_dropped,
            self.higher_order_tets
        )?;
        if let Some(folded) = &self.folded {
            writeln!(f, "  WARNING       {folded}")?;
        }
        if let Some(mending) = &self.mending {
            write!(f, "{mending}")?;
        }
        writeln!(
            f,
            "  other cells   {others}\n  regions       {}\n  surface       {} triangles\n  bodies        \
             {} by node, {} by face\n  dihedral      {:.2} to {:.2} degrees, worst radius ratio \
             {:.4}\n  box           ({x:.6}, {y:.6}, {z:.6}) to ({right:.6}, {back:.6}, {top:.6})",
            self.regions,
            self.surface_triangles,
            self.bodies_by_node,
            self.pieces_by_face,
            self.dihedral_min_deg,
            self.dihedral_max_deg,
            self.worst_radius_ratio,
        )?;
        let modelled = &self.modelled;
        writeln!(
            f,
            "  modelled      {} nodes, {} degrees of freedom, linear tetrahedra\n  work          \
             stiffness {}, dense inverse {}, Gauss-Jordan {:.1e} operations; {}",
            modelled.nodes,
            modelled.dofs,
            Bytes(modelled.stiffness_bytes),
            Bytes(modelled.dense_inverse_bytes),
            modelled.gauss_jordan_operations,
            match modelled.recommended_method {
                Some(method) => format!("use {method}"),
                None => "nothing fits".to_owned(),
            },
        )?;
        write!(f, "{}", self.forecast)?;
        if !self.skipped_sections.is_empty() {
            writeln!(f, "  not looked at {}", self.skipped_sections.join(", "))?;
        }
        for note in self.notes.iter().chain(&self.remarks) {
            writeln!(f, "  note          {note}")?;
        }
        match &self.refused_because {
            None => writeln!(f, "  can be used   yes"),
            Some(reason) => writeln!(f, "  can be used   no: {reason}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use softgrasp_core::mesh_io::parse;

    use super::*;

    /// Two tetrahedra, the second inverted, then one without volume and one that repeats the first.
    const LISTS: &str = "softgrasp-lists 1\nvertices 6\n0 0 0\n0 1 0\n1 0 0\n0 0 1\n1 1 0\n2 2 0\n\
                         elements 4\n0 1 2 3\n2 1 4 3\n0 1 4 5\n1 2 0 3\n";

    fn inspect(limit: Option<u64>) -> Inspection {
        inspect_lists(LISTS, limit)
    }

    fn inspect_lists(lists: &str, limit: Option<u64>) -> Inspection {
        let read = parse("f.txt", lists.as_bytes(), &mut |_| None).unwrap();
        let machine = OwnMachine {
            rates: None,
            threads: 1,
            available_bytes: None,
            usual_limit_bytes: 8 << 30,
        };
        Inspection::new("f.txt".to_owned(), &read, limit, &machine)
    }

    #[test]
    fn bad_elements_are_listed_with_action_and_effect() {
        let inspection = inspect(None);
        let text = inspection.to_string();
        let inverted = inspection.flipped;
        for part in [
            "tetrahedron 2 has no volume: drop",
            "tetrahedron 3 repeats tetrahedron 0: drop",
            "1 nodes lose their last tetrahedron and will not move: 5",
            "can be used   yes",
        ] {
            assert!(text.contains(part), "'{part}' is missing in:\n{text}");
        }
        assert_eq!(text.matches("is inverted (volume -").count(), inverted, "{text}");
        let json: serde_json::Value = serde_json::to_value(&inspection).unwrap();
        let bad = &json["mending"]["bad_tets"];
        assert_eq!(bad[bad.as_array().unwrap().len() - 1]["repeats"], 0);
        assert_eq!(json["mending"]["lost_nodes"][0], 5);
        assert!(json["forecast"]["ways"].as_array().unwrap().len() >= 4);
        assert_eq!(json["usable"], true);
    }

    /// The second element lies inside the first: both stand on the same side of their common face.
    #[test]
    fn a_mesh_folded_over_itself_is_warned_of_with_how_much_overlaps() {
        let folded = "softgrasp-lists 1\nvertices 5\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n0.1 0.1 0.25\n\
                      elements 2\n0 1 2 3\n0 1 2 4\n";
        let text = inspect_lists(folded, None).to_string();
        assert!(text.contains("WARNING       the mesh is folded over itself"), "{text}");
        assert!(text.contains("up to 20.0 % of the volume counts twice"), "{text}");
        assert!(!inspect(None).to_string().contains("folded"));
    }

    #[test]
    fn mesh_over_the_limit_is_not_usable_and_says_why() {
        let inspection = inspect(Some(1000));
        assert!(!inspection.usable);
        let text = inspection.to_string();
        assert!(text.contains("can be used   no:") && text.contains("1000 bytes"), "{text}");
    }
}
