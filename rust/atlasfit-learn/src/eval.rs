//! How good a model is: Chamfer distance, overlap and distortion of the charts, correspondence, by family.
//!
//! In: a model, the shapes of a split. Out: plain numbers, by the core's measures.

use crate::data::{Dataset, Shard, Split};
use crate::error::Result;
use crate::model::{CHANNELS, Model};
use crate::params::Mode;
use atlasfit::geometry::TriMesh;
use atlasfit::measure;
use atlasfit::numeric::rng::shuffled;
use atlasfit::numeric::vec3::Vec3;
use atlasfit::run::Context;
use atlasfit_net::explicit::NetworkAtlas;
use candle_core::Tensor;
use rayon::prelude::*;

/// Shapes that are answered together.
const TOGETHER: usize = 32;
/// Training shapes that are tried as the answer to everything, and shapes that each is tried on.
const CONSTANTS: usize = 24;

/// What a model is asked with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Input {
    /// Points of the shape.
    Points,
    /// One picture.
    Image,
}

impl Input {
    /// Whether a model has an encoder for it.
    #[must_use]
    pub fn is_taken_by(self, model: &Model) -> bool {
        match self {
            Self::Points => model.recipe.encoder.points(),
            Self::Image => model.recipe.encoder.image(),
        }
    }

    /// Its name in tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Points => "points",
            Self::Image => "image",
        }
    }
}

/// Shapes whose answers are known.
pub struct Answers {
    /// The shapes.
    pub shapes: Shard,
    /// Names of the families.
    pub families: Vec<String>,
}

impl Answers {
    /// All shapes of a split.
    ///
    /// # Errors
    /// As [`Dataset::read_all`].
    pub fn read(data: &Dataset, split: Split) -> Result<Self> {
        Ok(Self { shapes: data.read_all(split)?, families: data.manifest.families.clone() })
    }

    /// The points of one shape.
    fn truth(&self, shape: usize) -> Vec<Vec3> {
        vectors(self.shapes.points_of(shape))
    }
}

fn vectors(flat: &[f32]) -> Vec<Vec3> {
    flat.as_chunks::<3>().0.iter().map(|p| Vec3(p.map(f64::from))).collect()
}

/// A model's answer: samples of its charts.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Answer {
    /// Chart after chart, line after line.
    pub samples: Vec<Vec3>,
    /// Number of charts.
    pub charts: usize,
    /// Samples along a side of a chart.
    pub side: usize,
}

/// Answers to some inputs, all of one kind: coordinates or pixels, one input after the other; with `side`
/// samples along a side of each chart where the decoder can.
///
/// # Errors
/// Those of candle; samples that are not finite.
pub fn answers(model: &Model, input: Input, flat: &[f32], count: usize, side: usize) -> Result<Vec<Answer>> {
    let device = model.device();
    let codes = match input {
        Input::Points => model.encode_points(
            &Tensor::from_slice(flat, (count, flat.len() / 3 / count, 3), device)?,
            Mode::Use,
        )?,
        Input::Image => {
            let n = model.recipe.image_side;
            model.encode_pictures(&Tensor::from_slice(flat, (count, n, n, CHANNELS), device)?, Mode::Use)?
        }
    };
    let Some(codes) = codes else {
        return Err(crate::Error::recipe(
            format!("the model has no encoder of {}s", input.name().trim_end_matches('s')),
            "Give one that was trained with it (model.encoder)",
        ));
    };
    let (samples, side) = model.decode_at(&codes, side, Mode::Use)?;
    let charts = samples.dim(1)?;
    let flat: Vec<f32> = samples.flatten_all()?.to_vec1()?;
    if flat.iter().any(|x| !x.is_finite()) {
        return Err(atlasfit::Error::Diverged {
            what: "a sample of a chart is not finite".into(),
            advice: "Take another checkpoint".into(),
        }
        .into());
    }
    let each = flat.len() / count;
    Ok(flat.chunks_exact(each).map(|s| Answer { samples: vectors(s), charts, side }).collect())
}

