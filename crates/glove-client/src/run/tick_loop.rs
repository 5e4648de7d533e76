//! Plays a run to its end: when each tick is due, a person's wishes, pause and stop.

use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender};
use std::time::{Duration, Instant};

use softgrasp_grasp::object::ObjectError;
use softgrasp_hand::notice::Notice;
use softgrasp_hand::sent::TICKS_PER_S;
use softgrasp_window::view::control::Control;

use crate::pace::run_clock::RunClock;
use crate::pace::{Due, Schedule, wait_until};
use crate::run::session::Session;
use crate::run::tick_outcome::TickOutcome;

/// Times at which ticks are played.
#[derive(Clone, Copy, Debug, Default)]
pub struct Timing {
    /// Time from tick to tick, in real time; `None` plays one after the other without pause.
    pub period: Option<Duration>,
    /// Number of ticks to play; `None` until the script ends or the run is stopped.
    pub ticks_max: Option<u64>,
}

/// Plays the ticks of one run.
pub struct TickLoop<'a> {
    session: &'a mut Session,
    controls: &'a Receiver<Control>,
    notices: &'a Sender<Notice>,
    schedule: Option<Schedule>,
    ticks_max: u64,
    clock: RunClock,
    mode: Mode,
    /// Number of the tick after the last played one.
    next: u64,
}

/// Whether ticks are played, paused, or played one by one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    Plays,
    Paused,
    /// Paused, except for one tick.
    Steps,
    Stopped,
}

/// Time between two looks for controls, while no tick is played and before a tick that is far off.
const LOOK_EVERY: Duration = Duration::from_millis(20);

impl<'a> TickLoop<'a> {
    /// Loop whose first tick is due now. Controls come in, sentences for the person go out; they are lost
    /// if nobody listens.
    pub fn new(
        session: &'a mut Session,
        timing: Timing,
        controls: &'a Receiver<Control>,
        notices: &'a Sender<Notice>,
    ) -> Self {
        Self {
            session,
            controls,
            notices,
            schedule: timing.period.map(Schedule::new),
            ticks_max: timing.ticks_max.unwrap_or(u64::MAX),
            clock: RunClock::start(Instant::now()),
            mode: Mode::Plays,
            next: 0,
        }
    }

    /// Plays until the script or the ticks end, the run is stopped, or `asked_to_end` is true; returns
    /// whether the user ended it. `sink` is called after each tick, and after a change while no tick was
    /// played; then its `Due` and its time (s) are the last ones.
    ///
    /// # Errors
    /// Error of a tick, or the first of `sink`.
    pub fn play<E: From<ObjectError>>(
        mut self,
        asked_to_end: impl Fn() -> bool,
        mut sink: impl FnMut(&Session, &TickOutcome, Due, f64) -> Result<(), E>,
    ) -> Result<bool, E> {
        let mut last = (Due { tick: 0, skipped: 0 }, 0.0);
        loop {
            let changed = self.rest() | self.obey_all();
            if self.mode == Mode::Stopped {
                return Ok(true);
            }
            if self.mode == Mode::Paused {
                if asked_to_end() {
                    return Ok(true);
                }
                let outcome = self.session.idle()?;
                self.tell();
                if changed || !outcome.events.is_empty() || !outcome.answers.is_empty() {
                    sink(self.session, &outcome, last.0, last.1)?;
                }
                continue;
            }
            if self.is_early() {
                if asked_to_end() {
                    return Ok(true);
                }
                continue;
            }
            let (due, now_s) = self.due();
            if due.tick >= self.ticks_max {
                self.session.skip(due.skipped.min(self.ticks_max - self.next));
                return Ok(false);
            }
            if asked_to_end() {
                self.session.skip(due.skipped);
                return Ok(true);
            }
            let Some(outcome) = self.session.play(due, now_s)? else { return Ok(false) };
            self.next = due.tick + 1;
            last = (due, now_s);
            self.tell();
            sink(self.session, &outcome, due, now_s)?;
            if self.mode == Mode::Steps {
                self.mode = Mode::Paused;
            }
        }
    }

