//! One tick of the client in fixed order (bytes, pose, contacts, grasp, request, answer), and a person's
//! changes of the object between two ticks.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use softgrasp_force::{ForceReport, Renderer};
use softgrasp_grasp::grasp::{Command, Contact, Grasp, GraspError, HandSegments, StateName};
use softgrasp_grasp::hand::HandPose;
use softgrasp_grasp::object::{ObjectError, RestShape, SoftObject};
use softgrasp_hand::hand_reader::HandReader;
use softgrasp_hand::hand_readers::HandReaders;
use softgrasp_hand::notice::Notice;
use softgrasp_hand::sent::{Sent, WhichHand};
use softgrasp_protocol::{Material, MethodName};
use softgrasp_window::view::object_skin::Look;

use crate::ask::link::Link;
use crate::ask::solve_settings::{AnswerWishes, SolveSettings, Subscription};
use crate::object::object_place::ObjectPlace;
use crate::pace::Pace;
use crate::run::contact_grasp::{ContactGrasp, ContactScene};
use crate::run::felt::FeltHand;
use crate::run::friction::FrictionTick;
use crate::run::objects::Objects;
use crate::run::placing::where_it_closes;
use crate::run::table_object::{FurtherObject, TableObject};
use crate::run::thesis_tick::ThesisTick;
use crate::run::tick_outcome::TickOutcome;
use crate::run::tracked_hands::TrackedHands;

/// The client's loop between devices and server.
pub struct GraspLoop {
    hands: TrackedHands,
    objects: Objects,
    /// Place where the first object is put when the first hand comes.
    place: ObjectPlace,
    /// Whether the table stops the hand: one that was put below an object in the hand is not there for the
    /// hand.
    stops_hand: bool,
}

impl GraspLoop {
    /// Loop of one hand or two around an object at the origin; sends its model to the server at once. To be
    /// made before the calling thread asks for real-time priority. Two hands need a grasp by friction.
    ///
    /// # Errors
    /// Error of the operating system if it starts no thread.
    pub fn try_new(
        readers: impl Into<HandReaders>,
        object: SoftObject,
        grasp: Grasp,
        link: Link,
        settings: SolveSettings,
        pace: Pace,
    ) -> std::io::Result<Self> {
        let first = TableObject::start(object, grasp, link, settings, pace)?;
        Ok(Self {
            hands: TrackedHands::new(readers.into()),
            objects: Objects::new(first),
            place: ObjectPlace::Home,
            stops_hand: true,
        })
    }

    /// Lays a further object on the table of a grasp by friction; sends its model to the server at once.
    /// To be made before the calling thread asks for real-time priority. Objects do not touch each other.
    ///
    /// # Errors
    /// Error of the operating system if it starts no thread.
    pub fn lay_beside(&mut self, further: FurtherObject) -> std::io::Result<()> {
        let further = TableObject::further(further, self.pace())?;
        self.objects.add(further);
        Ok(())
    }

    /// Gives the first object its name and look, which are shown where there are several.
    pub fn name_first(&mut self, name: &str, look: Look) {
        let first = self.objects.first_mut();
        (first.name, first.look) = (name.to_owned(), look);
    }

    /// The objects of the run.
    pub(crate) fn objects(&self) -> &Objects {
        &self.objects
    }

    /// Number of objects on the table.
    pub fn object_count(&self) -> usize {
        self.objects.count()
    }

    /// Object of a number, from 0, and its pose in the world; the first for a number that none has.
    pub fn object_at(&self, number: usize) -> (&SoftObject, &Isometry3<f64>) {
        let object = self.objects.get(number);
        (object.object(), object.world_from_object())
    }

    /// Lets a hand go by itself to the object of a number, from 0.
    pub fn aim(&mut self, which: WhichHand, number: usize) {
        self.objects.aim(which, number);
    }

    /// Lets a hand go by itself to the object that is nearest to a point, seen from above; returns whether
    /// it is another one than before.
    ///
    /// Units: m. Frame: world.
    pub fn aim_at_nearest(&mut self, which: WhichHand, point: &Point3<f64>) -> bool {
        let (before, nearest) = (self.objects.aimed(which), self.objects.nearest_to(point));
        self.objects.aim(which, nearest);
        nearest != before
    }

