//! `atlasfit learn reconstruct`.

use super::answers::{answer, model};
use super::args::Reconstruct;
use crate::console::Console;
use crate::files;
use crate::number::counted;
use crate::output::{self, Holds, Output, Writer};
use anyhow::Result;
use atlasfit::geometry::{PointCloud, TriMesh};
use atlasfit::numeric::vec3;
use atlasfit::{DenoiseOptions, denoise};
use atlasfit_learn::eval::{Answer, charts};
use serde_json::json;
use std::time::Instant;

/// From a picture or a scan a mesh.
pub fn run(args: &Reconstruct, console: &Console) -> Result<()> {
    let output = Output { option: "--output", path: &args.output, holds: Holds::Faces };
    output::check(&[output], &[&args.input], args.write, console)?;
    let started = Instant::now();
    let loaded = model(args.model.as_deref(), &args.device.device)?;
    let samples = args.samples as usize;
    let (answer, from) = answer(&loaded, &args.input, samples, args.read, &args.run, console)?;
    let mesh = if args.charts { charts(&answer) } else { stitched(answer, args, console)? };
    let mut writer = Writer::new(args.write, &args.run, console);
    writer.mesh(output, &mesh, None, None, |_| false)?;
    let written = writer.written;
    let text = format!(
        "{}: {}, from {}, {:.1} s\n",
        written.files.join(", "),
        counted(mesh.triangles.len(), "face"),
        from.name(),
        started.elapsed().as_secs_f64()
    );
    let json = json!({
        "input": files::text(&args.input), "from": from.name(), "faces": mesh.triangles.len(),
        "vertices": mesh.positions.len(), "seconds": started.elapsed().as_secs_f64(), "files": written.files,
    });
    console.report(&text, &json);
    Ok(())
}

/// One surface with UVs: the samples of the charts are a scan, which is denoised as any other.
fn stitched(answer: Answer, args: &Reconstruct, console: &Console) -> Result<TriMesh> {
    let cloud = PointCloud::from_positions(vec3::plain(answer.samples));
    let done = denoise(&cloud, &DenoiseOptions::default(), &mut console.start(&args.run))?;
    done.report.warnings.iter().for_each(|w| console.warn(w));
    Ok(done.surface)
}
