//! Which side of each chart is seen from afar, and how likely signs are by that.
//!
//! In: the pieces of charts, or of whatever has one side. Out: the share of each that is seen from each of
//! some directions, by side; for signs, the logarithm of their likelihood.
//!
//! A scan is what viewers saw, so every chart shows its right side to some of them. Where they stood is not
//! known: how many stood in each direction is estimated with the signs, as the shares of a mixture (Dempster
//! et al. 1977). An object on the ground is so told from the ground: whoever sees the object from outside
//! sees the ground from above.

use super::constants::ORIENT;
use crate::atlas::ProjectedPoint;
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use rayon::prelude::*;
use std::f64::consts::PI;

/// A small square of the surface.
pub(crate) struct Piece {
    pub(crate) position: Vec3,
    pub(crate) normal: Vec3,
    /// Side of the square.
    pub(crate) side: f64,
}

/// How much of each chart is seen, for each chart and direction: of the side that its normals point to, and
/// of the other.
pub(crate) struct Views(Vec<Vec<[f32; 2]>>);

/// The places as they are seen along a direction: the squares of a plane across it, and in each the places
/// that lie farthest along it and farthest against it.
struct Depth<'a> {
    places: &'a [Vec3],
    /// How far along the direction each place lies.
    along: Vec<f64>,
    /// The square of each place.
    square: Vec<u32>,
    /// Side of a square.
    side: f64,
    /// Numbers of the two places of each square, `u32::MAX` where there is none.
    ends: Vec<[u32; 2]>,
}

impl Views {
    /// Looks at the pieces of all charts from directions evenly spread over the sphere.
    ///
    /// # Errors
    /// Cancelled or out of time.
    pub(crate) fn of(pieces: &[&[Piece]], ctx: &Context<'_>) -> Result<Self> {
        let side = ORIENT.view_cell * widest(pieces);
        let half = ORIENT.views / 2;
        let places: Vec<Vec3> = pieces.iter().flat_map(|p| p.iter()).map(|p| p.position).collect();
        let seen: Vec<Vec<[[f32; 2]; 2]>> = (0..half)
            .into_par_iter()
            .map(|k| {
                // A spiral over the upper half of the sphere; each axis is looked along both ways.
                let z = (k as f64 + 0.5) / half as f64;
                let turn = k as f64 * PI * (3.0 - 5f64.sqrt());
                let r = (1.0 - z * z).sqrt();
                let axis = Vec3([r * turn.cos(), r * turn.sin(), z]);
                along(pieces, &Depth::of(axis, &places, side, ctx)?, axis, ctx)
            })
            .collect::<Result<_>>()?;
        let of_chart = |c: usize| seen.iter().flat_map(|axis| axis[c]).collect();
        Ok(Self((0..pieces.len()).map(of_chart).collect()))
    }

    /// Logarithm of the likelihood, in nats a chart in the mean, that viewers saw the right sides of these
    /// charts; with the likeliest share of them in each direction.
    pub(crate) fn likelihood(&self, charts: &[u32], signs: &[f64]) -> f64 {
        if charts.is_empty() {
            return 0.0;
        }
        let none = ORIENT.seen_by_chance;
        let rows: Vec<Vec<f64>> = charts
            .iter()
            .map(|&c| {
                let side = usize::from(signs[c as usize] < 0.0);
                self.0[c as usize].iter().map(|s| none + (1.0 - none) * f64::from(s[side])).collect()
            })
            .collect();
        let mut share = vec![1.0 / ORIENT.views as f64; ORIENT.views];
        let mut sum = 0.0;
        for _ in 0..ORIENT.view_rounds {
            let mut next = vec![0.0; ORIENT.views];
            sum = 0.0;
            for row in &rows {
                let seen: f64 = row.iter().zip(&share).map(|(s, w)| s * w).sum();
                sum += seen.ln();
                next.iter_mut().zip(row.iter().zip(&share)).for_each(|(n, (s, w))| *n += s * w / seen);
            }
            share = next.iter().map(|n| n / rows.len() as f64).collect();
        }
        sum / rows.len() as f64
    }
}

