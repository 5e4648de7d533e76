//! The grasp of one object, and one tick of it: measurements and a command in, events, object pose and
//! displacements out.

use nalgebra::Isometry3;

use super::event::{Command, GraspEvent, KnownNode, StepInput, StepOutput};
use super::rules::{grip, is_clear, leave, recall, touch};
use super::state::{Contact, GraspState, HandSegments, Hold};

/// One object and the hand that may hold it.
///
/// Starts `Detached`, so a hand that begins inside the object has to leave it first.
#[derive(Clone, Debug, PartialEq)]
pub struct Grasp {
    pub(super) state: GraspState,
    world_from_object: Isometry3<f64>,
    home: Isometry3<f64>,
    release_margin: f64,
}

/// Why a grasp cannot be set up.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GraspError {
    /// The release margin is no distance.
    #[error("the release margin is {metres} m; it must be a finite number, at least 0")]
    Margin {
        /// Release margin that was given.
        metres: f64,
    },
    /// A hand holds the object, which stays where the hand has it.
    #[error("a hand holds the object; let it go first")]
    Held,
    /// The pose has a number that is not finite.
    #[error("the object's pose is not finite")]
    Pose,
}

impl Grasp {
    /// Usual release margin, at which a tip lets go: three times the noise of one sensor count at a
    /// fingertip.
    pub const RELEASE_MARGIN_M: f64 = 0.003;

    /// A grasp of an object that rests at `home` (world from object).
    ///
    /// Units: `release_margin` m; see [`Grasp::RELEASE_MARGIN_M`].
    ///
    /// # Errors
    /// [`GraspError::Margin`] if the margin is negative or not finite.
    pub fn try_new(home: Isometry3<f64>, release_margin: f64) -> Result<Self, GraspError> {
        if !(release_margin >= 0.0 && release_margin.is_finite()) {
            return Err(GraspError::Margin { metres: release_margin });
        }
        Ok(Self { state: GraspState::Detached, world_from_object: home, home, release_margin })
    }

    /// The state after the last tick.
    pub fn state(&self) -> &GraspState {
        &self.state
    }

    /// Release margin, m; [`super::sense`] takes it too.
    pub fn release_margin(&self) -> f64 {
        self.release_margin
    }

    /// Home pose, to which the object returns (world from object).
    pub fn home(&self) -> &Isometry3<f64> {
        &self.home
    }

    /// Whether the object follows the palm.
    pub fn is_held(&self) -> bool {
        matches!(self.state, GraspState::Attached { .. } | GraspState::Deforming { .. })
    }

    /// Lets go of the object where it is, between two ticks; a hand inside it has to leave it first.
    ///
    /// For a hand or an object that is replaced. What a user asks for in a tick is a
    /// [`super::Command`].
    pub fn let_go(&mut self) {
        self.state = GraspState::Detached;
    }

    /// Puts the object, which nothing holds, somewhere else, between two ticks. Fingers that avoid
    /// it stay where they are shown in the world.
    ///
    /// Source: thesis 6.1.2, the mouse turns the object.
    ///
    /// # Errors
    /// [`GraspError::Held`] while the object follows the palm, [`GraspError::Pose`] for a pose that
    /// is not finite; nothing has changed then.
    pub fn place(&mut self, world_from_object: Isometry3<f64>) -> Result<(), GraspError> {
        let Isometry3 { rotation, translation } = &world_from_object;
        let mut numbers = rotation.coords.iter().chain(translation.vector.iter());
        if !numbers.all(|number| number.is_finite()) {
            return Err(GraspError::Pose);
        }
        let now_from_before = world_from_object.inverse() * self.world_from_object;
        match &mut self.state {
            GraspState::Attached { .. } | GraspState::Deforming { .. } => {
                return Err(GraspError::Held);
            }
            GraspState::Free { last_free } | GraspState::Avoiding { last_free, .. } => {
                *last_free =
                    last_free.map(|finger| finger.map(|segment| now_from_before * segment));
            }
            GraspState::Detached => {}
        }
        self.world_from_object = world_from_object;
        Ok(())
    }

