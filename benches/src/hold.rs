//! Report `hold`: a request every millisecond for a minute, and how many answers come late.

use std::time::{Duration, Instant};

use glove_client::connection::{Host, ServerChoice, ServerConnection, unexpected};
use glove_client::pace::{be_urgent, wait_until};
use softgrasp_core::mesh::BuiltIn;
use softgrasp_protocol::{Answer, FrameRequest, ModelHash, NodeChoice, Reply, Request, StageMs};

use crate::plot::{Mark, Plot, Scale, Series};
use crate::reference::{Reference, error_rel};
use crate::report::{Options, Report, ReportError, check, progress};
use crate::sample::Spread;
use crate::scene::Pressed;
use crate::table::{Cell, Table, three_digits};
use crate::tail::{Tail, longer_than};
use crate::threads::processors;

/// A haptic device asks a thousand times a second.
const PERIOD: Duration = Duration::from_millis(1);
/// Largest error, relative to a direct solve, with which a time is reported.
const ERROR_ALLOWED: f64 = 1e-9;
/// Late answers that are few enough, per cent.
const LATE_BAR_PERCENT: f64 = 0.1;
/// A proof that takes longer than this is not waited for.
const PROOF_MAX: Duration = Duration::from_secs(120);

/// One answered tick; times in ms.
#[derive(Clone, Copy, Debug, Default)]
struct Tick {
    /// From the moment of the tick to the answer.
    from_tick: f64,
    /// From sending to the answer.
    round_trip: f64,
    stages: StageMs,
    error_rel: f64,
    residual_rel: f64,
    error_bound_rel: Option<f64>,
}

/// All ticks of one run.
struct Held {
    ticks: Vec<Tick>,
    /// Ticks that passed while an earlier answer was awaited.
    missed: usize,
    lasted: Duration,
}

/// Asks for a frame every millisecond.
///
/// # Errors
/// [`ReportError`]; an answer that differs from the direct solve is one.
pub fn measure(options: &Options) -> Result<Report, ReportError> {
    let (nodes, count) = if options.is_quick { (125, 500) } else { (10_648, 60_000) };
    let threads = processors();
    let title = "Hold: a request every millisecond";
    let mut report = Report::begin("hold", title, &threads.to_string(), options);
    let scene = Pressed::try_new(BuiltIn::Cube, nodes)?;
    let host = Host::open(&ServerChoice::Embedded, Some(threads))?;
    let mut holder = Holder::try_new(&host, &scene)?;
    progress("hold", "waiting for the proof of the error bound");
    holder.wait_for_proof()?;
    progress("hold", &format!("{count} ticks of 1 ms"));
    let is_urgent = be_urgent();
    let held = holder.hold(count)?;
    report.text(INTRODUCTION);
    report.text(urgency(is_urgent));
    report.text(verdict(&held, scene.mesh.node_count()));
    report.table(times(&held, &scene));
    report.figure(
        "hold",
        "Share of ticks whose answer takes longer, from the tick.",
        curve(&held)?,
    );
    report.table(stages(&held));
    Ok(report)
}

/// A client that keeps a schedule.
struct Holder<'a> {
    scene: &'a Pressed,
    /// Right displacements of the surface nodes for the load of the scene, m.
    right: Vec<f64>,
    model: ModelHash,
    connection: ServerConnection,
}

impl<'a> Holder<'a> {
    fn try_new(host: &Host, scene: &'a Pressed) -> Result<Self, ReportError> {
        let (model, known) = scene.model()?;
        let displacement = Reference::of(&model, &known)?.displacement;
        let of_node = |&n: &u32| displacement[3 * n as usize..3 * n as usize + 3].to_vec();
        let right = scene.surface.nodes.iter().flat_map(of_node).collect();
        let mut connection = host.connect(None)?;
        let model = match connection.ask(&Request::UploadModel(scene.upload()))? {
            Reply::ModelReady(ready) => ready.model,
            other => return Err(unexpected("UploadModel", &other).into()),
        };
        Ok(Self { scene, right, model, connection })
    }

