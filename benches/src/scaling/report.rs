//! Writes the page: tables, laws, and the 1998 figures beside ours.

use softgrasp_core::mesh::BuiltIn;
use softgrasp_core::solve::Method;

use super::figures::{self, PROCESSORS_1998, SizeLaw};
use super::grid::{METHODS, Series, measure_objects};
use super::procedures;
use crate::fit::PowerLaw;
use crate::report::{Options, Report, ReportError};
use crate::sample::Spread;
use crate::table::{Cell, Table, three_digits};
use crate::thesis::{self, TIMES};
use crate::threads::{processors, thread_counts};

/// Measures times over vertices, processors and shapes, and fits the thesis's law.
///
/// # Errors
/// [`ReportError`].
pub fn measure(options: &Options) -> Result<Report, ReportError> {
    let sizes: &[usize] = match options.is_quick {
        true => &[27, 64, 125],
        false => &[27, 64, 125, 216, 267, 343, 512, 729, 1000],
    };
    let (equal_size, procedure_size) = if options.is_quick { (64, 64) } else { (343, 267) };
    let counts = thread_counts(processors());
    let threads: Vec<String> = counts.iter().map(usize::to_string).collect();
    let title = "Scaling: time against vertices, processors and shape";
    let mut report = Report::begin("scaling", title, &threads.join(", "), options);
    report.text(INTRODUCTION);
    report.table(procedures::procedures(procedure_size, processors())?);
    report.table(procedures::stages(procedure_size, &counts)?);
    let mut series = Vec::new();
    for &nodes in sizes {
        series.extend(measure_objects(&[(BuiltIn::Cube, nodes)], &counts, options.is_quick)?);
    }
    let laws = size_laws(&series, &counts)?;
    report.table(times(&series));
    report.figure("scaling-vertices", "Medians; bars from the fastest to the slowest round.", {
        figures::vertices(&series, &counts)?
    });
    report.table(vertex_laws(&series, &counts)?);
    if laws.is_empty() {
        report.text("This machine has one processor: no law over processors can be fitted.");
    } else {
        report.table(processor_laws(&series, &laws));
        let band = "The bar at 27 holds 95 % of further measurements if the law holds.";
        report.figure("scaling-processors", band, figures::processors(&series, &laws)?);
        let bars = "Bars are two standard errors of m each way.";
        report.figure("scaling-slopes", bars, figures::slopes(&laws)?);
        report.text(on_twenty_seven(&series, &laws));
    }
    let objects: Vec<_> = BuiltIn::ALL.iter().map(|&shape| (shape, equal_size)).collect();
    let shapes = measure_objects(&objects, &counts[counts.len() - 1..], options.is_quick)?;
    report.table(shape_table(&shapes));
    report.table(beside_1998(&series));
    if !laws.is_empty() {
        report.table(slopes_beside_1998(&series, &laws));
    }
    report.text(NOTE_1998);
    Ok(report)
}

/// One law for each method and size, over all rounds with all numbers of processors.
fn size_laws(series: &[Series], counts: &[usize]) -> Result<Vec<SizeLaw>, ReportError> {
    let mut laws = Vec::new();
    if counts.len() < 2 {
        return Ok(laws);
    }
    let firsts = series.iter().filter(|s| s.threads == counts[0]);
    for Series { method, nodes, .. } in firsts {
        let of = series.iter().filter(|s| s.method == *method && s.nodes == *nodes);
        let measured: Vec<(f64, f64)> =
            of.flat_map(|s| s.seconds.iter().map(|&t| (s.threads as f64, t))).collect();
        let law = PowerLaw::fit(&format!("{method} at {nodes} vertices"), &measured)?;
        laws.push(SizeLaw { method: *method, nodes: *nodes, law });
    }
    Ok(laws)
}

fn times(series: &[Series]) -> Table {
    let title = "Figures 6.13 and 6.14 again: time of the analysis of the cube";
    let mut table = Table::new("scaling", title, &TIME_COLUMNS);
    for s in series {
        let spread = s.spread();
        let row: [Cell; 9] = [
            s.method.name().into(),
            s.nodes.into(),
            s.unknown_dofs.into(),
            s.threads.into(),
            spread.median.into(),
            spread.min.into(),
            spread.max.into(),
            s.error_rel.into(),
            spread.count.into(),
        ];
        table.push(row);
    }
    table
}

/// Laws T = k Vᵖ over vertices, for larger sizes: small ones are mostly overhead.
fn vertex_laws(series: &[Series], counts: &[usize]) -> Result<Table, ReportError> {
    let largest = series.iter().map(|s| s.nodes).max().unwrap_or(0);
    let from = if largest >= 1000 { 216 } else { 0 };
    let title = format!("Laws T = k Vᵖ over vertices, from {from} on");
    let mut table = Table::new("scaling-vertex-laws", title, &VERTEX_LAW_COLUMNS);
    for method in METHODS {
        for &threads in counts {
            let of = series
                .iter()
                .filter(|s| s.method == method && s.threads == threads && s.nodes >= from);
            let measured: Vec<(f64, f64)> =
                of.clone().flat_map(|s| s.seconds.iter().map(|&t| (s.nodes as f64, t))).collect();
            let law = PowerLaw::fit(&format!("{method} over vertices"), &measured)?;
            let row: [Cell; 7] = [
                method.name().into(),
                threads.into(),
                law.m.into(),
                law.m_error.into(),
                law.k.into(),
                (100.0 * law.residual).into(),
                Spread::of(of.map(|s| s.error_rel)).max.into(),
            ];
            table.push(row);
        }
    }
    Ok(table)
}

