//! Copies the visible state of a tick out of the run.

use std::sync::Arc;

use softgrasp_grasp::grasp::StateName;
use softgrasp_hand::hand_source::HandSource;
use softgrasp_hand::scripted::GraspPlan;
use softgrasp_hand::sent::WhichHand;
use softgrasp_protocol::solve_report::SolveSummary;
use softgrasp_window::view::frame::{
    GraspView, HandActs, HandView, LinkHealth, News, NewsKind, ObjectView, ServerView, TickTiming,
    ViewFrame,
};

use crate::pace::Due;
use crate::run::grasp_loop::GraspLoop;
use crate::run::tick_outcome::{LoopEvent, TickOutcome};

/// Preview of the hand that will squeeze the object, made again when its plan changes.
#[derive(Default)]
pub struct Foresight {
    made_for: Option<GraspPlan>,
    squeezing: Option<Arc<HandView>>,
}

impl Foresight {
    /// What the hand of a run does without a person: its script and plan.
    pub fn acts(&mut self, hand: &HandSource, grasp_loop: &GraspLoop) -> HandActs {
        let plan = hand.plan();
        if plan != self.made_for {
            self.made_for = plan;
            self.squeezing = plan.map(|plan| {
                let setup = grasp_loop.reader().setup();
                let (object, world_from_object) = grasp_loop.aimed(WhichHand::First);
                let centre = object.rest_shape().centre();
                let in_object = plan.squeezing(setup, centre);
                let mut seen = HandView::of_pose(setup.dimensions, &in_object);
                seen.world_from_palm = world_from_object * seen.world_from_palm;
                for segment in seen.world_from_segment.iter_mut().flatten() {
                    *segment = world_from_object * *segment;
                }
                Arc::new(seen)
            });
        }
        HandActs {
            story_is_over: hand.is_over(),
            is_on_its_way: hand.is_on_its_way(),
            squeezing: self.squeezing.clone(),
            aimed: grasp_loop.objects().aimed(WhichHand::First),
        }
    }
}

/// Gathers, tick by tick, what the next frame for the window tells.
#[derive(Default)]
pub struct Observer {
    news: Vec<News>,
    timings: Vec<TickTiming>,
    solve: Option<SolveSummary>,
    ticks_skipped: u64,
    /// Last news of the server.
    said: Option<String>,
}

impl Observer {
    /// Notes a tick, whether or not it becomes a frame for the window.
    pub fn note(&mut self, due: Due, outcome: &TickOutcome) {
        self.ticks_skipped += due.skipped;
        let heard = outcome.events.iter().rev().find_map(|event| match event {
            LoopEvent::Server(text) => Some(text.clone()),
            _ => None,
        });
        self.said = heard.or(self.said.take());
        self.news.extend(outcome.events.iter().map(|event| news(due.tick, event)));
        // Of several objects the one that was touched last is told of.
        for (tick, solve) in &outcome.part(outcome.touched).answers {
            self.timings.push(TickTiming::new(*tick, solve));
            self.solve = Some(solve.clone());
        }
    }

    /// Frame for the window, of the tick that was noted last.
    pub fn frame(
        &mut self,
        due: Due,
        now_s: f64,
        outcome: &TickOutcome,
        grasp_loop: &GraspLoop,
    ) -> ViewFrame {
        let (touched, faults) = (outcome.touched, grasp_loop.readers().faults());
        let others = (0..grasp_loop.object_count()).filter(|number| *number != touched);
        let part = outcome.part(touched);
        ViewFrame {
            tick: due.tick,
            at_s: now_s,
            object: object_view(grasp_loop, touched),
            others: others.map(|number| object_view(grasp_loop, number)).collect(),
            hand: hand_view(grasp_loop, WhichHand::First, now_s),
            second_hand: hand_view(grasp_loop, WhichHand::Second, now_s),
            grasp: GraspView {
                state: part.state,
                tips: part.tips,
                second_tips: part.second_tips,
                contacts: grasp_loop.contacts(),
                forces: grasp_loop.fingertip_forces(),
                keeping: part.seen.keeping,
                silent: outcome.silent.clone(),
            },
            server: ServerView {
                link: health(grasp_loop, due.tick, part),
                is_preparing: !grasp_loop.is_model_prepared(),
                solve: self.solve.clone(),
                shown_tick: part.shown_tick,
                ticks_skipped: self.ticks_skipped,
                device_faults: faults.glove + faults.tracker,
                said: self.said.clone(),
            },
            acts: HandActs::default(),
            news: std::mem::take(&mut self.news),
            timings: std::mem::take(&mut self.timings),
        }
    }
}

