//! The objects of a run: one, or several that lie beside each other on one table and are each asked about
//! by themselves.

use nalgebra::{Isometry3, Point3, Translation3};
use softgrasp_grasp::grasp::{Command, HandSegments, StateName};
use softgrasp_grasp::object::{ObjectError, RestShape};
use softgrasp_hand::sent::WhichHand;

use crate::object::table_layout::Footprint;
use crate::run::friction::FrictionTick;
use crate::run::table_object::TableObject;
use crate::run::tick_outcome::{LoopEvent, TickOutcome};

/// The objects of a run, numbered from 0. They do not touch each other: each has its own model, its own
/// link to the server and its own steps.
pub(crate) struct Objects {
    first: TableObject,
    further: Vec<TableObject>,
    /// Number of the object that a hand touched last.
    touched: usize,
    /// Number of the object that each hand goes to by itself.
    aims: [usize; 2],
}

impl Objects {
    /// The one object of a run.
    pub(crate) fn new(first: TableObject) -> Self {
        Self { first, further: Vec::new(), touched: 0, aims: [0; 2] }
    }

    /// Lays a further object on the table of the first.
    pub(crate) fn add(&mut self, mut further: TableObject) {
        self.first.holding.keep_table();
        further.holding.keep_table();
        self.further.push(further);
    }

    /// Number of objects.
    pub(crate) fn count(&self) -> usize {
        1 + self.further.len()
    }

    /// The first object.
    pub(crate) fn first(&self) -> &TableObject {
        &self.first
    }

    pub(crate) fn first_mut(&mut self) -> &mut TableObject {
        &mut self.first
    }

    /// Object of a number; the first for a number that none has.
    pub(crate) fn get(&self, number: usize) -> &TableObject {
        number.checked_sub(1).and_then(|at| self.further.get(at)).unwrap_or(&self.first)
    }

