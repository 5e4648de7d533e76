//! The menus: a bar at the top, and the pop-up menu of the right button (thesis Figure 6.1).

use egui::{Align2, Area, Button, Context, Frame, Id, Order, Pos2, Ui, Vec2};
use softgrasp_core::mesh::BuiltIn;
use softgrasp_grasp::object::ObjectChoice;
use softgrasp_hand::hand_request::HandChoice;
use softgrasp_hand::scripted::ScriptName;

use super::places;
use super::theme;
use crate::view::action::Action;
use crate::view::display::{Display, Level};
use crate::view::shading::Shading;
use crate::view::toggle::{Page, Toggle};

/// What the menus have to know of the run.
pub struct MenuFacts<'a> {
    /// What of the scene is shown.
    pub display: &'a Display,
    /// The hand that acts.
    pub hand: HandChoice,
    /// Name of the object.
    pub object: &'a str,
    /// Name of the method that was asked for.
    pub method: &'a str,
    /// Name of the method of the newest answer.
    pub solved_by: Option<&'a str>,
    /// Largest relative error that was asked for.
    pub max_error: Option<f64>,
    /// Whether there is a kept shape to go back from.
    pub can_undo: bool,
    /// Whether pictures are being written.
    pub is_recording: bool,
    /// Whether the shape can be kept now.
    pub can_keep: bool,
}

/// Methods that a person chooses among.
const METHODS: [&str; 5] = ["auto", "condensed", "front", "front-mixed", "pcg"];
/// Error budgets that a person chooses among.
const BUDGETS: [Option<f64>; 4] = [None, Some(1e-2), Some(1e-4), Some(1e-6)];

/// Width of a menu, points.
const MENU_WIDTH: f32 = 215.0;

/// The pop-up menu of the right mouse button.
#[derive(Default)]
pub struct PopUp {
    at: Option<Pos2>,
    /// Whether the click that opened the menu is still to be ignored: it does not close it.
    is_new: bool,
}

impl PopUp {
    /// Opens the menu at a place.
    pub fn open(&mut self, at: Pos2) {
        (self.at, self.is_new) = (Some(at), true);
    }

    /// Closes the menu.
    pub fn close(&mut self) {
        self.at = None;
    }

    /// Whether the menu is open.
    pub fn is_open(&self) -> bool {
        self.at.is_some()
    }

    /// Shows the menu, if it is open, and returns what was chosen.
    pub fn show(&mut self, context: &Context, facts: &MenuFacts<'_>) -> Option<Action> {
        let at = self.at?;
        let mut chosen = None;
        let area = Area::new(Id::new("pop-up menu"))
            .order(Order::Foreground)
            .fixed_pos(at)
            .constrain(true)
            .show(context, |ui| {
                Frame::menu(ui.style()).show(ui, |ui| {
                    ui.set_width(MENU_WIDTH);
                    chosen = main_entries(ui, facts);
                });
            });
        let pressed_elsewhere = context.input(|input| {
            let outside = |at: Pos2| !area.response.rect.contains(at);
            input.pointer.any_pressed() && input.pointer.interact_pos().is_some_and(outside)
        });
        if chosen.is_some() || (pressed_elsewhere && !self.is_new) {
            self.at = None;
        }
        self.is_new = false;
        chosen
    }
}

/// The entries of the thesis's menu, and what belongs to them.
fn main_entries(ui: &mut Ui, facts: &MenuFacts<'_>) -> Option<Action> {
    let mut chosen = None;
    let mut entry = |ui: &mut Ui, action: Action, enabled: bool| {
        if plain_entry(ui, facts, &action, enabled) {
            chosen = Some(action);
        }
    };
    entry(ui, Action::ReadFile, true);
    entry(ui, Action::KeepShape, facts.can_keep);
    entry(ui, Action::UndoKeepShape, facts.can_undo);
    entry(ui, Action::SaveAs, true);
    ui.separator();
    entry(ui, Action::Detach, true);
    entry(ui, Action::ReturnHome, true);
    ui.separator();
    entry(ui, Action::Snapshot, true);
    entry(ui, Action::Record, true);
    ui.separator();
    entry(ui, Action::Exit, true);
    chosen
}

fn plain_entry(ui: &mut Ui, facts: &MenuFacts<'_>, action: &Action, enabled: bool) -> bool {
    let mut label = action.label();
    if *action == Action::Record && facts.is_recording {
        "End recording".clone_into(&mut label);
    }
    let button = Button::new(label.clone())
        .shortcut_text(action.key())
        .frame(false)
        .min_size(Vec2::new(ui.available_width(), 0.0));
    let response = ui.add_enabled(enabled, button);
    // The page of help has the name of the menu that it is in.
    let place = match action {
        Action::Page(_) => format!("page {label}"),
        _ => label,
    };
    places::tell(ui.ctx(), &place, &response);
    response.clicked()
}

