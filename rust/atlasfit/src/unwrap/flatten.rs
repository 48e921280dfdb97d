//! Flattening: planar positions of a chart's vertices that keep its triangles' shapes.
//!
//! In: triangles, their rest shapes, a first guess. Out: positions; how far they stretch. As-rigid-as-possible
//! parametrisation (Liu, Zhang, Xu, Gotsman, Gortler 2008): best rotation per triangle, then one linear solve with
//! a matrix that is factorised once.

use super::chart::Chart;
use super::solver::{Factor, Graph};
use super::surface::Surface;
use crate::numeric::vec3::Vec3;
use crate::run::Context;

/// Cotangent weights are kept inside this range, so that needles neither vanish nor rule.
const COT: (f64, f64) = (0.02, 20.0);

/// Twice the signed area of a planar triangle.
#[inline]
pub(super) fn twice_area(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Largest and smallest singular value of the map from a rest triangle to the plane; the smallest is negative for
/// a flipped one.
#[inline]
pub(super) fn singular(rest: [f64; 3], p: [[f64; 2]; 3]) -> (f64, f64) {
    let [l, x, y] = rest;
    let d1 = [p[1][0] - p[0][0], p[1][1] - p[0][1]];
    let d2 = [p[2][0] - p[0][0], p[2][1] - p[0][1]];
    let (a, c) = (d1[0] / l, d1[1] / l);
    let (b, d) = ((d2[0] - a * x) / y, (d2[1] - c * x) / y);
    // Singular values from the similar and the anti-similar part.
    let p = ((a + d).powi(2) + (c - b).powi(2)).sqrt() * 0.5;
    let q = ((a - d).powi(2) + (c + b).powi(2)).sqrt() * 0.5;
    (p + q, p - q)
}

/// The judge of one triangle: max(s1, 1/s2); infinite when flipped or flat.
#[inline]
pub(super) fn stretch(rest: [f64; 3], p: [[f64; 2]; 3]) -> f64 {
    let (s1, s2) = singular(rest, p);
    if s2 > 0.0 { s1.max(1.0 / s2) } else { f64::INFINITY }
}

#[inline]
pub(super) fn corners(tri: [u32; 3], uv: &[[f64; 2]]) -> [[f64; 2]; 3] {
    tri.map(|v| uv[v as usize])
}

/// Whether every triangle is counter-clockwise.
pub(super) fn all_positive(tris: &[[u32; 3]], uv: &[[f64; 2]]) -> bool {
    tris.iter().all(|t| {
        let [a, b, c] = corners(*t, uv);
        twice_area(a, b, c) > 1e-18
    })
}

/// Area of the faces stretched beyond `bound`.
pub(super) fn over_area(s: &Surface, chart: &Chart, bound: f64) -> f64 {
    chart
        .faces
        .iter()
        .zip(&chart.tris)
        .filter(|(f, t)| stretch(s.rest[**f as usize], corners(**t, &chart.uv)) > bound)
        .map(|(f, _)| s.area[*f as usize])
        .sum()
}

/// Projects a chart to the plane across its mean normal.
pub(super) fn project(s: &Surface, chart: &mut Chart, n: Vec3) {
    let (e1, e2) = n.tangents();
    let mut origin = None;
    for (f, t) in chart.faces.iter().zip(&chart.tris) {
        for k in 0..3 {
            let p = s.pos[s.tri[*f as usize][k] as usize];
            let o = *origin.get_or_insert(p);
            let d = p - o;
            chart.uv[t[k] as usize] = [d.dot(e1), d.dot(e2)];
        }
    }
}

/// Half the cotangent at each corner of rest triangles, kept inside [`COT`].
pub(super) fn cotangents(rest: &[[f64; 3]]) -> Vec<[f64; 3]> {
    rest.iter()
        .map(|&[l, x, y]| {
            // Dot over cross of the two edges at each corner.
            let twice = l * y;
            let c0 = x * l / twice;
            let c1 = (l - x) * l / twice;
            let c2 = (x * (x - l) + y * y) / twice;
            [c0, c1, c2].map(|c| (0.5 * c).clamp(COT.0, COT.1))
        })
        .collect()
}

/// How strongly a vertex is held where it is: just enough to fix the free translation, or for good.
fn hold(pinned: &[bool], v: usize) -> f64 {
    if pinned.get(v).is_some_and(|&x| x) { 1e6 } else { 1e-9 }
}

/// How the linear systems are solved.
enum Solver {
    /// Exactly.
    Direct(Factor),
    /// A few conjugate gradient steps from where the positions are: linear in the chart's size, and enough where only
    /// fine detail is missing or little has to move.
    Iterative(Graph),
}

/// Charts with more vertices are solved iteratively: exact solves would cost n^1.5.
const DIRECT: usize = 12_000;
/// Conjugate gradient steps per iteration of the iterative solver.
const GRADIENT_STEPS: usize = 12;

/// Iterations of local rotations and global solves.
pub(super) struct Arap<'c> {
    ctx: &'c Context<'c>,
    solver: Solver,
    cot: Vec<[f64; 3]>,
    rest: Vec<[f64; 3]>,
}

