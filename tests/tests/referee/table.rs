//! The table of agreement that a run prints, in the form of the documents.

use std::fmt;

use softgrasp_core::fem::Element;

use crate::agreement::{Agreement, Comparison};
use crate::deck::System;
use crate::object::Object;

/// Rows of a Markdown table.
#[derive(Default)]
pub struct Table(Vec<String>);

impl Table {
    /// Adds one object with one element.
    pub fn push(&mut self, object: &Object, system: &System, agreement: &Agreement) {
        let of = |c: &Comparison| match c.count {
            0 => "– | – | –".to_owned(),
            count => format!("{count} | {:.1e} | {:.1e}", c.difference_rel, c.beyond_digits_rel),
        };
        let element = if system.element == Element::Tet4 { "C3D4" } else { "C3D10" };
        let nodes = system.used.iter().filter(|used| **used).count();
        self.0.push(format!(
            "| {} | {element} | {nodes} | {:.1e} | {} | {} | {} |",
            object.name,
            object.mesh.size(),
            agreement.questions,
            of(&agreement.displacement),
            of(&agreement.force)
        ));
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(
            "| mesh | element | nodes | size | questions | displacements | differ by | beyond digits \
             | reactions | differ by | beyond digits |\n",
        )?;
        writeln!(f, "|---|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|")?;
        self.0.iter().try_for_each(|row| writeln!(f, "{row}"))
    }
}