    /// All objects, the first one first.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &TableObject> {
        std::iter::once(&self.first).chain(&self.further)
    }

    pub(crate) fn iter_mut(&mut self) -> impl Iterator<Item = &mut TableObject> {
        std::iter::once(&mut self.first).chain(&mut self.further)
    }

    /// Number of the object that a hand touched last.
    pub(crate) fn touched(&self) -> usize {
        self.touched
    }

    /// The object that a hand touched last; the first if none did.
    pub(crate) fn touched_mut(&mut self) -> &mut TableObject {
        match self.touched.checked_sub(1) {
            Some(at) if at < self.further.len() => &mut self.further[at],
            _ => &mut self.first,
        }
    }

    /// Number of the object that a hand goes to by itself.
    pub(crate) fn aimed(&self, which: WhichHand) -> usize {
        self.aims[which.index()]
    }

    /// Lets a hand go to an object by itself.
    pub(crate) fn aim(&mut self, which: WhichHand, number: usize) {
        self.aims[which.index()] = number.min(self.further.len());
    }

    /// Number of the object whose centre is nearest to a point, seen from above.
    ///
    /// Units: m. Frame: world.
    pub(crate) fn nearest_to(&self, point: &Point3<f64>) -> usize {
        let aside = |object: &TableObject| (object.centre() - point).xz().norm();
        let nearest =
            self.iter().enumerate().min_by(|(_, a), (_, b)| aside(a).total_cmp(&aside(b)));
        nearest.map_or(0, |(number, _)| number)
    }

    /// Puts the first object at another home; the others, and the table, keep their place to it.
    pub(crate) fn put_first_at(&mut self, home: Isometry3<f64>) {
        let moved = home.translation.vector - self.first.holding.thesis().home().translation.vector;
        for object in &mut self.further {
            let kept = *object.holding.thesis().home();
            object.set_home(Translation3::from(moved) * kept);
        }
        self.first.set_home(home);
    }

    /// Checks that a shape has room at the home of the object that was touched last.
    ///
    /// # Errors
    /// Sentence that names the object in its way.
    pub(crate) fn check_room_for(&self, rest: &RestShape) -> Result<(), String> {
        let home = self.get(self.touched).holding.thesis().home();
        let new = Footprint::of(rest.mesh().vertices().iter().map(|point| home * point));
        let others = self.iter().enumerate().filter(|(number, _)| *number != self.touched);
        for (number, other) in others {
            let pose = other.world_from_object();
            let there = Footprint::of(other.object().shape().iter().map(|point| pose * point));
            if new.overlaps(&there) {
                let name = &other.name;
                return Err(format!("it would lie in object {}, {name}", number + 1));
            }
        }
        Ok(())
    }

    /// Lets every object take what the server has answered.
    ///
    /// # Errors
    /// [`ObjectError`] if an answer does not fit its object.
    pub(crate) fn pick_up(&mut self, outcome: &mut TickOutcome) -> Result<(), ObjectError> {
        self.each(outcome, TableObject::pick_up)
    }

    /// Does the same with every object and its part of the outcome.
    ///
    /// # Errors
    /// The first error of an object.
    pub(crate) fn each(
        &mut self,
        outcome: &mut TickOutcome,
        mut act: impl FnMut(&mut TableObject, &mut TickOutcome) -> Result<(), ObjectError>,
    ) -> Result<(), ObjectError> {
        act(&mut self.first, outcome)?;
        outcome.further.resize_with(self.further.len(), TickOutcome::default);
        let mut further = self.further.iter_mut().zip(&mut outcome.further);
        further.try_for_each(|(object, part)| act(object, part))
    }

    /// Plays a tick of a grasp by friction; returns the segments of each hand as they are shown. Every
    /// object's step is asked for before the first answer is awaited.
    ///
    /// # Errors
    /// [`ObjectError`] when an object cannot be shown any more.
    pub(crate) fn play(
        &mut self,
        tick: &FrictionTick,
        command: Option<Command>,
        outcome: &mut TickOutcome,
    ) -> Result<[Option<HandSegments>; 2], ObjectError> {
        let (touched, mut number) = (self.touched, 0);
        let mut asked = Vec::with_capacity(self.count());
        self.each(outcome, |object, part| {
            let own = command.filter(|_| number == touched);
            number += 1;
            let own = object.allowed(own, part);
            part.seen.keeping = object.is_keeping();
            asked.push(tick.begin(own, object, part)?);
            Ok(())
        })?;
        let mut asked = asked.into_iter();
        self.each(outcome, |object, part| match asked.next() {
            Some(asked) => tick.end(asked, object, part),
            None => Ok(()),
        })?;
        self.note_touch(outcome);
        self.tell_hands(outcome);
        let grasps: Vec<_> = self.iter().filter_map(|object| object.holding.friction()).collect();
        Ok(tick.shown_hands(&grasps))
    }

    /// Notes which object the hands touch; of several the one that was touched before.
    fn note_touch(&mut self, outcome: &mut TickOutcome) {
        let deforms = |object: &TableObject| object.holding.state_name() == StateName::Deforming;
        let other = self.iter().position(deforms);
        if let Some(number) = other.filter(|_| !deforms(self.get(self.touched))) {
            self.touched = number;
        }
        outcome.touched = self.touched;
    }

    /// Tells each hand of the object that it goes to.
    fn tell_hands(&self, outcome: &mut TickOutcome) {
        let [first, second] = self.aims.map(|aim| {
            let part = outcome.part(aim);
            (part.seen, part.seen_by_second)
        });
        (outcome.seen, outcome.seen_by_second) = (first.0, second.1);
    }

    /// Moves the news of further objects into those of the run, each with the name of its object.
    pub(crate) fn gather_news(&self, outcome: &mut TickOutcome) {
        let TickOutcome { events, notices, further, .. } = outcome;
        for ((number, object), part) in self.iter().enumerate().skip(1).zip(further) {
            let label = || format!("object {}, {}", number + 1, object.name);
            let of_object =
                |event| LoopEvent::OfFurther { object: label(), event: Box::new(event) };
            events.extend(part.events.drain(..).map(of_object));
            notices.extend(part.notices.drain(..).map(|mut notice| {
                notice.text = format!("{} ({})", notice.text, label());
                notice
            }));
        }
    }
}
