//! How much of a texture faces cover, and where they overlap.
//!
//! In: UVs on the unit square. Out: texels covered once and more than once; the number of overlapping faces,
//! exactly.

use super::apart::surely_apart;
use super::layout::FaceUv;
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::bvh::{Aabb, Bvh};
use rayon::prelude::*;
use robust::{Coord, orient2d};
use std::ops::ControlFlow;

/// Side of the texture, in texels, that coverage and overlap are counted on: that of an ordinary texture.
pub const TEXELS: usize = 1024;
/// Faces that share a side must not overlap: a texel counts only where twice the area of its centre and a
/// side is larger than this times [`TEXELS`], in squared texels. For a side of one texel this is about the
/// rounding of f32 UVs.
const INSIDE: f64 = 1e-7;
/// Rows of texels per task.
const BAND: usize = 32;
/// Faces drawn between two looks at the cancel flag: a few milliseconds even where each covers a whole band.
const FACES_PER_CHECK: usize = 256;

/// Counts of texels, of [`TEXELS`] squared.
#[derive(Clone, Copy, Default)]
pub(super) struct Covered {
    /// Under one face or more.
    pub once: usize,
    /// Under two or more.
    pub twice: usize,
}

/// Counts the texels whose centres faces cover. Faces whose UVs are not finite are left out.
pub(super) fn texels(uvs: &[FaceUv], finite: &[bool], ctx: &Context<'_>) -> Result<Covered> {
    let size = TEXELS as f64;
    // Rows that a face can reach.
    let rows = |c: &FaceUv| {
        let (lo, hi) =
            c.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(p[1]), h.max(p[1])));
        ((lo * size).floor().max(0.0) as usize, (hi * size).ceil().clamp(0.0, size) as usize)
    };
    let mut bands: Vec<Vec<u32>> = vec![Vec::new(); TEXELS.div_ceil(BAND)];
    for (i, c) in uvs.iter().enumerate().filter(|(i, _)| finite[*i]) {
        ctx.check_at(i)?;
        let (lo, hi) = rows(c);
        for band in bands.iter_mut().take(hi.div_ceil(BAND)).skip(lo / BAND) {
            band.push(i as u32);
        }
    }
    let counts = bands
        .par_iter()
        .enumerate()
        .map(|(band, faces)| {
            let mut count = vec![0u8; BAND * TEXELS];
            for (n, &i) in faces.iter().enumerate() {
                if n % FACES_PER_CHECK == 0 {
                    ctx.check()?;
                }
                cover(&uvs[i as usize], band * BAND, &mut count);
            }
            let above = |most: u8| count.iter().filter(|c| **c > most).count();
            Ok(Covered { once: above(0), twice: above(1) })
        })
        .collect::<Result<Vec<_>>>()?;
    Ok(counts
        .iter()
        .fold(Covered::default(), |s, c| Covered { once: s.once + c.once, twice: s.twice + c.twice }))
}

/// Counts the texels of one band of rows whose centres a face covers.
fn cover(c: &FaceUv, first_row: usize, count: &mut [u8]) {
    let size = TEXELS as f64;
    let mut p = c.map(|q| q.map(|x| x * size));
    let twice = (p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) - (p[2][0] - p[0][0]) * (p[1][1] - p[0][1]);
    if twice < 0.0 {
        p.swap(1, 2);
    } else if twice == 0.0 {
        return;
    }
    let range = |k: usize, from: f64, to: f64| {
        let lo = p.iter().fold(f64::INFINITY, |m, q| m.min(q[k])).floor().max(from);
        let hi = p.iter().fold(f64::NEG_INFINITY, |m, q| m.max(q[k])).ceil().min(to);
        (lo as usize)..(hi.max(0.0) as usize)
    };
    let margin = INSIDE * size;
    let row0 = first_row as f64;
    for y in range(1, row0, row0 + BAND as f64) {
        let py = y as f64 + 0.5;
        // Where the row meets the face, and a texel more each way for rounding: all of a needle's box would
        // be very much more.
        let (mut from, mut to) = (0.0, size);
        for k in 0..3 {
            let (a, b) = (p[k], p[(k + 1) % 3]);
            let x = a[0] + (b[0] - a[0]) * (py - a[1]) / (b[1] - a[1]);
            if b[1] > a[1] && x < to {
                to = x;
            } else if b[1] < a[1] && x > from {
                from = x;
            }
        }
        for x in range(0, (from - 1.5).floor().max(0.0), (to + 1.5).ceil().min(size)) {
            let px = x as f64 + 0.5;
            let inside =
                |a: [f64; 2], b: [f64; 2]| (b[0] - a[0]) * (py - a[1]) - (b[1] - a[1]) * (px - a[0]) > margin;
            if inside(p[0], p[1]) && inside(p[1], p[2]) && inside(p[2], p[0]) {
                let texel = &mut count[(y - first_row) * TEXELS + x];
                *texel = texel.saturating_add(1);
            }
        }
    }
}

