//! A run from its first tick to its report: hand, grasp loop and report, one tick at a time, and a
//! person's wishes between the ticks.

use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use nalgebra::{Quaternion, UnitQuaternion};
use softgrasp_grasp::grasp::{Command, StateName};
use softgrasp_grasp::object::ObjectError;
use softgrasp_hand::hand_source::HandSource;
use softgrasp_hand::live_hand::LiveHand;
use softgrasp_hand::loaded_object::LoadedObject;
use softgrasp_hand::mouse::{MouseHand, MouseInput};
use softgrasp_hand::notice::Notice;
use softgrasp_hand::recording::{Intervention, Recorder, Replayed};
use softgrasp_hand::scripted::Seen;
use softgrasp_hand::sent::{Sent, WhichHand};
use softgrasp_window::view::control::Control;

use crate::ask::solve_settings::Subscription;
use crate::pace::tick_budget::{Priority, TickBudget};
use crate::pace::{Due, Pace};
use crate::run::grasp_loop::GraspLoop;
use crate::run::latency::LatencyLedger;
use crate::run::recorded_tick::{news, scene, stage_digests, tick_seen};
use crate::run::run_report::{ReplaySummary, RunReport};
use crate::run::tick_outcome::{LoopEvent, TickOutcome};

/// A run. It has no clock: the caller says which tick is due.
pub struct Session {
    grasp_loop: GraspLoop,
    hand: HandSource,
    second: Option<HandSource>,
    seen: Seen,
    seen_by_second: Seen,
    report: RunReport,
    budget: TickBudget,
    ends_with_script: bool,
    /// Commands of the menu, of which each tick takes one.
    commands: VecDeque<Command>,
    notices: Vec<Notice>,
    /// State, tips and segments after the last tick, without its news.
    last: TickOutcome,
    recorder: Option<Recorder>,
    latency: LatencyLedger,
    /// Faults of the devices when they were last checked.
    complaints: Vec<Notice>,
    /// Whether a script waits while the server prepares the object.
    awaits_model: bool,
}

/// Number of ticks between two checks of the devices.
const COMPLAIN_EVERY: u64 = 30;

impl Session {
    /// A run that has not begun. The thread that plays it gets `priority` with the first tick. The run
    /// ends with the script, or goes on with a hand at rest.
    pub fn new(
        grasp_loop: GraspLoop,
        hand: impl Into<HandSource>,
        report: RunReport,
        priority: Priority,
        ends_with_script: bool,
    ) -> Self {
        let (mut grasp_loop, hand) = (grasp_loop, hand.into());
        if matches!(hand, HandSource::Replay(_)) {
            grasp_loop.want_digests();
        }
        Self {
            grasp_loop,
            hand,
            second: None,
            seen: Seen::default(),
            seen_by_second: Seen::default(),
            report,
            budget: TickBudget::new(priority),
            ends_with_script,
            commands: VecDeque::new(),
            notices: Vec::new(),
            last: TickOutcome::default(),
            recorder: None,
            latency: LatencyLedger::default(),
            complaints: Vec::new(),
            awaits_model: false,
        }
    }

    /// Lets a second hand act beside the first. The run ends with the scripts when both are over.
    pub fn act_with(&mut self, second: HandSource) {
        self.second = Some(second);
    }

    /// Makes a script wait until the server has prepared the object: for a person who watches.
    pub fn await_model(&mut self) {
        self.awaits_model = true;
    }

