//! The surface in a window as a height over a plane: a quadric, and a bend along a line.
//!
//! In: points in the window's frame. Out: the model that makes them likeliest, and how likely.
//! z = c0 + c1 x + c2 y + c3 x² + c4 x y + c5 y² + c6 sqrt(q² + w²), with q = x - t - k y - m y² the distance
//! across the line. The bend is a crease where its width w is 0.

use super::constants::CREASE;
use super::moments::{Columns, Cost, Few, Lanes, Sums, Weigh, Weighed, at, monomials, sum, sums};
use crate::numeric::dense::{cholesky, cholesky_solve};
use crate::numeric::robust::{TUKEY, cost, tukey};

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

/// The surface of a model at a place.
struct At {
    height: f64,
    slopes: [f64; 2],
    /// The bend's height there, for a coefficient of 1.
    bend: f64,
    /// How the bend's part of the height grows across the line.
    side: f64,
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
    /// Whether the surface falls on both sides of the line, seen along the normal; else it rises.
    pub fn is_ridge(&self) -> bool {
        self.coefficients[6] < 0.0
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
        self.at(x, y).height
    }
    /// How the height grows along both axes. On a crease, as halfway between the two sides.
    pub fn slopes(&self, x: f64, y: f64) -> [f64; 2] {
        self.at(x, y).slopes
    }
    /// The surface at a place.
    fn at(&self, x: f64, y: f64) -> At {
        let c = &self.coefficients;
        let (q, bend) = self.bend(x, y);
        let side = if bend > 0.0 { c[6] * q / bend } else { 0.0 };
        let slopes = [
            c[1] + 2.0 * c[3] * x + c[4] * y + side,
            c[2] + c[4] * x + 2.0 * c[5] * y - side * (self.skew + 2.0 * self.arc * y),
        ];
        let terms = [1.0, x, y, x * x, x * y, y * y, bend];
        At { height: c.iter().zip(terms).map(|(c, t)| c * t).sum(), slopes, bend, side }
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
        let At { height, slopes: [hx, hy], .. } = self.at(x, y);
        (z - height) / (1.0 + hx * hx + hy * hy).sqrt()
    }
    /// How much less likely than on the surface itself a point is, in nats, with noise of this standard
    /// deviation.
    pub fn misfit(&self, point: [f64; 3], sigma: f64) -> f64 {
        cost(self.distance(point) / sigma)
    }
    /// The same of all points.
    fn misfits(&self, points: &Columns, sigma: f64) -> f64 {
        sum(points, &Noisy { model: self, sigma, first: false })
    }
    /// One step towards the likeliest model (Gauss and Newton, with Tukey's weights); none where the points
    /// do not determine it.
    fn step(&mut self, points: &Columns, sigma: f64, first: bool) -> Option<()> {
        let noisy = Noisy { model: self, sigma, first };
        let equations = if self.width > 0.0 { noisy.by_rows(points) } else { noisy.by_moments(points) };
        let mut step = equations.solved(points.len)?;
        // Where the line would go too far, the whole step is shorter: its numbers belong together.
        let most = [CREASE.most_shift, CREASE.most_skew, CREASE.most_arc];
        let share = step[LINEAR..].iter().zip(most).fold(1.0, |s: f64, (d, most)| s.min(most / d.abs()));
        step.iter_mut().for_each(|d| *d *= share);
        self.coefficients.iter_mut().zip(step).for_each(|(c, d)| *c += d);
        self.offset += step[LINEAR];
        self.skew += step[LINEAR + 1];
        self.arc += step[LINEAR + 2];
        self.coefficients.iter().all(|c| c.is_finite()).then_some(())
    }
}

/// A model of points with noise of this standard deviation.
struct Noisy<'a> {
    model: &'a Model,
    sigma: f64,
    /// Whether all points count alike.
    first: bool,
}

/// Of some points: how far they are off along the third axis, the square of the cosine of the slope there,
/// and the side of the line.
struct Off {
    off: Lanes,
    cos2: Lanes,
    sign: Lanes,
}