/// Shows the bar at the top of the window and returns what was chosen.
pub fn bar(context: &Context, facts: &MenuFacts<'_>) -> Option<Action> {
    let mut chosen = None;
    theme::card(context, "bar", Align2::LEFT_TOP, [theme::MARGIN; 2], |ui| {
        ui.horizontal(|ui| {
            let mut menu =
                |ui: &mut Ui, name: &str, content: &dyn Fn(&mut Ui) -> Option<Action>| {
                    let shown = ui.menu_button(name, |ui| {
                        ui.set_width(MENU_WIDTH);
                        if let Some(action) = content(ui) {
                            chosen = Some(action);
                            ui.close();
                        }
                    });
                    places::tell(ui.ctx(), name, &shown.response);
                };
            menu(ui, "File", &|ui| main_entries(ui, facts));
            menu(ui, "Object", &|ui| objects(ui, facts));
            menu(ui, "Hand", &|ui| hands(ui, facts));
            menu(ui, "Solve", &|ui| methods(ui, facts));
            menu(ui, "View", &|ui| views(ui, facts));
            menu(ui, "Help", &|ui| help(ui, facts));
        });
    });
    chosen
}

fn choice(ui: &mut Ui, action: Action, is_chosen: bool) -> Option<Action> {
    let response = ui.radio(is_chosen, action.label());
    places::tell(ui.ctx(), &action.label(), &response);
    let is_wished = response.clicked();
    if let Action::Method(name) = &action {
        response.on_hover_text(about_method(name));
    }
    is_wished.then_some(action)
}

/// A sentence on what a method does, for a person who does not know its name.
fn about_method(name: &str) -> &'static str {
    match name {
        "auto" => "the server chooses for each question, and F2 tells why",
        "condensed" => "frames from kept columns of the inverse: fast while the fingers stay",
        "front" => "a factor of all equations, in double precision",
        "front-mixed" => "a factor in single precision, refined until it is as good",
        "pcg" => "conjugate gradients: many small steps and no factor",
        _ => "named when the program was started",
    }
}

fn objects(ui: &mut Ui, facts: &MenuFacts<'_>) -> Option<Action> {
    let mut chosen = None;
    for shape in BuiltIn::ALL {
        let action = Action::Open(ObjectChoice::BuiltIn(shape));
        chosen = choice(ui, action, facts.object == shape.to_string()).or(chosen);
    }
    ui.separator();
    if plain_entry(ui, facts, &Action::ReadFile, true) {
        chosen = Some(Action::ReadFile);
    }
    ui.separator();
    let softness = Action::Page(Page::Softness);
    if plain_entry(ui, facts, &softness, true) {
        chosen = Some(softness);
    }
    chosen
}

fn hands(ui: &mut Ui, facts: &MenuFacts<'_>) -> Option<Action> {
    let mut chosen = None;
    let mouse = Action::Hand(HandChoice::Mouse);
    chosen = choice(ui, mouse, facts.hand == HandChoice::Mouse).or(chosen);
    for script in ScriptName::ALL {
        let wish = HandChoice::Scripted(script);
        chosen = choice(ui, Action::Hand(wish), facts.hand == wish).or(chosen);
    }
    chosen
}

/// Shows the menu of methods and accepted errors; returns what was chosen.
pub fn methods(ui: &mut Ui, facts: &MenuFacts<'_>) -> Option<Action> {
    let mut chosen = None;
    ui.label(theme::quiet("Method"));
    // One that was named when the program was started may be none of the usual ones.
    let other = Some(facts.method).filter(|method| !METHODS.contains(method));
    for name in METHODS.into_iter().chain(other) {
        let action = Action::Method(name.to_owned());
        chosen = choice(ui, action, facts.method == name).or(chosen);
    }
    if let Some(solved_by) = facts.solved_by {
        ui.label(theme::quiet(format!("the last answer: {solved_by}")).small());
    }
    ui.separator();
    ui.label(theme::quiet("Error that is accepted"));
    for budget in BUDGETS {
        chosen = choice(ui, Action::MaxError(budget), facts.max_error == budget).or(chosen);
    }
    chosen
}

fn views(ui: &mut Ui, facts: &MenuFacts<'_>) -> Option<Action> {
    let mut chosen = None;
    let display = facts.display;
    ui.label(theme::quiet("Colour"));
    for shading in Shading::ALL {
        let action = Action::Shade(shading);
        chosen = choice(ui, action, display.shading == shading).or(chosen);
    }
    ui.separator();
    for toggle in Toggle::ALL {
        let mut on = display.shows(toggle);
        let text = format!("{}   ({})", toggle.label(), toggle.key());
        let response = ui.checkbox(&mut on, text);
        // A menu has the name of a part, too.
        places::tell(ui.ctx(), &format!("show {}", toggle.label()), &response);
        if response.clicked() {
            chosen = Some(Action::Toggle(toggle));
        }
    }
    for action in [Action::NextSphereLevel, Action::LastSphereLevel] {
        if plain_entry(ui, facts, &action, true) {
            chosen = Some(action);
        }
    }
    ui.separator();
    ui.label(theme::quiet("Light"));
    for level in Level::ALL {
        chosen = choice(ui, Action::Light(level), display.level == level).or(chosen);
    }
    ui.separator();
    if plain_entry(ui, facts, &Action::FrameAll, true) {
        chosen = Some(Action::FrameAll);
    }
    chosen
}

fn help(ui: &mut Ui, facts: &MenuFacts<'_>) -> Option<Action> {
    let mut chosen = None;
    for action in Page::ALL.map(Action::Page) {
        if plain_entry(ui, facts, &action, true) {
            chosen = Some(action);
        }
    }
    chosen
}
