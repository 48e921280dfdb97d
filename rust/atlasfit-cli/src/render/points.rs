//! Points as discs.

use crate::render::camera::Camera;
use crate::render::canvas::{Canvas, Drawing, NOTHING, OVER, Primitive};
use crate::render::color::{BACK, BACKGROUND, FRONT, Rgb, mix, scaled};
use crate::render::shade::{finish, finite, light, samples};
use crate::render::style::{Picture, Style};
use atlasfit::geometry::TriMesh;
use atlasfit::numeric::vec3::Vec3;
use atlasfit::{Context, Result};
use rayon::prelude::*;

/// Draws the vertices of a mesh as discs: in the light where they have normals, else darker with depth.
pub fn points(mesh: &TriMesh, style: &Style, ctx: &Context<'_>) -> Result<Picture> {
    let size = samples(style);
    let shown: Vec<u32> =
        (0..mesh.positions.len() as u32).filter(|&i| finite(&mesh.positions[i as usize])).collect();
    let seen: Vec<Vec3> = shown.iter().map(|&i| Vec3(mesh.positions[i as usize])).collect();
    let camera = Camera::fit(&seen, style.view, style.up, size);
    // By default discs have the size with which they would cover the picture twice if they were spread evenly
    // over it: a surface then shows no gaps.
    let area = (size[0] * size[1]) as f64;
    let even = (2.0 * area / seen.len().max(1) as f64).sqrt().clamp(1.0, 12.0 * OVER as f64);
    let radius = 0.5 * style.point_size.map_or(even, |d| d * OVER as f64) as f32;
    let bulge = radius * camera.depth_per_pixel();
    let primitives: Vec<Primitive> = seen
        .par_iter()
        .map(|p| Primitive::Disc { centre: camera.project(*p), radius: radius.max(0.5), bulge })
        .collect();
    let drawing = Drawing::new(size, &primitives, ctx)?;
    let colors = mesh.colors.as_ref().filter(|_| style.colors);
    // In the light nothing depends on depth, nor on the samples beside.
    let lit = mesh.normals.is_some();
    let [near, far] = if lit { [0.0; 2] } else { depths(&drawing, ctx)? };
    let shade = |[canvas]: &[Canvas; 1], sample: [usize; 2]| -> Rgb {
        let at = canvas.at(sample);
        if canvas.id[at] == NOTHING {
            return BACKGROUND;
        }
        let point = shown[canvas.id[at] as usize] as usize;
        let base = colors.map_or(FRONT, |c| [c[point][0], c[point][1], c[point][2]]);
        match &mesh.normals {
            Some(normals) => {
                let n = camera.turn(Vec3(normals[point].map(f64::from))).normalized();
                let lit = if n[2] >= 0.0 { base } else { mix(base, BACK, 1.0) };
                scaled(lit, light(if n[2] >= 0.0 { n } else { n.map(|x| -x) }))
            }
            None => {
                let fog = (canvas.depth[at] - near) / (far - near).max(1e-12);
                scaled(base, eye_dome(canvas, sample) * (1.05 - 0.3 * fog))
            }
        }
    };
    let reach = if lit { 0 } else { REACH };
    finish([drawing], reach, shade, mesh.positions.len() - shown.len(), ctx)
}

/// The least and the greatest depth of all that is seen.
fn depths(drawing: &Drawing<'_>, ctx: &Context<'_>) -> Result<[f32; 2]> {
    let both = |[a, b]: [f32; 2], [c, d]: [f32; 2]| [a.min(c), b.max(d)];
    let nothing = [f32::INFINITY, f32::NEG_INFINITY];
    let band = |rows| {
        let seen = drawing.draw(rows, ctx)?.depth.into_iter().filter(|d| d.is_finite());
        Ok(seen.fold(nothing, |range, d| both(range, [d, d])))
    };
    let [near, far] =
        (drawing.bands().into_par_iter().map(band)).try_reduce(|| nothing, |a, b| Ok(both(a, b)))?;
    Ok([near, far.max(near)])
}

/// How far away the samples are that [`eye_dome`] looks at.
const REACH: usize = 2 * OVER;

/// How much of its brightness a sample keeps: less where its neighbours stand nearer to the viewer. Shows
/// shape without normals (Boucheny 2009, "Eye-dome lighting").
fn eye_dome(canvas: &Canvas, sample: [usize; 2]) -> f32 {
    let [x, y] = sample.map(|k| k as isize);
    let (reach, depth) = (REACH as isize, canvas.depth[canvas.at(sample)]);
    let (first, end) = (canvas.rows.start as isize, canvas.rows.end as isize);
    let mut sum = 0.0;
    for (dx, dy) in [(-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (1, 1), (-1, 1), (1, -1)] {
        let (px, py) = (x + reach * dx, y + reach * dy);
        if px < 0 || px >= canvas.width as isize || py < first || py >= end {
            continue;
        }
        let other = canvas.depth[canvas.at([px as usize, py as usize])];
        if other.is_finite() {
            sum += (depth - other).clamp(0.0, 0.05);
        }
    }
    (-10.0 * sum).exp()
}