    /// Plays the tick that is due; `None` if the script is over. Missed ticks are counted; the hand is
    /// where it is now.
    ///
    /// Units: `now_s` s on the client's clock.
    ///
    /// # Errors
    /// [`ObjectError`] if the answer does not fit the object.
    pub fn play(&mut self, due: Due, now_s: f64) -> Result<Option<TickOutcome>, ObjectError> {
        self.budget.begin();
        let began = Instant::now();
        // Between the ticks the object may have been turned or replaced.
        let object_awaited = self.awaits_model && !self.grasp_loop.is_object_ready();
        let seen = [&mut self.seen, &mut self.seen_by_second];
        for (seen, which) in seen.into_iter().zip(WhichHand::ALL) {
            seen.world_from_object = *self.grasp_loop.aimed(which).1;
            seen.object_awaited = object_awaited;
        }
        let (due, now_s, mut sent) = self.next(due, now_s);
        if sent.over && self.ends_with_script {
            self.report.add_skipped(due.skipped);
            return Ok(None);
        }
        if sent.command.is_none() {
            sent.command = self.commands.pop_front();
        }
        let mut outcome = self.grasp_loop.tick(due.tick, now_s, &sent)?;
        self.complain(due.tick, now_s, &mut outcome);
        self.record(due, now_s, &sent, &outcome);
        (self.seen, self.seen_by_second) = (outcome.seen, outcome.seen_by_second);
        self.hear(&outcome);
        self.report.add(due, now_s, &outcome);
        let computed = self.budget.end();
        self.note_latency(due.tick, now_s, began.elapsed(), &outcome);
        self.report.add_computed(computed);
        Ok(Some(outcome))
    }

    /// Input of a tick; a replayed one has the number and the time that were recorded.
    fn next(&mut self, due: Due, now_s: f64) -> (Due, f64, Sent) {
        if let HandSource::Replay(hand) = &mut self.hand {
            let Some(replayed) = hand.next_tick() else {
                return (due, now_s, Sent { over: true, ..Sent::default() });
            };
            let Replayed { tick, skipped, now_s, interventions, sent } = replayed;
            interventions.into_iter().for_each(|done| self.repeat(done));
            return (Due { tick, skipped }, now_s, sent);
        }
        let [object, of_second] = WhichHand::ALL.map(|which| self.grasp_loop.aimed(which).0);
        let ticks = due.skipped + 1;
        let mut sent = self.hand.next_after(ticks, now_s, &self.seen, object);
        if let Some(second) = &mut self.second {
            sent.join_second(second.next_after(ticks, now_s, &self.seen_by_second, of_second));
        }
        (due, now_s, sent)
    }

    /// Repeats what a person did to the object between two recorded ticks.
    fn repeat(&mut self, done: Intervention) {
        let repeated = match done {
            Intervention::Turn([x, y, z, w]) => {
                let rotation = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
                self.grasp_loop.turn_object(rotation).map_err(|error| error.to_string())
            }
            Intervention::UndoKeepShape => {
                self.grasp_loop.undo_keep_shape().map_err(|notice| notice.text)
            }
            Intervention::NotReplayed(what) => Err(format!("a replay cannot repeat this: {what}")),
        };
        self.notices.extend(repeated.err().map(Notice::refused));
    }

    /// Tells the faults of devices that were open before, or never were.
    fn complain(&mut self, tick: u64, now_s: f64, outcome: &mut TickOutcome) {
        if tick % COMPLAIN_EVERY != COMPLAIN_EVERY - 1 || self.live_hands().next().is_none() {
            return;
        }
        let complaints = self.complaints(now_s);
        let new = complaints.iter().filter(|told| !self.complaints.contains(told));
        outcome.events.extend(new.cloned().map(LoopEvent::Device));
        self.complaints = complaints;
    }

    fn live_hands(&self) -> impl Iterator<Item = &LiveHand> {
        std::iter::once(&self.hand).chain(&self.second).filter_map(HandSource::as_live)
    }

    /// Faults of devices, and of the records that they send.
    fn complaints(&self, now_s: f64) -> Vec<Notice> {
        let readers = self.grasp_loop.readers();
        let heard = readers.heard(now_s);
        let of_devices = self.live_hands().flat_map(|hand| hand.complaints(heard));
        of_devices.chain(readers.complaints().into_iter().map(Notice::refused)).collect()
    }

