//! Object of a recording: the mesh file that its name may stand for.

use std::path::{Path, PathBuf};

use anyhow::bail;
use softgrasp_grasp::object::ObjectChoice;

/// Object that a recording names. A recording may come from anywhere. So its mesh file is only opened in
/// the folder of the recording or below it: by the path in the recording, or under the same file name.
///
/// # Errors
/// There is no such file there. A path outside the folder is neither opened nor checked.
pub(super) fn recorded_object(recording: &Path, name: &str) -> anyhow::Result<ObjectChoice> {
    let Ok(ObjectChoice::File(named)) = name.parse() else { return Ok(name.parse()?) };
    let folder = match recording.parent() {
        Some(parent) if parent != Path::new("") => parent,
        _ => Path::new("."),
    };
    match file_below(folder, &named) {
        Some(file) => Ok(ObjectChoice::File(file)),
        None => bail!(
            "the recording {} names the object {}, which is no file below the recording's folder; \
             a recording may open no other: put the mesh beside it, or name it with --object FILE",
            recording.display(),
            named.display()
        ),
    }
}

/// Path of the file that a recording in this folder names, if it lies in the folder or below it.
fn file_below(folder: &Path, named: &Path) -> Option<PathBuf> {
    let folder_itself = folder.canonicalize().ok()?;
    let below = |path: PathBuf| {
        // Links are followed first: a link may lead out of the folder.
        let itself = path.canonicalize().ok()?;
        (itself.starts_with(&folder_itself) && itself.is_file()).then_some(path)
    };
    let beside = named.file_name().map(|file| folder.join(file));
    [Some(folder.join(named)), Some(named.to_owned()), beside].into_iter().flatten().find_map(below)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn recording_may_name_files_below_its_own_folder_only() {
        let place = tempfile::tempdir().unwrap();
        let folder = place.path().join("runs");
        std::fs::create_dir_all(folder.join("meshes")).unwrap();
        let secret = place.path().join("secret");
        for file in [&folder.join("a.msh"), &folder.join("meshes/b.msh"), &secret] {
            std::fs::write(file, "text").unwrap();
        }
        let recording = folder.join("run.mcap");
        let found = |name: &str| match recorded_object(&recording, name) {
            Ok(ObjectChoice::File(path)) => Some(path),
            Ok(choice) => panic!("{choice}"),
            Err(_) => None,
        };
        assert_eq!(found("a.msh"), Some(folder.join("a.msh")));
        assert_eq!(found("meshes/b.msh"), Some(folder.join("meshes/b.msh")));
        assert_eq!(found("/far/away/a.msh"), Some(folder.join("a.msh")), "moved with its mesh");
        let inside = folder.join("meshes/b.msh");
        assert_eq!(found(inside.to_str().unwrap()), Some(inside));
        for outside in [secret.to_str().unwrap(), "../secret", "/etc/passwd", "meshes/../../secret"]
        {
            assert_eq!(found(outside), None, "{outside}");
        }
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(&secret, folder.join("link.msh")).unwrap();
            assert_eq!(found("link.msh"), None, "a link leads out");
        }
        let built_in = recorded_object(&recording, "cube").unwrap();
        assert!(matches!(built_in, ObjectChoice::BuiltIn(_)));
    }
}
