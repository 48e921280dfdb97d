//! The surface in a window as a height over a plane: a quadric, and a bend along a line.
//!
//! In: points in the window's frame. Out: the model that makes them likeliest, and how likely.
//! z = c0 + c1 x + c2 y + c3 x² + c4 x y + c5 y² + c6 sqrt(q² + w²), with q = x - t - k y - m y² the distance
//! across the line. The bend is a crease where its width w is 0.

use super::constants::CREASE;
use crate::numeric::dense::{cholesky, cholesky_solve};
use crate::numeric::robust::{TUKEY, tukey};

/// Numbers that enter linearly.
const LINEAR: usize = 7;
/// All numbers of a model.
pub(super) const UNKNOWNS: usize = LINEAR + 3;

/// A model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Model {
    /// The coefficients c0 to c6.
    coefficients: [f64; LINEAR],
    /// t: where the line crosses the first axis.
    offset: f64,
    /// k: how much it is turned from the second.
    pub skew: f64,
    /// m: how it is bent.
    arc: f64,
    /// w: width of the bend.
    width: f64,
}

impl Model {
    /// A flat model whose line goes through `offset`.
    fn flat(offset: f64, width: f64) -> Self {
        Self { coefficients: [0.0; LINEAR], offset, skew: 0.0, arc: 0.0, width }
    }
    /// The same with a bend of another width.
    pub fn with_width(self, width: f64) -> Self {
        Self { width, ..self }
    }
    /// Where the line is at `y`.
    pub fn line(&self, y: f64) -> f64 {
        self.offset + (self.skew + self.arc * y) * y
    }
    /// Across the line: its distance and the bend's height there, for a coefficient of 1.
    fn bend(&self, x: f64, y: f64) -> (f64, f64) {
        let q = x - self.line(y);
        (q, (q * q + self.width * self.width).sqrt())
    }
    /// The height.
    pub fn height(&self, x: f64, y: f64) -> f64 {
        let terms = [1.0, x, y, x * x, x * y, y * y, self.bend(x, y).1];
        self.coefficients.iter().zip(terms).map(|(c, t)| c * t).sum()
    }
    /// How the height grows along both axes. On a crease, as halfway between the two sides.
    pub fn slopes(&self, x: f64, y: f64) -> [f64; 2] {
        let c = &self.coefficients;
        let (q, b) = self.bend(x, y);
        let side = if b > 0.0 { c[6] * q / b } else { 0.0 };
        [
            c[1] + 2.0 * c[3] * x + c[4] * y + side,
            c[2] + c[4] * x + 2.0 * c[5] * y - side * (self.skew + 2.0 * self.arc * y),
        ]
    }
    /// The model of the frame turned half around its third axis.
    pub fn turned(mut self) -> Self {
        self.coefficients[1] = -self.coefficients[1];
        self.coefficients[2] = -self.coefficients[2];
        self.offset = -self.offset;
        self.arc = -self.arc;
        self
    }
    /// Distance of a point from the surface, about.
    fn distance(&self, [x, y, z]: [f64; 3]) -> f64 {
        let [hx, hy] = self.slopes(x, y);
        (z - self.height(x, y)) / (1.0 + hx * hx + hy * hy).sqrt()
    }
    /// How much less likely than on the surface itself the points are, in nats, with noise of this standard
    /// deviation.
    pub fn misfit(&self, points: &[[f64; 3]], sigma: f64) -> f64 {
        points.iter().map(|&p| cost(self.distance(p) / sigma)).sum()
    }
    /// One step towards the likeliest model (Gauss and Newton, with Tukey's weights); none where the points
    /// do not determine it.
    fn step(&mut self, points: &[[f64; 3]], sigma: f64, first: bool) -> Option<()> {
        const N: usize = UNKNOWNS;
        let (mut a, mut b) = ([0.0; N * N], [0.0; N]);
        for &[x, y, z] in points {
            let (q, bend) = self.bend(x, y);
            let side = if bend > 0.0 { self.coefficients[6] * q / bend } else { 0.0 };
            let row = [1.0, x, y, x * x, x * y, y * y, bend, -side, -side * y, -side * y * y];
            let [hx, hy] = self.slopes(x, y);
            let cos2 = 1.0 / (1.0 + hx * hx + hy * hy);
            let off = z - self.height(x, y);
            let weight = if first { 1.0 } else { cos2 * trust(off * cos2.sqrt() / sigma) };
            for i in 0..N {
                let f = weight * row[i];
                (i..N).for_each(|j| a[i * N + j] += f * row[j]);
                b[i] += f * off;
            }
        }
        let n = points.len() as f64;
        (0..N).for_each(|i| a[i * (N + 1)] += CREASE.ridge * n);
        if !cholesky(&mut a, N) {
            return None;
        }
        cholesky_solve(&a, N, &mut b);
        self.coefficients.iter_mut().zip(b).for_each(|(c, d)| *c += d);
        self.offset += b[LINEAR].clamp(-CREASE.most_shift, CREASE.most_shift);
        self.skew += b[LINEAR + 1].clamp(-CREASE.most_skew, CREASE.most_skew);
        self.arc += b[LINEAR + 2].clamp(-CREASE.most_arc, CREASE.most_arc);
        self.coefficients.iter().all(|c| c.is_finite()).then_some(())
    }
}

/// How much a point counts in a fit.
fn trust(off: f64) -> f64 {
    tukey(off, TUKEY).max(CREASE.least_weight)
}

/// What a point costs, in nats, at so many standard deviations: no more than a stray.
pub(super) fn cost(off: f64) -> f64 {
    0.5 * (off * off).min(TUKEY * TUKEY)
}

