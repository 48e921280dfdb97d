//! A surface: faces in the light, in colours of their charts, with a checker or a texture; lines along edges.

use crate::render::camera::Camera;
use crate::render::canvas::{Canvas, Drawing, NOTHING, OVER, Primitive, Weights};
use crate::render::color::{
    BACK, BACKGROUND, BOUNDARY, FRONT, LINE, NON_MANIFOLD, Rgb, chart_color, mix, scaled,
};
use crate::render::shade::{chart_of_faces, finish, finite, light, samples};
use crate::render::style::{Mode, Picture, Style};
use atlasfit::bake::Image;
use atlasfit::geometry::TriMesh;
use atlasfit::measure::charts;
use atlasfit::numeric::vec3::{self, Vec3};
use atlasfit::spatial::edges::{Edges, HalfEdge};
use atlasfit::spatial::weld::weld;
use atlasfit::{Context, Result};
use rayon::prelude::*;

/// Squares of the checker along each side of the texture.
const SQUARES: f32 = 64.0;

/// Draws the faces of a mesh, and lines along some edges.
pub fn surface(mesh: &TriMesh, texture: Option<&Image>, style: &Style, ctx: &Context<'_>) -> Result<Picture> {
    let size = samples(style);
    let shown: Vec<u32> = (0..mesh.triangles.len() as u32)
        .filter(|&i| mesh.triangles[i as usize].iter().all(|&v| finite(&mesh.positions[v as usize])))
        .collect();
    let corners: Vec<Vec3> = shown
        .iter()
        .flat_map(|&i| mesh.triangles[i as usize].map(|v| Vec3(mesh.positions[v as usize])))
        .collect();
    let camera = Camera::fit(&corners, style.view, style.up, size);
    let mut primitives: Vec<Primitive> = corners
        .par_chunks_exact(3)
        .map(|c| Primitive::Triangle([c[0], c[1], c[2]].map(|p| camera.project(p))))
        .collect();
    let faces = primitives.len();
    let chart = if style.mode == Mode::Charts { chart_of_faces(mesh, ctx)? } else { Vec::new() };
    if style.mode == Mode::Checker {
        charts(mesh, ctx)?; // says what is missing
    }
    ctx.check()?;
    let lines = lines(mesh, &chart, &camera, style, ctx)?;
    primitives.extend(lines.iter().map(|l| l.primitive));
    ctx.check()?;
    let not_shown = mesh.triangles.len() - shown.len();
    let shading = Shading::new(mesh, texture, style, Shown { faces: shown, chart, camera });
    let shade = |[canvas]: &[Canvas; 1], [x, y]: [usize; 2]| -> Rgb {
        let id = canvas.id[canvas.at([x, y])];
        if id == NOTHING {
            return BACKGROUND;
        }
        let id = id as usize;
        if id >= faces {
            return lines[id - faces].color;
        }
        let Primitive::Triangle(t) = &primitives[id] else { return BACKGROUND };
        let weights =
            Weights::new(t).map_or([1.0, 0.0, 0.0], |weights| weights.at(x as f32 + 0.5, y as f32 + 0.5));
        shading.color(id, weights)
    };
    finish([Drawing::new(size, &primitives, ctx)?], 0, shade, not_shown, ctx)
}

/// A line of a colour.
struct Line {
    primitive: Primitive,
    color: Rgb,
}

/// The lines that the style asks for: boundary, non-manifold edges, all edges, or edges between charts.
fn lines(
    mesh: &TriMesh,
    chart: &[u32],
    camera: &Camera,
    style: &Style,
    ctx: &Context<'_>,
) -> Result<Vec<Line>> {
    // Lines lie two pixels nearer to the viewer than the surface, so that it does not hide them.
    let bias = 2.0 * OVER as f32 * camera.depth_per_pixel();
    let mut out = Vec::new();
    let mut line = |a: u32, b: u32, width: f32, color: Rgb| {
        let ends = [a, b].map(|v| {
            let [x, y, z] = camera.project(Vec3(mesh.positions[v as usize]));
            [x, y, z - bias]
        });
        out.push(Line { primitive: Primitive::Line { ends, half_width: 0.5 * width * OVER as f32 }, color });
    };
    let place = weld(vec3::of(&mesh.positions), 0.0, ctx)?;
    let welded: Vec<[u32; 3]> = mesh.triangles.iter().map(|t| t.map(|v| place[v as usize])).collect();
    let any = style.boundary || matches!(style.mode, Mode::Wire | Mode::Charts);
    let edges = Edges::new(if any { &welded } else { &[] }, ctx)?;
    for edge in edges.iter() {
        let [a, b] = edge[0].ends();
        let chart_of = |h: &HalfEdge| chart[h.face()];
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
    Ok(out)
}

/// The faces that are shown, and from where.
struct Shown {
    /// Their indices in the mesh.
    faces: Vec<u32>,
    /// Chart of each face of the mesh; empty where the mode shows no charts.
    chart: Vec<u32>,
    camera: Camera,
}

/// All that decides the colour of a place on a face.
struct Shading<'a> {
    mesh: &'a TriMesh,
    mode: Mode,
    shown: Shown,
    /// Normal of each shown face, twice its area long.
    face_normals: Vec<Vec3>,
    /// Where faces are shown smooth.
    smooth: Option<Smooth<'a>>,
    vertex_colors: Option<&'a [[f32; 4]]>,
    texture: Option<Textured<'a>>,
}

