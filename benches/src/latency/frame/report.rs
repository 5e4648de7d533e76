//! Writes the page: frames of the default contact, of single nodes, then of every method.

use glove_client::ask::connection::{Host, ServerChoice};
use softgrasp_core::mesh::BuiltIn;
use softgrasp_core::solve::Method;
use softgrasp_protocol::StageMs;

use super::asker::{Asked, Trip};
use super::round_trips::RoundTrips;
use crate::echo::Ends;
use crate::reference::Reference;
use crate::report::{Options, Report, ReportError, progress};
use crate::sample::Spread;
use crate::scene::Pressed;
use crate::table::{Cell, Table, three_digits};
use crate::tail::Tail;
use crate::threads::processors;

/// Size in bytes above which a method's matrix is too large for frame questions.
const DENSE_BYTES_MAX: u64 = 512 << 20;
/// Largest time of a warm frame of the largest object, as a multiple of an echo, and in ms.
const ECHOES_MAX: f64 = 3.0;
const P99_MAX_MS: f64 = 1.0;
/// Number of nodes of the object that the limit is for.
const NODES_OF_BAR: usize = 10_648;

/// All ways of waiting that are measured, by their names in the tables.
const HABITS: [(&str, Ends); 3] = [
    ("asleep", Ends::ASLEEP),
    ("client awake", Ends::CLIENT_AWAKE),
    ("client awake, echo wholly", Ends::AWAKE),
];

/// Measures frames of the cube with five contacts: surface nodes back, double precision.
///
/// # Errors
/// [`ReportError`], also for an answer that differs from the exact one.
pub fn measure(options: &Options, report: &mut Report) -> Result<(), ReportError> {
    let is_quick = options.is_quick;
    let sizes: &[usize] = if is_quick { &[64, 125] } else { &[216, 267, 343, 1000, 10_648] };
    let threads = processors();
    let host = Host::open(&ServerChoice::Embedded, Some(threads))?;
    let mut frames = Table::new("latency-frame", "Warm frames by condensed", &FRAME_COLUMNS);
    let mut stages = Table::new("latency-frame-stages", "Medians by stage", &STAGE_COLUMNS);
    let mut verdicts = Vec::new();
    for asked in contacts(&host, if is_quick { &[125] } else { &[1000, NODES_OF_BAR] })? {
        for (habit, ends) in HABITS {
            progress("frame", &format!("{}, {} nodes, {habit}", asked.contact, asked.nodes));
            let trips = RoundTrips::measure(&host, &asked, ends, is_quick)?;
            verdicts.push(verdict(&trips, habit));
            frames.push(frame_row(&trips, habit));
            if ends == Ends::CLIENT_AWAKE {
                stages.push(stage_row(&trips));
            }
        }
    }
    let mut methods =
        Table::new("latency-frame-methods", "Warm frames by every method", &METHOD_COLUMNS);
    for &nodes in sizes {
        for asked in by_every_method(nodes)? {
            progress("frame", &format!("{}, {} nodes", asked.method, asked.nodes));
            let trips = RoundTrips::measure(&host, &asked, Ends::CLIENT_AWAKE, is_quick)?;
            methods.push(method_row(&trips));
            stages.push(stage_row(&trips));
        }
    }
    report.text(INTRODUCTION);
    report.text(verdicts.concat());
    report.table(frames);
    report.text(METHODS);
    report.table(methods);
    report.table(stages);
    Ok(())
}

/// Questions to `condensed`: by masks, which is the default of `run`, then by single nodes.
fn contacts(host: &Host, sizes: &[usize]) -> Result<Vec<Asked>, ReportError> {
    let mut all = Vec::new();
    for &nodes in sizes {
        all.push(Asked::by_masks(host, nodes)?);
    }
    for &nodes in sizes {
        let (scene, reference) = pressed(nodes)?;
        all.push(Asked::by_vertices(&scene, &reference, "condensed"));
    }
    Ok(all)
}

