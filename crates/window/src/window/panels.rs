//! All menus, cards and dialogs of one picture, and what was asked for on them.

use std::time::{Duration, Instant};

use egui::{Align2, Context, Ui};
use nalgebra::Vector2;
use softgrasp_grasp::object::ObjectChoice;
use softgrasp_hand::hand_request::HandChoice;
use softgrasp_hand::mouse::MouseInput;

use super::changes::Change;
use super::running::Running;
use super::ui::dialogs::{Dialog, FileAnswer};
use super::ui::hand_card::FingerSliders;
use super::ui::information_card::{self, RunFacts};
use super::ui::legend_card::{self, LegendText};
use super::ui::menu::{self, MenuFacts, PopUp};
use super::ui::notices::Notices;
use super::ui::softness_card::{Is, Softness, SoftnessWish};
use super::ui::status_card::{self, Told};
use super::ui::timeline::{self, Playing, TimelineWish};
use super::ui::timings_card::Timings;
use super::ui::waiting_cards::{self, Preparing};
use super::ui::{help_card, theme};
use crate::view::action::Action;
use crate::view::colouring::Colouring;
use crate::view::display::Display;
use crate::view::frame::ViewFrame;
use crate::view::shading::Shading;
use crate::view::toggle::Page;

/// Everything that lies over the scene, from picture to picture.
#[derive(Default)]
pub struct Panels {
    pop_up: PopUp,
    /// Dialog that is open.
    pub dialog: Dialog,
    /// Sentences on the screen, for a while.
    pub notices: Notices,
    /// Newest times of answers, for their graph.
    pub timings: Timings,
    /// Sliders that close the fingers of the mouse hand.
    pub sliders: FingerSliders,
    help: bool,
    information: bool,
    shows_timings: bool,
    shows_softness: bool,
    softness: Softness,
    /// Whether the hint of the first run has been seen.
    hint_gone: bool,
    is_set_up: bool,
    /// When the server began to prepare the object.
    pub(super) prepares_since: Option<Instant>,
}

/// What the person asked for on the panels.
#[derive(Default)]
pub struct Asked {
    /// Wishes to the run and the window.
    pub actions: Vec<Action>,
    /// Wishes to the mouse hand.
    pub mouse: Vec<MouseInput>,
    /// File that was named in a dialog.
    pub file: Option<FileAnswer>,
    /// Number of a tick to look at.
    pub look_at: Option<u64>,
    /// Whether the newest tick is to be looked at again.
    pub newest: bool,
    /// Whether the object that is being loaded is not wanted any more.
    pub cancel: bool,
    /// Whether the person takes the hand of the script.
    pub takes_hand: bool,
    /// Another material, size or mesh of the object that is wanted.
    pub softness: Option<SoftnessWish>,
}

