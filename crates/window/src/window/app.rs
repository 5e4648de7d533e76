//! The window: opens, shows picture after picture, and carries out the person's wishes.

use std::time::{Duration, Instant};

use kiss3d::prelude::{CanvasSetup, NumSamples, Window};

use super::drawing_pace::DrawingPace;
use super::graphics::{Graphics, NoGraphics, check_display, without_panic};
use super::lost_display;
use super::scene::Scene;
use super::scene_input::SceneInput;
use super::seen_window::SeenWindow;
use super::shown_view::ShownView;
use super::start::Opening;
use super::start::Start;
use super::window_run::WindowRun;
use crate::view::colouring::Colouring;
use crate::view::display::Level;
use crate::view::object_skin::Look;

/// An open window and what belongs to it.
pub struct App {
    window: Window,
    input: SceneInput,
    run: WindowRun,
    pace: DrawingPace,
    seen_window: SeenWindow,
}

/// Time between two looks whether a window that nobody sees is to be seen again.
const UNSEEN_EVERY: Duration = Duration::from_millis(100);
/// After mouse or keys the picture is drawn as often as ever for so long.
const LIVELY: Duration = Duration::from_secs(2);
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
        let eye_and_shading = (eye_is_chosen, shading_is_chosen);
        let view =
            ShownView::new(scene, camera, display, Colouring::new(material), eye_and_shading);
        Ok(Self {
            window,
            input: SceneInput::new(),
            pace: DrawingPace::of(&graphics),
            run: WindowRun::new(view, graphics, (object, contact, load)),
            seen_window: SeenWindow::titled(TITLE),
        })
    }

    /// Shows the window until it is closed, and asks the run to end; returns whether one began. Where the
    /// display is lost, or the window fails, this does not return: the run goes on to the end of its
    /// script, its report is told, and the process ends.
    ///
    /// # Errors
    /// A sentence, when the run could not begin.
    pub fn show(mut self, start: Start, asked_to_end: impl Fn() -> bool) -> anyhow::Result<bool> {
        self.run.set_start(start);
        let lost = loop {
            if self.run.ends() || asked_to_end() {
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
            return Ok(self.run.stop());
        };
        // Closing a window that cannot be drawn any more would fail as drawing did.
        std::mem::forget(self);
        lost_display::go_on_without(&lost.to_string())
    }

    /// Draws one picture; returns false when the window is closed. A window that is not to be seen is not
    /// drawn.
    fn picture(&mut self) -> anyhow::Result<bool> {
        let Self { window, input, run, pace, seen_window } = self;
        if !seen_window.is_seen() {
            run.begin_when_ready()?;
            run.take_changes();
            run.hear();
            std::thread::sleep(UNSEEN_EVERY);
            return Ok(true);
        }
        input.take_events(window, run);
        run.begin_when_ready()?;
        run.take_changes();
        run.look(window);
        let asked = run.draw_panels(window, pace.fps());
        run.obey(asked, window);
        let (root, camera) = run.view.drawing();
        let is_open = pollster::block_on(window.render_3d(root, camera));
        run.was_seen(window);
        let now = Instant::now();
        pace.rest(!run.is_lively() && now.duration_since(input.touched()) >= LIVELY);
        Ok(is_open)
    }
}
