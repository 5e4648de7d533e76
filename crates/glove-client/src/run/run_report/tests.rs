//! Counting of ticks, answers and reasons in the report of a run.

use super::*;
use crate::pace::tick_budget::Priority;
use crate::run::run_words::failure;

fn report() -> RunReport {
    let object =
        ObjectSummary { name: "cube".to_owned(), nodes: 8, tets: 6, size_m: 0.1, notes: vec![] };
    let contact = ContactModel::default();
    RunReport::new(object, "none".to_owned(), "none".to_owned(), Pace::Free, contact)
}

fn tick(report: &mut RunReport, tick: u64, skipped: u64, outcome: TickOutcome) {
    report.add(Due { tick, skipped }, 0.01 * tick as f64, &outcome);
}

fn deforming() -> TickOutcome {
    TickOutcome { state: Some(StateName::Deforming), ..TickOutcome::default() }
}

#[test]
fn every_deforming_tick_is_answered_or_has_one_reason() {
    let mut report = report();
    let free = TickOutcome { state: Some(StateName::Free), ..TickOutcome::default() };
    tick(&mut report, 0, 0, free.clone());
    // Missed while nothing is deformed: no answer is missing.
    tick(&mut report, 4, 3, deforming());
    // Missed while something is.
    let solve = SolveSummary::new(softgrasp_protocol::SolveReport::default(), None, 0.5);
    let answered = TickOutcome { answers: vec![(4, solve)], ..deforming() };
    tick(&mut report, 7, 2, answered);
    let late = (7, Unanswered::AnswerLate);
    tick(&mut report, 8, 0, TickOutcome { unanswered: vec![late, late], ..deforming() });
    tick(&mut report, 9, 0, free);
    report.add_skipped(2);
    report.finish(DeviceFaults::default(), &TickBudget::new(Priority::Ordinary));
    let s = &report.summary;
    assert_eq!((report.ticks, s.ticks_skipped), (12, 7));
    let mut counts = UnansweredCounts::default();
    counts.add(Unanswered::TickSkipped, 2);
    counts.add(Unanswered::AnswerLate, 1);
    counts.add(Unanswered::RunEnded, 1);
    assert_eq!(s.unanswered, counts);
    assert_eq!(s.deforming_ticks, s.solves as u64 + s.unanswered.total());
    assert_eq!(failure(&report), None);
}

#[test]
fn tick_that_was_lost_in_mid_run_is_not_said_to_have_waited_for_its_end() {
    let mut report = report();
    let lost = LoopEvent::Server("lost: the connection was closed".to_owned());
    let solve = SolveSummary::new(softgrasp_protocol::SolveReport::default(), None, 0.5);
    tick(&mut report, 0, 0, deforming());
    tick(&mut report, 1, 0, TickOutcome { events: vec![lost], ..deforming() });
    tick(&mut report, 2, 0, deforming());
    tick(&mut report, 3, 0, TickOutcome { answers: vec![(3, solve)], ..deforming() });
    tick(&mut report, 4, 0, deforming());
    report.finish(DeviceFaults::default(), &TickBudget::new(Priority::Ordinary));
    let reasons: Vec<_> = report.played.iter().map(|record| record.unanswered).collect();
    let lost = Some("server_lost");
    assert_eq!(reasons, [lost, lost, Some("answer_late"), None, Some("run_ended")]);
}

#[test]
fn age_of_a_shape_is_the_time_since_the_tick_that_asked_for_it() {
    let mut report = report();
    for (number, shown_tick) in [(0, None), (1, Some(0)), (2, Some(0)), (3, Some(3))] {
        tick(&mut report, number, 0, TickOutcome { shown_tick, ..deforming() });
    }
    report.finish(DeviceFaults::default(), &TickBudget::new(Priority::Ordinary));
    let RunSummary { shown_age_ms_p50, shown_age_ms_max, .. } = report.summary;
    // Quantiles are good to 0.1 %.
    assert!((shown_age_ms_p50.unwrap() - 10.0).abs() < 1e-2);
    assert!((shown_age_ms_max.unwrap() - 20.0).abs() < 2e-2);
}

/// Symptom: a run of which nearly every answer was late ended with "the server was lost".
#[test]
fn run_without_any_answer_says_the_reason_of_most_ticks() {
    let mut report = report();
    let lost = LoopEvent::Server("lost: the stream failed".to_owned());
    let unanswered = vec![(0, Unanswered::AnswerLate)];
    tick(&mut report, 0, 0, TickOutcome { unanswered, ..deforming() });
    let unanswered = vec![(1, Unanswered::ServerLost)];
    tick(&mut report, 1, 0, TickOutcome { events: vec![lost], unanswered, ..deforming() });
    let unanswered = vec![(2, Unanswered::AnswerLate)];
    tick(&mut report, 2, 0, TickOutcome { unanswered, ..deforming() });
    report.finish(DeviceFaults::default(), &TickBudget::new(Priority::Ordinary));
    let why = failure(&report).unwrap();
    assert_eq!(why, "none of 3 deforming ticks was answered: the answer before it was late");
}

#[test]
fn run_without_any_answer_says_what_the_server_refused() {
    let mut report = report();
    let refused = LoopEvent::Server("refused the model (BadRequest): too soft".to_owned());
    let unanswered = vec![(0, Unanswered::Refused)];
    tick(&mut report, 0, 0, TickOutcome { events: vec![refused], unanswered, ..deforming() });
    report.finish(DeviceFaults::default(), &TickBudget::new(Priority::Ordinary));
    let why = failure(&report).unwrap();
    assert_eq!(
        why,
        "none of 1 deforming ticks was answered: the server refused the model (BadRequest): \
         too soft"
    );
}
