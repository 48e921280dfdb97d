//! Flattening a disk without flips, however far it is from flat: where as-rigid-as-possible steps turn
//! triangles over, these cannot.
//!
//! In: a disk's triangles, their rest shapes and border. Out: positions of least symmetric Dirichlet energy,
//! area times s1² + s2² + 1/s1² + 1/s2² (Smith, Schaefer 2015). Start: a convex embedding (Tutte 1963).
//! Steps: the energy's gradient through a weighted Laplacian, weights from the energy's curvature (after
//! Rabinovich, Poranne, Panozzo, Sorkine-Hornung 2017, one weight for both directions), no step so long that
//! a triangle turns over. Then triangles beyond a stretch bound count more, for less area beyond it.

use super::constants::FLATTEN;
use super::factor::Factor;
use super::graph::Graph;
use super::shape::{all_positive, cotangents, singular, stretch};
use crate::numeric::plane::{corners, twice_area};
use crate::run::Context;
use crate::unwrap::surface::NONE;
use std::f64::consts::PI;

/// A disk to be flattened.
#[derive(Clone, Copy)]
pub(crate) struct Disk<'a> {
    pub tris: &'a [[u32; 3]],
    /// Rest shape per triangle.
    pub rest: &'a [[f64; 3]],
    /// Free edges: (triangle, slot).
    pub border: &'a [(u32, u8)],
    /// Number of vertices.
    pub vertices: usize,
}

/// Positions of the disk's vertices, all triangles counter-clockwise and little area stretched beyond
/// `bound`; `None` for what is no disk, or has a triangle too thin for numbers.
pub(crate) fn flatten(disk: &Disk<'_>, bound: f64, ctx: &Context<'_>) -> Option<Vec<[f64; 2]>> {
    let &Disk { tris, rest, .. } = disk;
    let cot = cotangents(rest);
    let mut uv = convex(disk, &cot, ctx)?;
    let mut energy = Energy { tris, rest, cot: &cot, importance: vec![1.0; tris.len()] };
    minimise(&energy, &mut uv, FLATTEN.steps, ctx)?;
    // What is beyond the bound counts more, and the rest makes room for it.
    let beyond = |uv: &[[f64; 2]]| -> (f64, Vec<bool>) {
        let is = |(t, &r): (&[u32; 3], &[f64; 3])| stretch(r, corners(*t, uv)) > bound;
        let all: Vec<bool> = tris.iter().zip(rest).map(is).collect();
        (all.iter().zip(rest).filter(|b| *b.0).map(|(_, r)| r[0] * r[2]).sum(), all)
    };
    let (mut least, mut over) = beyond(&uv);
    for _ in 0..FLATTEN.reweights {
        if least == 0.0 {
            break;
        }
        energy.importance.iter_mut().zip(&over).filter(|i| *i.1).for_each(|i| *i.0 *= FLATTEN.more);
        let mut at = uv.clone();
        minimise(&energy, &mut at, FLATTEN.more_steps, ctx)?;
        let (area, still) = beyond(&at);
        over = still;
        if area < least {
            (uv, least) = (at, area);
        }
    }
    all_positive(tris, &uv).then_some(uv)
}

/// What is minimised.
struct Energy<'a> {
    tris: &'a [[u32; 3]],
    rest: &'a [[f64; 3]],
    /// Half the cotangents of the rest triangles.
    cot: &'a [[f64; 3]],
    /// How much each triangle counts.
    importance: Vec<f64>,
}

impl Energy<'_> {
    /// The energy of some positions; infinite where a triangle is flipped.
    fn of(&self, uv: &[[f64; 2]]) -> f64 {
        self.tris
            .iter()
            .zip(self.rest)
            .zip(&self.importance)
            .map(|((t, &r), i)| {
                let (s1, s2) = singular(r, corners(*t, uv));
                if s2 > 0.0 {
                    0.5 * i * r[0] * r[2] * (s1 * s1 + s2 * s2 + (s1 * s1).recip() + (s2 * s2).recip())
                } else {
                    f64::INFINITY
                }
            })
            .sum()
    }
}

