//! One row: a method asked one case under a time limit on several pools, and judged.

use std::sync::Arc;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use glove_client::ask::connection::{Host, ServerChoice};

use super::answer::Answer;
use super::case::{Allowed, Case, Family, Reach, Repeats, THREADS};
use super::keep_shape::{Walk, walk};
use super::outcome::{Judged, Outcome};
use super::refusal::Refusal;
use super::truth::{Errors, Truth};
use super::ways::Way;
use softgrasp_bench::report::ReportError;
use softgrasp_bench::threads::pool;

/// Result of one way in one case.
#[derive(Clone, Debug)]
pub(super) struct Row {
    pub family: &'static str,
    pub case: String,
    pub nodes: usize,
    pub way: Way,
    pub allowed: Allowed,
    pub outcome: Outcome,
    /// Reason of a refusal or failure, or statement of a degraded answer.
    pub note: String,
    pub against: &'static str,
    pub numbers: Option<Numbers>,
    /// FNV-1a of the answer's bits, or of the reason of a refusal.
    pub hash: u64,
    /// Number of runs that gave these bits.
    pub runs: usize,
}

/// Errors and time of an answer.
#[derive(Clone, Copy, Debug)]
pub(super) struct Numbers {
    pub error_rel: Option<f64>,
    /// Largest relative error with which the answer counts as exact.
    pub threshold_rel: Option<f64>,
    pub stated_rel: f64,
    pub bound_rel: Option<f64>,
    pub residual_rel: f64,
    pub condition: f64,
    pub ms: f64,
}

/// Result of one run of a row.
enum Found {
    Answer(Box<Answer>, Option<Errors>),
    Refusal(Refusal),
    Fault(String),
}

/// Pool on which rows are asked, and a server with as many threads.
#[derive(Clone)]
struct Place {
    pool: Arc<rayon::ThreadPool>,
    host: Arc<Host>,
}

/// Pools and servers on which rows are asked.
pub(super) struct Pools(Vec<Place>);

impl Pools {
    /// One pool and one server for every entry of [`THREADS`].
    ///
    /// # Errors
    /// [`ReportError::Threads`], [`ReportError::Link`].
    pub fn new() -> Result<Self, ReportError> {
        let pools = THREADS.iter().map(|&threads| {
            let host = Arc::new(Host::open(&ServerChoice::Embedded, Some(threads))?);
            Ok(Place { pool: Arc::new(pool(threads)?), host })
        });
        Ok(Self(pools.collect::<Result<_, ReportError>>()?))
    }
}

/// Time after which a way is taken to hang.
fn limit(reach: Reach) -> Duration {
    match reach {
        Reach::All | Reach::OfEachKind => Duration::from_secs(120),
        Reach::Large => Duration::from_secs(900),
    }
}

/// Rows of all ways in one case.
pub(super) fn rows_of(family: &Family, case: &Case, pools: &Pools) -> Vec<Row> {
    let shared = Arc::new(case.clone());
    let mut rows = Vec::new();
    let mut truth: Option<(Way, Result<Arc<Truth>, String>)> = None;
    for way in Way::of(case.reach) {
        let known = truth.as_ref().filter(|(of, _)| of.element() == way.element());
        let right = match known {
            Some((_, right)) => right.clone(),
            None => truth_of(&shared, way),
        };
        truth = Some((way, right.clone()));
        rows.push(match right {
            Ok(right) => row(family, &shared, way, &right, pools),
            Err(fault) => {
                let found = Found::Fault(format!("the right answer: {fault}"));
                judged(family, case, way, "", (found, 0))
            }
        });
    }
    rows
}

fn truth_of(case: &Arc<Case>, way: Way) -> Result<Arc<Truth>, String> {
    if case.repeats != Repeats::Once {
        return Ok(Arc::new(Truth::on_the_way()));
    }
    let of = Arc::clone(case);
    guarded(limit(case.reach), move || {
        Arc::new(Truth::of(&of.question, way.element(), of.field.as_deref()))
    })
}

/// One row: timed and compared on the first pool, repeated on the others.
fn row(family: &Family, case: &Arc<Case>, way: Way, right: &Arc<Truth>, pools: &Pools) -> Row {
    let mut first: Option<Row> = None;
    for (place, threads) in pools.0.iter().zip(THREADS).take(case.runs) {
        let (of, right_one, place) = (Arc::clone(case), Arc::clone(right), place.clone());
        let is_first = first.is_none();
        let asked = guarded(limit(case.reach), move || {
            let Place { pool, host } = place;
            pool.install(|| ask(&of, way, is_first.then_some(&*right_one), &host))
        });
        let found = asked.unwrap_or_else(|fault| (Found::Fault(fault), 0));
        match &mut first {
            None => {
                let row = judged(family, case, way, right.source, found);
                let failed = row.outcome == Outcome::Failed;
                first = Some(row);
                if failed {
                    break;
                }
            }
            Some(row) if found.1 == row.hash => row.runs += 1,
            Some(row) => {
                row.outcome = Outcome::Failed;
                row.note = match found.0 {
                    Found::Fault(fault) => format!("{threads} threads: {fault}"),
                    _ => format!("{threads} threads give other bits than {} do", THREADS[0]),
                };
                break;
            }
        }
    }
    let never_asked = || (Found::Fault("it was not asked".to_owned()), 0);
    first.unwrap_or_else(|| judged(family, case, way, right.source, never_asked()))
}

