//! Bakes colours into a texture.
//!
//! In: a mesh with UVs, and colours of its vertices or of points near it. Out: an [`Image`] for those UVs.
//! Every texel whose middle lies on a face gets the colour there, a texel that only holds a corner the
//! corner's; the colours then spread beyond the borders of the charts, so that filtered look-ups find nothing
//! foreign (dilation).

use crate::error::{Error, Result};
use crate::geometry::{PointCloud, TriMesh};
use crate::numeric::vec3::Vec3;
use crate::run::{Context, Stage};
use crate::spatial::neighbours::{Neighbour, Neighbours};
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
    /// How far the colours spread beyond the charts, in texels. Default 16; what is left is of the mean
    /// colour.
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
/// [`Error::EmptyInput`] without UVs or colours; [`Error::InvalidArgument`] for a size out of range or
/// columns of wrong length; [`Error::IndexOutOfRange`]; those of [`Context::check`] and [`Context::reserve`].
pub fn bake(mesh: &TriMesh, colors: Colors<'_>, options: &BakeOptions, ctx: &Context<'_>) -> Result<Image> {
    let [width, height] = options.size.map(|s| s as usize);
    if options.size.iter().any(|s| !(1..=65536).contains(s)) {
        return Err(Error::invalid(format!("the texture is {width} by {height}"), "Give 1 to 65536 texels"));
    }
    mesh.validate()?;
    ctx.reserve((width * height) as u64 * 20)?;
    ctx.stage(Stage::Bake, height);
    let uv = mesh.corner_uv.as_ref().filter(|uv| !uv.is_empty() && uv.len() == mesh.triangles.len());
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
            if index.is_empty() {
                return Err(Error::empty("no point is finite", "Give a coloured scan near the mesh"));
            }
            let at: Vec<Vec3> = index.iter().map(|&i| Vec3(cloud.positions[i as usize])).collect();
            let tree = Neighbours::build(&at, ctx)?;
            Box::new(move |f, w| {
                let corner = mesh.triangles[f as usize].map(|v| mesh.positions[v as usize]);
                let p = (0..3).fold(Vec3::ZERO, |p, k| p + Vec3(corner[k]) * w[k]);
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

/// The face at the middle of each texel, else one with a corner in the texel, so that what is thinner than a
/// texel is seen too; of several, the last.
fn owners(uv: &[[[f32; 2]; 3]], width: usize, height: usize, ctx: &Context<'_>) -> Result<Vec<u32>> {
    let texels = |t: &[[f32; 2]; 3]| {
        t.map(|q| [f64::from(q[0]) * width as f64, (1.0 - f64::from(q[1])) * height as f64])
    };
    let span = |p: &[[f64; 2]; 3], k: usize| {
        p.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), q| (lo.min(q[k]), hi.max(q[k])))
    };
    // Faces of each block of rows.
    let mut blocks: Vec<Vec<u32>> = vec![Vec::new(); height.div_ceil(ROWS)];
    for (f, t) in uv.iter().enumerate() {
        ctx.check_at(f)?;
        let p = texels(t);
        if p.iter().flatten().all(|x| x.is_finite()) {
            let (lo, hi) = span(&p, 1);
            let first = (lo / ROWS as f64).max(0.0) as usize;
            let end = ((hi / ROWS as f64).floor() + 1.0).clamp(0.0, blocks.len() as f64) as usize;
            blocks.iter_mut().take(end).skip(first).for_each(|b| b.push(f as u32));
        }
    }
    let mut owner = vec![NONE; width * height];
    owner.par_chunks_mut(width * ROWS).zip(blocks).enumerate().try_for_each(|(block, (owner, faces))| {
        let (top, rows) = (block * ROWS, owner.len() / width);
        for &f in &faces {
            for [x, y] in texels(&uv[f as usize]).map(|q| q.map(f64::floor)) {
                if (0.0..width as f64).contains(&x) && (top as f64..(top + rows) as f64).contains(&y) {
                    owner[(y as usize - top) * width + x as usize] = f;
                }
            }
        }
        let mut looked_at = 0;
        for &f in &faces {
            let p = texels(&uv[f as usize]);
            // Texels whose middles are within.
            let range = |k: usize, least: usize, most: usize| {
                let (lo, hi) = span(&p, k);
                let (least, most) = (least as f64, most as f64);
                let from = (lo - 0.5).ceil().clamp(least, most) as usize;
                (from, ((hi - 0.5).floor() + 1.0).clamp(from as f64, most) as usize)
            };
            let (ys, xs) = (range(1, top, top + rows), range(0, 0, width));
            looked_at += 16 + (ys.1 - ys.0) * (xs.1 - xs.0);
            if looked_at > 1 << 16 {
                ctx.check()?;
                looked_at = 0;
            }
            for y in ys.0..ys.1 {
                for x in xs.0..xs.1 {
                    let q = [x as f64 + 0.5, y as f64 + 0.5];
                    let side = |a: [f64; 2], b: [f64; 2]| {
                        (b[0] - a[0]) * (q[1] - a[1]) - (b[1] - a[1]) * (q[0] - a[0])
                    };
                    let s = [side(p[0], p[1]), side(p[1], p[2]), side(p[2], p[0])];
                    if s.iter().all(|&s| s >= 0.0) || s.iter().all(|&s| s <= 0.0) {
                        owner[(y - top) * width + x] = f;
                    }
                }
            }
        }
        ctx.check()
    })?;
    Ok(owner)
}

/// Spreads colours into empty texels, one ring at a time; what stays empty gets the mean colour.
fn dilate(rgba: &mut [[u8; 4]], owner: &[u32], width: usize, rings: u32, ctx: &Context<'_>) -> Result<()> {
    let block = width * ROWS;
    let mut filled: Vec<bool> = owner.par_iter().map(|&f| f != NONE).collect();
    ctx.check()?;
    let sum = |(texels, filled): (&[[u8; 4]], &[bool])| {
        ctx.check()?;
        let (mut sum, mut count) = ([0u64; 4], 0u64);
        for (c, _) in texels.iter().zip(filled).filter(|c| *c.1) {
            (0..4).for_each(|k| sum[k] += u64::from(c[k]));
            count += 1;
        }
        Ok((sum, count))
    };
    let (sum, count) = (rgba.par_chunks(block).zip(filled.par_chunks(block)).map(sum))
        .try_reduce(|| ([0; 4], 0), |(a, m), (b, n)| Ok(([0, 1, 2, 3].map(|k| a[k] + b[k]), m + n)))?;
    let mean = sum.map(|s| (s / count.max(1)) as u8);
    let height = filled.len() / width;
    let near = |at: usize| {
        let (x, y) = (at % width, at / width);
        let rows = y.saturating_sub(1)..(y + 2).min(height);
        rows.flat_map(move |r| (x.saturating_sub(1)..(x + 2).min(width)).map(move |c| r * width + c))
    };
    let beside = |block: &[usize; 2], filled: &[bool]| -> Result<Vec<usize>> {
        ctx.check()?;
        Ok((block[0]..block[1]).filter(|&i| !filled[i] && near(i).any(|j| filled[j])).collect())
    };
    let blocks: Vec<[usize; 2]> =
        (0..filled.len()).step_by(block).map(|i| [i, (i + block).min(filled.len())]).collect();
    let front: Vec<Vec<usize>> = blocks.par_iter().map(|b| beside(b, &filled)).collect::<Result<_>>()?;
    let mut front = front.concat();
    for _ in 0..rings {
        if front.is_empty() {
            break;
        }
        ctx.check()?;
        let colors: Vec<[u8; 4]> = front
            .par_iter()
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
        next.par_sort_unstable();
        next.dedup();
        front = next;
    }
    rgba.par_iter_mut().zip(&filled).filter(|c| !*c.1).for_each(|(c, _)| *c = mean);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::Run;

    /// A unit square with a red, a green, a blue and a white corner, mapped to the lower left quarter of the
    /// page.
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

    #[test]
    fn a_chart_thinner_than_a_texel_is_seen() {
        let thin = |v: f32| [[0.51, v], [0.511, v], [0.51, v + 0.001]];
        // Nearest to the texels' middles: the first face's red corner, the second one's white corner.
        let [a, b, c] = thin(0.26);
        let mesh = TriMesh { corner_uv: Some(vec![thin(0.51), [b, c, a]]), ..square() };
        let options = BakeOptions { size: [64, 64], dilation: 0 };
        let image = Run::default().execute(|c| bake(&mesh, Colors::Vertices, &options, c)).unwrap();
        let colors = image.rgba.iter().filter(|c| **c != image.rgba[0]).count();
        assert_eq!(colors, 2, "all other texels have the mean colour");
    }
}
