//! Honest clients beside hostile connections, and beside other clients' long work.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::process::Command;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Duration;

use glove_client::ask::connection::ServerConnection;
use softgrasp_core::mesh::BuiltIn;
use softgrasp_protocol::{Limits, Request, VERSION};

use super::bars::{Amounts, bar, server};
use super::malformed::malformed;
use crate::programs::Programs;
use crate::random::Random;
use crate::report::{Report, ReportError};
use crate::sample::Spread;
use crate::scene::Pressed;
use crate::table::{Cell, Table};
use crate::tail::Tail;
use crate::visitors::{Heard, Kind, Subject, visit};

/// Number of hostile connections.
const HOSTILE: usize = 200;
/// Time between two actions of each hostile connection.
const ACT_EVERY: Duration = Duration::from_millis(50);
/// Number of honest clients, and their rate.
const HONEST: usize = 4;
const RATE_HZ: f64 = 60.0;

/// Other clients beside the honest ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Others {
    Nobody,
    Hostile,
    /// Two clients that upload one large model after the other.
    Uploads,
}

impl Others {
    const ALL: [Self; 3] = [Self::Nobody, Self::Hostile, Self::Uploads];

    fn words(self) -> &'static str {
        match self {
            Self::Nobody => "nobody",
            Self::Hostile => "200 hostile connections",
            Self::Uploads => "two clients that upload 8000-node models without a pause",
        }
    }
}

/// Measures the answers to honest clients.
///
/// # Errors
/// [`ReportError`].
pub(super) fn measure(
    programs: &Programs,
    amounts: Amounts,
    is_quick: bool,
    bars: &mut Table,
    report: &mut Report,
) -> Result<(), ReportError> {
    let server = server(programs, "127.0.0.1:0")?;
    let subject = Subject::new(Kind::Linear, 1000, &server.address)?;
    let lasts = Duration::from_secs_f64(amounts.beats_s);
    let mut p99 = [const { Vec::new() }; 3];
    let mut table = Table::new(
        "service-trust-honest",
        "Four honest clients at 60 Hz, 1000 nodes, beside others",
        &["others", "round", "answers", "p50_ms", "p99_ms", "max_ms", "acts_of_others"],
    );
    for round in 0..amounts.rounds {
        for (others, p99) in Others::ALL.into_iter().zip(&mut p99) {
            let (heard, acts) = beside(others, &subject, &server.address, lasts);
            if heard.wrong > 0 || !heard.failed.is_empty() {
                report.fault(format!("{others:?}: {} wrong, {:?}", heard.wrong, heard.failed));
            }
            let tail = Tail::of(heard.latencies_ms.iter().copied());
            p99.extend(tail.p99.or(tail.max));
            let number = |value: Option<f64>| value.map_or(Cell::Blank, Cell::Number);
            table.push([
                Cell::Text(others.words().to_owned()),
                Cell::Count(round as u64 + 1),
                Cell::Count(heard.latencies_ms.len() as u64),
                number(tail.p50),
                number(tail.p99),
                number(tail.max),
                Cell::Count(acts as u64),
            ]);
        }
    }
    report.table(table);
    let [quiet, hostile, uploads] = p99.map(|times| Spread::of(times).median);
    let mut row = |row| bar(bars, report, is_quick, row);
    row((
        "p99 of honest clients beside 200 hostile connections, over quiet",
        hostile / quiet,
        2.0,
        "times",
    ));
    // A slice of the system's scheduler, for each of the two threads that may be in the way.
    row(("p99 of honest clients beside endless uploads, less quiet", uploads - quiet, 16.0, "ms"));
    Ok(())
}

fn beside(others: Others, subject: &Subject, address: &str, lasts: Duration) -> (Heard, usize) {
    let (is_over, acts) = (AtomicBool::new(false), AtomicUsize::new(0));
    let heard = std::thread::scope(|scope| {
        let number = match others {
            Others::Nobody => 0,
            Others::Hostile => HOSTILE,
            Others::Uploads => 2,
        };
        for number in 0..number {
            let (is_over, acts) = (&is_over, &acts);
            scope.spawn(move || match others {
                Others::Uploads => upload_on(address, number, is_over, acts),
                _ => be_hostile(address, number, is_over, acts),
            });
        }
        if number > 0 {
            // They have begun.
            std::thread::sleep(Duration::from_millis(500));
        }
        let heard = visit(subject, address, HONEST, RATE_HZ, lasts);
        is_over.store(true, Ordering::Relaxed);
        heard
    });
    (heard, acts.into_inner())
}

