//! More and more clients, until the server does not answer them in time.

use std::time::{Duration, Instant};

use super::page::write;
use super::row::Row;
use crate::programs::{Programs, Server};
use crate::report::{Options, Report, ReportError};
use crate::tail::Tail;
use crate::threads::processors;
use crate::visitors::{Kind, Subject, visit};

/// Frame questions per second of each client.
const RATE_HZ: f64 = 60.0;
/// Quantile of 99 % of the times, ms, above which a series ends.
const TOO_LATE_MS: f64 = 64.0;
/// Largest number of clients.
const CLIENTS_MAX: usize = 1024;

/// Measures the report.
///
/// # Errors
/// [`ReportError`].
pub fn measure(options: &Options, report: &mut Report) -> Result<(), ReportError> {
    let threads = processors();
    let programs = Programs::find()?;
    let mut rows = Vec::new();
    for (kind, nodes) in subjects(options.is_quick) {
        let what =
            format!("{}, {nodes} nodes", if kind == Kind::Linear { "linear" } else { "large" });
        let server = server(&programs, threads)?;
        let subject = Subject::new(kind, nodes, &server.address)?;
        climb(&what, &subject, &server, options.is_quick, &mut rows, report);
    }
    write(report, &rows)
}

fn subjects(is_quick: bool) -> Vec<(Kind, usize)> {
    match is_quick {
        true => vec![(Kind::Linear, 216)],
        false => vec![
            (Kind::Linear, 1000),
            (Kind::Linear, 10_648),
            (Kind::Large, 1000),
            (Kind::Large, 3375),
        ],
    }
}

fn server(programs: &Programs, threads: usize) -> Result<Server, ReportError> {
    let (threads, most) = (threads.to_string(), CLIENTS_MAX.to_string());
    programs.serve_as(&[
        "--listen",
        "127.0.0.1:0",
        "--threads",
        &threads,
        "--max-sessions",
        &most,
        "--max-queue",
        &most,
    ])
}

/// Measures more and more clients, until the server does not answer them in time.
fn climb(
    what: &str,
    subject: &Subject,
    server: &Server,
    is_quick: bool,
    rows: &mut Vec<Row>,
    report: &mut Report,
) {
    let lasts = Duration::from_secs(if is_quick { 1 } else { 5 });
    let mut clients = 1;
    while clients <= if is_quick { 2 } else { CLIENTS_MAX } {
        let before = (server.busy_s(), own_busy_s(), Instant::now());
        let heard = visit(subject, &server.address, clients, RATE_HZ, lasts);
        let took = before.2.elapsed().as_secs_f64();
        let share = |now: Option<f64>, then: Option<f64>| Some((now? - then?) / took);
        if heard.wrong > 0 || !heard.failed.is_empty() {
            let why = heard.failed.first().cloned().unwrap_or_default();
            report.fault(format!("{what}, {clients} clients: {} wrong; {why}", heard.wrong));
        }
        let tail = Tail::of(heard.latencies_ms.iter().copied());
        rows.push(Row {
            what: what.to_owned(),
            clients,
            answers: heard.latencies_ms.len(),
            tail,
            server_busy: share(server.busy_s(), before.0),
            clients_busy: share(own_busy_s(), before.1),
        });
        if tail.p99.or(tail.max).is_none_or(|p99| p99 > TOO_LATE_MS) {
            break;
        }
        clients = next(clients);
    }
}

/// Next number of clients, larger by at most a third.
fn next(clients: usize) -> usize {
    match clients {
        1..4 => clients + 1,
        _ => clients + clients.div_ceil(4),
    }
}

/// Processor time that this process has used, s.
fn own_busy_s() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
    let ticks = |at: usize| fields.get(at)?.parse::<f64>().ok();
    Some((ticks(11)? + ticks(12)?) / 100.0)
}
