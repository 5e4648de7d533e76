//! The dialogs that ask for a file: which mesh to read, under which name to save.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use egui::{Context, Key, RichText, TextEdit, Ui};

use super::file_list::{Clicked, FileList};
use super::{places, theme};

/// Dialog that is open.
#[derive(Default)]
pub enum Dialog {
    /// No dialog is open.
    #[default]
    Closed,
    /// The dialog that asks which mesh is to be read.
    Read(FileQuestion),
    /// The dialog that asks under which name the object is to be saved.
    Save(FileQuestion),
    /// The dialog that asks whether this file is to be replaced.
    Replace(PathBuf),
}

/// A question for a file.
pub struct FileQuestion {
    typed: String,
    /// Meshes and folders of the folder that is shown.
    list: FileList,
    /// The native dialog, while it is open, and since when.
    native: Option<(Receiver<Option<PathBuf>>, Instant)>,
    /// Reason why the last answer could not be used, in a sentence.
    refusal: Option<String>,
    is_new: bool,
}

/// Answer of the person to a dialog.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FileAnswer {
    /// Read this mesh file.
    Read(PathBuf),
    /// Save the object to this file, which is not there yet, or may be replaced.
    Save(PathBuf),
}

/// Formats that are written, by extension.
pub const WRITTEN: [&str; 3] = ["msh", "vtu", "txt"];
/// Extensions of what is read, for the system's own dialog.
const READ: [&str; 16] = [
    "msh", "vtu", "vtk", "mesh", "meshb", "txt", "node", "ele", "veg", "tet", "inp", "vol", "feb",
    "xdmf", "xmf", "gz",
];
/// Time within which a system without a dialog of its own says so; no person chooses so fast.
const NO_PERSON: Duration = Duration::from_millis(400);

impl Dialog {
    /// Asks which mesh is to be read.
    pub fn read() -> Self {
        Self::Read(FileQuestion::new(String::new()))
    }

    /// Asks again which mesh is to be read, because this file cannot be; `why` is a sentence.
    pub fn read_again(path: &Path, why: String) -> Self {
        let mut question = FileQuestion::new(path.to_string_lossy().into_owned());
        question.list = FileList::of(path.parent().unwrap_or(Path::new("")));
        question.refusal = Some(why);
        Self::Read(question)
    }

    /// Asks for a name under which the object is saved, with a proposal.
    pub fn save(object: &str) -> Self {
        Self::Save(FileQuestion::new(free_name(object)))
    }

    /// Whether no dialog is open.
    pub fn is_closed(&self) -> bool {
        matches!(self, Self::Closed)
    }

    /// Shows the dialog; returns the answer, once there is one.
    pub fn show(&mut self, context: &Context) -> Option<FileAnswer> {
        let (next, answer) = match std::mem::take(self) {
            Self::Closed => (Self::Closed, None),
            Self::Read(mut question) => match question.ask(context, false) {
                Step::Stay => (Self::Read(question), None),
                Step::Close => (Self::Closed, None),
                Step::Chosen(path) => (Self::Closed, Some(FileAnswer::Read(path))),
            },
            Self::Save(mut question) => match question.ask(context, true) {
                Step::Stay => (Self::Save(question), None),
                Step::Close => (Self::Closed, None),
                Step::Chosen(path) if path.exists() => (Self::Replace(path), None),
                Step::Chosen(path) => (Self::Closed, Some(FileAnswer::Save(path))),
            },
            Self::Replace(path) => match ask_to_replace(context, &path) {
                None => (Self::Replace(path), None),
                Some(true) => (Self::Closed, Some(FileAnswer::Save(path))),
                Some(false) => (Self::Closed, None),
            },
        };
        *self = next;
        answer
    }
}

/// Result of a look at a dialog.
enum Step {
    Stay,
    Close,
    Chosen(PathBuf),
}