/// Lowers the energy, each triangle's times its importance. `None` when the run is to stop: the caller
/// checks.
fn minimise(energy: &Energy<'_>, uv: &mut Vec<[f64; 2]>, steps: usize, ctx: &Context<'_>) -> Option<()> {
    let &Energy { tris, rest, cot, ref importance } = energy;
    let mut work = Vec::new();
    let mut now = energy.of(uv);
    for _ in 0..steps {
        let mut step = vec![[0.0; 2]; uv.len()];
        let mut weight = cot.to_vec();
        for (((t, &r), &i), w) in tris.iter().zip(rest).zip(importance).zip(&mut weight) {
            let p = corners(*t, uv);
            for (v, g) in t.iter().zip(gradient(r, p)) {
                let s = &mut step[*v as usize];
                *s = [s[0] - i * g[0], s[1] - i * g[1]];
            }
            let (s1, s2) = singular(r, p);
            // Half the energy's second derivatives in s1 and s2, mean.
            let stiff = 1.0 + 1.5 * (s1.powi(-4) + s2.powi(-4));
            *w = w.map(|w| 2.0 * i * w * stiff.min(FLATTEN.stiffest));
        }
        let graph = Graph::from_triangles(uv.len(), tris, &weight, ctx);
        Factor::laplacian(&graph, uv, |_| FLATTEN.drift, ctx).solve(&mut step, &mut work, ctx);
        ctx.check().ok()?;
        let mut length = (FLATTEN.short_of * first_collapse(tris, uv, &step)).min(1.0);
        let next = (0..FLATTEN.halvings).find_map(|_| {
            let at: Vec<[f64; 2]> =
                uv.iter().zip(&step).map(|(p, d)| [p[0] + length * d[0], p[1] + length * d[1]]).collect();
            length *= 0.5;
            let e = energy.of(&at);
            (e < now).then_some((at, e))
        });
        let Some((at, e)) = next else { break };
        let converged = now - e < FLATTEN.converged * now;
        (*uv, now) = (at, e);
        if converged {
            break;
        }
    }
    Some(())
}

/// The disk with its border on a circle of the disk's area.
pub(crate) fn convex(disk: &Disk<'_>, cot: &[[f64; 3]], ctx: &Context<'_>) -> Option<Vec<[f64; 2]>> {
    let &Disk { tris, rest, border, vertices } = disk;
    let mut next = vec![(NONE, 0.0); vertices];
    for &(i, k) in border {
        let (t, k) = (tris[i as usize], k as usize);
        let [l, x, y] = rest[i as usize];
        let length = [l, (x - l).hypot(y), x.hypot(y)][k];
        let from = &mut next[t[k] as usize];
        if from.0 != NONE {
            return None;
        }
        *from = (t[(k + 1) % 3], length);
    }
    let &(i, k) = border.first()?;
    let first = tris[i as usize][k as usize];
    let round: f64 = border.iter().map(|&(i, k)| next[tris[i as usize][k as usize] as usize].1).sum();
    let area: f64 = rest.iter().map(|&[l, _, y]| 0.5 * l * y).sum();
    let radius = (area / PI).sqrt();
    let mut pinned = vec![false; vertices];
    let mut uv = vec![[0.0; 2]; vertices];
    let (mut v, mut along) = (first, 0.0);
    for _ in 0..border.len() {
        let a = 2.0 * PI * along / round;
        uv[v as usize] = [radius * a.cos(), radius * a.sin()];
        if std::mem::replace(&mut pinned[v as usize], true) {
            return None;
        }
        let (to, length) = next[v as usize];
        if to == NONE {
            return None;
        }
        (v, along) = (to, along + length);
    }
    if v != first {
        return None;
    }
    let graph = Graph::from_triangles(vertices, tris, cot, ctx);
    let order = spread(&graph, &uv, &pinned);
    let uv = harmonic(&graph, &order, &pinned, &uv, ctx)?;
    all_positive(tris, &uv).then_some(uv)
}

