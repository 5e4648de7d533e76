//! All menus, cards and dialogs of one picture, and what was asked for on them.

use egui::Context;
use nalgebra::Vector2;
use softgrasp_hand::hand_choice::HandChoice;
use softgrasp_hand::mouse::MouseInput;

use super::changes::Change;
use super::running::Running;
use super::ui::dialogs::{Dialog, FileAnswer};
use super::ui::hand_card::FingerSliders;
use super::ui::information_card::{self, RunFacts};
use super::ui::legend_card::{self, LegendText};
use super::ui::menu::{self, MenuFacts, PopUp};
use super::ui::notices::Notices;
use super::ui::status_card::{self, Told};
use super::ui::timeline::{self, Playing, TimelineWish};
use super::ui::timings_card::Timings;
use super::ui::{help_card, loading_card, theme};
use crate::view::action::Action;
use crate::view::colouring::Colouring;
use crate::view::display::Display;
use crate::view::shading::Shading;
use crate::view::toggle::Page;

/// What lies over the scene, from picture to picture.
#[derive(Default)]
pub struct Panels {
    pop_up: PopUp,
    /// The dialog that is open.
    pub dialog: Dialog,
    /// Sentences on the screen.
    pub notices: Notices,
    /// The newest times.
    pub timings: Timings,
    /// How far the fingers of the mouse hand are to be closed.
    pub sliders: FingerSliders,
    help: bool,
    information: bool,
    shows_timings: bool,
    /// The first-run hint, until it has been seen.
    hint_gone: bool,
    is_set_up: bool,
}

/// What was asked for.
#[derive(Default)]
pub struct Asked {
    /// Wishes.
    pub actions: Vec<Action>,
    /// Wishes to the mouse hand.
    pub mouse: Vec<MouseInput>,
    /// A file that was named.
    pub file: Option<FileAnswer>,
    /// A tick to look at.
    pub look_at: Option<u64>,
    /// The newest tick is to be looked at again.
    pub newest: bool,
    /// What is being loaded is not wanted any more.
    pub cancel: bool,
}

