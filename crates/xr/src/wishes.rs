//! Wishes of pages, turned into controls of the ticks.

use std::path::{Component, Path, PathBuf};
use std::sync::mpsc::Sender;

use softgrasp_grasp::object::ObjectChoice;
use softgrasp_window::view::control::Control;
use softgrasp_window::view::loading::{LoadObject, Loading, ObjectWish};
use softgrasp_window::view::object_skin::Look;
use softgrasp_window::view::shading::Shading;

use crate::from_page::Ask;

/// Passes wishes to the ticks.
pub struct Wishes {
    controls: Sender<Control>,
    /// Reads objects; `None` where a window does.
    load: Option<LoadObject>,
    loading: Option<(Loading, ObjectChoice)>,
}

/// Result of a wish for the page itself.
pub enum Granted {
    /// No result for the page.
    Nothing,
    /// Sentence for the person, and whether the wish was refused.
    Said(String, bool),
    /// Quantity that the colours show from now on.
    Shading(Shading),
    /// Look of the next object.
    Look(Look),
}

impl Wishes {
    /// Passes wishes to the ticks that obey these controls.
    pub fn new(controls: Sender<Control>, load: Option<LoadObject>) -> Self {
        Self { controls, load, loading: None }
    }

    /// Sends a control to the ticks; a run that is over ignores it.
    pub fn control(&self, control: Control) {
        let _ = self.controls.send(control);
    }

    /// Grants a wish of a page, or begins to.
    pub fn grant(&mut self, ask: Ask) -> Granted {
        let control = match ask {
            Ask::KeepShape => Control::KeepShape,
            Ask::UndoKeepShape => Control::UndoKeepShape,
            Ask::Detach => Control::Detach,
            Ask::ReturnHome => Control::ReturnHome,
            Ask::Restart => Control::Restart,
            Ask::Pause { stands: true } => Control::Pause,
            Ask::Pause { stands: false } => Control::Resume,
            Ask::Exit => Control::Stop,
            Ask::Save { name } => match new_file(&name) {
                Ok(path) => Control::Save(path),
                Err(why) => return Granted::Said(why, true),
            },
            Ask::Read { name } => return self.read(&name),
            Ask::Shade { what } => {
                return match what.parse() {
                    Ok(shading) => Granted::Shading(shading),
                    Err(error) => Granted::Said(format!("{error}"), true),
                };
            }
        };
        self.control(control);
        Granted::Nothing
    }

    fn read(&mut self, name: &str) -> Granted {
        let Some(load) = &self.load else {
            let text = "a run beside its window reads objects in the window";
            return Granted::Said(text.to_owned(), true);
        };
        let Ok(choice) = name.parse::<ObjectChoice>();
        if matches!(choice, ObjectChoice::File(_)) && !is_plain_name(name) {
            return Granted::Said(format!("'{name}' is no file of the run's folder"), true);
        }
        match Loading::start(load.clone(), ObjectWish::from(choice.clone())) {
            Ok(loading) => self.loading = Some((loading, choice)),
            Err(error) => return Granted::Said(format!("cannot read {name}: {error}"), true),
        }
        Granted::Said(format!("reading {name} …"), false)
    }

    /// Passes an object that has been read to the ticks.
    pub fn look_after_reading(&mut self) -> Granted {
        let Some((loading, choice)) = &self.loading else { return Granted::Nothing };
        let Some(result) = loading.take() else { return Granted::Nothing };
        let name = choice.to_string();
        self.loading = None;
        match result {
            Ok(loaded) => {
                self.control(Control::ReplaceObject(Box::new(loaded)));
                Granted::Look(Look::of(&name))
            }
            Err(why) => Granted::Said(why, true),
        }
    }
}

/// Whether a text is a file name without a folder.
fn is_plain_name(name: &str) -> bool {
    let mut parts = Path::new(name).components();
    let is_one = matches!(parts.next(), Some(Component::Normal(part)) if part == name);
    is_one && parts.next().is_none() && name.len() <= NAME_MAX && !name.starts_with('.')
}

/// Largest length of a file name, bytes.
const NAME_MAX: usize = 100;

/// Path of a new file in the run's folder; pages cannot replace files.
fn new_file(name: &str) -> Result<PathBuf, String> {
    if !is_plain_name(name) {
        return Err(format!("'{name}' is no name of a file: letters and an end like .msh"));
    }
    let path = PathBuf::from(name);
    match path.exists() {
        true => Err(format!("{name} is there already; save under another name")),
        false => Ok(path),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;

    use super::*;

    #[test]
    fn menu_reaches_the_ticks() {
        let (controls, obeyed) = channel();
        let mut wishes = Wishes::new(controls, None);
        for ask in [Ask::KeepShape, Ask::Pause { stands: true }, Ask::Exit] {
            assert!(matches!(wishes.grant(ask), Granted::Nothing));
        }
        let obeyed: Vec<Control> = obeyed.try_iter().collect();
        assert!(matches!(obeyed[..], [Control::KeepShape, Control::Pause, Control::Stop]));
    }

    #[test]
    fn page_writes_no_file_outside_the_folder_and_none_that_is_there() {
        let (controls, obeyed) = channel();
        let mut wishes = Wishes::new(controls, None);
        for name in ["../a.msh", "/tmp/a.msh", "a/b.msh", "", ".", "..", ".a.msh", "Cargo.toml"] {
            let told = wishes.grant(Ask::Save { name: name.to_owned() });
            assert!(matches!(told, Granted::Said(_, true)), "{name}");
        }
        assert!(obeyed.try_recv().is_err());
        let name = "shape-that-is-not-there.msh".to_owned();
        assert!(matches!(wishes.grant(Ask::Save { name }), Granted::Nothing));
        assert!(matches!(obeyed.try_recv(), Ok(Control::Save(_))));
    }
}