/// Every vertex that is not pinned at the weighted mean of its neighbours. `order` are rough positions, good
/// enough to order an elimination by. `None` when the run is to stop: the caller checks.
pub(crate) fn harmonic(
    graph: &Graph,
    order: &[[f64; 2]],
    pinned: &[bool],
    at: &[[f64; 2]],
    ctx: &Context<'_>,
) -> Option<Vec<[f64; 2]>> {
    let hold = |v: usize| if pinned[v] { FLATTEN.held } else { 0.0 };
    let mut out: Vec<[f64; 2]> = at.iter().enumerate().map(|(v, p)| p.map(|x| x * hold(v))).collect();
    Factor::laplacian(graph, order, hold, ctx).solve(&mut out, &mut Vec::new(), ctx);
    ctx.check().ok()?;
    Some(out)
}

/// Rough positions of the inner vertices, good enough to order an elimination by.
fn spread(graph: &Graph, uv: &[[f64; 2]], pinned: &[bool]) -> Vec<[f64; 2]> {
    // Rings inward from the border, each vertex at the mean of what named it, drawn towards the middle.
    let mut at = uv.to_vec();
    let mut known = pinned.to_vec();
    let mut ring: Vec<u32> = (0..uv.len() as u32).filter(|&v| pinned[v as usize]).collect();
    while !ring.is_empty() {
        let mut inner = Vec::new();
        for &v in &ring {
            for e in graph.start[v as usize] as usize..graph.start[v as usize + 1] as usize {
                let q = graph.to[e] as usize;
                if !known[q] {
                    known[q] = true;
                    at[q] = at[v as usize].map(|x| FLATTEN.inward * x);
                    inner.push(q as u32);
                }
            }
        }
        ring = inner;
    }
    at
}

/// The gradient of one triangle's energy at its three corners.
fn gradient([l, x, y]: [f64; 3], p: [[f64; 2]; 3]) -> [[f64; 2]; 3] {
    let d1 = [p[1][0] - p[0][0], p[1][1] - p[0][1]];
    let d2 = [p[2][0] - p[0][0], p[2][1] - p[0][1]];
    let (a, c) = (d1[0] / l, d1[1] / l);
    let (b, d) = ((d2[0] - a * x) / y, (d2[1] - c * x) / y);
    // E = F (1 + 1/D²) with F the sum of squares, D the determinant.
    let (f, det) = (a * a + b * b + c * c + d * d, a * d - b * c);
    let (m, n) = (l * y * (1.0 + 1.0 / (det * det)), l * y * f / det.powi(3));
    let (ga, gb, gc, gd) = (m * a - n * d, m * b + n * c, m * c + n * b, m * d - n * a);
    let g1 = [ga / l - gb * x / (l * y), gc / l - gd * x / (l * y)];
    let g2 = [gb / y, gd / y];
    [[-g1[0] - g2[0], -g1[1] - g2[1]], g1, g2]
}

