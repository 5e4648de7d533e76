//! Link in memory that splits, delays, stalls, damages or cuts the bytes, all of it by a seed.

use std::time::Duration;

use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt, DuplexStream, duplex, split};
use tokio::time::sleep;

use crate::random::Random;

/// Faults on one direction of a link.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WayFaults {
    /// Largest length of a piece, bytes; 0: pieces as they come.
    pub piece_max: usize,
    /// Largest delay of a piece.
    pub delay_max: Duration,
    /// The one fault of this direction, and the offset of the byte before which it occurs.
    pub fault: Option<(u64, PipeFault)>,
}

/// Fault that occurs once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PipeFault {
    /// Both directions are cut.
    Cut,
    /// This direction passes nothing for this time.
    Stall(Duration),
    /// A bit of the byte is inverted.
    Flip,
}

/// How a direction ended.
enum Ended {
    /// Its sender closed it.
    Finished,
    /// The link was cut.
    Cut,
}

impl WayFaults {
    /// Draws faults among the first `len` bytes; on average every second direction has one.
    pub fn drawn(random: &mut Random, len: usize) -> Self {
        let piece_max = [0, 1, 7, 97, 4096][random.below(5)];
        let delay_max = Duration::from_millis([0, 0, 1, 40][random.below(4)]);
        let at = random.below(len) as u64;
        let fault = match random.below(8) {
            0 | 1 => Some(PipeFault::Cut),
            // Shorter and longer than a server waits inside a message.
            2 => Some(PipeFault::Stall(Duration::from_secs([2, 29, 31, 3600][random.below(4)]))),
            3 => Some(PipeFault::Flip),
            _ => None,
        };
        Self { piece_max, delay_max, fault: fault.map(|fault| (at, fault)) }
    }
}

/// Passes bytes between `server` and the returned end, until both directions have ended or the link is
/// cut.
pub fn faulty_pipe(
    server: DuplexStream,
    to_server: WayFaults,
    to_client: WayFaults,
    mut random: Random,
) -> (DuplexStream, impl Future<Output = ()> + Send) {
    let (client, near) = duplex(64 * 1024);
    let (one, other) = (Random::new(random.number()), Random::new(random.number()));
    let passes = async move {
        let (from_client, into_client) = split(near);
        let (from_server, into_server) = split(server);
        let mut there = Box::pin(pass(from_client, into_server, to_server, one));
        let mut back = Box::pin(pass(from_server, into_client, to_client, other));
        tokio::select! {
            ended = &mut there => if let Ended::Finished = ended { back.await; },
            ended = &mut back => if let Ended::Finished = ended { there.await; },
        }
    };
    (client, passes)
}

async fn pass(
    mut from: impl AsyncRead + Unpin,
    mut to: impl AsyncWrite + Unpin,
    faults: WayFaults,
    mut random: Random,
) -> Ended {
    let mut passed = 0;
    let mut fault = faults.fault;
    let mut buffer = vec![0; 16 * 1024];
    loop {
        let Ok(count @ 1..) = from.read(&mut buffer).await else {
            let _ = to.shutdown().await;
            return Ended::Finished;
        };
        let mut rest = &mut buffer[..count];
        while !rest.is_empty() {
            let wanted = match faults.piece_max {
                0 => rest.len(),
                max => 1 + random.below(max),
            };
            // A piece ends where the fault is.
            let until = fault.map_or(u64::MAX, |(at, _)| at.saturating_sub(passed).max(1));
            let len = wanted.min(rest.len()).min(usize::try_from(until).unwrap_or(usize::MAX));
            let (piece, later) = rest.split_at_mut(len);
            if let Some((_, happens)) = fault.filter(|(at, _)| *at <= passed) {
                fault = None;
                match happens {
                    PipeFault::Cut => return Ended::Cut,
                    PipeFault::Stall(pause) => sleep(pause).await,
                    PipeFault::Flip => piece[0] ^= 1 << random.below(8),
                }
            }
            if !faults.delay_max.is_zero() && random.below(4) == 0 {
                sleep(faults.delay_max.mul_f64(random.below(1000) as f64 * 1e-3)).await;
            }
            if to.write_all(piece).await.is_err() {
                return Ended::Finished;
            }
            passed += len as u64;
            rest = later;
        }
    }
}
