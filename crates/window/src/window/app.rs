//! The window: opens, shows picture after picture, and obeys who sits before it.

use std::sync::Arc;

use anyhow::{Context as _, bail};
use kiss3d::prelude::{
    Action as Press, CanvasSetup, Key, NumSamples, OrbitCamera3d, Window, WindowEvent,
};
use nalgebra::Vector2;
use softgrasp_grasp::object::{ContactModel, ObjectChoice};
use softgrasp_hand::hand_choice::HandChoice;
use softgrasp_hand::mouse::MouseInput;

use super::changes::{Change, Changed};
use super::drawing_pace::DrawingPace;
use super::finger_keys::FingerKeys;
use super::graphics::{Graphics, NoGraphics, check_display, without_panic};
use super::grips::{Grip, Grips};
use super::input::{DragButton, Gesture, Mouse, wish_of_key};
use super::lost_display;
use super::opening::Opening;
use super::panels::{Asked, Panels, Seen};
use super::recorder::Recordings;
use super::running::Running;
use super::scene::Scene;
use super::stage::{drawn_camera, place_camera};
use super::start::{Start, Started};
use super::ui::dialogs::{Dialog, FileAnswer};
use crate::view::action::Action;
use crate::view::camera::ViewCamera;
use crate::view::colouring::Colouring;
use crate::view::control::Control;
use crate::view::display::{Display, Level};
use crate::view::eye_place::EyePlace;
use crate::view::loading::LoadObject;
use crate::view::object_skin::Look;

/// An open window and what belongs to it.
pub struct App {
    window: Window,
    scene: Scene,
    drawn_camera: OrbitCamera3d,
    camera: ViewCamera,
    display: Display,
    colouring: Colouring,
    panels: Panels,
    mouse: Mouse,
    keys: FingerKeys,
    grips: Grips,
    graphics: Graphics,
    start: Option<Start>,
    running: Option<Running>,
    change: Change,
    object: ObjectChoice,
    contact: ContactModel,
    load: LoadObject,
    recordings: Recordings,
    pace: DrawingPace,
    eye_place: EyePlace,
    /// The person chose where the eye is.
    eye_is_chosen: bool,
    ends: bool,
}

const TITLE: &str = "Softgrasp";
const SIZE: (u32, u32) = (1280, 800);
impl App {
    /// Opens the window.
    ///
    /// # Errors
    /// [`NoGraphics`], in a sentence, where there is no display or nothing draws.
    pub fn open(opening: Opening) -> Result<Self, NoGraphics> {
        check_display()?;
        lost_display::hear();
        Graphics::find()?;
        let mut window = without_panic(|| {
            let setup = CanvasSetup { samples: NumSamples::Four, ..CanvasSetup::default() };
            pollster::block_on(Window::new_with_setup(TITLE, SIZE.0, SIZE.1, setup))
        })?;
        let graphics = Graphics::in_use();
        let Opening {
            mut display,
            camera,
            eye_is_chosen,
            level_is_chosen,
            object,
            contact,
            load,
            material,
        } = opening;
        if graphics.is_software && !level_is_chosen {
            display.level = Level::Plain;
        }
        let mut scene = Scene::new(&mut window);
        scene.set_look(Look::of(&object.to_string()));
        Ok(Self {
            window,
            scene,
            drawn_camera: drawn_camera(),
            camera,
            display,
            colouring: Colouring::new(material),
            panels: Panels::default(),
            mouse: Mouse::default(),
            keys: FingerKeys::default(),
            grips: Grips::default(),
            pace: DrawingPace::of(&graphics),
            graphics,
            start: None,
            running: None,
            change: Change::None,
            object,
            contact,
            load,
            recordings: Recordings::default(),
            eye_place: if eye_is_chosen { EyePlace::Taken } else { EyePlace::AtOnce },
            eye_is_chosen,
            ends: false,
        })
    }

    /// Shows the window until it is closed, and asks the run to end; whether one began. Where the
    /// display is lost the run is asked to go on to the end of its script.
    ///
    /// # Errors
    /// A sentence, when the run could not begin.
    pub fn show(mut self, start: Start, asked_to_end: impl Fn() -> bool) -> anyhow::Result<bool> {
        self.start = Some(start);
        let lost = loop {
            if self.ends || asked_to_end() {
                break None;
            }
            match without_panic(|| self.picture()) {
                Ok(shown) => {
                    if !shown? {
                        break None;
                    }
                }
                Err(lost) => break Some(lost),
            }
        };
        self.pace.tell();
        lost_display::clear_rest();
        let running = self.running.take();
        let Some(lost) = lost else {
            if let Some(running) = &running {
                running.ask(Control::Stop);
            }
            return Ok(running.is_some());
        };
        // Closing a window whose display is gone would fail as drawing did.
        std::mem::forget(self);
        let Some(running) = running else { bail!(lost) };
        eprintln!("glove-client: {lost}; the run goes on without it");
        running.ask(Control::EndWithScript);
        Ok(true)
    }