fn processor_laws(series: &[Series], laws: &[SizeLaw]) -> Table {
    let title = "Figures 6.15 and 6.16 again: laws T = k Nᵐ over processors";
    let mut table = Table::new("scaling-processor-laws", title, &LAW_COLUMNS);
    for SizeLaw { method, nodes, law } in laws {
        let of = series.iter().filter(|s| s.method == *method && s.nodes == *nodes);
        let at_27 = law.predict(PROCESSORS_1998 as f64);
        let row: [Cell; 11] = [
            method.name().into(),
            (*nodes).into(),
            law.k.into(),
            law.m.into(),
            law.m_error.into(),
            (100.0 * law.residual).into(),
            law.count.into(),
            at_27.value.into(),
            at_27.low.into(),
            at_27.high.into(),
            Spread::of(of.map(|s| s.error_rel)).max.into(),
        ];
        table.push(row);
    }
    table
}

/// Comparison of the fits with the thesis's extrapolation.
fn on_twenty_seven(series: &[Series], laws: &[SizeLaw]) -> String {
    let mut text = format!(
        "### What the fits say about {PROCESSORS_1998} processors\n\n\
         The thesis extrapolates that {PROCESSORS_1998} processors do 216 vertices in 0.5 s (6.4).\n\n"
    );
    for SizeLaw { method, nodes, law } in laws.iter().filter(|l| l.nodes == 216) {
        let of = |threads: usize| {
            series
                .iter()
                .find(|s| s.method == *method && s.nodes == *nodes && s.threads == threads)
                .map(|s| s.spread().median)
        };
        let most = series.iter().map(|s| s.threads).max().unwrap_or(1);
        let at_27 = law.predict(PROCESSORS_1998 as f64);
        text.push_str(&format!(
            "- `{method}`: T = {} s × N^({:.2} ± {:.2}); at {PROCESSORS_1998} processors {} s, \
             95 % of measurements between {} and {} s if the law holds.",
            three_digits(law.k),
            law.m,
            2.0 * law.m_error,
            three_digits(at_27.value),
            three_digits(at_27.low),
            three_digits(at_27.high),
        ));
        if let (Some(one), Some(all)) = (of(1), of(most)) {
            text.push_str(&amdahl(one, all, most));
        }
        text.push('\n');
    }
    let most = series.iter().map(|s| s.threads).max().unwrap_or(1);
    text.push_str(&format!(
        "\nThe measurements end at {most} processors, so {PROCESSORS_1998} lies {:.1} times beyond \
         the measured range in ln N. The range given counts scatter only. That the law itself holds \
         out there is an assumption: a part that does not get faster is invisible in it, and \
         Amdahl's law, which has one, gives another number from the same measurements. The thesis \
         extrapolates in the same way from four processors, with a slope below −1 at about 200 \
         vertices: faster than in proportion to the processors, as growing caches can make a few \
         of them, but not ever more.\n",
        (PROCESSORS_1998 as f64).ln() / (most.max(2) as f64).ln()
    ));
    text
}

/// Extrapolation by Amdahl's law, with a constant serial share.
fn amdahl(one: f64, all: f64, processors: usize) -> String {
    let n = processors as f64;
    let serial = ((all / one * n - 1.0) / (n - 1.0)).clamp(0.0, 1.0);
    let far = one * (serial + (1.0 - serial) / PROCESSORS_1998 as f64);
    format!(" By Amdahl's law (serial share {:.0} %) {} s.", 100.0 * serial, three_digits(far))
}

fn shape_table(shapes: &[Series]) -> Table {
    let title = "Independence of shape: equal vertices, all processors";
    let mut table = Table::new("scaling-shapes", title, &SHAPE_COLUMNS);
    for s in shapes {
        let is_cube = |c: &&Series| c.shape == BuiltIn::Cube && c.method == s.method;
        let cube = shapes.iter().find(is_cube).map_or(&s.seconds, |c| &c.seconds);
        let (spread, ratio) = (s.spread(), Spread::of_ratio(&s.seconds, cube));
        let row: [Cell; 9] = [
            s.method.name().into(),
            s.shape.name().into(),
            s.nodes.into(),
            s.unknown_dofs.into(),
            spread.median.into(),
            ratio.median.into(),
            ratio.p10.into(),
            ratio.p90.into(),
            s.error_rel.into(),
        ];
        table.push(row);
    }
    table
}

