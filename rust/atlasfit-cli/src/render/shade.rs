//! What all kinds of picture share: which points can be shown, the light, the average of samples to pixels.

use crate::render::canvas::{Canvas, OVER};
use crate::render::color::Rgb;
use crate::render::style::{Picture, Style};
use atlasfit::geometry::TriMesh;
use atlasfit::measure::charts;
use atlasfit::numeric::vec3::Vec3;
use atlasfit::{Context, Result};
use rayon::prelude::*;

/// Light from the upper left behind the viewer, some from all round. `n` is in the viewer's frame.
pub fn light(n: Vec3) -> f32 {
    let key = n.dot(Vec3([-0.4, 0.55, 0.85]).normalized()).max(0.0);
    let fill = n.dot(Vec3([0.8, -0.3, 0.4]).normalized()).max(0.0);
    (0.30 + 0.60 * key + 0.24 * fill) as f32
}

/// Whether a point can be shown.
pub fn finite(p: &[f64; 3]) -> bool {
    p.iter().all(|x| x.is_finite())
}

/// Samples per row, and rows of samples, of a picture.
pub fn samples(style: &Style) -> [usize; 2] {
    style.size.map(|s| s * OVER)
}

/// Chart of each face: as the file says, or as the UVs say.
pub fn chart_of_faces(mesh: &TriMesh, ctx: &Context<'_>) -> Result<Vec<u32>> {
    match &mesh.face_chart {
        Some(charts) if charts.len() == mesh.triangles.len() => Ok(charts.clone()),
        _ => Ok(charts(mesh, ctx)?.of_face),
    }
}

/// Averages samples to pixels.
pub fn finish(
    canvas: &Canvas,
    shade: impl Fn(usize) -> Rgb + Sync,
    not_shown: usize,
    ctx: &Context<'_>,
) -> Result<Picture> {
    let size = canvas.size.map(|s| s / OVER);
    let mut rgb = vec![0; 3 * size[0] * size[1]];
    rgb.par_chunks_exact_mut(3 * size[0].max(1)).enumerate().try_for_each(|(y, row)| {
        ctx.check()?;
        for (x, pixel) in row.as_chunks_mut::<3>().0.iter_mut().enumerate() {
            let mut sum = [0.0; 3];
            for dy in 0..OVER {
                for dx in 0..OVER {
                    let c = shade((y * OVER + dy) * canvas.size[0] + x * OVER + dx);
                    for k in 0..3 {
                        sum[k] += c[k].clamp(0.0, 1.0);
                    }
                }
            }
            *pixel = sum.map(|s| (255.0 * s / (OVER * OVER) as f32).round() as u8);
        }
        Ok(())
    })?;
    Ok(Picture { size, rgb, not_shown })
}