    /// Records a tick, and compares it with a recording during a replay.
    fn record(&mut self, due: Due, now_s: f64, sent: &Sent, outcome: &TickOutcome) {
        if let HandSource::Replay(hand) = &mut self.hand {
            hand.compare(&stage_digests(&self.grasp_loop, outcome));
        }
        if let Some(recorder) = &mut self.recorder {
            let grasp_loop = &self.grasp_loop;
            let stages = stage_digests(grasp_loop, outcome);
            let made = tick_seen(due, now_s, grasp_loop, outcome, stages);
            let nodes = grasp_loop.object().surface().nodes.len();
            let with_surface = recorder.wants_surface(now_s, nodes);
            let scene = scene(due.tick, now_s, grasp_loop, with_surface);
            recorder.tick(sent, news(outcome), scene, made);
        }
    }

    /// Books the times of samples, question and shown answers.
    fn note_latency(&mut self, tick: u64, now_s: f64, computed: Duration, outcome: &TickOutcome) {
        // Ticks that wait for their answers have no time of their own.
        if self.grasp_loop.pace() == Pace::Lockstep {
            return;
        }
        let end_s = now_s + computed.as_secs_f64();
        for (asked, solve) in &outcome.answers {
            self.latency.shown(*asked, solve.round_trip_ms, end_s);
        }
        let sample_s = self.grasp_loop.readers().sample_time_s(now_s);
        if let (Some(StateName::Deforming), Some(sample_s)) = (outcome.state, sample_s) {
            self.latency.asked(tick, sample_s, now_s, end_s);
        }
    }

    /// Records every tick from now on.
    pub fn record_to(&mut self, recorder: Recorder) {
        self.grasp_loop.want_digests();
        self.recorder = Some(recorder);
    }

    fn intervened(&mut self, intervention: Intervention) {
        if let Some(recorder) = &mut self.recorder {
            recorder.intervene(intervention);
        }
    }

    /// Continues what is under way while no tick is played. The outcome repeats what the last tick
    /// showed.
    ///
    /// # Errors
    /// The same as those of [`Session::play`].
    pub fn idle(&mut self) -> Result<TickOutcome, ObjectError> {
        let outcome = self.grasp_loop.idle()?;
        if let Some(recorder) = &mut self.recorder {
            recorder.idle(news(&outcome));
        }
        self.report.add_last(&outcome);
        self.hear(&outcome);
        let TickOutcome { events, answers, unanswered, notices, .. } = outcome;
        let state = self.last.state.map(|_| self.grasp_loop.state());
        Ok(TickOutcome { events, answers, unanswered, notices, state, ..self.last.clone() })
    }

    /// Grants a person's wish, or begins to; [`Session::take_notices`] tells the result. Pause, step and
    /// stop change nothing here: they concern whoever plays the ticks.
    pub fn apply(&mut self, control: Control) {
        let refused = match control {
            Control::KeepShape => self.command(Command::KeepShape),
            Control::Detach => self.command(Command::Release),
            Control::ReturnHome => self.command(Command::ReturnHome),
            Control::UndoKeepShape => {
                let begun = self.grasp_loop.undo_keep_shape();
                if begun.is_ok() {
                    self.intervened(Intervention::UndoKeepShape);
                }
                begun
            }
            Control::Save(path) => self.save(path),
            Control::ReplaceObject(loaded) => self.replace_object(&loaded),
            Control::ReplaceHand(hand) => self.replace_hand(*hand),
            Control::TurnObject(rotation) => self.turn_object(rotation),
            Control::Restart => self.restart(),
            Control::Mouse(input) => {
                self.take_mouse(input);
                Ok(())
            }
            Control::SetMethod(method) => {
                self.notices.push(Notice::done(format!("solved by {method} from now on")));
                self.grasp_loop.set_method(method);
                Ok(())
            }
            Control::SetMaterial(material) => {
                let set = self.grasp_loop.set_material(material);
                if set.is_ok() {
                    let what = "the object became of another material".to_owned();
                    self.intervened(Intervention::NotReplayed(what));
                }
                set
            }
            Control::SetMaxError(max_error) => self.set_max_error(max_error),
            Control::SetForces(forces) => {
                self.grasp_loop.wishes_mut().forces = forces;
                Ok(())
            }
            Control::SetWhole(whole) => {
                let subscription = if whole { Subscription::Whole } else { Subscription::Surface };
                self.grasp_loop.set_subscription(subscription);
                Ok(())
            }
            Control::EndWithScript => {
                self.ends_with_script = true;
                Ok(())
            }
            Control::Pause | Control::Resume | Control::Step | Control::Stop => Ok(()),
        };
        self.notices.extend(refused.err());
    }

