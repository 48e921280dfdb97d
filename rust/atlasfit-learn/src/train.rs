//! Training: epochs over a collection, a checkpoint after each, the best one kept.
//!
//! In: a recipe, a collection, a folder. Out, in the folder: `last.safetensors` (training goes on from it),
//! `best.safetensors` (the model with the lowest validation so far) and `log.csv`, all written whole after
//! each epoch; at the end `model.safetensors`, the best one in half precision. The same recipe gives the same
//! bytes for any number of threads, and when training goes on from `last.safetensors`.

use crate::adam::Adam;
use crate::checkpoint::{self, Precision};
use crate::data::{BRIGHTEST, Batch, Batches, Dataset, Split};
use crate::error::{Error, Result};
use crate::eval::{Answers, Input, chamfers};
use crate::loss::{chamfer, stretch};
use crate::model::{CHANNELS, Model};
use crate::params::Mode;
use crate::recipe::Recipe;
pub use crate::state::{Epoch, State};
use atlasfit::run::{Context, Stage};
use candle_core::{DType, Device, Tensor};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// The file that training goes on from.
pub const LAST: &str = "last.safetensors";
/// The best model so far.
pub const BEST: &str = "best.safetensors";
/// The best model in half precision, once training is over.
pub const MODEL: &str = "model.safetensors";
/// The losses, one line per epoch.
pub const LOG: &str = "log.csv";

/// What happens while a model is trained.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Event {
    /// A step was taken.
    Step {
        /// Steps of the whole training so far.
        step: usize,
        /// Steps of the whole training.
        of: usize,
        /// Mean Chamfer distance of the epoch so far.
        chamfer: f64,
        /// Time that the rest takes at this speed.
        left: Duration,
    },
    /// An epoch ended, from 1.
    Epoch(usize, Epoch),
}

/// Steps before speed is measured: the first ones start the device and its libraries.
const WARM: usize = 3;

/// What came out.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Trained {
    /// All epochs.
    pub state: State,
    /// The best model.
    pub best: PathBuf,
    /// Whether training ended before its last epoch, because validation no longer fell.
    pub early: bool,
    /// Shapes per second while training, without the first three steps, which start the device.
    pub shapes_per_second: f64,
}

/// Trains a model in a folder. With `resume` it goes on from the folder's [`LAST`]; the recipe must be the
/// same.
///
/// # Errors
/// [`Error::Diverged`] where the loss is no number: the files of the last good epoch stay.
/// [`Error::BadFile`], [`Error::Recipe`]; files that cannot be written; cancelled or out of time.
pub fn train(
    recipe: &Recipe,
    data: &Dataset,
    folder: &Path,
    resume: bool,
    device: &Device,
    ctx: &Context<'_>,
    watch: &mut dyn FnMut(Event),
) -> Result<Trained> {
    recipe.validate()?;
    check(recipe, data)?;
    let mut run = Training::begin(recipe, folder, resume, device)?;
    let validation = Answers::read(data, Split::Validate)?;
    let per_epoch = data.len(Split::Train) / recipe.train.batch;
    let first = run.state.epochs.len();
    let total = recipe.train.epochs;
    ctx.stage(Stage::Fit, total.saturating_sub(first) * per_epoch);
    let (started, mut steps, mut warming) = (Instant::now(), 0usize, Duration::ZERO);
    let mut spent = Duration::ZERO;
    let mut early = run.is_stale();
    for epoch in first..total {
        if early {
            break;
        }
        let rate = recipe.train.rate * 0.5f64.powi((epoch / recipe.train.halve_every) as i32);
        let batches =
            Batches::new(data, recipe.train.batch, recipe.train.points, recipe.train.seed, epoch as u64);
        let (mut sums, mut n) = ([0.0; 2], 0.0);
        let began = Instant::now();
        for batch in batches {
            ctx.check()?;
            let losses = run.step(&batch?, rate, ctx).map_err(|e| run.explain(e, epoch, folder))?;
            n += 1.0;
            steps += 1;
            if steps == WARM {
                warming = spent + began.elapsed();
            }
            (0..2).for_each(|k| sums[k] += losses[k]);
            ctx.advance(1);
            let of = (total - first) * per_epoch;
            let each = started.elapsed().as_secs_f64() / steps as f64;
            let left = Duration::from_secs_f64(each * of.saturating_sub(steps) as f64);
            watch(Event::Step {
                step: first * per_epoch + steps,
                of: total * per_epoch,
                chamfer: sums[0] / n,
                left,
            });
        }
        spent += began.elapsed();
        let validated = run.validate(&validation, ctx);
        let [from_points, from_image] = validated.map_err(|e| run.explain(e, epoch, folder))?;
        let row = Epoch { chamfer: sums[0] / n, stretch: sums[1] / n, from_points, from_image, rate };
        run.state.epochs.push(row);
        run.write(folder, ctx)?;
        watch(Event::Epoch(epoch + 1, row));
        early = run.is_stale() && epoch + 1 < total;
    }
    let best = checkpoint::load(&folder.join(BEST), device)?;
    checkpoint::save(&folder.join(MODEL), &best.model, recipe, None, Precision::Half, &ctx.stop())?;
    Ok(Trained {
        state: run.state,
        best: folder.join(BEST),
        early,
        shapes_per_second: (steps.saturating_sub(WARM) * recipe.train.batch) as f64
            / (spent - warming).as_secs_f64().max(1e-9),
    })
}

