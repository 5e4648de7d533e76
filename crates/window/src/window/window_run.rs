//! The run in a window: what a person asked for by menu, panel or key is carried out.

use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::Context as _;
use kiss3d::prelude::Window;
use softgrasp_core::fem::Material as ElasticMaterial;
use softgrasp_grasp::object::{ContactModel, ObjectChoice};
use softgrasp_hand::hand_request::HandChoice;
use softgrasp_hand::mouse::MouseInput;
use softgrasp_protocol::Material;

use super::changes::{Change, Changed};
use super::graphics::Graphics;
use super::lost_display;
use super::panels::{Asked, Panels, Seen};
use super::recorder::Recordings;
use super::running::Running;
use super::shown_view::ShownView;
use super::start::{Start, Started};
use super::story::Story;
use super::ui::dialogs::{Dialog, FileAnswer};
use super::ui::softness_card::SoftnessWish;
use crate::view::action::Action;
use crate::view::control::Control;
use crate::view::display::Level;
use crate::view::frame::ViewFrame;
use crate::view::loading::{LoadObject, ObjectWish};
use crate::view::object_skin::Look;

/// Time within which a hand that was asked to go somewhere is on its way.
const HEARD_WITHIN: Duration = Duration::from_secs(1);

/// The run in a window, from its start on, and the panels that tell of it.
pub(super) struct WindowRun {
    start: Option<Start>,
    running: Option<Running>,
    change: Change,
    object: ObjectChoice,
    contact: ContactModel,
    load: LoadObject,
    graphics: Graphics,
    recordings: Recordings,
    story: Story,
    /// Whether answers were asked to hold the nodes inside.
    asked_whole: bool,
    /// Whether the hand that the person takes goes to the object at once.
    reaches: bool,
    /// When the hand was asked to go to the object, as long as nothing has been heard of that.
    asked_to_reach: Option<Instant>,
    ends: bool,
    pub(super) panels: Panels,
    pub(super) view: ShownView,
}

impl WindowRun {
    /// A window in which no run has begun yet.
    pub(super) fn new(
        view: ShownView,
        graphics: Graphics,
        (object, contact, load): (ObjectChoice, ContactModel, LoadObject),
    ) -> Self {
        Self {
            start: None,
            running: None,
            change: Change::None,
            object,
            contact,
            load,
            graphics,
            recordings: Recordings::default(),
            story: Story::default(),
            asked_whole: false,
            reaches: false,
            asked_to_reach: None,
            ends: false,
            panels: Panels::default(),
            view,
        }
    }

    /// Sets the run that begins as soon as it is ready.
    pub(super) fn set_start(&mut self, start: Start) {
        self.start = Some(start);
    }

    /// Begins the run as soon as it is ready.
    ///
    /// # Errors
    /// The reason why the run could not begin.
    pub(super) fn begin_when_ready(&mut self) -> anyhow::Result<()> {
        let Some(start) = &self.start else { return Ok(()) };
        let Some(started) = start.take() else { return Ok(()) };
        self.start = None;
        let Started { play, inlet, about } = started?;
        let ticks = play().context("cannot start the thread of the ticks")?;
        let mut running = Running::new(ticks, inlet, about);
        running.ask(Control::SetForces(true));
        if let Some(when_lost) = running.when_lost() {
            lost_display::set_rest(when_lost);
        }
        self.running = Some(running);
        Ok(())
    }

    /// Asks the run to end; returns whether one began.
    pub(super) fn stop(&mut self) -> bool {
        let running = self.running.take();
        if let Some(running) = &running {
            running.ask(Control::Stop);
        }
        running.is_some()
    }

    /// Lets the window close after this picture.
    pub(super) fn end(&mut self) {
        self.ends = true;
    }

    pub(super) fn ends(&self) -> bool {
        self.ends
    }

    /// Kind of the hand that acts, once the run has begun.
    pub(super) fn hand(&self) -> Option<HandChoice> {
        self.running.as_ref().map(|running| running.about.hand)
    }

    /// View of the tick that is shown.
    pub(super) fn frame(&self) -> Option<&Arc<ViewFrame>> {
        self.running.as_ref().and_then(Running::frame)
    }

    pub(super) fn ask(&self, control: Control) {
        if let Some(running) = &self.running {
            running.ask(control);
        }
    }

    pub(super) fn move_hand(&self, input: MouseInput) {
        self.ask(Control::Mouse(input));
    }

    /// Notes that the person has moved mouse or keys.
    pub(super) fn was_touched(&mut self, now: Instant) {
        self.story.was_touched(now);
    }

    /// Whether something moves in the picture, or is recorded.
    pub(super) fn is_lively(&self) -> bool {
        let moves = self.running.as_ref().is_none_or(|running| !running.is_paused());
        moves || self.recordings.is_recording()
    }

    /// Notes that the picture has been drawn.
    pub(super) fn was_seen(&mut self, window: &Window) {
        if let Some(running) = &mut self.running {
            running.was_seen();
        }
        self.recordings.add(window);
    }

    /// Takes what has been loaded or opened beside the pictures.
    pub(super) fn take_changes(&mut self) {
        match (self.change.take(), &mut self.running) {
            (Some(Changed::Object(loaded, choice)), Some(running)) => {
                self.view.scene_mut().set_look(Look::of(&choice.to_string()));
                running.object_is(choice.to_string());
                self.object = choice;
                self.view.meet_object(running.newest());
                running.ask(Control::ReplaceObject(loaded));
                self.panels.sliders.open();
            }
            (Some(Changed::Hand(control, wish)), Some(running)) => {
                running.ask(control);
                running.hand_is(wish);
                self.panels.sliders.open();
                if wish == HandChoice::Mouse && std::mem::take(&mut self.reaches) {
                    running.ask(Control::Mouse(MouseInput::Reach));
                    self.asked_to_reach = Some(Instant::now());
                }
            }
            (Some(Changed::Refused(path, text)), _) => {
                self.panels.notices.add(text.clone(), true);
                self.panels.dialog = Dialog::read_again(&path, text);
            }
            (Some(Changed::Failed(text)), _) => self.panels.notices.add(text, true),
            (Some(_) | None, _) => {}
        }
    }

