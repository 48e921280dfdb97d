//! `atlasfit compare`: what changed between two scans of the same thing.

use crate::console::{Console, RunArgs};
use crate::files::{self, InputArgs};
use crate::number::{counted, json as number, short};
use crate::output::{self, Holds, Output, OutputArgs, Writer};
use anyhow::Result;
use atlasfit::geometry::{Attribute, ScalarKind};
use atlasfit::measure::{CompareOptions, Comparison, compare};
use atlasfit::{DenoiseOptions, Denoised, denoise};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Options of `compare`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The earlier scan: points, or a mesh whose vertices are taken as points
    before: PathBuf,
    /// The later scan, in the same frame and unit
    after: PathBuf,
    /// The later scan's denoised points to write, with the attributes "distance" (signed, from the earlier
    /// surface), "distance_uncertainty" and "significant"
    #[arg(short, long, value_name = "OUT")]
    output: Option<PathBuf>,
    /// How sure a change must be
    #[arg(long, default_value_t = CompareOptions::default().level, value_name = "LEVEL")]
    level: f64,
    /// How far the two frames may be off each other, in the scans' unit: less is no change
    #[arg(long, default_value_t = 0.0, value_name = "LENGTH")]
    registration: f64,
    /// Points farther from the earlier surface have no counterpart on it [default: a tenth of its longest
    /// side]
    #[arg(long, value_name = "LENGTH")]
    max_distance: Option<f64>,
    #[command(flatten)]
    read: InputArgs,
    #[command(flatten)]
    write: OutputArgs,
    #[command(flatten)]
    run: RunArgs,
}

/// Compares.
pub fn run(args: &Args, console: &Console) -> Result<()> {
    let out = args.output.as_deref();
    let output = out.map(|path| Output { option: "--output", path, holds: Holds::Points });
    output::check(output.as_slice(), &[&args.before, &args.after], args.write, console)?;
    let started = Instant::now();
    let fit = |path: &Path, surface: bool, share: f64| -> Result<Denoised> {
        console.part_to(share);
        let mut loaded = files::load_as(path, args.read.input_format, &args.run, console)?;
        loaded.normals_from_faces();
        let options = DenoiseOptions::default().with_uv(false).with_uncertainty(true).with_surface(surface);
        let done = denoise(&loaded.cloud, &options, &mut console.start(&args.run))?;
        let name = path.display();
        done.report.warnings.iter().for_each(|w| console.warn(format!("{name}: {w}")));
        Ok(done)
    };
    let before = fit(&args.before, true, 0.55)?;
    let mut after = fit(&args.after, false, 0.95)?;
    console.part_to(1.0);
    let options = CompareOptions::default()
        .with_level(args.level)
        .with_registration(args.registration)
        .with_max_distance(args.max_distance);
    let change =
        console.start(&args.run).execute(|ctx| compare(&before.surface, &after.points, &options, ctx))?;
    let mut writer = Writer::new(args.write, &args.run, console);
    if let Some(output) = output {
        after.points.attributes.extend(columns(&change));
        writer.cloud(output, &after.points)?;
    }
    let share = change.changed as f64 / change.compared as f64;
    let text = format!(
        "compared       {} of {}\n\
         changed        {}, {:.2} % (level {})\n\
         detectable     {} (median)\n\
         distances      rms {}, median {}\n\
         seconds        {:.1}\n",
        counted(change.compared, "point"),
        counted(change.distance.len(), "point"),
        counted(change.changed, "point"),
        100.0 * share,
        args.level,
        short(change.detectable),
        short(change.rms),
        short(change.median),
        started.elapsed().as_secs_f64(),
    );
    let json = json!({
        "before": files::text(&args.before), "after": files::text(&args.after),
        "points": change.distance.len(), "compared": change.compared, "changed": change.changed,
        "share": number(share), "level": args.level, "detectable": number(change.detectable),
        "rms": number(change.rms), "median": number(change.median),
        "seconds": number(started.elapsed().as_secs_f64()), "files": writer.written.files,
    });
    console.report(&text, &json);
    Ok(())
}

/// What changed, as columns of the points.
fn columns(change: &Comparison) -> Vec<Attribute> {
    let column = |name: &str, kind, values: Vec<f64>| Attribute { name: name.into(), width: 1, kind, values };
    let single = |values: &[f64]| values.iter().map(|v| f64::from(*v as f32)).collect();
    let flags = change.significant.iter().map(|s| f64::from(u8::from(*s))).collect();
    vec![
        column("distance", ScalarKind::F32, single(&change.distance)),
        column("distance_uncertainty", ScalarKind::F32, single(&change.uncertainty)),
        column("significant", ScalarKind::U8, flags),
    ]
}
