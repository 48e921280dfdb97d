//! A small software renderer: people and tests look at results with it.
//!
//! In: a mesh (without triangles: its points) and a [`Style`]. Out: RGB pixels. Everything is drawn at [`canvas::OVER`]
//! times the size and averaged.

pub mod camera;
pub mod canvas;
mod color;

use atlasfit::bake::Image;
use atlasfit::geometry::TriMesh;
use atlasfit::measure::charts;
use atlasfit::numeric::vec3::{self, Vec3};
use atlasfit::spatial::edges::Edges;
use atlasfit::spatial::weld::weld;
use atlasfit::{Context, Error, Result};
use camera::{Camera, Up, View};
use canvas::{Canvas, NOTHING, OVER, Primitive, Weights};
pub use color::chart_color;
use color::{Rgb, mix, scaled};
use rayon::prelude::*;

/// What to show.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Mode {
    /// The surface with light; back faces are orange.
    Shaded,
    /// The vertices as discs.
    Points,
    /// UV charts in colours.
    Charts,
    /// A checker texture through the UVs.
    Checker,
    /// The UV layout: charts in colours, flipped faces black, overlaps red.
    Uv,
    /// The surface with its edges.
    Wire,
}

/// How to show it.
#[derive(Debug, Clone, Copy)]
pub struct Style {
    /// What to show.
    pub mode: Mode,
    /// From where.
    pub view: View,
    /// The vertical axis.
    pub up: Up,
    /// Width and height in pixels.
    pub size: [usize; 2],
    /// One normal per face instead of smooth ones.
    pub flat: bool,
    /// Boundary edges in red, edges with more than two faces in magenta.
    pub boundary: bool,
    /// Use the file's colours.
    pub colors: bool,
    /// Diameter of a point in pixels; `None` = by the number of points.
    pub point_size: Option<f64>,
}

/// A picture.
pub struct Picture {
    /// Width and height in pixels.
    pub size: [usize; 2],
    /// Red, green, blue, row after row.
    pub rgb: Vec<u8>,
    /// Faces or points that were not finite and are not shown.
    pub not_shown: usize,
}

const BACKGROUND: Rgb = [1.0, 1.0, 1.0];
const FRONT: Rgb = [0.74, 0.77, 0.80];
const BACK: Rgb = [0.93, 0.55, 0.25];
const LINE: Rgb = [0.15, 0.15, 0.2];
const BOUNDARY: Rgb = [0.90, 0.05, 0.05];
const NON_MANIFOLD: Rgb = [0.90, 0.0, 0.90];
const FLIPPED: Rgb = [0.0, 0.0, 0.0];
const OVERLAP: Rgb = [1.0, 0.0, 0.0];
/// Squares of the checker along each side of the texture.
const SQUARES: f32 = 64.0;

/// Draws a mesh, in the light with its texture if there is one. Modes that need UVs or faces fail without them.
pub fn render(mesh: &TriMesh, texture: Option<&Image>, style: &Style, ctx: &Context<'_>) -> Result<Picture> {
    mesh.validate()?;
    match style.mode {
        Mode::Points => Ok(points(mesh, style)),
        _ if mesh.triangles.is_empty() => Err(Error::EmptyInput {
            what: "there are no faces to show".into(),
            advice: "Show the points (--mode points)".into(),
        }),
        Mode::Uv => uv_layout(mesh, style, ctx),
        _ => surface(mesh, texture, style, ctx),
    }
}

/// Light from the upper left behind the viewer, some from all round. `n` is in the viewer's frame.
fn light(n: Vec3) -> f32 {
    let key = n.dot(Vec3([-0.4, 0.55, 0.85]).normalized()).max(0.0);
    let fill = n.dot(Vec3([0.8, -0.3, 0.4]).normalized()).max(0.0);
    (0.30 + 0.60 * key + 0.24 * fill) as f32
}

fn finite(p: &[f64; 3]) -> bool {
    p.iter().all(|x| x.is_finite())
}

fn samples(style: &Style) -> [usize; 2] {
    style.size.map(|s| s * OVER)
}

