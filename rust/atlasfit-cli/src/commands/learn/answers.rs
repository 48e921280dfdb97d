//! A model's answer to a file: a picture or a scan.

use super::job::{execute, plain};
use super::painter::Renderer;
use crate::console::{Console, RunArgs};
use crate::files::{self, InputArgs};
use anyhow::{Context as _, Result};
use atlasfit_learn::checkpoint::{self, Loaded};
use atlasfit_learn::data::{Painter as _, prepare};
use atlasfit_learn::eval::{Answer, Frame, Input, answers};
use atlasfit_learn::{Error, SMALL_MODEL};
use std::io::Read as _;
use std::path::Path;

/// The model of a file, or the one that comes with the program.
pub fn model(path: Option<&Path>, device: &str) -> Result<Loaded> {
    let device = atlasfit_learn::device(device).map_err(plain)?;
    match path {
        Some(path) => checkpoint::load(path, &device).map_err(plain),
        None => {
            checkpoint::from_bytes(SMALL_MODEL, "the program's own model".as_ref(), &device).map_err(plain)
        }
    }
}

/// Whether a file is a picture, by its first bytes.
fn is_picture(path: &Path) -> bool {
    let mut start = [0; 8];
    let read = std::fs::File::open(path).and_then(|mut f| f.read(&mut start)).unwrap_or(0);
    start[..read].starts_with(b"\x89PNG") || start[..read].starts_with(&[0xFF, 0xD8, 0xFF])
}

/// The answer to a file, with about so many samples, in the frame of the scan; that to a picture in the
/// normalised frame.
pub fn answer(
    model: &Loaded,
    path: &Path,
    samples: usize,
    read: InputArgs,
    args: &RunArgs,
    console: &Console,
) -> Result<(Answer, Input)> {
    let recipe = &model.recipe.model;
    let side = ((samples as f64 / recipe.charts as f64).sqrt().round() as usize).max(2);
    if is_picture(path) {
        let bytes = std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
        let name = path.display().to_string();
        let image =
            Renderer.read(&bytes).map_err(|what| plain(Error::bad_file(path, what, "Give a PNG or JPEG")))?;
        let pixels: Vec<f32> = prepare(&image, recipe.image_side, &name)
            .map_err(plain)?
            .into_iter()
            .map(|b| f32::from(b) / 255.0)
            .collect();
        let one = execute(args, false, console, |_| answers(&model.model, Input::Image, &pixels, 1, side))?;
        return Ok((first(one)?, Input::Image));
    }
    let loaded = files::load_as(path, read.input_format, args, console)?;
    let points = loaded.cloud.positions;
    let one = execute(args, false, console, |ctx| {
        let frame = Frame::about(&points)?;
        let flat = frame.some(&points, model.recipe.data.points, ctx.seed);
        let mut one = answers(&model.model, Input::Points, &flat, 1, side)?;
        one.iter_mut().flat_map(|a| &mut a.samples).for_each(|p| *p = frame.out(*p));
        Ok(one)
    })?;
    Ok((first(one)?, Input::Points))
}

fn first(mut answers: Vec<Answer>) -> Result<Answer> {
    answers.pop().ok_or_else(|| atlasfit::Error::internal("a model without an answer").into())
}
