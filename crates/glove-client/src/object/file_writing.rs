//! Writes a file completely, or leaves an older one as it was.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// Why a file cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum FileWriteError {
    /// The path names a folder.
    #[error("cannot write {path}: it is a directory")]
    Directory {
        /// Path as it was given.
        path: PathBuf,
    },
    /// The operating system refuses.
    #[error("cannot write {path}: {source}")]
    System {
        /// Path as it was given.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
}

/// Writes a file completely, or leaves an older file as it was: the bytes are written to a file beside
/// it, synchronised to the disk, and renamed. A name that is a link leads to the same file afterwards.
///
/// # Errors
/// [`FileWriteError`] with the path and the error of the operating system.
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<(), FileWriteError> {
    write_file_by(path, |file| file.write_all(bytes))
}

/// Writes a file whose bytes need not be in memory as a whole: `write` writes them piece by piece.
///
/// # Errors
/// The same as those of [`write_file`].
pub fn write_file_by(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> std::io::Result<()>,
) -> Result<(), FileWriteError> {
    let system = |source| FileWriteError::System { path: path.to_owned(), source };
    if path.is_dir() {
        return Err(FileWriteError::Directory { path: path.to_owned() });
    }
    // Devices and pipes (/dev/stdout) cannot be replaced by renaming.
    if path.exists() && !path.is_file() {
        let open = File::options().write(true).open(path);
        return open.and_then(|mut device| buffered(&mut device, write)).map_err(system);
    }
    let target = std::fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let part = beside(&target);
    let written = write_and_sync(&part, write, &target)
        .and_then(|()| std::fs::rename(&part, &target))
        .and_then(|()| sync_folder(&target));
    if written.is_err() {
        // Best effort: the error that matters is the one reported below.
        let _ = std::fs::remove_file(&part);
    }
    written.map_err(system)
}

/// Path beside a file that no other writer uses, in this process or another.
fn beside(path: &Path) -> PathBuf {
    static WRITTEN: AtomicU64 = AtomicU64::new(0);
    let number = WRITTEN.fetch_add(1, Ordering::Relaxed);
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(format!(".{}.{number}.part", std::process::id()));
    path.with_file_name(name)
}

/// Writes the bytes and synchronises them to the disk, with the permissions of the file to be replaced.
fn write_and_sync(
    part: &Path,
    write: impl FnOnce(&mut dyn Write) -> std::io::Result<()>,
    replaces: &Path,
) -> std::io::Result<()> {
    let mut file = File::create_new(part)?;
    buffered(&mut file, write)?;
    if let Ok(older) = std::fs::metadata(replaces) {
        file.set_permissions(older.permissions())?;
    }
    file.sync_all()
}

fn buffered(
    file: &mut File,
    write: impl FnOnce(&mut dyn Write) -> std::io::Result<()>,
) -> std::io::Result<()> {
    let mut pieces = BufWriter::new(file);
    write(&mut pieces)?;
    pieces.flush()
}

/// Synchronises a new name in a folder to the disk.
fn sync_folder(path: &Path) -> std::io::Result<()> {
    let folder = match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    match cfg!(unix) {
        true => File::open(folder)?.sync_all(),
        // Other systems do not open folders as files.
        false => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(folder).unwrap();
        let mut names: Vec<String> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn writers_of_one_file_at_once_leave_one_whole_file_and_nothing_beside_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mesh");
        std::thread::scope(|scope| {
            for writer in 0..8 {
                let path = &path;
                scope.spawn(move || {
                    for _ in 0..20 {
                        write_file(path, &vec![writer; 10_000]).unwrap();
                        let found = std::fs::read(path).unwrap();
                        assert!(found.len() == 10_000 && found.iter().all(|b| *b == found[0]));
                    }
                });
            }
        });
        assert_eq!(names(folder.path()), ["mesh"]);
    }

    #[test]
    fn failure_leaves_the_older_file_as_it_was() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("no such folder").join("mesh");
        assert!(matches!(write_file(&path, b"new"), Err(FileWriteError::System { .. })));
        // Its name beside the file would be too long.
        let path = folder.path().join("m".repeat(250));
        std::fs::write(&path, b"old").unwrap();
        assert!(matches!(write_file(&path, b"new"), Err(FileWriteError::System { .. })));
        assert_eq!(std::fs::read(&path).unwrap(), b"old");
        assert!(matches!(write_file(folder.path(), b""), Err(FileWriteError::Directory { .. })));
    }

    #[cfg(unix)]
    #[test]
    fn link_and_permissions_stay() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let [path, link] = ["mesh", "link"].map(|name| folder.path().join(name));
        std::fs::write(&path, b"old").unwrap();
        std::fs::set_permissions(&path, PermissionsExt::from_mode(0o640)).unwrap();
        std::os::unix::fs::symlink(&path, &link).unwrap();
        write_file(&link, b"new").unwrap();
        assert!(std::fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(std::fs::read(&path).unwrap(), b"new");
        assert_eq!(std::fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o640);
    }
}
