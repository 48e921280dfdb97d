//! `atlasfit learn train`.

use super::args::Train;
use super::job::{execute, plain};
use super::painter::Renderer;
use super::{curves, data};
use crate::console::Console;
use crate::files;
use crate::number::{json as number, short};
use anyhow::{Context as _, Result};
use atlasfit_learn::data::{Dataset, Split, generate};
use atlasfit_learn::eval::constant;
use atlasfit_learn::model::Model;
use atlasfit_learn::recipe::Recipe;
use atlasfit_learn::train::{Event, train};
use serde_json::json;
use std::time::{Duration, Instant};

/// How often a line says where training stands.
const EVERY: Duration = Duration::from_secs(10);

/// The collection: the given one, or one of the folder's own, made where it is not there yet.
fn collection(args: &Train, recipe: &Recipe, console: &Console) -> Result<Dataset> {
    if let Some(folder) = &args.data {
        return Dataset::open(folder).map_err(plain);
    }
    let folder = args.output.join("data");
    if let Ok(data) = Dataset::open(&folder)
        && data.manifest.recipe == recipe.data
    {
        return Ok(data);
    }
    execute(&args.run, true, console, |ctx| generate(&recipe.data, &folder, &Renderer, ctx))?;
    Dataset::open(&folder).map_err(plain)
}

/// Minutes and seconds.
fn clock(time: Duration) -> String {
    let s = time.as_secs();
    format!("{}:{:02}", s / 60, s % 60)
}

/// Trains.
pub fn run(args: &Train, console: &Console) -> Result<()> {
    let mut recipe = data::recipe(&args.recipe)?;
    recipe.train.seed = recipe.train.seed.wrapping_add(args.run.seed);
    let device = atlasfit_learn::device(&args.device.device).map_err(plain)?;
    let collection = collection(args, &recipe, console)?;
    std::fs::create_dir_all(&args.output)
        .with_context(|| format!("cannot make {}", args.output.display()))?;
    let counts = Model::new(&recipe.model, recipe.train.seed, &device).map_err(|e| plain(e.into()))?;
    let (counts, count) = (counts.counts(), counts.params.count());
    console.tell_progress(format_args!(
        "{count} parameters: encoders {} of points and {} of images, decoder {}; the paper's ConvAtlas has 14.5 \
         million, its AtlasNet 42.6",
        counts.points, counts.image, counts.decoder
    ));
    let side = match recipe.model.decoder {
        atlasfit_learn::recipe::Decoder::AtlasNet => recipe.model.side,
        atlasfit_learn::recipe::Decoder::ConvAtlas => 32,
    };
    let samples = recipe.model.charts * side * side;
    let flat =
        execute(&args.run, false, console, |ctx| constant(&collection, Split::Validate, samples, ctx))?;
    console.tell_progress(format_args!("validation of the constant answer: {}", short(flat)));
    files::write(&args.output.join("recipe.toml"), recipe.text().map_err(plain)?)?;
    let started = Instant::now();
    let mut told = started;
    let done = execute(&args.run, false, console, |ctx| {
        train(&recipe, &collection, &args.output, args.resume, &device, ctx, &mut |event| match event {
            Event::Step { step, of, chamfer, left } if told.elapsed() >= EVERY => {
                told = Instant::now();
                let left = clock(left);
                let chamfer = short(chamfer);
                console.tell_progress(format_args!("step {step}/{of}: {chamfer} ({left} left)"));
            }
            Event::Epoch(epoch, row) => {
                told = Instant::now();
                console.tell_progress(format_args!(
                    "epoch {epoch}/{}: training {}, stretch {}, validation {} ({})",
                    recipe.train.epochs,
                    short(row.chamfer),
                    short(row.stretch),
                    short(row.validation()),
                    clock(started.elapsed())
                ));
            }
            _ => {}
        })
    })?;
    if done.early {
        console.note("training ended early: validation no longer falls");
    }
    let (state, path) = (done.state.clone(), args.output.join("curves.png"));
    let png = console.apart(&args.run, "drawing the curves", move || {
        crate::commands::render::png(&curves::figure(&state, flat).picture()?)
    })??;
    files::write(&path, png)?;
    let best = done.state.best().unwrap_or(0);
    let Some(row) = done.state.epochs.get(best) else { return Ok(()) };
    let text = format!(
        "{}: epoch {} of {}, validation {}, {:.0} % of the constant answer's {}; {:.0} shapes/s\n",
        done.best.display(),
        best + 1,
        done.state.epochs.len(),
        short(row.validation()),
        100.0 * row.validation() / flat,
        short(flat),
        done.shapes_per_second
    );
    let json = json!({
        "model": files::text(&done.best), "epoch": best + 1, "epochs": done.state.epochs.len(),
        "parameters": count, "validation": number(row.validation()),
        "validation_points": row.from_points.map(number), "validation_image": row.from_image.map(number),
        "constant": number(flat), "seconds": started.elapsed().as_secs_f64(),
        "shapes_per_second": number(done.shapes_per_second), "curves": files::text(&path),
    });
    console.report(&text, &json);
    Ok(())
}
