//! Whether the points about a place ask for a crease.
//!
//! In: windows. Out: pieces of creases, where the points are much likelier with two sides that meet along a
//! line than with a smooth surface, be it a polynomial, a rounded edge, or what the charts say.

use super::constants::CREASE;
use super::model::{self, UNKNOWNS};
use super::piece::Piece;
use super::window::{Scratch, Window, Windows};
use crate::error::Result;
use crate::run::Context;
use rayon::prelude::*;
use std::sync::Mutex;

/// The pieces that are found about the seeds, in their order.
pub(super) fn pieces(windows: &Windows<'_>, seeds: &[u32], ctx: &Context<'_>) -> Result<Vec<Piece>> {
    // Scratch is an array for all vertices: each thread takes one that another has left, if there is one.
    let left: Mutex<Vec<Scratch>> = Mutex::default();
    let found: Vec<Vec<Piece>> = seeds
        .par_chunks(CREASE.check)
        .map(|seeds| {
            let taken = left.lock().ok().and_then(|mut left| left.pop());
            let mut scratch = taken.map_or_else(|| windows.scratch(ctx), Ok)?;
            let mut found = Vec::new();
            for &v in seeds {
                ctx.check()?;
                found.extend(about(v, windows, &mut scratch));
            }
            if let Ok(mut left) = left.lock() {
                left.push(scratch);
            }
            Ok(found)
        })
        .collect::<Result<_>>()?;
    Ok(found.concat())
}

/// The piece about a vertex, in the widest window that asks for one.
fn about(vertex: u32, windows: &Windows<'_>, scratch: &mut Scratch) -> Option<Piece> {
    let mut radii = CREASE.radii.iter();
    let piece = radii.find_map(|&radii| piece(&windows.about(vertex, radii, scratch)?, radii))?;
    Some(extended(piece, windows, vertex, scratch))
}

/// The piece of a crease in a window.
fn piece(window: &Window, radius: [f64; 2]) -> Option<Piece> {
    let Window { points, sigma, .. } = window;
    let n = points.len() as f64;
    let (sharp, misfit) = model::crease(points, *sigma)?;
    // A model follows its points as closely as it has unknowns.
    if window.misfit < misfit + 0.5 * UNKNOWNS as f64 {
        return None;
    }
    let mut evidence = f64::INFINITY;
    // Half the logarithm of the number of points for each number that is fitted (Schwarz 1978).
    let charge = |unknowns: usize| 0.5 * n.ln() * (unknowns as f64 - UNKNOWNS as f64);
    for cubic in [false, true] {
        if evidence < CREASE.margin {
            return None;
        }
        let (smooth, unknowns) = model::polynomial(points, *sigma, cubic)?;
        evidence = evidence.min(smooth + charge(unknowns) - misfit);
    }
    for k in 0..CREASE.roundings {
        if evidence < CREASE.margin {
            return None;
        }
        let width = CREASE.rounding * CREASE.wider.powi(k);
        let (_, rounded) = model::fit(points, *sigma, sharp.with_width(width))?;
        evidence = evidence.min(rounded - misfit);
    }
    let Window { at, frame, unit, .. } = *window;
    let reach = radius.map(|r| CREASE.reach * r);
    let piece = Piece { at, frame, unit, across: reach[0], along: [reach[1]; 2], model: sharp };
    let inside = sharp.line(0.0).abs() < reach[0];
    let rises = piece.sides(0.0).iter().all(|n| n.dot(frame[2]) >= CREASE.steep);
    (inside && rises && evidence >= CREASE.margin).then_some(piece)
}

/// The piece as far along the crease as it explains the points.
fn extended(mut piece: Piece, windows: &Windows<'_>, vertex: u32, scratch: &mut Scratch) -> Piece {
    let longest = piece.along[0] + CREASE.strips as f64 * CREASE.strip;
    let strip = windows.strip(vertex, &piece, longest, scratch);
    for (end, sign) in [-1.0, 1.0].into_iter().enumerate() {
        let (mut behind, start) = (0.0, piece.along[end]);
        for k in 0..CREASE.strips {
            let from = start + k as f64 * CREASE.strip;
            let within = |p: &&([f64; 3], f64)| {
                let y = sign * p.0[1];
                y >= from && y < from + CREASE.strip
            };
            let (mut misfit, mut sides) = (0.0, [false; 2]);
            for &(p, claimed) in strip.points.iter().filter(within) {
                misfit += piece.model.misfit(&[p], strip.sigma) - claimed;
                sides[usize::from(p[0] > piece.model.line(p[1]))] = true;
            }
            behind += misfit;
            if behind > 0.0 || sides.contains(&false) {
                break;
            }
            piece.along[end] = from + CREASE.strip;
        }
    }
    piece
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::{Rng, Vec3};

    const SIGMA: f64 = 0.2;
    const RADII: [f64; 2] = [6.0, 6.0];

    /// A window of points, one for each unit of area of the plane, on a height, with noise along its normal;
    /// the charts leave `misfit` times what noise leaves.
    fn window(height: impl Fn(f64, f64) -> f64, misfit: f64, seed: u64) -> Window {
        let mut rng = Rng::new(seed);
        let mut points = Vec::new();
        while points.len() < 113 {
            let [x, y] = [0; 2].map(|_| 12.0 * rng.uniform() - 6.0);
            if x.hypot(y) < RADII[0] {
                let steep = |x1: f64, y1: f64| (height(x1, y1) - height(x, y)) / 1e-6;
                let stretch = (1.0 + steep(x + 1e-6, y).powi(2) + steep(x, y + 1e-6).powi(2)).sqrt();
                points.push([x, y, height(x, y) + SIGMA * stretch * rng.normal()]);
            }
        }
        let misfit = misfit * 0.5 * points.len() as f64;
        let frame = [0, 1, 2].map(|k| Vec3::from_fn(|i| f64::from(u8::from(i == k))));
        Window { at: Vec3::ZERO, frame, unit: 1.0, sigma: SIGMA, points, misfit }
    }

    #[test]
    fn edges_are_creases_and_smooth_surfaces_are_not() {
        let found = |height: &dyn Fn(f64, f64) -> f64| -> usize {
            (0..20).filter(|&seed| piece(&window(height, 1.3, seed), RADII).is_some()).count()
        };
        let edge = |x: f64, _: f64| -x.abs();
        let groove = |x: f64, y: f64| (x - 0.5 - 0.1 * y).abs() - 0.02 * y * y;
        assert!(found(&edge) >= 18 && found(&groove) >= 18, "{} {}", found(&edge), found(&groove));
        let plane = |x: f64, y: f64| 0.3 * x - 0.1 * y;
        let ball = |x: f64, y: f64| (100.0 - x * x - y * y).sqrt();
        let rounded = |x: f64, _: f64| -x.hypot(4.0);
        let wave = |x: f64, _: f64| (0.6 * x).sin();
        for smooth in [&plane as &dyn Fn(f64, f64) -> f64, &ball, &rounded, &wave] {
            assert!(found(smooth) <= 1, "{}", found(smooth));
        }
    }

    #[test]
    fn where_the_charts_explain_the_points_better_there_is_no_crease() {
        assert!(piece(&window(|x, _| -x.abs(), 0.7, 1), RADII).is_none());
    }
}