    /// Sets another home pose, where the object, which nothing holds, is put at once.
    ///
    /// # Errors
    /// Those of [`Grasp::place`].
    pub fn set_home(&mut self, world_from_home: Isometry3<f64>) -> Result<(), GraspError> {
        self.place(world_from_home)?;
        self.home = world_from_home;
        Ok(())
    }

    /// Pose of the object when the palm is at `world_from_palm`: it follows the palm while it is
    /// attached.
    ///
    /// Sense against this pose, then step with the same palm pose.
    pub fn world_from_object(&self, world_from_palm: &Isometry3<f64>) -> Isometry3<f64> {
        match &self.state {
            GraspState::Attached { palm_from_object, .. }
            | GraspState::Deforming { palm_from_object, .. } => world_from_palm * palm_from_object,
            GraspState::Free { .. } | GraspState::Avoiding { .. } | GraspState::Detached => {
                self.world_from_object
            }
        }
    }

    /// Advances by one tick.
    ///
    /// Order within a tick: the object follows the palm; a command that has a meaning ends the tick;
    /// else tips leave, tips touch, the state follows. A tick with a number that is not finite
    /// changes nothing.
    ///
    /// Frames: `input.fingers` sensed against `self.world_from_object(&input.world_from_palm)`.
    ///
    /// Source: thesis 4.5–4.6; table in docs/grasp.md.
    pub fn step(&mut self, input: &StepInput) -> StepOutput {
        let mut events = Vec::new();
        if !input.is_finite() {
            events.push(GraspEvent::InputIgnored);
            events.extend(input.command.map(GraspEvent::Ignored));
            return StepOutput { known: None, ..self.output(input, events) };
        }
        let name_before = self.state.name();
        self.world_from_object = self.world_from_object(&input.world_from_palm);
        if !self.obey(input.command, &mut events) {
            let state = std::mem::replace(&mut self.state, GraspState::Detached);
            self.state = self.follow(state, input, &mut events);
        }
        if self.state.name() != name_before {
            events.push(GraspEvent::Entered(self.state.name()));
        }
        self.output(input, events)
    }

    /// Carries out a command; returns false if there is none or it has no meaning in this state.
    fn obey(&mut self, command: Option<Command>, events: &mut Vec<GraspEvent>) -> bool {
        use GraspState::{Attached, Deforming};
        let Some(command) = command else { return false };
        let event = match (command, &self.state) {
            (Command::KeepShape, Deforming { .. }) => GraspEvent::ShapeKept,
            (Command::Release, Attached { .. } | Deforming { .. }) => GraspEvent::Released,
            (Command::ReturnHome, _) => GraspEvent::ReturnedHome,
            (Command::KeepShape | Command::Release, _) => {
                events.push(GraspEvent::Ignored(command));
                return false;
            }
        };
        if command != Command::Release {
            self.world_from_object = self.home;
        }
        self.state = GraspState::Detached;
        events.push(event);
        true
    }

    /// The state after the measurements.
    fn follow(
        &self,
        state: GraspState,
        input: &StepInput,
        events: &mut Vec<GraspEvent>,
    ) -> GraspState {
        match state {
            GraspState::Free { last_free } => self.approach(last_free, [0; 5], input, events),
            GraspState::Avoiding { last_free, recalled } => {
                self.approach(last_free, recalled, input, events)
            }
            GraspState::Attached { palm_from_object, holds, last_free, recalled } => {
                let carried = Carried { palm_from_object, holds, last_free, recalled };
                self.carry(carried, input, events)
            }
            GraspState::Deforming { palm_from_object, contacts, last_free } => {
                // Where the object turns rigid again, all fingers are inside it.
                let holds = contacts.map(Hold::Held);
                let carried = Carried { palm_from_object, holds, last_free, recalled: [3; 5] };
                self.carry(carried, input, events)
            }
            GraspState::Detached if input.fingers.iter().all(is_clear) => {
                GraspState::Free { last_free: self.in_object(&input.world_from_segment) }
            }
            GraspState::Detached => GraspState::Detached,
        }
    }