fn surface(mesh: &TriMesh, texture: Option<&Image>, style: &Style, ctx: &Context<'_>) -> Result<Picture> {
    let size = samples(style);
    let shown: Vec<u32> = (0..mesh.triangles.len() as u32)
        .filter(|&i| mesh.triangles[i as usize].iter().all(|&v| finite(&mesh.positions[v as usize])))
        .collect();
    let seen: Vec<Vec3> = shown
        .iter()
        .flat_map(|&i| mesh.triangles[i as usize].map(|v| Vec3(mesh.positions[v as usize])))
        .collect();
    let camera = Camera::fit(&seen, style.view, style.up, size);
    let mut primitives: Vec<Primitive> = seen
        .par_chunks_exact(3)
        .map(|c| Primitive::Triangle([c[0], c[1], c[2]].map(|p| camera.project(p))))
        .collect();
    let faces = primitives.len();
    let chart = if style.mode == Mode::Charts { chart_of_faces(mesh, ctx)? } else { Vec::new() };
    if style.mode == Mode::Checker {
        charts(mesh, ctx)?; // says what is missing
    }
    ctx.check()?;

    // Lines lie two pixels before the surface, so that it does not swallow them.
    let bias = 2.0 * OVER as f32 * camera.depth_per_pixel();
    let mut line_color = Vec::new();
    let mut line = |a: u32, b: u32, width: f32, color: Rgb| {
        let ends = [a, b].map(|v| {
            let [x, y, z] = camera.project(Vec3(mesh.positions[v as usize]));
            [x, y, z - bias]
        });
        primitives.push(Primitive::Line(ends, 0.5 * width * OVER as f32));
        line_color.push(color);
    };
    let place = weld(vec3::of(&mesh.positions), 0.0, ctx)?;
    let welded: Vec<[u32; 3]> = mesh.triangles.iter().map(|t| t.map(|v| place[v as usize])).collect();
    let lines = style.boundary || matches!(style.mode, Mode::Wire | Mode::Charts);
    let edges = Edges::new(if lines { &welded } else { &[] }, ctx)?;
    for edge in edges.iter() {
        let (a, b) = ((edge[0].0 >> 32) as u32, edge[0].0 as u32);
        let chart_of = |h: &(u64, u32)| chart[h.1 as usize / 3];
        match edge.len() {
            1 if style.boundary => line(a, b, 2.2, BOUNDARY),
            3.. if style.boundary => line(a, b, 2.2, NON_MANIFOLD),
            _ if style.mode == Mode::Wire => line(a, b, 0.6, LINE),
            _ if style.mode == Mode::Charts
                && edge.windows(2).any(|w| chart_of(&w[0]) != chart_of(&w[1])) =>
            {
                line(a, b, 1.2, LINE);
            }
            _ => {}
        }
    }
    ctx.check()?;

    let face_normals: Vec<Vec3> = shown
        .par_iter()
        .map(|&i| {
            let [a, b, c] = mesh.triangles[i as usize].map(|v| Vec3(mesh.positions[v as usize]));
            (b - a).cross(c - a)
        })
        .collect();
    let smooth = (!style.flat).then(|| {
        let mut sums = vec![Vec3::ZERO; mesh.positions.len()];
        for (&i, n) in shown.iter().zip(&face_normals) {
            for v in mesh.triangles[i as usize] {
                sums[v as usize] += *n;
            }
        }
        sums.into_par_iter().map(Vec3::normalized).collect::<Vec<_>>()
    });
    let vertex_colors = mesh.colors.as_ref().filter(|_| style.colors && style.mode == Mode::Shaded);

    let texture = texture.filter(|_| style.colors && style.mode == Mode::Shaded).zip(mesh.corner_uv.as_ref());

    let canvas = Canvas::draw(size, &primitives);
    let shade = |at: usize| -> Rgb {
        let id = canvas.id[at] as usize;
        if canvas.id[at] == NOTHING {
            return BACKGROUND;
        }
        if id >= faces {
            return line_color[id - faces];
        }
        let Primitive::Triangle(t) = &primitives[id] else { return BACKGROUND };
        let w = Weights::new(t).map_or([1.0, 0.0, 0.0], |weights| {
            weights.at((at % size[0]) as f32 + 0.5, (at / size[0]) as f32 + 0.5)
        });
        let face = shown[id] as usize;
        let corners = mesh.triangles[face];
        let flat = camera.turn(face_normals[id]).normalized();
        let front = flat[2] >= 0.0;
        let mut n = match &smooth {
            Some(normals) => {
                let sum = Vec3::from_fn(|k| {
                    (0..3).map(|c| f64::from(w[c]) * normals[corners[c] as usize][k]).sum()
                });
                camera.turn(sum).normalized()
            }
            None => flat,
        };
        // Light falls on the side that is seen.
        if n[2] * flat[2] < 0.0 || n == Vec3::ZERO {
            n = flat;
        }
        if n[2] < 0.0 {
            n = n.map(|x| -x);
        }
        let mut base = match style.mode {
            Mode::Charts => chart_color(chart[face]),
            Mode::Checker => mesh.corner_uv.as_ref().map_or(FRONT, |uv| {
                let [u, v] = [0, 1].map(|k| (0..3).map(|c| w[c] * uv[face][c][k]).sum::<f32>());
                checker(u, v)
            }),
            _ => match (texture, vertex_colors) {
                (Some((image, uv)), _) => {
                    let [u, v] = [0, 1].map(|k| (0..3).map(|c| w[c] * uv[face][c][k]).sum::<f32>());
                    look_up(image, u, v)
                }
                (None, Some(colors)) => {
                    std::array::from_fn(|k| (0..3).map(|c| w[c] * colors[corners[c] as usize][k]).sum())
                }
                (None, None) => FRONT,
            },
        };
        if !front {
            base = mix(
                base,
                BACK,
                if style.mode == Mode::Shaded || style.mode == Mode::Wire { 1.0 } else { 0.5 },
            );
        }
        scaled(base, light(n))
    };
    Ok(finish(&canvas, shade, mesh.triangles.len() - shown.len()))
}