    /// Whether a hand goes by itself to the object that was touched last.
    pub fn aims_at_touched(&self, which: WhichHand) -> bool {
        self.objects.aimed(which) == self.objects.touched()
    }

    /// Object that a hand goes to by itself, and its pose in the world.
    pub fn aimed(&self, which: WhichHand) -> (&SoftObject, &Isometry3<f64>) {
        self.object_at(self.objects.aimed(which))
    }

    /// Makes the object free and heavy, so that the hand grasps it by contact with friction instead of by
    /// the thesis's rules.
    pub fn grasp_with_friction(&mut self, scene: ContactScene) {
        let first = self.objects.first_mut();
        first.holding.by_friction(scene, &mut first.live.shown);
    }

    /// Lets the hand feel what a grasp by friction presses it with.
    pub fn feel(&mut self, renderer: Renderer) {
        if let Some(contact) = self.objects.first_mut().holding.friction_mut() {
            contact.feel(FeltHand::new(renderer));
        }
    }

    /// Ends the force and tells of it; `None` without any.
    pub fn end_force(&mut self) -> Option<ForceReport> {
        self.objects.first_mut().holding.friction_mut()?.end_force()
    }

    /// State of the grasp of the first object by friction, if there is one.
    pub fn contact_grasp(&self) -> Option<&ContactGrasp> {
        self.objects.first().holding.friction()
    }

    /// Sets the time from tick to tick: live questions ask for their answer within it.
    pub fn tick_every(&mut self, period: Duration) {
        self.objects.iter_mut().for_each(|object| object.live.questions.tick_every(period));
    }

    /// Whether ticks wait for answers.
    pub fn pace(&self) -> Pace {
        self.objects.first().live.questions.pace()
    }

    /// Adds the digest of the question to every later outcome.
    pub fn want_digests(&mut self) {
        self.objects.first_mut().live.questions.want_digests();
    }

    /// The first object with its present shape.
    pub fn object(&self) -> &SoftObject {
        self.objects.first().object()
    }

    /// Pose of the first object in the world after the last tick.
    pub fn world_from_object(&self) -> &Isometry3<f64> {
        self.objects.first().world_from_object()
    }

    /// State of the grasp of the first object after the last tick.
    pub fn state(&self) -> StateName {
        self.objects.first().holding.state_name()
    }

    /// First hand of the last tick, as measured, but never below the table of a grasp by friction.
    pub fn hand(&self) -> Option<&HandPose> {
        self.hands.pose(WhichHand::First)
    }

    /// Whether there was a hand in the last tick.
    pub fn has_hand(&self) -> bool {
        WhichHand::ALL.into_iter().any(|which| self.hands.pose(which).is_some())
    }

    /// Hand of the last tick, as [`GraspLoop::hand`], with its segments as the tick shows them, in the
    /// world: those that may not enter the object stay at their last free pose.
    pub fn shown_hand(&self, which: WhichHand) -> Option<(&HandPose, &HandSegments)> {
        Some((self.hands.pose(which)?, self.hands.shown(which)))
    }

    /// Segments of the first hand as the last tick shows them.
    pub fn shown_segments(&self) -> &HandSegments {
        self.hands.shown(WhichHand::First)
    }

    /// Contact of each fingertip after the last tick, thumb first.
    pub fn contacts(&self) -> [Option<Contact>; 5] {
        self.objects.first().holding.contacts()
    }

    /// Force of each fingertip on the object that was touched last in its shown shape, thumb first. `None` if the fingers do
    /// not deform it, until the first answer, and unless [`AnswerWishes::forces`] asks for them.
    ///
    /// Units: N. Frame: the object's.
    pub fn fingertip_forces(&self) -> Option<[Vector3<f64>; 5]> {
        self.objects.get(self.objects.touched()).live.shown.forces()
    }

    /// Whether the server has prepared the objects' models.
    pub fn is_model_prepared(&self) -> bool {
        self.objects.iter().all(|object| !object.live.questions.link().is_giving_model())
    }

    /// Whether the server is connected.
    pub fn is_connected(&self) -> bool {
        self.objects.iter().all(|object| object.live.questions.link().is_connected())
    }

    /// Whether the objects are those asked for, and the server keeps their models.
    pub fn is_object_ready(&self) -> bool {
        self.objects.iter().all(TableObject::is_ready)
    }

