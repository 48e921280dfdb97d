//! A visibility buffer: which primitive is seen at each sample, and how far away it is.
//!
//! In: primitives in pixel coordinates. Out: the nearest primitive's number per sample, for the rows asked
//! for. A picture is drawn in bands of rows by several threads and never held whole, so that a large one
//! takes little memory, and ends at once when the run does. The result does not depend on bands or threads.

use atlasfit::{Context, Result};
use std::ops::Range;

/// Samples per pixel along each axis.
pub const OVER: usize = 2;
/// Rows of samples per band: a whole number of pixels.
pub const BAND: usize = 32 * OVER;
/// Primitives that are drawn between two looks at what ends the run.
const PRIMITIVES_PER_CHECK: usize = 16;
/// No primitive here.
pub const NOTHING: u32 = u32::MAX;

/// Something that can be drawn. Coordinates are samples; z is depth, smaller = nearer.
#[derive(Debug, Clone, Copy)]
pub enum Primitive {
    /// A triangle.
    Triangle([[f32; 3]; 3]),
    /// A line between two ends.
    Line { ends: [[f32; 3]; 2], half_width: f32 },
    /// A disc that bulges towards the viewer by a depth, so that discs side by side meet half-way.
    Disc { centre: [f32; 3], radius: f32, bulge: f32 },
}

/// Primitives, and which bands each may touch.
pub struct Drawing<'p> {
    /// Samples per row and rows of samples.
    pub size: [usize; 2],
    primitives: &'p [Primitive],
    /// Numbers of the primitives of each band, in rising order.
    bands: Vec<Vec<u32>>,
}

/// What is seen at each sample of some rows.
pub struct Canvas {
    /// The rows.
    pub rows: Range<usize>,
    /// Samples per row.
    pub width: usize,
    /// Number of the nearest primitive, or [`NOTHING`].
    pub id: Vec<u32>,
    /// Its depth.
    pub depth: Vec<f32>,
}

impl<'p> Drawing<'p> {
    /// Takes primitives. Those that are not finite are left out.
    pub fn new(size: [usize; 2], primitives: &'p [Primitive], ctx: &Context<'_>) -> Result<Self> {
        let height = size[1];
        let mut bands: Vec<Vec<u32>> = vec![Vec::new(); height.div_ceil(BAND)];
        for (i, p) in primitives.iter().enumerate() {
            ctx.check_at(i)?;
            let (lo, hi) = p.rows();
            if lo.is_finite() && hi.is_finite() && hi >= 0.0 && lo < height as f32 {
                let last = (hi as usize / BAND).min(bands.len() - 1);
                for band in &mut bands[lo.max(0.0) as usize / BAND..=last] {
                    band.push(i as u32);
                }
            }
        }
        Ok(Self { size, primitives, bands })
    }

    /// Bands of rows, from the top; the last may be lower.
    pub fn bands(&self) -> Vec<Range<usize>> {
        let height = self.size[1];
        (0..height).step_by(BAND).map(|from| from..(from + BAND).min(height)).collect()
    }

    /// Draws rows of the picture.
    pub fn draw(&self, rows: Range<usize>, ctx: &Context<'_>) -> Result<Canvas> {
        let width = self.size[0];
        let (mut id, mut depth) =
            (vec![NOTHING; rows.len() * width], vec![f32::INFINITY; rows.len() * width]);
        for b in rows.start / BAND..rows.end.div_ceil(BAND) {
            let part = rows.start.max(b * BAND)..rows.end.min((b + 1) * BAND);
            let at = (part.start - rows.start) * width..(part.end - rows.start) * width;
            let (id, depth) = (&mut id[at.clone()], &mut depth[at]);
            let mut part = Rows { first: part.start, count: part.len(), width, id, depth };
            for (n, &i) in self.bands[b].iter().enumerate() {
                // A large primitive takes up to a millisecond per band.
                if n.is_multiple_of(PRIMITIVES_PER_CHECK) {
                    ctx.check()?;
                }
                part.draw(i, &self.primitives[i as usize]);
            }
        }
        Ok(Canvas { rows, width, id, depth })
    }
}