/// What the panels show.
pub struct Seen<'a> {
    /// The run, once it is there.
    pub running: Option<&'a Running>,
    /// What is shown of the scene.
    pub display: &'a Display,
    /// Colours and legend.
    pub colouring: &'a Colouring,
    /// What is being changed.
    pub change: &'a Change,
    /// What is being done before the run begins, and the name of the object.
    pub starting: Option<(usize, &'a str)>,
    /// What draws, and how many pictures a second.
    pub graphics: (&'a str, f64),
    /// Whether pictures are being written.
    pub is_recording: bool,
    /// Force that a metre of arrow stands for, N/m.
    pub newtons_per_m: f64,
}

/// The hint goes after so many ticks of a hand that is played.
const HINT_TICKS: u64 = 900;

impl Panels {
    /// Opens the pop-up menu at a place, pixels.
    pub fn open_menu(&mut self, context: &Context, at: Vector2<f64>) {
        let scale = context.pixels_per_point();
        self.pop_up.open(egui::Pos2::new(at.x as f32 / scale, at.y as f32 / scale));
    }

    /// Whether a page or dialog is open that Escape closes; closes it.
    pub fn escape(&mut self) -> bool {
        let was_open = self.pop_up.is_open() || self.help || !self.dialog.is_closed();
        self.pop_up.close();
        self.help = false;
        self.dialog = Dialog::Closed;
        was_open
    }

    /// Shows a page, or does not any more.
    pub fn toggle(&mut self, page: Page) {
        match page {
            Page::Help => self.help = !self.help,
            Page::Information => self.information = !self.information,
            Page::Timings => self.shows_timings = !self.shows_timings,
        }
        self.hint_gone |= page == Page::Help;
    }

    /// The hint has been understood.
    pub fn hide_hint(&mut self) {
        self.hint_gone = true;
    }

    /// Draws everything that lies over the scene.
    pub fn show(&mut self, context: &Context, seen: &Seen<'_>) -> Asked {
        if !std::mem::replace(&mut self.is_set_up, true) {
            theme::set_up(context);
        }
        let mut asked = Asked::default();
        if let Some((step, name)) = seen.starting {
            asked.cancel = loading_card::show(context, name, step);
        }
        if let Some(running) = seen.running {
            self.show_run(context, seen, running, &mut asked);
        }
        if let Some((stage, name)) = seen.change.stage() {
            asked.cancel |= loading_card::show(context, &name, stage as usize);
        }
        asked.file = self.dialog.show(context);
        self.notices.show(context);
        asked
    }

    fn show_run(
        &mut self,
        context: &Context,
        seen: &Seen<'_>,
        running: &Running,
        asked: &mut Asked,
    ) {
        let facts = menu_facts(seen, running);
        asked.actions.extend(menu::bar(context, &facts));
        asked.actions.extend(self.pop_up.show(context, &facts));
        let is_played = running.about.hand.is_played();
        if is_played {
            self.show_timeline(context, running, asked);
        } else if running.about.hand == HandChoice::Mouse {
            asked.mouse = self.sliders.show(context);
            let closes = |input: &MouseInput| matches!(input, MouseInput::CloseTo(..));
            self.hint_gone |= asked.mouse.iter().any(closes);
        }
        if let Some(frame) = running.frame() {
            let told = Told {
                tick_s: running.about.tick_s,
                preparing: (running.about.server_stage)(),
                newtons_per_m: seen.display.forces.then_some(seen.newtons_per_m),
            };
            status_card::show(context, frame, &told);
            self.hint_gone |= is_played && frame.tick > HINT_TICKS;
        }
        if seen.display.shading != Shading::Plain {
            legend_card::show(context, seen.colouring.map(), &legend_text(seen.colouring));
        }
        if self.shows_timings {
            self.timings.show(context, seen.graphics.1);
        }
        if self.information {
            let facts = run_facts(running, seen.graphics.0);
            information_card::show(context, &facts, running.frame().map(AsRef::as_ref));
        }
        if self.help {
            help_card::show(context, running.about.hand);
        } else if !self.hint_gone {
            help_card::hint(context, running.about.hand);
        }
    }

    fn show_timeline(&self, context: &Context, running: &Running, asked: &mut Asked) {
        let playing = Playing { is_paused: running.is_paused(), looked_at: running.looked_at() };
        match timeline::show(context, running.history(), &playing) {
            Some(TimelineWish::Do(action)) => asked.actions.push(action),
            Some(TimelineWish::LookAt(tick)) => asked.look_at = Some(tick),
            Some(TimelineWish::Newest) => asked.newest = true,
            None => {}
        }
    }
}

fn menu_facts<'a>(seen: &Seen<'a>, running: &'a Running) -> MenuFacts<'a> {
    let about = &running.about;
    let newest = running.newest();
    MenuFacts {
        display: seen.display,
        hand: about.hand,
        object: &about.object,
        method: &about.method,
        max_error: about.max_error,
        can_undo: newest.is_some_and(|frame| frame.object.kept > 0),
        is_recording: seen.is_recording,
        can_keep: newest.is_some_and(|frame| frame.can_keep()),
    }
}

fn run_facts(running: &Running, graphics: &str) -> RunFacts {
    let about = &running.about;
    RunFacts {
        object: about.object.clone(),
        material: (about.material.young(), about.material.poisson()),
        contact: about.contact.clone(),
        server: about.server.clone(),
        hand: match about.hand {
            HandChoice::Mouse => "mouse and keyboard".to_owned(),
            HandChoice::Scripted(script) => format!("scripted ({script})"),
            HandChoice::Live => "your own".to_owned(),
            HandChoice::Replay => "a recording".to_owned(),
        },
        graphics: graphics.to_owned(),
    }
}

fn legend_text(colouring: &Colouring) -> LegendText {
    let legend = colouring.legend();
    LegendText {
        title: legend.shading().title().to_owned(),
        labels: legend.ticks().map(|tick| (tick.fraction, tick.text)).to_vec(),
        remark: colouring.remark().to_owned(),
    }
}
