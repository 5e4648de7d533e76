//! Writes the report: outcome of every method in every case, and advice for users.

use super::case::{Case, Family, Form};
use super::outcome::Outcome;
use super::row::{Numbers, Pools, Row, rows_of};
use super::{families, locking};
use softgrasp_bench::axis::Scale;
use softgrasp_bench::plot::{Mark, Plot, PlotError, PlotPoint, Series};
use softgrasp_bench::report::{Options, Report, ReportError, progress};
use softgrasp_bench::table::{Cell, Table, three_digits};

/// Asks every case and judges every answer.
///
/// # Errors
/// [`ReportError`] where a case cannot be set up; rows that failed are faults of the report, which
/// is written all the same.
pub fn measure(options: &Options) -> Result<Report, ReportError> {
    let form = match options.is_quick {
        true => Form { is_quick: true, cells: 2 },
        false => Form { is_quick: false, cells: 3 },
    };
    let title = "Hard cases: what every way does where numbers get difficult";
    let threads = "1, 2, 4 and 7, and 2 again; times with 2";
    let mut report = Report::begin("hard-cases", title, threads, options);
    let pools = Pools::new()?;
    let families = families::all(form)?;
    let mut rows = Vec::new();
    for family in &families {
        for case in &family.cases {
            progress("hard-cases", &format!("{}: {}", family.name, case.name));
            rows.extend(rows_of(family, case, &pools));
        }
    }
    refuse_refusals_that_others_answer(&mut rows);
    report.text(INTRODUCTION);
    report.text(totals(&rows));
    report.text(slack(&rows));
    report.text(refusals(&rows));
    report.text(worst(&families, &rows));
    report.text(promises(&families));
    report.figure("hard-cases", FIGURE, figure(&rows)?);
    progress("hard-cases", "locking");
    let softness = locking::measure(form)?;
    report.text(LOCKING);
    report.figure("hard-cases-locking", LOCKING_FIGURE, locking::figure(&softness)?);
    report.table(locking::table(&softness));
    for row in rows.iter().filter(|row| row.outcome == Outcome::Failed) {
        report.fault(fault(row));
    }
    report.text(failures(&rows));
    report.records(record_table(&rows));
    report.table(case_table(&families, &rows));
    Ok(report)
}

fn fault(row: &Row) -> String {
    let (way, element) = (row.way.name(), row.way.element().name());
    format!("{}, {}; {element} by {way}: {}", row.family, row.case, row.note)
}

/// Whether another way with the same element answers the same question.
fn is_answered_elsewhere(row: &Row, rows: &[Row]) -> bool {
    let is_same = |other: &&Row| {
        let of = |r: &Row| (r.family, r.way.element());
        of(other) == of(row) && other.case == row.case
    };
    let is_answered = |other: &Row| matches!(other.outcome, Outcome::Exact | Outcome::Degraded);
    rows.iter().filter(is_same).any(is_answered)
}

/// Marks refusals of questions that another way answers as failed, unless they are a stated limit of the
/// way.
fn refuse_refusals_that_others_answer(rows: &mut [Row]) {
    let is_unexcused = |row: &Row| row.outcome == Outcome::Refused && row.way.limit().is_none();
    let unexcused: Vec<usize> = (0..rows.len())
        .filter(|&i| is_unexcused(&rows[i]) && is_answered_elsewhere(&rows[i], rows))
        .collect();
    for i in unexcused {
        rows[i].outcome = Outcome::Failed;
        rows[i].note = format!("refused, but another way answers: {}", rows[i].note);
    }
}