/// What the panels show in a picture.
pub struct Seen<'a> {
    /// The run, once it has begun.
    pub running: Option<&'a Running>,
    /// What of the scene is shown.
    pub display: &'a Display,
    /// Colours of the object and their legend.
    pub colouring: &'a Colouring,
    /// Change that is under way.
    pub change: &'a Change,
    /// Step of loading before the run begins, and the name of the object.
    pub starting: Option<(usize, &'a str)>,
    /// Name of the graphics, and pictures a second.
    pub graphics: (&'a str, f64),
    /// Whether pictures are being written.
    pub is_recording: bool,
    /// Force that a metre of arrow stands for, N/m.
    pub newtons_per_m: f64,
    /// Time until a script that is over begins anew.
    pub story_begins_in: Option<Duration>,
}

/// Names of the columns of cards.
const LEFT: &str = "left";
const RIGHT: &str = "right";
const TOP: &str = "top";
/// Width of the column at the left, points.
const LEFT_WIDTH: f32 = 222.0;
/// Width of the column at the right, and where only the legend is there, points.
const RIGHT_WIDTH: f32 = 366.0;
const LEGEND_WIDTH: f32 = 176.0;
/// Largest width of what is told at the top, points.
const TOLD_WIDTH: f32 = 560.0;
/// Number of ticks of a hand that is played after which the hint goes.
const HINT_TICKS: u64 = 900;

impl Panels {
    /// Opens the pop-up menu at a place, pixels.
    pub fn open_menu(&mut self, context: &Context, at: Vector2<f64>) {
        let scale = context.pixels_per_point();
        self.pop_up.open(egui::Pos2::new(at.x as f32 / scale, at.y as f32 / scale));
    }

    /// Closes the page or dialog that Escape closes; returns whether one was open.
    pub fn escape(&mut self) -> bool {
        let was_open = self.pop_up.is_open() || self.help || !self.dialog.is_closed();
        self.pop_up.close();
        self.help = false;
        self.dialog = Dialog::Closed;
        was_open
    }

    /// Shows a page, or hides it where it is shown.
    pub fn toggle(&mut self, page: Page) {
        match page {
            Page::Help => self.help = !self.help,
            Page::Information => self.information = !self.information,
            Page::Timings => self.shows_timings = !self.shows_timings,
            Page::Softness => self.shows_softness = !self.shows_softness,
        }
        self.hint_gone |= page == Page::Help;
    }

    /// Hides the hint: it has been understood.
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
            asked.cancel = waiting_cards::loading(context, name, step);
        }
        if let Some(running) = seen.running {
            self.show_run(context, seen, running, &mut asked);
        }
        if let Some((stage, name)) = seen.change.stage() {
            asked.cancel |= waiting_cards::loading(context, &name, stage as usize);
        }
        if seen.running.is_none() {
            let offset = [0.0, theme::BELOW_BAR];
            theme::column(context, TOP, Align2::CENTER_TOP, offset, [TOLD_WIDTH, 200.0], |ui| {
                self.notices.show(ui);
            });
        }
        asked.file = self.dialog.show(context);
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
        }
        let above = if is_played { timeline::HEIGHT } else { 0.0 };
        if let Some(frame) = running.frame() {
            let told = Told {
                tick_s: running.about.tick_s,
                newtons_per_m: seen.display.forces.then_some(seen.newtons_per_m),
                above,
            };
            status_card::show(context, frame, &told);
            self.hint_gone |= is_played && frame.tick > HINT_TICKS;
        }
        self.show_left(context, running, asked);
        self.show_right(context, seen, running, asked);
        self.show_top(context, seen, running, asked);
        if self.help {
            help_card::show(context, running.about.hand);
        }
    }

    /// Shows the card of the mouse hand, below the bar.
    fn show_left(&mut self, context: &Context, running: &Running, asked: &mut Asked) {
        if running.about.hand != HandChoice::Mouse {
            return;
        }
        let status = theme::size_of(context, "status").y;
        let height = context.content_rect().height() - theme::BELOW_BAR - status - 28.0;
        let offset = [theme::MARGIN, theme::BELOW_BAR];
        theme::column(context, LEFT, Align2::LEFT_TOP, offset, [LEFT_WIDTH, height], |ui| {
            asked.mouse = self.sliders.show(ui);
        });
        let closes = |input: &MouseInput| matches!(input, MouseInput::CloseTo(..));
        self.hint_gone |= asked.mouse.iter().any(closes);
    }

    /// Shows softness, legend, times and information, at the right.
    fn show_right(
        &mut self,
        context: &Context,
        seen: &Seen<'_>,
        running: &Running,
        asked: &mut Asked,
    ) {
        if !self.has_right(seen) {
            return;
        }
        let is_coloured = seen.display.shading != Shading::Plain;
        let above = if running.about.hand.is_played() { timeline::HEIGHT } else { 0.0 };
        let height = context.content_rect().height() - above - 2.0 * theme::MARGIN;
        let offset = [-theme::MARGIN, theme::MARGIN];
        let is_wide = self.shows_timings || self.information || self.shows_softness;
        let width = if is_wide { RIGHT_WIDTH } else { LEGEND_WIDTH };
        theme::column(context, RIGHT, Align2::RIGHT_TOP, offset, [width, height], |ui| {
            // Sliders come first: the legend comes and goes, and must not move them under the hand.
            if let (true, Some(frame)) = (self.shows_softness, running.newest()) {
                asked.softness = self.softness.show(ui, &softness_of(running, frame));
            }
            if is_coloured {
                legend_card::show(ui, seen.colouring.map(), &legend_text(seen.colouring));
            }
            if self.shows_timings {
                self.timings.show(ui, seen.graphics.1);
            }
            if self.information {
                let facts = run_facts(running, seen.graphics.0);
                information_card::show(ui, &facts, running.frame().map(AsRef::as_ref));
            }
        });
    }

    fn has_right(&self, seen: &Seen<'_>) -> bool {
        let is_coloured = seen.display.shading != Shading::Plain;
        is_coloured || self.shows_timings || self.information || self.shows_softness
    }

    /// Shows what has to be told, between the left and the right column.
    fn show_top(
        &mut self,
        context: &Context,
        seen: &Seen<'_>,
        running: &Running,
        asked: &mut Asked,
    ) {
        let width = context.content_rect().width();
        let beside = |name| match theme::size_of(context, name).x {
            0.0 => theme::MARGIN,
            taken => taken + 2.0 * theme::MARGIN,
        };
        let is_mouse = running.about.hand == HandChoice::Mouse;
        let left = if is_mouse { beside(LEFT) } else { theme::MARGIN };
        let right = if self.has_right(seen) { beside(RIGHT) } else { theme::MARGIN };
        let room = (width - left - right).max(100.0);
        let offset = [0.5 * (left - right), theme::BELOW_BAR];
        let height = context.content_rect().height() - 2.0 * theme::BELOW_BAR;
        let size_max = [room.min(TOLD_WIDTH), height];
        theme::column(context, TOP, Align2::CENTER_TOP, offset, size_max, |ui| {
            self.tell(ui, seen, running, asked);
            self.notices.show(ui);
        });
    }

    /// Shows the one thing that the person is to know now.
    fn tell(&mut self, ui: &mut Ui, seen: &Seen<'_>, running: &Running, asked: &mut Asked) {
        if seen.story_begins_in.is_some() {
            self.hint_gone = true;
            let begins_in = seen.story_begins_in.filter(|_| running.about.begins_anew);
            asked.takes_hand = waiting_cards::turn(ui, &running.about.object, begins_in);
        } else if let Some(preparing) = self.preparing(running) {
            waiting_cards::preparing(ui, &preparing);
        } else if !self.hint_gone {
            help_card::hint(ui, running.about.hand, running.about.is_lifted);
        }
    }

    /// What the card says of a server that has been preparing the object for a while.
    fn preparing<'a>(&mut self, running: &'a Running) -> Option<Preparing<'a>> {
        let frame = running.frame().filter(|frame| frame.server.is_preparing);
        let Some(frame) = frame else {
            self.prepares_since = None;
            return None;
        };
        let since = self.prepares_since.get_or_insert_with(Instant::now).elapsed();
        (since > waiting_cards::BRIEF).then(|| Preparing {
            object: running.object_name(),
            nodes: frame.object.rest.mesh().node_count(),
            stage: (running.about.server_stage)(),
            since,
            is_awaited: matches!(running.about.hand, HandChoice::Scripted(_)),
        })
    }

    fn show_timeline(&self, context: &Context, running: &Running, asked: &mut Asked) {
        let playing = Playing {
            is_paused: running.is_paused(),
            looked_at: running.looked_at(),
            first_tick: running.first_tick(),
        };
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
        object: running.object_name(),
        method: &about.method,
        solved_by: newest
            .and_then(|frame| Some(frame.server.solve.as_ref()?.report.method.as_str())),
        max_error: about.max_error,
        can_undo: newest.is_some_and(|frame| frame.object.kept > 0),
        is_recording: seen.is_recording,
        can_keep: newest.is_some_and(|frame| frame.can_keep()),
    }
}

fn softness_of(running: &Running, frame: &ViewFrame) -> Is {
    let own = frame.object.own.as_ref().map(|own| own.material);
    let (material, mesh) = (own.unwrap_or(running.about.material), frame.object.rest.mesh());
    Is {
        young: material.young(),
        poisson: material.poisson(),
        size_m: mesh.size(),
        nodes: mesh.node_count(),
        can_be_refined: matches!(running.object_name().parse(), Ok(ObjectChoice::BuiltIn(_))),
        grip_newtons: frame.grip_newtons(),
    }
}

fn run_facts(running: &Running, graphics: &str) -> RunFacts {
    let about = &running.about;
    RunFacts {
        object: running.object_name().to_owned(),
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
