//! Report of a run in words, for a person who does not know the program.

use crate::ask::unanswered::Unanswered;
use crate::pace::Pace;
use crate::run::run_report::{ReplaySummary, RunReport};

/// Reason why the run is a failure: questions were asked and none was answered. `None` if it is none.
pub fn failure(report: &RunReport) -> Option<String> {
    if let Some(why) = &report.recording_failed {
        return Some(why.clone());
    }
    if let Some(why) = &report.no_hand {
        let why = match &why[..] {
            [] => "its devices sent nothing that tells where it is".to_owned(),
            why => why.join("; "),
        };
        return Some(format!("there was never a hand: {why}"));
    }
    let s = &report.summary;
    let further = || report.further_objects.iter();
    let solves = s.solves + further().map(|object| object.solves).sum::<usize>();
    let deforming = s.deforming_ticks + further().map(|object| object.deforming_ticks).sum::<u64>();
    if solves > 0 || deforming == 0 || report.interrupted {
        return None;
    }
    Some(format!("none of {deforming} deforming ticks was answered: {}", why_unanswered(report)))
}

/// The reason that most ticks without an answer have: in the server's words where it was lost or refused.
fn why_unanswered(report: &RunReport) -> String {
    let most = report.summary.unanswered.by_count().first().map(|&(why, _)| why);
    match (most, &report.last_failure) {
        (None | Some(Unanswered::ServerLost | Unanswered::Refused), Some(what)) => {
            format!("the server {}", what.replacen("lost", "was lost", 1))
        }
        (Some(why), _) => why.to_string(),
        (None, None) => String::new(),
    }
}

/// Summary of one screen, for a person who does not know the program.
pub fn describe(report: &RunReport) -> String {
    let s = &report.summary;
    let mut text = format!(
        "\n{} ({} nodes, {} tetrahedra, {:.0} mm), grasped by the hand {}\n  \
         {}; solved {}\n",
        report.object.name,
        report.object.nodes,
        report.object.tets,
        1e3 * report.object.size_m,
        report.hand,
        words_of_contact(&report.contact),
        words_of_server(&report.server)
    );
    for note in &report.object.notes {
        text.push_str(&format!("  {note}\n"));
    }
    text.push_str("\nWhat happened:\n");
    for event in &report.events {
        text.push_str(&format!("  tick {:>5}  {}\n", event.tick, event.what));
    }
    if report.events_left_out > 0 {
        text.push_str(&format!("  and {} events more\n", report.events_left_out));
    }
    text.push_str(&format!("\n  ticks               {}", report.ticks));
    if s.ticks_skipped > 0 {
        text.push_str(&format!(", of which {} came too late and were skipped", s.ticks_skipped));
    }
    text.push_str(&format!("\n  grasp states        {}\n", report.states_reached.join(", ")));
    text.push_str(&format!(
        "  deforming ticks     {} of {} answered\n",
        s.solves, s.deforming_ticks
    ));
    for (why, count) in s.unanswered.by_count() {
        text.push_str(&format!("    not answered      {count}: {why}\n"));
    }
    // A tick that waits for plans and kept shapes may compute for as long as they take.
    if s.ticks_over_1_ms > 0 && report.pace == Pace::Free.name() {
        text.push_str(&format!(
            "  long ticks          {} computed for more than 1 ms ({:.1} ms at most)\n",
            s.ticks_over_1_ms, s.compute_ms_max
        ));
    }
    text.push_str(&words_of_answers(report));
    text.push_str(&words_of_age(report));
    text.push_str(&words_of_large(report));
    text.push_str(&report.summary.contact.as_ref().map_or(String::new(), |c| c.words()));
    text.push_str(&words_of_devices(report));
    report.further_objects.iter().for_each(|object| text.push_str(&object.words()));
    if report.interrupted {
        text.push_str("  ended by the user\n");
    }
    text
}

