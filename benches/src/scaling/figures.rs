//! The figures: time against vertices, against processors, and slopes against vertices.

use softgrasp_core::solve::Method;

use super::grid::{METHODS, Series};
use crate::fit::PowerLaw;
use crate::plot::{Mark, Plot, PlotError, PlotPoint, Scale, Series as Line};
use crate::thesis::{SLOPES, TIMES};

/// Fitted law T = k Nᵐ over processors at one size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SizeLaw {
    pub method: Method,
    pub nodes: usize,
    pub law: PowerLaw,
}

/// Number of processors that the thesis extrapolates to.
pub(super) const PROCESSORS_1998: usize = 27;

fn point(x: f64, y: f64, spread: Option<(f64, f64)>) -> PlotPoint {
    PlotPoint { x, y, spread }
}

fn measured(series: &Series, x: usize) -> PlotPoint {
    let spread = series.spread();
    point(x as f64, spread.median, Some((spread.min, spread.max)))
}

/// Figure 6.13: time of the analysis against vertices.
pub(super) fn vertices(series: &[Series], thread_counts: &[usize]) -> Result<String, PlotError> {
    let mut lines = Vec::new();
    for method in METHODS {
        for &threads in thread_counts.iter().take(1).chain(thread_counts.iter().skip(1).last()) {
            let of = series.iter().filter(|s| s.method == method && s.threads == threads);
            let points = of.map(|s| measured(s, s.nodes)).collect();
            let label = format!("{method}, {threads} proc.");
            lines.push(Line { label, mark: Mark::Line, points });
        }
    }
    let of_1998 = TIMES.iter().filter(|t| t.processors <= 4);
    lines.push(Line {
        label: "1998: one R4400, four R10000".to_owned(),
        mark: Mark::Points,
        points: of_1998.map(|t| point(t.nodes as f64, t.seconds, None)).collect(),
    });
    let title = "Figure 6.13 again: time of the analysis";
    plot(title, "vertices", "seconds", Scale::Log, lines)
}

/// Figures 6.14 and 6.15: time against processors, with the laws drawn on to 27.
pub(super) fn processors(series: &[Series], laws: &[SizeLaw]) -> Result<String, PlotError> {
    let mut lines = Vec::new();
    let sizes = [216, 512, 1000];
    for &nodes in sizes.iter().filter(|&&n| laws.iter().any(|l| l.nodes == n)) {
        let is_it = |method: Method, n: usize| method == Method::GaussJordan && n == nodes;
        let of = series.iter().filter(|s| is_it(s.method, s.nodes));
        let points = of.map(|s| measured(s, s.threads)).collect();
        lines.push(Line { label: format!("{nodes} vertices"), mark: Mark::Line, points });
        for fitted in laws.iter().filter(|l| is_it(l.method, l.nodes)) {
            let at = |n: usize| {
                let p = fitted.law.predict(n as f64);
                // The band of the law is drawn where it is used: at its far end.
                let spread = (n == PROCESSORS_1998).then_some((p.low, p.high));
                point(n as f64, p.value, spread)
            };
            let points = [1, 2, 4, 8, 16, PROCESSORS_1998].map(at).to_vec();
            let label = format!("{nodes} vertices, k N^m");
            lines.push(Line { label, mark: Mark::Dashed, points });
        }
    }
    let of_1998 = TIMES.iter().filter(|t| t.processors > 1);
    let points = of_1998.map(|t| point(t.processors as f64, t.seconds, None)).collect();
    let label = "1998: 267 measured on 4, 216 extrapolated to 27".to_owned();
    lines.push(Line { label, mark: Mark::Points, points });
    let title = "Figures 6.14 and 6.15 again: gauss-jordan";
    plot(title, "processors", "seconds", Scale::Log, lines)
}

/// Figure 6.16: exponents of the laws against vertices, with two standard errors each way.
pub(super) fn slopes(laws: &[SizeLaw]) -> Result<String, PlotError> {
    let mut lines: Vec<Line> = METHODS
        .iter()
        .map(|&method| {
            let of = laws.iter().filter(|l| l.method == method);
            let points = of.map(|l| {
                let reach = 2.0 * l.law.m_error;
                point(l.nodes as f64, l.law.m, Some((l.law.m - reach, l.law.m + reach)))
            });
            Line { label: method.to_string(), mark: Mark::Line, points: points.collect() }
        })
        .collect();
    let points = SLOPES.iter().map(|&(nodes, m)| point(nodes as f64, m, None)).collect();
    lines.push(Line { label: "1998".to_owned(), mark: Mark::Points, points });
    let title = "Figure 6.16 again: m of T = k N^m";
    plot(title, "vertices", "m", Scale::Linear, lines)
}

fn plot(
    title: &str,
    x_label: &str,
    y_label: &str,
    y_scale: Scale,
    series: Vec<Line>,
) -> Result<String, PlotError> {
    let (title, x_label, y_label) = (title.to_owned(), x_label.to_owned(), y_label.to_owned());
    Plot { title, x_label, y_label, x_scale: Scale::Log, y_scale, series }.svg()
}
