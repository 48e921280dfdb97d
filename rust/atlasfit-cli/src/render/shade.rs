//! What all kinds of picture share: which points can be shown, the light, the average of samples to pixels.

use crate::render::canvas::{BAND, Canvas, Drawing, OVER};
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

/// Draws, and averages samples to pixels. `shade` is given the rows of each of the drawings, `reach` more on
/// either side where the picture has them, and the column and row of a sample.
pub fn finish<const N: usize>(
    drawings: [Drawing<'_>; N],
    reach: usize,
    shade: impl Fn(&[Canvas; N], [usize; 2]) -> Rgb + Sync,
    not_shown: usize,
    ctx: &Context<'_>,
) -> Result<Picture> {
    let [width, height] = drawings[0].size;
    let size = [width / OVER, height / OVER];
    let mut rgb = vec![0; 3 * size[0] * size[1]];
    let rows_of_pixels = rgb.par_chunks_mut(3 * size[0] * (BAND / OVER));
    rows_of_pixels.zip(drawings[0].bands()).try_for_each(|(pixels, rows)| {
        let wider = rows.start.saturating_sub(reach)..(rows.end + reach).min(height);
        let mut canvases = Vec::with_capacity(N);
        for drawing in &drawings {
            canvases.push(drawing.draw(wider.clone(), ctx)?);
        }
        let Ok(canvases) = <[Canvas; N]>::try_from(canvases) else { return Ok(()) };
        for (i, row) in pixels.chunks_exact_mut(3 * size[0]).enumerate() {
            ctx.check()?;
            let y = rows.start + OVER * i;
            for (x, pixel) in row.as_chunks_mut::<3>().0.iter_mut().enumerate() {
                let mut sum = [0.0; 3];
                for dy in 0..OVER {
                    for dx in 0..OVER {
                        let c = shade(&canvases, [x * OVER + dx, y + dy]);
                        for k in 0..3 {
                            sum[k] += c[k].clamp(0.0, 1.0);
                        }
                    }
                }
                *pixel = sum.map(|s| (255.0 * s / (OVER * OVER) as f32).round() as u8);
            }
        }
        Ok(())
    })?;
    Ok(Picture { size, rgb, not_shown })
}