    /// The proof is made beside the frames after an upload; a session lasts longer than it.
    fn wait_for_proof(&mut self) -> Result<(), ReportError> {
        let start = Instant::now();
        while start.elapsed() < PROOF_MAX {
            if self.ask(&self.request(1.0))?.report.error_bound_rel.is_some() {
                return Ok(());
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        Ok(())
    }

    /// One request at each tick of an absolute schedule; a tick that passes while an earlier answer
    /// is awaited is not asked for any more.
    fn hold(&mut self, count: usize) -> Result<Held, ReportError> {
        // Growing would take as long as some ticks.
        let mut held = Held { ticks: Vec::with_capacity(count), missed: 0, lasted: Duration::ZERO };
        let start = Instant::now() + 5 * PERIOD;
        for (number, tick) in (0..count as u32).map(|n| (n, start + n * PERIOD)) {
            if Instant::now() >= tick + PERIOD {
                held.missed += 1;
                continue;
            }
            // Another load each time; the displacements are proportional to it.
            let scale = 1.0 + 0.25 * (1e-2 * f64::from(number)).sin();
            let request = self.request(scale);
            wait_until(tick);
            let sent = Instant::now();
            let answer = self.ask(&request)?;
            let (from_tick, round_trip) = (ms(tick.elapsed()), ms(sent.elapsed()));
            let report = &answer.report;
            let (stages, residual_rel) = (report.stage_ms, report.residual_rel);
            let error_bound_rel = report.error_bound_rel;
            let error_rel = self.error_of(answer, scale)?;
            held.ticks.push(Tick {
                from_tick,
                round_trip,
                stages,
                error_rel,
                residual_rel,
                error_bound_rel,
            });
        }
        held.lasted = start.elapsed();
        Ok(held)
    }

    fn request(&self, scale: f64) -> Request {
        let nodes = NodeChoice::Nodes(self.scene.surface.nodes.clone());
        let question = self.scene.question("condensed", scale, nodes);
        Request::Frame(FrameRequest { model: self.model, question })
    }

    fn ask(&mut self, request: &Request) -> Result<Answer, ReportError> {
        match self.connection.ask_awake(request)? {
            Reply::Answer(answer) => Ok(*answer),
            other => Err(unexpected("Frame", &other).into()),
        }
    }

    fn error_of(&self, answer: Answer, scale: f64) -> Result<f64, ReportError> {
        let got = answer.displacements.into_f64();
        let error = match 3 * got.len() == self.right.len() {
            true => {
                let right = self.right.iter().map(|u| scale * u);
                error_rel(got.iter().flatten().copied().zip(right))
            }
            false => f64::INFINITY,
        };
        check(|| "a held frame".to_owned(), error, ERROR_ALLOWED)?;
        Ok(error)
    }
}

impl Held {
    fn count(&self) -> usize {
        self.ticks.len() + self.missed
    }

    /// Ticks whose answer was not there before the next one.
    fn late_percent(&self) -> f64 {
        let period = ms(PERIOD);
        let late = self.ticks.iter().filter(|t| t.from_tick >= period).count();
        100.0 * (late + self.missed) as f64 / self.count().max(1) as f64
    }

    fn of(&self, value: fn(&Tick) -> f64) -> impl Iterator<Item = f64> + '_ {
        self.ticks.iter().map(value)
    }
}

fn ms(duration: Duration) -> f64 {
    duration.as_secs_f64() * 1e3
}

fn verdict(held: &Held, nodes: usize) -> String {
    let late = held.late_percent();
    let word = match (nodes >= 10_000, late < LATE_BAR_PERCENT) {
        (false, _) => "",
        (true, true) => ": reached",
        (true, false) => ": **not reached**",
    };
    format!(
        "{} of {} ticks are late ({} %), {} of them not asked for any more. Bar: below \
         {LATE_BAR_PERCENT} % for a minute on 10 648 nodes{word}.",
        (held.count() as f64 * late / 100.0).round(),
        held.count(),
        three_digits(late),
        held.missed,
    )
}

fn urgency(is_urgent: bool) -> String {
    let (word, then) = match is_urgent {
        true => ("grants", "no other work on the machine goes before them"),
        false => ("does not grant", "they wait their turn like all others"),
    };
    format!(
        "The thread that keeps the ticks, and the server's that reads, solves and answers, ask for \
         real-time scheduling; this system {word} it, so {then}."
    )
}

fn times(held: &Held, scene: &Pressed) -> Table {
    let title = "Ticks of 1 ms over loopback, condensed, five contacts";
    let mut table = Table::new("hold", title, &COLUMNS);
    let (from_tick, trip) =
        (Tail::of(held.of(|t| t.from_tick)), Tail::of(held.of(|t| t.round_trip)));
    let waking = Tail::of(held.of(|t| t.from_tick - t.round_trip));
    let bounds: Vec<f64> = held.ticks.iter().filter_map(|t| t.error_bound_rel).collect();
    let worst = |of: fn(&Tick) -> f64| Spread::of(held.of(of)).max;
    let row: [Cell; 21] = [
        scene.mesh.node_count().into(),
        scene.surface.nodes.len().into(),
        held.lasted.as_secs_f64().into(),
        held.count().into(),
        held.missed.into(),
        held.late_percent().into(),
        from_tick.p50.into(),
        from_tick.p99.into(),
        from_tick.p999.into(),
        from_tick.p9999.into(),
        from_tick.max.into(),
        trip.p50.into(),
        trip.p99.into(),
        trip.p999.into(),
        trip.max.into(),
        waking.p50.into(),
        waking.p999.into(),
        (100.0 * bounds.len() as f64 / held.ticks.len().max(1) as f64).into(),
        Spread::of(bounds).max.into(),
        worst(|t| t.residual_rel).into(),
        worst(|t| t.error_rel).into(),
    ];
    table.push(row);
    table
}

/// Name of a share of a tick's time, and the share, ms.
type Part = (&'static str, fn(&Tick) -> f64);

fn stages(held: &Held) -> Table {
    let title = "Where the time of a tick goes";
    let mut table = Table::new("hold-stages", title, &STAGE_COLUMNS);
    let worst = Spread::of(held.of(|t| t.error_rel)).max;
    let parts: [Part; 7] = [
        ("late in sending", |t| t.from_tick - t.round_trip),
        ("decode", |t| t.stages.decode),
        ("queue", |t| t.stages.queue),
        ("factor", |t| t.stages.order + t.stages.factor),
        ("solve", |t| t.stages.solve),
        ("gather", |t| t.stages.encode),
        ("codecs, threads, way", |t| {
            let s = &t.stages;
            t.round_trip - s.decode - s.queue - s.order - s.factor - s.solve - s.encode
        }),
    ];
    for (name, part) in parts {
        let tail = Tail::of(held.of(part));
        let row: [Cell; 6] = [
            name.into(),
            tail.p50.into(),
            tail.p99.into(),
            tail.p999.into(),
            tail.max.into(),
            worst.into(),
        ];
        table.push(row);
    }
    table
}

fn curve(held: &Held) -> Result<String, ReportError> {
    let series = |label: &str, times: Vec<f64>| Series {
        label: label.to_owned(),
        mark: Mark::Line,
        points: longer_than(times),
    };
    let plot = Plot {
        title: "A request every millisecond".to_owned(),
        x_label: "ms".to_owned(),
        y_label: "share of ticks that take longer".to_owned(),
        x_scale: Scale::Log,
        y_scale: Scale::Log,
        series: vec![
            series("from the tick", held.of(|t| t.from_tick).collect()),
            series("from sending", held.of(|t| t.round_trip).collect()),
        ],
    };
    Ok(plot.svg()?)
}

const COLUMNS: [&str; 21] = [
    "nodes",
    "surface_nodes",
    "lasted_s",
    "ticks",
    "missed",
    "late_percent",
    "p50_ms",
    "p99_ms",
    "p99.9_ms",
    "p99.99_ms",
    "max_ms",
    "trip_p50_ms",
    "trip_p99_ms",
    "trip_p99.9_ms",
    "trip_max_ms",
    "sending_late_p50_ms",
    "sending_late_p99.9_ms",
    "with_bound_percent",
    "error_bound_rel",
    "residual_rel",
    "error_rel",
];

const STAGE_COLUMNS: [&str; 6] = ["part", "p50_ms", "p99_ms", "p99.9_ms", "max_ms", "error_rel"];

const INTRODUCTION: &str = "\
An embedded server, over a loopback socket with TCP_NODELAY, keeps the cube. The client sends a \
request at each tick of an absolute schedule, one a millisecond: fifteen known degrees of freedom, \
another load each time, displacements of all surface nodes in double precision. As `run` does, it \
sleeps until shortly before the tick, stays awake for the rest, and stays awake for the answer for as \
long as an answer usually takes. A tick is late if its answer is not there before the next tick; \
a tick that passes while an earlier answer is awaited is late too and is not asked for any more, as \
the newest order wins in the client. Times are counted from the tick, not from sending, so waiting \
behind a slow answer counts.

Every answer carries its residual and, once the proof is made (it is waited for), its proven error \
bound; rotation and strain are worked out beside the frames, on the same threads. Every answer is \
compared with a direct solve refined in twice the working precision, between the answer and the next \
tick; above 1e-9 the report ends.";