    /// Reader of the first hand.
    pub fn reader(&self) -> &HandReader {
        self.hands.readers.first()
    }

    /// Readers of all hands, for their faults.
    pub fn readers(&self) -> &HandReaders {
        &self.hands.readers
    }

    /// Waits until all requests have ended, for at most `at_most`; returns whether they have.
    pub fn wait_idle(&self, at_most: Duration) -> bool {
        // Each waits for what is left of the time that all have.
        let until = Instant::now() + at_most;
        let left = || until.saturating_duration_since(Instant::now());
        self.objects.iter().all(|object| object.live.questions.link().wait_idle(left()))
    }

    /// Waits until all requests have ended, for at most `at_most`, and until background work is done:
    /// then what the next tick finds does not depend on time.
    pub fn settle(&mut self, at_most: Duration) {
        self.objects.iter_mut().for_each(|object| object.live.changing.settle());
        self.wait_idle(at_most);
    }

    /// Takes what has come from the server since the last tick, if no tick follows.
    ///
    /// # Errors
    /// [`ObjectError`] if the answer does not fit the object.
    pub fn take_last(&mut self) -> Result<TickOutcome, ObjectError> {
        let mut outcome = TickOutcome::default();
        self.objects.pick_up(&mut outcome)?;
        self.objects.gather_news(&mut outcome);
        Ok(outcome)
    }

    /// Plays one tick, at a time on the client's clock.
    ///
    /// # Errors
    /// [`ObjectError`] if the answer does not fit the object.
    pub fn tick(&mut self, tick: u64, now_s: f64, sent: &Sent) -> Result<TickOutcome, ObjectError> {
        let mut outcome = TickOutcome::default();
        self.hands.readers.feed(&sent.arrivals, now_s);
        self.objects.first_mut().live.questions.begin_tick(sent.recorded.as_ref());
        self.objects.each(&mut outcome, |object, part| {
            object.pick_up(part)?;
            object.save_when_whole(part);
            Ok(())
        })?;
        self.hands.look_at_devices(now_s, &mut outcome);
        let played = self.play(tick, now_s, sent.command, &mut outcome);
        self.objects.gather_news(&mut outcome);
        played.map(|()| outcome)
    }

    /// Plays the part of a tick that needs a hand.
    fn play(
        &mut self,
        tick: u64,
        now_s: f64,
        command: Option<Command>,
        outcome: &mut TickOutcome,
    ) -> Result<(), ObjectError> {
        // Until the devices of a hand have spoken there is none to act with.
        if self.readers().heard(now_s) == 0 {
            return Ok(());
        }
        self.meet_first_hand(now_s);
        let hands = self.hands.measured(now_s, self.table_for_hands());
        self.objects.each(outcome, |object, part| {
            object.take_work(part);
            Ok(())
        })?;
        let shown = if self.contact_grasp().is_some() {
            let friction = FrictionTick { tick, now_s, hands };
            self.objects.play(&friction, command, outcome)?
        } else {
            // The thesis's rules know one object and one hand.
            let object = self.objects.first_mut();
            let command = object.allowed(command, outcome);
            let [Some(hand), _] = hands else { return Ok(()) };
            let shown = ThesisTick { tick, hand }.play(command, object, outcome)?;
            outcome.seen.keeping = object.is_keeping();
            [Some(shown), None]
        };
        self.hands.show(&hands, shown);
        Ok(())
    }

    /// Height of the table where it stops hands, m.
    fn table_for_hands(&self) -> Option<f64> {
        let contact = self.contact_grasp().filter(|_| self.stops_hand);
        contact.and_then(|contact| contact.scene().table_y)
    }

    /// Puts the object where the first hand closes that is heard of, if that is wanted.
    fn meet_first_hand(&mut self, now_s: f64) {
        let readers = self.readers();
        let mut heard = WhichHand::ALL.into_iter().filter_map(|which| readers.of(which));
        let heard = heard.find_map(|reader| {
            let (angles, _) = reader.measured(now_s)?;
            Some((angles, reader.hand(now_s)?, reader.setup().dimensions))
        });
        let Some((angles, hand, dimensions)) = heard else { return };
        if std::mem::take(&mut self.place) != ObjectPlace::Hand {
            return;
        }
        self.stops_hand = false;
        let home = where_it_closes(&dimensions, &angles, &hand, self.object());
        self.objects.put_first_at(home);
    }