impl Canvas {
    /// The place of a sample of the picture in this canvas' arrays. Its row must be one of this canvas.
    pub fn at(&self, [x, y]: [usize; 2]) -> usize {
        (y - self.rows.start) * self.width + x
    }
}

impl Primitive {
    /// The first and the last row that it may touch; not finite where it is not.
    fn rows(&self) -> (f32, f32) {
        match self {
            Self::Triangle(t) => {
                // A sum that is not finite spoils both ends: such a triangle is left out.
                let bad = t.iter().flatten().sum::<f32>() * 0.0;
                (t[0][1].min(t[1][1]).min(t[2][1]) + bad, t[0][1].max(t[1][1]).max(t[2][1]) + bad)
            }
            Self::Line { ends: [a, b], half_width: w } => {
                let bad = a.iter().chain(b).sum::<f32>() * 0.0;
                (a[1].min(b[1]) - w + bad, a[1].max(b[1]) + w + bad)
            }
            Self::Disc { centre: c, radius: r, .. } => {
                let bad = c.iter().sum::<f32>() * 0.0;
                (c[1] - r + bad, c[1] + r + bad)
            }
        }
    }
}

/// One band of rows while it is drawn.
struct Rows<'a> {
    first: usize,
    count: usize,
    width: usize,
    id: &'a mut [u32],
    depth: &'a mut [f32],
}

impl Rows<'_> {
    /// Shows primitive `id` at some samples of row `y`, where it is the nearest; `depth_at` gives its depth
    /// at a sample's middle.
    fn put(&mut self, [y, id]: [u32; 2], columns: Range<usize>, depth_at: impl Fn(f32) -> f32) {
        if columns.is_empty() {
            return;
        }
        let row = (y as usize - self.first) * self.width;
        let at = row + columns.start..row + columns.end;
        // Without a branch, so that several samples are done at once.
        for ((x, depth), seen) in
            (columns.start as i32..).zip(&mut self.depth[at.clone()]).zip(&mut self.id[at])
        {
            let z = depth_at(x as f32 + 0.5);
            let nearer = z < *depth;
            *depth = if nearer { z } else { *depth };
            *seen = if nearer { id } else { *seen };
        }
    }
    /// The samples whose centres may lie between `lo` and `hi`.
    fn columns(&self, lo: f32, hi: f32) -> Range<usize> {
        let from = (lo - 0.5).ceil().max(0.0) as usize;
        from..(((hi - 0.5).floor() + 1.0).max(0.0) as usize).min(self.width)
    }
    fn rows(&self, lo: f32, hi: f32) -> Range<usize> {
        let from = ((lo - 0.5).ceil().max(0.0) as usize).max(self.first);
        from..(((hi - 0.5).floor() + 1.0).max(0.0) as usize).min(self.first + self.count)
    }

    fn draw(&mut self, id: u32, primitive: &Primitive) {
        match primitive {
            Primitive::Triangle(t) => self.triangle(id, t),
            Primitive::Line { ends: [a, b], half_width } => {
                let steps = ((b[0] - a[0]).abs().max((b[1] - a[1]).abs()).ceil() as usize).clamp(1, 1 << 16);
                for s in 0..=steps {
                    let t = s as f32 / steps as f32;
                    self.disc(id, std::array::from_fn(|k| a[k] + t * (b[k] - a[k])), *half_width, 0.0);
                }
            }
            Primitive::Disc { centre, radius, bulge } => self.disc(id, *centre, *radius, *bulge),
        }
    }

    fn disc(&mut self, id: u32, c: [f32; 3], radius: f32, bulge: f32) {
        let r2 = radius * radius;
        for y in self.rows(c[1] - radius, c[1] + radius) {
            let dy = y as f32 + 0.5 - c[1];
            let w = (r2 - dy * dy).max(0.0).sqrt();
            self.put([y as u32, id], self.columns(c[0] - w, c[0] + w), |x| {
                let dx = x - c[0];
                c[2] + bulge * ((dx * dx + dy * dy) / r2 - 1.0)
            });
        }
    }

    fn triangle(&mut self, id: u32, t: &[[f32; 3]; 3]) {
        let Some(weights) = Weights::new(t) else { return };
        let (lo, hi) = (t[0][1].min(t[1][1]).min(t[2][1]), t[0][1].max(t[1][1]).max(t[2][1]));
        for y in self.rows(lo, hi) {
            let py = y as f32 + 0.5;
            // The row's stretch between the sides that it crosses.
            let (mut from, mut to) = (f32::INFINITY, f32::NEG_INFINITY);
            for k in 0..3 {
                let (a, b) = (t[k], t[(k + 1) % 3]);
                if (a[1] <= py) != (b[1] <= py) {
                    let x = a[0] + (py - a[1]) / (b[1] - a[1]) * (b[0] - a[0]);
                    from = from.min(x);
                    to = to.max(x);
                }
            }
            self.put([y as u32, id], self.columns(from, to), |x| {
                let w = weights.at(x, py);
                w[0] * t[0][2] + w[1] * t[1][2] + w[2] * t[2][2]
            });
        }
    }
}