/// Number of faces whose inside meets the inside of another: exact, whatever the size of the overlap.
pub(super) fn overlapping(uvs: &[FaceUv], finite: &[bool], ctx: &Context<'_>) -> Result<usize> {
    // Counter-clockwise faces with area; the others cover nothing.
    let mut solid: Vec<FaceUv> = Vec::with_capacity(uvs.len());
    for (i, c) in uvs.iter().enumerate().filter(|(i, _)| finite[*i]) {
        ctx.check_at(i)?;
        match orient(c[0], c[1], c[2]) {
            s if s > 0.0 => solid.push(*c),
            s if s < 0.0 => solid.push([c[0], c[2], c[1]]),
            _ => {}
        }
    }
    let mut boxes: Vec<Aabb> = Vec::with_capacity(solid.len());
    for (i, c) in solid.iter().enumerate() {
        ctx.check_at(i)?;
        boxes.push(Aabb::of(&c.map(|p| Vec3([p[0], p[1], 0.0]))));
    }
    let tree = Bvh::build(&boxes, ctx)?;
    if surely_apart(&solid, &tree, ctx)? {
        return Ok(0);
    }
    counted(&solid, &boxes, &tree, ctx)
}

/// Twice the signed area of a triangle; its sign is exact.
fn orient(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    let [a, b, c] = [a, b, c].map(|p| Coord { x: p[0], y: p[1] });
    orient2d(a, b, c)
}

/// The number of counter-clockwise faces whose inside meets the inside of another, by comparing all whose
/// boxes meet.
pub(super) fn counted(solid: &[FaceUv], boxes: &[Aabb], tree: &Bvh, ctx: &Context<'_>) -> Result<usize> {
    // Convex shapes have disjoint insides exactly where a side of one has all of the other on its far side or
    // on it.
    let parted =
        |a: &FaceUv, b: &FaceUv| (0..3).any(|k| b.iter().all(|p| orient(a[k], a[(k + 1) % 3], *p) <= 0.0));
    let blocks = (0..solid.len())
        .collect::<Vec<_>>()
        .par_chunks(256)
        .map(|block| {
            let mut found = 0;
            for &i in block {
                let (a, region) = (&solid[i], &boxes[i]);
                let mut met = 0;
                let hit = tree.meeting(region, |j| {
                    met += 1;
                    if ctx.check_at(met).is_err() {
                        return ControlFlow::Break(());
                    }
                    let (b, other) = (&solid[j as usize], &boxes[j as usize]);
                    // Boxes that only touch cannot share an inside.
                    let apart =
                        (0..2).any(|k| region.min[k] >= other.max[k] || other.min[k] >= region.max[k]);
                    if j as usize == i || apart || parted(a, b) || parted(b, a) {
                        ControlFlow::Continue(())
                    } else {
                        ControlFlow::Break(())
                    }
                });
                ctx.check()?;
                found += usize::from(hit.is_break());
            }
            Ok(found)
        })
        .collect::<Result<Vec<usize>>>()?;
    Ok(blocks.iter().sum())
}
