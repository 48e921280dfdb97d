//! Newton steps on the symmetric Dirichlet energy: where its last per cent counts.
//!
//! In: a disk's triangles, rest shapes and positions without flips. Out: positions of less energy, without
//! flips. The energy's second derivatives are made positive by their analytic eigenvalues (Smith, de Goes,
//! Kim 2019); no step is so long that a triangle turns over or the
//! border touches itself.

use super::block::{Block, Pattern};
use super::constants::FLATTEN;
use super::contacts::{Border, Contact, gentle};
use super::dirichlet::{Disk, first_collapse};
use super::shape::jacobian;
use crate::numeric::plane::corners;
use crate::run::Context;
use rustc_hash::FxHashSet;

/// Symmetric Dirichlet energy of one triangle, s1² + s2² + 1/s1² + 1/s2²: 4 where nothing is stretched, and
/// infinite where it is flipped.
#[inline]
pub(crate) fn dirichlet(rest: [f64; 3], p: [[f64; 2]; 3]) -> f64 {
    let [a, b, c, d] = jacobian(rest, p);
    let det = a * d - b * c;
    let squares = a * a + b * b + c * c + d * d;
    if det > 0.0 { squares * (1.0 + 1.0 / (det * det)) } else { f64::INFINITY }
}

/// Area of a rest triangle.
fn area(rest: [f64; 3]) -> f64 {
    0.5 * rest[0] * rest[2]
}

/// Mean energy by area.
pub(crate) fn mean_energy(tris: &[[u32; 3]], rest: &[[f64; 3]], uv: &[[f64; 2]]) -> f64 {
    let (sum, all) = tris.iter().zip(rest).fold((0.0, 0.0), |(sum, all), (t, &r)| {
        (sum + area(r) * dirichlet(r, corners(*t, uv)), all + area(r))
    });
    sum / all
}

/// When steps end.
#[derive(Clone, Copy)]
pub(crate) struct Until {
    /// Number of steps at most.
    pub steps: usize,
    /// One lowers the mean energy by less than this.
    pub least: f64,
    /// The mean energy is this low, or by all signs will not become so.
    pub wanted: Option<f64>,
}

/// Triangles of which some vertices may move.
pub(crate) struct Piece<'a> {
    pub tris: &'a [[u32; 3]],
    pub rest: &'a [[f64; 3]],
    /// What the mean is taken over.
    pub area: f64,
    /// Border edges, also those of other triangles that may come near.
    pub border: Border,
    /// Coordinates of vertices that stay what they are; all others move where this is empty.
    pub held: &'a [[bool; 2]],
}

impl Piece<'_> {
    fn energy(&self, uv: &[[f64; 2]]) -> f64 {
        let sum: f64 =
            self.tris.iter().zip(self.rest).map(|(t, &r)| area(r) * dirichlet(r, corners(*t, uv))).sum();
        sum / self.area
    }
}

/// Lowers the mean energy by Newton steps; returns it. A border that touches itself nowhere does not come to
/// do so. `None` when the run is to stop: the caller checks.
pub(crate) fn relax(disk: &Disk<'_>, uv: &mut Vec<[f64; 2]>, until: Until, ctx: &Context<'_>) -> Option<f64> {
    let &Disk { tris, rest, border, .. } = disk;
    let area = rest.iter().map(|&r| area(r)).sum();
    let border = Border::new(tris, border);
    relax_piece(&Piece { tris, rest, area, border, held: &[] }, uv, until, ctx)
}

