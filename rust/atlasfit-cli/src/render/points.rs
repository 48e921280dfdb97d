//! Points as discs.

use crate::render::camera::Camera;
use crate::render::canvas::{Canvas, NOTHING, OVER, Primitive};
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
    let canvas = Canvas::draw(size, &primitives, ctx)?;
    let colors = mesh.colors.as_ref().filter(|_| style.colors);
    let near = canvas.depth.iter().copied().fold(f32::INFINITY, f32::min);
    let far = canvas.depth.iter().copied().filter(|d| d.is_finite()).fold(near, f32::max);
    let shade = |at: usize| -> Rgb {
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
                scaled(base, eye_dome(&canvas, at) * (1.05 - 0.3 * fog))
            }
        }
    };
    finish(&canvas, shade, mesh.positions.len() - shown.len(), ctx)
}

/// How much of its brightness a sample keeps: less where its neighbours stand nearer to the viewer. Shows
/// shape without normals (Boucheny 2009, "Eye-dome lighting").
fn eye_dome(canvas: &Canvas, at: usize) -> f32 {
    let (x, y) = ((at % canvas.size[0]) as isize, (at / canvas.size[0]) as isize);
    let reach = 2 * OVER as isize;
    let mut sum = 0.0;
    for (dx, dy) in [(-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (1, 1), (-1, 1), (1, -1)] {
        let (px, py) = (x + reach * dx, y + reach * dy);
        if px < 0 || py < 0 || px >= canvas.size[0] as isize || py >= canvas.size[1] as isize {
            continue;
        }
        let other = canvas.depth[py as usize * canvas.size[0] + px as usize];
        if other.is_finite() {
            sum += (canvas.depth[at] - other).clamp(0.0, 0.05);
        }
    }
    (-10.0 * sum).exp()
}