/// Of some places of the surface, the shares before which nothing lies along an axis and against it; nothing
/// where none of them is seen from there. `spacing` is that of the points.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn open_along(
    axis: Vec3,
    of: &[u32],
    projected: &[ProjectedPoint],
    spacing: f64,
    ctx: &Context<'_>,
) -> Result<Option<[f64; 2]>> {
    let places: Vec<Vec3> = projected.iter().map(|p| p.position).collect();
    let depth = Depth::of(axis, &places, ORIENT.view_cell * spacing, ctx)?;
    let (mut open, mut all) = ([0; 2], 0);
    for (i, &k) in of.iter().enumerate() {
        ctx.check_at(i)?;
        let p = projected[k as usize];
        if p.normal.dot(axis).abs() >= ORIENT.view_cosine {
            let is_open = depth.open(k as usize, p.normal, axis);
            open.iter_mut().zip(is_open).for_each(|(n, is)| *n += usize::from(is));
            all += 1;
        }
    }
    Ok((all > 0).then(|| open.map(|n| n as f64 / f64::from(all))))
}

/// The side that most pieces' squares are not longer than.
fn widest(pieces: &[&[Piece]]) -> f64 {
    let mut sides: Vec<f64> = pieces.iter().flat_map(|p| p.iter()).map(|p| p.side).collect();
    let at = (sides.len() as f64 * ORIENT.view_widest) as usize;
    if at >= sides.len() {
        return 1.0;
    }
    *sides.select_nth_unstable_by(at, f64::total_cmp).1
}

/// What is seen of each chart from this direction, and from the opposite one.
fn along(
    pieces: &[&[Piece]],
    depth: &Depth<'_>,
    axis: Vec3,
    ctx: &Context<'_>,
) -> Result<Vec<[[f32; 2]; 2]>> {
    let mut first = 0;
    pieces
        .iter()
        .enumerate()
        .map(|(i, chart)| {
            ctx.check_at(i)?;
            let mut seen = [[0.0f32; 2]; 2];
            for (place, p) in (first..).zip(*chart) {
                let cosine = p.normal.dot(axis);
                if cosine.abs() < ORIENT.view_cosine {
                    continue;
                }
                let shown = usize::from(cosine < 0.0);
                let [near, far] = depth.open(place, p.normal, axis);
                seen[0][shown] += f32::from(u8::from(near));
                seen[1][1 - shown] += f32::from(u8::from(far));
            }
            first += chart.len();
            let all = chart.len().max(1) as f32;
            Ok(seen.map(|of| of.map(|n| n / all)))
        })
        .collect()
}

impl<'a> Depth<'a> {
    fn of(axis: Vec3, places: &'a [Vec3], side: f64, ctx: &Context<'_>) -> Result<Self> {
        let (x, y) = axis.tangents();
        let across: Vec<[f64; 2]> = places.iter().map(|p| [p.dot(x), p.dot(y)]).collect();
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for at in &across {
            for k in 0..2 {
                (low[k], high[k]) = (low[k].min(at[k]), high[k].max(at[k]));
            }
        }
        ctx.check()?;
        let extent = (high[0] - low[0]).max(high[1] - low[1]).max(0.0);
        let side = side.max(extent / ORIENT.view_cells as f64);
        let width = (extent / side) as usize + 1;
        let square = |at: &[f64; 2]| {
            let [x, y] = [0, 1].map(|k| (((at[k] - low[k]) / side).max(0.0) as usize).min(width - 1));
            (x + width * y) as u32
        };
        let square: Vec<u32> = across.iter().map(square).collect();
        let along: Vec<f64> = places.iter().map(|p| p.dot(axis)).collect();
        let mut ends = vec![[u32::MAX; 2]; width * width];
        for (i, (&square, &at)) in square.iter().zip(&along).enumerate() {
            ctx.check_at(i)?;
            let [near, far] = &mut ends[square as usize];
            if along.get(*near as usize).is_none_or(|&other| at > other) {
                *near = i as u32;
            }
            if along.get(*far as usize).is_none_or(|&other| at < other) {
                *far = i as u32;
            }
        }
        Ok(Self { places, along, square, side, ends })
    }

