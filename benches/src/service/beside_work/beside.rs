//! A new client and a new contact while others solve for long, and the loss of pace of these.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use glove_client::ask::connection::ServerConnection;
use softgrasp_core::mesh::BuiltIn;
use softgrasp_core::solve::Method;
use softgrasp_protocol::{Ask, NodeChoice, Request};

use super::bars::Bars;
use super::probe::{Probes, Times};
use crate::programs::Programs;
use crate::report::{ReportError, progress};
use crate::sample::Spread;
use crate::scene::Pressed;
use crate::table::{Cell, Table};
use crate::threads::processors;

/// Pause between two questions beside long work.
const PAUSE: Duration = Duration::from_millis(250);
/// Largest time until a new client's model is ready, as a multiple of that without other work.
const NEWCOMER_MAX: f64 = 10.0;
/// Largest time of an answer to a new contact, as a multiple of that without other work.
const CONTACT_MAX: f64 = 5.0;
/// Largest loss of pace of the long solves.
const LOSS_MAX: f64 = 1.0 / 3.0;

/// Sizes and numbers of all parts.
struct Amounts {
    newcomer_nodes: usize,
    contact_nodes: usize,
    quiet_questions: usize,
    /// Number of sessions that solve without a pause, nodes of each, and least number of timed solves.
    long: [(usize, usize, usize); 2],
}

const FULL: Amounts = Amounts {
    newcomer_nodes: 1000,
    contact_nodes: 10_648,
    quiet_questions: 30,
    long: [(1, 100_000, 2), (8, 22_000, 16)],
};
const QUICK: Amounts = Amounts {
    newcomer_nodes: 64,
    contact_nodes: 125,
    quiet_questions: 3,
    long: [(1, 1000, 2), (2, 216, 4)],
};

/// Measures the section.
///
/// # Errors
/// [`ReportError`].
pub(super) fn measure(programs: &Programs, bars: &mut Bars<'_>) -> Result<(), ReportError> {
    let amounts = if bars.is_quick() { QUICK } else { FULL };
    let threads = processors().to_string();
    let arguments = ["--listen", "127.0.0.1:0", "--threads", &threads, "--max-queue", "64"];
    let server = programs.serve_as(&arguments)?;
    bars.report().text(
        "A newcomer connects and uploads a cube of 1000 nodes that the server has never seen, and waits \
         until it is ready. A client with a kept cube of 10 648 nodes then presses five surface nodes \
         that it never touched before, and waits for the displacements of the surface. A pause of \
         250 ms follows, and both begin anew. Clients, newcomers and server share one machine; loopback \
         TCP. Beside them sessions solve one request after the other without a pause (`auto`, one \
         request with its mesh). All contacts are asked again by a factor when the server rests, and \
         every long solve must give the displacements of the first one, bit by bit. *Pace* is solves a \
         second, alone and beside the questions.",
    );
    let mut tables = Tables::new();
    let mut probes = Probes::new(&server.address, amounts.newcomer_nodes, amounts.contact_nodes)?;
    let mut quiet = Times::default();
    progress("service", "quiet");
    for _ in 0..amounts.quiet_questions {
        probes.ask(&mut quiet)?;
    }
    rows(&mut tables.questions, "nobody", &quiet, &quiet);
    for long in amounts.long {
        beside(&server.address, long, (&mut probes, &quiet), &mut tables, bars)?;
    }
    let checked = probes.check()?;
    bars.report().table(tables.questions);
    bars.report().table(tables.pace);
    bars.report().text(format!("{checked} answers to new contacts were checked and are right."));
    Ok(())
}

struct Tables {
    questions: Table,
    pace: Table,
}

impl Tables {
    fn new() -> Self {
        let questions = [
            "beside",
            "question",
            "asked",
            "p50_ms",
            "p90_ms",
            "max_ms",
            "quiet_p50_ms",
            "ratio_p50",
            "ratio_max",
        ];
        let pace = ["work", "alone_per_s", "beside_per_s", "loss", "solves_beside"];
        Self {
            questions: Table::new("service-beside", "Questions beside long work", &questions),
            pace: Table::new("service-pace", "What the long work loses", &pace),
        }
    }
}

