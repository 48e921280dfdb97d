//! A visibility buffer: which primitive is seen at each sample, and how far away it is.
//!
//! In: primitives in pixel coordinates. Out: the nearest primitive's number per sample. The picture is cut
//! into bands of rows; each thread fills its own bands, so that the result does not depend on the threads.

use atlasfit::{Context, Result};
use rayon::prelude::*;

/// Samples per pixel along each axis.
pub const OVER: usize = 2;
/// Rows of samples per band.
const BAND: usize = 32;
/// Primitives that are drawn between two looks at what ends the run.
const PRIMITIVES_PER_CHECK: usize = 64;
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

/// What is seen at each sample.
pub struct Canvas {
    /// Samples per row and rows of samples.
    pub size: [usize; 2],
    /// Number of the nearest primitive, or [`NOTHING`].
    pub id: Vec<u32>,
    /// Its depth.
    pub depth: Vec<f32>,
}

impl Canvas {
    /// Draws primitives. Those that are not finite are left out.
    pub fn draw(size: [usize; 2], primitives: &[Primitive], ctx: &Context<'_>) -> Result<Self> {
        let [width, height] = size;
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
        let mut id = vec![NOTHING; width * height];
        let mut depth = vec![f32::INFINITY; width * height];
        id.par_chunks_mut(BAND * width)
            .zip(depth.par_chunks_mut(BAND * width))
            .zip(bands)
            .enumerate()
            .try_for_each(|(b, ((id, depth), band))| {
                let mut rows = Rows { first: b * BAND, count: id.len() / width, width, id, depth };
                for (n, i) in band.into_iter().enumerate() {
                    // A large primitive takes up to a millisecond per band.
                    if n.is_multiple_of(PRIMITIVES_PER_CHECK) {
                        ctx.check()?;
                    }
                    rows.draw(i, &primitives[i as usize]);
                }
                Ok(())
            })?;
        Ok(Self { size, id, depth })
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
    fn put(&mut self, x: usize, y: usize, z: f32, id: u32) {
        let at = (y - self.first) * self.width + x;
        if z < self.depth[at] {
            self.depth[at] = z;
            self.id[at] = id;
        }
    }
    /// The samples whose centres may lie between `lo` and `hi`.
    fn columns(&self, lo: f32, hi: f32) -> std::ops::Range<usize> {
        let from = (lo - 0.5).ceil().max(0.0) as usize;
        from..(((hi - 0.5).floor() + 1.0).max(0.0) as usize).min(self.width)
    }
    fn rows(&self, lo: f32, hi: f32) -> std::ops::Range<usize> {
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
            for x in self.columns(c[0] - w, c[0] + w) {
                let dx = x as f32 + 0.5 - c[0];
                self.put(x, y, c[2] + bulge * ((dx * dx + dy * dy) / r2 - 1.0), id);
            }
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
            for x in self.columns(from, to) {
                let w = weights.at(x as f32 + 0.5, py);
                self.put(x, y, w[0] * t[0][2] + w[1] * t[1][2] + w[2] * t[2][2], id);
            }
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
        let canvas = atlasfit::Run::default().execute(|ctx| Canvas::draw([64, 64], &all, ctx)).unwrap();
        assert!(canvas.id.iter().all(|i| *i == NOTHING || *i < 4));
        for y in 3..60 {
            for x in 3..59 {
                let id = canvas.id[y * 64 + x];
                assert_eq!(id >= 2, x >= 30 && y >= 30, "{x} {y} {id}");
            }
        }
        assert_eq!(canvas.id[0], NOTHING);
    }
}