    /// Takes what has come from the ticks.
    pub(super) fn hear(&mut self) {
        let Some(running) = &mut self.running else { return };
        let arrived = running.look();
        self.panels.timings.add(&arrived.timings);
        for (text, is_refusal) in arrived.sentences {
            self.panels.notices.add(text, is_refusal);
        }
        self.ends |= running.is_over();
    }

    /// Shows what has come from the ticks.
    pub(super) fn look(&mut self, window: &mut Window) {
        self.hear();
        let Some(frame) = self.frame().map(Arc::clone) else { return };
        self.follow_story(&frame);
        let whole = self.view.direct(&frame, self.hand());
        if self.asked_whole != whole {
            self.asked_whole = whole;
            self.ask(Control::SetWhole(whole));
        }
        self.view.follow(window, &frame);
    }

    /// Draws the panels; returns what a person asks for on them.
    ///
    /// Units: `fps` pictures in a second.
    pub(super) fn draw_panels(&mut self, window: &mut Window, fps: f64) -> Asked {
        let object = self.object.to_string();
        let seen = Seen {
            running: self.running.as_ref(),
            display: &self.view.display,
            colouring: &self.view.colouring,
            change: &self.change,
            starting: self.start.as_ref().map(|start| (start.step(), object.as_str())),
            graphics: (&self.graphics.name, fps),
            is_recording: self.recordings.is_recording(),
            newtons_per_m: self.view.scene().newtons_per_m(),
            story_begins_in: self.story.begins_in(Instant::now()),
        };
        let mut asked = Asked::default();
        let panels = &mut self.panels;
        window.draw_ui(|context| asked = panels.show(context, &seen));
        asked
    }

    /// Carries out what was asked for on the panels.
    pub(super) fn obey(&mut self, asked: Asked, window: &Window) {
        for input in asked.mouse {
            self.move_hand(input);
        }
        for action in asked.actions {
            self.act(action, window);
        }
        if let Some(file) = asked.file {
            self.take_file(file);
        }
        match asked.softness {
            Some(SoftnessWish::Material { young, poisson }) => self.set_material(young, poisson),
            Some(SoftnessWish::Object { nodes, size_m }) => self.open_object(ObjectWish {
                choice: self.changed_object(),
                nodes,
                size_m: Some(size_m),
            }),
            None => {}
        }
        if asked.takes_hand {
            self.take_hand(window);
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

    /// Carries out one wish of the person.
    pub(super) fn act(&mut self, action: Action, window: &Window) {
        // For those who drive the window by a program: this was heard.
        tracing::debug!(target: "softgrasp_window::places", wish = action.label());
        match action {
            Action::Exit => self.ends = true,
            Action::ReadFile => self.panels.dialog = Dialog::read(),
            Action::SaveAs => {
                let name = self.running.as_ref().map_or("object", |r| r.object_name());
                self.panels.dialog = Dialog::save(name);
            }
            Action::Snapshot => {
                let said = self.recordings.snapshot(window);
                self.panels.notices.add_result(said);
            }
            Action::Record => {
                let said = self.recordings.begin_or_end();
                self.panels.notices.add_result(said);
            }
            Action::Page(page) => self.panels.toggle(page),
            Action::Toggle(toggle) => self.view.display.toggle(toggle),
            Action::Light(level) => self.set_light(level),
            Action::Shade(shading) => self.view.shade(Some(shading)),
            Action::NextShading => self.view.shade(None),
            Action::NextSphereLevel => self.view.display.next_spheres(self.sphere_levels()),
            Action::LastSphereLevel => self.view.display.last_spheres(self.sphere_levels()),
            Action::FrameAll => self.frame_all(),
            Action::Open(choice) => self.open_object(choice),
            other => self.act_on_run(other),
        }
    }

    /// The object that is shown and can be made of another size; of several that which was touched last.
    fn changed_object(&self) -> ObjectChoice {
        let named = self.running.as_ref().and_then(|running| running.object_name().parse().ok());
        named.unwrap_or_else(|| self.object.clone())
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
        self.view.colouring.set_material(material);
        running.ask(Control::SetMaterial(Material { young, poisson }));
    }

    fn set_light(&mut self, level: Level) {
        self.view.display.level = level;
        if let Some(price) = self.graphics.price_of(level) {
            self.panels.notices.add(price, false);
        }
    }

    fn sphere_levels(&self) -> usize {
        let newest = self.running.as_ref().and_then(Running::newest);
        newest.map_or(1, |frame| frame.object.rest.tree().depth())
    }

    /// Carries out a wish that concerns the ticks.
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

    /// Gives the hand of a script to the person: it goes to the object at once.
    pub(super) fn take_hand(&mut self, window: &Window) {
        if matches!(self.change, Change::None) {
            self.reaches = true;
            self.act(Action::Hand(HandChoice::Mouse), window);
        }
    }

    /// Carries out what a script that comes to its end asks for.
    fn follow_story(&mut self, frame: &ViewFrame) {
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
        if let Some(frame) = self.running.as_ref().and_then(Running::frame) {
            self.view.frame_all(frame);
        }
    }
}