/// Uploads new models, and drops each.
fn upload_on(address: &str, number: usize, is_over: &AtomicBool, acts: &AtomicUsize) {
    let Ok(scene) = Pressed::try_new(BuiltIn::Cube, 8000) else { return };
    let Ok(mut connection) = ServerConnection::connect(address) else { return };
    let mut upload = scene.upload();
    let mut turn = 0;
    while !is_over.load(Ordering::Relaxed) {
        turn += 1;
        // Another model each time: its material differs in a late digit.
        for material in &mut upload.materials {
            material.young = 1.0e5 + (2 * turn + number) as f64;
        }
        let hash = softgrasp_protocol::ModelHash::of(&upload);
        let uploaded = connection.ask(&Request::UploadModel(upload.clone()));
        if uploaded.and_then(|_| connection.send(&Request::Drop(hash))).is_err() {
            return;
        }
        acts.fetch_add(1, Ordering::Relaxed);
    }
}

/// Gives the calling thread the lowest priority, because hostile clients would be on another machine.
/// Where the system refuses, the figures are worse for it. One that is only nice keeps a share of the processors.
fn be_last() {
    let tid = std::fs::read_link("/proc/thread-self").ok();
    let tid = tid.and_then(|path| Some(path.file_name()?.to_str()?.to_owned()));
    if let Some(tid) = tid {
        // Behind all that is not of this kind itself, without a share of its own.
        let is_idle = Command::new("chrt").args(["--idle", "--pid", "0", &tid]).output();
        if !is_idle.is_ok_and(|said| said.status.success()) {
            // Without these programs nothing has changed.
            drop(Command::new("renice").args(["-n", "19", "-p", &tid]).output());
        }
    }
}

/// Opens one hostile connection after the other; `number` decides their kind.
fn be_hostile(address: &str, number: usize, is_over: &AtomicBool, acts: &AtomicUsize) {
    be_last();
    let mut random = Random(number as u64);
    while !is_over.load(Ordering::Relaxed) {
        let Ok(mut stream) = TcpStream::connect(address) else { return };
        let _ = stream.set_read_timeout(Some(ACT_EVERY));
        let _ = stream.set_write_timeout(Some(ACT_EVERY));
        let _ = socket2::SockRef::from(&stream).set_linger(Some(Duration::ZERO));
        act(&mut stream, number, &mut random, is_over, acts);
        acts.fetch_add(1, Ordering::Relaxed);
        std::thread::sleep(ACT_EVERY);
    }
}

fn act(
    stream: &mut TcpStream,
    number: usize,
    random: &mut Random,
    is_over: &AtomicBool,
    acts: &AtomicUsize,
) {
    let mut replies = [0; 4096];
    match number % 6 {
        // Part of a header, and then nothing until the server gives up.
        0 => {
            let _ =
                stream.write_all(b"SGRP").and_then(|()| stream.write_all(&VERSION.to_le_bytes()));
            while !is_over.load(Ordering::Relaxed) && is_open(stream.read(&mut replies)) {}
        }
        // Bytes without sense.
        1 => {
            let bytes: Vec<u8> = (0..4096).map(|_| random.below(256) as u8).collect();
            let _ = stream.write_all(&bytes);
            let _ = stream.read(&mut replies);
        }
        // Frames without sense, one after the other.
        2 => {
            while !is_over.load(Ordering::Relaxed) {
                if stream.write_all(&malformed(random)).is_err() {
                    return;
                }
                acts.fetch_add(1, Ordering::Relaxed);
                // Some have no reply.
                if !is_open(stream.read(&mut replies)) {
                    return;
                }
            }
        }
        // Gone at once.
        3 => {}
        // Questions whose answers it does not take.
        4 => {
            let mut ping = Vec::new();
            let _ = Request::Ping { nonce: 1 }.encode_into(1, &Limits::default(), &mut ping);
            let many = ping.repeat(1000);
            while !is_over.load(Ordering::Relaxed) && stream.write_all(&many).is_ok() {
                acts.fetch_add(1, Ordering::Relaxed);
                std::thread::sleep(ACT_EVERY);
            }
        }
        // A large upload that breaks off.
        _ => {
            let mut header = malformed(random);
            header.truncate(32);
            header[6..8].copy_from_slice(&4u16.to_le_bytes());
            header[12..16].copy_from_slice(&(200u32 << 20).to_le_bytes());
            let crc = crc32c::crc32c(&header[..24]);
            header[24..28].copy_from_slice(&crc.to_le_bytes());
            let _ = stream.write_all(&header);
            let _ = stream.write_all(&vec![0; 1 << 20]);
        }
    }
}

/// Whether the peer of a read has not closed.
fn is_open(read: std::io::Result<usize>) -> bool {
    match read {
        Ok(count) => count > 0,
        Err(error) => {
            matches!(error.kind(), std::io::ErrorKind::WouldBlock | std::io::ErrorKind::TimedOut)
        }
    }
}
