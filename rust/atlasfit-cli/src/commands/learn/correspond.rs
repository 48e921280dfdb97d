//! `atlasfit learn correspond`: two answers of a model, in the same colours where their charts' places are
//! the same.

use super::answers::{answer, model};
use super::args::Correspond;
use crate::console::Console;
use crate::files;
use crate::output::{self, Holds, Output, OutputArgs, Writer};
use crate::render::{Mode, Picture, Style, camera::Up, render};
use anyhow::Result;
use atlasfit::geometry::TriMesh;
use atlasfit::numeric::vec3::{self, Vec3};
use atlasfit_learn::eval::Answer;
use serde_json::json;

/// Samples of each answer.
const SAMPLES: usize = 8192;
/// Side of one answer's picture, in pixels.
const SIDE: usize = 640;

/// Colours of samples: the hue by the distance from the middle, as in the paper.
fn colors(reference: &Answer) -> Vec<[f32; 4]> {
    let n = reference.samples.len().max(1) as f64;
    let middle = reference.samples.iter().fold(Vec3::ZERO, |a, b| a + *b) * (1.0 / n);
    let away: Vec<f64> = reference.samples.iter().map(|p| p.dist2(middle).sqrt()).collect();
    let farthest = away.iter().fold(f64::MIN_POSITIVE, |a, b| a.max(*b));
    // From red to violet, so that the ends differ.
    away.iter().map(|d| hue(0.8 * d / farthest)).collect()
}

fn hue(h: f64) -> [f32; 4] {
    let channel = |shift: f64| {
        let x = ((h + shift).fract() * 6.0 - 3.0).abs() - 1.0;
        (0.15 + 0.8 * x.clamp(0.0, 1.0)) as f32
    };
    [channel(0.0), channel(2.0 / 3.0), channel(1.0 / 3.0), 1.0]
}

/// Draws both.
pub fn run(args: &Correspond, console: &Console) -> Result<()> {
    let output = Output { option: "--output", path: &args.output, holds: Holds::Picture };
    let write = OutputArgs { output_format: None, ascii: false, force: false };
    let inputs: Vec<_> = args.inputs.iter().map(std::path::PathBuf::as_path).collect();
    output::check(&[output], &inputs, write, console)?;
    let loaded = model(args.model.as_deref(), &args.device.device)?;
    let mut both = Vec::new();
    for input in &args.inputs {
        both.push(answer(&loaded, input, SAMPLES, args.read, &args.run, console)?.0);
    }
    let colors = colors(&both[0]);
    let style = Style {
        mode: Mode::Points,
        view: args.view,
        up: Up::Y,
        size: [SIDE; 2],
        flat: false,
        boundary: false,
        colors: true,
        point_size: None,
    };
    let mut pictures = Vec::new();
    for answer in both {
        let mut mesh = TriMesh::new(vec3::plain(answer.samples), Vec::new());
        mesh.colors = Some(colors.clone());
        pictures.push(console.start_silent(&args.run).execute(|ctx| render(&mesh, None, &style, ctx))?);
    }
    let rows = |k: usize| pictures[k].rgb.chunks_exact(3 * SIDE);
    let rgb = rows(0).zip(rows(1)).flat_map(|(a, b)| a.iter().chain(b)).copied().collect();
    let picture = Picture { size: [2 * SIDE, SIDE], rgb, not_shown: 0 };
    let bytes = console
        .apart(&args.run, "encoding the picture", move || crate::commands::render::png(&picture))??;
    Writer::new(write, &args.run, console).bytes(output, &bytes)?;
    let text = format!("{}\n", args.output.display());
    console.report(&text, &json!({ "file": files::text(&args.output) }));
    Ok(())
}