/// Ratio of the thresholds to the errors of exact answers.
fn slack(rows: &[Row]) -> String {
    let of = |row: &Row| {
        let Numbers { error_rel, threshold_rel, .. } = row.numbers?;
        Some(threshold_rel? / error_rel.filter(|error| *error > 0.0)?)
    };
    let exact = rows.iter().filter(|row| row.outcome == Outcome::Exact);
    let mut slack: Vec<f64> = exact.filter_map(of).collect();
    slack.sort_by(f64::total_cmp);
    let at = |share: f64| slack.get((share * slack.len() as f64) as usize).copied();
    let [least, median, most] =
        [at(0.0), at(0.5), slack.last().copied()].map(|s| three_digits(s.unwrap_or(f64::NAN)));
    format!(
        "**Slack**: the threshold of an answer is {median} times its error in the median, {least} \
         times at least and {most} times at most, over {} exact answers whose error is not zero.",
        slack.len()
    )
}

/// Refusals of questions that another way answers, with their reasons.
fn refusals(rows: &[Row]) -> String {
    let refused = rows.iter().filter(|r| r.outcome == Outcome::Refused);
    let answered: Vec<&Row> = refused.clone().filter(|r| is_answered_elsewhere(r, rows)).collect();
    let total = refused.count();
    let head = format!(
        "### Refusals that another way answers\n\nOf {total} refusals {} are of questions that no way \
         answers, each for the reason that its case names.",
        total - answered.len()
    );
    let line = |row: &&Row| {
        let (way, element) = (row.way.name(), row.way.element().name());
        let limit = row.way.limit().unwrap_or("no reason");
        format!("- {}, {}; {element} by {way}: {limit}\n", row.family, row.case)
    };
    let lines: String = answered.iter().map(line).collect();
    match lines.is_empty() {
        true => format!("{head} No question is refused that another way answers."),
        false => format!("{head} The others, and why:\n\n{lines}"),
    }
}

/// Number of rows of each outcome.
fn totals(rows: &[Row]) -> String {
    let of = |outcome: Outcome| {
        let count = rows.iter().filter(|r| r.outcome == outcome).count();
        format!("{count} {}", outcome.name())
    };
    let runs: usize = rows.iter().map(|r| r.runs).sum();
    let counts = Outcome::ALL.map(of).join(", ");
    format!(
        "**{} rows: {counts}.** {runs} runs in all; every repeated run gave the bits of the first, \
         on 1, 2, 4 and 7 threads, unless its row is among the failed.",
        rows.len()
    )
}

/// The three cases with the largest errors within their promise, each of another family.
fn worst(families: &[Family], rows: &[Row]) -> String {
    let error = |row: &Row| row.numbers.and_then(|n| n.error_rel).unwrap_or(0.0);
    let mut found: Vec<(&Family, &Row)> = Vec::new();
    for family in families {
        let kept = |r: &&Row| r.family == family.name && r.outcome != Outcome::Failed;
        let of_family = rows.iter().filter(kept);
        let worst = of_family.max_by(|a, b| error(a).total_cmp(&error(b)));
        found.extend(worst.map(|row| (family, row)));
    }
    found.sort_by(|a, b| error(b.1).total_cmp(&error(a.1)));
    let mut text = "### The worst three cases, and what to do about them\n\n".to_owned();
    for (family, row) in found.into_iter().take(3) {
        let Some(Numbers { stated_rel, condition, .. }) = row.numbers else { continue };
        text.push_str(&format!(
            "- **{}: {}.** Largest error {:.1e} ({} by {}, which states {stated_rel:.1e}; condition \
             {condition:.1e}; {}). {}\n",
            family.name,
            row.case,
            error(row),
            row.way.element().name(),
            row.way.name(),
            row.outcome.name(),
            family.advice
        ));
    }
    text
}

/// Reasons for the thresholds.
fn promises(families: &[Family]) -> String {
    let line = |f: &Family| format!("- **{}:** {} *{}*\n", f.name, f.reasoning, f.advice);
    let lines: String = families.iter().map(line).collect();
    format!("### Promises, made before measuring, and what to do\n\n{lines}")
}

