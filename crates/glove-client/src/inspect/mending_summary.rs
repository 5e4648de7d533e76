//! The report of `inspect` on bad tetrahedra of a file: which were turned or dropped, and why.

use std::fmt;

use serde::Serialize;
use softgrasp_core::mesh_io::{Mending, TetFault};

/// Bad tetrahedra and lost nodes, and how mending changes the object.
#[derive(Debug, Serialize)]
pub struct MendingSummary {
    /// First bad tetrahedra, ascending by number.
    bad_tets: Vec<BadTetSummary>,
    bad_tet_count: usize,
    volume_in_file: f64,
    volume: f64,
    /// First lost nodes, ascending by number.
    lost_nodes: Vec<u32>,
    lost_node_count: usize,
    bodies_in_file: usize,
    bodies: usize,
    bodies_fallen_apart: usize,
    bodies_vanished: usize,
    pieces_in_file: usize,
    pieces: usize,
}

#[derive(Debug, Serialize)]
struct BadTetSummary {
    tet: usize,
    fault: &'static str,
    action: &'static str,
    /// Signed volume with the corners in the file's order, m³.
    volume: f64,
    /// Number of the earlier tetrahedron that this one repeats.
    repeats: Option<usize>,
}

/// Largest number of bad elements and of lost nodes listed in the JSON; the counts are always complete.
const LISTED_JSON: usize = 1000;
/// Largest number of bad elements and of lost nodes listed in the text.
const LISTED_TEXT: usize = 10;

impl MendingSummary {
    /// Summary of what the reader found.
    pub fn new(mending: &Mending) -> Self {
        let bad = mending.bad.iter().take(LISTED_JSON);
        Self {
            bad_tets: bad
                .map(|bad| BadTetSummary {
                    tet: bad.tet,
                    fault: bad.fault.name(),
                    action: bad.fault.action(),
                    volume: bad.volume,
                    repeats: match bad.fault {
                        TetFault::Repeated { of } => Some(of),
                        _ => None,
                    },
                })
                .collect(),
            bad_tet_count: mending.bad.len(),
            volume_in_file: mending.volume_in_file,
            volume: mending.volume,
            lost_nodes: mending.lost_nodes.iter().take(LISTED_JSON).copied().collect(),
            lost_node_count: mending.lost_nodes.len(),
            bodies_in_file: mending.bodies_in_file,
            bodies: mending.bodies,
            bodies_fallen_apart: mending.fallen_apart.len(),
            bodies_vanished: mending.vanished,
            pieces_in_file: mending.pieces_in_file,
            pieces: mending.pieces,
        }
    }
}

impl fmt::Display for MendingSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for bad in self.bad_tets.iter().take(LISTED_TEXT) {
            let what = match (bad.fault, bad.repeats) {
                (_, Some(of)) => format!("repeats tetrahedron {of}"),
                ("flat", _) => "has no volume".to_owned(),
                _ => format!("is inverted (volume {:.3e})", bad.volume),
            };
            writeln!(f, "  mend          tetrahedron {} {what}: {}", bad.tet, bad.action)?;
        }
        if self.bad_tet_count > LISTED_TEXT {
            let more = self.bad_tet_count - LISTED_TEXT;
            writeln!(f, "                and {more} more (--json lists up to {LISTED_JSON})")?;
        }
        writeln!(
            f,
            "  mended        volume {:.6e} instead of {:.6e}",
            self.volume, self.volume_in_file
        )?;
        if self.lost_node_count > 0 {
            let listed: Vec<String> =
                self.lost_nodes.iter().take(LISTED_TEXT).map(u32::to_string).collect();
            let more = if self.lost_node_count > LISTED_TEXT { ", …" } else { "" };
            writeln!(
                f,
                "                {} nodes lose their last tetrahedron and will not move: {}{more}",
                self.lost_node_count,
                listed.join(", ")
            )?;
        }
        if self.bodies_fallen_apart > 0 || self.bodies_vanished > 0 {
            writeln!(
                f,
                "                {} bodies instead of {}: {} fall apart, {} vanish",
                self.bodies, self.bodies_in_file, self.bodies_fallen_apart, self.bodies_vanished
            )?;
        }
        if self.pieces > self.pieces_in_file {
            writeln!(
                f,
                "                {} pieces instead of {}: what hung together by faces is hinged now",
                self.pieces, self.pieces_in_file
            )?;
        }
        Ok(())
    }
}
