//! A million malformed messages on a hundred thousand connections: the server goes on to answer, and does
//! not grow.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use softgrasp_protocol::{HEADER_LEN, Kind, VERSION};

use super::bars::{Amounts, bar, server};
use crate::programs::Programs;
use crate::random::Random;
use crate::report::{Report, ReportError};
use crate::table::Table;
use crate::visitors::{Kind as FrameKind, Subject};

/// Number of malformed messages on each connection that keeps to the format.
const FRAMES: usize = 20;
/// Number of connections at the same time.
const THREADS: usize = 8;
/// Time after which a server that has not closed is taken to hang.
const END_MAX: Duration = Duration::from_secs(30);

/// Numbers of connections and malformed messages, and of those that failed.
#[derive(Default)]
struct Counts {
    connections: AtomicUsize,
    frames: AtomicUsize,
    unanswered: AtomicUsize,
}

/// Measures the malformed messages.
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
    let subject = Subject::new(FrameKind::Linear, 1000, &server.address)?;
    let is_quick = amounts.connections < 10_000;
    // What a server takes once, for its first thousands of connections, is no growth.
    soak(&server.address, amounts.connections / 5, 1, &Counts::default());
    let before = server.resident_bytes().unwrap_or(0.0);
    let (counts, begun) = (Counts::default(), Instant::now());
    soak(&server.address, amounts.connections, 2, &counts);
    let took = begun.elapsed().as_secs_f64();
    let after = server.resident_bytes().unwrap_or(0.0);
    let right = subject.ask(&mut subject.connect(&server.address)?, 0)?;
    let count = |of: &AtomicUsize| of.load(Ordering::Relaxed) as f64;
    report.text(format!(
        "Malformed: {} connections, half of them with random bytes, half with {FRAMES} frames each whose \
         header and checksums are right and whose payload makes no sense: {} such frames, {took:.0} s. \
         Resident memory of the server {:.1} MB before and {:.1} MB after.",
        count(&counts.connections),
        count(&counts.frames),
        before * 1e-6,
        after * 1e-6,
    ));
    let growth = 100.0 * (after / before - 1.0).max(0.0);
    let mut row = |row| bar(bars, report, is_quick, row);
    row(("growth of resident memory over the malformed soak", growth, 5.0, "%"));
    let lost = count(&counts.unanswered);
    row((
        "connections of the soak that were neither answered nor closed",
        lost,
        0.0,
        "connections",
    ));
    row((
        "wrong answers to an honest client after it",
        f64::from(u8::from(!right)),
        0.0,
        "answers",
    ));
    Ok(())
}

fn soak(address: &str, connections: usize, seed: u64, counts: &Counts) {
    std::thread::scope(|scope| {
        for thread in 0..THREADS {
            scope.spawn(move || {
                let mut random = Random(seed * 1000 + thread as u64);
                for _ in 0..connections / THREADS {
                    let bytes = match random.below(2) {
                        0 => {
                            let len = 1 + random.below(200);
                            random_bytes(&mut random, len)
                        }
                        _ => {
                            counts.frames.fetch_add(FRAMES, Ordering::Relaxed);
                            (0..FRAMES).flat_map(|_| malformed(&mut random)).collect()
                        }
                    };
                    counts.connections.fetch_add(1, Ordering::Relaxed);
                    if !is_ended(address, &bytes) {
                        counts.unanswered.fetch_add(1, Ordering::Relaxed);
                    }
                }
            });
        }
    });
}

/// Sends bytes on a new connection and reads until the server has closed it; returns whether it has.
fn is_ended(address: &str, bytes: &[u8]) -> bool {
    let Ok(mut stream) = TcpStream::connect(address) else { return false };
    let _ = stream.set_read_timeout(Some(END_MAX));
    // The server may close before it has read all.
    let _ = stream.write_all(bytes);
    let _ = stream.shutdown(std::net::Shutdown::Write);
    let ended = match stream.read_to_end(&mut Vec::new()) {
        Ok(_) => true,
        Err(error) => error.kind() == std::io::ErrorKind::ConnectionReset,
    };
    // No port is to rest for a minute after each of so many connections.
    let _ = socket2::SockRef::from(&stream).set_linger(Some(Duration::ZERO));
    ended
}

fn random_bytes(random: &mut Random, len: usize) -> Vec<u8> {
    (0..len).map(|_| random.below(256) as u8).collect()
}

/// Message of the right form around random bytes.
pub(super) fn malformed(random: &mut Random) -> Vec<u8> {
    let requests: Vec<Kind> =
        Kind::ALL.into_iter().filter(|kind| *kind as u16 & 0x8000 == 0).collect();
    let kind = requests[random.below(requests.len())] as u16;
    let len = 1 + random.below(64);
    let mut payload = random_bytes(random, len);
    if random.below(2) == 0 {
        // The length of the part is right, so that its fields are read.
        payload.splice(0..0, (len as u64).to_le_bytes());
        payload.resize(payload.len().next_multiple_of(8), 0);
    }
    let len = payload.len();
    let mut raw = vec![0; HEADER_LEN];
    raw[0..4].copy_from_slice(b"SGRP");
    raw[4..6].copy_from_slice(&VERSION.to_le_bytes());
    raw[6..8].copy_from_slice(&kind.to_le_bytes());
    raw[12..16].copy_from_slice(&(len as u32).to_le_bytes());
    raw[16..24].copy_from_slice(&7u64.to_le_bytes());
    let header_crc = crc32c::crc32c(&raw[..24]);
    raw[24..28].copy_from_slice(&header_crc.to_le_bytes());
    let frame_crc = crc32c::crc32c_append(crc32c::crc32c(&raw[..28]), &payload);
    raw[28..32].copy_from_slice(&frame_crc.to_le_bytes());
    raw.extend_from_slice(&payload);
    raw
}