/// Sentences on the size of the systems of equations, the times and the errors of the answers.
fn words_of_answers(report: &RunReport) -> String {
    let (s, Some(solve)) = (&report.summary, report.last_answer()) else { return String::new() };
    let ms = |value: Option<f64>| value.map_or("-".to_owned(), |v| format!("{v:.2} ms"));
    let mut text = format!(
        "  equations           {} unknown, {} prescribed, by {}\n  \
         answer came after   {} (median), {} (99 %), {} (slowest: a new grip)\n  \
         residual            {:.1e} at most\n",
        solve.report.unknown_dofs,
        solve.report.known_dofs,
        solve.report.method,
        ms(s.round_trip_ms_p50),
        ms(s.round_trip_ms_p99),
        ms(s.round_trip_ms_max),
        s.residual_rel_max,
    );
    if let (Some(turned), Some(strain)) = (s.max_rotation_deg, s.max_strain) {
        text.push_str(&format!(
            "  shape               turned by {turned:.1} degrees, strained by {:.0} % at most\n",
            100.0 * strain,
        ));
    }
    text
}

/// Sentence on the age of the shown shapes, for runs in real time.
fn words_of_age(report: &RunReport) -> String {
    match (report.summary.shown_age_ms_p50, report.summary.shown_age_ms_max) {
        (Some(median), Some(most)) if report.pace == Pace::Free.name() => {
            format!("  shape shown         {median:.0} ms old (median), {most:.0} ms at most\n")
        }
        _ => String::new(),
    }
}

/// Sentences on large deformation.
fn words_of_large(report: &RunReport) -> String {
    let s = &report.summary;
    let Some(min_jacobian) = s.min_jacobian else { return String::new() };
    let error = s.error_estimate_rel_max.unwrap_or(0.0);
    let mut text = format!(
        "  large deformation   {} of {} answers; off by {error:.1e} at most (estimated), volumes \
         down to {min_jacobian:.2} of those at rest\n",
        s.large_solves, s.solves
    );
    if s.jumps > 0 {
        text.push_str(&format!("                      the shape jumped {} times\n", s.jumps));
    }
    text
}

/// Sentences on silent devices, on latency, and on a replay.
fn words_of_devices(report: &RunReport) -> String {
    let (s, mut text) = (&report.summary, String::new());
    if s.ticks_held > 0 {
        text.push_str(&format!(
            "  hand held           {} ticks, while a device was silent\n",
            s.ticks_held
        ));
    }
    let jumps = s.glove_jumps + s.tracker_jumps;
    if jumps > 0 {
        text.push_str(&format!(
            "  damaged records     {jumps} readings jumped as no hand does and were not taken\n"
        ));
    }
    if let Some(fit) = &s.joint_fit {
        text.push_str(&format!(
            "  hand fits joints    to {:.1} mm (root mean square), {:.1} mm at most\n",
            1e3 * fit.rms_m,
            1e3 * fit.most_m
        ));
    }
    if let Some(latency) = &s.latency {
        text.push_str(&format!(
            "  sample to shape     {:.1} ms (median), {:.1} ms (99 %)\n",
            latency.whole.p50_ms, latency.whole.p99_ms
        ));
    }
    if let Some(replay) = &report.replay {
        text.push_str(&words_of_replay(replay));
    }
    text
}

/// Words for how the hand holds the object, by the name of `--contact`, or of the grasp by friction.
pub fn words_of_contact(contact: &str) -> String {
    let held = match contact {
        "friction" => return "the hand presses with friction".to_owned(),
        "vertex" => "the node that it touches (vertex)",
        "patch" => "every node under it (patch)",
        "mask" => "what lies under it, weighted by its pressure (mask)",
        other => other,
    };
    format!("a fingertip holds {held}")
}

/// Words for the server, by the name of `--server`.
pub fn words_of_server(server: &str) -> String {
    match server {
        "embedded" => "in this program".to_owned(),
        address => format!("by the server at {address}"),
    }
}

/// Sentences on what a replay has found.
fn words_of_replay(replay: &ReplaySummary) -> String {
    let ReplaySummary { ticks, requests, difference, cut, .. } = replay;
    let found = match difference {
        None if *ticks == 0 => "nothing was compared".to_owned(),
        None => "poses, contacts, requests and displacements are the same bit by bit".to_owned(),
        Some(difference) => format!("it differs from {difference}"),
    };
    let mut text =
        format!("  replay              {ticks} ticks, {requests} with requests: {found}\n");
    if let Some(why) = cut {
        text.push_str(&format!("                      the recording ends there: {why}\n"));
    }
    text
}
