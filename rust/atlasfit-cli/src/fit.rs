//! The one place where the program meets the fit: options in, outcome and facts out.

use crate::number::{count, short};
use atlasfit::geometry::neighbours::Neighbours;
use atlasfit::geometry::vec3::Vec3;
use atlasfit::geometry::{PointCloud, TriMesh};
use atlasfit::{Result, Run, Stage, analyse, fit, orient, partition, project, surface};
use serde_json::{Value, json};

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
///
/// Provisional: the core's steps one after the other, without colours and UVs, until the core has the whole as one function.
pub fn denoise(cloud: &PointCloud, options: &Options, run: &mut Run<'_>) -> Result<Outcome> {
    let kept: Vec<usize> =
        (0..cloud.len()).filter(|&i| cloud.positions[i].iter().all(|x| x.is_finite())).collect();
    let positions: Vec<Vec3> = kept.iter().map(|&i| cloud.positions[i]).collect();
    run.execute(|ctx| {
        ctx.stage(Stage::Analyse, 1);
        let tree = Neighbours::build(&positions)?;
        let spacing = analyse::spacing(&positions, &tree, ctx)?;
        let median_spacing = analyse::median(&mut spacing.iter().map(|&s| f64::from(s)).collect::<Vec<_>>());
        let sigma = match options.noise {
            Some(sigma) => sigma,
            None => analyse::noise(&positions, &tree, ctx)?,
        };
        let analysis = analyse::Analysis { spacing, median_spacing, sigma };
        ctx.stage(Stage::Partition, 1);
        let patches = partition::partition(&positions, &tree, &analysis, partition::PATCH_SIZE, ctx)?;
        ctx.stage(Stage::Fit, 1);
        let mut fitted = fit::fit(&positions, &patches, sigma, ctx)?;
        ctx.stage(Stage::Project, 1);
        let membership = project::membership(positions.len(), &fitted);
        let projected = project::project_members(&positions, &fitted, &membership, ctx)?;
        ctx.stage(Stage::Surface, 1);
        let relations = orient::relations(&positions, &fitted, &membership);
        let (signs, conflicts) = orient::orient(fitted.len(), &relations);
        for (chart, sign) in fitted.iter_mut().zip(&signs) {
            chart.chart.sign = *sign;
        }
        let charts: Vec<_> = fitted.iter().map(|f| f.chart.clone()).collect();
        let cell = 0.6 * median_spacing / options.detail;
        let contour = surface::field::contour(&charts, &relations, &conflicts, cell, ctx)?;
        let surface = surface::clean::triangulate(contour, 100);
        let mut points = cloud.clone();
        for (&i, p) in kept.iter().zip(&projected) {
            points.positions[i] = p.position;
        }
        let outliers = projected.iter().filter(|p| p.chart == u32::MAX).count();
        let fact = |key, label, text: String, value| Fact { key, text: (label, text), value };
        Ok(Outcome {
            points,
            surface: TriMesh::new(surface.positions, surface.triangles),
            facts: vec![
                fact("spacing", "spacing", short(median_spacing), json!(median_spacing)),
                fact("noise", "noise", short(sigma), json!(sigma)),
                fact("outliers", "outliers", count(outliers), json!(outliers)),
                fact("charts", "charts", count(charts.len()), json!(charts.len())),
            ],
            seconds: ctx.stage_seconds(),
        })
    })
}