/// Questions to every method that fits in memory, by single nodes, which all of them can answer.
fn by_every_method(nodes: usize) -> Result<Vec<Asked>, ReportError> {
    let (scene, reference) = pressed(nodes)?;
    let bytes = |m: &Method| m.dense_bytes(scene.unknown_dofs()).unwrap_or(0);
    let direct =
        Method::DIRECT.into_iter().filter(|m| bytes(m) <= DENSE_BYTES_MAX).map(Method::name);
    let all = direct.chain(["condensed"]);
    Ok(all.map(|method| Asked::by_vertices(&scene, &reference, method)).collect())
}

fn pressed(nodes: usize) -> Result<(Pressed, Reference), ReportError> {
    let scene = Pressed::try_new(BuiltIn::Cube, nodes)?;
    let (model, known) = scene.model()?;
    let reference = Reference::of(&model, &known)?;
    Ok((scene, reference))
}

fn times(trips: &[Trip]) -> Vec<f64> {
    trips.iter().map(|trip| trip.ms).collect()
}

/// Ratio of frames to echoes that took turns; `None` if they did not.
fn in_turn_ratio(trips: &RoundTrips) -> Option<f64> {
    let ratio = Spread::of_ratio(&times(&trips.frames), &trips.echoes);
    (ratio.count > 0).then_some(ratio.median)
}

/// Medians of frames alone and of echoes alone, and their quotient.
fn alone(trips: &RoundTrips) -> [f64; 3] {
    let frames = Spread::of(times(&trips.frames_alone)).median;
    let echoes = Spread::of(trips.echoes_alone.iter().copied()).median;
    [frames, echoes, frames / echoes]
}

/// Line that compares with the limit; empty for other objects.
fn verdict(trips: &RoundTrips, habit: &str) -> String {
    if trips.asked.nodes != NODES_OF_BAR {
        return String::new();
    }
    let [_, _, alone] = alone(trips);
    let of_habit = if trips.frames.is_empty() { &trips.frames_alone } else { &trips.frames };
    let p99 = Tail::of(times(of_habit)).p99;
    let kept = |is_kept: bool| if is_kept { "reached" } else { "**not reached**" };
    let in_turn = in_turn_ratio(trips).map_or(String::new(), |ratio| {
        format!("{} × in turn ({}), ", three_digits(ratio), kept(ratio <= ECHOES_MAX))
    });
    format!(
        "- `{}`, {habit}: {in_turn}{} × each alone ({}); 99 % of the frames within {} ms ({}).\n",
        trips.asked.contact,
        three_digits(alone),
        kept(alone <= ECHOES_MAX),
        p99.map_or("–".to_owned(), three_digits),
        kept(p99.is_some_and(|ms| ms <= P99_MAX_MS)),
    )
}

fn frame_row(trips: &RoundTrips, habit: &str) -> [Cell; 20] {
    let (frames, echoes) = (Tail::of(times(&trips.frames)), Tail::of(trips.echoes.iter().copied()));
    let [alone, echo_alone, alone_over_echo] = alone(trips);
    [
        trips.asked.contact.to_string().into(),
        trips.asked.nodes.into(),
        trips.asked.surface_nodes.into(),
        trips.held_nodes.into(),
        habit.into(),
        trips.request_bytes.into(),
        trips.reply_bytes.into(),
        frames.p50.into(),
        frames.p99.into(),
        frames.p999.into(),
        echoes.p50.into(),
        echoes.p99.into(),
        in_turn_ratio(trips).into(),
        alone.into(),
        Tail::of(times(&trips.frames_alone)).p99.into(),
        echo_alone.into(),
        alone_over_echo.into(),
        Spread::of(trips.every_frame().map(|t| t.residual_rel)).max.into(),
        Spread::of(trips.every_frame().map(|t| t.error_rel)).max.into(),
        trips.every_frame().count().into(),
    ]
}

fn method_row(trips: &RoundTrips) -> [Cell; 13] {
    let frames = Tail::of(times(&trips.frames));
    let [_, echo_alone, alone_over_echo] = alone(trips);
    [
        trips.asked.method.into(),
        trips.asked.nodes.into(),
        trips.asked.surface_nodes.into(),
        frames.p50.into(),
        frames.p99.into(),
        frames.p999.into(),
        Tail::of(trips.echoes.iter().copied()).p50.into(),
        in_turn_ratio(trips).into(),
        echo_alone.into(),
        alone_over_echo.into(),
        Spread::of(trips.every_frame().map(|t| t.residual_rel)).max.into(),
        Spread::of(trips.every_frame().map(|t| t.error_rel)).max.into(),
        trips.every_frame().count().into(),
    ]
}

