//! Report `frame`: round trip of a frame over loopback TCP against an echo of the same bytes.

use std::time::Duration;

use glove_client::connection::{Host, LinkError, ServerChoice, ServerConnection, unexpected};
use softgrasp_core::mesh::BuiltIn;
use softgrasp_core::solve::Method;
use softgrasp_protocol::{
    Answer, FrameRequest, Limits, ModelHash, NodeChoice, Reply, Request, StageMs,
};

use crate::echo::Echo;
use crate::reference::{Reference, error_rel};
use crate::report::{Options, Report, ReportError, check, progress};
use crate::sample::{Competitor, Effort, Spread, quantile, take_turns, timed_ms};
use crate::scene::Pressed;
use crate::table::{Cell, Table};
use crate::threads::processors;

/// Largest error, relative to a direct solve, with which a time is reported.
const ERROR_ALLOWED: f64 = 1e-9;
/// Echoes one after another, without frames.
const LONE_ECHOES: usize = 500;
/// A method whose matrix is larger is left out: it could not be asked for a frame at all.
const DENSE_BYTES_MAX: u64 = 512 << 20;

/// One round trip.
#[derive(Clone, Copy, Debug, Default)]
struct Trip {
    ms: f64,
    stages: StageMs,
    residual_rel: f64,
    error_rel: f64,
}

/// All round trips of one method on one object, and how it began.
struct Case {
    method: &'static str,
    nodes: usize,
    surface_nodes: usize,
    request_bytes: usize,
    reply_bytes: usize,
    first_ms: f64,
    frames: Vec<Trip>,
    echoes: Vec<Trip>,
    /// Echoes without frames between them, ms.
    lone_echoes: Vec<f64>,
}

/// Measures frames of the cube with five contacts: surface nodes in, double precision.
///
/// # Errors
/// [`ReportError`]; an answer that differs from the direct solve is one.
pub fn measure(options: &Options) -> Result<Report, ReportError> {
    let sizes: &[usize] =
        if options.is_quick { &[64, 125] } else { &[216, 267, 343, 1000, 10_648] };
    let threads = processors();
    let title = "Frame: round trip against an echo of the same bytes";
    let mut report = Report::begin("frame", title, &threads.to_string(), options);
    let mut trips = Table::new("frame", "Round trips of warm frames", &TRIP_COLUMNS);
    let mut stages = Table::new("frame-stages", "Medians by stage", &STAGE_COLUMNS);
    let host = Host::open(&ServerChoice::Embedded, Some(threads))?;
    for &nodes in sizes {
        let scene = Pressed::try_new(BuiltIn::Cube, nodes)?;
        let (model, known) = scene.model()?;
        let reference = Reference::of(&model, &known)?;
        drop(model);
        let fits = |m: &Method| {
            m.dense_bytes(scene.unknown_dofs()).is_none_or(|bytes| bytes <= DENSE_BYTES_MAX)
        };
        let direct = Method::DIRECT.into_iter().filter(fits).map(Method::name);
        for method in direct.chain(["condensed"]) {
            progress("frame", &format!("{method}, {nodes} nodes"));
            let case = Asker::new(&host, &scene, &reference, method)?.case(options.is_quick)?;
            trips.push(trip_row(&case));
            stages.push(stage_row(&case));
        }
    }
    report.text(INTRODUCTION);
    report.table(trips);
    report.table(stages);
    Ok(report)
}

/// A client that asks one method for frames and compares every answer.
struct Asker<'a> {
    scene: &'a Pressed,
    reference: &'a Reference,
    method: &'static str,
    model: ModelHash,
    connection: ServerConnection,
    asked: u32,
}

impl<'a> Asker<'a> {
    /// Connects and makes sure that the server has the model.
    fn new(
        host: &Host,
        scene: &'a Pressed,
        reference: &'a Reference,
        method: &'static str,
    ) -> Result<Self, ReportError> {
        let mut connection = host.connect(None)?;
        let model = match connection.ask(&Request::UploadModel(scene.upload()))? {
            Reply::ModelReady(ready) => ready.model,
            other => return Err(unexpected("UploadModel", &other).into()),
        };
        Ok(Self { scene, reference, method, model, connection, asked: 0 })
    }