/// The same of a piece: the part of the mean energy that is its own.
pub(crate) fn relax_piece(
    piece: &Piece<'_>,
    uv: &mut Vec<[f64; 2]>,
    until: Until,
    ctx: &Context<'_>,
) -> Option<f64> {
    let Piece { tris, border, held, .. } = piece;
    let barrier = |contacts: &[Contact]| contacts.iter().map(|c| c.energy).sum::<f64>();
    let mut energy = piece.energy(uv);
    if until.steps == 0 || !energy.is_finite() {
        return Some(energy);
    }
    let mut contacts = border.contacts(uv, held);
    let mut now = energy + barrier(&contacts);
    let mut known: Option<(FxHashSet<[u32; 3]>, Pattern)> = None;
    let mut pivot = FLATTEN.pivot;
    for _ in 0..until.steps {
        if until.wanted.is_some_and(|w| energy <= w) {
            break;
        }
        // A pattern with contacts that are no more serves as well.
        if !known.as_ref().is_some_and(|k| contacts.iter().all(|c| k.0.contains(&c.at))) {
            let near: Vec<[u32; 3]> = contacts.iter().map(|c| c.at).collect();
            let pattern = Pattern::new(tris, &near, uv, ctx)?;
            known = Some((near.into_iter().collect(), pattern));
        }
        let Some((_, pattern)) = &known else { break };
        let mut step = vec![[0.0; 2]; uv.len()];
        let slope = direction(piece, &contacts, uv, pattern, &mut step, pivot, ctx);
        ctx.check().ok()?;
        // The quadratic model gives half of this.
        if slope < 0.0 && until.wanted.is_some_and(|w| now + slope > w) {
            break;
        }
        let mut length = (FLATTEN.short_of * first_collapse(tris, uv, &step)).min(1.0);
        let mut next = None;
        for _ in 0..FLATTEN.halvings {
            let at: Vec<[f64; 2]> =
                uv.iter().zip(&step).map(|(p, d)| [p[0] + length * d[0], p[1] + length * d[1]]).collect();
            let e = piece.energy(&at);
            let wanted = now + 1e-4 * length * slope;
            length *= 0.5;
            // Not so where there is no number.
            if e < wanted && slope < 0.0 {
                let met = border.contacts(&at, held);
                let all = e + barrier(&met);
                if all < wanted && gentle(&contacts, &met) && !border.touches(&at, ctx).ok()? {
                    next = Some((at, e, met, all));
                    break;
                }
            }
        }
        let Some((at, e, met, all)) = next else {
            // Triangles near collapse: the system was solved badly, unless it is held together by more.
            if pivot >= FLATTEN.most_pivot {
                break;
            }
            pivot *= FLATTEN.stiffer;
            continue;
        };
        pivot = FLATTEN.pivot;
        let gain = now - all;
        (*uv, energy, contacts, now) = (at, e, met, all);
        // A step that the border cut short says nothing of what is left to gain.
        if gain < until.least && length >= 0.25 {
            break;
        }
    }
    Some(energy)
}

/// Adds the second derivatives of a triangle or a contact, whose pairs of vertices (1, 0), (2, 0), (2, 1)
/// have these slots.
fn add<const N: usize>(
    at: [u32; 3],
    slots: [u32; 3],
    modes: &[(f64, [[f64; 2]; 3]); N],
    diagonal: &mut [Block],
    pairs: &mut [Block],
) {
    for v in 0..3 {
        add_block(&mut diagonal[at[v] as usize], modes, v, v);
    }
    for (slot, (v, w)) in slots.into_iter().zip([(1, 0), (2, 0), (2, 1)]) {
        // The slot says which of the two is eliminated first: the rows are its.
        let (low, high) = if slot & 1 == 1 { (v, w) } else { (w, v) };
        add_block(&mut pairs[slot as usize / 2], modes, low, high);
    }
}

/// Adds the part for two of the corners.
#[inline]
fn add_block<const N: usize>(to: &mut Block, modes: &[(f64, [[f64; 2]; 3]); N], v: usize, w: usize) {
    for &(value, q) in modes {
        let ([x, y], b) = (q[v], q[w]);
        let (x, y) = (value * x, value * y);
        *to = [to[0] + x * b[0], to[1] + x * b[1], to[2] + y * b[0], to[3] + y * b[1]];
    }
}

/// The Newton step into `step`; returns the slope of the mean energy along it.
fn direction(
    &Piece { tris, rest, area: all, held, .. }: &Piece<'_>,
    contacts: &[Contact],
    uv: &[[f64; 2]],
    pattern: &Pattern,
    step: &mut [[f64; 2]],
    pivot: f64,
    ctx: &Context<'_>,
) -> f64 {
    let mut diagonal: Vec<Block> = vec![[FLATTEN.steady, 0.0, 0.0, FLATTEN.steady]; uv.len()];
    let mut pairs: Vec<Block> = vec![[0.0; 4]; pattern.pairs()];
    let mut against = |at: [u32; 3], gradient: [[f64; 2]; 3]| {
        for (v, g) in at.iter().zip(gradient) {
            let s = &mut step[*v as usize];
            *s = [s[0] - g[0], s[1] - g[1]];
        }
    };
    for (i, ((&t, &r), &slots)) in tris.iter().zip(rest).zip(&pattern.slots).enumerate() {
        if ctx.check_at(i).is_err() {
            return 0.0;
        }
        let Local { gradient, modes } = Local::new(r, corners(t, uv), area(r) / all);
        against(t, gradient);
        add(t, slots, &modes, &mut diagonal, &mut pairs);
    }
    for c in contacts {
        against(c.at, c.gradient.map(|g| g.map(|x| c.slope * x)));
        add(c.at, pattern.slots_of(c.at), &[(c.curvature, c.gradient)], &mut diagonal, &mut pairs);
    }
    let stay = |step: &mut [[f64; 2]]| {
        for (s, held) in step.iter_mut().zip(held) {
            (0..2).filter(|&k| held[k]).for_each(|k| s[k] = 0.0);
        }
    };
    for (d, held) in diagonal.iter_mut().zip(held) {
        (0..2).filter(|&k| held[k]).for_each(|k| d[3 * k] += FLATTEN.fixed);
    }
    stay(step);
    let downhill: Vec<[f64; 2]> = step.to_vec();
    pattern.solve(&diagonal, &pairs, step, pivot, ctx);
    stay(step);
    -downhill.iter().zip(step).map(|(g, s)| g[0] * s[0] + g[1] * s[1]).sum::<f64>()
}