    /// Whether nothing lies before a place along the axis, and against it: nothing but what its own surface
    /// rises to within a square, which stays near the place's plane.
    fn open(&self, place: usize, normal: Vec3, axis: Vec3) -> [bool; 2] {
        let ends = self.ends[self.square[place] as usize];
        [(ends[0], 1.0), (ends[1], -1.0)].map(|(end, side)| {
            if side * (self.along[end as usize] - self.along[place]) <= 0.0 {
                return true;
            }
            let to = self.places[end as usize] - self.places[place];
            let off = to.dot(normal);
            // How far from the place the line of sight through the other meets the place's plane.
            let along = (to - axis * (off / normal.dot(axis))).norm();
            off.abs() < ORIENT.view_bend * (along + self.side)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Run;

    /// Two square sheets at these heights, 0.1 apart; each is one chart that faces up.
    fn sheets(heights: [f64; 2]) -> Views {
        let sheet = |z: f64| -> Vec<Piece> {
            let at = |k: u32| Vec3([0.02 * f64::from(k % 50), 0.02 * f64::from(k / 50), z]);
            let normal = Vec3([0.0, 0.0, 1.0]);
            (0..2500).map(|k| Piece { position: at(k), normal, side: 0.02 }).collect()
        };
        let [a, b] = heights.map(sheet);
        Run::default().execute(|ctx| Views::of(&[&a, &b], ctx)).expect("nothing stops it")
    }

    #[test]
    fn the_sides_of_two_sheets_that_face_each_other_are_seen_the_least() {
        let views = sheets([0.0, 0.1]);
        let of = |signs: [f64; 2]| views.likelihood(&[0, 1], &signs);
        let (apart, facing) = (of([-1.0, 1.0]), of([1.0, -1.0]));
        let (up, down) = (of([1.0, 1.0]), of([-1.0, -1.0]));
        assert!(apart > up && up > facing + 1.0, "{apart} {up} {facing}");
        assert!((up - down).abs() < 0.05, "{up} {down}");
    }

    #[test]
    fn a_sheet_hides_another_that_is_nearer_than_a_square_is_wide() {
        let views = sheets([0.0, 0.03]);
        let of = |signs: [f64; 2]| views.likelihood(&[0, 1], &signs);
        assert!(of([-1.0, 1.0]) > of([1.0, 1.0]) + 0.3, "{} {}", of([-1.0, 1.0]), of([1.0, 1.0]));
        assert!(of([1.0, 1.0]) > of([1.0, -1.0]) + 1.0, "{} {}", of([1.0, 1.0]), of([1.0, -1.0]));
    }

    #[test]
    fn a_sheet_alone_is_seen_as_well_from_both_sides() {
        let views = sheets([0.0, 0.1]);
        let alone = sheets([0.0, 40.0]);
        let of = |views: &Views, sign: f64| views.likelihood(&[0], &[sign, 1.0]);
        assert!((of(&alone, 1.0) - of(&alone, -1.0)).abs() < 0.02);
        assert!(of(&views, -1.0) > of(&views, 1.0) + 0.2);
    }

    #[test]
    fn of_two_sheets_the_upper_one_is_open_upwards_and_the_lower_one_downwards() {
        let at = |k: u32, z: f64| Vec3([0.02 * f64::from(k % 50), 0.02 * f64::from(k / 50), z]);
        let normal = Vec3([0.0, 0.0, 1.0]);
        let point = |k: u32, z: f64| ProjectedPoint { position: at(k, z), normal, chart: 0 };
        let sheets: Vec<ProjectedPoint> =
            [0.0, 0.1].into_iter().flat_map(|z| (0..2500).map(move |k| point(k, z))).collect();
        let open = |axis: Vec3, of: std::ops::Range<u32>| {
            let of: Vec<u32> = of.collect();
            Run::default().execute(|ctx| open_along(axis, &of, &sheets, 0.02, ctx)).expect("nothing stops it")
        };
        assert_eq!(open(normal, 0..2500), Some([0.0, 1.0]));
        assert_eq!(open(normal, 2500..5000), Some([1.0, 0.0]));
        // Edge-on nothing is seen.
        assert_eq!(open(Vec3([1.0, 0.0, 0.0]), 0..2500), None);
    }
}
