//! The report: one press on finer and finer meshes, then the frame time of a grip.

use std::time::Duration;

use glove_client::ask::connection::{Host, ServerChoice, ServerConnection};
use softgrasp_grasp::object::ContactModel;
use softgrasp_protocol::{Answer, Ask, ModelHash, Question, Request, SolveReport};

use super::tips::{DEPTH, RADIUS, Tips, WANT_ALL};
use super::verify::verify;
use super::{half_space, steps};
use crate::axis::Scale;
use crate::echo::{Echo, Ends};
use crate::plot::{Mark, Plot, PlotPoint, Series};
use crate::reference::error_rel;
use crate::report::{Options, Report, ReportError, check, progress};
use crate::requests::{answer, encode_reply, encode_request, held_nodes, upload};
use crate::sample::{Competitor, Effort, Spread, quantile, take_turns, timed_ms};
use crate::table::{Cell, Table};
use crate::threads::processors;

/// Largest error, relative to a direct solve, with which a figure is reported.
const ERROR_ALLOWED: f64 = 1e-9;
const CONTACTS: [ContactModel; 3] = [ContactModel::Vertex, ContactModel::Patch, ContactModel::Mask];
/// Largest time of a warm frame, as a multiple of an echo of the same bytes.
const ECHOES_MAX: f64 = 3.0;

/// Press by one contact model on one mesh.
struct Pressing {
    contact: ContactModel,
    nodes: usize,
    held_nodes: usize,
    report: SolveReport,
    force: f64,
    error_rel: f64,
}

/// Measures the report.
///
/// # Errors
/// [`ReportError`]; an answer that differs from the direct solve is one.
pub fn measure(options: &Options) -> Result<Report, ReportError> {
    // Third powers of odd numbers have a node in the middle of the top.
    let sizes: &[usize] = match options.is_quick {
        true => &[125, 343],
        false => &[125, 343, 729, 1331, 2197, 3375, 6859, 12_167, 19_683],
    };
    let grips: &[usize] = if options.is_quick { &[125] } else { &[1000, 10_648] };
    let threads = processors();
    let title = "Contact: force of one press on finer meshes, and what a frame costs";
    let mut report = Report::begin("contact", title, &threads.to_string(), options);
    let host = Host::open(&ServerChoice::Embedded, Some(threads))?;
    let mut pressings = Vec::new();
    for &nodes in sizes {
        let tips = Tips::press(nodes)?;
        let mut asker = Asker::new(&host, &tips)?;
        for contact in CONTACTS {
            progress("contact", &format!("press by {contact}, {nodes} nodes"));
            pressings.push(asker.press(contact)?);
        }
    }
    let mut frames = Table::new("contact-frames", "Round trips of warm frames", &FRAME_COLUMNS);
    for &nodes in grips {
        let tips = Tips::grip(nodes)?;
        for contact in CONTACTS {
            progress("contact", &format!("frames by {contact}, {nodes} nodes"));
            frames.push(Asker::new(&host, &tips)?.frames(contact, options.is_quick)?);
        }
    }
    report.text(introduction());
    report.table(press_table(&pressings));
    report.figure("contact", FIGURE, figure(&pressings)?);
    report.table(frames);
    report.text(steps::TEXT.to_owned());
    report.table(steps::table(options.is_quick)?);
    Ok(report)
}

/// Client that asks about one object.
struct Asker<'a> {
    tips: &'a Tips,
    model: ModelHash,
    connection: ServerConnection,
}

impl<'a> Asker<'a> {
    fn new(host: &Host, tips: &'a Tips) -> Result<Self, ReportError> {
        let mut connection = host.connect()?;
        let model = upload(&mut connection, tips.upload())?;
        Ok(Self { tips, model, connection })
    }

    fn ask(&mut self, question: Question) -> Result<(f64, Answer), ReportError> {
        let request = Request::from(Ask::new(self.model, question));
        let (ms, reply) = timed_ms(|| self.connection.ask_awake(&request));
        Ok((ms, answer(reply)?))
    }

