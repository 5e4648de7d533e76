//! The run behind the window: what it asks of the ticks, and the frames that come from them.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender};

use softgrasp_core::fem::Material;
use softgrasp_hand::hand_request::HandChoice;
use softgrasp_hand::notice::{Notice, NoticeKind};
use softgrasp_protocol::MethodName;

use super::lost_display::End;
use crate::view::control::Control;
use crate::view::frame::{News, NewsKind, TickTiming, ViewFrame};
use crate::view::history::History;
use crate::view::outlet::Inlet;

/// A run that is being played on a thread of its own.
pub struct Running {
    ticks: Ticks,
    inlet: Inlet,
    history: History,
    newest: Option<Arc<ViewFrame>>,
    /// The tick that is looked at, where it is not the newest.
    looked_at: Option<u64>,
    is_paused: bool,
    /// The script has come to its end, and stands still there.
    is_at_end: bool,
    /// Ticks are told from this one on: the first of the script that is played.
    first_tick: u64,
    /// The script stands still until its first picture has been seen: making that takes its time.
    waits_for_picture: bool,
    /// What can be said of it.
    pub about: About,
}

/// What a window holds of the thread that plays the ticks.
pub struct Ticks {
    /// Where wishes go; a run that is over does not hear them.
    pub controls: Sender<Control>,
    /// Where sentences for the person come from.
    pub notices: Receiver<Notice>,
    /// Whether the run is over.
    pub is_over: Box<dyn Fn() -> bool>,
    /// What is left to do where the window ends although nobody closed it, which ends the process:
    /// the run goes on to the end of its script, and its report is told.
    pub when_lost: Option<WhenLost>,
}

/// Work that can be done on any thread, and is told why.
pub type WhenLost = Box<dyn FnOnce(End) + Send>;

/// What a window says of a run.
pub struct About {
    /// Name or file of the object.
    pub object: String,
    /// Where it is solved.
    pub server: String,
    /// What a fingertip holds.
    pub contact: String,
    /// Whether fingers press with friction, so that an object is pinched and lifted.
    pub is_lifted: bool,
    /// Material.
    pub material: Material,
    /// The hand that acts.
    pub hand: HandChoice,
    /// Method asked for.
    pub method: String,
    /// Error budget.
    pub max_error: Option<f64>,
    /// From tick to tick, s.
    pub tick_s: f64,
    /// Whether a script that is over stands still, and begins anew after a pause.
    pub begins_anew: bool,
    /// What a server in this process is at, in a word.
    pub server_stage: Box<dyn Fn() -> &'static str + Send>,
}

/// What has come from the ticks since the last look.
#[derive(Default)]
pub struct Arrived {
    /// Times of answers.
    pub timings: Vec<TickTiming>,
    /// Sentences for the person, and whether each is a refusal.
    pub sentences: Vec<(String, bool)>,
    /// Whether there is a newer frame.
    pub is_new: bool,
}

impl Running {
    /// A run whose frames come through an inlet.
    pub fn new(ticks: Ticks, inlet: Inlet, about: About) -> Self {
        let waits_for_picture = about.hand.is_played();
        let running = Self {
            ticks,
            inlet,
            history: History::default(),
            newest: None,
            looked_at: None,
            is_paused: false,
            is_at_end: false,
            first_tick: 0,
            waits_for_picture,
            about,
        };
        if waits_for_picture {
            running.ask(Control::Pause);
        }
        running
    }

    /// Takes what has come.
    pub fn look(&mut self) -> Arrived {
        let mut arrived = Arrived::default();
        while let Ok(Notice { text, kind }) = self.ticks.notices.try_recv() {
            arrived.sentences.push((text, kind == NoticeKind::Refused));
        }
        if let Some(mut frame) = self.inlet.take() {
            arrived.is_new = true;
            arrived.timings = std::mem::take(&mut frame.timings);
            for News { tick, text, .. } in &frame.news {
                tracing::info!(tick, text, "news");
            }
            arrived.sentences.extend(frame.news.iter().filter_map(sentence));
            let frame = Arc::new(*frame);
            // A frame that was on its way when the script began again is of the one before.
            if frame.tick >= self.first_tick {
                self.history.add(Arc::clone(&frame));
            }
            self.newest = Some(frame);
        }
        arrived
    }

    /// The frame that is looked at.
    pub fn frame(&self) -> Option<&Arc<ViewFrame>> {
        match self.looked_at {
            Some(tick) => self.history.at(tick),
            None => self.newest.as_ref(),
        }
    }

