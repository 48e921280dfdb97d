//! Whether the points about a place ask for a crease.
//!
//! In: windows. Out: pieces of creases, where the points are much likelier with two sides that meet along a
//! line than with a smooth surface, be it a polynomial, a rounded edge, or what the charts say.

use super::bends::spread;
use super::constants::CREASE;
use super::model::{self, Model, UNKNOWNS};
use super::moments::Columns;
use super::piece::Piece;
use super::window::{Scratch, Window, Windows};
use crate::contour::surface::Surface;
use crate::error::Result;
use crate::numeric::sort::sort;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::Neighbours;
use rayon::prelude::*;
use std::sync::Mutex;

/// The pieces that are found about the seeds, in their order. A few seeds are looked at first, then all next
/// to those that found a piece, and so on: most places that bend are no creases.
pub(super) fn pieces(
    s: &Surface,
    windows: &Windows<'_>,
    seeds: &[u32],
    ctx: &Context<'_>,
) -> Result<Vec<Piece>> {
    let mut look = spread(seeds, CREASE.first_apart, s, windows, ctx)?;
    let places: Vec<Vec3> = seeds.iter().map(|&v| s.positions[v as usize]).collect();
    let tree = Neighbours::build(&places, ctx)?;
    let mut found: Vec<Option<Vec<Piece>>> = vec![None; seeds.len()];
    let mut near = Vec::new();
    while !look.is_empty() {
        for (&k, pieces) in look.iter().zip(about_all(&look, seeds, windows, ctx)?) {
            found[k as usize] = Some(pieces);
        }
        let mut next = Vec::new();
        for &k in look.iter().filter(|&&k| found[k as usize].as_ref().is_some_and(|p| !p.is_empty())) {
            ctx.check()?;
            let Some(unit) = windows.unit(seeds[k as usize]) else { continue };
            tree.within(places[k as usize], CREASE.next_within * unit, &mut near);
            next.extend(near.iter().map(|n| n.index).filter(|&n| found[n as usize].is_none()));
        }
        sort(&mut next, ctx)?;
        next.dedup();
        look = next;
    }
    Ok(found.into_iter().flatten().flatten().collect())
}

/// The pieces that are found about some of the seeds.
fn about_all(
    look: &[u32],
    seeds: &[u32],
    windows: &Windows<'_>,
    ctx: &Context<'_>,
) -> Result<Vec<Vec<Piece>>> {
    // Scratch is an array for all vertices: each thread takes one that another has left, if there is one.
    let left: Mutex<Vec<Scratch>> = Mutex::default();
    let found: Vec<Vec<Vec<Piece>>> = look
        .par_chunks(CREASE.check)
        .map(|look| {
            let taken = left.lock().ok().and_then(|mut left| left.pop());
            let mut scratch = taken.map_or_else(|| windows.scratch(ctx), Ok)?;
            let mut found = Vec::with_capacity(look.len());
            for &k in look {
                ctx.check()?;
                found.push(about(seeds[k as usize], windows, &mut scratch));
            }
            if let Ok(mut left) = left.lock() {
                left.push(scratch);
            }
            Ok(found)
        })
        .collect::<Result<_>>()?;
    Ok(found.into_iter().flatten().collect())
}

/// The pieces about a vertex, in the widest windows that ask for one.
fn about(vertex: u32, windows: &Windows<'_>, scratch: &mut Scratch) -> Vec<Piece> {
    let mut tried = 0;
    for radii in CREASE.radii {
        let found = windows.about(vertex, radii, scratch);
        tried += found.len();
        // The more windows are looked at, the more of them show a crease by chance.
        let margin = CREASE.margin + (tried as f64).max(1.0).ln();
        let pieces: Vec<Piece> = found.iter().filter_map(|w| piece(w, radii, margin)).collect();
        if !pieces.is_empty() {
            return pieces.into_iter().map(|p| extended(p, radii[1], windows, vertex, scratch)).collect();
        }
    }
    Vec::new()
}