    /// Sets the place where the object is put when the first hand comes.
    pub fn put_object(&mut self, place: ObjectPlace) {
        self.place = place;
    }

    /// Returns to the rest shape before the last one that was kept; the object is then free at its home.
    /// The result is told in a later tick.
    ///
    /// # Errors
    /// Reason for a refusal, in a sentence.
    pub fn undo_keep_shape(&mut self) -> Result<(), Notice> {
        self.objects.touched_mut().undo_keep_shape()
    }

    /// Puts every object back to its home, with the rest shape that it began with. The result is told in a
    /// later tick.
    ///
    /// # Errors
    /// Reason for a refusal, in a sentence.
    pub fn begin_anew(&mut self) -> Result<(), Notice> {
        self.objects.iter_mut().try_for_each(TableObject::begin_anew)
    }

    /// Replaces the object that was touched last; the new one is free at its home. The result is told in
    /// a later tick.
    ///
    /// # Errors
    /// Reason for a refusal, in a sentence.
    pub fn replace_object(&mut self, rest: Arc<RestShape>, name: &str) -> Result<(), Notice> {
        let has_room = self.objects.check_room_for(&rest);
        has_room.map_err(|why| Notice::refused(format!("{name} is not taken: {why}")))?;
        self.objects.touched_mut().replace(rest, name)
    }

    /// Changes the material of the object that was touched last; it stays held as it is. An element that
    /// was chosen as the cheapest without locking follows Poisson's ratio. The result is told in a later
    /// tick.
    ///
    /// # Errors
    /// Reason for a refusal, in a sentence.
    pub fn set_material(&mut self, material: Material) -> Result<(), Notice> {
        self.objects.touched_mut().live.set_material(material)
    }

    /// Rotates the object that was touched last about its centre while nothing holds it (thesis 6.1.2).
    ///
    /// Frame: the rotation is in the world frame.
    ///
    /// # Errors
    /// [`GraspError`] while the hand holds it.
    pub fn turn_object(&mut self, rotation: UnitQuaternion<f64>) -> Result<(), GraspError> {
        self.objects.touched_mut().turn(rotation)
    }

    /// Releases the objects at their poses, because the hand is replaced.
    pub fn let_object_go(&mut self) {
        self.objects.iter_mut().for_each(|object| object.holding.let_go());
    }

    /// Releases the objects and puts them back to their homes.
    pub fn put_object_home(&mut self) {
        self.objects.iter_mut().for_each(TableObject::put_home);
    }

    /// Saves the object that was touched last in its present shape, with all nodes. If the inside is not known it is asked for
    /// first. The result is told in a later tick.
    ///
    /// # Errors
    /// Reason for a refusal, in a sentence.
    pub fn save(&mut self, path: PathBuf) -> Result<Option<Notice>, Notice> {
        self.objects.touched_mut().save(path)
    }

    /// Sets the method, from the next question on.
    pub fn set_method(&mut self, method: MethodName) {
        for object in self.objects.iter_mut() {
            object.live.questions.set_method(method.clone());
        }
    }

    /// Sets the nodes that are asked for, from the next question on.
    pub fn set_subscription(&mut self, subscription: Subscription) {
        for object in self.objects.iter_mut() {
            object.live.questions.settings_mut().subscription = subscription;
        }
    }

    /// Wishes for the answers of a grasp by the thesis's rules, from the next question on.
    pub fn wishes_mut(&mut self) -> &mut AnswerWishes {
        self.objects.first_mut().live.questions.wishes_mut()
    }

    /// Number of kept shapes of the first object that can be undone.
    pub fn undo_count(&self) -> usize {
        self.objects.first().undo_count()
    }

    /// Continues what is under way while no tick is played.
    ///
    /// # Errors
    /// [`ObjectError`] if the answer does not fit the object.
    pub fn idle(&mut self) -> Result<TickOutcome, ObjectError> {
        let mut outcome = TickOutcome::default();
        let tip_radii = self.reader().setup().dimensions.tip_radii();
        self.objects.each(&mut outcome, |object, part| {
            object.pick_up(part)?;
            object.save_when_whole(part);
            object.take_work(part);
            object.live.ask_for_inside(tip_radii);
            Ok(())
        })?;
        self.objects.gather_news(&mut outcome);
        Ok(outcome)
    }
}
