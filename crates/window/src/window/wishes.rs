//! What a person asked for by menu, panel or key, and the window does.

use std::sync::Arc;
use std::time::{Duration, Instant};

use softgrasp_core::fem::Material as ElasticMaterial;
use softgrasp_grasp::object::ObjectChoice;
use softgrasp_hand::hand_choice::HandChoice;
use softgrasp_hand::mouse::MouseInput;
use softgrasp_protocol::Material;

use super::app::App;
use super::changes::Change;
use super::panels::Asked;
use super::running::Running;
use super::ui::dialogs::{Dialog, FileAnswer};
use super::ui::softness_card::SoftnessWish;
use crate::view::action::Action;
use crate::view::control::Control;
use crate::view::display::Level;
use crate::view::frame::ViewFrame;
use crate::view::loading::ObjectWish;

/// A hand that was asked to go somewhere is on its way within this time.
const HEARD_WITHIN: Duration = Duration::from_secs(1);

impl App {
    /// Does what was asked for on the panels.
    pub(super) fn obey(&mut self, asked: Asked) {
        for input in asked.mouse {
            self.move_hand(input);
        }
        for action in asked.actions {
            self.act(action);
        }
        if let Some(file) = asked.file {
            self.take_file(file);
        }
        match asked.softness {
            Some(SoftnessWish::Material { young, poisson }) => self.set_material(young, poisson),
            Some(SoftnessWish::Object { nodes, size_m }) => self.open_object(ObjectWish {
                choice: self.object.clone(),
                nodes,
                size_m: Some(size_m),
            }),
            None => {}
        }
        if asked.takes_hand {
            self.take_hand();
        }
        let Some(running) = &mut self.running else {
            // Nothing runs yet: who does not want the object does not want the window.
            self.ends |= asked.cancel;
            return;
        };
        if asked.cancel {
            self.change = Change::None;
            self.panels.notices.add("loading was cancelled", false);
        }
        if let Some(tick) = asked.look_at {
            running.look_at(tick);
        }
        if asked.newest {
            running.look_at_newest();
        }
    }

    /// Does one thing that a person asked for.
    pub(super) fn act(&mut self, action: Action) {
        // For those who drive the window by a program: this was heard.
        tracing::debug!(target: "softgrasp_window::places", wish = action.label());
        match action {
            Action::Exit => self.ends = true,
            Action::ReadFile => self.panels.dialog = Dialog::read(),
            Action::SaveAs => {
                let name = self.running.as_ref().map_or("object", |r| r.about.object.as_str());
                self.panels.dialog = Dialog::save(name);
            }
            Action::Snapshot => {
                let said = self.recordings.snapshot(&self.window);
                self.panels.notices.add_result(said);
            }
            Action::Record => {
                let said = self.recordings.begin_or_end();
                self.panels.notices.add_result(said);
            }
            Action::Page(page) => self.panels.toggle(page),
            Action::Toggle(toggle) => self.display.toggle(toggle),
            Action::Light(level) => self.set_light(level),
            Action::Shade(shading) => {
                self.display.shading = shading;
                self.director.shading_is_chosen();
            }
            Action::NextShading => {
                self.display.next_shading();
                self.director.shading_is_chosen();
            }
            Action::NextSphereLevel => self.display.next_spheres(self.sphere_levels()),
            Action::LastSphereLevel => self.display.last_spheres(self.sphere_levels()),
            Action::FrameAll => self.frame_all(),
            Action::Open(choice) => self.open_object(choice),
            other => self.act_on_run(other),
        }
    }

    /// Makes the object of another material.
    ///
    /// Units: `young` Pa.
    fn set_material(&mut self, young: f64, poisson: f64) {
        let (Some(running), Ok(material)) =
            (&mut self.running, ElasticMaterial::try_new(young, poisson))
        else {
            return;
        };
        running.about.material = material;
        self.colouring.set_material(material);
        running.ask(Control::SetMaterial(Material { young, poisson }));
    }

    fn set_light(&mut self, level: Level) {
        self.display.level = level;
        if let Some(price) = self.graphics.price_of(level) {
            self.panels.notices.add(price, false);
        }
    }

