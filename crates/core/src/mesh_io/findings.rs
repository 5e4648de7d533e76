//! What a mesh file holds besides the mesh that is made of it, and the files that decks, Vega and FEBio models
//! include by name: found, counted, noted.

use std::collections::BTreeMap;

use super::companion::{Companion, FindCompanion};
use super::cursor::Cursor;
use super::error::{Fault, MeshFileError};
use crate::mesh::TetMesh;
use crate::mesh_io::{Format, Mending};

/// A mesh file after reading.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshFile {
    /// The format its content has, whatever its name says.
    pub format: Format,
    /// The mesh: node i is the i-th node record of the file.
    pub mesh: TetMesh,
    /// What was put right, left out or skipped on the way.
    pub findings: Findings,
}

/// What was put right, left out or skipped while a file was read.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Findings {
    /// Node records in the file.
    pub file_nodes: usize,
    /// Tetrahedra of any order in the file.
    pub file_tets: usize,
    /// Tetrahedra (record numbers from 0) whose corners are ordered against the format's rule;
    /// they were turned.
    pub flipped: Vec<usize>,
    /// Tetrahedra (record numbers from 0) without volume; they were dropped.
    pub degenerate: Vec<usize>,
    /// Tetrahedra (record numbers from 0) with the four corners of an earlier one; they were
    /// dropped.
    pub repeated: Vec<usize>,
    /// These tetrahedra one by one, and how putting them right changed the object; `None` if
    /// there was nothing to put right.
    pub mending: Option<Mending>,
    /// Nodes that are no corner of a kept tetrahedron; they keep their number.
    pub orphans: usize,
    /// Tetrahedra of second or higher order. Where every tetrahedron has ten nodes, the mesh keeps its
    /// mid-edge nodes; else corners are used alone.
    pub higher_order: usize,
    /// Cells that are not tetrahedra, by plural name ("triangles").
    pub other_cells: BTreeMap<String, usize>,
    /// Whether node labels are something else than 0, 1, 2 … or 1, 2, 3 ….
    pub labels_mapped: bool,
    /// The file's own name of each region of the mesh; empty when the mesh has one region.
    pub region_labels: Vec<String>,
    /// Sections of the file that were not looked into.
    pub skipped_sections: Vec<String>,
    /// Anything else worth a sentence.
    pub notes: Vec<String>,
}

impl Findings {
    /// Adds a note once; a file cannot fill the list.
    pub(super) fn note(&mut self, note: impl Into<String>) {
        let note = note.into();
        if self.notes.len() < 50 && !self.notes.contains(&note) {
            self.notes.push(note);
        }
    }

    /// Adds a skipped section once; a file of thousands of them does not fill the list.
    pub(super) fn skip(&mut self, section: &[u8]) {
        let section = section.get(..60).unwrap_or(section).escape_ascii().to_string();
        if self.skipped_sections.len() < 50 && !self.skipped_sections.contains(&section) {
            self.skipped_sections.push(section);
        }
    }
}

/// Files that a mesh file includes by name, all together; a file that includes itself ends there.
pub(super) struct Included<'f, 'g> {
    find: &'f mut FindCompanion<'g>,
    count: usize,
}

/// Files that one mesh may include.
const MAX_INCLUDED: usize = 64;

impl<'f, 'g> Included<'f, 'g> {
    /// No file is included so far.
    pub(super) fn new(find: &'f mut FindCompanion<'g>) -> Self {
        Self { find, count: 0 }
    }

    /// Bytes of one more, which is noted.
    ///
    /// # Errors
    /// [`MeshFileError`] at the place of the cursor: it is not there, or there are too many; `what` they
    /// are.
    pub(super) fn bytes(
        &mut self,
        file: &str,
        what: &str,
        cursor: &Cursor,
        findings: &mut Findings,
    ) -> Result<Vec<u8>, MeshFileError> {
        self.count += 1;
        if self.count > MAX_INCLUDED {
            return Err(cursor.count_fault(what, &format!("at most {MAX_INCLUDED}"), "more"));
        }
        let companion = Companion::FileName(file.to_owned());
        let Some(bytes) = (self.find)(&companion) else {
            return Err(cursor.fault(Fault::MissingCompanion { companion }));
        };
        findings.note(format!("includes {}", file.escape_debug()));
        Ok(bytes)
    }
}