/// Asks once; compares if there is an exact answer.
fn ask(case: &Case, way: Way, right: Option<&Truth>, host: &Host) -> (Found, u64) {
    let found = match case.repeats {
        Repeats::Once => match way.answer(&case.question, host) {
            Ok(answer) => {
                let errors =
                    right.and_then(|right| right.errors_of(&answer.displacement, way.is_single()));
                Found::Answer(Box::new(answer), errors)
            }
            Err(refusal) => Found::Refusal(refusal),
        },
        _ => match walk(way, case, right.is_some(), host) {
            Walk::Answered(answer, errors) => Found::Answer(Box::new(answer), errors),
            Walk::Refused(refusal) => Found::Refusal(refusal),
            Walk::Failed(fault) => Found::Fault(fault),
        },
    };
    let hash = match &found {
        Found::Answer(answer, _) => {
            hash_of(answer.displacement.iter().flat_map(|u| u.to_bits().to_le_bytes()))
        }
        Found::Refusal(Refusal { text, .. }) | Found::Fault(text) => hash_of(text.bytes()),
    };
    (found, hash)
}

fn judged(
    family: &Family,
    case: &Case,
    way: Way,
    against: &'static str,
    (found, hash): (Found, u64),
) -> Row {
    let allowed = way.allowed(case);
    let (outcome, note) = match &found {
        Found::Answer(answer, errors) => {
            let Answer { stated_rel, bound_rel, .. } = **answer;
            let promised_rel = way.promised_rel();
            let judged = Judged { errors: *errors, stated_rel, bound_rel, promised_rel };
            let (outcome, note) = Outcome::of_answer(&judged, allowed);
            let parts = [note.as_str(), answer.remark.as_str()];
            let parts: Vec<&str> = parts.into_iter().filter(|part| !part.is_empty()).collect();
            (outcome, parts.join("; "))
        }
        Found::Refusal(refusal) => Outcome::of_refusal(refusal, way.reason(case), allowed),
        Found::Fault(text) => (Outcome::Failed, text.clone()),
    };
    let numbers = match found {
        Found::Answer(answer, errors) => Some(Numbers {
            error_rel: errors.map(|e| e.largest_rel),
            threshold_rel: errors.map(|e| e.threshold_rel),
            stated_rel: answer.stated_rel,
            bound_rel: answer.bound_rel,
            residual_rel: answer.residual_rel,
            condition: answer.condition,
            ms: answer.ms,
        }),
        _ => None,
    };
    Row {
        family: family.name,
        case: case.name.clone(),
        nodes: case.question.mesh.node_count(),
        way,
        allowed,
        outcome,
        note,
        against,
        numbers,
        hash,
        runs: 1,
    }
}

/// Result of some work, unless it panics or takes too long; a thread that hangs is abandoned.
fn guarded<T: Send + 'static>(
    limit: Duration,
    work: impl FnOnce() -> T + Send + 'static,
) -> Result<T, String> {
    let (sender, receiver) = channel();
    let thread = std::thread::spawn(move || {
        let _ = sender.send(work());
    });
    match receiver.recv_timeout(limit) {
        Ok(done) => Ok(done),
        Err(RecvTimeoutError::Timeout) => Err(format!("no answer within {} s", limit.as_secs())),
        Err(RecvTimeoutError::Disconnected) => match thread.join() {
            Ok(()) => Err("no answer".to_owned()),
            Err(payload) => Err(format!("panic: {}", panic_text(payload.as_ref()))),
        },
    }
}

fn panic_text(payload: &(dyn std::any::Any + Send)) -> &str {
    let text = payload.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| payload.downcast_ref::<&str>().copied()).unwrap_or("without words")
}

/// Hash by FNV-1a, 64 bits.
fn hash_of(bytes: impl Iterator<Item = u8>) -> u64 {
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn panics_and_hangs_are_faults_with_a_text() {
        let second = Duration::from_secs(5);
        assert_eq!(guarded(second, || 7), Ok(7));
        let fault = guarded(second, || -> u8 { panic!("at node {}", 3) }).unwrap_err();
        assert_eq!(fault, "panic: at node 3");
        // The thread goes on waiting for a channel that never speaks.
        let (_kept, silent) = channel::<u8>();
        let fault = guarded(Duration::from_millis(20), move || silent.recv()).unwrap_err();
        assert!(fault.starts_with("no answer within"), "{fault}");
    }

    #[test]
    fn hash_tells_bits_apart() {
        assert_eq!(hash_of("a".bytes()), 0xaf63_dc4c_8601_ec8c);
        assert_ne!(
            hash_of(0f64.to_bits().to_le_bytes().into_iter()),
            hash_of((-0f64).to_bits().to_le_bytes().into_iter())
        );
    }
}
