//! Copies out of the run what there is to see of a tick.

use std::sync::Arc;

use softgrasp_grasp::grasp::StateName;
use softgrasp_protocol::solve_report::SolveSummary;
use softgrasp_window::view::frame::{
    GraspView, HandView, LinkHealth, News, NewsKind, ObjectView, ServerView, TickTiming, ViewFrame,
};

use crate::pace::Due;
use crate::run::grasp_loop::GraspLoop;
use crate::run::tick_outcome::{LoopEvent, TickOutcome};

/// What is to be told with the next frame, gathered tick by tick.
#[derive(Default)]
pub struct Observer {
    news: Vec<News>,
    timings: Vec<TickTiming>,
    solve: Option<SolveSummary>,
    ticks_skipped: u64,
}

impl Observer {
    /// Takes note of a tick, whether or not it becomes a frame.
    pub fn note(&mut self, due: Due, outcome: &TickOutcome) {
        self.ticks_skipped += due.skipped;
        self.news.extend(outcome.events.iter().map(|event| news(due.tick, event)));
        for (tick, solve) in &outcome.answers {
            self.timings.push(TickTiming::new(*tick, solve));
            self.solve = Some(solve.clone());
        }
    }

    /// The frame of the tick that was noted last.
    pub fn frame(
        &mut self,
        due: Due,
        now_s: f64,
        outcome: &TickOutcome,
        grasp_loop: &GraspLoop,
    ) -> ViewFrame {
        let object = grasp_loop.object();
        let setup = grasp_loop.reader().setup();
        let faults = grasp_loop.reader().faults();
        ViewFrame {
            tick: due.tick,
            at_s: now_s,
            object: ObjectView {
                rest: Arc::clone(object.rest_shape()),
                rest_shapes: object.rest_shapes(),
                kept: grasp_loop.undo_count(),
                displacement: object.displacement().to_vec(),
                whole: object.is_whole(),
                world_from_object: *grasp_loop.world_from_object(),
            },
            hand: grasp_loop.hand().map(|hand| HandView {
                dimensions: setup.dimensions,
                world_from_palm: hand.world_from_palm,
                world_from_segment: *grasp_loop.shown_segments(),
            }),
            grasp: GraspView {
                state: outcome.state,
                tips: outcome.tips,
                contacts: grasp_loop.contacts(),
                forces: grasp_loop.fingertip_forces(),
                keeping: outcome.seen.keeping,
                silent: outcome.silent.clone(),
            },
            server: ServerView {
                link: health(grasp_loop, due.tick, outcome),
                is_preparing: !grasp_loop.is_model_prepared(),
                solve: self.solve.clone(),
                shown_tick: outcome.shown_tick,
                ticks_skipped: self.ticks_skipped,
                device_faults: faults.glove + faults.tracker,
            },
            news: std::mem::take(&mut self.news),
            timings: std::mem::take(&mut self.timings),
        }
    }
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
        LoopEvent::Grasp(event) => (event.to_string(), NewsKind::Grasp),
        LoopEvent::KeepRefused(text) => (text.clone(), NewsKind::Refusal),
        LoopEvent::Device(text) => (text.clone(), NewsKind::Information),
        LoopEvent::Server(text) if text.starts_with("lost") || text.starts_with("refused") => {
            (format!("the server: {text}"), NewsKind::Refusal)
        }
        LoopEvent::Server(text) | LoopEvent::Shape(text) => (text.clone(), NewsKind::Information),
    };
    News { tick, text, kind }
}