impl FileQuestion {
    fn new(typed: String) -> Self {
        let list = FileList::of(Path::new(""));
        Self { typed, list, native: None, refusal: None, is_new: true }
    }

    fn ask(&mut self, context: &Context, is_save: bool) -> Step {
        if let Some((native, since)) = &self.native {
            match native.try_recv() {
                Ok(Some(path)) => return Step::Chosen(path),
                // Closed without a choice, or there is no native dialog here: the typed name stays.
                Ok(None) | Err(std::sync::mpsc::TryRecvError::Disconnected) => {
                    if since.elapsed() < NO_PERSON {
                        let text = "This system has no file dialog of its own (no portal, no zenity); \
                                    type the path, or choose it in the list.";
                        self.refusal = Some(text.to_owned());
                    }
                    self.native = None;
                }
                Err(std::sync::mpsc::TryRecvError::Empty) => {}
            }
        }
        let mut step = Step::Stay;
        let title = if is_save { "Save as" } else { "Read file" };
        theme::dialog(context, title, |ui| {
            ui.set_width(440.0);
            ui.heading(title);
            step = self.content(ui, is_save);
        });
        if context.input(|input| input.key_pressed(Key::Escape)) {
            step = Step::Close;
        }
        step
    }

    fn content(&mut self, ui: &mut Ui, is_save: bool) -> Step {
        let mut chosen = self.name_field(ui, is_save);
        if let Some(refusal) = &self.refusal {
            let response = ui.label(RichText::new(refusal).color(theme::BAD));
            places::tell(ui.ctx(), "why not", &response);
        }
        if is_save {
            self.formats(ui);
        } else {
            chosen = self.offers(ui).or(chosen);
        }
        ui.separator();
        let mut step = Step::Stay;
        ui.horizontal(|ui| {
            let verb = if is_save { "Save" } else { "Read" };
            let button = ui.add_enabled(!self.typed.trim().is_empty(), egui::Button::new(verb));
            places::tell(ui.ctx(), verb, &button);
            if button.clicked() {
                chosen = Some(PathBuf::from(self.typed.trim()));
            }
            let browses = ui.add_enabled(self.native.is_none(), egui::Button::new("Browse …"));
            places::tell(ui.ctx(), "Browse", &browses);
            if browses.clicked() {
                self.native = Some((browse(is_save, self.typed.clone()), Instant::now()));
            }
            let cancel = ui.button("Cancel");
            places::tell(ui.ctx(), "Cancel", &cancel);
            if cancel.clicked() {
                step = Step::Close;
            }
        });
        chosen.map_or(step, Step::Chosen)
    }

    fn name_field(&mut self, ui: &mut Ui, is_save: bool) -> Option<PathBuf> {
        let hint = if is_save { "name.msh" } else { "path of a mesh file" };
        let field =
            TextEdit::singleline(&mut self.typed).hint_text(hint).desired_width(f32::INFINITY);
        let response = ui.add(field);
        places::tell(ui.ctx(), "file name", &response);
        // The first pictures of a card only measure it: the wish is repeated until it is heard.
        if self.is_new {
            response.request_focus();
            self.is_new = !response.has_focus();
        }
        let entered = response.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
        let typed = self.typed.trim();
        (entered && !typed.is_empty()).then(|| PathBuf::from(typed))
    }

    /// Shows the formats as buttons: each sets the extension.
    fn formats(&mut self, ui: &mut Ui) {
        ui.horizontal(|ui| {
            ui.label(theme::quiet("format"));
            for extension in WRITTEN {
                let path = PathBuf::from(self.typed.trim());
                let is_chosen = path.extension().is_some_and(|e| e == extension);
                let about = match extension {
                    "msh" => "Gmsh 4.1",
                    "vtu" => "VTK, with the displacement",
                    _ => "the three lists of the thesis",
                };
                let response =
                    ui.selectable_label(is_chosen, format!(".{extension}")).on_hover_text(about);
                places::tell(ui.ctx(), extension, &response);
                if response.clicked() {
                    self.typed = path.with_extension(extension).to_string_lossy().into_owned();
                }
            }
        });
    }

