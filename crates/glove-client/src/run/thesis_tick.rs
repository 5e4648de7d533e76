//! Ticks of a grasp by the thesis's rules: fingertips prescribe displacements, and the answer is the shape.

use softgrasp_grasp::grasp::{
    Command, GraspEvent, HandSegments, StateName, StepInput, StepOutput, sense,
};
use softgrasp_grasp::hand::HandColliders;
use softgrasp_grasp::object::ObjectError;

use crate::ask::unanswered::Unanswered;
use crate::run::friction::TickHand;
use crate::run::table_object::TableObject;
use crate::run::tick_outcome::{LoopEvent, TickOutcome};

/// Tick of a grasp by the thesis's rules: its number and its hand.
pub(crate) struct ThesisTick {
    pub(crate) tick: u64,
    pub(crate) hand: TickHand,
}

impl ThesisTick {
    /// Plays the tick; returns the segments of the hand as they are shown.
    ///
    /// # Errors
    /// [`ObjectError`] if the answer does not fit the object.
    pub(crate) fn play(
        &self,
        command: Option<Command>,
        object: &mut TableObject,
        outcome: &mut TickOutcome,
    ) -> Result<HandSegments, ObjectError> {
        let step = self.step(command, object, outcome);
        self.follow(&step, object, outcome)?;
        object.live.shown.place(step.world_from_object);
        outcome.events.extend(step.events.iter().map(|&event| LoopEvent::Grasp(event)));
        outcome.state = Some(step.state);
        outcome.seen.state = Some(step.state);
        outcome.seen.world_from_object = step.world_from_object;
        outcome.recalled = step.recalled;
        outcome.shown_tick = object.live.shown.tick();
        Ok(step.world_from_segment)
    }

    fn step(
        &self,
        command: Option<Command>,
        object: &mut TableObject,
        outcome: &mut TickOutcome,
    ) -> StepOutput {
        let TickHand { pose: hand, dimensions } = &self.hand;
        let colliders = HandColliders::new(dimensions, hand);
        let thesis = object.holding.thesis();
        let world_from_object = thesis.world_from_object(&hand.world_from_palm);
        let margin = thesis.release_margin();
        let (tree, normals) = (object.object().tree(), object.object().normals());
        let fingers = sense(tree, normals, &colliders, &world_from_object, margin);
        let tips = fingers.map(|finger| finger.tip_in_object);
        outcome.seen.inside = std::array::from_fn(|i| fingers[i].tip_hits[0].is_some());
        outcome.tips = outcome.seen.inside;
        object.prefetch(&tips, dimensions.tip_radii(), outcome);
        object.holding.step(&StepInput {
            world_from_palm: hand.world_from_palm,
            world_from_segment: hand.fingers.map(|f| f.segments.map(|s| s.world_from_segment)),
            fingers,
            command,
        })
    }

    /// Applies the decisions of the thesis's rules to object and server.
    fn follow(
        &self,
        step: &StepOutput,
        object: &mut TableObject,
        outcome: &mut TickOutcome,
    ) -> Result<(), ObjectError> {
        let (tick, tip_radii) = (self.tick, self.hand.dimensions.tip_radii());
        let TableObject { holding, live, .. } = object;
        if step.events.contains(&GraspEvent::ShapeKept) {
            live.keep_made()?;
        }
        match &step.known {
            Some(known) => {
                outcome.tips = [true; 5];
                let grip = live.questions.begin_grip(tick);
                if live.changing.keep().freezes() {
                    outcome.unanswered.push((tick, Unanswered::KeepingShape));
                    return Ok(());
                }
                let wants_whole = live.changing.wants_whole();
                let shown = live.shown.object();
                let questions = &mut live.questions;
                let question =
                    questions.question_of_tick(shown, tip_radii, wants_whole, known, outcome);
                if questions.ask(tick, grip, question, outcome) {
                    live.wait_in_lockstep(holding, outcome)?;
                }
            }
            // A tick whose input was ignored keeps the shape as it is.
            None if step.state == StateName::Deforming => {
                outcome.unanswered.push((tick, Unanswered::InputIgnored));
            }
            None => live.let_go(holding, outcome)?,
        }
        Ok(())
    }
}