/// The texture at a point, between texels; it repeats outside of [0, 1].
fn look_up(image: &Image, u: f32, v: f32) -> Rgb {
    let at = |t: f32, n: u32| {
        let x = t * n as f32 - 0.5;
        let low = x.floor();
        let index = |i: f32| i.rem_euclid(n as f32) as usize % n as usize;
        (index(low), index(low + 1.0), x - low)
    };
    let ((x0, x1, fx), (y0, y1, fy)) = (at(u, image.width), at(1.0 - v, image.height));
    let texel = |x: usize, y: usize| image.rgba[y * image.width as usize + x];
    let (a, b, c, d) = (texel(x0, y0), texel(x1, y0), texel(x0, y1), texel(x1, y1));
    std::array::from_fn(|k| {
        let across = |p: [u8; 4], q: [u8; 4]| f32::from(p[k]) * (1.0 - fx) + f32::from(q[k]) * fx;
        (across(a, b) * (1.0 - fy) + across(c, d) * fy) / 255.0
    })
}

fn checker(u: f32, v: f32) -> Rgb {
    let odd = ((u * SQUARES).floor() + (v * SQUARES).floor()).rem_euclid(2.0) >= 1.0;
    // The tint tells places of the texture apart.
    let tint = [0.95 - 0.35 * u.clamp(0.0, 1.0), 0.75, 0.60 + 0.35 * v.clamp(0.0, 1.0)];
    if odd { tint } else { scaled(tint, 0.35) }
}

fn points(mesh: &TriMesh, style: &Style) -> Picture {
    let size = samples(style);
    let shown: Vec<u32> =
        (0..mesh.positions.len() as u32).filter(|&i| finite(&mesh.positions[i as usize])).collect();
    let seen: Vec<Vec3> = shown.iter().map(|&i| Vec3(mesh.positions[i as usize])).collect();
    let camera = Camera::fit(&seen, style.view, style.up, size);
    // By default discs that would cover the picture twice if they were spread evenly over it: a surface then closes.
    let area = (size[0] * size[1]) as f64;
    let even = (2.0 * area / seen.len().max(1) as f64).sqrt().clamp(1.0, 12.0 * OVER as f64);
    let radius = 0.5 * style.point_size.map_or(even, |d| d * OVER as f64) as f32;
    let bulge = radius * camera.depth_per_pixel();
    let primitives: Vec<Primitive> =
        seen.par_iter().map(|p| Primitive::Disc(camera.project(*p), radius.max(0.5), bulge)).collect();
    let canvas = Canvas::draw(size, &primitives);
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
    finish(&canvas, shade, mesh.positions.len() - shown.len())
}

/// Darkens a sample by how far its neighbours stand before it: shape without normals (Boucheny 2009, "Eye-dome
/// lighting").
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