    /// First frame, then frames and echoes in turn.
    fn case(mut self, is_quick: bool) -> Result<Case, ReportError> {
        // The first frame factors; it is the one a user waits for after touching.
        let (first, answer) = self.frame()?;
        let request_bytes = self.encode_request()?.len();
        let reply_bytes = encode_reply(answer)?;
        let (method, nodes) = (self.method, self.scene.mesh.node_count());
        let surface_nodes = self.scene.surface.nodes.len();
        let mut echo = Echo::start(request_bytes, &reply_bytes).map_err(ReportError::Echo)?;
        let mut competitors: [Competitor<'_, Trip, ReportError>; 2] = [
            Box::new(|| Ok(self.frame()?.0)),
            Box::new(|| {
                let (ms, echoed) = timed_ms(|| echo.trip());
                echoed.map_err(ReportError::Echo)?;
                Ok(Trip { ms, ..Trip::default() })
            }),
        ];
        let mut results = take_turns(&effort(nodes, is_quick), &mut competitors)?.into_iter();
        let (frames, echoes) =
            (results.next().unwrap_or_default(), results.next().unwrap_or_default());
        drop(competitors);
        let mut lone_echo = || {
            let (ms, echoed) = timed_ms(|| echo.trip());
            echoed.map(|()| ms).map_err(ReportError::Echo)
        };
        let lone_echoes = (0..LONE_ECHOES).map(|_| lone_echo()).collect::<Result<_, _>>()?;
        Ok(Case {
            method,
            nodes,
            surface_nodes,
            request_bytes,
            reply_bytes: reply_bytes.len(),
            first_ms: first.ms,
            frames,
            echoes,
            lone_echoes,
        })
    }

    /// One frame with its own load; its answer is compared with the direct solve.
    fn frame(&mut self) -> Result<(Trip, Answer), ReportError> {
        self.asked += 1;
        // Another load each time; the displacements are proportional to it.
        let scale = 1.0 + 0.25 * f64::from(self.asked).sin();
        let request = self.request(scale);
        let (ms, reply) = timed_ms(|| self.connection.ask_awake(&request));
        let answer = match reply? {
            Reply::Answer(answer) => *answer,
            other => return Err(unexpected("Frame", &other).into()),
        };
        let right = self.scene.surface.nodes.iter().flat_map(|&node| {
            let first = 3 * node as usize;
            self.reference.displacement[first..first + 3].iter().map(move |u| scale * u)
        });
        let got = answer.displacements.clone().into_f64();
        let is_complete = got.len() == self.scene.surface.nodes.len();
        let error_rel = match is_complete {
            true => error_rel(got.iter().flatten().copied().zip(right)),
            false => f64::INFINITY,
        };
        check(|| format!("frame by {}", self.method), error_rel, ERROR_ALLOWED)?;
        let residual_rel = answer.report.residual_rel;
        Ok((Trip { ms, stages: answer.report.stage_ms, residual_rel, error_rel }, answer))
    }

    fn request(&self, scale: f64) -> Request {
        let nodes = NodeChoice::Nodes(self.scene.surface.nodes.clone());
        let question = self.scene.question(self.method, scale, nodes);
        Request::Frame(FrameRequest { model: self.model, question })
    }

    fn encode_request(&self) -> Result<Vec<u8>, ReportError> {
        let mut bytes = Vec::new();
        self.request(1.0)
            .encode_into(1, &Limits::default(), &mut bytes)
            .map_err(LinkError::from)?;
        Ok(bytes)
    }
}

fn encode_reply(answer: Answer) -> Result<Vec<u8>, ReportError> {
    let mut bytes = Vec::new();
    Reply::Answer(Box::new(answer))
        .encode_into(1, &Limits::default(), &mut bytes)
        .map_err(LinkError::from)?;
    Ok(bytes)
}

fn effort(nodes: usize, is_quick: bool) -> Effort {
    let (rounds_min, rounds_max, seconds) = match (is_quick, nodes > 5000) {
        (true, _) => (50, 200, 1),
        (false, false) => (1000, 3000, 6),
        (false, true) => (1000, 3000, 20),
    };
    let budget = Duration::from_secs(seconds);
    Effort { warm_up_rounds: 20, rounds_min, rounds_max, budget }
}

