//! Writes the tables, a figure, and the text about them.

use super::row::Row;
use crate::plot::{Mark, Plot, PlotPoint, Scale, Series};
use crate::report::{Report, ReportError};
use crate::table::Table;

/// Time after which an answer is late for the next picture, ms.
const IN_TIME_MS: f64 = 16.0;

pub(super) fn write(report: &mut Report, rows: &[Row]) -> Result<(), ReportError> {
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
        "service-load-limits",
        "Most clients whose 99 % quantile is at most 16 ms",
        &["frames", "clients", "p50_ms", "p99_ms", "server_processors", "clients_processors"],
    );
    for series in rows.chunk_by(|a, b| a.what == b.what) {
        let in_time =
            |row: &&Row| row.tail.p99.or(row.tail.max).is_some_and(|p99| p99 <= IN_TIME_MS);
        // The last one before the first that is too slow.
        if let Some(row) = series.iter().take_while(in_time).last() {
            best.push(
                row.cells()
                    .into_iter()
                    .enumerate()
                    .filter(|(i, _)| ![2, 5].contains(i))
                    .map(|(_, c)| c),
            );
        }
    }
    report.table(best);
    let mut all = Table::new(
        "service-load",
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
    rows.iter().for_each(|row| all.push(row.cells()));
    report.table(all);
    figure(report, rows)
}

fn figure(report: &mut Report, rows: &[Row]) -> Result<(), ReportError> {
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
            "service-load",
            "Time of 99 % of the frames against the number of clients.",
            plot.svg()?,
        );
    }
    Ok(())
}
