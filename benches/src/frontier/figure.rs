//! Figure of time against both errors for every object; rows that no other beats are drawn strong.

use plotters::coord::Shift;
use plotters::prelude::*;

use super::contest::Outcome;
use super::row::{Best, Row};
use super::system::Discretisation;
use crate::axis::{Axis, Scale};
use crate::plot::{COLOURS, Drawn, FONT, PlotError};

/// Time that is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Time {
    /// Time of one more answer.
    Warm,
    /// Time from the mesh to the first answer.
    Cold,
}

/// Error that is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Error {
    Algebraic,
    Total,
}

const PANEL: (u32, u32) = (440, 300);
const LEGEND_WIDTH: u32 = 190;
const TITLE_HEIGHT: u32 = 34;
const METHODS_LEFT: i32 = 12;
/// Opacity of a point that another one beats.
const FAINT: f64 = 0.3;

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Panel<'a> = ChartContext<'a, SVGBackend<'a>, Cartesian2d<Axis, Axis>>;

/// Point of a figure.
struct Point {
    at: (f64, f64),
    colour: RGBColor,
    discretisation: Discretisation,
    is_best: bool,
}

/// Figure with one row of panels for each object: algebraic error at the left, total error at the right.
///
/// # Errors
/// [`PlotError`] if there is nothing to draw, or drawing fails.
pub(super) fn figure(rows: &[Row], time: Time) -> Result<String, PlotError> {
    let title = match time {
        Time::Warm => "Warm frame: time against error",
        Time::Cold => "Cold start: time against error",
    };
    let mut objects: Vec<&str> = rows.iter().map(|r| r.object.as_str()).collect();
    objects.dedup();
    let mut methods: Vec<&str> = Vec::new();
    for row in rows {
        let name = row.outcome.way.name();
        if !methods.contains(&name) {
            methods.push(name);
        }
    }
    if objects.is_empty() {
        return Err(PlotError::Empty { title: title.to_owned() });
    }
    let size = (2 * PANEL.0 + LEGEND_WIDTH, TITLE_HEIGHT + PANEL.1 * objects.len() as u32);
    let mut text = String::new();
    let failed = |error: String| PlotError::Drawing { title: title.to_owned(), text: error };
    {
        let area = SVGBackend::with_string(&mut text, size).into_drawing_area();
        draw(&area, rows, &objects, &methods, time, title).map_err(|e| failed(e.to_string()))?;
    }
    Ok(text)
}

fn draw(
    area: &Area<'_>,
    rows: &[Row],
    objects: &[&str],
    methods: &[&str],
    time: Time,
    title: &str,
) -> Drawn {
    area.fill(&WHITE)?;
    area.draw(&Text::new(title, (12, 8), (FONT, 20)))?;
    let (panels, legend) = area.split_horizontally(2 * PANEL.0);
    let (_, panels) = panels.split_vertically(TITLE_HEIGHT);
    let cells = panels.split_evenly((objects.len(), 2));
    for (index, cell) in cells.iter().enumerate() {
        let object = objects[index / 2];
        let error = if index % 2 == 0 { Error::Algebraic } else { Error::Total };
        let of = rows.iter().filter(|r| r.object == object);
        let points: Vec<Point> = of.map(|row| point(row, methods, time, error)).collect();
        draw_panel(cell, object, error, &points)?;
    }
    draw_legend(&legend, methods)?;
    area.present()
}

fn point(row: &Row, methods: &[&str], time: Time, error: Error) -> Point {
    let Outcome { way, cold, warm, algebraic_rel, total_rel, .. } = &row.outcome;
    let Best { warm_algebraic, warm_total, cold_algebraic, cold_total } = row.best;
    let x = match error {
        Error::Algebraic => *algebraic_rel,
        Error::Total => *total_rel,
    };
    let y = match time {
        Time::Warm => warm.median,
        Time::Cold => cold.median,
    };
    let is_best = match (time, error) {
        (Time::Warm, Error::Algebraic) => warm_algebraic,
        (Time::Warm, Error::Total) => warm_total,
        (Time::Cold, Error::Algebraic) => cold_algebraic,
        (Time::Cold, Error::Total) => cold_total,
    };
    let place = methods.iter().position(|m| *m == way.name()).unwrap_or(0);
    let (colour, discretisation) = (colour(place), row.discretisation);
    Point { at: (x, y), colour, discretisation, is_best }
}

/// Colours of further methods: grey would be faint black.
const FURTHER: [RGBColor; 2] = [RGBColor(128, 64, 0), RGBColor(80, 40, 160)];

