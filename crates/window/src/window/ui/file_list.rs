//! The folders and the meshes of a folder, to be clicked.

use std::fs::File;
use std::io::Read as _;
use std::path::{Path, PathBuf};

use egui::{ScrollArea, Ui};
use softgrasp_core::mesh_io::{Sniffed, sniff};

use super::{places, theme};

/// The folders and the mesh files of a folder.
pub struct FileList {
    folder: PathBuf,
    folders: Vec<String>,
    files: Vec<String>,
    /// Number of entries that were not looked at, because there are too many.
    left_out: usize,
}

/// Entry of the list that was clicked.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Clicked {
    /// Another folder was clicked.
    Folder(PathBuf),
    /// A file was clicked once.
    File(PathBuf),
    /// A file was clicked twice: it is to be read.
    FileTwice(PathBuf),
}

/// Most entries of a folder that are looked at.
const ENTRIES_MAX: usize = 500;
/// Number of bytes at the beginning of a file by which its format is told.
const LOOKED_AT: u64 = 1 << 16;

impl FileList {
    /// The list of a folder: its folders, and the files whose content a mesh can be read from,
    /// whatever their names end with.
    pub fn of(folder: &Path) -> Self {
        let shown = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        let (mut folders, mut files, mut left_out) = (Vec::new(), Vec::new(), 0);
        let entries = std::fs::read_dir(shown).into_iter().flatten().flatten();
        for (place, entry) in entries.enumerate() {
            let name = entry.file_name().to_string_lossy().into_owned();
            match entry.path() {
                _ if name.starts_with('.') => {}
                _ if place >= ENTRIES_MAX => left_out += 1,
                path if path.is_dir() => folders.push(name),
                path if is_readable_mesh(&path) => files.push(name),
                _ => {}
            }
        }
        folders.sort();
        files.sort();
        Self { folder: folder.to_owned(), folders, files, left_out }
    }

    /// Shows folders, then files; returns what was clicked.
    pub fn show(&self, ui: &mut Ui, typed: &str) -> Option<Clicked> {
        let mut clicked = None;
        if !self.folder.as_os_str().is_empty() {
            ui.label(theme::quiet(format!("in {}", self.folder.display())));
        }
        if self.files.is_empty() {
            ui.label(theme::quiet("There is no mesh that can be read in this folder."));
        }
        let height_max = (ui.ctx().content_rect().height() - 330.0).clamp(80.0, 240.0);
        ScrollArea::vertical().max_height(height_max).show(ui, |ui| {
            ui.set_min_width(ui.available_width());
            if ui.selectable_label(false, "🗀 ..").clicked() {
                clicked = Some(Clicked::Folder(self.above()));
            }
            for name in &self.folders {
                let response = ui.selectable_label(false, format!("🗀 {name}"));
                places::tell(ui.ctx(), &format!("{name}/"), &response);
                if response.clicked() {
                    clicked = Some(Clicked::Folder(self.folder.join(name)));
                }
            }
            for name in &self.files {
                let path = self.folder.join(name);
                let response = ui.selectable_label(typed == path.to_string_lossy(), name);
                places::tell(ui.ctx(), name, &response);
                if response.double_clicked() {
                    clicked = Some(Clicked::FileTwice(path));
                } else if response.clicked() {
                    clicked = Some(Clicked::File(path));
                }
            }
        });
        if self.left_out > 0 {
            let text = format!("{} more entries were not looked at; type the name", self.left_out);
            ui.label(theme::quiet(text).small());
        }
        clicked
    }

    /// Path of the folder above.
    fn above(&self) -> PathBuf {
        match self.folder.file_name() {
            Some(_) => self.folder.parent().unwrap_or(Path::new("")).to_owned(),
            // From the folder that the program was started in, or from one above it.
            None if self.folder.has_root() => self.folder.clone(),
            None => self.folder.join(".."),
        }
    }
}

/// Whether a file begins as a mesh that can be read.
fn is_readable_mesh(path: &Path) -> bool {
    let Ok(file) = File::open(path) else { return false };
    // Pipes and devices would be waited for.
    if !file.metadata().is_ok_and(|metadata| metadata.is_file()) {
        return false;
    }
    let mut begin = Vec::new();
    let looked = file.take(LOOKED_AT).read_to_end(&mut begin);
    looked.is_ok() && matches!(sniff(&begin), Some(Sniffed::Readable(_)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use softgrasp_core::mesh::{BuiltIn, generate};
    use softgrasp_core::mesh_io::write_msh41;

    #[test]
    fn readable_meshes_are_offered_whatever_their_name_and_unreadable_files_are_not() {
        let folder = std::env::temp_dir().join(format!("softgrasp-list-{}", std::process::id()));
        std::fs::create_dir_all(folder.join("deeper")).unwrap();
        let mesh = generate(BuiltIn::Cube, 27).unwrap();
        for name in ["a.msh", "mesh.veg", "b.tet", "no-extension"] {
            std::fs::write(folder.join(name), write_msh41(&mesh)).unwrap();
        }
        for name in ["deck.inp", "data.json", "page.xml", "notes.txt"] {
            std::fs::write(folder.join(name), "{ no mesh }").unwrap();
        }
        let list = FileList::of(&folder);
        std::fs::remove_dir_all(&folder).unwrap();
        assert_eq!(list.files, ["a.msh", "b.tet", "mesh.veg", "no-extension"]);
        assert_eq!(list.folders, ["deeper"]);
    }

    #[test]
    fn way_up_leads_out_of_folders_and_ends_at_the_root() {
        let above = |folder: &str| {
            let list = FileList {
                folder: folder.into(),
                folders: Vec::new(),
                files: Vec::new(),
                left_out: 0,
            };
            list.above()
        };
        assert_eq!(above("a/b"), Path::new("a"));
        assert_eq!(above("a"), Path::new(""));
        assert_eq!(above(""), Path::new(".."));
        assert_eq!(above(".."), Path::new("../.."));
        assert_eq!(above("/"), Path::new("/"));
    }
}
