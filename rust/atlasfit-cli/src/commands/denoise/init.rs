//! A learned start: the networks of `--prior mlp` begin at the answer of a model to the scan.

use crate::console::Usage;
use crate::files;
use anyhow::Result;
use atlasfit::geometry::TriMesh;
use atlasfit::pipeline::Guide;
use atlasfit::{Context, Error, Vec3};
use atlasfit_learn::Device;
use atlasfit_learn::checkpoint::{self, Loaded};
use atlasfit_learn::eval::{Frame, Input, answers};
use atlasfit_learn::recipe::Decoder;
use atlasfit_net::explicit::{Begun, Network};
use atlasfit_net::{NetworkOptions, Prior};
use std::path::Path;

/// What to say where there are no such networks.
const OTHER_PRIOR: &str = "--init starts the networks of --prior mlp. Give both";

/// The model, and how the networks go on from it.
pub struct Start {
    loaded: Loaded,
    options: NetworkOptions,
}

/// The start that `--init` names; `None` without it.
pub fn start(path: Option<&Path>, prior: &Prior) -> Result<Option<Start>> {
    let Some(path) = path else { return Ok(None) };
    let Prior::Network(options) = prior else { return Err(Usage(OTHER_PRIOR.into()).into()) };
    if options.network != Network::Dense {
        return Err(Usage(OTHER_PRIOR.into()).into());
    }
    let loaded = checkpoint::load(path, &Device::Cpu)?;
    let recipe = &loaded.recipe.model;
    if recipe.decoder != Decoder::AtlasNet || !recipe.encoder.points() {
        return Err(Usage(format!(
            "{}: --init takes a model of points with the decoder atlasnet",
            files::text(path)
        ))
        .into());
    }
    let options = options.with_charts(recipe.charts);
    Ok(Some(Start { loaded, options }))
}

impl Guide for Start {
    fn validate(&self) -> atlasfit::Result<()> {
        self.options.validate()
    }

    fn surface(&self, points: &[Vec3], sigma: f64, ctx: &Context<'_>) -> atlasfit::Result<TriMesh> {
        let first = |points: &[Vec3], grid: [usize; 2], ctx: &Context<'_>| {
            let plain: Vec<[f64; 3]> = points.iter().map(|p| p.0).collect();
            let frame = Frame::about(&plain)?;
            let some = frame.some(&plain, self.loaded.recipe.data.points, ctx.seed);
            let all = answers(&self.loaded.model, Input::Points, &some, 1, grid[0]);
            let all = all.map_err(|e| Error::internal(e.to_string()))?;
            Ok(all.iter().flat_map(|a| &a.samples).map(|p| frame.out(*p)).collect())
        };
        Begun { options: self.options, first: &first }.surface(points, sigma, ctx)
    }
}