    /// The newest frame.
    pub fn newest(&self) -> Option<&Arc<ViewFrame>> {
        self.newest.as_ref()
    }

    /// The frames so far.
    pub fn history(&self) -> &History {
        &self.history
    }

    /// A picture of it has been shown.
    pub fn was_seen(&mut self) {
        if self.newest.is_some() && std::mem::take(&mut self.waits_for_picture) {
            self.ask(Control::Resume);
        }
    }

    /// Whether no tick is played.
    pub fn is_paused(&self) -> bool {
        self.is_paused
    }

    /// The tick that is looked at, where it is not the newest.
    pub fn looked_at(&self) -> Option<u64> {
        self.looked_at
    }

    /// Whether it is over.
    pub fn is_over(&self) -> bool {
        (self.ticks.is_over)()
    }

    /// Asks something of the ticks.
    pub fn ask(&self, control: Control) {
        // A run that is over does not hear it.
        let _ = self.ticks.controls.send(control);
    }

    /// Another object is there: its script is played from the beginning.
    pub fn object_is(&mut self, object: String) {
        self.about.object = object;
        self.looked_at = None;
        if std::mem::take(&mut self.is_at_end) {
            self.play_or_pause();
        }
    }

    /// Looks at a tick that was seen; the run stands still meanwhile.
    pub fn look_at(&mut self, tick: u64) {
        if !self.is_paused {
            self.play_or_pause();
        }
        self.looked_at = Some(tick);
    }

    /// Looks at the newest tick again.
    pub fn look_at_newest(&mut self) {
        self.looked_at = None;
    }

    /// The tick that a person counts from: the first of the script that is played.
    pub fn first_tick(&self) -> u64 {
        self.first_tick
    }

    /// Whether a frame is of the script before the one that is played now.
    pub fn has_begun_anew(&self, frame: &ViewFrame) -> bool {
        frame.tick < self.first_tick
    }

    /// Stands still because the script has come to its end.
    pub fn stand_at_end(&mut self) {
        if !self.is_paused {
            self.play_or_pause();
        }
        self.is_at_end = true;
    }

    /// Goes on, or stands still; a script that is over begins again.
    pub fn play_or_pause(&mut self) {
        if self.is_at_end {
            return self.restart();
        }
        self.is_paused = !self.is_paused;
        self.looked_at = None;
        self.ask(if self.is_paused { Control::Pause } else { Control::Resume });
    }

    /// Plays one tick.
    pub fn step(&mut self) {
        (self.is_paused, self.looked_at) = (true, None);
        self.ask(Control::Step);
    }

    /// Plays the script from its beginning.
    pub fn restart(&mut self) {
        (self.is_paused, self.is_at_end, self.looked_at) = (false, false, None);
        self.history = History::default();
        self.first_tick = self.newest.as_ref().map_or(0, |frame| frame.tick + 1);
        self.ask(Control::Restart);
    }

    /// Another hand acts from now on.
    pub fn hand_is(&mut self, hand: HandChoice) {
        (self.is_paused, self.is_at_end, self.looked_at) = (false, false, None);
        self.about.hand = hand;
        // Another script would stand still where this one did.
        self.ask(Control::Resume);
    }

    /// Writes the object.
    pub fn save(&self, path: PathBuf) {
        self.ask(Control::Save(path));
    }

    /// Solves by another method from now on.
    ///
    /// # Errors
    /// A sentence, for a name that no method has.
    pub fn set_method(&mut self, name: &str) -> Result<(), String> {
        let method: MethodName = name.parse().map_err(|error| format!("{error}"))?;
        self.ask(Control::SetMethod(method));
        name.clone_into(&mut self.about.method);
        Ok(())
    }

    /// Accepts errors up to this from now on.
    pub fn set_max_error(&mut self, max_error: Option<f64>) {
        self.ask(Control::SetMaxError(max_error));
        self.about.max_error = max_error;
    }

    /// What is left to do where the window ends although nobody closed it; it is there once.
    pub fn when_lost(&mut self) -> Option<WhenLost> {
        self.ticks.when_lost.take()
    }
}

/// What a person has to know of a piece of news; the status shows the rest.
fn sentence(news: &News) -> Option<(String, bool)> {
    match news.kind {
        NewsKind::Refusal => Some((news.text.clone(), true)),
        NewsKind::Grasp | NewsKind::Information => None,
    }
}