    /// Counts ticks that were missed at the end and are not played.
    pub fn skip(&mut self, ticks: u64) {
        self.report.add_skipped(ticks);
    }

    /// Grasp loop of the run.
    pub fn grasp_loop(&self) -> &GraspLoop {
        &self.grasp_loop
    }

    /// First hand of the run.
    pub fn hand(&self) -> &HandSource {
        &self.hand
    }

    /// Whether all hands are played by the program, so that they can be paused.
    pub fn is_played(&self) -> bool {
        self.hand.is_played() && self.second.as_ref().is_none_or(HandSource::is_played)
    }

    /// Whether a hand can go on only with a window.
    pub fn needs_window(&self) -> bool {
        self.hand.needs_window() || self.second.as_ref().is_some_and(HandSource::needs_window)
    }

    fn mouse_hands(&mut self) -> impl Iterator<Item = &mut MouseHand> {
        std::iter::once(&mut self.hand).chain(&mut self.second).filter_map(HandSource::as_mouse)
    }

    /// Passes on a wish of the person with the mouse. A hand that is to go somewhere by itself goes to the
    /// object that it is over.
    fn take_mouse(&mut self, input: MouseInput) {
        let Self { grasp_loop, hand, second, .. } = self;
        let hands = std::iter::once(hand).chain(second).zip(WhichHand::ALL);
        for (hand, which) in hands.filter_map(|(hand, which)| Some((hand.as_mouse()?, which))) {
            if input.is_errand() && grasp_loop.aim_at_nearest(which, &hand.looks_at()) {
                hand.turn_to_another_object();
            }
            hand.take(input);
        }
    }

    /// Whether commands wait for the next tick.
    pub fn has_commands(&self) -> bool {
        !self.commands.is_empty()
    }

    /// Sentences for the person since the last call.
    pub fn take_notices(&mut self) -> Vec<Notice> {
        let said: Vec<Notice> = self.mouse_hands().flat_map(MouseHand::take_notices).collect();
        self.notices.extend(said);
        std::mem::take(&mut self.notices)
    }

    /// Waits until all requests have ended, for at most `at_most`; returns whether they have.
    pub fn wait_idle(&self, at_most: Duration) -> bool {
        self.grasp_loop.wait_idle(at_most)
    }

    /// Waits until only the planning of the hand is under way; see [`GraspLoop::settle`].
    pub fn settle(&mut self, at_most: Duration) {
        self.grasp_loop.settle(at_most);
    }

    /// Ends the run; `interrupted` if the user ended it.
    ///
    /// # Errors
    /// The same as those of [`Session::play`].
    pub fn finish(mut self, interrupted: bool) -> Result<RunReport, ObjectError> {
        self.report.add_last(&self.grasp_loop.take_last()?);
        self.report.interrupted = interrupted;
        for object in &mut self.report.further_objects {
            let (_, world_from_object) = self.grasp_loop.object_at(object.number - 1);
            object.at_m = world_from_object.translation.vector.into();
        }
        self.report.finish(self.grasp_loop.readers().faults(), &self.budget);
        self.report.summary.latency = self.latency.summary();
        self.report.force = self.grasp_loop.end_force();
        let fit = self.grasp_loop.readers().fit_errors();
        self.report.summary.joint_fit = (fit.records > 0).then_some(fit);
        self.report.summary.pieces_dropped = self.live_hands().map(LiveHand::dropped).sum();
        let is_live = self.live_hands().next().is_some();
        if is_live && !self.grasp_loop.has_hand() {
            let why = self.complaints(0.0).into_iter().map(|told| told.text);
            self.report.no_hand = Some(why.collect());
        }
        if let HandSource::Replay(hand) = self.hand {
            self.report.replay = Some(ReplaySummary::of(&hand));
        }
        if let Some(Err(error)) = self.recorder.map(Recorder::finish) {
            self.report.recording_failed = Some(softgrasp_os::one_line(&error));
        }
        Ok(self.report)
    }

