//! Rows of a scanner that lie far apart: line lasers, spinning LiDARs, profilers.
//!
//! In: points of which none is a copy. Out: fewer points: where rows are several times as dense along as
//! across, points that follow each other are averaged, two by two, until they are not; at the end, where the
//! given points lie on the charts. All that looks at the points nearest to a point, to tell a sheet from a
//! thread for example, sees a surface then instead of one row of it.

use super::constants::PIPELINE;
use super::copies::{Places, placed};
use super::prepare::Scan;
use super::sheets::OrientedAtlas;
use crate::blend::project::project_member;
use crate::error::Result;
use crate::geometry::PointCloud;
use crate::numeric::dense::principal;
use crate::numeric::stats::median;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use rayon::prelude::*;

/// Stands for no point.
const NONE: u32 = u32::MAX;

/// Averages the points of rows, where enough of them lie in long ones. Returns how many points went into
/// each.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn average(places: &mut Places, ctx: &Context<'_>) -> Result<Vec<u32>> {
    let mut count = vec![1u32; places.points.len()];
    // Most scans have no rows: a sample says so.
    let step = places.points.len().div_ceil(PIPELINE.row_sample).max(1);
    let sample: Vec<u32> = (0..places.points.len() as u32).step_by(step).collect();
    let found = neighbours_in_row(places, &sample, ctx)?;
    if !is_share(found.iter().filter(|b| **b != [NONE; 2]).count(), found.len()) {
        return Ok(count);
    }
    for round in 0..PIPELINE.row_rounds {
        let n = places.points.len();
        let rows = rows(&neighbours_in_row(places, &(0..n as u32).collect::<Vec<_>>(), ctx)?, ctx)?;
        let long = rows.iter().filter(|row| row.len() >= PIPELINE.row_long).map(Vec::len).sum();
        let pairs: Vec<[u32; 2]> =
            rows.iter().flat_map(|row| row.chunks_exact(2).map(|pair| [pair[0], pair[1]])).collect();
        let few = (pairs.len() as f64) < PIPELINE.row_pairs * n as f64;
        if few || (round == 0 && !is_share(long, n)) {
            break;
        }
        join(places, &mut count, &pairs, ctx)?;
    }
    Ok(count)
}

fn is_share(count: usize, of: usize) -> bool {
    count as f64 > PIPELINE.row_share * of as f64
}

/// For each of the points `of` those before and after it in its row; [`NONE`] where it is in none, or its row
/// ends.
fn neighbours_in_row(places: &Places, of: &[u32], ctx: &Context<'_>) -> Result<Vec<[u32; 2]>> {
    let points = &places.points;
    let chunks = of.par_chunks(1024).map(|chunk| {
        ctx.check()?;
        let mut found = Vec::new();
        let of = |&own: &u32| {
            places.tree.nearest(points[own as usize], PIPELINE.row_points, &mut found);
            let near: Vec<(u32, Vec3)> = found.iter().map(|f| (f.index, points[f.index as usize])).collect();
            Row::about(&near).and_then(|row| row.beside(own)).unwrap_or([NONE; 2])
        };
        Ok(chunk.iter().map(of).collect::<Vec<_>>())
    });
    chunks.collect::<Result<Vec<_>>>().map(|v| v.concat())
}

/// A row about a point.
struct Row {
    /// Its points, with their places along it.
    points: Vec<(f64, u32)>,
}

/// A point near another: a number to sort by, its name, where it is from there.
type Near = (f64, u32, Vec3);

fn sort(near: &mut [Near], by: impl Fn(Vec3) -> f64) {
    near.iter_mut().for_each(|n| n.0 = by(n.2));
    near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
}