/// Asks questions beside sessions that solve without a pause, until `solves_min` solves are done.
fn beside(
    address: &str,
    (sessions, nodes, solves_min): (usize, usize, usize),
    (probes, quiet): (&mut Probes, &Times),
    tables: &mut Tables,
    bars: &mut Bars<'_>,
) -> Result<(), ReportError> {
    let scene = Pressed::try_new(BuiltIn::Cube, nodes)?;
    let what = format!("{sessions} × {} nodes", scene.mesh.node_count());
    progress("service", &what);
    let mut request = scene.whole_request(Method::Front);
    let few: Vec<u32> = scene.surface.nodes.iter().copied().take(100).collect();
    request.question = scene.question("auto", 1.0, NodeChoice::Nodes(few));
    let work = LongWork { address, request: &request, sessions, solves_min };
    let alone = work.run(|_| Ok(()))?;
    let mut times = Times::default();
    let beside = work.run(|is_over| {
        while !is_over() {
            probes.ask(&mut times)?;
            std::thread::sleep(PAUSE);
        }
        Ok(())
    })?;
    let [newcomer, contact] = rows(&mut tables.questions, &what, &times, quiet);
    let loss = 1.0 - beside.per_s / alone.per_s;
    tables.pace.push([
        Cell::Text(what.clone()),
        Cell::Number(alone.per_s),
        Cell::Number(beside.per_s),
        Cell::Number(loss),
        Cell::Count(beside.solves as u64),
    ]);
    bars.row(&format!("newcomer beside {what}, slowest"), newcomer, NEWCOMER_MAX, "× quiet");
    bars.row(&format!("new contact beside {what}, slowest"), contact, CONTACT_MAX, "× quiet");
    bars.row(&format!("loss of {what}"), loss, LOSS_MAX, "of the pace");
    Ok(())
}

/// Adds the rows of both questions; returns the slowest of each, relative to the median without other
/// work.
fn rows(table: &mut Table, beside: &str, times: &Times, quiet: &Times) -> [f64; 2] {
    let both = [
        ("a newcomer's model is ready", &times.newcomer_ms, &quiet.newcomer_ms),
        ("a new contact is answered", &times.contact_ms, &quiet.contact_ms),
    ];
    both.map(|(question, times, quiet)| {
        let mut sorted = times.clone();
        sorted.sort_by(f64::total_cmp);
        let at = |share: f64| sorted.get((share * (sorted.len() - 1) as f64) as usize).copied();
        let (p50, max) = (at(0.5).unwrap_or(f64::NAN), at(1.0).unwrap_or(f64::NAN));
        let usual = Spread::of(quiet.clone()).median;
        table.push([
            Cell::Text(beside.to_owned()),
            Cell::Text(question.to_owned()),
            Cell::Count(times.len() as u64),
            Cell::Number(p50),
            at(0.9).map_or(Cell::Blank, Cell::Number),
            Cell::Number(max),
            Cell::Number(usual),
            Cell::Number(p50 / usual),
            Cell::Number(max / usual),
        ]);
        max / usual
    })
}

/// Sessions that solve the same request again and again.
struct LongWork<'a> {
    address: &'a str,
    request: &'a Ask,
    sessions: usize,
    solves_min: usize,
}

/// Number of solves, and solves per second.
struct Pace {
    solves: usize,
    per_s: f64,
}

impl LongWork<'_> {
    /// Solves until enough solves are done; `meanwhile` runs beside and can ask whether that is so.
    fn run(
        &self,
        meanwhile: impl FnOnce(&dyn Fn() -> bool) -> Result<(), ReportError>,
    ) -> Result<Pace, ReportError> {
        let (done, is_failed) = (AtomicUsize::new(0), AtomicBool::new(false));
        let is_over = || done.load(Ordering::Relaxed) >= self.solves_min;
        let begun = Instant::now();
        let (solved, asked) = std::thread::scope(|scope| {
            let sessions: Vec<_> = (0..self.sessions)
                .map(|_| {
                    let (done, is_failed) = (&done, &is_failed);
                    scope.spawn(move || {
                        let solved = self.solve_on(done, is_failed);
                        is_failed.fetch_or(solved.is_err(), Ordering::Relaxed);
                        solved
                    })
                })
                .collect();
            let asked = meanwhile(&|| is_over() || is_failed.load(Ordering::Relaxed));
            is_failed.fetch_or(asked.is_err(), Ordering::Relaxed);
            let solved: Result<Vec<f64>, ReportError> = sessions
                .into_iter()
                .map(|session| session.join().unwrap_or_else(|_| Err(ended_abnormally())))
                .collect();
            (solved, asked)
        });
        asked?;
        let _ = solved?;
        let solves = done.load(Ordering::Relaxed);
        Ok(Pace { solves, per_s: solves as f64 / begun.elapsed().as_secs_f64() })
    }

    /// Runs one session; returns the time for which it solved, s.
    fn solve_on(&self, done: &AtomicUsize, is_failed: &AtomicBool) -> Result<f64, ReportError> {
        let mut connection = ServerConnection::connect(self.address)?;
        let request = Request::from(self.request.clone());
        let begun = Instant::now();
        let mut first = None;
        while done.load(Ordering::Relaxed) < self.solves_min && !is_failed.load(Ordering::Relaxed) {
            let answer = crate::requests::answer(connection.ask(&request))?;
            let found = answer.displacements.into_f64();
            let right = first.get_or_insert_with(|| found.clone());
            if *right != found {
                let what = "the same request gave other bits beside other work".to_owned();
                return Err(ReportError::Wrong { what, error: 1.0, allowed: 0.0 });
            }
            done.fetch_add(1, Ordering::Relaxed);
        }
        Ok(begun.elapsed().as_secs_f64())
    }
}

fn ended_abnormally() -> ReportError {
    ReportError::Ended { what: "a session that solves".to_owned(), said: "it panicked".to_owned() }
}