    /// Shows folders and meshes, to be clicked.
    fn offers(&mut self, ui: &mut Ui) -> Option<PathBuf> {
        match self.list.show(ui, &self.typed)? {
            Clicked::Folder(folder) => self.list = FileList::of(&folder),
            Clicked::File(path) => self.typed = path.to_string_lossy().into_owned(),
            Clicked::FileTwice(path) => return Some(path),
        }
        None
    }
}

fn ask_to_replace(context: &Context, path: &Path) -> Option<bool> {
    theme::dialog(context, "replace", |ui| {
        ui.set_width(400.0);
        ui.heading("Replace the file?");
        ui.label(format!("{} is there already.", path.display()));
        ui.horizontal(|ui| {
            let replace = ui.button("Replace");
            places::tell(ui.ctx(), "Replace", &replace);
            let keep = ui.button("Keep the old one");
            places::tell(ui.ctx(), "Keep the old one", &keep);
            if replace.clicked() { Some(true) } else { keep.clicked().then_some(false) }
        })
        .inner
    })
}

/// Opens the system's own dialog on a thread, so that the window stays alive.
fn browse(is_save: bool, proposal: String) -> Receiver<Option<PathBuf>> {
    let (answer, answered) = channel();
    let thread = std::thread::Builder::new().name("file dialog".to_owned());
    let started = thread.spawn(move || {
        let dialog = rfd::FileDialog::new();
        let path = if is_save {
            dialog.add_filter("mesh", &WRITTEN).set_file_name(proposal).save_file()
        } else {
            dialog.add_filter("mesh", &READ).pick_file()
        };
        // Nobody may be waiting any more.
        let _ = answer.send(path);
    });
    if let Err(error) = started {
        tracing::warn!(%error, "cannot open the system's file dialog");
    }
    answered
}

/// A name that no file has: the object's, with a number.
fn free_name(object: &str) -> String {
    let stem = Path::new(object).file_stem().map_or("object".into(), |s| s.to_string_lossy());
    let stem = stem.trim_end_matches(|c: char| c.is_ascii_digit() || c == '-');
    (2..1000)
        .map(|n| format!("{stem}-{n}.msh"))
        .find(|name| !Path::new(name).exists())
        .unwrap_or_else(|| format!("{stem}.msh"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::window::read_words_tests::words_read;

    /// A dialog whose own dialog of the system has just ended without a choice, by itself.
    fn browsed() -> FileQuestion {
        let mut question = FileQuestion::new("typed.msh".to_owned());
        let (_, ended) = channel();
        // However long this test is stopped here, no person was there.
        question.native = Some((ended, Instant::now() + Duration::from_secs(3600)));
        question
    }

    #[test]
    fn browse_without_a_file_dialog_of_the_system_says_so_and_keeps_what_was_typed() {
        for (mut dialog, verb) in
            [(Dialog::Read(browsed()), "Read"), (Dialog::Save(browsed()), "Save")]
        {
            let mut answer = None;
            let read = words_read(|ui| answer = dialog.show(ui.ctx()));
            assert!(read.contains("no file dialog of its own"), "{read}");
            assert!(read.contains("typed.msh") && read.contains(verb), "{read}");
            assert!(answer.is_none() && !dialog.is_closed());
        }
    }

    #[test]
    fn refused_file_keeps_the_dialog_with_the_name_and_the_reason() {
        let why = "no/such.msh is not there".to_owned();
        let mut dialog = Dialog::read_again(Path::new("no/such.msh"), why.clone());
        let mut answer = None;
        let read = words_read(|ui| answer = dialog.show(ui.ctx()));
        assert!(read.contains(&why) && read.lines().any(|line| line == "no/such.msh"), "{read}");
        assert!(answer.is_none() && !dialog.is_closed());
    }
}
