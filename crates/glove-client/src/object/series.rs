//! A series of files of the object, and the PVD file that lists them with their times, which ParaView plays.

use std::path::{Path, PathBuf};

use crate::object::file_writing::{FileWriteError, write_file};

/// Files `step_00001.vtu`, `step_00002.vtu`, … of a folder, and their times.
pub struct Series {
    folder: PathBuf,
    entries: String,
    count: usize,
}

impl Series {
    /// An empty series in a folder, which is made.
    ///
    /// # Errors
    /// [`FileWriteError`] if the folder cannot be made.
    pub fn create(folder: &Path) -> Result<Self, FileWriteError> {
        std::fs::create_dir_all(folder)
            .map_err(|source| FileWriteError::System { path: folder.to_owned(), source })?;
        Ok(Self { folder: folder.to_owned(), entries: String::new(), count: 0 })
    }

    /// Adds a moment; path of its file, which the caller writes.
    ///
    /// Units: `time_s` s.
    pub fn add(&mut self, time_s: f64) -> PathBuf {
        self.count += 1;
        let name = format!("step_{:05}.vtu", self.count);
        self.entries.push_str(&format!(
            "    <DataSet timestep=\"{time_s}\" part=\"0\" file=\"{name}\"/>\n"
        ));
        self.folder.join(name)
    }

    /// Writes the file that lists all others, `series.pvd`.
    ///
    /// # Errors
    /// [`FileWriteError`].
    pub fn finish(self) -> Result<(), FileWriteError> {
        let text = format!(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" \
             byte_order=\"LittleEndian\">\n  <Collection>\n{}  </Collection>\n</VTKFile>\n",
            self.entries
        );
        write_file(&self.folder.join("series.pvd"), text.as_bytes())
    }
}