/// Fails where the collection is none for the recipe.
fn check(recipe: &Recipe, data: &Dataset) -> Result<()> {
    let made = &data.manifest.recipe;
    if recipe.model.encoder.image() && made.image_side != recipe.model.image_side {
        return Err(Error::recipe(
            format!(
                "model.image_side is {}, the data's pictures have {}",
                recipe.model.image_side, made.image_side
            ),
            "Make the data anew, or change the recipe",
        ));
    }
    if data.len(Split::Train) < recipe.train.batch || data.len(Split::Validate) == 0 {
        return Err(Error::recipe(
            format!(
                "train.batch is {}, and the data have {} shapes to train and {} to validate",
                recipe.train.batch,
                data.len(Split::Train),
                data.len(Split::Validate)
            ),
            "Make more shapes, or smaller batches",
        ));
    }
    Ok(())
}

struct Training {
    recipe: Recipe,
    model: Model,
    adam: Adam,
    state: State,
}

impl Training {
    fn begin(recipe: &Recipe, folder: &Path, resume: bool, device: &Device) -> Result<Self> {
        let last = folder.join(LAST);
        if !resume {
            std::fs::create_dir_all(folder).map_err(|e| {
                Error::bad_file(folder, format!("the folder cannot be made ({e})"), "Name another")
            })?;
            atlasfit_io::check_output(&last)?;
            let model = Model::new(&recipe.model, recipe.train.seed, device)?;
            let adam = Adam::new(&model.params)?;
            return Ok(Self { recipe: recipe.clone(), model, adam, state: State::default() });
        }
        let loaded = checkpoint::load(&last, device)?;
        let Some((adam, state)) = loaded.training else {
            return Err(Error::bad_file(
                &last,
                "it is a model without the state of a training",
                "Start anew",
            ));
        };
        // More epochs are no other training.
        let mut same = loaded.recipe.clone();
        same.train.epochs = recipe.train.epochs;
        same.train.patience = recipe.train.patience;
        if same != *recipe {
            return Err(Error::bad_file(
                &last,
                "it was trained by another recipe",
                "Resume with the recipe of its folder (recipe.toml), or start anew elsewhere",
            ));
        }
        Ok(Self { recipe: recipe.clone(), model: loaded.model, adam, state })
    }

