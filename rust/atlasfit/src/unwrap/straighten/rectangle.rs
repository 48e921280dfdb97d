//! A chart as a rectangle.
//!
//! In: a disk and four corners on its border. Out: the disk on the axis-parallel rectangle of least symmetric
//! Dirichlet energy. Start: a harmonic map with the border by its length, which has no flips (Tutte 1963).
//! Steps: Newton's, in which border vertices slide along their sides, and in turns with them the sizes of the
//! rectangle.

use super::border::chords;
use super::constants::STRAIGHT;
use super::flat::Flat;
use super::goal::Goal;
use crate::numeric::plane::corners;
use crate::run::Context;
use crate::unwrap::chart::Chart;
use crate::unwrap::flatten::shape::{all_positive, jacobian, over_area_at};
use crate::unwrap::surface::{NONE, Surface};

/// The chart on a rectangle with these corners, places on its border; `None` where it is not accepted.
pub(super) fn rectangle(
    s: &Surface,
    c: &Chart,
    border: &[u32],
    places: [usize; 4],
    goal: Goal,
    ctx: &Context<'_>,
) -> Option<Chart> {
    let sides = Sides::new(s, c, border, places);
    if chords(c, &[border.to_vec()], &sides.on).next().is_some() {
        return None;
    }
    let flat = Flat::new(s, c);
    let pinned: Vec<bool> = sides.on.iter().map(|on| on[0] != NONE).collect();
    let at = flat.small(&sides.at);
    let mut uv = flat.harmonic(&c.uv, &pinned, &at, ctx)?;
    for ((p, at), _) in uv.iter_mut().zip(at).zip(&pinned).filter(|p| *p.1) {
        *p = at;
    }
    if !all_positive(&c.tris, &uv) {
        return None;
    }
    let held: Vec<[bool; 2]> = sides
        .on
        .iter()
        .map(|on| [1, 0].map(|k| on.iter().any(|&side| side != NONE && side % 2 == k)))
        .collect();
    let mut last = f64::INFINITY;
    for round in 0..STRAIGHT.rounds {
        resize(&c.tris, &flat.rest, &mut uv);
        let energy = flat.relax(&mut uv, &held, ctx)?;
        if round == 0 && over_area_at(s, c, &flat.sized(&uv), goal.bound) > STRAIGHT.hope * goal.allowed(c) {
            return None;
        }
        if last - energy < STRAIGHT.least {
            break;
        }
        last = energy;
    }
    goal.accepted(s, c, flat.sized(&uv), ctx)
}

/// The border on the sides of a rectangle.
struct Sides {
    /// Position of each border vertex.
    at: Vec<[f64; 2]>,
    /// The sides that each vertex is on, from the lower one on counter-clockwise; two at a corner, [`NONE`]
    /// inside.
    on: Vec<[u32; 2]>,
}

impl Sides {
    /// Each side as long as it is on the surface, or rather the mean of it and the one across.
    fn new(s: &Surface, c: &Chart, border: &[u32], places: [usize; 4]) -> Self {
        let mut after = vec![0.0; c.vertices()];
        for &(i, k) in &c.border {
            let v = c.tris[i as usize][usize::from(k)];
            after[v as usize] = f64::from(s.length[c.faces[i as usize] as usize][usize::from(k)]);
        }
        let n = border.len();
        let run = |k: usize| {
            let (from, to) = (places[k], places[(k + 1) % 4]);
            let count = (to + n - from) % n;
            (0..count).map(move |j| border[(from + j) % n])
        };
        let length = [0, 1, 2, 3].map(|k| run(k).map(|v| after[v as usize]).sum::<f64>());
        let [w, h] = [0, 1].map(|k| 0.5 * (length[k] + length[k + 2]));
        let corner = [[0.0, 0.0], [w, 0.0], [w, h], [0.0, h]];
        let mut out = Self { at: vec![[0.0; 2]; c.vertices()], on: vec![[NONE; 2]; c.vertices()] };
        for k in 0..4 {
            let (from, to) = (corner[k], corner[(k + 1) % 4]);
            let mut along = 0.0;
            for v in run(k) {
                let t = along / length[k];
                // The coordinate that both ends share comes out exactly.
                out.at[v as usize] = [0, 1].map(|k| from[k] + t * (to[k] - from[k]));
                out.on[v as usize][0] = k as u32;
                along += after[v as usize];
            }
            out.on[border[places[k]] as usize][1] = (k as u32 + 3) % 4;
        }
        out
    }
}

/// Scales both directions to the least energy. It is a sum of a part for each: with J the map of a triangle,
/// x the first direction's factor, x² |J1|² + |J2|² / (x det J)², and likewise for the second one's.
fn resize(tris: &[[u32; 3]], rest: &[[f64; 3]], uv: &mut [[f64; 2]]) {
    let (mut grows, mut shrinks) = ([0.0; 2], [0.0; 2]);
    for (t, &r) in tris.iter().zip(rest) {
        let [a, b, c, d] = jacobian(r, corners(*t, uv));
        let (area, det) = (r[0] * r[2], a * d - b * c);
        let squares = [a * a + b * b, c * c + d * d];
        for k in 0..2 {
            grows[k] += area * squares[k];
            shrinks[k] += area * squares[1 - k] / (det * det);
        }
    }
    let factor = [0, 1].map(|k| (shrinks[k] / grows[k]).powf(0.25));
    if factor.iter().all(|f| f.is_finite() && *f > 0.0) {
        uv.iter_mut().for_each(|p| *p = [0, 1].map(|k| p[k] * factor[k]));
    }
}
