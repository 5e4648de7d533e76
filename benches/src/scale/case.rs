//! One size by all ways: each in processes of its own, asked once, and its answer looked at.

use std::time::{Duration, Instant};

use glove_client::ask::connection::{LinkError, ServerConnection};
use softgrasp_protocol::{RejectCode, SolveReport};

use super::cube::Cube;
use super::row::{Answered, Outcome, Row};
use super::way::{WAYS, Way};
use crate::programs::Programs;
use crate::report::{ReportError, check, progress};

/// Largest force on a free node over the largest on a held one with which a time is reported: what a
/// worker holds its own answers to.
const IMBALANCE_ALLOWED: f64 = 1e-8;
/// Largest difference to `front`, over the largest displacement, with which a time is reported.
const OFF_FRONT_ALLOWED: f64 = 1e-8;
/// Longest time for one answer.
const ANSWER_MAX: Duration = Duration::from_secs(1800);

/// What the processes are started by, and may take.
pub(super) struct Means<'a> {
    pub programs: &'a Programs,
    /// Memory that the processes of one way may take together, bytes.
    pub memory: u64,
    /// Whether a worker can be started.
    pub has_worker: bool,
}

/// An answer before it was looked at.
struct Raw {
    wall_s: f64,
    peak_bytes: f64,
    report: SolveReport,
    displacement: Vec<f64>,
}

/// Asks all ways about a cube of `nodes` nodes; one after the other, so that each has the machine alone.
///
/// # Errors
/// [`ReportError`], also for a wrong answer.
pub(super) fn rows(means: &Means<'_>, nodes: usize) -> Result<Vec<Row>, ReportError> {
    let cube = Cube::try_new(nodes)?;
    let mut found = Vec::new();
    for way in WAYS {
        if means.has_worker || matches!(way, Way::One(_)) {
            progress("scale", &format!("{nodes} nodes, {}", way.name()));
            found.push((way, ask(means, &cube, way)?));
        }
    }
    let answers: Vec<&[f64]> =
        found.iter().flat_map(|(_, found)| found).map(|raw| raw.displacement.as_slice()).collect();
    let mut imbalances = cube.imbalances(&answers)?.into_iter();
    let front =
        found.iter().find(|(way, _)| *way == WAYS[0]).and_then(|(_, raw)| raw.as_ref().ok());
    let mut rows = Vec::new();
    for (way, raw) in &found {
        let outcome = match raw {
            Err(text) => Outcome::Refused { text: text.clone() },
            Ok(raw) => {
                let imbalance = imbalances.next().unwrap_or(f64::NAN);
                let what = || format!("{nodes} nodes by {}", way.name());
                check(|| format!("balance of {}", what()), imbalance, IMBALANCE_ALLOWED)?;
                let others = front.filter(|_| *way != WAYS[0]);
                let off_front = others.map(|front| off(&raw.displacement, &front.displacement));
                if let Some(off) = off_front {
                    check(|| format!("{} against front", what()), off, OFF_FRONT_ALLOWED)?;
                }
                Outcome::Answered(Box::new(Answered {
                    wall_s: raw.wall_s,
                    peak_bytes: raw.peak_bytes,
                    report: raw.report.clone(),
                    imbalance,
                    off_front,
                }))
            }
        };
        rows.push(Row { nodes: cube.node_count(), way: *way, outcome });
    }
    Ok(rows)
}

/// Answer of one way in fresh processes, or the words of its refusal for want of memory.
fn ask(means: &Means<'_>, cube: &Cube, way: Way) -> Result<Result<Raw, String>, ReportError> {
    let server = way.start(means.programs, means.memory)?;
    let mut connection = ServerConnection::connect(server.address.as_str())?;
    let timeout = connection.stream().set_read_timeout(Some(ANSWER_MAX));
    timeout.map_err(|error| LinkError::Connection(error.into()))?;
    let ask = cube.ask(way.method());
    let begun = Instant::now();
    let answer = match connection.answer(ask) {
        Err(LinkError::Rejected(rejected)) if rejected.code == RejectCode::MemoryLimit => {
            return Ok(Err(rejected.text));
        }
        answer => answer?,
    };
    let wall_s = begun.elapsed().as_secs_f64();
    let peak_bytes = server.peak_bytes().unwrap_or(f64::NAN);
    let displacement = answer.displacements.into_f64().concat();
    Ok(Ok(Raw { wall_s, peak_bytes, report: answer.report, displacement }))
}

/// Largest difference of two answers, over the largest entry of the second.
fn off(answer: &[f64], truth: &[f64]) -> f64 {
    if answer.len() != truth.len() {
        return f64::INFINITY;
    }
    let largest = truth.iter().fold(0.0f64, |m, u| m.max(u.abs()));
    // A difference that is no number must not be passed over.
    let most = |m: f64, d: f64| if d > m || d.is_nan() { d } else { m };
    answer.iter().zip(truth).map(|(a, b)| (a - b).abs()).fold(0.0, most) / largest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_number_is_no_agreement() {
        assert_eq!(off(&[1.0, 2.5], &[1.0, 2.0]), 0.25);
        assert!(off(&[f64::NAN, 2.0], &[1.0, 2.0]).is_nan());
        assert_eq!(off(&[1.0], &[1.0, 2.0]), f64::INFINITY);
    }
}
