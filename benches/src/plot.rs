//! Figures of a report as SVG: lines, measured points with their spread, and fits.

use plotters::coord::Shift;
use plotters::prelude::*;

use crate::axis::Axis;
pub use crate::axis::Scale;

/// Style of a series.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// Measured points joined by a line.
    Line,
    /// Points that are not joined.
    Points,
    /// Dashed line of a fitted law or an extrapolation.
    Dashed,
}

/// Point with the range of its value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlotPoint {
    /// Value on the horizontal axis.
    pub x: f64,
    /// Value on the vertical axis.
    pub y: f64,
    /// Lower and upper end of the value's range, if it has one.
    pub spread: Option<(f64, f64)>,
}

/// Points that belong together.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Name in the legend.
    pub label: String,
    /// Style in which the series is drawn.
    pub mark: Mark,
    /// Points of the series, in the order in which they are joined.
    pub points: Vec<PlotPoint>,
}

/// Data of a figure.
#[derive(Clone, Debug, PartialEq)]
pub struct Plot {
    /// Title of the figure.
    pub title: String,
    /// Name and unit of the horizontal axis.
    pub x_label: String,
    /// Name and unit of the vertical axis.
    pub y_label: String,
    /// Scale of the horizontal axis.
    pub x_scale: Scale,
    /// Scale of the vertical axis.
    pub y_scale: Scale,
    /// Series that are drawn.
    pub series: Vec<Series>,
}

/// Why a figure cannot be drawn.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlotError {
    /// The figure has no point.
    #[error("figure {title:?} has no point that can be drawn")]
    Empty {
        /// Title of the figure.
        title: String,
    },
    /// The drawing library failed.
    #[error("figure {title:?} cannot be drawn: {text}")]
    Drawing {
        /// Title of the figure.
        title: String,
        /// Error of the drawing library.
        text: String,
    },
}

const SIZE: (u32, u32) = (1040, 540);
const LEGEND_WIDTH: u32 = 250;
pub(crate) const FONT: &str = "sans-serif";
/// Colours of the series; people with any kind of colour vision can tell them apart (Okabe and Ito).
pub(crate) const COLOURS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(0, 0, 0),
];

type Chart<'a> = ChartContext<'a, SVGBackend<'a>, Cartesian2d<Axis, Axis>>;
pub(crate) type Drawn =
    Result<(), DrawingAreaErrorKind<<SVGBackend<'static> as DrawingBackend>::ErrorType>>;

/// Style of a dot: filled, or a ring if the series' colour has been used before.
fn dot_style(index: usize) -> ShapeStyle {
    let colour = COLOURS[index % COLOURS.len()];
    match index < COLOURS.len() {
        true => colour.filled(),
        false => colour.stroke_width(2),
    }
}

impl Plot {
    /// Figure as the text of an SVG file; equal data give equal text.
    ///
    /// # Errors
    /// [`PlotError`] if there is no point, or drawing fails.
    pub fn svg(&self) -> Result<String, PlotError> {
        let title = || self.title.clone();
        let x_axis = Axis::around(self.x_scale, self.shown().map(|(_, p)| p.x));
        let y_values = self.shown().flat_map(|(_, p)| {
            let (low, high) = p.spread.unwrap_or((p.y, p.y));
            [p.y, low, high]
        });
        let (Some(x_axis), Some(y_axis)) = (x_axis, Axis::around(self.y_scale, y_values)) else {
            return Err(PlotError::Empty { title: title() });
        };
        let mut text = String::new();
        {
            let area = SVGBackend::with_string(&mut text, SIZE).into_drawing_area();
            self.draw(&area, x_axis, y_axis)
                .map_err(|error| PlotError::Drawing { title: title(), text: error.to_string() })?;
        }
        Ok(text)
    }