impl Noisy<'_> {
    #[inline(always)]
    fn off(&self, p: &Few) -> Off {
        let Model { coefficients: c, offset, skew, arc, width } = *self.model;
        let mut out = Off { off: [0.0; 4], cos2: [0.0; 4], sign: [0.0; 4] };
        for l in 0..4 {
            let (x, y) = (p.x[l], p.y[l]);
            let q = x - (offset + (skew + arc * y) * y);
            let sign = if q < 0.0 { -1.0 } else { 1.0 };
            let bend = if width > 0.0 { (q * q + width * width).sqrt() } else { sign * q };
            let side = c[6] * if width > 0.0 { q / bend } else { sign };
            let hx = c[1] + 2.0 * c[3] * x + c[4] * y + side;
            let hy = c[2] + c[4] * x + 2.0 * c[5] * y - side * (skew + 2.0 * arc * y);
            let flat = c[0] + c[1] * x + c[2] * y + c[3] * x * x + c[4] * x * y + c[5] * y * y;
            out.off[l] = p.z[l] - (flat + c[6] * bend);
            out.cos2[l] = 1.0 / (1.0 + hx * hx + hy * hy);
            out.sign[l] = sign;
        }
        out
    }
    /// The equations of a step, point by point.
    fn by_rows(&self, points: &Columns) -> Equations {
        let mut equations = Equations::default();
        for [x, y, z] in points.points() {
            let At { height, slopes: [hx, hy], bend, side } = self.model.at(x, y);
            let row = [1.0, x, y, x * x, x * y, y * y, bend, -side, -side * y, -side * y * y];
            let cos2 = 1.0 / (1.0 + hx * hx + hy * hy);
            let off = z - height;
            let weight = if self.first { 1.0 } else { cos2 * trust(off * cos2.sqrt() / self.sigma) };
            equations.add(&row, weight, off);
        }
        equations
    }
    /// The same where the line is a crease: on either side of it all is polynomial.
    fn by_moments(&self, points: &Columns) -> Equations {
        let Model { coefficients: c, offset, skew, arc, .. } = *self.model;
        let found: [Sums<{ monomials(4) }, { monomials(2) }>; 2] = sums(points, self);
        // A row is made of terms: a factor, whether it has the side's sign, powers of x and y.
        let term = |factor, signed, i, j| Term { factor, signed, i, j };
        let plain = [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)].map(|(i, j)| term(1.0, 0, i, j));
        let bend = [term(1.0, 1, 1, 0), term(-offset, 1, 0, 0), term(-skew, 1, 0, 1), term(-arc, 1, 0, 2)];
        let line = [0, 1, 2].map(|j| term(-c[6], 1, 0, j));
        let rows = plain.chunks(1).chain([&bend[..]]).chain(line.chunks(1));
        let product = |row: &[Term], other: &[Term]| -> f64 {
            let of = |a: &Term, b: &Term| {
                a.factor * b.factor * found[(a.signed + b.signed) % 2].alone[at(a.i + b.i, a.j + b.j)]
            };
            row.iter().map(|a| other.iter().map(|b| of(a, b)).sum::<f64>()).sum()
        };
        let mut equations = Equations::default();
        for (i, row) in rows.clone().enumerate() {
            for (j, other) in rows.clone().enumerate().skip(i) {
                equations.a[i * UNKNOWNS + j] = product(row, other);
            }
            equations.b[i] = row.iter().map(|a| a.factor * found[a.signed].values[at(a.i, a.j)]).sum();
        }
        equations
    }
}

/// Part of a row of equations: a factor times powers of x and y, and times the sign of the side if that is 1.
struct Term {
    factor: f64,
    signed: usize,
    i: usize,
    j: usize,
}

impl Weigh for Noisy<'_> {
    const SIDED: bool = true;
    #[inline(always)]
    fn weigh(&self, points: &Few) -> Weighed {
        let Off { off, cos2, sign } = self.off(points);
        let weight = if self.first { [1.0; 4] } else { trusted(&off, &cos2, self.sigma) };
        Weighed { weight, value: off, sign }
    }
}

impl Cost for Noisy<'_> {
    #[inline(always)]
    fn cost(&self, points: &Few) -> Lanes {
        let Off { off, cos2, .. } = self.off(points);
        costs(&off, &cos2, self.sigma)
    }
}