fn failures(rows: &[Row]) -> String {
    let failed = rows.iter().filter(|row| row.outcome == Outcome::Failed);
    let lines: String = failed.map(|row| format!("- {}\n", fault(row))).collect();
    match lines.is_empty() {
        true => "### Failed rows\n\nNone.".to_owned(),
        false => format!("### Failed rows\n\n{lines}"),
    }
}

const RECORDS: [&str; 20] = [
    "family",
    "case",
    "nodes",
    "element",
    "way",
    "precision",
    "outcome",
    "allowed",
    "threshold_rel",
    "error_rel",
    "stated_error_rel",
    "error_bound_rel",
    "residual_rel",
    "condition",
    "total_ms",
    "against",
    "runs",
    "bits",
    "note",
    "index",
];

/// Table of all rows.
fn record_table(rows: &[Row]) -> Table {
    let mut table = Table::new("hard-cases", "Every row", &RECORDS);
    for (index, row) in rows.iter().enumerate() {
        let number = |of: fn(&Numbers) -> Option<f64>| row.numbers.as_ref().and_then(of);
        let cells: [Cell; 20] = [
            row.family.into(),
            row.case.clone().into(),
            row.nodes.into(),
            row.way.element().name().into(),
            row.way.name().into(),
            row.way.precision().into(),
            row.outcome.name().into(),
            row.allowed.text().into(),
            number(|n| n.threshold_rel).into(),
            number(|n| n.error_rel).into(),
            number(|n| Some(n.stated_rel)).into(),
            number(|n| n.bound_rel).into(),
            number(|n| Some(n.residual_rel)).into(),
            number(|n| Some(n.condition)).into(),
            number(|n| Some(n.ms)).into(),
            row.against.into(),
            row.runs.into(),
            format!("{:016x}", row.hash).into(),
            row.note.clone().into(),
            index.into(),
        ];
        table.push(cells);
    }
    table
}

const CASES: [&str; 13] = [
    "family",
    "case",
    "nodes",
    "allowed_f64",
    "allowed_f32",
    "threshold_rel",
    "exact",
    "degraded",
    "refused",
    "failed",
    "error_max_rel",
    "stated_max_rel",
    "condition_max",
];

/// Table of all cases, with the number of ways for each outcome.
fn case_table(families: &[Family], rows: &[Row]) -> Table {
    let title = "Every case: what was allowed, and outcomes of its ways";
    let mut table = Table::new("hard-cases-outcomes", title, &CASES);
    let cases = families.iter().flat_map(|f| f.cases.iter().map(move |case| (f, case)));
    for (family, case) in cases {
        let Case { name, question, double, single, .. } = case;
        let of_case: Vec<&Row> =
            rows.iter().filter(|r| r.family == family.name && r.case == *name).collect();
        let count = |outcome: Outcome| of_case.iter().filter(|r| r.outcome == outcome).count();
        let most = |of: fn(&Numbers) -> Option<f64>| {
            of_case.iter().filter_map(|r| r.numbers.as_ref().and_then(of)).reduce(f64::max)
        };
        let head: [Cell; 6] = [
            family.name.into(),
            name.clone().into(),
            question.mesh.node_count().into(),
            double.text().into(),
            single.text().into(),
            most(|n| n.threshold_rel).into(),
        ];
        let counts = Outcome::ALL.map(|outcome| Cell::from(count(outcome)));
        let most: [Cell; 3] = [
            most(|n| n.error_rel).into(),
            most(|n| Some(n.stated_rel)).into(),
            most(|n| Some(n.condition)).into(),
        ];
        table.push(head.into_iter().chain(counts).chain(most));
    }
    table
}

