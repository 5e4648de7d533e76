//! Whether a file that is to stay secret can be read by others.

use std::path::Path;

/// Whether every user of this machine can read a file: its mode lets them, and so do all folders above
/// it. `false` where the system has no such modes or does not tell.
#[cfg(unix)]
pub fn others_can_read(path: &Path) -> bool {
    use std::os::unix::fs::PermissionsExt;
    const READ: u32 = 0o004;
    const PASS: u32 = 0o001;
    let allows =
        |path: &Path, bit| path.metadata().is_ok_and(|found| found.permissions().mode() & bit != 0);
    let Ok(path) = path.canonicalize() else { return false };
    allows(&path, READ) && path.ancestors().skip(1).all(|folder| allows(folder, PASS))
}

/// Always `false`: files have no such modes on this system.
#[cfg(not(unix))]
pub fn others_can_read(_path: &Path) -> bool {
    false
}

#[cfg(all(test, unix))]
mod tests {
    use std::fs::{Permissions, create_dir_all, remove_dir_all, set_permissions, write};
    use std::os::unix::fs::PermissionsExt;

    use super::*;

    #[test]
    fn file_is_open_to_others_only_if_its_folders_are() {
        let folder = std::env::temp_dir().join(format!("softgrasp-open-{}", std::process::id()));
        create_dir_all(&folder).unwrap();
        let file = folder.join("token");
        write(&file, "hush").unwrap();
        let mode = |path: &Path, mode| set_permissions(path, Permissions::from_mode(mode)).unwrap();
        for (of_folder, of_file, is_open) in
            [(0o755, 0o644, true), (0o755, 0o640, false), (0o700, 0o644, false)]
        {
            mode(&file, of_file);
            mode(&folder, of_folder);
            assert_eq!(others_can_read(&file), is_open, "{of_folder:o} {of_file:o}");
        }
        remove_dir_all(&folder).unwrap();
        assert!(!others_can_read(&file), "it is not there");
    }
}
