//! The run behind the window: what it asks of the ticks, and the views of ticks that come from them.

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

/// A run that is played on a thread of its own, as the window sees it.
pub struct Running {
    ticks: Ticks,
    inlet: Inlet,
    history: History,
    newest: Option<Arc<ViewFrame>>,
    /// Number of the tick that is looked at, where it is not the newest.
    looked_at: Option<u64>,
    is_paused: bool,
    /// Whether the script has come to its end, and the run is paused there.
    is_at_end: bool,
    /// Number of the tick from which the person counts: the first of the script that is played.
    first_tick: u64,
    /// Whether the script is paused until its first picture has been seen: making that takes its time.
    waits_for_picture: bool,
    /// Facts of the run that the window shows.
    pub about: About,
}

/// The window's ends of the channels to the thread that plays the ticks.
pub struct Ticks {
    /// Channel of the person's wishes; a run that is over does not take them.
    pub controls: Sender<Control>,
    /// Channel of the sentences for the person.
    pub notices: Receiver<Notice>,
    /// Whether the run is over.
    pub is_over: Box<dyn Fn() -> bool>,
    /// Work that is left where the window ends although nobody closed it, which ends the process: the run
    /// goes on to the end of its script, and its report is told.
    pub when_lost: Option<WhenLost>,
}

/// Work that is left when the window has ended; it is told why, and can be done on any thread.
pub type WhenLost = Box<dyn FnOnce(End) + Send>;

/// Facts of a run that the window shows.
pub struct About {
    /// Name or file of the object.
    pub object: String,
    /// Server that answers, as it is shown to a person.
    pub server: String,
    /// Words for how the hand holds the object: by friction, or by what a fingertip holds.
    pub contact: String,
    /// Whether fingers press with friction, so that an object is pinched and lifted.
    pub is_lifted: bool,
    /// Material of the object.
    pub material: Material,
    /// The hand that acts.
    pub hand: HandChoice,
    /// Name of the method that was asked for.
    pub method: String,
    /// Largest relative error that was asked for; `None` leaves it to the method.
    pub max_error: Option<f64>,
    /// Time from tick to tick, s.
    pub tick_s: f64,
    /// Whether a script that is over pauses, and begins anew after a while.
    pub begins_anew: bool,
    /// Stage of a server in this process, in a word.
    pub server_stage: Box<dyn Fn() -> &'static str + Send>,
}

/// What has come from the ticks since the last look at their channels.
#[derive(Default)]
pub struct Arrived {
    /// Times of answers.
    pub timings: Vec<TickTiming>,
    /// Sentences for the person, and whether each is a refusal.
    pub sentences: Vec<(String, bool)>,
    /// Whether there is a newer view of a tick.
    pub is_new: bool,
}

impl Running {
    /// A run whose views of ticks come through an inlet.
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

    /// Takes what has come from the ticks since the last call.
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
            // A tick that was on its way when the script began again is of the script before.
            if frame.tick >= self.first_tick {
                self.history.add(Arc::clone(&frame));
            }
            self.newest = Some(frame);
        }
        arrived
    }

    /// View of the tick that is looked at.
    pub fn frame(&self) -> Option<&Arc<ViewFrame>> {
        match self.looked_at {
            Some(tick) => self.history.at(tick),
            None => self.newest.as_ref(),
        }
    }

    /// View of the newest tick.
    pub fn newest(&self) -> Option<&Arc<ViewFrame>> {
        self.newest.as_ref()
    }

    /// Views of the ticks so far.
    pub fn history(&self) -> &History {
        &self.history
    }

    /// Notes that a picture of the run has been shown.
    pub fn was_seen(&mut self) {
        if self.newest.is_some() && std::mem::take(&mut self.waits_for_picture) {
            self.ask(Control::Resume);
        }
    }

    /// Whether no tick is played.
    pub fn is_paused(&self) -> bool {
        self.is_paused
    }

    /// Number of the tick that is looked at, where it is not the newest.
    pub fn looked_at(&self) -> Option<u64> {
        self.looked_at
    }

    /// Whether the run is over.
    pub fn is_over(&self) -> bool {
        (self.ticks.is_over)()
    }

    /// Sends a wish to the ticks.
    pub fn ask(&self, control: Control) {
        // A run that is over does not hear it.
        let _ = self.ticks.controls.send(control);
    }

    /// Name of the object; of several that which was touched last.
    pub fn object_name(&self) -> &str {
        let own = self.newest.as_ref().and_then(|frame| frame.object.own.as_ref());
        own.map_or(&self.about.object, |own| &own.name)
    }

    /// Notes that another object is there: its script is played from the beginning.
    pub fn object_is(&mut self, object: String) {
        self.about.object = object;
        self.looked_at = None;
        if std::mem::take(&mut self.is_at_end) {
            self.play_or_pause();
        }
    }

    /// Looks at a tick that was seen; the run is paused meanwhile.
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

    /// Number of the tick from which a person counts: the first of the script that is played.
    pub fn first_tick(&self) -> u64 {
        self.first_tick
    }

    /// Whether a tick is of the script before the one that is played now.
    pub fn has_begun_anew(&self, frame: &ViewFrame) -> bool {
        frame.tick < self.first_tick
    }

    /// Pauses the run because the script has come to its end.
    pub fn stand_at_end(&mut self) {
        if !self.is_paused {
            self.play_or_pause();
        }
        self.is_at_end = true;
    }

    /// Plays on, or pauses; a script that is over begins again.
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

    /// Notes that another hand acts from now on.
    pub fn hand_is(&mut self, hand: HandChoice) {
        (self.is_paused, self.is_at_end, self.looked_at) = (false, false, None);
        self.about.hand = hand;
        // Another script would stand still where this one did.
        self.ask(Control::Resume);
    }

    /// Asks the ticks to write the object to a file.
    pub fn save(&self, path: PathBuf) {
        self.ask(Control::Save(path));
    }

    /// Asks the ticks to solve by another method from now on.
    ///
    /// # Errors
    /// A sentence, for a name that no method has.
    pub fn set_method(&mut self, name: &str) -> Result<(), String> {
        let method: MethodName = name.parse().map_err(|error| format!("{error}"))?;
        self.ask(Control::SetMethod(method));
        name.clone_into(&mut self.about.method);
        Ok(())
    }

    /// Asks the ticks to accept errors up to this from now on.
    pub fn set_max_error(&mut self, max_error: Option<f64>) {
        self.ask(Control::SetMaxError(max_error));
        self.about.max_error = max_error;
    }

    /// The work that is left where the window ends although nobody closed it; it can be taken once.
    pub fn when_lost(&mut self) -> Option<WhenLost> {
        self.ticks.when_lost.take()
    }
}

/// The sentence that a person has to read of a piece of news, and whether it is a refusal; the status
/// shows the rest.
fn sentence(news: &News) -> Option<(String, bool)> {
    match news.kind {
        NewsKind::Refusal => Some((news.text.clone(), true)),
        NewsKind::Grasp | NewsKind::Information => None,
    }
}