/// Barycentric weights of a triangle in the picture.
pub struct Weights {
    origin: [f32; 2],
    rows: [[f32; 2]; 2],
}

impl Weights {
    /// `None` where the triangle is seen from its side.
    pub fn new(t: &[[f32; 3]; 3]) -> Option<Self> {
        let d = |k: usize| [t[k][0] - t[0][0], t[k][1] - t[0][1]];
        let (b, c) = (d(1), d(2));
        let det = b[0] * c[1] - b[1] * c[0];
        (det != 0.0 && det.is_finite()).then(|| Self {
            origin: [t[0][0], t[0][1]],
            rows: [[c[1] / det, -c[0] / det], [-b[1] / det, b[0] / det]],
        })
    }
    /// Weights of the three corners at a place, kept inside the triangle.
    pub fn at(&self, x: f32, y: f32) -> [f32; 3] {
        let p = [x - self.origin[0], y - self.origin[1]];
        let [b, c] = self.rows.map(|r| (r[0] * p[0] + r[1] * p[1]).clamp(0.0, 1.0));
        [(1.0 - b - c).max(0.0), b, c]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearer_primitive_is_seen_and_shared_sides_leave_no_gap() {
        let square = |z: f32, s: f32| {
            let (a, b, c, d) = ([s, s, z], [60.0, s, z], [60.0, 61.3, z], [s, 61.3, z]);
            [Primitive::Triangle([a, b, c]), Primitive::Triangle([a, c, d])]
        };
        let mut all = square(0.5, 2.2).to_vec();
        all.extend(square(0.1, 30.0));
        let bad = Primitive::Triangle([[f32::NAN; 3], [0.0; 3], [9.0, 60.0, -1.0]]);
        all.push(bad);
        let canvas = atlasfit::Run::default()
            .execute(|ctx| Drawing::new([64, 64], &all, ctx)?.draw(0..64, ctx))
            .unwrap();
        assert!(canvas.id.iter().all(|i| *i == NOTHING || *i < 4));
        for y in 3..60 {
            for x in 3..59 {
                let id = canvas.id[y * 64 + x];
                assert_eq!(id >= 2, x >= 30 && y >= 30, "{x} {y} {id}");
            }
        }
        assert_eq!(canvas.id[0], NOTHING);
    }
    #[test]
    fn rows_are_the_same_whichever_are_drawn_together() {
        let disc = |k: usize| {
            let centre = [(k * 37 % 64) as f32, (k * 53 % 90) as f32, (k % 5) as f32];
            Primitive::Disc { centre, radius: 9.5, bulge: 0.3 }
        };
        let all: Vec<Primitive> = (0..60).map(disc).collect();
        let (whole, part) = atlasfit::Run::default()
            .execute(|ctx| {
                let drawing = Drawing::new([64, 90], &all, ctx)?;
                Ok((drawing.draw(0..90, ctx)?, drawing.draw(27..70, ctx)?))
            })
            .unwrap();
        assert_eq!(part.id, whole.id[27 * 64..70 * 64]);
        assert_eq!(part.depth, whole.depth[27 * 64..70 * 64]);
        assert_eq!(part.at([3, 28]), 67);
    }
}
