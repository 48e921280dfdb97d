//! What a picture shows and how: the options of the renderer, and the picture that comes out.

use crate::render::camera::{Up, View};

/// What to show.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Mode {
    /// The surface with light; back faces are orange.
    Shaded,
    /// The vertices as discs.
    Points,
    /// UV charts in colours.
    Charts,
    /// A checker texture through the UVs.
    Checker,
    /// The UV layout: charts in colours, flipped faces black, overlaps red.
    Uv,
    /// The surface with its edges.
    Wire,
    /// An attribute as colours, with a legend: the uncertainty, or what --attribute names.
    Uncertainty,
}

/// How to show it.
#[derive(Debug, Clone, Copy)]
pub struct Style {
    /// What to show.
    pub mode: Mode,
    /// From where.
    pub view: View,
    /// The vertical axis.
    pub up: Up,
    /// Width and height in pixels.
    pub size: [usize; 2],
    /// One normal per face instead of smooth ones.
    pub flat: bool,
    /// Boundary edges in red, edges with more than two faces in magenta.
    pub boundary: bool,
    /// Use the file's colours.
    pub colors: bool,
    /// Diameter of a point in pixels; `None` = by the number of points.
    pub point_size: Option<f64>,
}

/// A picture.
pub struct Picture {
    /// Width and height in pixels.
    pub size: [usize; 2],
    /// Red, green, blue, row after row.
    pub rgb: Vec<u8>,
    /// Faces or points that were not finite and are not shown.
    pub not_shown: usize,
}
