//! The window: opens, shows picture after picture, and obeys who sits before it.

use std::sync::Arc;
use std::time::Instant;

use anyhow::Context as _;
use kiss3d::prelude::{CanvasSetup, NumSamples, OrbitCamera3d, Window};
use softgrasp_grasp::object::{ContactModel, ObjectChoice};
use softgrasp_hand::hand_choice::HandChoice;
use softgrasp_hand::mouse::MouseInput;

use super::changes::{Change, Changed};
use super::director::Director;
use super::drawing_pace::DrawingPace;
use super::finger_keys::FingerKeys;
use super::graphics::{Graphics, NoGraphics, check_display, without_panic};
use super::grips::Grips;
use super::input::Mouse;
use super::lost_display;
use super::opening::Opening;
use super::panels::{Asked, Panels, Seen};
use super::recorder::Recordings;
use super::running::Running;
use super::scene::Scene;
use super::seen_window::SeenWindow;
use super::stage::{drawn_camera, place_camera};
use super::start::{Start, Started};
use super::story::Story;
use super::ui::dialogs::Dialog;
use crate::view::camera::ViewCamera;
use crate::view::colouring::Colouring;
use crate::view::control::Control;
use crate::view::display::{Display, Level};
use crate::view::eye_place::EyePlace;
use crate::view::frame::ViewFrame;
use crate::view::loading::LoadObject;
use crate::view::object_skin::Look;

/// An open window and what belongs to it.
pub struct App {
    pub(super) window: Window,
    pub(super) scene: Scene,
    pub(super) drawn_camera: OrbitCamera3d,
    pub(super) camera: ViewCamera,
    pub(super) display: Display,
    pub(super) colouring: Colouring,
    pub(super) panels: Panels,
    pub(super) mouse: Mouse,
    pub(super) keys: FingerKeys,
    pub(super) grips: Grips,
    pub(super) graphics: Graphics,
    pub(super) start: Option<Start>,
    pub(super) running: Option<Running>,
    pub(super) change: Change,
    pub(super) object: ObjectChoice,
    pub(super) contact: ContactModel,
    pub(super) load: LoadObject,
    pub(super) recordings: Recordings,
    pub(super) pace: DrawingPace,
    pub(super) eye_place: EyePlace,
    /// What is left to the window.
    pub(super) director: Director,
    pub(super) ends: bool,
    pub(super) story: Story,
    /// Answers were asked to hold the nodes inside.
    asked_whole: bool,
    /// When the person moved mouse or keys last.
    pub(super) touched: Instant,
    seen_window: SeenWindow,
    /// The hand that the person takes goes to the object at once.
    pub(super) reaches: bool,
    /// The hand was asked to go to the object, and nothing has been heard of it yet.
    pub(super) asked_to_reach: Option<Instant>,
}

/// A window that nobody sees looks so often whether it is seen again.
const UNSEEN_EVERY: std::time::Duration = std::time::Duration::from_millis(100);
/// After mouse or keys the picture is drawn as often as ever for so long.
const LIVELY: std::time::Duration = std::time::Duration::from_secs(2);
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
            shading_is_chosen,
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
            director: Director::new(eye_is_chosen, shading_is_chosen),
            ends: false,
            story: Story::default(),
            asked_whole: false,
            touched: Instant::now(),
            seen_window: SeenWindow::titled(TITLE),
            reaches: false,
            asked_to_reach: None,
        })
    }

    /// Shows the window until it is closed, and asks the run to end; whether one began. Where the
    /// display is lost, or the window fails, this does not return: the run goes on to the end of its
    /// script, its report is told, and the process ends.
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
        let Some(lost) = lost else {
            lost_display::clear_rest();
            let running = self.running.take();
            if let Some(running) = &running {
                running.ask(Control::Stop);
            }
            return Ok(running.is_some());
        };
        // Closing a window that cannot be drawn any more would fail as drawing did.
        std::mem::forget(self);
        lost_display::go_on_without(&lost.to_string())
    }

    /// One picture; false when the window is closed. A window that is not to be seen is not drawn.
    fn picture(&mut self) -> anyhow::Result<bool> {
        if !self.seen_window.is_seen() {
            return self.without_picture();
        }
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
        self.pace.rest(!self.is_lively());
        Ok(is_open)
    }

    /// Goes on while nobody sees the window.
    fn without_picture(&mut self) -> anyhow::Result<bool> {
        self.begin_when_ready()?;
        self.take_changes();
        if let Some(running) = &mut self.running {
            let arrived = running.look();
            self.panels.timings.add(&arrived.timings);
            for (text, is_refusal) in arrived.sentences {
                self.panels.notices.add(text, is_refusal);
            }
            self.ends |= running.is_over();
        }
        std::thread::sleep(UNSEEN_EVERY);
        Ok(true)
    }

    /// Whether something moves in the picture: the hand, or the person's.
    fn is_lively(&self) -> bool {
        let moves = self.running.as_ref().is_none_or(|running| !running.is_paused());
        moves || self.touched.elapsed() < LIVELY || self.recordings.is_recording()
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
        Ok(())
    }

    fn take_changes(&mut self) {
        match (self.change.take(), &mut self.running) {
            (Some(Changed::Object(loaded, choice)), Some(running)) => {
                self.scene.set_look(Look::of(&choice.to_string()));
                running.object_is(choice.to_string());
                self.object = choice;
                if let (Some(frame), true) = (running.newest(), self.director.has_eye()) {
                    self.eye_place = EyePlace::after(frame);
                }
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
        self.follow_story(&frame);
        self.direct(&frame);
        self.colouring.follow(&frame.object, self.display.shading, frame.at_s);
        self.scene.follow(&mut self.window, &frame, &self.display, &self.colouring);
    }

    /// Shows what is left to the window.
    fn direct(&mut self, frame: &ViewFrame) {
        if frame.acts.squeezing.is_some() {
            self.eye_place = EyePlace::Taken;
        }
        let placed = self.director.eye(frame, self.camera);
        if let Some(eye) = placed.or_else(|| self.eye_place.eye(frame)) {
            self.camera = eye;
        }
        let hand = self.running.as_ref().map(|running| running.about.hand);
        let is_directed = matches!(hand, Some(HandChoice::Scripted(_) | HandChoice::Mouse));
        if let Some(shading) = self.director.shading(frame, is_directed) {
            self.display.shading = shading;
        }
        let whole = self.display.shading.needs_inside()
            || (is_directed && self.director.directs_colours(frame));
        if self.asked_whole != whole
            && let Some(running) = &self.running
        {
            self.asked_whole = whole;
            running.ask(Control::SetWhole(whole));
        }
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
            story_begins_in: self.story.begins_in(Instant::now()),
        };
        let mut asked = Asked::default();
        let panels = &mut self.panels;
        self.window.draw_ui(|context| asked = panels.show(context, &seen));
        asked
    }
}