fn uv_layout(mesh: &TriMesh, style: &Style, ctx: &Context<'_>) -> Result<Picture> {
    let uv = mesh.corner_uv.as_deref().unwrap_or_default();
    let size = samples(style);
    // The unit square with a margin of 2%, v up, without distortion.
    let side = 0.96 * size[0].min(size[1]) as f32;
    let place = |p: [f32; 2], z: f32| {
        [0.5 * size[0] as f32 + (p[0] - 0.5) * side, 0.5 * size[1] as f32 - (p[1] - 0.5) * side, z]
    };
    let charts = charts(mesh, ctx)?;
    let color_of = chart_of_faces(mesh, ctx)?;
    let area = |c: &[[f32; 2]; 3]| {
        (c[1][0] - c[0][0]) * (c[2][1] - c[0][1]) - (c[1][1] - c[0][1]) * (c[2][0] - c[0][0])
    };
    let mut majority = vec![0.0; charts.count];
    for (c, chart) in uv.iter().zip(&charts.of_face) {
        majority[*chart as usize] += f64::from(area(c));
    }
    let mut primitives: Vec<Primitive> =
        uv.iter().map(|c| Primitive::Triangle(c.map(|p| place(p, 0.0)))).collect();
    let mut colors: Vec<Rgb> = (0..uv.len())
        .map(|i| {
            let flipped = f64::from(area(&uv[i])) * majority[charts.of_face[i] as usize] < 0.0;
            if flipped { FLIPPED } else { chart_color(color_of[i]) }
        })
        .collect();
    // The first face drawn at a sample stays; drawn in reverse order it is the last. Where the two differ, faces overlap.
    let reversed: Vec<Primitive> = primitives.iter().rev().copied().collect();
    let (first, last) = (Canvas::draw(size, &primitives), Canvas::draw(size, &reversed));
    let faces = primitives.len();
    let mut line = |a: [f32; 2], b: [f32; 2], width: f32, z: f32, color: Rgb| {
        primitives.push(Primitive::Line([place(a, z), place(b, z)], 0.5 * width * OVER as f32));
        colors.push(color);
    };
    for &h in &charts.outline {
        let (c, k) = (&uv[h as usize / 3], h as usize % 3);
        line(c[k], c[(k + 1) % 3], 1.0, -0.5, LINE);
    }
    for (a, b) in [
        ([0.0, 0.0], [1.0, 0.0]),
        ([1.0, 0.0], [1.0, 1.0]),
        ([1.0, 1.0], [0.0, 1.0]),
        ([0.0, 1.0], [0.0, 0.0]),
    ] {
        line(a, b, 1.0, -1.0, [0.5, 0.5, 0.5]);
    }
    let canvas = Canvas::draw(size, &primitives);
    let shade = |at: usize| -> Rgb {
        let id = canvas.id[at];
        if id == NOTHING {
            return BACKGROUND;
        }
        let twice = (id as usize) < faces && {
            let (a, b) = (first.id[at] as usize, faces - 1 - last.id[at] as usize);
            a != b && !adjacent(&uv[a], &uv[b])
        };
        if twice { OVERLAP } else { colors[id as usize] }
    };
    let bad = uv.iter().filter(|c| !c.iter().flatten().all(|x| x.is_finite())).count();
    Ok(finish(&canvas, shade, bad))
}

/// Whether two faces share a corner in the texture: along their common side rounding may give a sample to both.
fn adjacent(a: &[[f32; 2]; 3], b: &[[f32; 2]; 3]) -> bool {
    a.iter().any(|p| b.contains(p))
}

/// Chart of each face: as the file says, or as the UVs say.
fn chart_of_faces(mesh: &TriMesh, ctx: &Context<'_>) -> Result<Vec<u32>> {
    match &mesh.face_chart {
        Some(charts) if charts.len() == mesh.triangles.len() => Ok(charts.clone()),
        _ => Ok(charts(mesh, ctx)?.of_face),
    }
}

/// Averages samples to pixels.
fn finish(canvas: &Canvas, shade: impl Fn(usize) -> Rgb + Sync, not_shown: usize) -> Picture {
    let size = canvas.size.map(|s| s / OVER);
    let rgb = (0..size[1])
        .into_par_iter()
        .flat_map_iter(|y| {
            let shade = &shade;
            (0..size[0]).flat_map(move |x| {
                let mut sum = [0.0; 3];
                for dy in 0..OVER {
                    for dx in 0..OVER {
                        let c = shade((y * OVER + dy) * canvas.size[0] + x * OVER + dx);
                        for k in 0..3 {
                            sum[k] += c[k].clamp(0.0, 1.0);
                        }
                    }
                }
                sum.map(|s| (255.0 * s / (OVER * OVER) as f32).round() as u8)
            })
        })
        .collect();
    Picture { size, rgb, not_shown }
}