    /// Takes the news of a tick that the person is told.
    fn hear(&mut self, outcome: &TickOutcome) {
        self.notices.extend(outcome.events.iter().filter_map(LoopEvent::notice));
        self.notices.extend(outcome.notices.iter().cloned());
        if outcome.state.is_some() {
            self.last = outcome.without_news();
        }
    }

    fn command(&mut self, command: Command) -> Result<(), Notice> {
        self.commands.push_back(command);
        Ok(())
    }

    fn save(&mut self, path: PathBuf) -> Result<(), Notice> {
        self.notices.extend(self.grasp_loop.save(path)?);
        Ok(())
    }

    fn replace_object(&mut self, loaded: &LoadedObject) -> Result<(), Notice> {
        if matches!(self.hand, HandSource::Replay(_)) {
            return Err(Notice::refused("a recording is of the object that it was made with"));
        }
        let LoadedObject { summary, object, plan, .. } = loaded;
        let plan = match (plan, self.hand.is_played()) {
            (Err(error), true) => return Err(Notice::refused(error.to_string())),
            (plan, _) => plan.as_ref().ok(),
        };
        self.grasp_loop.replace_object(Arc::clone(object.rest_shape()), &summary.name)?;
        self.grasp_loop.let_object_go();
        if self.grasp_loop.aims_at_touched(WhichHand::First) {
            self.hand.meet_new_object(plan.copied());
        }
        // The plan is the first hand's: another one makes its own.
        if self.grasp_loop.aims_at_touched(WhichHand::Second) {
            self.second.iter_mut().for_each(|second| second.meet_new_object(None));
        }
        self.intervened(Intervention::NotReplayed(format!("the object became {}", summary.name)));
        Ok(())
    }

    fn replace_hand(&mut self, mut hand: HandSource) -> Result<(), Notice> {
        self.grasp_loop.let_object_go();
        if let HandSource::Scripted(hand) = &mut hand {
            // Scripts are made for an object at home, as it is now.
            self.grasp_loop.put_object_home();
            hand.restart(None);
        }
        let what = format!("the hand became {}", hand.name());
        self.intervened(Intervention::NotReplayed(what));
        let text = format!("the hand is now {}", hand.name());
        self.hand = hand;
        self.notices.push(Notice::done(text));
        Ok(())
    }

    fn restart(&mut self) -> Result<(), Notice> {
        let HandSource::Scripted(hand) = &mut self.hand else {
            let text = "only a script can be played again from its beginning";
            return Err(Notice::refused(text));
        };
        self.grasp_loop.begin_anew()?;
        hand.restart(None);
        if let Some(HandSource::Scripted(second)) = &mut self.second {
            second.restart(None);
        }
        self.intervened(Intervention::NotReplayed("the script began again".to_owned()));
        Ok(())
    }

    fn turn_object(&mut self, rotation: UnitQuaternion<f64>) -> Result<(), Notice> {
        if self.hand.is_played() || self.second.as_ref().is_some_and(HandSource::is_played) {
            let text = "a script grasps the object as it stands; take the mouse hand to turn it";
            return Err(Notice::refused(text));
        }
        let turned = self.grasp_loop.turn_object(rotation);
        if turned.is_ok() {
            self.intervened(Intervention::Turn(rotation.coords.into()));
        }
        turned.map_err(|error| Notice::refused(format!("the object is not turned: {error}")))
    }

    fn set_max_error(&mut self, max_error: Option<f64>) -> Result<(), Notice> {
        if max_error.is_some_and(|error| !(error.is_finite() && error > 0.0)) {
            let text = "the largest error is not taken: it must be a number above 0";
            return Err(Notice::refused(text));
        }
        self.grasp_loop.wishes_mut().max_error = max_error;
        Ok(())
    }
}