fn colour(place: usize) -> RGBColor {
    let coloured = COLOURS.len() - 1;
    let colours = COLOURS.iter().take(coloured).chain(&FURTHER);
    colours.copied().nth(place % (coloured + FURTHER.len())).unwrap_or(BLACK)
}

fn draw_panel(cell: &Area<'_>, object: &str, error: Error, points: &[Point]) -> Drawn {
    let shown: Vec<&Point> =
        points.iter().filter(|p| Scale::Log.holds(p.at.0) && Scale::Log.holds(p.at.1)).collect();
    let x_axis = Axis::around(Scale::Log, shown.iter().map(|p| p.at.0));
    let y_axis = Axis::around(Scale::Log, shown.iter().map(|p| p.at.1));
    let (Some(x_axis), Some(y_axis)) = (x_axis, y_axis) else { return Ok(()) };
    let x_label = match error {
        Error::Algebraic => "error against the same system",
        Error::Total => "error against the finest mesh",
    };
    let mut chart = ChartBuilder::on(cell)
        .caption(object, (FONT, 15))
        .margin(8)
        .x_label_area_size(38)
        .y_label_area_size(58)
        .build_cartesian_2d(x_axis, y_axis)?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(BLACK.mix(0.12))
        .x_desc(x_label)
        .y_desc("ms")
        .label_style((FONT, 12))
        .draw()?;
    for discretisation in Discretisation::ALL {
        // Algebraic errors are compared among equal systems, total ones among all.
        let is_of = |p: &&&Point| match error {
            Error::Algebraic => p.discretisation == discretisation,
            Error::Total => discretisation == Discretisation::T4,
        };
        let best = shown.iter().filter(|p| p.is_best).filter(is_of).map(|p| p.at);
        draw_staircase(&mut chart, best.collect())?;
    }
    for is_best in [false, true] {
        for point in shown.iter().filter(|p| p.is_best == is_best) {
            draw_point(&mut chart, point)?;
        }
    }
    Ok(())
}

/// Draws the steps from the most exact answer to the fastest one.
fn draw_staircase(chart: &mut Panel<'_>, mut best: Vec<(f64, f64)>) -> Drawn {
    best.sort_by(|a, b| a.0.total_cmp(&b.0));
    let corners = best.windows(2).flat_map(|w| [w[0], (w[1].0, w[0].1)]);
    let line: Vec<_> = corners.chain(best.last().copied()).collect();
    chart.draw_series(LineSeries::new(line, BLACK.mix(0.45).stroke_width(1)))?;
    Ok(())
}

fn draw_point(chart: &mut Panel<'_>, point: &Point) -> Drawn {
    let colour = point.colour.mix(if point.is_best { 1.0 } else { FAINT });
    let (at, style, thick) = (point.at, colour.filled(), colour.stroke_width(2));
    match point.discretisation {
        Discretisation::T4 => drop(chart.draw_series([Circle::new(at, 4, style)])?),
        Discretisation::T4Anp => drop(chart.draw_series([Circle::new(at, 5, thick)])?),
        Discretisation::T4Refined => drop(chart.draw_series([Cross::new(at, 4, thick)])?),
        Discretisation::T10 => drop(chart.draw_series([TriangleMarker::new(at, 6, style)])?),
    }
    Ok(())
}

fn draw_legend(area: &Area<'_>, methods: &[&str]) -> Drawn {
    let mut y = TITLE_HEIGHT as i32 + 10;
    for (place, method) in methods.iter().enumerate() {
        area.draw(&Circle::new((METHODS_LEFT, y), 4, colour(place).filled()))?;
        area.draw(&Text::new((*method).to_owned(), (METHODS_LEFT + 14, y - 6), (FONT, 13)))?;
        y += 20;
    }
    y += 10;
    for discretisation in Discretisation::ALL {
        let at = (METHODS_LEFT, y);
        match discretisation {
            Discretisation::T4 => area.draw(&Circle::new(at, 4, BLACK.filled()))?,
            Discretisation::T4Anp => area.draw(&Circle::new(at, 5, BLACK.stroke_width(2)))?,
            Discretisation::T4Refined => {
                area.draw(&Cross::new(at, 4, BLACK.stroke_width(2)))?;
            }
            Discretisation::T10 => area.draw(&TriangleMarker::new(at, 6, BLACK.filled()))?,
        }
        let name = discretisation.name();
        area.draw(&Text::new(name, (METHODS_LEFT + 14, y - 6), (FONT, 13)))?;
        y += 20;
    }
    for line in ["faint: another point is", "faster and as exact"] {
        area.draw(&Text::new(line, (METHODS_LEFT - 6, y + 4), (FONT, 12)))?;
        y += 16;
    }
    Ok(())
}