impl<'c> Arap<'c> {
    /// Prepares the matrix of a chart; the present positions only serve the ordering. Vertices marked in `pinned`
    /// (which may be empty) stay where they are.
    ///
    /// When the run is to stop, this and the steps end early: the caller checks and drops the positions.
    pub(super) fn new(
        tris: &[[u32; 3]],
        rest: Vec<[f64; 3]>,
        uv: &[[f64; 2]],
        pinned: &[bool],
        ctx: &'c Context<'c>,
    ) -> Self {
        let cot = cotangents(&rest);
        let graph = Graph::from_triangles(uv.len(), tris, &cot, ctx);
        let solver = if uv.len() > DIRECT {
            Solver::Iterative(graph)
        } else {
            Solver::Direct(Factor::laplacian(&graph, uv, |v| hold(pinned, v), ctx))
        };
        Self { ctx, solver, cot, rest }
    }

    /// Runs one iteration.
    pub(super) fn step(
        &self,
        tris: &[[u32; 3]],
        uv: &mut [[f64; 2]],
        pinned: &[bool],
        rhs: &mut Vec<[f64; 2]>,
        work: &mut Vec<[f64; 2]>,
    ) {
        if self.ctx.check().is_err() {
            return;
        }
        rhs.clear();
        match self.solver {
            Solver::Direct(_) => {
                rhs.extend(uv.iter().enumerate().map(|(v, p)| p.map(|x| x * hold(pinned, v))));
            }
            Solver::Iterative(_) => rhs.resize(uv.len(), [0.0; 2]),
        }
        for ((t, &[l, x, y]), cot) in tris.iter().zip(&self.rest).zip(&self.cot) {
            let p = corners(*t, uv);
            // Edge k runs opposite corner k, from corner k + 1 to k + 2.
            let e = [[x - l, y], [-x, -y], [l, 0.0]];
            let (mut c, mut d) = (0.0, 0.0);
            for k in 0..3 {
                let (i, j) = ((k + 1) % 3, (k + 2) % 3);
                let u = [p[j][0] - p[i][0], p[j][1] - p[i][1]];
                c += cot[k] * (e[k][0] * u[0] + e[k][1] * u[1]);
                d += cot[k] * (e[k][0] * u[1] - e[k][1] * u[0]);
            }
            let n = (c * c + d * d).sqrt();
            let (c, d) = if n > 0.0 { (c / n, d / n) } else { (1.0, 0.0) };
            for k in 0..3 {
                let (i, j) = (t[(k + 1) % 3] as usize, t[(k + 2) % 3] as usize);
                let r = [cot[k] * (c * e[k][0] - d * e[k][1]), cot[k] * (d * e[k][0] + c * e[k][1])];
                rhs[j][0] += r[0];
                rhs[j][1] += r[1];
                rhs[i][0] -= r[0];
                rhs[i][1] -= r[1];
            }
        }
        match &self.solver {
            Solver::Direct(factor) => {
                factor.solve(rhs, work, self.ctx);
                for (v, (p, q)) in uv.iter_mut().zip(rhs.iter()).enumerate() {
                    if !pinned.get(v).is_some_and(|&x| x) {
                        *p = *q;
                    }
                }
            }
            Solver::Iterative(graph) => graph.relax(uv, rhs, pinned, GRADIENT_STEPS, self.ctx),
        }
    }
}

/// Moves from `from` towards `to` as far as no triangle flips; returns whether anything moved.
pub(super) fn blend_without_flips(tris: &[[u32; 3]], from: &mut [[f64; 2]], to: &[[f64; 2]]) -> bool {
    let mut t = 1.0;
    for _ in 0..6 {
        let mixed: Vec<[f64; 2]> =
            from.iter().zip(to).map(|(a, b)| [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]).collect();
        if all_positive(tris, &mixed) {
            from.copy_from_slice(&mixed);
            return true;
        }
        t *= 0.5;
    }
    false
}

/// The mean normal of some faces, by area.
pub(super) fn mean_normal(s: &Surface, faces: &[u32]) -> Vec3 {
    let mut n = Vec3::ZERO;
    for &f in faces {
        for k in 0..3 {
            n[k] += s.normal[f as usize][k] * s.area[f as usize];
        }
    }
    let l = n.norm();
    if l > 0.0 { n.map(|x| x / l) } else { Vec3([0.0, 0.0, 1.0]) }
}
