//! An hour of frame questions at 250 Hz: every answer has the right bits, and the server's memory does
//! not grow.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use super::bars::{Amounts, bar, server};
use crate::programs::Programs;
use crate::report::{Report, ReportError};
use crate::table::Table;
use crate::visitors::{Kind, Subject};

const CLIENTS: usize = 3;

/// Measures the long run.
///
/// # Errors
/// [`ReportError`].
pub(super) fn measure(
    programs: &Programs,
    amounts: Amounts,
    bars: &mut Table,
    report: &mut Report,
) -> Result<(), ReportError> {
    let server = server(programs, "127.0.0.1:0")?;
    let subject = Subject::new(Kind::Linear, 1000, &server.address)?;
    let wrong = AtomicUsize::new(0);
    let play = |frames: usize| -> Result<(), ReportError> {
        std::thread::scope(|scope| {
            let clients: Vec<_> = (0..CLIENTS)
                .map(|_| {
                    scope.spawn(|| -> Result<(), ReportError> {
                        let mut connection = subject.connect(&server.address)?;
                        for frame in 0..frames / CLIENTS {
                            let right = subject.ask(&mut connection, frame)?;
                            wrong.fetch_add(usize::from(!right), Ordering::Relaxed);
                        }
                        Ok(())
                    })
                })
                .collect();
            for client in clients {
                client.join().unwrap_or_else(|_| {
                    let said = "a client ended abnormally".to_owned();
                    Err(ReportError::Ended { what: "the long run".to_owned(), said })
                })?;
            }
            Ok(())
        })
    };
    play(amounts.frames / 20)?;
    let before = server.resident_bytes().unwrap_or(0.0);
    let begun = Instant::now();
    play(amounts.frames)?;
    let took = begun.elapsed().as_secs_f64();
    let after = server.resident_bytes().unwrap_or(0.0);
    report.text(format!(
        "Long run: {} frames on 1000 nodes, those of an hour at 250 Hz, by {CLIENTS} clients in {took:.0} s \
         ({:.0} frames a second), each compared bit by bit with a quiet server's. Resident memory {:.1} MB \
         before and {:.1} MB after.",
        amounts.frames,
        amounts.frames as f64 / took,
        before * 1e-6,
        after * 1e-6,
    ));
    let is_quick = amounts.frames < 100_000;
    let mut row = |row| bar(bars, report, is_quick, row);
    row(("wrong answers of an hour's frames", wrong.into_inner() as f64, 0.0, "answers"));
    row((
        "growth of resident memory over an hour's frames",
        100.0 * (after / before - 1.0).max(0.0),
        5.0,
        "%",
    ));
    Ok(())
}
