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
use super::shape::singular;
use crate::numeric::plane::corners;
use crate::run::Context;
use crate::spatial::inject::border_touches;

/// Symmetric Dirichlet energy of one triangle, s1² + s2² + 1/s1² + 1/s2²: 4 where nothing is stretched, and
/// infinite where it is flipped.
#[inline]
pub(crate) fn dirichlet(rest: [f64; 3], p: [[f64; 2]; 3]) -> f64 {
    let (s1, s2) = singular(rest, p);
    let det = s1 * s2;
    let squares = s1 * s1 + s2 * s2;
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

/// Lowers the mean energy by at most `steps` Newton steps, until one lowers it by less than `least`; returns
/// it. A border that touches itself nowhere does not come to do so. `None` when the run is to stop: the caller
/// checks.
pub(crate) fn relax(
    disk: &Disk<'_>,
    uv: &mut Vec<[f64; 2]>,
    (steps, least): (usize, f64),
    ctx: &Context<'_>,
) -> Option<f64> {
    let &Disk { tris, rest, border, .. } = disk;
    let free = Border::new(tris, border);
    let barrier = |contacts: &[Contact]| contacts.iter().map(|c| c.energy).sum::<f64>();
    let mut energy = mean_energy(tris, rest, uv);
    if steps == 0 || !energy.is_finite() {
        return Some(energy);
    }
    let mut contacts = free.contacts(uv);
    let mut now = energy + barrier(&contacts);
    let mut pattern: Option<(Vec<[u32; 3]>, Pattern)> = None;
    for _ in 0..steps {
        let near: Vec<[u32; 3]> = contacts.iter().map(|c| c.at).collect();
        let known = match pattern.take() {
            Some(p) if p.0 == near => p,
            _ => {
                let all: Vec<[u32; 3]> = tris.iter().chain(&near).copied().collect();
                (near, Pattern::new(&all, uv, ctx)?)
            }
        };
        let mut step = vec![[0.0; 2]; uv.len()];
        let slope = direction(disk, &contacts, uv, &known.1, &mut step, ctx);
        pattern = Some(known);
        ctx.check().ok()?;
        let mut length = (FLATTEN.short_of * first_collapse(tris, uv, &step)).min(1.0);
        let mut next = None;
        for _ in 0..FLATTEN.halvings {
            let at: Vec<[f64; 2]> =
                uv.iter().zip(&step).map(|(p, d)| [p[0] + length * d[0], p[1] + length * d[1]]).collect();
            let e = mean_energy(tris, rest, &at);
            let wanted = now + 1e-4 * length * slope;
            length *= 0.5;
            if e < wanted {
                let met = free.contacts(&at);
                let all = e + barrier(&met);
                if all < wanted && gentle(&contacts, &met) && !border_touches(tris, &at, border, ctx).ok()? {
                    next = Some((at, e, met, all));
                    break;
                }
            }
        }
        let Some((at, e, met, all)) = next else { break };
        let gain = now - all;
        (*uv, energy, contacts, now) = (at, e, met, all);
        // A step that the border cut short says nothing of what is left to gain.
        if gain < least && length >= 0.25 {
            break;
        }
    }
    Some(energy)
}

/// Adds a mode of a triangle's or a contact's second derivatives.
fn add(
    at: [u32; 3],
    modes: &[(f64, [[f64; 2]; 3])],
    pattern: &Pattern,
    diagonal: &mut [Block],
    pairs: &mut [Block],
) {
    for v in 0..3 {
        for w in 0..=v {
            let (low, high, into) = if w == v {
                (v, v, &mut diagonal[at[v] as usize])
            } else {
                let (pair, first) = pattern.pair(at[v], at[w]);
                let (low, high) = if first { (v, w) } else { (w, v) };
                (low, high, &mut pairs[pair as usize])
            };
            for (value, q) in modes {
                let (a, b) = (q[low], q[high]);
                *into = [
                    into[0] + value * a[0] * b[0],
                    into[1] + value * a[0] * b[1],
                    into[2] + value * a[1] * b[0],
                    into[3] + value * a[1] * b[1],
                ];
            }
        }
    }
}

/// The Newton step into `step`; returns the slope of the mean energy along it.
fn direction(
    &Disk { tris, rest, .. }: &Disk<'_>,
    contacts: &[Contact],
    uv: &[[f64; 2]],
    pattern: &Pattern,
    step: &mut [[f64; 2]],
    ctx: &Context<'_>,
) -> f64 {
    let all: f64 = rest.iter().map(|&r| area(r)).sum();
    let mut diagonal: Vec<Block> = vec![[FLATTEN.steady, 0.0, 0.0, FLATTEN.steady]; uv.len()];
    let mut pairs: Vec<Block> = vec![[0.0; 4]; pattern.pairs()];
    let mut against = |at: [u32; 3], gradient: [[f64; 2]; 3]| {
        for (v, g) in at.iter().zip(gradient) {
            let s = &mut step[*v as usize];
            *s = [s[0] - g[0], s[1] - g[1]];
        }
    };
    for (i, (&t, &r)) in tris.iter().zip(rest).enumerate() {
        if ctx.check_at(i).is_err() {
            return 0.0;
        }
        let Local { gradient, modes } = Local::new(r, corners(t, uv), area(r) / all);
        against(t, gradient);
        add(t, &modes, pattern, &mut diagonal, &mut pairs);
    }
    for c in contacts {
        against(c.at, c.gradient.map(|g| g.map(|x| c.slope * x)));
        add(c.at, &[(c.curvature, c.gradient)], pattern, &mut diagonal, &mut pairs);
    }
    let downhill: Vec<[f64; 2]> = step.to_vec();
    pattern.solve(&diagonal, &pairs, step, ctx);
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
        let (similar, other) = ((c - b).atan2(a + d), (c + b).atan2(a - d));
        let plus = 0.5 * (a + d).hypot(c - b);
        let minus = 0.5 * (a - d).hypot(c + b);
        let s = [plus + minus, plus - minus];
        let frame = |angle: f64| {
            let (sin, cos) = angle.sin_cos();
            [[cos, sin], [-sin, cos]]
        };
        let (u, v) = (frame(0.5 * (similar + other)), frame(0.5 * (other - similar)));
        let dot = |a: [f64; 2], b: [f64; 2]| a[0] * b[0] + a[1] * b[1];
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
