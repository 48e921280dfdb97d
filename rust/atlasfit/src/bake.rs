//! Bakes colours into a texture.
//!
//! In: a mesh with UVs, and colours of its vertices or of points near it. Out: an [`Image`] for those UVs. Every texel
//! whose middle lies on a face gets the colour there; the colours then spread beyond the borders of the charts, so that
//! filtered look-ups find nothing foreign (dilation).

use crate::error::{Error, Result};
use crate::geometry::neighbours::{Neighbour, Neighbours};
use crate::geometry::vec3::{Vec3, mul_add};
use crate::geometry::{PointCloud, TriMesh};
use crate::run::{Context, Stage};
use rayon::prelude::*;

/// No face.
const NONE: u32 = u32::MAX;
/// Points that give a texel its colour.
const POINTS: usize = 4;
/// Rows per task.
const ROWS: usize = 8;

/// An image of 8 bits per channel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Red, green, blue, alpha; row after row, the top row (v = 1) first.
    pub rgba: Vec<[u8; 4]>,
}

/// Where the colours come from.
#[derive(Debug, Clone, Copy)]
pub enum Colors<'a> {
    /// The colours of the mesh's own vertices.
    Vertices,
    /// The colours of points in the mesh's frame, the nearest ones to each texel.
    Points(&'a PointCloud),
}

/// How to bake.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BakeOptions {
    /// Width and height in texels, each 1 to 65536. Default 1024 by 1024.
    pub size: [u32; 2],
    /// How far the colours spread beyond the charts, in texels. Default 16; what is left is of the mean colour.
    pub dilation: u32,
}

impl Default for BakeOptions {
    fn default() -> Self {
        Self { size: [1024; 2], dilation: 16 }
    }
}

/// Bakes colours into a texture for the mesh's UVs; faces or parts outside [0, 1] are left out.
///
/// # Errors
/// [`Error::EmptyInput`] without UVs or colours; [`Error::InvalidArgument`] for a size out of range or columns of wrong
/// length; [`Error::IndexOutOfRange`]; those of [`Context::check`] and [`Context::reserve`].
pub fn bake(mesh: &TriMesh, colors: Colors<'_>, options: &BakeOptions, ctx: &Context<'_>) -> Result<Image> {
    let [width, height] = options.size.map(|s| s as usize);
    if options.size.iter().any(|s| !(1..=65536).contains(s)) {
        return Err(Error::invalid(format!("the texture is {width} by {height}"), "Give 1 to 65536 texels"));
    }
    mesh.validate()?;
    ctx.reserve((width * height) as u64 * 20)?;
    ctx.stage(Stage::Bake, height);
    let uv = mesh.corner_uv.as_ref().filter(|uv| uv.len() == mesh.triangles.len());
    let uv = uv.ok_or_else(|| Error::empty("the mesh has no UVs", "Unwrap it first"))?;
    let missing =
        |what: &str| Error::empty(format!("{what} have no colours"), "Give a coloured mesh or scan");
    let color_at: Box<dyn Fn(u32, [f64; 3]) -> [f64; 4] + Sync> = match colors {
        Colors::Vertices => {
            let own = mesh.colors.as_ref().filter(|c| c.len() == mesh.positions.len());
            let own = own.ok_or_else(|| missing("the vertices"))?;
            Box::new(move |f, w| {
                let corner = mesh.triangles[f as usize].map(|v| own[v as usize]);
                [0, 1, 2, 3].map(|k| (0..3).map(|c| w[c] * f64::from(corner[c][k])).sum())
            })
        }
        Colors::Points(cloud) => {
            let own = cloud.colors.as_ref().filter(|c| c.len() == cloud.positions.len());
            let own = own.ok_or_else(|| missing("the points"))?;
            let finite = |i: &u32| cloud.positions[*i as usize].iter().all(|x| x.is_finite());
            let index: Vec<u32> = (0..cloud.positions.len() as u32).filter(finite).collect();
            let at: Vec<Vec3> = index.iter().map(|&i| cloud.positions[i as usize]).collect();
            let tree = Neighbours::build(&at, ctx)?;
            Box::new(move |f, w| {
                let corner = mesh.triangles[f as usize].map(|v| mesh.positions[v as usize]);
                let p = (0..3).fold([0.0; 3], |p, k| mul_add(p, corner[k], w[k]));
                let mut near: Vec<Neighbour> = Vec::new();
                tree.nearest(p, POINTS, &mut near);
                let soft = near.first().map_or(0.0, |n| n.dist2) * 0.1 + 1e-300;
                let (mut sum, mut total) = ([0.0; 4], 0.0);
                for n in &near {
                    let weight = 1.0 / (n.dist2 + soft);
                    let c = own[index[n.index as usize] as usize];
                    (0..4).for_each(|k| sum[k] += weight * f64::from(c[k]));
                    total += weight;
                }
                sum.map(|s| s / total)
            })
        }
    };
    let owner = owners(uv, width, height, ctx)?;
    let mut rgba = vec![[0u8; 4]; width * height];
    rgba.par_chunks_mut(width * ROWS).zip(owner.par_chunks(width * ROWS)).enumerate().try_for_each(
        |(block, (texels, owner))| {
            ctx.check()?;
            for (i, (texel, &f)) in texels.iter_mut().zip(owner).enumerate() {
                if f != NONE {
                    let at = block * ROWS * width + i;
                    let weights = barycentric(&uv[f as usize], middle(at, width, height));
                    *texel = color_at(f, weights).map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8);
                }
            }
            ctx.advance(ROWS);
            Ok(())
        },
    )?;
    dilate(&mut rgba, &owner, width, options.dilation, ctx)?;
    Ok(Image { width: options.size[0], height: options.size[1], rgba })
}