impl Row {
    /// The row of a point, the first of those `near`, which are its nearest: all of them where they lie along
    /// a line; or those that do so seen from above, if the others are far to the side.
    fn about(near: &[(u32, Vec3)]) -> Option<Self> {
        if near.len() < PIPELINE.row_points {
            return None;
        }
        let (narrow, own) = (PIPELINE.row_width, near[0].1);
        let mut near: Vec<Near> = near.iter().map(|&(i, p)| (0.0, i, p - own)).collect();
        let all = principal(near.iter().map(|n| (n.2, 1.0)))?;
        let mut along = all.axes[2];
        if all.variances[1] > narrow.powi(2) * all.variances[2] {
            let up = all.axes[0];
            let above = |p: Vec3| p - up * p.dot(up);
            sort(&mut near, |p| above(p).norm2());
            let line = principal(near[..PIPELINE.row_least].iter().map(|n| (above(n.2), 1.0)))?;
            if line.variances[1] > narrow.powi(2) * line.variances[2] {
                return None;
            }
            along = line.axes[2];
            let aside = along.cross(up);
            sort(&mut near, |p| p.dot(aside).abs());
            let ends = |k: &usize| near[*k - 1].0 < narrow * near[*k].0;
            let count = (PIPELINE.row_least..=near.len() - PIPELINE.row_beside).find(ends)?;
            near.truncate(count);
        }
        sort(&mut near, |p| p.dot(along));
        let row = Self { points: near.iter().map(|n| (n.0, n.1)).collect() };
        let [thick, wide, _] = principal(near.iter().map(|n| (n.2, 1.0)))?.variances;
        let is_thread = wide > (PIPELINE.row_noise * row.step()).powi(2) && thick > narrow.powi(2) * wide;
        (!is_thread).then_some(row)
    }

    fn step(&self) -> f64 {
        median(&mut self.points.windows(2).map(|w| w[1].0 - w[0].0).collect::<Vec<_>>())
    }

    /// The points before and after one.
    fn beside(&self, own: u32) -> Option<[u32; 2]> {
        let (points, most) = (&self.points, PIPELINE.row_gap * self.step());
        let at = points.iter().position(|p| p.1 == own)?;
        let near = |k: usize| (points[k].0 - points[at].0).abs() < most;
        let before = if at > 0 && near(at - 1) { points[at - 1].1 } else { NONE };
        let after = if at + 1 < points.len() && near(at + 1) { points[at + 1].1 } else { NONE };
        Some([before, after])
    }
}

/// Rows, each in its order. Points are of one row where each has the other beside it.
fn rows(beside: &[[u32; 2]], ctx: &Context<'_>) -> Result<Vec<Vec<u32>>> {
    let n = beside.len();
    let mutual = |i: usize, k: usize| {
        let other = beside[i][k];
        let is = other != NONE && beside[other as usize].contains(&(i as u32));
        if is { other } else { NONE }
    };
    let links: Vec<[u32; 2]> = (0..n).into_par_iter().map(|i| [mutual(i, 0), mutual(i, 1)]).collect();
    ctx.check()?;
    let mut seen = vec![false; n];
    let mut rows = Vec::new();
    // From the ends of rows first; what is left then are rings.
    let ends = (0..n).filter(|&i| links[i].contains(&NONE));
    for (k, start) in ends.chain(0..n).enumerate() {
        ctx.check_at(k)?;
        if seen[start] || links[start] == [NONE; 2] {
            continue;
        }
        let mut row = Vec::new();
        let mut at = start as u32;
        while at != NONE && !seen[at as usize] {
            seen[at as usize] = true;
            row.push(at);
            let [a, b] = links[at as usize];
            at = if a != NONE && !seen[a as usize] { a } else { b };
        }
        rows.push(row);
    }
    Ok(rows)
}