    /// Free or avoiding: recall what penetrates, attach when three fingers touch together.
    fn approach(
        &self,
        mut last_free: HandSegments,
        recalled: [u8; 5],
        input: &StepInput,
        events: &mut Vec<GraspEvent>,
    ) -> GraspState {
        let recalled = self.recall_all(recalled, &mut last_free, input);
        let mut holds = [Hold::Open; 5];
        let mut touched = Vec::new();
        touch(&mut holds, &input.fingers, |finger| finger.attaches(), &mut touched);
        if let (_, true) = grip(&holds) {
            events.append(&mut touched);
            let palm_from_object = input.world_from_palm.inverse() * self.world_from_object;
            return GraspState::Attached { palm_from_object, holds, last_free, recalled };
        }
        if recalled == [0; 5] {
            GraspState::Free { last_free }
        } else {
            GraspState::Avoiding { last_free, recalled }
        }
    }

    /// Attached or deforming: tips leave, then touch; five held deform, none of the three lets go.
    fn carry(
        &self,
        carried: Carried,
        input: &StepInput,
        events: &mut Vec<GraspEvent>,
    ) -> GraspState {
        let Carried { palm_from_object, mut holds, mut last_free, recalled } = carried;
        leave(&mut holds, &input.fingers, self.release_margin, events);
        touch(&mut holds, &input.fingers, |_| true, events);
        if let (false, _) = grip(&holds) {
            return GraspState::Detached;
        }
        if let Some(contacts) = all_contacts(&holds) {
            return GraspState::Deforming { palm_from_object, contacts, last_free };
        }
        let mut recalled = self.recall_all(recalled, &mut last_free, input);
        for (count, hold) in recalled.iter_mut().zip(&holds) {
            // A holding tip is in the rigid object whatever the margin says.
            if hold.contact().is_some() {
                *count = 3;
            }
        }
        GraspState::Attached { palm_from_object, holds, last_free, recalled }
    }

    /// Applies the recall rule to each finger and remembers the poses of those that are free.
    fn recall_all(
        &self,
        before: [u8; 5],
        last_free: &mut HandSegments,
        input: &StepInput,
    ) -> [u8; 5] {
        let measured = self.in_object(&input.world_from_segment);
        std::array::from_fn(|finger| {
            let count = recall(before[finger], &input.fingers[finger]);
            if count == 0 {
                last_free[finger] = measured[finger];
            }
            count
        })
    }

    fn in_object(&self, world_from_segment: &HandSegments) -> HandSegments {
        let object_from_world = self.world_from_object.inverse();
        world_from_segment.map(|finger| finger.map(|segment| object_from_world * segment))
    }

    fn output(&self, input: &StepInput, events: Vec<GraspEvent>) -> StepOutput {
        let (last_free, recalled) = match &self.state {
            GraspState::Avoiding { last_free, recalled }
            | GraspState::Attached { last_free, recalled, .. } => (last_free, *recalled),
            GraspState::Free { .. } | GraspState::Deforming { .. } | GraspState::Detached => {
                (&input.world_from_segment, [0; 5])
            }
        };
        let mut world_from_segment = input.world_from_segment;
        for (finger, &count) in recalled.iter().enumerate() {
            for segment in 0..usize::from(count) {
                let object_from_segment = last_free[finger][segment];
                world_from_segment[finger][segment] = self.world_from_object * object_from_segment;
            }
        }
        let known = match &self.state {
            GraspState::Deforming { contacts, .. } => Some(known(contacts, input)),
            _ => None,
        };
        StepOutput {
            events,
            state: self.state.name(),
            known,
            world_from_object: self.world_from_object,
            world_from_segment,
            recalled,
        }
    }
}

/// Data that the states `Attached` and `Deforming` have in common.
struct Carried {
    palm_from_object: Isometry3<f64>,
    holds: [Hold; 5],
    last_free: HandSegments,
    recalled: [u8; 5],
}

fn all_contacts(holds: &[Hold; 5]) -> Option<[Contact; 5]> {
    let [Hold::Held(a), Hold::Held(b), Hold::Held(c), Hold::Held(d), Hold::Held(e)] = *holds else {
        return None;
    };
    Some([a, b, c, d, e])
}

/// Each tip's displacement since its own contact is its node's known displacement (4.5.1).
fn known(contacts: &[Contact; 5], input: &StepInput) -> [KnownNode; 5] {
    std::array::from_fn(|finger| KnownNode {
        node: contacts[finger].node,
        displacement_in_object: input.fingers[finger].tip_in_object
            - contacts[finger].tip_at_contact_in_object,
    })
}