/// The likeliest model with a crease, and the points' misfit. The line is tried at a few places first.
pub(super) fn crease(points: &[[f64; 3]], sigma: f64) -> Option<(Model, f64)> {
    let tried = CREASE.starts.map(|offset| {
        let mut model = Model::flat(offset, 0.0);
        model.step(points, sigma, true)?;
        Some((model, model.misfit(points, sigma)))
    });
    let best = tried.into_iter().flatten().min_by(|a, b| a.1.total_cmp(&b.1))?;
    fit(points, sigma, best.0)
}

/// The likeliest model from a start, and the points' misfit.
pub(super) fn fit(points: &[[f64; 3]], sigma: f64, start: Model) -> Option<(Model, f64)> {
    let mut model = start;
    for step in 0..CREASE.steps {
        model.step(points, sigma, step == 0)?;
    }
    Some((model, model.misfit(points, sigma)))
}

/// The misfit of the likeliest polynomial of the second or third degree, and how many coefficients it has.
pub(super) fn polynomial(points: &[[f64; 3]], sigma: f64, cubic: bool) -> Option<(f64, usize)> {
    const N: usize = 10;
    let n = if cubic { N } else { 6 };
    let terms = |x: f64, y: f64| [1.0, x, y, x * x, x * y, y * y, x * x * x, x * x * y, x * y * y, y * y * y];
    let slopes = |c: &[f64; N], x: f64, y: f64| {
        let of = |d: [f64; N]| -> f64 { c.iter().zip(d).map(|(c, d)| c * d).sum() };
        let along_x = [0.0, 1.0, 0.0, 2.0 * x, y, 0.0, 3.0 * x * x, 2.0 * x * y, y * y, 0.0];
        let along_y = [0.0, 0.0, 1.0, 0.0, x, 2.0 * y, 0.0, x * x, 2.0 * x * y, 3.0 * y * y];
        [of(along_x), of(along_y)]
    };
    let off = |c: &[f64; N], [x, y, z]: [f64; 3]| {
        let [hx, hy] = slopes(c, x, y);
        let height: f64 = c.iter().zip(terms(x, y)).map(|(c, t)| c * t).sum();
        (z - height, 1.0 / (1.0 + hx * hx + hy * hy))
    };
    let mut c = [0.0; N];
    for step in 0..CREASE.steps {
        let (mut a, mut b) = ([0.0; N * N], [0.0; N]);
        for &p in points {
            let row = terms(p[0], p[1]);
            let (d, cos2) = off(&c, p);
            let weight = if step == 0 { 1.0 } else { cos2 * trust(d * cos2.sqrt() / sigma) };
            for i in 0..n {
                let f = weight * row[i];
                (i..n).for_each(|j| a[i * n + j] += f * row[j]);
                b[i] += f * p[2];
            }
        }
        (0..n).for_each(|i| a[i * (n + 1)] += CREASE.ridge * points.len() as f64);
        if !cholesky(&mut a[..n * n], n) {
            return None;
        }
        cholesky_solve(&a[..n * n], n, &mut b[..n]);
        c = b;
    }
    let misfit = points
        .iter()
        .map(|&p| {
            let (d, cos2) = off(&c, p);
            cost(d * cos2.sqrt() / sigma)
        })
        .sum();
    Some((misfit, n))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ridge, askew, on a grid.
    fn ridge() -> Vec<[f64; 3]> {
        let at = |k: i32| (f64::from(k % 11) - 5.0, f64::from(k / 11) - 5.0);
        let height = |x: f64, y: f64| 0.3 * y - (x - 0.3 - 0.1 * y).abs();
        (0..121).map(|k| (at(k).0, at(k).1, height(at(k).0, at(k).1)).into()).collect()
    }

    #[test]
    fn two_planes_are_found_exactly() {
        let (model, misfit) = crease(&ridge(), 0.05).expect("a fit");
        assert!(misfit < 1e-6, "{misfit}");
        assert!((model.line(0.0) - 0.3).abs() < 1e-4 && (model.line(2.0) - 0.5).abs() < 1e-4, "{model:?}");
    }

    #[test]
    fn slopes_are_the_derivatives_of_the_height() {
        let mut model = Model::flat(0.2, 0.5);
        model.coefficients = [0.1, -0.2, 0.3, 0.05, -0.04, 0.06, 0.7];
        (model.skew, model.arc) = (0.1, -0.02);
        for (x, y) in [(0.4, 1.0), (-1.5, 0.3), (2.0, -2.0)] {
            let h = 1e-6;
            let along_x = (model.height(x + h, y) - model.height(x - h, y)) / (2.0 * h);
            let along_y = (model.height(x, y + h) - model.height(x, y - h)) / (2.0 * h);
            let [hx, hy] = model.slopes(x, y);
            assert!(
                (hx - along_x).abs() < 1e-8 && (hy - along_y).abs() < 1e-8,
                "{hx} {along_x} {hy} {along_y}"
            );
            // Turned half around, the same place has the same height.
            assert!((model.turned().height(-x, -y) - model.height(x, y)).abs() < 1e-12);
        }
    }

    #[test]
    fn a_cubic_explains_what_a_quadric_does_not() {
        let points: Vec<[f64; 3]> = ridge().iter().map(|p| [p[0], p[1], 0.01 * p[0].powi(3)]).collect();
        let [quadric, cubic] = [false, true].map(|cubic| polynomial(&points, 0.05, cubic).expect("a fit"));
        assert!(quadric.0 > 10.0 && cubic.0 < 1e-6, "{quadric:?} {cubic:?}");
    }
}
