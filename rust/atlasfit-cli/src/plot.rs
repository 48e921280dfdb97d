//! Figures as PNG and SVG: panels with axes, lines, points and faces.
//!
//! In: a [`Figure`], plain data. Out: the same picture in both formats. Text is set in a font that comes with
//! the program, so that it looks the same everywhere.

use crate::render::Picture;
use crate::render::font::{FONT, fonts};
use anyhow::{Result, anyhow};
use plotters::coord::Shift;
use plotters::prelude::*;

/// A picture of several rows of panels.
pub struct Figure {
    /// Above all.
    pub title: &'static str,
    /// The panels, row by row.
    pub rows: Vec<Vec<Panel>>,
    /// Width and height of a row's panels together, in pixels.
    pub row: [u32; 2],
}

/// One plot.
pub struct Panel {
    pub title: String,
    /// `None` where places mean nothing: no axes are drawn, and both directions have one scale.
    pub axes: Option<[Axis; 2]>,
    /// Where the legend is.
    pub legend: Legend,
    pub marks: Vec<Mark>,
}

/// Where it hides least.
#[derive(Clone, Copy)]
pub enum Legend {
    UpperRight,
    LowerRight,
}

/// An axis. Logarithmic ones are given the decimal logarithm.
#[derive(Clone, Copy)]
pub struct Axis {
    pub label: &'static str,
    pub range: [f64; 2],
    pub logarithmic: bool,
}

/// What is drawn in a panel.
pub struct Mark {
    /// In the legend; empty: not there.
    pub label: String,
    pub color: usize,
    pub shape: Shape,
}

/// How it is drawn.
pub enum Shape {
    Line(Vec<[f64; 2]>),
    Dashed(Vec<[f64; 2]>),
    Dots(Vec<[f64; 2]>),
    /// Between two heights at each abscissa.
    Band(Vec<[f64; 3]>),
    /// Quadrilaterals, each with its brightness, the farthest first.
    Faces(Vec<([[f64; 2]; 4], f64)>),
}

impl Axis {
    /// A linear axis.
    pub const fn linear(label: &'static str, range: [f64; 2]) -> Self {
        Self { label, range, logarithmic: false }
    }
    /// An axis of decimal logarithms.
    pub const fn logarithmic(label: &'static str, range: [f64; 2]) -> Self {
        Self { label, range, logarithmic: true }
    }

    fn text(self, x: f64) -> String {
        match self.logarithmic {
            true if (x - x.round()).abs() < 1e-6 => format!("1e{x:.0}"),
            true => String::new(),
            false => format!("{:.3}", x + 0.0).trim_end_matches('0').trim_end_matches('.').to_owned(),
        }
    }
}

impl Mark {
    /// A line in the legend.
    pub fn line(label: impl Into<String>, color: usize, points: Vec<[f64; 2]>) -> Self {
        Self { label: label.into(), color, shape: Shape::Line(points) }
    }
    /// A dashed one.
    pub fn dashed(label: impl Into<String>, color: usize, points: Vec<[f64; 2]>) -> Self {
        Self { label: label.into(), color, shape: Shape::Dashed(points) }
    }
    /// Points.
    pub fn dots(label: impl Into<String>, color: usize, points: Vec<[f64; 2]>) -> Self {
        Self { label: label.into(), color, shape: Shape::Dots(points) }
    }
}

/// Colours that differ for the colour-blind too (Okabe and Ito 2008).
const COLORS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(0, 0, 0),
];
/// Height of the title, in pixels.
const TITLE: u32 = 44;
/// Dots of a lighter line between two ticks would hide the data.
const NO_LINES: RGBAColor = RGBAColor(0, 0, 0, 0.0);

impl Figure {
    fn size(&self) -> (u32, u32) {
        (self.row[0], TITLE + self.row[1] * self.rows.len() as u32)
    }

    /// As SVG.
    pub fn svg(&self) -> Result<String> {
        fonts()?;
        let mut text = String::new();
        self.draw(SVGBackend::with_string(&mut text, self.size()).into_drawing_area())?;
        Ok(text)
    }

    /// As pixels.
    pub fn picture(&self) -> Result<Picture> {
        fonts()?;
        let (width, height) = self.size();
        let mut rgb = vec![0; (3 * width * height) as usize];
        self.draw(BitMapBackend::with_buffer(&mut rgb, (width, height)).into_drawing_area())?;
        Ok(Picture { size: [width as usize, height as usize], rgb, not_shown: 0 })
    }

    fn draw<B: DrawingBackend>(&self, area: DrawingArea<B, Shift>) -> Result<()> {
        area.fill(&WHITE).map_err(failed)?;
        let area = area.margin(8, 0, 0, 0).titled(self.title, (FONT, 26)).map_err(failed)?;
        for (row, panels) in area.split_evenly((self.rows.len(), 1)).iter().zip(&self.rows) {
            for (area, panel) in row.split_evenly((1, panels.len())).iter().zip(panels) {
                panel.draw(area)?;
            }
        }
        area.present().map_err(failed)
    }
}

fn failed(e: impl std::fmt::Display) -> anyhow::Error {
    anyhow!("cannot draw the figure: {e}")
}