fn beside_1998(series: &[Series]) -> Table {
    let mut table = Table::new("scaling-1998", "The 1998 figures beside ours", &COLUMNS_1998);
    let most = series.iter().map(|s| s.threads).max().unwrap_or(1);
    for time in &TIMES {
        for method in METHODS {
            let threads = time.processors.min(most);
            let is_it =
                |s: &&Series| s.nodes == time.nodes && s.method == method && s.threads == threads;
            let ours = series.iter().find(is_it);
            let seconds = ours.map(|s| s.spread().median);
            let row: [Cell; 9] = [
                time.nodes.into(),
                time.machine.into(),
                time.source.into(),
                time.seconds.into(),
                method.name().into(),
                threads.into(),
                seconds.into(),
                seconds.map(|s| time.seconds / s).into(),
                ours.map(|s| s.error_rel).into(),
            ];
            table.push(row);
        }
    }
    let speed_up = |method: Method| -> Cell {
        let of = |threads: usize| {
            let is_it = |s: &&Series| s.nodes == 267 && s.method == method && s.threads == threads;
            series.iter().find(is_it).map(|s| s.spread().median)
        };
        of(1).zip(of(most)).map(|(one, all)| one / all).into()
    };
    for method in METHODS {
        let row: [Cell; 9] = [
            267usize.into(),
            "speed-up, Indigo2 to ONYX".into(),
            "7.1".into(),
            thesis::SPEED_UP.into(),
            method.name().into(),
            most.into(),
            speed_up(method),
            Cell::Blank,
            Cell::Blank,
        ];
        table.push(row);
    }
    table
}

/// Exponents m of the thesis (6.4), each beside ours at the nearest number of vertices.
fn slopes_beside_1998(series: &[Series], laws: &[SizeLaw]) -> Table {
    let title = "Slopes m of T = k Nᵐ: the 1998 figures beside ours";
    let mut table = Table::new("scaling-slopes-1998", title, &SLOPE_COLUMNS);
    for (vertices, m_1998) in thesis::SLOPES {
        for method in METHODS {
            let of_method = laws.iter().filter(|l| l.method == method);
            let Some(SizeLaw { nodes, law, .. }) =
                of_method.min_by_key(|l| l.nodes.abs_diff(vertices))
            else {
                continue;
            };
            let of = series.iter().filter(|s| s.method == method && s.nodes == *nodes);
            let row: [Cell; 8] = [
                vertices.into(),
                m_1998.into(),
                method.name().into(),
                (*nodes).into(),
                law.m.into(),
                law.m_error.into(),
                (100.0 * law.residual).into(),
                Spread::of(of.map(|s| s.error_rel)).max.into(),
            ];
            table.push(row);
        }
    }
    table
}

const TIME_COLUMNS: [&str; 9] = [
    "method",
    "vertices",
    "unknown_dofs",
    "processors",
    "median_s",
    "min_s",
    "max_s",
    "error_rel",
    "rounds",
];

const VERTEX_LAW_COLUMNS: [&str; 7] =
    ["method", "processors", "p", "p_std_error", "k_s", "residual_percent", "error_rel"];

const LAW_COLUMNS: [&str; 11] = [
    "method",
    "vertices",
    "k_s",
    "m",
    "m_std_error",
    "residual_percent",
    "measurements",
    "at_27_s",
    "at_27_low_s",
    "at_27_high_s",
    "error_rel",
];

const SHAPE_COLUMNS: [&str; 9] = [
    "method",
    "shape",
    "vertices",
    "unknown_dofs",
    "median_s",
    "over_cube",
    "over_cube_p10",
    "over_cube_p90",
    "error_rel",
];

const COLUMNS_1998: [&str; 9] = [
    "vertices",
    "machine_1998",
    "where",
    "figure_1998",
    "our_method",
    "our_processors",
    "our_figure",
    "times_faster",
    "error_rel",
];

const SLOPE_COLUMNS: [&str; 8] = [
    "vertices_1998",
    "m_1998",
    "our_method",
    "our_vertices",
    "m",
    "m_std_error",
    "residual_percent",
    "error_rel",
];

const INTRODUCTION: &str = "\
Times are of the whole analysis, from the mesh to the displacements, of an object with five known \
nodes. All methods and numbers of processors take turns at each size; each number of processors is \
a rayon pool of exactly so many threads. `error_rel` is the worst error of all rounds against a \
reference refined in twice the working precision; above 1e-9 the report ends. Laws are straight \
lines through logarithms of all rounds (least squares); `residual_percent` is the standard deviation \
of ln T about the line, in per cent. The operation count of the thesis, 2n²(3n − 1)/N (C.5), is a law \
with p = 3 over vertices and m = −1 over processors; `front` counts about as the square of the \
vertices.";

const NOTE_1998: &str = "\
The thesis prints its slopes without signs: 0.18 at about 50 vertices, 1.5 at 200, 0.9 from 400 up \
(6.4); the figure takes them as 0, −1.5 and −0.9, as the text around them says. Its operation count \
2n²(3n − 1)/N (C.5) is for two n × n matrices; ours leaves out the known zeros and ones. Where the \
1998 row used more processors than this machine has, ours used all there are.";
