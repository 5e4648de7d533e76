//! Meshes and recordings of other authors, which are beside the repository and no part of it.

use std::path::{Path, PathBuf};

/// Folder of shared data, in the folder that `SOFTGRASP_SHARED` names or in `shared` beside a folder
/// above. `None`, with a line that the test is skipped, if it does not exist.
#[expect(clippy::print_stdout, reason = "whoever runs the test is told that it was skipped")]
pub fn shared(name: &str) -> Option<PathBuf> {
    let named = std::env::var_os("SOFTGRASP_SHARED").map(PathBuf::from);
    let above = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().map(|dir| dir.join("shared"));
    let mut folders = named.into_iter().chain(above).map(|shared| shared.join(name));
    let found = folders.find(|folder| folder.is_dir());
    if found.is_none() {
        println!("skipped: there is no folder shared/{name} (SOFTGRASP_SHARED names shared/)");
    }
    found
}
