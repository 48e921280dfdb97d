//! The four corners of a chart that could be a rectangle.
//!
//! In: its border. Out: sets of four places on it. A corner is where the border turns by about a right angle,
//! as seen at some scale; a border has those four and no others there.

use super::border::distance;
use super::constants::STRAIGHT;

/// A closed curve by its length.
struct Curve {
    at: Vec<[f64; 2]>,
    /// Length up to each point, and all of it.
    along: Vec<f64>,
}

impl Curve {
    fn new(border: &[u32], uv: &[[f64; 2]]) -> Self {
        let at: Vec<[f64; 2]> = border.iter().map(|&v| uv[v as usize]).collect();
        let mut along = vec![0.0];
        for i in 0..at.len() {
            along.push(along[i] + distance(at[i], at[(i + 1) % at.len()]));
        }
        Self { at, along }
    }

    fn length(&self) -> f64 {
        self.along[self.at.len()]
    }

    /// The point at a length.
    fn point(&self, x: f64) -> [f64; 2] {
        let n = self.at.len();
        let x = x.rem_euclid(self.length());
        let i = self.along.partition_point(|&a| a <= x).clamp(1, n) - 1;
        let (a, b) = (self.at[i], self.at[(i + 1) % n]);
        let t = (x - self.along[i]) / (self.along[i + 1] - self.along[i]).max(f64::MIN_POSITIVE);
        [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]
    }

    /// By how much it turns at a point, seen from so far away: in radians, left positive.
    fn turn(&self, i: usize, away: f64) -> f64 {
        let (p, x) = (self.at[i], self.along[i]);
        let (a, b) = (self.point(x - away), self.point(x + away));
        let (u, v) = ([p[0] - a[0], p[1] - a[1]], [b[0] - p[0], b[1] - p[1]]);
        (u[0] * v[1] - u[1] * v[0]).atan2(u[0] * v[0] + u[1] * v[1])
    }

    /// The four corners at a scale, ascending; `None` where there are not just four.
    fn four(&self, away: f64) -> Option<[usize; 4]> {
        let n = self.at.len();
        // Near scales say where a corner is, far ones whether.
        let mut turns: Vec<(f64, usize)> = Vec::with_capacity(n);
        for i in 0..n {
            let far = self.turn(i, away);
            let all = (far + self.turn(i, 0.5 * away) + self.turn(i, 0.25 * away)) / 3.0;
            if far < -STRAIGHT.least_turn {
                return None;
            }
            if far.min(all) > STRAIGHT.least_turn {
                turns.push((all, i));
            }
        }
        turns.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let mut out: Vec<usize> = Vec::with_capacity(4);
        for (turn, i) in turns {
            let apart = |&j: &usize| {
                let d = (self.along[i] - self.along[j]).abs();
                d.min(self.length() - d) > away
            };
            if out.iter().all(apart) {
                if out.len() == 4 || turn > STRAIGHT.most_turn {
                    return None;
                }
                out.push(i);
            }
        }
        out.sort_unstable();
        out.try_into().ok()
    }
}

/// Sets of four corners of a border, as places on it, seen from farthest away first.
pub(super) fn corners(border: &[u32], uv: &[[f64; 2]]) -> Vec<[usize; 4]> {
    let curve = Curve::new(border, uv);
    let mut out: Vec<[usize; 4]> = Vec::new();
    for scale in 0..STRAIGHT.scales {
        let away = STRAIGHT.coarsest * curve.length() * 0.5f64.powi(scale as i32);
        let four = curve.four(away);
        out.extend(four.filter(|four| !out.contains(four)));
    }
    out
}
