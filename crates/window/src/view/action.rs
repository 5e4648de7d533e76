//! What a person can ask for, by menu, bar or key.

use softgrasp_grasp::object::ObjectChoice;
use softgrasp_hand::hand_request::HandChoice;

use super::display::Level;
use super::shading::Shading;
use super::toggle::{Page, Toggle};

/// One wish of the person, by menu, bar or key.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// Ask for a mesh file.
    ReadFile,
    /// Take another object.
    Open(ObjectChoice),
    /// Make the shape as it is the shape at rest (thesis 4.6).
    KeepShape,
    /// Go back to the shape at rest before the last one.
    UndoKeepShape,
    /// Let the object go where it is.
    Detach,
    /// Put the object back where it began.
    ReturnHome,
    /// Ask for a name and write the object.
    SaveAs,
    /// Write a picture of the scene.
    Snapshot,
    /// Begin or end to write every picture.
    Record,
    /// End the program.
    Exit,
    /// Let another hand act.
    Hand(HandChoice),
    /// Solve by another method.
    Method(String),
    /// Accept errors up to this share, or only those of rounding.
    MaxError(Option<f64>),
    /// Show or hide a part of the scene.
    Toggle(Toggle),
    /// Show or hide a page.
    Page(Page),
    /// Show a quantity in colours.
    Shade(Shading),
    /// Spend so much on the light.
    Light(Level),
    /// Show the next quantity in colours.
    NextShading,
    /// Show the next level of the sphere tree, after the last one the spheres of a search, then none.
    NextSphereLevel,
    /// Show the level of the sphere tree before this one.
    LastSphereLevel,
    /// Look at the whole scene.
    FrameAll,
    /// Play on, or pause: hands that are played only.
    PlayOrPause,
    /// Play one tick: hands that are played only.
    Step,
    /// Play from the beginning: hands that are played only.
    Restart,
}

impl Action {
    /// Text of the wish in a menu.
    pub fn label(&self) -> String {
        match self {
            Self::ReadFile => "Read file …".to_owned(),
            Self::Open(choice) => capitalised(&choice.to_string()),
            Self::KeepShape => "Keep shape".to_owned(),
            Self::UndoKeepShape => "Undo keep shape".to_owned(),
            Self::Detach => "Detach".to_owned(),
            Self::ReturnHome => "Return to the origin".to_owned(),
            Self::SaveAs => "Save as …".to_owned(),
            Self::Snapshot => "Snapshot".to_owned(),
            Self::Record => "Record pictures".to_owned(),
            Self::Exit => "Exit".to_owned(),
            Self::Hand(HandChoice::Mouse) => "Mouse and keyboard".to_owned(),
            Self::Hand(HandChoice::Scripted(script)) => format!("Script: {script}"),
            Self::Hand(HandChoice::Live) => "Your own hand".to_owned(),
            Self::Hand(HandChoice::Replay) => "Recording".to_owned(),
            Self::Method(name) => name.clone(),
            Self::MaxError(None) => "rounding only".to_owned(),
            Self::MaxError(Some(share)) => Shading::Error.text(*share),
            Self::Toggle(toggle) => toggle.label().to_owned(),
            Self::Page(page) => page.label().to_owned(),
            Self::Shade(shading) => shading.title().to_owned(),
            Self::Light(level) => capitalised(&format!("{level} light")),
            Self::NextShading => "Next colouring".to_owned(),
            Self::NextSphereLevel => "Next level of spheres".to_owned(),
            Self::LastSphereLevel => "Previous level of spheres".to_owned(),
            Self::FrameAll => "Frame the scene".to_owned(),
            Self::PlayOrPause => "Play or pause".to_owned(),
            Self::Step => "One tick".to_owned(),
            Self::Restart => "From the beginning".to_owned(),
        }
    }

    /// Key that asks for the wish, as the menu shows it; empty where there is none.
    pub const fn key(&self) -> &'static str {
        match self {
            Self::ReadFile => "Ctrl+O",
            Self::KeepShape => "K",
            Self::UndoKeepShape => "Ctrl+Z",
            Self::Detach => "Backspace",
            Self::ReturnHome => "Home",
            Self::SaveAs => "Ctrl+S",
            Self::Snapshot => "P",
            Self::Record => "R",
            Self::Exit => "Ctrl+Q",
            Self::NextShading => "C",
            Self::NextSphereLevel => "T",
            Self::LastSphereLevel => "Shift+T",
            Self::FrameAll => "F",
            Self::PlayOrPause => "Enter",
            Self::Step => ".",
            Self::Restart => ",",
            Self::Toggle(toggle) => toggle.key(),
            Self::Page(page) => page.key(),
            _ => "",
        }
    }
}

fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn no_two_actions_share_a_key() {
        let mut actions: Vec<Action> = Toggle::ALL.map(Action::Toggle).to_vec();
        actions.extend(Page::ALL.map(Action::Page));
        actions.extend([
            Action::ReadFile,
            Action::KeepShape,
            Action::UndoKeepShape,
            Action::Detach,
            Action::ReturnHome,
            Action::SaveAs,
            Action::Snapshot,
            Action::Record,
            Action::Exit,
            Action::NextShading,
            Action::NextSphereLevel,
            Action::LastSphereLevel,
            Action::FrameAll,
            Action::PlayOrPause,
            Action::Step,
            Action::Restart,
        ]);
        let keys: BTreeSet<&str> = actions.iter().map(Action::key).collect();
        assert_eq!(keys.len(), actions.len(), "{keys:?}");
        assert!(!keys.contains(""));
    }

    #[test]
    fn errors_that_are_accepted_are_read_as_round_numbers() {
        let read = [1e-2, 1e-4, 1e-6].map(|share| Action::MaxError(Some(share)).label());
        assert_eq!(read, ["1 %", "0.01 %", "0.0001 %"]);
    }
}