    /// Force of the press by one contact model, after its answer was checked.
    fn press(&mut self, contact: ContactModel) -> Result<Pressing, ReportError> {
        let question = self.tips.question(contact, 1.0, WANT_ALL);
        let (_, answer) = self.ask(question.clone())?;
        let error_rel = verify(self.tips, &question, &answer, ERROR_ALLOWED)?;
        let down = answer.reactions.iter().filter(|r| r.dof % 3 == 1);
        let of_touched = down.filter(|r| self.tips.fixed.binary_search(&r.dof).is_err());
        let of_masks = answer.mask_forces.iter().map(|f| f[1]);
        Ok(Pressing {
            contact,
            nodes: self.tips.mesh.node_count(),
            held_nodes: held_nodes(&question),
            force: -of_touched.map(|r| r.value).chain(of_masks).sum::<f64>(),
            report: answer.report,
            error_rel,
        })
    }

    /// Measures frames and echoes in turn; a row of the table.
    fn frames(mut self, contact: ContactModel, quick: bool) -> Result<[Cell; 10], ReportError> {
        let want = self.tips.want_surface();
        let question = self.tips.question(contact, 1.0, want.clone());
        let whole = self.tips.question(contact, 1.0, WANT_ALL);
        let (first_ms, first) = self.ask(question.clone())?;
        let (_, answer) = self.ask(whole.clone())?;
        let mut error = verify(self.tips, &whole, &answer, ERROR_ALLOWED)?;
        let right = first.displacements.clone().into_f64();
        let request_bytes = encode_request(self.model, question.clone())?.len();
        let reply = encode_reply(first)?;
        let mut echo =
            Echo::start(request_bytes, &reply, Ends::CLIENT_AWAKE).map_err(ReportError::Echo)?;
        let mut asked = 0u32;
        let (tips, nodes) = (self.tips, self.tips.mesh.node_count());
        let mut method = String::new();
        let mut competitors: [Competitor<'_, f64, ReportError>; 2] = [
            Box::new(|| {
                asked += 1;
                // Another load each time; the displacements are proportional to it.
                let scale = 1.0 + 0.25 * f64::from(asked).sin();
                let (ms, answer) = self.ask(tips.question(contact, scale, want.clone()))?;
                let got = answer.displacements.into_f64();
                let right = right.iter().flatten().map(|u| scale * u);
                let wrong = error_rel(got.iter().flatten().copied().zip(right));
                check(|| format!("frame by {contact}"), wrong, ERROR_ALLOWED)?;
                error = error.max(wrong);
                method = answer.report.method;
                Ok(ms)
            }),
            Box::new(|| {
                let (ms, echoed) = timed_ms(|| echo.trip());
                echoed.map_err(ReportError::Echo)?;
                Ok(ms)
            }),
        ];
        let mut results = take_turns(&effort(quick), &mut competitors)?.into_iter();
        drop(competitors);
        let (frames, echoes) =
            (results.next().unwrap_or_default(), results.next().unwrap_or_default());
        let ratio = Spread::of_ratio(&frames, &echoes).median;
        let mut sorted = frames.clone();
        sorted.sort_by(f64::total_cmp);
        let forces = question.known.len() + 3 * question.masks.len();
        Ok([
            contact.to_string().into(),
            nodes.into(),
            held_nodes(&question).into(),
            forces.into(),
            method.into(),
            first_ms.into(),
            quantile(&sorted, 0.5).into(),
            ratio.into(),
            if ratio <= ECHOES_MAX { "yes" } else { "no" }.into(),
            error.into(),
        ])
    }
}

fn effort(is_quick: bool) -> Effort {
    let (rounds_min, rounds_max, seconds) = if is_quick { (20, 60, 1) } else { (300, 2000, 8) };
    let budget = Duration::from_secs(seconds);
    Effort { warm_up_rounds: 10, rounds_min, rounds_max, budget }
}

fn of(pressings: &[Pressing], contact: ContactModel) -> impl Iterator<Item = &Pressing> {
    pressings.iter().filter(move |p| p.contact == contact)
}