fn stage_row(trips: &RoundTrips) -> [Cell; 11] {
    let of = |f: fn(&StageMs) -> f64| Spread::of(trips.frames.iter().map(|t| f(&t.stages))).median;
    let named =
        |s: &StageMs| s.decode + s.queue + s.assemble + s.order + s.factor + s.solve + s.encode;
    let rest = trips.frames.iter().map(|t| t.ms - named(&t.stages));
    [
        trips.asked.method.into(),
        trips.asked.contact.to_string().into(),
        trips.asked.nodes.into(),
        trips.first_ms.into(),
        of(|s| s.decode).into(),
        of(|s| s.queue).into(),
        of(|s| s.order + s.factor).into(),
        of(|s| s.solve).into(),
        of(|s| s.encode).into(),
        Spread::of(rest).median.into(),
        Spread::of(trips.every_frame().map(|t| t.error_rel)).max.into(),
    ]
}

const FRAME_COLUMNS: [&str; 20] = [
    "contact",
    "nodes",
    "surface_nodes",
    "held_nodes",
    "waiting",
    "request_bytes",
    "reply_bytes",
    "p50_ms",
    "p99_ms",
    "p99.9_ms",
    "echo_p50_ms",
    "echo_p99_ms",
    "frame_over_echo",
    "alone_p50_ms",
    "alone_p99_ms",
    "echo_alone_p50_ms",
    "alone_over_echo_alone",
    "residual_rel",
    "error_rel",
    "frames",
];

const METHOD_COLUMNS: [&str; 13] = [
    "method",
    "nodes",
    "surface_nodes",
    "p50_ms",
    "p99_ms",
    "p99.9_ms",
    "echo_p50_ms",
    "frame_over_echo",
    "echo_alone_p50_ms",
    "alone_over_echo_alone",
    "residual_rel",
    "error_rel",
    "frames",
];

const STAGE_COLUMNS: [&str; 11] = [
    "method",
    "contact",
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
An embedded server, over a loopback socket with TCP_NODELAY, keeps the cube and answers frames: five \
contacts with three known displacements each, another load each frame, displacements of all surface \
nodes in double precision. `mask` is the default contact of `run`; `vertex` displaces single nodes. \
The echo reads as many bytes as the request has and writes the bytes of the reply.

A frame is compared with an echo whose ends wait as the frame's do. `asleep`: the client and the \
server are woken by the system when bytes have come. `client awake`: the client looks again and again \
for the reply, as `run` does, and the server sleeps; so does the echo. In these two, the sleeping \
thread of the server and that of the echo both ask for real-time scheduling. `client awake, echo \
wholly`: both ends of the echo stay awake, which is the shortest way there is and keeps two processors \
busy; `fea-server` does not work like this, so this ratio is the least favourable one.

Frames and echoes take turns; `frame_over_echo` is the median of the quotients of neighbours. \
`alone` is without the other between, and `alone_over_echo_alone` the quotient of the two medians. \
An echo wholly awake is measured alone only: it would take a processor from the frames. Where the \
system runs both ends on one processor a sleeping echo takes half as long as on two, so both ratios \
belong to the answer.

Every answer is compared: for `vertex` with a direct solve refined in twice the working precision; \
for `mask` with an answer of the whole object that is checked first (with the held nodes displaced \
as answered, a direct solve must give all displacements, forces that are the masks' own, and the \
displacements asked for). `error_rel` is the worst of all frames and of that check, and above 1e-9 \
the report ends. A quantile that the number of frames cannot show is left blank.

The bar of 10 648 nodes: at most 3 × the echo, 99 % of the frames within 1 ms.";

const METHODS: &str = "\
Every method answers the same question about five single nodes, `client awake`. The first frame \
factors (or computes the columns of the grip), all others reuse that. `gather` collects the rows \
asked for; `rest` is what the server does not time: both codecs, the threads' hand-over and the way. \
`dense` methods are left out where their matrix exceeds 512 MiB.";