/// How much points count in a fit, by how far they are off along the third axis, and the square of the cosine
/// of the slope there.
#[inline(always)]
fn trusted(off: &Lanes, cos2: &Lanes, sigma: f64) -> Lanes {
    let limit = (sigma * TUKEY * sigma * TUKEY).recip();
    let mut weight = [0.0; 4];
    for l in 0..4 {
        let t = (1.0 - off[l] * off[l] * cos2[l] * limit).max(0.0);
        weight[l] = cos2[l] * (t * t).max(CREASE.least_weight);
    }
    weight
}

/// What points that are so far off cost.
#[inline(always)]
fn costs(off: &Lanes, cos2: &Lanes, sigma: f64) -> Lanes {
    let scale = (sigma * sigma).recip();
    let mut out = [0.0; 4];
    for l in 0..4 {
        out[l] = 0.5 * (off[l] * off[l] * cos2[l] * scale).min(TUKEY * TUKEY);
    }
    out
}

/// The normal equations of a weighted fit.
struct Equations {
    a: [f64; UNKNOWNS * UNKNOWNS],
    b: [f64; UNKNOWNS],
}

impl Default for Equations {
    fn default() -> Self {
        Self { a: [0.0; UNKNOWNS * UNKNOWNS], b: [0.0; UNKNOWNS] }
    }
}

impl Equations {
    /// Those of the first so many monomials.
    fn of_monomials<const M: usize, const V: usize>(sums: &Sums<M, V>, unknowns: usize) -> Self {
        let mut equations = Self::default();
        let powers = (0..=3).flat_map(|d| (0..=d).map(move |j| (d - j, j)));
        let powers: Vec<(usize, usize)> = powers.take(unknowns).collect();
        for (i, a) in powers.iter().enumerate() {
            for (j, b) in powers.iter().enumerate().skip(i) {
                equations.a[i * UNKNOWNS + j] = sums.alone[at(a.0 + b.0, a.1 + b.1)];
            }
            equations.b[i] = sums.values[i];
        }
        equations
    }
    /// Adds a point whose `value` is to be the product of the unknowns with `row`.
    fn add(&mut self, row: &[f64; UNKNOWNS], weight: f64, value: f64) {
        for i in 0..UNKNOWNS {
            let f = weight * row[i];
            (i..UNKNOWNS).for_each(|j| self.a[i * UNKNOWNS + j] += f * row[j]);
            self.b[i] += f * value;
        }
    }
    /// The unknowns; none where that many points do not determine them. Those that no row has are 0.
    fn solved(mut self, points: usize) -> Option<[f64; UNKNOWNS]> {
        (0..UNKNOWNS).for_each(|i| self.a[i * (UNKNOWNS + 1)] += CREASE.ridge * points as f64);
        if !cholesky(&mut self.a, UNKNOWNS) {
            return None;
        }
        cholesky_solve(&self.a, UNKNOWNS, &mut self.b);
        Some(self.b)
    }
}

/// How much a point counts in a fit.
fn trust(off: f64) -> f64 {
    tukey(off, TUKEY).max(CREASE.least_weight)
}

/// The likeliest model with a crease, and the points' misfit. The line is tried at these places first.
pub(super) fn crease(points: &Columns, sigma: f64, starts: &[f64]) -> Option<(Model, f64)> {
    let tried = starts.iter().filter_map(|&offset| {
        let mut model = Model::flat(offset, 0.0);
        model.step(points, sigma, true)?;
        Some((model, model.misfits(points, sigma)))
    });
    let best = tried.min_by(|a, b| a.1.total_cmp(&b.1))?;
    fit(points, sigma, best.0)
}

/// The likeliest model from a start, and the points' misfit.
pub(super) fn fit(points: &Columns, sigma: f64, start: Model) -> Option<(Model, f64)> {
    let mut model = start;
    for step in 0..CREASE.steps {
        model.step(points, sigma, step == 0)?;
    }
    Some((model, model.misfits(points, sigma)))
}

/// A polynomial of the third degree, its coefficients as monomials are counted.
struct Polynomial {
    c: [f64; UNKNOWNS],
    sigma: f64,
    /// Whether all points count alike.
    first: bool,
}