/// Unit normals of a smooth surface.
enum Smooth<'a> {
    /// Per vertex.
    Vertices(Vec<Vec3>),
    /// Per corner of each triangle, as the mesh has them.
    Corners(&'a [[[f32; 3]; 3]]),
}

/// A texture, and where each corner lies on it.
struct Textured<'a> {
    image: &'a Image,
    corner_uv: &'a [[[f32; 2]; 3]],
}

impl<'a> Shading<'a> {
    fn new(mesh: &'a TriMesh, texture: Option<&'a Image>, style: &Style, shown: Shown) -> Self {
        let face_normals: Vec<Vec3> = shown
            .faces
            .par_iter()
            .map(|&i| {
                let [a, b, c] = mesh.triangles[i as usize].map(|v| Vec3(mesh.positions[v as usize]));
                (b - a).cross(c - a)
            })
            .collect();
        let smooth = (!style.flat).then(|| {
            if let Some(corners) = &mesh.corner_normals {
                return Smooth::Corners(corners);
            }
            let mut sums = vec![Vec3::ZERO; mesh.positions.len()];
            for (&i, n) in shown.faces.iter().zip(&face_normals) {
                for v in mesh.triangles[i as usize] {
                    sums[v as usize] += *n;
                }
            }
            Smooth::Vertices(sums.into_par_iter().map(Vec3::normalized).collect())
        });
        let colored = style.colors && matches!(style.mode, Mode::Shaded | Mode::Uncertainty);
        let texture = texture.zip(mesh.corner_uv.as_deref()).filter(|_| colored);
        Self {
            mesh,
            mode: style.mode,
            shown,
            face_normals,
            smooth,
            vertex_colors: mesh.colors.as_deref().filter(|_| colored),
            texture: texture.map(|(image, corner_uv)| Textured { image, corner_uv }),
        }
    }

    /// The colour of a place on the shown face `id`, in the light. `weights` are barycentric.
    fn color(&self, id: usize, weights: [f32; 3]) -> Rgb {
        let flat = self.shown.camera.turn(self.face_normals[id]).normalized();
        let mut base = self.base(self.shown.faces[id] as usize, weights);
        if flat[2] < 0.0 {
            let opaque = matches!(self.mode, Mode::Shaded | Mode::Wire);
            base = mix(base, BACK, if opaque { 1.0 } else { 0.5 });
        }
        scaled(base, light(self.normal(self.shown.faces[id] as usize, flat, weights)))
    }

    /// The normal that light falls on, in the viewer's frame: on the side that is seen.
    fn normal(&self, face: usize, flat: Vec3, weights: [f32; 3]) -> Vec3 {
        let corners = self.mesh.triangles[face];
        let at = |smooth: &Smooth<'_>, c: usize| match smooth {
            Smooth::Vertices(normals) => normals[corners[c] as usize],
            Smooth::Corners(normals) => Vec3(normals[face][c].map(f64::from)),
        };
        let mut n = match &self.smooth {
            Some(smooth) => {
                let sum: Vec3 = (0..3).map(|c| at(smooth, c) * f64::from(weights[c])).sum();
                self.shown.camera.turn(sum).normalized()
            }
            None => flat,
        };
        if n[2] * flat[2] < 0.0 || n == Vec3::ZERO {
            n = flat;
        }
        if n[2] < 0.0 {
            n = n.map(|x| -x);
        }
        n
    }

    /// The colour without light.
    fn base(&self, face: usize, weights: [f32; 3]) -> Rgb {
        let at =
            |uv: &[[[f32; 2]; 3]]| [0, 1].map(|k| (0..3).map(|c| weights[c] * uv[face][c][k]).sum::<f32>());
        match self.mode {
            Mode::Charts => chart_color(self.shown.chart[face]),
            Mode::Checker => self.mesh.corner_uv.as_deref().map_or(FRONT, |uv| {
                let [u, v] = at(uv);
                checker(u, v)
            }),
            _ => match (&self.texture, self.vertex_colors) {
                (Some(texture), _) => {
                    let [u, v] = at(texture.corner_uv);
                    look_up(texture.image, u, v)
                }
                (None, Some(colors)) => {
                    let corners = self.mesh.triangles[face];
                    std::array::from_fn(|k| (0..3).map(|c| weights[c] * colors[corners[c] as usize][k]).sum())
                }
                (None, None) => FRONT,
            },
        }
    }
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

/// A checker, tinted by the place on the texture.
fn checker(u: f32, v: f32) -> Rgb {
    let odd = ((u * SQUARES).floor() + (v * SQUARES).floor()).rem_euclid(2.0) >= 1.0;
    // The tint tells places of the texture apart.
    let tint = [0.95 - 0.35 * u.clamp(0.0, 1.0), 0.75, 0.60 + 0.35 * v.clamp(0.0, 1.0)];
    if odd { tint } else { scaled(tint, 0.35) }
}