/// The middle of a texel in UVs; rows run from the top.
fn middle(at: usize, width: usize, height: usize) -> [f64; 2] {
    [((at % width) as f64 + 0.5) / width as f64, 1.0 - ((at / width) as f64 + 0.5) / height as f64]
}

/// Weights of the corners at a point, brought into the face.
fn barycentric(uv: &[[f32; 2]; 3], p: [f64; 2]) -> [f64; 3] {
    let [a, b, c] = uv.map(|q| q.map(f64::from));
    let area =
        |a: [f64; 2], b: [f64; 2], c: [f64; 2]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    let w = [area(b, c, p), area(c, a, p), area(a, b, p)];
    let total = area(a, b, c);
    if total == 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let w = w.map(|w| (w / total).max(0.0));
    let sum: f64 = w.iter().sum();
    w.map(|w| w / sum)
}

/// The face at the middle of each texel; of several, the last.
fn owners(uv: &[[[f32; 2]; 3]], width: usize, height: usize, ctx: &Context<'_>) -> Result<Vec<u32>> {
    let mut owner = vec![NONE; width * height];
    for (f, t) in uv.iter().enumerate() {
        if f % 4096 == 0 {
            ctx.check()?;
        }
        let p = t.map(|q| [f64::from(q[0]) * width as f64, (1.0 - f64::from(q[1])) * height as f64]);
        if !p.iter().flatten().all(|x| x.is_finite()) {
            continue;
        }
        let range = |k: usize, most: usize| {
            let lo = p.iter().map(|q| q[k]).fold(f64::INFINITY, f64::min);
            let hi = p.iter().map(|q| q[k]).fold(f64::NEG_INFINITY, f64::max);
            ((lo - 0.5).ceil().max(0.0) as usize, ((hi - 0.5).floor() + 1.0).clamp(0.0, most as f64) as usize)
        };
        let (rows, columns) = (range(1, height), range(0, width));
        for y in rows.0..rows.1 {
            for x in columns.0..columns.1 {
                let q = [x as f64 + 0.5, y as f64 + 0.5];
                let side =
                    |a: [f64; 2], b: [f64; 2]| (b[0] - a[0]) * (q[1] - a[1]) - (b[1] - a[1]) * (q[0] - a[0]);
                let s = [side(p[0], p[1]), side(p[1], p[2]), side(p[2], p[0])];
                if s.iter().all(|&s| s >= 0.0) || s.iter().all(|&s| s <= 0.0) {
                    owner[y * width + x] = f as u32;
                }
            }
        }
    }
    Ok(owner)
}