    /// One picture; false when the window is closed.
    fn picture(&mut self) -> anyhow::Result<bool> {
        self.take_events();
        self.begin_when_ready()?;
        self.take_changes();
        self.look();
        let asked = self.draw_panels();
        self.obey(asked);
        place_camera(&mut self.drawn_camera, &self.camera);
        let (scene, camera) = (&mut self.scene, &mut self.drawn_camera);
        let is_open = pollster::block_on(self.window.render_3d(scene.root(), camera));
        if let Some(running) = &mut self.running {
            running.was_seen();
        }
        self.recordings.add(&self.window);
        self.pace.rest();
        Ok(is_open)
    }

    /// Begins the run as soon as it is ready.
    fn begin_when_ready(&mut self) -> anyhow::Result<()> {
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
        self.ask_for_what_is_shown();
        Ok(())
    }

    /// What is coloured by strain or stress needs the nodes inside.
    fn ask_for_what_is_shown(&self) {
        if let Some(running) = &self.running {
            running.ask(Control::SetWhole(self.display.shading.needs_inside()));
        }
    }

    fn take_changes(&mut self) {
        match (self.change.take(), &mut self.running) {
            (Some(Changed::Object(loaded, choice)), Some(running)) => {
                self.scene.set_look(Look::of(&choice.to_string()));
                running.about.object = choice.to_string();
                self.object = choice;
                running.look_at_newest();
                if let (Some(frame), false) = (running.newest(), self.eye_is_chosen) {
                    self.eye_place = EyePlace::after(frame);
                }
                running.ask(Control::ReplaceObject(loaded));
                self.panels.sliders.open();
            }
            (Some(Changed::Hand(control, wish)), Some(running)) => {
                running.ask(control);
                running.hand_is(wish);
                self.panels.sliders.open();
            }
            (Some(Changed::Failed(text)), _) => self.panels.notices.add(text, true),
            (Some(_) | None, _) => {}
        }
    }

    /// Takes what has come from the ticks, and shows it.
    fn look(&mut self) {
        let Some(running) = &mut self.running else { return };
        let arrived = running.look();
        self.panels.timings.add(&arrived.timings);
        for (text, is_refusal) in arrived.sentences {
            self.panels.notices.add(text, is_refusal);
        }
        if running.is_over() {
            self.ends = true;
        }
        let Some(frame) = running.frame() else { return };
        let frame = Arc::clone(frame);
        if let Some(eye) = self.eye_place.eye(&frame) {
            self.camera = eye;
        }
        self.colouring.follow(&frame.object, self.display.shading, frame.at_s);
        self.scene.follow(&mut self.window, &frame, &self.display, &self.colouring);
    }

    fn draw_panels(&mut self) -> Asked {
        let object = self.object.to_string();
        let seen = Seen {
            running: self.running.as_ref(),
            display: &self.display,
            colouring: &self.colouring,
            change: &self.change,
            starting: self.start.as_ref().map(|start| (start.step(), object.as_str())),
            graphics: (&self.graphics.name, self.pace.fps()),
            is_recording: self.recordings.is_recording(),
            newtons_per_m: self.scene.newtons_per_m(),
        };
        let mut asked = Asked::default();
        let panels = &mut self.panels;
        self.window.draw_ui(|context| asked = panels.show(context, &seen));
        asked
    }

