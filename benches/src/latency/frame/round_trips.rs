//! Frames and echoes of the same bytes, in turn and each alone, with the same way of waiting.

use std::time::Duration;

use glove_client::ask::connection::Host;

use super::asker::{Asked, Asker, Trip};
use crate::echo::{Echo, Ends, Waiting};
use crate::report::ReportError;
use crate::requests::{encode_reply, encode_request, held_nodes};
use crate::sample::{Competitor, Effort, take_turns, timed_ms};

/// All round trips of one question, the lengths of its messages, and the time of the first answer.
pub(super) struct RoundTrips {
    pub asked: Asked,
    pub held_nodes: usize,
    pub request_bytes: usize,
    pub reply_bytes: usize,
    pub first_ms: f64,
    /// Frames and echoes in turn; empty if an echo would take the server's processor.
    pub frames: Vec<Trip>,
    pub echoes: Vec<f64>,
    /// Frames without echoes between them, and echoes without frames, ms.
    pub frames_alone: Vec<Trip>,
    pub echoes_alone: Vec<f64>,
}

impl RoundTrips {
    /// Measures one question with one way of waiting, the same for the frame's client and the echo's.
    ///
    /// # Errors
    /// [`ReportError`], also for an answer that differs from the exact one.
    pub fn measure(
        host: &Host,
        asked: &Asked,
        ends: Ends,
        is_quick: bool,
    ) -> Result<Self, ReportError> {
        let mut asker = Asker::new(host, asked.clone())?;
        // The first frame factors; it is the one a user waits for after touching.
        let (first, answer) = asker.frame(ends.client)?;
        let request_bytes = encode_request(asker.model, asked.question.clone())?.len();
        let reply = encode_reply(answer)?;
        let effort = effort(asked, is_quick);
        let (mut frames, mut echoes) = (Vec::new(), Vec::new());
        if ends.server == Waiting::Asleep {
            let mut echo = Echo::start(request_bytes, &reply, ends).map_err(ReportError::Echo)?;
            (frames, echoes) = in_turn(&effort, &mut asker, &mut echo, ends.client)?;
        }
        let mut frame: [Competitor<'_, Trip, ReportError>; 1] =
            [Box::new(|| Ok(asker.frame(ends.client)?.0))];
        let frames_alone = take_turns(&effort, &mut frame)?.into_iter().flatten().collect();
        drop(frame);
        // Started only now: one that stays awake would keep a processor from the frames.
        let mut echo = Echo::start(request_bytes, &reply, ends).map_err(ReportError::Echo)?;
        let mut alone: [Competitor<'_, f64, ReportError>; 1] = [Box::new(|| trip_ms(&mut echo))];
        let echoes_alone = take_turns(&effort, &mut alone)?.into_iter().flatten().collect();
        Ok(Self {
            asked: asked.clone(),
            held_nodes: held_nodes(&asked.question),
            request_bytes,
            reply_bytes: reply.len(),
            first_ms: first.ms,
            frames,
            echoes,
            frames_alone,
            echoes_alone,
        })
    }

    /// All frames, in turn and alone.
    pub fn every_frame(&self) -> impl Iterator<Item = &Trip> {
        self.frames.iter().chain(&self.frames_alone)
    }
}

fn in_turn(
    effort: &Effort,
    asker: &mut Asker,
    echo: &mut Echo,
    client: Waiting,
) -> Result<(Vec<Trip>, Vec<f64>), ReportError> {
    let mut competitors: [Competitor<'_, Trip, ReportError>; 2] = [
        Box::new(|| Ok(asker.frame(client)?.0)),
        Box::new(|| Ok(Trip { ms: trip_ms(echo)?, ..Trip::default() })),
    ];
    let mut results = take_turns(effort, &mut competitors)?.into_iter();
    let (frames, echoes) = (results.next().unwrap_or_default(), results.next().unwrap_or_default());
    Ok((frames, echoes.iter().map(|trip| trip.ms).collect()))
}

fn trip_ms(echo: &mut Echo) -> Result<f64, ReportError> {
    let (ms, echoed) = timed_ms(|| echo.trip());
    echoed.map(|()| ms).map_err(ReportError::Echo)
}

fn effort(asked: &Asked, is_quick: bool) -> Effort {
    // A direct method takes tens of milliseconds a frame on the large object.
    let is_slow = asked.nodes > 5000 && asked.method != "condensed";
    let (rounds_min, rounds_max, seconds) = match (is_quick, is_slow) {
        (true, _) => (50, 100, 1),
        (false, false) => (1000, 3000, 4),
        (false, true) => (400, 1000, 15),
    };
    let budget = Duration::from_secs(seconds);
    Effort { warm_up_rounds: 20, rounds_min, rounds_max, budget }
}
