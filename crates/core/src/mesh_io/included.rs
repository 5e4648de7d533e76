//! The files that decks, Vega and FEBio models include by name: found, counted, noted.

use super::companion::{Companion, FindCompanion};
use super::cursor::Cursor;
use super::error::{Fault, MeshFileError};
use super::findings::Findings;

/// Files that a mesh file includes by name, all together; a file that includes itself ends there.
pub(super) struct Included<'f, 'g> {
    find: &'f mut FindCompanion<'g>,
    count: usize,
}

/// Files that one mesh may include.
const MAX_INCLUDED: usize = 64;

impl<'f, 'g> Included<'f, 'g> {
    /// None so far.
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