/// Figure of the true error against the error that an answer states.
fn figure(rows: &[Row]) -> Result<String, PlotError> {
    let points = |keep: &dyn Fn(&Row) -> bool| -> Vec<PlotPoint> {
        let of = |row: &Row| {
            let Numbers { error_rel, stated_rel, .. } = row.numbers?;
            // An error of nothing has no place on the axis.
            Some(PlotPoint { x: stated_rel, y: error_rel?.max(1e-18), spread: None })
        };
        rows.iter().filter(|row| keep(row)).filter_map(of).collect()
    };
    let series = |label: &str, keep: &dyn Fn(&Row) -> bool| Series {
        label: label.to_owned(),
        mark: Mark::Points,
        points: points(keep),
    };
    let is = |row: &Row, outcome: Outcome| row.outcome == outcome;
    let diagonal = [1e-16, 1e-1].map(|x| PlotPoint { x, y: x, spread: None });
    let plot = Plot {
        title: "Error of every answer against the error it states".to_owned(),
        x_label: "stated error, relative".to_owned(),
        y_label: "error, relative".to_owned(),
        x_scale: Scale::Log,
        y_scale: Scale::Log,
        series: vec![
            series("exact, f64 factor", &|r| is(r, Outcome::Exact) && !r.way.is_single()),
            series("degraded as stated", &|r| is(r, Outcome::Degraded)),
            series("exact, f32 factor", &|r| is(r, Outcome::Exact) && r.way.is_single()),
            series("failed", &|r| is(r, Outcome::Failed)),
            Series {
                label: format!("as stated (refused from {})", three_digits(0.1)),
                mark: Mark::Dashed,
                points: diagonal.to_vec(),
            },
        ],
    };
    plot.svg()
}

const FIGURE: &str = "\
Every row that was answered. Points below the dashed line are no worse than they say; above it only \
answers whose error is below their case's threshold may lie.";

const LOCKING_FIGURE: &str = "\
Displacement of a pushed block over that of ten-node elements of a finer mesh: an element that locks \
goes to zero.";

const LOCKING: &str = "\
### Locking

The errors above are those of the equations' solution. What the element makes of the material is \
another matter, and for linear elements near ν = 0.5 a worse one: a block of 1 × 1 × 2 m is clamped \
below, its upper face pushed sideways, and the displacement for a force compared with ten-node \
elements of a finer mesh.";

const INTRODUCTION: &str = "\
Every method, precision and element is asked the same hard questions. What may become of a question \
was written down, in the file of its family, before it was measured:

- **exact**: the largest error over all nodes, relative to the largest displacement, is at most the \
threshold: a hundred times the expected error ε (κ / 64 + 1), ε the rounding of a double and κ \
Skeel's condition number as the reference estimates it (κ is reached only if all roundings conspire; \
they cancel to a sixty-fourth or so), with 1e-14 added for a factor in single precision, whose \
refinement ends there. It is never above 1e-9. `condensed` proves a bound besides, and the error must \
be below that too.
- **degraded as stated**: the error is larger, but no larger than the answer states of itself \
(`Certainty::error_rel`), and what it states is above 1e-9, so that a user is warned.
- **refused with reason**: there is no answer, and the reason given is the right one, which the case \
names: the question itself (a contradiction, no number), a free motion, a body held too weakly for \
double precision (a stated error of 0.1 or more among them), numbers out of range, elements turned \
inside out. A question that another way answers with the same element may be refused only by a way \
that is listed with its reason.
- Anything else is **failed**: no number, a panic, no answer in time, an error beyond the threshold and \
beyond what is stated, an outcome that the case does not allow, other bits on another number of \
threads. Then this report ends with an error that names the rows.

The right answer solves the stiffness as assembled, refined with residuals in twice the working \
precision (`reference`); where that does not settle it is factored densely in twice the precision \
(`dense reference`); where it is known without solving (a body moved as a whole), the larger of both \
errors counts. Times are from the mesh to the displacements, one run each.

Beside the methods in process, `condensed, masks` holds every touched node by a mask of that node \
alone (up to ten of them), which is the same question asked of other code; `server, one request` and \
`server, frame` ask a server with as many threads over a loopback socket, with the method left to it, \
`server, frame of masks` with masks.";