/// Spreads colours into empty texels, one ring at a time; what stays empty gets the mean colour.
fn dilate(rgba: &mut [[u8; 4]], owner: &[u32], width: usize, rings: u32, ctx: &Context<'_>) -> Result<()> {
    let mut filled: Vec<bool> = owner.iter().map(|&f| f != NONE).collect();
    let height = filled.len() / width;
    let mean = {
        let mut sum = [0u64; 4];
        let mut count = 0u64;
        for (c, _) in rgba.iter().zip(&filled).filter(|c| *c.1) {
            (0..4).for_each(|k| sum[k] += u64::from(c[k]));
            count += 1;
        }
        sum.map(|s| (s / count.max(1)) as u8)
    };
    let near = |at: usize| {
        let (x, y) = (at % width, at / width);
        let rows = y.saturating_sub(1)..(y + 2).min(height);
        rows.flat_map(move |r| (x.saturating_sub(1)..(x + 2).min(width)).map(move |c| r * width + c))
    };
    let mut front: Vec<usize> =
        (0..filled.len()).filter(|&i| !filled[i] && near(i).any(|j| filled[j])).collect();
    for _ in 0..rings {
        ctx.check()?;
        let colors: Vec<[u8; 4]> = front
            .iter()
            .map(|&i| {
                let (mut sum, mut count) = ([0u32; 4], 0);
                for j in near(i).filter(|&j| filled[j]) {
                    (0..4).for_each(|k| sum[k] += u32::from(rgba[j][k]));
                    count += 1;
                }
                sum.map(|s| ((s + count / 2) / count.max(1)) as u8)
            })
            .collect();
        for (&i, c) in front.iter().zip(colors) {
            rgba[i] = c;
            filled[i] = true;
        }
        let mut next: Vec<usize> = front.iter().flat_map(|&i| near(i)).filter(|&j| !filled[j]).collect();
        next.sort_unstable();
        next.dedup();
        front = next;
    }
    for (c, _) in rgba.iter_mut().zip(&filled).filter(|c| !*c.1) {
        *c = mean;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::Run;

    /// A unit square with a red, a green, a blue and a white corner, mapped to the lower left quarter of the page.
    fn square() -> TriMesh {
        let corner = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let triangles = vec![[0u32, 1, 2], [0, 2, 3]];
        let uv = |v: u32| corner[v as usize].map(|x: f64| (x * 0.5) as f32);
        TriMesh {
            positions: corner.iter().map(|c| [c[0], c[1], 0.0]).collect(),
            corner_uv: Some(triangles.iter().map(|t| t.map(uv)).collect()),
            triangles,
            colors: Some(vec![
                [1.0, 0.0, 0.0, 1.0],
                [0.0, 1.0, 0.0, 1.0],
                [0.0, 0.0, 1.0, 1.0],
                [1.0, 1.0, 1.0, 1.0],
            ]),
            ..TriMesh::default()
        }
    }

    #[test]
    fn texels_get_the_colour_of_their_place_and_colours_spread_beyond_the_chart() {
        let options = BakeOptions { size: [64, 64], dilation: 4 };
        let bake =
            |mesh: &TriMesh, colors: Colors<'_>| Run::default().execute(|c| bake(mesh, colors, &options, c));
        let mesh = square();
        let image = bake(&mesh, Colors::Vertices).unwrap();
        let at = |image: &Image, x: usize, y: usize| image.rgba[(63 - y) * 64 + x];
        let near = |a: [u8; 4], b: [u8; 4]| a.iter().zip(&b).all(|(a, b)| a.abs_diff(*b) < 16);
        assert!(near(at(&image, 0, 0), [255, 0, 0, 255]), "{:?}", at(&image, 0, 0));
        assert!(near(at(&image, 31, 0), [0, 255, 0, 255]) && near(at(&image, 31, 31), [0, 0, 255, 255]));
        // Beside the chart the same colours, far away the mean.
        assert!(near(at(&image, 34, 0), at(&image, 31, 0)));
        assert_eq!(at(&image, 60, 60), at(&image, 50, 5));
        // Points in place of the vertices give the corners the same colours.
        let cloud = PointCloud {
            positions: mesh.positions.clone(),
            colors: mesh.colors.clone(),
            ..PointCloud::default()
        };
        assert!(near(at(&bake(&mesh, Colors::Points(&cloud)).unwrap(), 0, 0), [255, 0, 0, 255]));
        let bare = TriMesh { colors: None, ..mesh.clone() };
        assert!(matches!(bake(&bare, Colors::Vertices), Err(Error::EmptyInput { .. })));
        let flat = TriMesh { corner_uv: None, ..mesh };
        assert!(matches!(bake(&flat, Colors::Vertices), Err(Error::EmptyInput { .. })));
    }
}