impl Polynomial {
    /// How far points are off along the third axis, and the square of the cosine of the slope there.
    #[inline(always)]
    fn off(&self, p: &Few) -> (Lanes, Lanes) {
        let c = &self.c;
        let (mut off, mut cos2) = ([0.0; 4], [0.0; 4]);
        for l in 0..4 {
            let (x, y) = (p.x[l], p.y[l]);
            let (xx, xy, yy) = (x * x, x * y, y * y);
            let flat = c[0] + c[1] * x + c[2] * y + c[3] * xx + c[4] * xy + c[5] * yy;
            off[l] = p.z[l] - (flat + (c[6] * xx + c[7] * xy) * x + (c[8] * xy + c[9] * yy) * y);
            let hx = c[1] + 2.0 * c[3] * x + c[4] * y + 3.0 * c[6] * xx + 2.0 * c[7] * xy + c[8] * yy;
            let hy = c[2] + c[4] * x + 2.0 * c[5] * y + c[7] * xx + 2.0 * c[8] * xy + 3.0 * c[9] * yy;
            cos2[l] = 1.0 / (1.0 + hx * hx + hy * hy);
        }
        (off, cos2)
    }
}

impl Weigh for Polynomial {
    const SIDED: bool = false;
    #[inline(always)]
    fn weigh(&self, points: &Few) -> Weighed {
        let (off, cos2) = self.off(points);
        let weight = if self.first { [1.0; 4] } else { trusted(&off, &cos2, self.sigma) };
        Weighed { weight, value: points.z, sign: [1.0; 4] }
    }
}

impl Cost for Polynomial {
    #[inline(always)]
    fn cost(&self, points: &Few) -> Lanes {
        let (off, cos2) = self.off(points);
        costs(&off, &cos2, self.sigma)
    }
}

/// The misfit of the likeliest polynomial of the second or third degree, and how many coefficients it has.
pub(super) fn polynomial(points: &Columns, sigma: f64, cubic: bool) -> Option<(f64, usize)> {
    let unknowns = monomials(if cubic { 3 } else { 2 });
    let mut of = Polynomial { c: [0.0; UNKNOWNS], sigma, first: true };
    for step in 0..CREASE.steps {
        of.first = step == 0;
        of.c = if cubic {
            let [found, _]: [Sums<{ monomials(6) }, { monomials(3) }>; 2] = sums(points, &of);
            Equations::of_monomials(&found, unknowns)
        } else {
            let [found, _]: [Sums<{ monomials(4) }, { monomials(2) }>; 2] = sums(points, &of);
            Equations::of_monomials(&found, unknowns)
        }
        .solved(points.len)?;
    }
    Some((sum(points, &of), unknowns))
}

#[cfg(test)]
impl Model {
    /// The ridge of two planes that fall at 45 degrees on both sides of the second axis.
    pub(super) fn roof() -> Self {
        Self { coefficients: [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0], ..Self::flat(0.0, 0.0) }
    }
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
        let (model, misfit) = crease(&Columns::new(&ridge()), 0.05, &CREASE.starts).expect("a fit");
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
    fn moments_give_the_equations_that_rows_give() {
        let points: Vec<[f64; 3]> = ridge()
            .iter()
            .map(|p| [p[0] + 0.01, p[1], p[2] + 0.1 * (7.0 * p[0] + 3.0 * p[1]).sin()])
            .collect();
        let points = Columns::new(&points);
        let mut model = Model::flat(0.2, 0.0);
        model.coefficients = [0.1, -0.2, 0.3, 0.05, -0.04, 0.06, -0.7];
        (model.skew, model.arc) = (0.1, -0.02);
        for first in [false, true] {
            let noisy = Noisy { model: &model, sigma: 0.3, first };
            let [rows, moments] = [noisy.by_rows(&points), noisy.by_moments(&points)];
            let pairs = rows.a.iter().zip(&moments.a).chain(rows.b.iter().zip(&moments.b));
            for (a, b) in pairs {
                assert!((a - b).abs() < 1e-9 * (1.0 + a.abs()), "{a} {b}");
            }
        }
    }

    #[test]
    fn a_cubic_explains_what_a_quadric_does_not() {
        let points: Vec<[f64; 3]> = ridge().iter().map(|p| [p[0], p[1], 0.01 * p[0].powi(3)]).collect();
        let [quadric, cubic] =
            [false, true].map(|cubic| polynomial(&Columns::new(&points), 0.05, cubic).expect("a fit"));
        assert!(quadric.0 > 10.0 && cubic.0 < 1e-6, "{quadric:?} {cubic:?}");
    }
}