/// Times of trips, ascending.
fn sorted_ms(trips: &[Trip]) -> Vec<f64> {
    let mut sorted: Vec<f64> = trips.iter().map(|t| t.ms).collect();
    sorted.sort_by(f64::total_cmp);
    sorted
}

fn trip_row(case: &Case) -> [Cell; 16] {
    let (frames, echoes) = (sorted_ms(&case.frames), sorted_ms(&case.echoes));
    let times = |trips: &[Trip]| trips.iter().map(|t| t.ms).collect::<Vec<f64>>();
    let ratio = Spread::of_ratio(&times(&case.frames), &times(&case.echoes));
    [
        case.method.into(),
        case.nodes.into(),
        case.surface_nodes.into(),
        case.request_bytes.into(),
        case.reply_bytes.into(),
        quantile(&frames, 0.5).into(),
        quantile(&frames, 0.99).into(),
        quantile(&frames, 0.999).into(),
        quantile(&echoes, 0.5).into(),
        quantile(&echoes, 0.99).into(),
        quantile(&echoes, 0.999).into(),
        Spread::of(case.lone_echoes.iter().copied()).median.into(),
        ratio.median.into(),
        Spread::of(case.frames.iter().map(|t| t.residual_rel)).max.into(),
        Spread::of(case.frames.iter().map(|t| t.error_rel)).max.into(),
        case.frames.len().into(),
    ]
}

fn stage_row(case: &Case) -> [Cell; 10] {
    let of = |f: fn(&StageMs) -> f64| Spread::of(case.frames.iter().map(|t| f(&t.stages))).median;
    let named =
        |s: &StageMs| s.decode + s.queue + s.assemble + s.order + s.factor + s.solve + s.encode;
    let rest = case.frames.iter().map(|t| t.ms - named(&t.stages));
    [
        case.method.into(),
        case.nodes.into(),
        case.first_ms.into(),
        of(|s| s.decode).into(),
        of(|s| s.queue).into(),
        of(|s| s.order + s.factor).into(),
        of(|s| s.solve).into(),
        of(|s| s.encode).into(),
        Spread::of(rest).median.into(),
        Spread::of(case.frames.iter().map(|t| t.error_rel)).max.into(),
    ]
}

const TRIP_COLUMNS: [&str; 16] = [
    "method",
    "nodes",
    "surface_nodes",
    "request_bytes",
    "reply_bytes",
    "p50_ms",
    "p99_ms",
    "p99.9_ms",
    "echo_p50_ms",
    "echo_p99_ms",
    "echo_p99.9_ms",
    "echo_alone_p50_ms",
    "frame_over_echo",
    "residual_rel",
    "error_rel",
    "frames",
];

const STAGE_COLUMNS: [&str; 10] = [
    "method",
    "nodes",
    "first_frame_ms",
    "decode_ms",
    "queue_ms",
    "factor_ms",
    "solve_ms",
    "gather_ms",
    "rest_ms",
    "error_rel",
];

const INTRODUCTION: &str = "\
An embedded server, over a loopback socket with TCP_NODELAY, keeps the cube and answers frames: \
fifteen known degrees of freedom, another load each frame, displacements of all surface nodes in \
double precision. The echo is a plain thread with a blocking socket that reads as many bytes as the \
request has and writes the bytes of the reply. Frames and echoes alternate; `echo_alone` is without \
frames between. Where the system runs both ends of an echo on one processor it takes half as long as \
on two, and what ran before decides which: so look at both before believing a ratio.

The client stays awake for an answer, as `run` does, for as long as one usually takes; the thread of \
the server's sockets asks for real-time scheduling, which the system may grant or not.

Every answer is compared with a direct solve refined in twice the working precision; `error_rel` is \
the worst of all frames, and above 1e-9 the report ends. `frame_over_echo` is the median of the \
quotients of neighbours. A quantile that the number of frames cannot show is left blank. The first \
frame factors (or computes the columns of the grip), all others reuse that. `gather` collects the rows asked for; `rest` is what \
the server does not time: both codecs, the largest strain, the threads' hand-over and the way. \
`dense` methods are left out where their matrix exceeds 512 MiB.

The bar of 10 648 nodes (round trip at most 3 × the echo, p99 at most 1 ms) is for `condensed`, which \
keeps columns of the compliance; the others solve with the whole factor in every frame.";