/// Answers to all shapes.
fn all_answers(
    model: &Model,
    all: &Answers,
    input: Input,
    side: usize,
    ctx: &Context<'_>,
) -> Result<Vec<Answer>> {
    let mut out = Vec::with_capacity(all.shapes.len());
    let indices: Vec<usize> = (0..all.shapes.len()).collect();
    for some in indices.chunks(TOGETHER) {
        ctx.check()?;
        let flat: Vec<f32> = match input {
            Input::Points => some.iter().flat_map(|&i| all.shapes.points_of(i)).copied().collect(),
            Input::Image => {
                some.iter().flat_map(|&i| crate::data::pixels(all.shapes.picture_of(i, 0))).collect()
            }
        };
        out.extend(answers(model, input, &flat, some.len(), side)?);
    }
    Ok(out)
}

/// Chamfer distance of the answer to each shape, by the samples of training.
///
/// # Errors
/// Those of candle; cancelled or out of time.
pub fn chamfers(model: &Model, all: &Answers, input: Input, ctx: &Context<'_>) -> Result<Vec<f64>> {
    let answers = all_answers(model, all, input, model.side(), ctx)?;
    let each: atlasfit::Result<Vec<f64>> = answers
        .par_iter()
        .enumerate()
        .map(|(i, a)| measure::chamfer(&a.samples, &all.truth(i), ctx))
        .collect();
    Ok(each?)
}

/// The mean Chamfer distance of `count` points that are the same for all shapes: the better one of points
/// drawn from all training shapes together, and of the best of several training shapes.
///
/// # Errors
/// As [`Dataset::read_all`]; cancelled or out of time.
pub fn constant(data: &Dataset, split: Split, count: usize, ctx: &Context<'_>) -> Result<f64> {
    let (train, all) = (data.read(Split::Train, 0)?, Answers::read(data, split)?);
    let some =
        |i: usize, n: usize| -> Vec<Vec3> { vectors(train.points_of(i)).into_iter().take(n).collect() };
    let each = count.div_ceil(train.len()).max(1);
    let mut tried: Vec<Vec<Vec3>> = vec![(0..train.len()).flat_map(|i| some(i, each)).take(count).collect()];
    let order = shuffled(train.len(), 1);
    tried.extend(order.into_iter().take(CONSTANTS).map(|i| some(i as usize, count)));
    let few: Vec<u32> = shuffled(all.shapes.len(), 2).into_iter().take(2 * CONSTANTS).collect();
    let mean = |points: &Vec<Vec3>, of: &[u32]| -> Result<f64> {
        let each: atlasfit::Result<Vec<f64>> =
            of.par_iter().map(|&i| measure::chamfer(points, &all.truth(i as usize), ctx)).collect();
        Ok(each?.iter().sum::<f64>() / of.len() as f64)
    };
    let rough = tried.iter().map(|p| mean(p, &few)).collect::<Result<Vec<f64>>>()?;
    let best = (0..tried.len()).min_by(|a, b| rough[*a].total_cmp(&rough[*b])).unwrap_or(0);
    mean(&tried[best], &(0..all.shapes.len() as u32).collect::<Vec<_>>())
}

/// Means over the shapes of a family.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Row {
    /// Its name.
    pub family: String,
    /// Shapes.
    pub shapes: usize,
    /// Chamfer distance, a squared length of the normalised frame.
    pub chamfer: f64,
    /// Share of samples nearer to another chart than to their own, in [0, 1].
    pub overlap: f64,
    /// Sander's L2 stretch of the charts, 1 or more: 1 = isometric.
    pub stretch: f64,
    /// Mean by area of the ratio of the singular values: 1 = conformal.
    pub conformal: f64,
}