fn press_table(pressings: &[Pressing]) -> Table {
    let mut table = Table::new("contact", "One press on finer meshes", &PRESS_COLUMNS);
    for contact in CONTACTS {
        let finest = of(pressings, contact).last().map(|p| p.force);
        let mut coarser: Option<f64> = None;
        for pressing in of(pressings, contact) {
            let force = pressing.force;
            let against = |other: Option<f64>| other.map(|other| force / other - 1.0);
            let edge = 60.0 / ((pressing.nodes as f64).cbrt().round() - 1.0);
            table.push([
                contact.to_string().into(),
                pressing.nodes.into(),
                edge.into(),
                pressing.held_nodes.into(),
                pressing.report.method.as_str().into(),
                force.into(),
                (1e3 * DEPTH / force).into(),
                against(coarser).into(),
                against(finest).into(),
                against(Some(exact())).into(),
                pressing.error_rel.into(),
            ]);
            coarser = Some(force);
        }
    }
    table
}

fn figure(pressings: &[Pressing]) -> Result<String, ReportError> {
    let mut series: Vec<Series> = CONTACTS
        .into_iter()
        .map(|contact| {
            let point = |p: &Pressing| PlotPoint { x: p.nodes as f64, y: p.force, spread: None };
            let points = of(pressings, contact).map(point).collect();
            Series { label: contact.to_string(), mark: Mark::Line, points }
        })
        .collect();
    let ends = [pressings.first(), pressings.last()].into_iter().flatten();
    let point = |p: &Pressing| PlotPoint { x: p.nodes as f64, y: exact(), spread: None };
    let label = "half-space, closed form".to_owned();
    series.push(Series { label, mark: Mark::Dashed, points: ends.map(point).collect() });
    let plot = Plot {
        title: "Force of one press".to_owned(),
        x_label: "nodes".to_owned(),
        y_label: "force, N".to_owned(),
        x_scale: Scale::Log,
        y_scale: Scale::Linear,
        series,
    };
    Ok(plot.svg()?)
}

/// Force on a half-space of the same material, N.
fn exact() -> f64 {
    half_space::force(DEPTH, RADIUS, super::tips::YOUNG, super::tips::POISSON)
}

const PRESS_COLUMNS: [&str; 11] = [
    "contact",
    "nodes",
    "edge_mm",
    "held_nodes",
    "method",
    "force_N",
    "mm_per_N",
    "change_from_coarser_rel",
    "off_finest_rel",
    "off_half_space_rel",
    "error_rel",
];

const FRAME_COLUMNS: [&str; 10] = [
    "contact",
    "nodes",
    "held_nodes",
    "unknown_forces",
    "method",
    "first_frame_ms",
    "p50_ms",
    "frame_over_echo",
    "within_3_echoes",
    "error_rel",
];

const FIGURE: &str = "Force of a tip of 8 mm radius pressed 1 mm into a cube of 60 mm whose bottom is held. \
A contact model converges if its line becomes level.";

fn introduction() -> String {
    format!(
        "\
A tip of {:.0} mm radius is pressed {:.0} mm into the middle of the top of a cube of 60 mm edge \
(20 kPa, Poisson's ratio 0.3), whose bottom is held. `vertex` displaces the node in the middle, \
`patch` every node of the surface within the radius, `mask` the mean of the surface, weighted by a \
pressure 1 − (d/r)², with one force. The same press on finer meshes shows whether the force is one \
of the object or one of the mesh: `change_from_coarser_rel` is the step from the mesh before, \
`off_finest_rel` the difference to the finest. `off_half_space_rel` compares with the closed form \
for a half-space under the mask's pressure, {:.4} N; the cube is finite, so a difference of some per \
cent remains for `mask`, and for the other two the comparison says only how far they are from it.\n\n\
Every answer is checked: with the held nodes displaced as in the answer, a direct solve (sparse \
Cholesky) must give all displacements, and for `mask` the forces it needs there must be the mask's \
force times the weights, and the means as asked; `error_rel` is the worst of these, and above 1e-9 \
the report ends.\n\n\
The frames are those of the frame report: a free cube held by five tips, another load each frame, \
displacements of all surface nodes back, `auto` as method, frames and echoes of the same bytes in \
turn, both with a client that stays awake and a server that sleeps. `first_frame_ms` is the first of a grip, without prefetch.",
        1e3 * RADIUS,
        1e3 * DEPTH,
        exact()
    )
}