    /// Does what was asked for on the panels.
    fn obey(&mut self, asked: Asked) {
        for input in asked.mouse {
            self.move_hand(input);
        }
        for action in asked.actions {
            self.act(action);
        }
        if let Some(file) = asked.file {
            self.take_file(file);
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
    fn act(&mut self, action: Action) {
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
            Action::Light(level) => self.display.level = level,
            Action::Shade(shading) => {
                self.display.shading = shading;
                self.ask_for_what_is_shown();
            }
            Action::NextShading => {
                self.display.next_shading();
                self.ask_for_what_is_shown();
            }
            Action::NextSphereLevel => {
                let levels = self
                    .running
                    .as_ref()
                    .and_then(Running::newest)
                    .map_or(1, |frame| frame.object.rest.tree().depth());
                self.display.next_spheres(levels);
            }
            Action::FrameAll => self.frame_all(),
            Action::Open(choice) => self.open_object(choice),
            other => self.act_on_run(other),
        }
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
                    self.change = Change::hand(wish, rest, self.contact, tick_s);
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

    fn open_object(&mut self, choice: ObjectChoice) {
        match Change::object(Arc::clone(&self.load), choice) {
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

    fn frame_all(&mut self) {
        let Some(frame) = self.running.as_ref().and_then(Running::frame) else { return };
        let sphere = frame.object.rest.tree().bounding_sphere();
        let centre = frame.object.world_from_object * sphere.centre;
        self.camera.frame(centre, 1.7 * sphere.radius);
    }

    fn move_hand(&self, input: MouseInput) {
        if let Some(running) = &self.running {
            running.ask(Control::Mouse(input));
        }
    }

    /// Takes mouse and keys.
    fn take_events(&mut self) {
        let mut events: Vec<WindowEvent> = Vec::new();
        let ctrl = [Key::LControl, Key::RControl]
            .into_iter()
            .any(|key| self.window.get_key(key) == Press::Press);
        for mut event in self.window.events().iter() {
            // A shortcut is no letter.
            event.inhibited |= ctrl && matches!(event.value, WindowEvent::Char(_));
            events.push(event.value);
        }
        let on_panel = self.window.is_egui_capturing_mouse();
        // What is typed into a dialog is not meant for the scene.
        let typing = self.window.is_egui_capturing_keyboard() || !self.panels.dialog.is_closed();
        for event in events {
            if let Some(gesture) = self.mouse.take(&event, on_panel) {
                self.follow(gesture);
            }
            match event {
                WindowEvent::Close => self.ends = true,
                WindowEvent::Key(key, press, modifiers) => {
                    let is_first = self.keys.take(key, press, modifiers, typing);
                    if is_first && !typing {
                        self.take_key(key, modifiers);
                    }
                }
                _ => {}
            }
        }
        let is_mouse = self.running.as_ref().is_some_and(|r| r.about.hand == HandChoice::Mouse);
        if is_mouse {
            let axes = self.camera.axes();
            for input in self.keys.inputs(axes) {
                if let MouseInput::CloseBy(digits, by) = input {
                    self.panels.sliders.step(digits, by);
                    self.panels.hide_hint();
                }
                self.move_hand(input);
            }
        }
    }

    fn take_key(&mut self, key: Key, modifiers: kiss3d::prelude::Modifiers) {
        let is_mouse = self.running.as_ref().is_some_and(|r| r.about.hand == HandChoice::Mouse);
        match key {
            Key::Escape if self.panels.escape() => {}
            Key::Tab if is_mouse => {
                self.panels.sliders.open();
                self.move_hand(MouseInput::AimElsewhere);
            }
            _ => {
                if let Some(action) = wish_of_key(key, modifiers) {
                    self.act(action);
                }
            }
        }
    }

    /// Does what the mouse did to the scene.
    fn follow(&mut self, gesture: Gesture) {
        match gesture {
            Gesture::MenuAsked(at) => {
                let panels = &mut self.panels;
                self.window.draw_ui(|context| panels.open_menu(context, at));
            }
            Gesture::DoubleClicked => self.frame_all(),
            Gesture::Began(DragButton::Left, at) => {
                let grip = self.grip_at(at);
                self.grips.begin(grip);
            }
            Gesture::Began(DragButton::Middle, _) => self.grips.begin(Grip::Pan),
            Gesture::Ended => self.grips.end(),
            Gesture::Dragged(_, by, shift) => {
                let height = f64::from(self.window.height().max(1));
                let wish = self.grips.drag(&mut self.camera, by / height, shift);
                if let (Some(control), Some(running)) = (wish, &self.running) {
                    running.ask(control);
                }
            }
            Gesture::Scrolled(notches, at) => {
                if self.grip_at(at) == Grip::Hand {
                    let [_, _, towards_eye] = self.camera.axes();
                    self.move_hand(MouseInput::Move(towards_eye * (-0.006 * notches)));
                } else {
                    self.camera.zoom(notches);
                }
            }
        }
    }

    /// What a drag that begins at a place in the window moves.
    fn grip_at(&self, at: Vector2<f64>) -> Grip {
        let Some(running) = &self.running else { return Grip::View };
        let Some(frame) = running.frame().filter(|_| running.about.hand == HandChoice::Mouse)
        else {
            return Grip::View;
        };
        let size = Vector2::new(self.window.width(), self.window.height()).map(f64::from);
        Grip::at(frame, &self.camera, at, size)
    }
}
