//! Report `load`: how many clients at 60 Hz one server serves in time, and what stops it.

use std::time::{Duration, Instant};

use crate::plot::{Mark, Plot, PlotPoint, Scale, Series};
use crate::programs::{Programs, Server};
use crate::report::{Options, Report, ReportError};
use crate::table::{Cell, Table};
use crate::tail::Tail;
use crate::threads::processors;
use crate::visitors::{Kind, Subject, visit};

/// Frames a second of each client.
const RATE_HZ: f64 = 60.0;
/// A frame that is not there by then is late for the next picture, ms.
const IN_TIME_MS: f64 = 16.0;
/// No more clients than this are tried.
const CLIENTS_MAX: usize = 1024;

/// One number of clients, measured.
struct Row {
    what: String,
    clients: usize,
    answers: usize,
    tail: Tail,
    /// Processors that the server kept busy.
    server_busy: Option<f64>,
    /// Processors that the clients kept busy.
    clients_busy: Option<f64>,
}

/// Measures the report.
///
/// # Errors
/// [`ReportError`].
pub fn measure(options: &Options) -> Result<Report, ReportError> {
    let threads = processors();
    let title = "How many clients one server serves in time";
    let mut report = Report::begin("load", title, &threads.to_string(), options);
    let programs = Programs::find()?;
    let mut rows = Vec::new();
    for (kind, nodes) in subjects(options.is_quick) {
        let what =
            format!("{}, {nodes} nodes", if kind == Kind::Linear { "linear" } else { "large" });
        let server = server(&programs, threads)?;
        let subject = Subject::new(kind, nodes, &server.address)?;
        climb(&what, &subject, &server, options.is_quick, &mut rows, &mut report);
    }
    write(&mut report, &rows)?;
    Ok(report)
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

/// More and more clients, until they are not served in time.
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
        if tail.p99.or(tail.max).is_none_or(|p99| p99 > 4.0 * IN_TIME_MS) {
            break;
        }
        clients = next(clients);
    }
}

/// Steps of at most a third.
fn next(clients: usize) -> usize {
    match clients {
        1..4 => clients + 1,
        _ => clients + clients.div_ceil(4),
    }
}

/// Processor time of this process so far, s.
fn own_busy_s() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
    let ticks = |at: usize| fields.get(at)?.parse::<f64>().ok();
    Some((ticks(11)? + ticks(12)?) / 100.0)
}

fn write(report: &mut Report, rows: &[Row]) -> Result<(), ReportError> {
    report.text(
        "Clients and server are two processes of one machine and share its processors; loopback TCP, \
         no encryption. Each client asks 60 times a second for the displacements of the surface of a \
         cube held at five nodes, on a model that all share, and waits for each answer. A frame's time \
         runs from the moment it was due, so a client that still waits for an earlier answer is \
         counted. Every answer is checked: a linear one bit by bit against a quiet server's, one at \
         large deformation by the error that it states (at most 2e-3). A row ends a series when its \
         99 % quantile is above 64 ms.",
    );
    report.text(
        "All sockets share one thread of the server, so linear frames, whose answers take less than reading \
         and writing them, keep little more than one processor of it busy however many there are. Where \
         both columns of processors together are near the machine's number, the machine is used up, \
         and clients on other machines would leave the server their part. Frames at large deformation \
         are bound by the solving threads and by the one that makes factors beside them.",
    );
    let mut best = Table::new(
        "load-limits",
        "Most clients whose 99 % quantile is at most 16 ms",
        &["frames", "clients", "p50_ms", "p99_ms", "server_processors", "clients_processors"],
    );
    for series in rows.chunk_by(|a, b| a.what == b.what) {
        let in_time =
            |row: &&Row| row.tail.p99.or(row.tail.max).is_some_and(|p99| p99 <= IN_TIME_MS);
        // The last one before the first that is too slow.
        if let Some(row) = series.iter().take_while(in_time).last() {
            best.push(
                cells(row)
                    .into_iter()
                    .enumerate()
                    .filter(|(i, _)| ![2, 5].contains(i))
                    .map(|(_, c)| c),
            );
        }
    }
    report.table(best);
    let mut all = Table::new(
        "load",
        "All numbers of clients",
        &[
            "frames",
            "clients",
            "answers",
            "p50_ms",
            "p99_ms",
            "max_ms",
            "server_processors",
            "clients_processors",
        ],
    );
    rows.iter().for_each(|row| all.push(cells(row)));
    report.table(all);
    let series = rows.chunk_by(|a, b| a.what == b.what).map(|series| Series {
        label: series.first().map_or_else(String::new, |row| row.what.clone()),
        mark: Mark::Line,
        points: series
            .iter()
            .filter_map(|row| {
                Some(PlotPoint { x: row.clients as f64, y: row.tail.p99?, spread: None })
            })
            .collect(),
    });
    let plot = Plot {
        title: "99 % of the frames are answered within".to_owned(),
        x_label: "clients at 60 Hz".to_owned(),
        y_label: "ms".to_owned(),
        x_scale: Scale::Log,
        y_scale: Scale::Log,
        series: series.filter(|series| !series.points.is_empty()).collect(),
    };
    if !plot.series.is_empty() {
        report.figure(
            "load",
            "Time of 99 % of the frames against the number of clients.",
            plot.svg()?,
        );
    }
    Ok(())
}

fn cells(row: &Row) -> Vec<Cell> {
    let number = |value: Option<f64>| value.map_or(Cell::Blank, Cell::Number);
    vec![
        Cell::Text(row.what.clone()),
        Cell::Count(row.clients as u64),
        Cell::Count(row.answers as u64),
        number(row.tail.p50),
        number(row.tail.p99),
        number(row.tail.max),
        number(row.server_busy),
        number(row.clients_busy),
    ]
}
