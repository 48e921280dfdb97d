//! The graph of a chart's edges with weights, and conjugate gradients on it.
//!
//! In: triangles and a weight per corner. Out: neighbours in compressed rows; positions nearer the
//! Laplacian's solution.

use crate::run::Context;

/// Neighbours in compressed rows: `to[start[i]..start[i + 1]]` with weights.
#[derive(Default)]
pub(crate) struct Graph {
    pub(crate) start: Vec<u32>,
    pub(crate) to: Vec<u32>,
    pub(crate) weight: Vec<f64>,
}

impl Graph {
    /// The Laplacian's graph: each corner weight `w[k]` of a triangle belongs to the edge opposite corner k.
    /// Without edges when the run is to stop: the caller checks.
    pub(crate) fn from_triangles(n: usize, tris: &[[u32; 3]], w: &[[f64; 3]], ctx: &Context<'_>) -> Self {
        let none = || Self { start: vec![0; n + 1], to: Vec::new(), weight: Vec::new() };
        let mut start = vec![0u32; n + 1];
        for t in tris {
            for &v in t {
                start[v as usize + 1] += 2;
            }
        }
        for i in 0..n {
            start[i + 1] += start[i];
        }
        let mut fill = start.clone();
        let mut raw = vec![(0u32, 0f64); start[n] as usize];
        for (i, (t, w)) in tris.iter().zip(w).enumerate() {
            if ctx.check_at(i).is_err() {
                return none();
            }
            for k in 0..3 {
                let (a, b) = (t[(k + 1) % 3], t[(k + 2) % 3]);
                for (a, b) in [(a, b), (b, a)] {
                    raw[fill[a as usize] as usize] = (b, w[k]);
                    fill[a as usize] += 1;
                }
            }
        }
        let mut out = Self { start: Vec::with_capacity(n + 1), to: Vec::new(), weight: Vec::new() };
        out.start.push(0);
        // Where each vertex was last put: a search along the row would take the square of a hub's neighbours.
        let mut place = vec![0usize; n];
        for i in 0..n {
            if ctx.check_at(i).is_err() {
                return none();
            }
            let from = out.to.len();
            for &(j, w) in &raw[start[i] as usize..start[i + 1] as usize] {
                let p = place[j as usize];
                if p >= from && out.to.get(p) == Some(&j) {
                    out.weight[p] += w;
                } else {
                    place[j as usize] = out.to.len();
                    out.to.push(j);
                    out.weight.push(w);
                }
            }
            out.start.push(out.to.len() as u32);
        }
        out
    }
    /// Takes `steps` of conjugate gradients with diagonal scaling towards the solution of Laplacian * uv =
    /// `rhs` (an empty one is zero: weighted means of neighbours), from the present positions; pinned ones
    /// stay.
    pub(crate) fn relax(
        &self,
        uv: &mut [[f64; 2]],
        rhs: &[[f64; 2]],
        pinned: &[bool],
        steps: usize,
        ctx: &Context<'_>,
    ) {
        let n = uv.len();
        let apply = |x: &[[f64; 2]], out: &mut [[f64; 2]]| {
            for i in 0..n {
                let mut y = [0.0; 2];
                if !pinned.get(i).is_some_and(|&p| p) {
                    for e in self.row(i as u32) {
                        let (w, q) = (self.weight[e], x[self.to[e] as usize]);
                        y = [y[0] + w * (x[i][0] - q[0]), y[1] + w * (x[i][1] - q[1])];
                    }
                }
                out[i] = y;
            }
        };
        let scale: Vec<f64> = (0..n)
            .map(|i| 1.0 / self.row(i as u32).map(|e| self.weight[e]).sum::<f64>().max(1e-300))
            .collect();
        let mut r = vec![[0.0; 2]; n];
        if ctx.check().is_err() {
            return;
        }
        apply(uv, &mut r);
        for (i, r) in r.iter_mut().enumerate() {
            let free = !pinned.get(i).is_some_and(|&p| p);
            let b = if free { rhs.get(i).copied().unwrap_or([0.0; 2]) } else { [0.0; 2] };
            *r = [b[0] - r[0], b[1] - r[1]];
        }
        let mut d: Vec<[f64; 2]> = r.iter().zip(&scale).map(|(r, s)| r.map(|x| x * s)).collect();
        let mut q = vec![[0.0; 2]; n];
        let scaled = |r: &[[f64; 2]]| -> [f64; 2] {
            r.iter().zip(&scale).fold([0.0; 2], |a, (r, s)| [a[0] + s * r[0] * r[0], a[1] + s * r[1] * r[1]])
        };
        let mut rho = scaled(&r);
        for _ in 0..steps {
            if ctx.check().is_err() {
                return;
            }
            apply(&d, &mut q);
            let mut dq = [0.0; 2];
            for (d, q) in d.iter().zip(&q) {
                dq = [dq[0] + d[0] * q[0], dq[1] + d[1] * q[1]];
            }
            if !(dq[0] > 0.0 || dq[1] > 0.0) {
                return;
            }
            let alpha = [0, 1].map(|k| if dq[k] > 0.0 { rho[k] / dq[k] } else { 0.0 });
            for i in 0..n {
                for k in 0..2 {
                    uv[i][k] += alpha[k] * d[i][k];
                    r[i][k] -= alpha[k] * q[i][k];
                }
            }
            let next = scaled(&r);
            let beta = [0, 1].map(|k| if rho[k] > 0.0 { next[k] / rho[k] } else { 0.0 });
            for i in 0..n {
                for k in 0..2 {
                    d[i][k] = r[i][k] * scale[i] + beta[k] * d[i][k];
                }
            }
            rho = next;
        }
    }

    /// The places in `to` and `weight` of a vertex's neighbours.
    pub(super) fn row(&self, i: u32) -> std::ops::Range<usize> {
        self.start[i as usize] as usize..self.start[i as usize + 1] as usize
    }
}