/// The piece of a crease in a window with these radii, if the evidence for it is beyond a margin.
fn piece(window: &Window, radii: [f64; 2], margin: f64) -> Option<Piece> {
    let Window { points, sigma, .. } = window;
    let columns = Columns::new(points);
    let (sharp, misfit) = model::crease(&columns, *sigma, &window.starts)?;
    let [across, along] = radii.map(|r| CREASE.reach * r);
    let along = both_sides(points, &sharp, [across, along]);
    // Where points of another side lie on the line, no two sides meet.
    let on_line =
        |[x, y, _]: [f64; 3]| (x - sharp.line(y)).abs() < CREASE.clear && y > -along[0] && y < along[1];
    let others = window.others.iter().filter(|(p, _)| on_line(*p));
    let lost: f64 = others.map(|(p, claimed)| sharp.misfit(*p, *sigma) - claimed).sum();
    // A model follows its points as closely as it has unknowns.
    let mut evidence = window.misfit - misfit - 0.5 * UNKNOWNS as f64 - lost;
    // Half the logarithm of the number of points for each number that is fitted (Schwarz 1978).
    let charge = |unknowns: usize| 0.5 * (points.len() as f64).ln() * (unknowns as f64 - UNKNOWNS as f64);
    for cubic in [false, true] {
        if evidence < margin {
            return None;
        }
        let (smooth, unknowns) = model::polynomial(&columns, *sigma, cubic)?;
        evidence = evidence.min(smooth + charge(unknowns) - misfit);
    }
    if evidence < margin {
        return None;
    }
    let (_, rounded) = model::fit(&columns, *sigma, sharp.with_width(CREASE.rounding))?;
    evidence = evidence.min(rounded - misfit);
    let Window { at, frame, unit, .. } = *window;
    let piece = Piece { at, frame, unit, across, along, model: sharp };
    let inside = sharp.line(0.0).abs() < across;
    let rises = piece.sides(0.0).iter().all(|n| n.dot(frame[2]) >= CREASE.steep);
    (inside && rises && evidence >= margin).then_some(piece)
}

/// How far both sides have points along a crease, backwards and forwards.
fn both_sides(points: &[[f64; 3]], model: &Model, [across, along]: [f64; 2]) -> [f64; 2] {
    let end = |sign: f64, right: bool| {
        let beside = points.iter().filter(|[x, y, _]| {
            let off = x - model.line(*y);
            off.abs() <= across && (off > 0.0) == right && sign * y >= 0.0
        });
        let mut along: Vec<f64> = beside.map(|p| sign * p[1]).collect();
        along.sort_by(f64::total_cmp);
        along.into_iter().fold(0.0, |end, y| if y - end <= CREASE.gap { y } else { end })
    };
    [-1.0, 1.0].map(|sign| end(sign, false).min(end(sign, true)).clamp(CREASE.beside, along))
}

/// The piece as far along the crease as it explains the points, beyond a window of this radius.
fn extended(
    mut piece: Piece,
    radius: f64,
    windows: &Windows<'_>,
    vertex: u32,
    scratch: &mut Scratch,
) -> Piece {
    let longest = piece.along[0].max(piece.along[1]) + CREASE.strips as f64 * CREASE.strip;
    let strip = windows.strip(vertex, &piece, longest, scratch);
    for (end, sign) in [-1.0, 1.0].into_iter().enumerate() {
        let (mut behind, start) = (0.0, piece.along[end]);
        // It ends within the window.
        if start < CREASE.reach * radius {
            continue;
        }
        for k in 0..CREASE.strips {
            let from = start + k as f64 * CREASE.strip;
            let within = |p: &&([f64; 3], f64)| {
                let y = sign * p.0[1];
                y >= from && y < from + CREASE.strip
            };
            let (mut misfit, mut sides) = (0.0, [false; 2]);
            for &(p, claimed) in strip.points.iter().filter(within) {
                misfit += piece.model.misfit(p, strip.sigma) - claimed;
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
        let (others, starts) = (Vec::new(), CREASE.starts.to_vec());
        Window { at: Vec3::ZERO, frame, unit: 1.0, sigma: SIGMA, points, misfit, others, starts }
    }

    #[test]
    fn edges_are_creases_and_smooth_surfaces_are_not() {
        let found = |height: &dyn Fn(f64, f64) -> f64| -> usize {
            (0..20).filter(|&seed| piece(&window(height, 1.3, seed), RADII, CREASE.margin).is_some()).count()
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
        assert!(piece(&window(|x, _| -x.abs(), 0.7, 1), RADII, CREASE.margin).is_none());
    }

    #[test]
    fn where_another_side_lies_on_the_line_there_is_no_crease_and_beside_it_there_may_be() {
        let mut edge = window(|x, _| -x.abs(), 1.3, 1);
        let strip = |x: f64| (0..20).map(|k| ([x, 0.2 * f64::from(k) - 2.0, -2.0], 0.5)).collect();
        edge.others = strip(3.0);
        assert!(piece(&edge, RADII, CREASE.margin).is_some());
        edge.others = strip(0.0);
        assert!(piece(&edge, RADII, CREASE.margin).is_none());
    }

    #[test]
    fn a_piece_ends_where_one_of_its_sides_does() {
        let mut edge = window(|x, _| -x.abs(), 1.3, 1);
        edge.points.retain(|&[x, y, _]| x < 0.0 || y < 1.5);
        edge.misfit = 1.3 * 0.5 * edge.points.len() as f64;
        let found = piece(&edge, RADII, CREASE.margin).expect("a crease");
        assert!(found.along[0] > 2.5 && found.along[1] < 1.5 && found.along[1] > 0.5, "{:?}", found.along);
    }
}