    fn draw<'a>(
        &self,
        area: &DrawingArea<SVGBackend<'a>, Shift>,
        x_axis: Axis,
        y_axis: Axis,
    ) -> Drawn {
        area.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(area)
            .caption(&self.title, (FONT, 20))
            .margin(12)
            .margin_right(LEGEND_WIDTH + 12)
            .x_label_area_size(44)
            .y_label_area_size(66)
            .build_cartesian_2d(x_axis, y_axis)?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(BLACK.mix(0.12))
            .x_desc(&self.x_label)
            .y_desc(&self.y_label)
            .label_style((FONT, 14))
            .draw()?;
        for (index, series) in self.series.iter().enumerate() {
            self.draw_series(&mut chart, series, index)?;
        }
        self.draw_legend(area)?;
        area.present()
    }

    fn draw_series(&self, chart: &mut Chart<'_>, series: &Series, index: usize) -> Drawn {
        let colour = COLOURS[index % COLOURS.len()];
        let points: Vec<PlotPoint> =
            self.shown().filter(|(s, _)| std::ptr::eq(*s, series)).map(|(_, p)| p).collect();
        let line = points.iter().map(|p| (p.x, p.y));
        let style = colour.stroke_width(2);
        match series.mark {
            Mark::Line => drop(chart.draw_series(LineSeries::new(line, style))?),
            Mark::Dashed => drop(chart.draw_series(DashedLineSeries::new(line, 6, 5, style))?),
            Mark::Points => {}
        }
        if series.mark != Mark::Dashed {
            let dot = |p: &PlotPoint| Circle::new((p.x, p.y), 4, dot_style(index));
            chart.draw_series(points.iter().map(dot))?;
        }
        let bars = points.iter().filter_map(|p| {
            let (low, high) = p.spread?;
            let ends = [(p.x, low), (p.x, high)];
            Some(PathElement::new(ends, colour.stroke_width(1)))
        });
        chart.draw_series(bars)?;
        Ok(())
    }

    /// Draws the names of the series beside the plot, where they cover nothing.
    fn draw_legend(&self, area: &DrawingArea<SVGBackend<'_>, Shift>) -> Drawn {
        let left = SIZE.0.saturating_sub(LEGEND_WIDTH) as i32;
        for (index, series) in self.series.iter().enumerate() {
            let colour = COLOURS[index % COLOURS.len()];
            let y = 60 + 22 * index as i32;
            if series.mark == Mark::Points || index >= COLOURS.len() {
                area.draw(&Circle::new((left + 12, y), 4, dot_style(index)))?;
            }
            if series.mark != Mark::Points {
                let step = if series.mark == Mark::Dashed { 9 } else { 24 };
                let mut x = left;
                while x < left + 24 {
                    let ends = [(x, y), ((x + step - step / 3).min(left + 24), y)];
                    area.draw(&PathElement::new(ends, colour.stroke_width(3)))?;
                    x += step;
                }
            }
            area.draw(&Text::new(series.label.as_str(), (left + 32, y - 6), (FONT, 14)))?;
        }
        Ok(())
    }

    /// Points that have a position on both axes, each with its series.
    fn shown(&self) -> impl Iterator<Item = (&Series, PlotPoint)> {
        let on_axes = |p: &PlotPoint| {
            let (low, high) = p.spread.unwrap_or((p.y, p.y));
            self.x_scale.holds(p.x) && [p.y, low, high].into_iter().all(|y| self.y_scale.holds(y))
        };
        self.series.iter().flat_map(move |series| {
            series.points.iter().copied().filter(on_axes).map(move |p| (series, p))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot(points: Vec<PlotPoint>) -> Plot {
        Plot {
            title: "Time & <more>".to_owned(),
            x_label: "nodes".to_owned(),
            y_label: "ms".to_owned(),
            x_scale: Scale::Log,
            y_scale: Scale::Log,
            series: vec![
                Series { label: "one".to_owned(), mark: Mark::Line, points: points.clone() },
                Series { label: "law".to_owned(), mark: Mark::Dashed, points },
            ],
        }
    }

    fn point(x: f64, y: f64) -> PlotPoint {
        PlotPoint { x, y, spread: Some((0.9 * y, 1.1 * y)) }
    }

    #[test]
    fn figure_shows_its_words_and_one_dot_a_point() {
        let svg = plot(vec![point(27.0, 1.0), point(216.0, 30.0), point(0.0, 5.0)]).svg().unwrap();
        assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"));
        for word in ["Time &amp; &lt;more&gt;", "nodes", "one", "law"] {
            assert!(svg.contains(word), "{word}");
        }
        // The point at 0 has no place on a logarithmic axis.
        assert_eq!(svg.matches("<circle").count(), 2);
    }

    #[test]
    fn equal_data_give_equal_text_and_one_point_suffices() {
        let one = plot(vec![point(3.0, 4.0)]);
        assert_eq!(one.svg().unwrap(), one.svg().unwrap());
    }

    #[test]
    fn figure_without_points_is_refused() {
        let error = plot(vec![point(f64::NAN, 1.0), point(1.0, -1.0)]).svg().unwrap_err();
        assert!(matches!(error, PlotError::Empty { .. }));
    }
}