/// Measures a model on the shapes of a split with about `samples` samples of each answer, family by family.
///
/// # Errors
/// Those of candle; cancelled or out of time.
pub fn table(
    model: &Model,
    all: &Answers,
    input: Input,
    samples: usize,
    ctx: &Context<'_>,
) -> Result<Vec<Row>> {
    let side = ((samples as f64 / model.recipe.charts as f64).sqrt().round() as usize).max(2);
    let answers = all_answers(model, all, input, side, ctx)?;
    let each: atlasfit::Result<Vec<[f64; 4]>> = answers
        .par_iter()
        .enumerate()
        .map(|(i, a)| {
            let atlas = NetworkAtlas::new(a.charts, [a.side; 2], a.samples.clone());
            let uv = measure::uv(&with_uv(&atlas), ctx)?;
            let chamfer = measure::chamfer(&a.samples, &all.truth(i), ctx)?;
            Ok([chamfer, atlas.overlap(ctx)?, uv.stretch_l2, uv.conformal])
        })
        .collect();
    let each = each?;
    let rows = all.families.iter().enumerate().map(|(f, name)| {
        let of: Vec<&[f64; 4]> =
            each.iter().zip(&all.shapes.family).filter(|(_, g)| usize::from(**g) == f).map(|e| e.0).collect();
        let mean = |k: usize| of.iter().map(|e| e[k]).sum::<f64>() / of.len().max(1) as f64;
        Row {
            family: name.clone(),
            shapes: of.len(),
            chamfer: mean(0),
            overlap: mean(1),
            stretch: mean(2),
            conformal: mean(3),
        }
    });
    Ok(rows.filter(|r| r.shapes > 0).collect())
}

/// The charts as one mesh, whose UVs are their squares side by side.
pub(crate) fn with_uv(atlas: &NetworkAtlas) -> TriMesh {
    let mut mesh = atlas.surface();
    let [lines, side] = atlas.grid;
    let across = (atlas.charts as f64).sqrt().ceil() as usize;
    // A gap of one cell between charts.
    let cell = 1.0 / (across * lines.max(side)) as f32;
    let place = |v: u32| {
        let (chart, i) = (v as usize / (lines * side), v as usize % (lines * side));
        let corner = [chart / across * lines, chart % across * side];
        [(corner[1] + i % side) as f32 * cell, (corner[0] + i / side) as f32 * cell]
    };
    mesh.corner_uv = Some(mesh.triangles.iter().map(|t| t.map(place)).collect());
    mesh
}

/// An answer's charts as one mesh: each a grid, its square of the page as UVs.
#[must_use]
pub fn charts(answer: &Answer) -> TriMesh {
    with_uv(&NetworkAtlas::new(answer.charts, [answer.side; 2], answer.samples.clone()))
}

/// The normalised frame of a scan: its box centred at 0, its longest side 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    middle: Vec3,
    longest: f64,
}

impl Frame {
    /// The frame of the finite ones of some points.
    ///
    /// # Errors
    /// [`atlasfit::Error::EmptyInput`] without any; [`atlasfit::Error::Degenerate`] where all lie in one
    /// place.
    pub fn about(points: &[[f64; 3]]) -> atlasfit::Result<Self> {
        let (mut low, mut high) = (Vec3([f64::INFINITY; 3]), Vec3([f64::NEG_INFINITY; 3]));
        for p in points.iter().filter(|p| p.iter().all(|x| x.is_finite())) {
            low = Vec3::from_fn(|k| low[k].min(p[k]));
            high = Vec3::from_fn(|k| high[k].max(p[k]));
        }
        if low[0] > high[0] {
            return Err(atlasfit::Error::empty("a scan without a finite point", "Give points"));
        }
        let longest = (0..3).map(|k| high[k] - low[k]).fold(0.0, f64::max);
        if longest == 0.0 {
            return Err(atlasfit::Error::degenerate(
                "all points lie in one place",
                "Give points of a surface",
            ));
        }
        Ok(Self { middle: (low + high) * 0.5, longest })
    }

    /// Coordinates in the frame of up to `most` of the points, chosen by the seed.
    #[must_use]
    pub fn some(&self, points: &[[f64; 3]], most: usize, seed: u64) -> Vec<f32> {
        shuffled(points.len(), seed)
            .into_iter()
            .map(|i| Vec3(points[i as usize]))
            .filter(|p| p.0.iter().all(|x| x.is_finite()))
            .take(most)
            .flat_map(|p| ((p - self.middle) * (1.0 / self.longest)).to_f32())
            .collect()
    }

    /// A point of the frame in that of the scan.
    #[must_use]
    pub fn out(&self, p: Vec3) -> Vec3 {
        p * self.longest + self.middle
    }
}