/// One triangle's part.
struct Local {
    gradient: [[f64; 2]; 3],
    /// Eigenvalues of the second derivatives, and eigenvectors at the three corners.
    modes: [(f64, [[f64; 2]; 3]); 4],
}

impl Local {
    fn new([l, x, y]: [f64; 3], p: [[f64; 2]; 3], weight: f64) -> Self {
        // Gradients of the corners' hat functions on the rest triangle.
        let g1 = [1.0 / l, -x / (l * y)];
        let g2 = [0.0, 1.0 / y];
        let g = [[-g1[0] - g2[0], -g1[1] - g2[1]], g1, g2];
        let entry = |r: usize, c: usize| p[0][r] * g[0][c] + p[1][r] * g[1][c] + p[2][r] * g[2][c];
        let (a, b, c, d) = (entry(0, 0), entry(0, 1), entry(1, 0), entry(1, 1));
        // The similar and the anti-similar part: their sizes and directions.
        let polar = |x: f64, y: f64| {
            let size = (x * x + y * y).sqrt();
            (0.5 * size, if size > 0.0 { [x / size, y / size] } else { [1.0, 0.0] })
        };
        let ((plus, similar), (minus, other)) = (polar(a + d, c - b), polar(a - d, c + b));
        let s = [plus + minus, plus - minus];
        let dot = |a: [f64; 2], b: [f64; 2]| a[0] * b[0] + a[1] * b[1];
        let cross = |a: [f64; 2], b: [f64; 2]| a[0] * b[1] - a[1] * b[0];
        // The inner frame has half the angle from the first to the second; the outer one is turned by the
        // first against it.
        let (cos, sin) = (dot(similar, other), cross(similar, other));
        let half = if cos >= 0.0 {
            let x = (0.5 * (1.0 + cos)).sqrt();
            [x, 0.5 * sin / x]
        } else {
            let y = (0.5 * (1.0 - cos)).sqrt();
            [0.5 * sin / y, y]
        };
        let frame = |[cos, sin]: [f64; 2]| [[cos, sin], [-sin, cos]];
        let turned =
            [half[0] * similar[0] - half[1] * similar[1], half[0] * similar[1] + half[1] * similar[0]];
        let (u, v) = (frame(turned), frame(half));
        // Twice the half of the energy.
        let slope = s.map(|s| 2.0 * weight * (s - s.powi(-3)));
        let along = g.map(|g| [dot(v[0], g), dot(v[1], g)]);
        let mix = |a: f64, b: f64| [a * u[0][0] + b * u[1][0], a * u[0][1] + b * u[1][1]];
        let gradient = along.map(|q| mix(slope[0] * q[0], slope[1] * q[1]));
        let (det, squares) = (s[0] * s[1], s[0] * s[0] + s[1] * s[1]);
        let (even, odd) = (1.0 + det.powi(-2), squares * det.powi(-3));
        let scaled = |x: f64| 2.0 * weight * x.max(0.0);
        let h = std::f64::consts::FRAC_1_SQRT_2;
        let modes = [
            (scaled(1.0 + 3.0 * s[0].powi(-4)), along.map(|q| mix(q[0], 0.0))),
            (scaled(1.0 + 3.0 * s[1].powi(-4)), along.map(|q| mix(0.0, q[1]))),
            (scaled(even - odd), along.map(|q| mix(-h * q[1], h * q[0]))),
            (scaled(even + odd), along.map(|q| mix(h * q[1], h * q[0]))),
        ];
        Self { gradient, modes }
    }
}