/// Puts each pair's mean in place of its two, by how many points went into them.
fn join(places: &mut Places, count: &mut Vec<u32>, pairs: &[[u32; 2]], ctx: &Context<'_>) -> Result<()> {
    let n = places.points.len();
    let mut gone = vec![false; n];
    let mut of = (0..n as u32).collect::<Vec<_>>();
    for &[a, b] in pairs {
        let (stays, goes) = (a.min(b) as usize, a.max(b) as usize);
        let share = f64::from(count[goes]) / f64::from(count[stays] + count[goes]);
        places.points[stays] = places.points[stays] * (1.0 - share) + places.points[goes] * share;
        count[stays] += count[goes];
        (gone[goes], of[goes]) = (true, stays as u32);
    }
    let mut place = vec![NONE; n];
    let mut points = Vec::with_capacity(n - pairs.len());
    let mut counts = Vec::with_capacity(n - pairs.len());
    for i in (0..n).filter(|&i| !gone[i]) {
        place[i] = points.len() as u32;
        points.push(places.points[i]);
        counts.push(count[i]);
    }
    let of_given = places.of_given.iter().map(|&p| place[of[p as usize] as usize]).collect();
    *count = counts;
    *places = placed(points, of_given, ctx)?;
    Ok(())
}

/// Where the given positions lie on the charts that were averaged with others of their row: each on the
/// charts of their mean.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn feet(
    cloud: &PointCloud,
    scan: &Scan,
    atlas: &OrientedAtlas,
    ctx: &Context<'_>,
) -> Result<Vec<(u32, Vec3)>> {
    let chunks = scan.input.averaged.par_chunks(1024).map(|chunk| {
        ctx.check()?;
        let foot = |&i: &u32| {
            let point = scan.input.of_input[i as usize];
            if point == NONE {
                return None;
            }
            let p = scan.frame.of_user(Vec3(cloud.positions[i as usize]));
            let foot = project_member(p, &atlas.fitted, atlas.members.of(point as usize));
            (foot.chart != NONE).then_some((i, foot.position))
        };
        Ok(chunk.iter().filter_map(foot).collect::<Vec<_>>())
    });
    chunks.collect::<Result<Vec<_>>>().map(|v| v.concat())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::Rng;
    use crate::pipeline::copies;
    use crate::run::Run;

    /// How many points go into one in the median, and how many are left.
    fn averaged(points: Vec<Vec3>) -> (f64, usize) {
        let count = Run::default().execute(|ctx| {
            let mut places = copies::join(points.clone(), true, ctx)?;
            average(&mut places, ctx)
        });
        let mut count: Vec<f64> = count.unwrap().into_iter().map(f64::from).collect();
        assert_eq!(count.iter().sum::<f64>(), points.len() as f64, "no point is lost");
        (median(&mut count), count.len())
    }

    /// Rows of 400 points with steps of 1, so far apart, with so much noise upwards and sideways.
    fn rows(apart: f64, up: f64, aside: f64) -> Vec<Vec3> {
        let mut rng = Rng::new(3);
        let at = |i: u32| [f64::from(i % 400), apart * f64::from(i / 400), 0.0];
        (0..8000).map(|i| Vec3(at(i)) + Vec3([0.0, aside * rng.normal(), up * rng.normal()])).collect()
    }

    #[test]
    fn points_of_rows_are_averaged_until_rows_are_no_longer_dense() {
        for (apart, up, most) in [(1.0, 0.3, 1.0), (3.0, 0.3, 1.0), (10.0, 0.0, 4.0), (10.0, 1.0, 4.0)] {
            let (count, left) = averaged(rows(apart, up, 0.0));
            assert_eq!(count, most, "rows {apart} apart with noise of {up}: {left} points left");
        }
    }

    #[test]
    fn threads_are_no_rows() {
        let mut rng = Rng::new(4);
        let mut thread = |k: u32| {
            let (x, turn) = (400.0 * rng.uniform(), std::f64::consts::TAU * rng.uniform());
            Vec3([x, 40.0 * f64::from(k % 20) + turn.cos(), turn.sin()])
        };
        assert_eq!(averaged((0..8000).map(&mut thread).collect()), (1.0, 8000));
        assert_eq!(averaged(rows(40.0, 1.0, 1.0)), (1.0, 8000));
    }
}
