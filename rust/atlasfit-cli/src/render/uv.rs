//! The UV layout: charts in colours, flipped faces, overlaps, seams.

use crate::render::canvas::{Canvas, Drawing, NOTHING, OVER, Primitive};
use crate::render::color::{BACKGROUND, FLIPPED, LINE, OVERLAP, Rgb, chart_color};
use crate::render::shade::{chart_of_faces, finish, samples};
use crate::render::style::{Picture, Style};
use atlasfit::geometry::TriMesh;
use atlasfit::measure::charts;
use atlasfit::{Context, Result};

/// Draws the UVs of a mesh in the unit square.
pub fn uv_layout(mesh: &TriMesh, style: &Style, ctx: &Context<'_>) -> Result<Picture> {
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
    // Of faces at one depth the first one drawn stays. Drawn in reverse order, the last one does: where the
    // two differ, faces overlap.
    let reversed: Vec<Primitive> = primitives.iter().rev().copied().collect();
    let faces = primitives.len();
    let mut line = |a: [f32; 2], b: [f32; 2], width: f32, z: f32, color: Rgb| {
        primitives.push(Primitive::Line {
            ends: [place(a, z), place(b, z)],
            half_width: 0.5 * width * OVER as f32,
        });
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
    let shade = |[canvas, first, last]: &[Canvas; 3], sample: [usize; 2]| -> Rgb {
        let at = canvas.at(sample);
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
    let [all, first, last] =
        [&primitives[..], &primitives[..faces], &reversed].map(|drawn| Drawing::new(size, drawn, ctx));
    finish([all?, first?, last?], 0, shade, bad, ctx)
}

/// Whether two faces share a corner in the texture. Rounding may then give a sample on their common side to
/// both, which is no overlap.
fn adjacent(a: &[[f32; 2]; 3], b: &[[f32; 2]; 3]) -> bool {
    a.iter().any(|p| b.contains(p))
}
