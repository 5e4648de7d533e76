//! Asks for records and hands them over, until the device falls silent or the port is lost.

use std::time::{Duration, Instant};

use super::driver::{DriverContext, Ended, Told};
use super::port::{Lost, Port};
use super::record_assembler::{Cut, RecordAssembler};

/// A device that has to be asked for each record.
#[derive(Clone, Copy, Debug)]
pub(super) struct Poll {
    /// Bytes that ask for one record.
    pub(super) request: &'static [u8],
    /// Time between two requests.
    pub(super) period: Duration,
}

/// Why listening ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Heard {
    /// The thread is to end.
    Stopped,
    /// Nothing has arrived for [`SET_UP_AGAIN`]: the device may have forgotten its settings.
    Nothing,
}

/// Time without a reply after which a request is repeated.
const REPLY_MAX: Duration = Duration::from_millis(250);
/// Time without bytes after which the device is silent.
const SILENT: Duration = Duration::from_millis(500);
/// Time without bytes after which the device is set up again.
const SET_UP_AGAIN: Duration = Duration::from_millis(900);
/// Number of times that a device is set up without a record before its port is opened again.
const OPEN_AGAIN: u32 = 3;

/// Sets a device up and listens, again and again.
///
/// `set_up` is told whether the port was just opened.
pub(super) fn serve(
    context: &DriverContext,
    port: &mut Port,
    cut: Cut,
    poll: Option<Poll>,
    mut set_up: impl FnMut(&mut Port, bool) -> Result<(), Lost>,
) -> Result<Ended, Lost> {
    let mut in_vain = 0;
    let mut just_opened = true;
    loop {
        set_up(port, just_opened)?;
        just_opened = false;
        let mut records = 0;
        let heard = listen(context, port, cut, poll, &mut records)?;
        in_vain = if records > 0 { 0 } else { in_vain + 1 };
        match heard {
            Heard::Stopped => return Ok(Ended::Stopped),
            Heard::Nothing if in_vain >= OPEN_AGAIN => return Ok(Ended::Silent),
            Heard::Nothing => {}
        }
    }
}

/// Hands over what arrives, and counts what looks like a record.
fn listen(
    context: &DriverContext,
    port: &mut Port,
    cut: Cut,
    poll: Option<Poll>,
    records: &mut u64,
) -> Result<Heard, Lost> {
    let mut assembler = RecordAssembler::new(cut);
    let mut bytes = [0; 1024];
    let mut last_heard = Instant::now();
    let mut next_request = Instant::now();
    let mut asked: Option<Instant> = None;
    loop {
        if context.stopped() {
            return Ok(Heard::Stopped);
        }
        let now = Instant::now();
        let mut wait = SILENT;
        if let Some(poll) = poll {
            asked = asked.filter(|asked| now - *asked < REPLY_MAX);
            if asked.is_none() && now >= next_request {
                port.write(poll.request)?;
                asked = Some(now);
                // Late requests are not made up for.
                next_request = (next_request + poll.period).max(now);
            }
            wait = match asked {
                Some(_) => REPLY_MAX,
                None => next_request.saturating_duration_since(now),
            };
        }
        let read = port.read(&mut bytes, wait);
        let arrived = Instant::now();
        let count = match read {
            Ok(count) => count,
            Err(lost) => {
                assembler.rest().into_iter().for_each(|piece| context.hand_over(piece));
                return Err(lost);
            }
        };
        if count > 0 {
            last_heard = arrived;
            context.tell(Told::Talking);
        } else if now - last_heard >= SILENT {
            // Counted up to before the reading: bytes that came while this thread could not run
            // would have been found by it.
            context.tell_silent(last_heard);
            check_path(context)?;
        }
        assembler.push(&bytes[..count], arrived);
        while let Some(piece) = assembler.next() {
            if piece.whole {
                *records += 1;
                asked = None;
            }
            context.hand_over(piece);
        }
        if count == 0 && now - last_heard >= SET_UP_AGAIN {
            assembler.rest().into_iter().for_each(|piece| context.hand_over(piece));
            return Ok(Heard::Nothing);
        }
    }
}

/// A port may stay open after its device was unplugged; its name does not stay.
fn check_path(context: &DriverContext) -> Result<(), Lost> {
    let path = &context.port().path;
    match cfg!(unix) && !path.exists() {
        true => Err(Lost { why: format!("{} is gone", path.display()) }),
        false => Ok(()),
    }
}

/// Reads and forgets until nothing has come for `quiet`, or `longest` is over.
pub(super) fn wait_until_quiet(
    context: &DriverContext,
    port: &mut Port,
    quiet: Duration,
    longest: Duration,
) -> Result<Vec<u8>, Lost> {
    let begun = Instant::now();
    let mut last = begun;
    let mut heard = Vec::new();
    let mut bytes = [0; 1024];
    while !context.stopped() && last.elapsed() < quiet && begun.elapsed() < longest {
        let count = port.read(&mut bytes, quiet)?;
        if count > 0 {
            last = Instant::now();
            heard.extend_from_slice(&bytes[..count]);
            // Only the end of a long babble can matter.
            let over = heard.len().saturating_sub(4096);
            heard.drain(..over);
        }
    }
    Ok(heard)
}

/// Sends a question and reads until `answer` finds one in what was heard, or `longest` is over.
pub(super) fn ask<Answer>(
    context: &DriverContext,
    port: &mut Port,
    question: &[u8],
    longest: Duration,
    answer: impl Fn(&[u8]) -> Option<Answer>,
) -> Result<Option<Answer>, Lost> {
    port.write(question)?;
    let begun = Instant::now();
    let mut heard = Vec::new();
    let mut bytes = [0; 256];
    while !context.stopped() && heard.len() < 4096 {
        let left = longest.saturating_sub(begun.elapsed());
        let count = port.read(&mut bytes, left)?;
        heard.extend_from_slice(&bytes[..count]);
        match answer(&heard) {
            Some(answer) if count > 0 => return Ok(Some(answer)),
            // The time is over only when a reading begun after it finds nothing.
            _ if count == 0 && left.is_zero() => break,
            _ => {}
        }
    }
    Ok(None)
}