impl Panel {
    fn draw<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>) -> Result<()> {
        let [x, y] = self.axes.unwrap_or_else(|| self.one_scale(area.dim_in_pixel()));
        let labels = if self.axes.is_some() { [44, 62] } else { [0, 0] };
        let mut chart = ChartBuilder::on(area)
            .caption(&self.title, (FONT, 19))
            .margin(10)
            .x_label_area_size(labels[0])
            .y_label_area_size(labels[1])
            .build_cartesian_2d(x.range[0]..x.range[1], y.range[0]..y.range[1])
            .map_err(failed)?;
        if self.axes.is_some() {
            chart
                .configure_mesh()
                .x_desc(x.label)
                .y_desc(y.label)
                .x_label_formatter(&|v| x.text(*v))
                .y_label_formatter(&|v| y.text(*v))
                .label_style((FONT, 15))
                .axis_desc_style((FONT, 17))
                .light_line_style(NO_LINES)
                .bold_line_style(BLACK.mix(0.12))
                .x_labels(7)
                .y_labels(7)
                .draw()
                .map_err(failed)?;
        }
        for mark in &self.marks {
            mark.draw(&mut chart)?;
        }
        if self.marks.iter().any(|m| !m.label.is_empty()) {
            chart
                .configure_series_labels()
                .position(match self.legend {
                    Legend::UpperRight => SeriesLabelPosition::UpperRight,
                    Legend::LowerRight => SeriesLabelPosition::LowerRight,
                })
                .background_style(WHITE.mix(0.85))
                .border_style(BLACK.mix(0.3))
                .label_font((FONT, 15))
                .draw()
                .map_err(failed)?;
        }
        Ok(())
    }

    /// Axes about everything that have one scale on so many pixels.
    fn one_scale(&self, (width, height): (u32, u32)) -> [Axis; 2] {
        let mut range = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
        for p in self.marks.iter().flat_map(|m| m.shape.points()) {
            for (r, x) in range.iter_mut().zip(p) {
                *r = [r[0].min(x), r[1].max(x)];
            }
        }
        let sides = [f64::from(width), f64::from(height.saturating_sub(40).max(1))];
        let scale = (0..2).map(|k| (range[k][1] - range[k][0]) / sides[k]).fold(1e-12, f64::max) * 1.08;
        std::array::from_fn(|k| {
            let (middle, half) = (0.5 * (range[k][0] + range[k][1]), 0.5 * scale * sides[k]);
            Axis::linear("", [middle - half, middle + half])
        })
    }
}

/// A panel's coordinates.
type Chart<'a, B> = ChartContext<
    'a,
    B,
    Cartesian2d<plotters::coord::types::RangedCoordf64, plotters::coord::types::RangedCoordf64>,
>;

impl Shape {
    pub fn points(&self) -> Vec<[f64; 2]> {
        match self {
            Self::Line(p) | Self::Dashed(p) | Self::Dots(p) => p.clone(),
            Self::Band(p) => p.iter().flat_map(|p| [[p[0], p[1]], [p[0], p[2]]]).collect(),
            Self::Faces(f) => f.iter().flat_map(|f| f.0).collect(),
        }
    }
}

impl Mark {
    fn draw<'a, B: DrawingBackend + 'a>(&self, chart: &mut Chart<'a, B>) -> Result<()> {
        let color = COLORS[self.color % COLORS.len()];
        let style = color.stroke_width(2);
        let pairs = |p: &[[f64; 2]]| p.iter().map(|p| (p[0], p[1])).collect::<Vec<_>>();
        let drawn = match &self.shape {
            Shape::Line(p) => chart.draw_series(LineSeries::new(pairs(p), style)),
            Shape::Dashed(p) => chart.draw_series(DashedLineSeries::new(pairs(p), 7, 5, style)),
            Shape::Dots(p) => {
                chart.draw_series(pairs(p).into_iter().map(|p| Circle::new(p, 3, color.filled())))
            }
            Shape::Band(p) => {
                let there = p.iter().map(|p| (p[0], p[1]));
                let back = p.iter().rev().map(|p| (p[0], p[2]));
                let outline: Vec<_> = there.chain(back).collect();
                chart.draw_series(std::iter::once(Polygon::new(outline, color.mix(0.2).filled())))
            }
            Shape::Faces(faces) => chart.draw_series(faces.iter().map(|(corners, bright)| {
                let shade = |c: u8| (f64::from(c) * bright).clamp(0.0, 255.0) as u8;
                let color = RGBColor(shade(color.0), shade(color.1), shade(color.2));
                Polygon::new(pairs(corners), color.filled())
            })),
        };
        let drawn = drawn.map_err(failed)?;
        if !self.label.is_empty() {
            // Two pieces, which meet but where the line is dashed or a dot.
            let (width, pieces) = match self.shape {
                Shape::Dots(_) => (6, [[9, 12], [9, 12]]),
                Shape::Dashed(_) => (2, [[0, 8], [12, 20]]),
                Shape::Band(_) | Shape::Faces(_) => (9, [[0, 10], [10, 20]]),
                Shape::Line(_) => (2, [[0, 10], [10, 20]]),
            };
            let opaque = if matches!(self.shape, Shape::Band(_)) { 0.2 } else { 1.0 };
            let style = color.mix(opaque).stroke_width(width);
            let piece = move |[from, to]: [i32; 2]| PathElement::new(vec![(from, 0), (to, 0)], style);
            drawn
                .label(&self.label)
                .legend(move |at| EmptyElement::at(at) + piece(pieces[0]) + piece(pieces[1]));
        }
        Ok(())
    }
}
