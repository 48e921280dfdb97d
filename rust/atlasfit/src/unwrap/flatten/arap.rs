//! As-rigid-as-possible parametrisation (Liu, Zhang, Xu, Gotsman, Gortler 2008): best rotation per triangle,
//! then one linear solve with a matrix that is factorised once.
//!
//! In: triangles, their rest shapes, a first guess. Out: positions.

use super::constants::FLATTEN;
use super::factor::Factor;
use super::graph::Graph;
use super::shape::cotangents;
use crate::numeric::plane::corners;
use crate::run::Context;

/// How strongly a vertex is held where it is: just enough to fix the free translation, or for good.
fn hold(pinned: &[bool], v: usize) -> f64 {
    if pinned.get(v).is_some_and(|&x| x) { FLATTEN.pin } else { FLATTEN.hold }
}

/// How the linear systems are solved.
enum Solver {
    /// Exactly.
    Direct(Factor),
    /// A few conjugate gradient steps from where the positions are: linear in the chart's size, and enough
    /// where only fine detail is missing or little has to move.
    Iterative(Graph),
}

/// Iterations of local rotations and global solves.
pub(crate) struct Arap<'c> {
    ctx: &'c Context<'c>,
    solver: Solver,
    cot: Vec<[f64; 3]>,
    rest: Vec<[f64; 3]>,
}

impl<'c> Arap<'c> {
    /// Prepares the matrix of a chart; the present positions only serve the ordering. Vertices marked in
    /// `pinned` (which may be empty) stay where they are.
    ///
    /// When the run is to stop, this and the steps end early: the caller checks and drops the positions.
    pub(crate) fn new(
        tris: &[[u32; 3]],
        rest: Vec<[f64; 3]>,
        uv: &[[f64; 2]],
        pinned: &[bool],
        ctx: &'c Context<'c>,
    ) -> Self {
        let cot = cotangents(&rest);
        let graph = Graph::from_triangles(uv.len(), tris, &cot, ctx);
        let solver = if uv.len() > FLATTEN.direct {
            Solver::Iterative(graph)
        } else {
            Solver::Direct(Factor::laplacian(&graph, uv, |v| hold(pinned, v), ctx))
        };
        Self { ctx, solver, cot, rest }
    }

    /// Runs one iteration.
    pub(crate) fn step(
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
        for (i, ((t, &[l, x, y]), cot)) in tris.iter().zip(&self.rest).zip(&self.cot).enumerate() {
            if self.ctx.check_at(i).is_err() {
                return;
            }
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
            Solver::Iterative(graph) => graph.relax(uv, rhs, pinned, FLATTEN.gradient_steps, self.ctx),
        }
    }
}
