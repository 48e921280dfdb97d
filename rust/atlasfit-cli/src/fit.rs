//! The one place where the program meets the fit: options in, outcome and facts out.

use atlasfit::geometry::{PointCloud, TriMesh};
use atlasfit::{Result, Run};
use serde_json::Value;

/// Which prior the charts follow.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum)]
pub enum Prior {
    /// The Gaussian-process limit of the paper's networks
    #[default]
    Gp,
    /// The paper's networks
    Mlp,
}

/// What happens to points that belong to no surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum)]
pub enum Outliers {
    /// Keep them where they are, so that points stay in input order
    #[default]
    Keep,
    /// Leave them out of the points
    Drop,
}

/// Options of a fit. `Default` asks for what suits an ordinary scan.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Standard deviation of the noise in the scan's unit; `None` = estimate it.
    pub noise: Option<f64>,
    /// Fineness of the surface: 1 = what the data supports, 0.5 = half as fine.
    pub detail: f64,
    /// Number of charts; `None` = as the shape needs.
    pub charts: Option<usize>,
    /// The prior.
    pub prior: Prior,
    /// Holes with a boundary shorter than this are filled, in the scan's unit; 0 = none.
    pub fill_holes: f64,
    /// Side of the texture in texels: decides the padding between UV charts.
    pub texture_size: u32,
    /// Points that belong to no surface.
    pub outliers: Outliers,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            noise: None,
            detail: 1.0,
            charts: None,
            prior: Prior::Gp,
            fill_holes: 0.0,
            texture_size: 2048,
            outliers: Outliers::Keep,
        }
    }
}

/// One thing that the fit found or did.
pub struct Fact {
    /// Key in the JSON report.
    pub key: &'static str,
    /// Label and value for people.
    pub text: (&'static str, String),
    /// Value in the JSON report.
    pub value: Value,
}

/// What a fit gives.
pub struct Outcome {
    /// Denoised points, in input order.
    pub points: PointCloud,
    /// The stitched surface with UVs.
    pub surface: TriMesh,
    /// What was found and done, in the order to be told.
    pub facts: Vec<Fact>,
    /// Seconds per stage.
    pub seconds: Vec<(atlasfit::Stage, f64)>,
}

/// Fits an atlas to a scan.
pub fn denoise(cloud: &PointCloud, _options: &Options, _run: &mut Run<'_>) -> Result<Outcome> {
    Err(atlasfit::Error::Internal { what: format!("the fit of {} points is not built in yet", cloud.len()) })
}