    fn sphere_levels(&self) -> usize {
        let newest = self.running.as_ref().and_then(Running::newest);
        newest.map_or(1, |frame| frame.object.rest.tree().depth())
    }

    /// What concerns the ticks.
    fn act_on_run(&mut self, action: Action) {
        let Some(running) = &mut self.running else { return };
        match action {
            Action::KeepShape => running.ask(Control::KeepShape),
            Action::UndoKeepShape => running.ask(Control::UndoKeepShape),
            Action::Detach => running.ask(Control::Detach),
            Action::ReturnHome => running.ask(Control::ReturnHome),
            Action::MaxError(max_error) => running.set_max_error(max_error),
            Action::Method(name) => {
                if let Err(text) = running.set_method(&name) {
                    self.panels.notices.add(text, true);
                }
            }
            Action::Hand(wish) => {
                if let Some(frame) = running.newest() {
                    let (rest, tick_s) = (Arc::clone(&frame.object.rest), running.about.tick_s);
                    let palm = frame.hand.as_ref().map(|hand| hand.world_from_palm);
                    self.change = Change::hand(wish, rest, self.contact, tick_s, palm);
                }
            }
            Action::PlayOrPause | Action::Step | Action::Restart
                if running.about.hand == HandChoice::Mouse =>
            {
                self.panels.notices.add("a hand that a person moves cannot be paused", true);
            }
            Action::PlayOrPause => running.play_or_pause(),
            Action::Step => running.step(),
            Action::Restart => running.restart(),
            _ => {}
        }
    }

    /// The person takes the hand of a script: it goes to the object at once.
    pub(super) fn take_hand(&mut self) {
        if matches!(self.change, Change::None) {
            self.reaches = true;
            self.act(Action::Hand(HandChoice::Mouse));
        }
    }

    /// Does what a script that comes to its end asks for.
    pub(super) fn follow_story(&mut self, frame: &ViewFrame) {
        let Some(running) = &mut self.running else { return };
        let now = Instant::now();
        let is_over = frame.acts.story_is_over && !running.has_begun_anew(frame);
        let ends = self.story.follow(is_over && running.about.hand.is_played(), now);
        if !running.about.begins_anew {
            return;
        }
        if ends {
            running.stand_at_end();
        }
        if !self.panels.dialog.is_closed() || running.looked_at().is_some() {
            self.story.was_touched(now);
        } else if self.story.begins_now(now) {
            tracing::info!("the script begins anew");
            running.restart();
        }
    }

    /// Whether the hand goes somewhere by itself, and takes no other wish.
    pub(super) fn hand_is_on_its_way(&mut self) -> bool {
        let newest = self.running.as_ref().and_then(Running::newest);
        let goes = newest.is_some_and(|frame| frame.acts.is_on_its_way);
        if goes || self.asked_to_reach.is_some_and(|then| then.elapsed() > HEARD_WITHIN) {
            self.asked_to_reach = None;
        }
        goes || self.asked_to_reach.is_some()
    }

    fn open_object(&mut self, wish: impl Into<ObjectWish>) {
        match Change::object(Arc::clone(&self.load), wish.into()) {
            Ok(change) => self.change = change,
            Err(text) => self.panels.notices.add(text, true),
        }
    }

    fn take_file(&mut self, answer: FileAnswer) {
        match answer {
            FileAnswer::Read(path) => self.open_object(ObjectChoice::File(path)),
            FileAnswer::Save(path) => {
                if let Some(running) = &self.running {
                    running.save(path);
                }
            }
        }
    }

    pub(super) fn frame_all(&mut self) {
        let Some(frame) = self.running.as_ref().and_then(Running::frame) else { return };
        let sphere = frame.object.rest.tree().bounding_sphere();
        let centre = frame.object.world_from_object * sphere.centre;
        self.director.eye_is_chosen();
        self.camera.frame(centre, 1.7 * sphere.radius);
    }

    pub(super) fn move_hand(&self, input: MouseInput) {
        if let Some(running) = &self.running {
            running.ask(Control::Mouse(input));
        }
    }
}
