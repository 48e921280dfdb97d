//! The motions that bring points onto the surfaces of other sweeps: one Gauss-Newton step for all sweeps.
//!
//! In: pairs, the motions so far, the residuals' size. Out: a small motion for each sweep.

use super::constants::REGISTER;
use crate::geometry::Motion;
use crate::numeric::dense::{cholesky, cholesky_solve};
use crate::numeric::vec3::Vec3;

/// Unknowns of a sweep: the turn's axis times its angle, and the shift.
const UNKNOWNS: usize = 6;

/// A point of a sweep, and the surface of others beside it, in the common frame.
pub(super) struct Pair {
    /// The point's sweep.
    pub sweep: u32,
    /// Where it is.
    pub at: Vec3,
    /// The points whose weighted mean the surface goes through, by their sweeps.
    pub parts: Vec<Part>,
    /// Distance of the point from the surface along its normal.
    pub residual: f64,
    /// The surface's unit normal.
    pub normal: Vec3,
    /// What is not known of it: directions along the surface, as long as the standard deviation of its slope.
    pub slopes: [Vec3; 2],
}

/// What a sweep counts for a surface.
pub(super) struct Part {
    pub sweep: u32,
    /// The sum of its points' weights; those of all parts add up to 1.
    pub weight: f64,
    /// The sum of its points' places times their weights.
    pub at: Vec3,
}

impl Pair {
    /// How the distance along a direction grows as each of its sweeps moves.
    fn rows(&self, direction: Vec3) -> Vec<(usize, [f64; UNKNOWNS])> {
        let row = |at: Vec3, d: Vec3, weight: f64| {
            let turn = at.cross(d);
            [turn[0], turn[1], turn[2], weight * d[0], weight * d[1], weight * d[2]]
        };
        let parts = self.parts.iter().map(|p| (p.sweep as usize, row(-p.at, direction, -p.weight)));
        std::iter::once((self.sweep as usize, row(self.at, direction, 1.0))).chain(parts).collect()
    }
}

/// Symmetric sums over pairs: upper triangle, row after row.
struct Sums(Vec<f64>);

impl Sums {
    fn new(unknowns: usize) -> Self {
        Self(vec![0.0; unknowns * unknowns])
    }

    /// Adds the square of what grows by these rows.
    fn add(&mut self, unknowns: usize, rows: &[(usize, [f64; UNKNOWNS])], weight: f64) {
        for (a, left) in rows {
            for (b, right) in rows.iter().filter(|(b, _)| a <= b) {
                for (i, x) in left.iter().enumerate() {
                    let first = if a == b { i } else { 0 };
                    let at = (UNKNOWNS * a + i) * unknowns + UNKNOWNS * b;
                    for (sum, y) in self.0[at + first..at + UNKNOWNS].iter_mut().zip(&right[first..]) {
                        *sum += weight * x * y;
                    }
                }
            }
        }
    }

    /// Times a vector.
    fn times(&self, x: &[f64]) -> Vec<f64> {
        let n = x.len();
        let mut out = vec![0.0; n];
        for r in 0..n {
            out[r] += self.0[r * n + r] * x[r];
            for c in r + 1..n {
                let a = self.0[r * n + c];
                out[r] += a * x[c];
                out[c] += a * x[r];
            }
        }
        out
    }
}

/// Normal equations of a step.
pub(super) struct Equations {
    /// What the pairs tell.
    matrix: Sums,
    right: Vec<f64>,
    /// How much of that is but noise of the normals: a plane whose normal is a little off seems to tell where
    /// along itself a point is.
    noise: Sums,
}

impl Equations {
    /// Of pairs whose residuals have this size, for so many sweeps.
    pub fn of(pairs: &[Pair], sweeps: usize, size: f64) -> Self {
        let n = UNKNOWNS * sweeps;
        let (mut matrix, mut noise, mut right) = (Sums::new(n), Sums::new(n), vec![0.0; n]);
        for pair in pairs {
            let residual = pair.residual;
            let weight = (REGISTER.freedom + 1.0) / (REGISTER.freedom * size * size + residual * residual);
            let rows = pair.rows(pair.normal);
            matrix.add(n, &rows, weight);
            for (sweep, row) in &rows {
                for (sum, a) in right[UNKNOWNS * sweep..].iter_mut().zip(row) {
                    *sum -= weight * a * residual;
                }
            }
            pair.slopes.iter().for_each(|s| noise.add(n, &pair.rows(*s), weight));
        }
        Self { matrix, right, noise }
    }

    /// The steps. Beforehand motions are as likely as normal ones of the size of the reach, and less likely
    /// where only the noise of normals would move them.
    pub fn solve(self, motions: &[Motion]) -> Vec<Motion> {
        let Self { mut matrix, mut right, mut noise } = self;
        let n = right.len();
        (0..n).for_each(|i| noise.0[i * n + i] += 1.0 / (REGISTER.reach * REGISTER.reach));
        let so_far: Vec<f64> =
            motions.iter().flat_map(|m| m.turn_sine().0.into_iter().chain(m.shift.0)).collect();
        right.iter_mut().zip(noise.times(&so_far)).for_each(|(r, pull)| *r -= pull);
        matrix.0.iter_mut().zip(&noise.0).for_each(|(a, b)| *a += b);
        if !cholesky(&mut matrix.0, n) {
            return vec![Motion::NONE; motions.len()];
        }
        cholesky_solve(&matrix.0, n, &mut right);
        let step = |x: &[f64]| Motion::new(Vec3([x[0], x[1], x[2]]), Vec3([x[3], x[4], x[5]]));
        right.chunks_exact(UNKNOWNS).map(step).collect()
    }

    /// Half the derivative of the weighted squares by the unknowns.
    #[cfg(test)]
    pub fn gradient(&self) -> Vec<f64> {
        self.right.iter().map(|x| -x).collect()
    }
}
