//! The surface in a window as a height over a plane: a quadric, and a bend along a line.
//!
//! In: points in the window's frame. Out: the model that makes them likeliest, and how likely.
//! z = c0 + c1 x + c2 y + c3 x² + c4 x y + c5 y² + c6 sqrt(q² + w²), with q = x - t - k y - m y² the distance
//! across the line. The bend is a crease where its width w is 0.

use super::constants::CREASE;
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
    /// How much less likely than on the surface itself the points are, in nats, with noise of this standard
    /// deviation.
    pub fn misfit(&self, points: &[[f64; 3]], sigma: f64) -> f64 {
        points.iter().map(|&p| cost(self.distance(p) / sigma)).sum()
    }
    /// One step towards the likeliest model (Gauss and Newton, with Tukey's weights); none where the points
    /// do not determine it.
    fn step(&mut self, points: &[[f64; 3]], sigma: f64, first: bool) -> Option<()> {
        let mut equations = Equations::default();
        for &[x, y, z] in points {
            let At { height, slopes: [hx, hy], bend, side } = self.at(x, y);
            let row = [1.0, x, y, x * x, x * y, y * y, bend, -side, -side * y, -side * y * y];
            let cos2 = 1.0 / (1.0 + hx * hx + hy * hy);
            let off = z - height;
            let weight = if first { 1.0 } else { cos2 * trust(off * cos2.sqrt() / sigma) };
            equations.add(&row, weight, off);
        }
        let mut step = equations.solved(points.len())?;
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
pub(super) fn crease(points: &[[f64; 3]], sigma: f64, starts: &[f64]) -> Option<(Model, f64)> {
    let tried = starts.iter().filter_map(|&offset| {
        let mut model = Model::flat(offset, 0.0);
        model.step(points, sigma, true)?;
        Some((model, model.misfit(points, sigma)))
    });
    let best = tried.min_by(|a, b| a.1.total_cmp(&b.1))?;
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
    let (third, unknowns) = if cubic { (1.0, UNKNOWNS) } else { (0.0, 6) };
    let terms = |x: f64, y: f64| {
        let cubes = [x * x * x, x * x * y, x * y * y, y * y * y].map(|t| third * t);
        [1.0, x, y, x * x, x * y, y * y, cubes[0], cubes[1], cubes[2], cubes[3]]
    };
    let of = |c: &[f64; UNKNOWNS], d: [f64; UNKNOWNS]| -> f64 { c.iter().zip(d).map(|(c, d)| c * d).sum() };
    // How far a point is off along the third axis, and the cosine of the slope there.
    let off = |c: &[f64; UNKNOWNS], [x, y, z]: [f64; 3]| {
        let hx = of(c, [0.0, 1.0, 0.0, 2.0 * x, y, 0.0, 3.0 * x * x, 2.0 * x * y, y * y, 0.0]);
        let hy = of(c, [0.0, 0.0, 1.0, 0.0, x, 2.0 * y, 0.0, x * x, 2.0 * x * y, 3.0 * y * y]);
        (z - of(c, terms(x, y)), 1.0 / (1.0 + hx * hx + hy * hy).sqrt())
    };
    let mut c = [0.0; UNKNOWNS];
    for step in 0..CREASE.steps {
        let mut equations = Equations::default();
        for &p in points {
            let (d, cos) = off(&c, p);
            let weight = if step == 0 { 1.0 } else { cos * cos * trust(d * cos / sigma) };
            equations.add(&terms(p[0], p[1]), weight, p[2]);
        }
        c = equations.solved(points.len())?;
    }
    let distances = points.iter().map(|&p| off(&c, p)).map(|(d, cos)| cost(d * cos / sigma));
    Some((distances.sum(), unknowns))
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
        let (model, misfit) = crease(&ridge(), 0.05, &CREASE.starts).expect("a fit");
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