/// The least positive length of `step` at which a triangle collapses.
pub(super) fn first_collapse(tris: &[[u32; 3]], uv: &[[f64; 2]], step: &[[f64; 2]]) -> f64 {
    let cross = |a: [f64; 2], b: [f64; 2]| a[0] * b[1] - a[1] * b[0];
    let minus = |a: [f64; 2], b: [f64; 2]| [a[0] - b[0], a[1] - b[1]];
    tris.iter().fold(f64::INFINITY, |least, t| {
        let [p, q, r] = corners(*t, uv);
        let [u, v, w] = corners(*t, step);
        let (d, e) = (minus(q, p), minus(r, p));
        let (f, g) = (minus(v, u), minus(w, u));
        // Twice the area along the step: a t² + b t + c.
        let (a, b, c) = (cross(f, g), cross(d, g) + cross(f, e), twice_area(p, q, r));
        let disc = b * b - 4.0 * a * c;
        if disc < 0.0 {
            return least;
        }
        // Both roots without cancellation.
        let h = -0.5 * (b + disc.sqrt().copysign(b));
        [h / a, c / h].into_iter().filter(|t| *t > 0.0).fold(least, f64::min)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::Run;

    /// A disk that owns its parts.
    struct Cap {
        tris: Vec<[u32; 3]>,
        rest: Vec<[f64; 3]>,
        border: Vec<(u32, u8)>,
        vertices: usize,
    }

    impl Cap {
        fn flatten(&self) -> Option<Vec<[f64; 2]>> {
            let Self { tris, rest, border, vertices } = self;
            let disk = Disk { tris, rest, border, vertices: *vertices };
            Run::default().execute(|ctx| Ok(flatten(&disk, f64::INFINITY, ctx))).unwrap()
        }
    }

    fn energy(tris: &[[u32; 3]], rest: &[[f64; 3]], uv: &[[f64; 2]]) -> f64 {
        Energy { tris, rest, cot: &[], importance: vec![1.0; tris.len()] }.of(uv)
    }

    /// A cap of the unit sphere down to `polar` radians, in rings.
    fn cap(rings: usize, polar: f64) -> Cap {
        let around = 24;
        let mut pos = vec![[0.0, 0.0, 1.0]];
        for i in 1..=rings {
            let a = polar * i as f64 / rings as f64;
            for j in 0..around {
                let b = 2.0 * PI * j as f64 / around as f64;
                pos.push([a.sin() * b.cos(), a.sin() * b.sin(), a.cos()]);
            }
        }
        let at = |i: usize, j: usize| if i == 0 { 0 } else { (1 + (i - 1) * around + j % around) as u32 };
        let mut tris = Vec::new();
        let mut border = Vec::new();
        for i in 0..rings {
            for j in 0..around {
                let (p, q, r, s) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
                if i > 0 {
                    tris.push([p, r, s]);
                }
                if i + 1 == rings {
                    border.push((tris.len() as u32, 1));
                }
                tris.push([p, q, r]);
            }
        }
        let rest = tris
            .iter()
            .map(|t| {
                let [p, q, r] = t.map(|v: u32| pos[v as usize]);
                let (d, e): (Vec<f64>, Vec<f64>) = (0..3).map(|k| (q[k] - p[k], r[k] - p[k])).unzip();
                let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
                let l = dot(&d, &d).sqrt();
                let x = dot(&d, &e) / l;
                [l, x, (dot(&e, &e) - x * x).sqrt()]
            })
            .collect();
        Cap { tris, rest, border, vertices: pos.len() }
    }

    #[test]
    fn the_gradient_is_that_of_the_energy() {
        let (rest, p) = ([1.2, 0.3, 0.9], [[0.1, 0.2], [1.0, -0.1], [0.4, 1.3]]);
        let g = gradient(rest, p);
        for v in 0..3 {
            for k in 0..2 {
                let h = 1e-6;
                let at = |d: f64| {
                    let mut q = p.to_vec();
                    q[v][k] += d;
                    energy(&[[0, 1, 2]], &[rest], &q)
                };
                let finite = (at(h) - at(-h)) / (2.0 * h);
                assert!((finite - g[v][k]).abs() < 1e-6 * (1.0 + finite.abs()), "{finite} {}", g[v][k]);
            }
        }
    }

    #[test]
    fn a_sphere_with_a_small_hole_comes_out_without_flips_and_a_half_sphere_hardly_stretched() {
        for (polar, bound) in [(1.5, 1.3), (2.9, 6.0)] {
            let cap = cap(24, polar);
            let uv = cap.flatten().expect("a disk");
            assert!(all_positive(&cap.tris, &uv));
            let mean =
                energy(&cap.tris, &cap.rest, &uv) / (2.0 * cap.rest.iter().map(|r| r[0] * r[2]).sum::<f64>());
            assert!(mean < bound, "polar {polar}: mean energy {mean} of its least");
        }
    }

    #[test]
    fn what_is_no_disk_is_none() {
        let Cap { tris, rest, border, vertices } = cap(6, 1.0);
        // Without the middle there are two borders.
        let (tris, rest) = (tris[24..].to_vec(), rest[24..].to_vec());
        let mut border: Vec<(u32, u8)> = border.iter().map(|&(i, k)| (i - 24, k)).collect();
        border.extend((0..24).map(|j| (2 * j, 2)));
        assert!(Cap { tris, rest, border, vertices }.flatten().is_none());
    }
}
