//! What is under way with the object besides the grasp: another shape, another object, a file.

use std::path::PathBuf;

use crate::object::shape_history::ShapeHistory;

/// Changes of the object that were asked for between ticks.
#[derive(Default)]
pub struct ObjectChanges {
    /// Rest shapes before the one there is.
    pub history: ShapeHistory,
    /// What takes the place of the object as soon as it is made.
    pub replacement: Option<Replacement>,
    /// The file to write as soon as every node is known.
    pub save_to: Option<PathBuf>,
    /// The last question was asked again for all nodes, outside the ticks.
    pub asked_whole: bool,
}

/// What takes the place of the object.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Replacement {
    /// Its rest shape before the last one was kept.
    EarlierShape,
    /// Its rest shape before the first one was kept.
    FirstShape,
    /// Another material for the rest shape that is there.
    OtherMaterial,
    /// Another object, by name.
    Other(String),
}

/// Stands for the tick of a question that no tick asked; no report counts it.
pub const UNCOUNTED: u64 = u64::MAX;

impl ObjectChanges {
    /// Whether the object is about to be replaced.
    pub fn are_under_way(&self) -> bool {
        self.replacement.is_some()
    }
}