    /// One step; Chamfer distance and stretch before it.
    fn step(&mut self, batch: &Batch, rate: f64, ctx: &Context<'_>) -> Result<[f64; 2]> {
        let (model, device) = (&self.model, self.model.device());
        let points = batch.points.len() / 3 / batch.len;
        let points = Tensor::from_slice(&batch.points, (batch.len, points, 3), device)?;
        let mut codes = Vec::new();
        codes.extend(model.encode_points(&points, Mode::Train)?);
        if model.recipe.encoder.image() {
            let side = model.recipe.image_side;
            let pictures = Tensor::from_slice(&batch.pictures, (batch.len, side, side, CHANNELS), device)?;
            let pictures = (pictures.to_dtype(DType::F32)? / BRIGHTEST)?;
            codes.extend(model.encode_pictures(&pictures, Mode::Train)?);
        }
        let samples = model.decode(&Tensor::cat(&codes, 0)?, Mode::Train)?;
        let (shapes, charts, n, _) = samples.dims4()?;
        let chamfer = chamfer(&samples.reshape((shapes, charts * n, 3))?, &points, ctx)?;
        let stretch = stretch(&samples, model.side())?;
        let loss = (&chamfer + (&stretch * self.recipe.train.stretch)?)?;
        self.adam.step(&model.params, &loss.backward()?, rate)?;
        // A GPU works through the whole step before it is asked for numbers: files keep the last good epoch.
        let numbers = Tensor::stack(&[loss, chamfer, stretch], 0)?.to_vec1::<f32>()?;
        let [loss, chamfer, stretch] = [0, 1, 2].map(|i| f64::from(numbers[i]));
        if !loss.is_finite() {
            return Err(Error::Diverged { epoch: 0, loss, kept: String::new() });
        }
        Ok([chamfer, stretch])
    }

    /// Mean Chamfer distance of the validation shapes, from points and from pictures.
    fn validate(&self, answers: &Answers, ctx: &Context<'_>) -> Result<[Option<f64>; 2]> {
        let mut out = [None; 2];
        for (k, input) in [Input::Points, Input::Image].into_iter().enumerate() {
            if input.is_taken_by(&self.model) {
                let each = chamfers(&self.model, answers, input, ctx)?;
                let mean = each.iter().sum::<f64>() / each.len().max(1) as f64;
                if !mean.is_finite() {
                    return Err(Error::Diverged { epoch: 0, loss: mean, kept: String::new() });
                }
                out[k] = Some(mean);
            }
        }
        Ok(out)
    }

    /// Whether validation has not fallen for as many epochs as the recipe waits.
    fn is_stale(&self) -> bool {
        let waits = self.recipe.train.patience;
        waits > 0 && self.state.best().is_some_and(|best| self.state.epochs.len() > best + waits)
    }

    fn write(&self, folder: &Path, ctx: &Context<'_>) -> Result<()> {
        let stop = ctx.stop();
        if self.state.best().is_some_and(|best| best + 1 == self.state.epochs.len()) {
            checkpoint::save(&folder.join(BEST), &self.model, &self.recipe, None, Precision::Single, &stop)?;
        }
        let training = Some((&self.adam, &self.state));
        checkpoint::save(&folder.join(LAST), &self.model, &self.recipe, training, Precision::Single, &stop)?;
        Ok(atlasfit_io::write_file(&folder.join(LOG), self.state.csv().as_bytes(), &stop)?)
    }

    /// An error with the epoch, and what is left on disk.
    fn explain(&self, error: Error, epoch: usize, folder: &Path) -> Error {
        let kept = match self.state.best() {
            Some(best) => format!(
                "The last good checkpoint is {}, the best one (epoch {}) {}. ",
                folder.join(LAST).display(),
                best + 1,
                folder.join(BEST).display()
            ),
            None => "There is no checkpoint yet. ".into(),
        };
        let loss = match error {
            Error::Core(atlasfit::Error::Diverged { .. }) => f64::NAN,
            Error::Diverged { loss, .. } => loss,
            other => return other,
        };
        Error::Diverged { epoch: epoch + 1, loss, kept }
    }
}