/// The object of a number, from 0.
fn object_view(grasp_loop: &GraspLoop, number: usize) -> ObjectView {
    let shown = grasp_loop.objects().get(number);
    let object = shown.object();
    let is_one_of_several = grasp_loop.object_count() > 1;
    ObjectView {
        number,
        own: is_one_of_several.then(|| shown.own_look()).flatten(),
        rest: Arc::clone(object.rest_shape()),
        rest_shapes: object.rest_shapes(),
        kept: shown.undo_count(),
        displacement: object.displacement().to_vec(),
        whole: object.is_whole(),
        world_from_object: *shown.world_from_object(),
        table_y: shown.holding.friction().and_then(|contact| contact.scene().table_y),
    }
}

fn hand_view(grasp_loop: &GraspLoop, which: WhichHand, now_s: f64) -> Option<HandView> {
    let (hand, shown) = grasp_loop.shown_hand(which)?;
    let reader = grasp_loop.readers().of(which)?;
    Some(HandView {
        dimensions: reader.setup().dimensions,
        world_from_palm: hand.world_from_palm,
        world_from_segment: *shown,
        record: reader.joints_number(now_s),
    })
}

fn health(grasp_loop: &GraspLoop, tick: u64, outcome: &TickOutcome) -> LinkHealth {
    let is_late = outcome.state == Some(StateName::Deforming)
        && outcome.shown_tick.is_none_or(|shown| tick.saturating_sub(shown) > 1);
    match (grasp_loop.is_connected(), is_late) {
        (false, _) => LinkHealth::Reconnecting,
        (true, true) => LinkHealth::Late,
        (true, false) => LinkHealth::Connected,
    }
}

fn news(tick: u64, event: &LoopEvent) -> News {
    let (text, kind) = match event {
        LoopEvent::OfFurther { object, event } => {
            let News { text, kind, .. } = news(tick, event);
            (format!("{text} ({object})"), kind)
        }
        LoopEvent::Grasp(event) => (event.to_string(), NewsKind::Grasp),
        LoopEvent::KeepRefused(text) => (text.clone(), NewsKind::Refusal),
        LoopEvent::Device(notice) => (notice.text.clone(), NewsKind::Information),
        LoopEvent::Server(text) if text.starts_with("lost") => {
            let said = "the server is gone; the window looks for it again (F2 tells what happened)";
            (said.to_owned(), NewsKind::Refusal)
        }
        LoopEvent::Server(text) if text.starts_with("refused") => {
            (format!("the server {text}"), NewsKind::Refusal)
        }
        LoopEvent::Server(text) | LoopEvent::Shape(text) => (text.clone(), NewsKind::Information),
    };
    News { tick, text, kind }
}

#[cfg(test)]
mod tests {
    use softgrasp_hand::notice::Notice;

    use super::*;

    #[test]
    fn lost_server_is_told_in_words_for_people_and_not_by_the_numbers_of_the_system() {
        let what = "lost: the connection broke: reset by peer (os error 104)";
        let told = news(3, &LoopEvent::Server(what.to_owned()));
        assert_eq!(told.kind, NewsKind::Refusal);
        assert!(told.text.contains("the server is gone") && !told.text.contains("os error"));
        // Who wants to know all finds it on F2.
        let mut observer = Observer::default();
        let events = vec![LoopEvent::Server(what.to_owned())];
        observer.note(Due { tick: 3, skipped: 0 }, &TickOutcome { events, ..Default::default() });
        assert_eq!(observer.said.as_deref(), Some(what));
    }

    #[test]
    fn device_that_speaks_again_is_no_refusal_in_the_news() {
        let told = news(3, &LoopEvent::Device(Notice::done("the glove speaks again")));
        assert_eq!(told.kind, NewsKind::Information);
    }
}