    /// Waits for the next tick, but not longer than a control may wait; returns whether a control came.
    fn rest(&mut self) -> bool {
        let now = Instant::now();
        let until = match (self.mode, &self.schedule) {
            (Mode::Paused, _) => now + LOOK_EVERY,
            (Mode::Plays, Some(schedule)) => self.clock.moment_of(schedule.next_at()),
            (Mode::Plays | Mode::Steps | Mode::Stopped, _) => return false,
        };
        if self.mode == Mode::Plays && until <= now + LOOK_EVERY {
            wait_until(until);
            return false;
        }
        match self.controls.recv_timeout(LOOK_EVERY) {
            Ok(control) => {
                self.obey(control);
                return true;
            }
            Err(RecvTimeoutError::Timeout) => {}
            // Nobody can ask for anything any more.
            Err(RecvTimeoutError::Disconnected) => std::thread::sleep(LOOK_EVERY),
        }
        false
    }

    /// Whether the next tick is not due yet.
    fn is_early(&self) -> bool {
        let next_at = self.schedule.as_ref().map_or(Duration::ZERO, Schedule::next_at);
        self.mode == Mode::Plays && self.clock.at(Instant::now()) < next_at
    }

    /// Tick to be played now, and its time on the client's clock, s.
    fn due(&mut self) -> (Due, f64) {
        let Some(schedule) = &mut self.schedule else {
            return (Due { tick: self.next, skipped: 0 }, self.next as f64 / TICKS_PER_S);
        };
        if self.mode == Mode::Steps {
            self.clock.set_forward(schedule.next_at());
        }
        let elapsed = self.clock.at(Instant::now());
        (schedule.due(elapsed), elapsed.as_secs_f64())
    }

    /// Obeys the controls that have come; returns whether there were any.
    fn obey_all(&mut self) -> bool {
        let mut any = false;
        while let Ok(control) = self.controls.try_recv() {
            self.obey(control);
            any = true;
        }
        any
    }

    fn obey(&mut self, control: Control) {
        let pauses = matches!(control, Control::Pause | Control::Step);
        if pauses && !self.session.is_played() {
            let text = "a hand that a person moves cannot be paused";
            return self.say(Notice::refused(text));
        }
        match (control, self.mode) {
            (Control::Stop, _) | (_, Mode::Stopped) => self.mode = Mode::Stopped,
            (Control::EndWithScript, _) if self.session.needs_window() => {
                self.mode = Mode::Stopped;
            }
            (Control::EndWithScript, mode) => {
                self.session.apply(Control::EndWithScript);
                if mode != Mode::Plays {
                    self.resume();
                }
            }
            (Control::Pause, Mode::Plays) => self.pause(),
            (Control::Step, Mode::Plays) => {
                self.pause();
                self.mode = Mode::Steps;
            }
            (Control::Step, _) => self.mode = Mode::Steps,
            (Control::Resume, Mode::Paused | Mode::Steps) => self.resume(),
            (Control::Pause | Control::Resume, _) => {}
            (control, mode) => {
                // A live hand is never paused, and a script that is played again plays.
                let goes_on = match &control {
                    Control::ReplaceHand(hand) => !hand.is_played(),
                    Control::Restart => true,
                    _ => false,
                };
                self.session.apply(control);
                if goes_on && mode != Mode::Plays {
                    self.resume();
                }
                self.tell();
                if self.mode == Mode::Paused && self.session.has_commands() {
                    self.say(Notice::waits("that takes effect when the run goes on"));
                }
            }
        }
    }

    fn pause(&mut self) {
        // The next tick is the one that was due when the pause was asked for, however late that was.
        let next_at = self.schedule.as_ref().map_or(Duration::MAX, Schedule::next_at);
        self.clock.stop(Instant::now(), next_at);
        self.mode = Mode::Paused;
    }

    fn resume(&mut self) {
        self.clock.go_on(Instant::now());
        self.mode = Mode::Plays;
    }

    fn tell(&mut self) {
        let notices = self.session.take_notices();
        notices.into_iter().for_each(|notice| self.say(notice));
    }

    fn say(&self, notice: Notice) {
        // A person who has gone is told nothing.
        let _ = self.notices.send(notice);
    }
}
