//! Depth of several views, each rounded to steps along a direction of its own, as depth cameras and stereo
//! give it.
//!
//! In: points and the planes that they are on. Out: each point moved along its view's direction to where it
//! lies between two steps. Where the level of a view changes, its depth was halfway between the two levels;
//! between such places it is interpolated. What is left is less than the rounding, by as much as levels are
//! wider than the view's points are apart; and it does not stay the same over a whole level, which would pass
//! for relief. Where many views see a place, each with few points, their roundings are noise like any other:
//! such scans stay as they are.

use super::constants::NOISE;
use super::estimate::quadric;
use super::stack::{Level, usual_step};
use crate::error::Result;
use crate::numeric::stats::median;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::neighbours::{Neighbour, Neighbours};
use rayon::prelude::*;

/// Stands for no view.
const NONE: u32 = u32::MAX;

/// A camera that rounded depth to steps.
pub(crate) struct Camera {
    /// Along this unit vector, or against it.
    pub axis: Vec3,
    /// The points that it saw.
    pub points: Vec<u32>,
}

/// Points between the steps that their depth was rounded to.
pub(crate) struct Between {
    /// Where they are.
    pub points: Vec<Vec3>,
    /// How far they were moved along the surface's normal, root mean square.
    pub moved: f64,
    /// Who saw them; each point one at most.
    pub cameras: Vec<Camera>,
}

/// The points, moved to between their steps; nothing where they are not of views whose depth is rounded to
/// steps that levels of several points show.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn steps(
    points: &[Vec3],
    tree: &Neighbours,
    stacks: Vec<(Vec3, Vec<Level>)>,
    ctx: &Context<'_>,
) -> Result<Option<Between>> {
    let mut view = vec![NONE; points.len()];
    let mut views: Vec<View> = Vec::new();
    for (direction, mut levels) in stacks {
        let mut shared = vec![0; views.len()];
        for level in &mut levels {
            let of_others = level.points.iter().map(|&p| view[p as usize]).filter(|&v| v != NONE);
            of_others.for_each(|v| shared[v as usize] += 1);
            level.points.retain(|&p| view[p as usize] == NONE);
        }
        // The points of grids and of voxels are on planes of all directions.
        if views.iter().zip(shared).any(|(v, shared)| shared as f64 > NOISE.on_grid * v.points() as f64) {
            return Ok(None);
        }
        levels.retain(|l| !l.points.is_empty());
        if levels.len() >= NOISE.levels_with_ends {
            levels.iter().flat_map(|l| &l.points).for_each(|&p| view[p as usize] = views.len() as u32);
            views.push(View::new(points, direction, levels, ctx)?);
        }
    }
    if 2 * views.iter().map(View::points).sum::<usize>() < points.len() {
        return Ok(None);
    }
    let (mut between, mut cameras) = (points.to_vec(), Vec::new());
    for (k, v) in (0..).zip(&views) {
        if v.shows_ends(points, tree, &view, k, ctx)? {
            for (point, by) in v.shifts(points, ctx)? {
                between[point as usize] = points[point as usize] + v.direction * by;
            }
            let seen = v.levels.iter().flat_map(|l| l.points.iter().copied()).collect();
            cameras.push(Camera { axis: v.direction, points: seen });
        }
    }
    if 2 * cameras.iter().map(|c| c.points.len()).sum::<usize>() < points.len() {
        return Ok(None);
    }
    let moved = along_normals(points, &between, tree, ctx)?;
    Ok(Some(Between { points: between, moved, cameras }))
}

/// How far points were moved along the surface's normal, root mean square of a sample.
fn along_normals(from: &[Vec3], to: &[Vec3], tree: &Neighbours, ctx: &Context<'_>) -> Result<f64> {
    let sample: Vec<usize> = (0..from.len()).step_by(from.len().div_ceil(NOISE.samples).max(1)).collect();
    let moved = |found: &mut Vec<Neighbour>, &i: &usize| {
        ctx.check()?;
        tree.nearest(from[i], NOISE.points_across, found);
        Ok(quadric(to, found).map(|q| (to[i] - from[i]).dot(q.normal).powi(2)))
    };
    let moved: Vec<Option<f64>> = sample.par_iter().map_init(Vec::new, moved).collect::<Result<_>>()?;
    let moved: Vec<f64> = moved.into_iter().flatten().collect();
    Ok((moved.iter().sum::<f64>() / moved.len().max(1) as f64).sqrt())
}

/// Where a point is on the levels of a view.
struct Ends {
    /// Whether the view saw it.
    own: bool,
    /// Whether the view saw points near it.
    seen: bool,
    /// How far the points of its level are apart there.
    apart: f64,
    /// How far the nearest end of its level is.
    nearest: f64,
    /// How far the two ends are together.
    width: f64,
}

/// The levels of a view.
struct View {
    direction: Vec3,
    levels: Vec<Level>,
    /// Points of each level.
    trees: Vec<Neighbours>,
    /// How far it is from each level to the next, if that is a single step.
    steps: Vec<Option<f64>>,
}

impl View {
    fn new(points: &[Vec3], direction: Vec3, levels: Vec<Level>, ctx: &Context<'_>) -> Result<Self> {
        let tree = |level: &Level| {
            let at: Vec<Vec3> = level.points.iter().map(|&p| points[p as usize]).collect();
            Neighbours::build(&at, ctx)
        };
        let trees = levels.par_iter().map(tree).collect::<Result<_>>()?;
        let apart: Vec<f64> = levels.windows(2).map(|l| l[1].at - l[0].at).collect();
        let one_step =
            |k: usize| Some(apart[k]).filter(|step| *step <= NOISE.one_step * usual_step(&apart, k));
        let steps = (0..apart.len()).map(one_step).collect();
        Ok(Self { direction, levels, trees, steps })
    }

    /// How many points it saw.
    fn points(&self) -> usize {
        self.levels.iter().map(|l| l.points.len()).sum()
    }

    /// The steps below and above a level.
    fn steps_about(&self, level: usize) -> Option<[f64; 2]> {
        Some([self.steps[level.checked_sub(1)?]?, (*self.steps.get(level)?)?])
    }

    /// The nearest point of a level to a place, and the way there along the planes; nothing if there is no
    /// such level.
    fn way_to(&self, level: usize, at: Vec3, points: &[Vec3]) -> Option<(u32, Vec3)> {
        let nearest = self.trees.get(level)?.nearest_one(at).index;
        let nearest = self.levels[level].points[nearest as usize];
        let to = points[nearest as usize] - at;
        Some((nearest, to - self.direction * to.dot(self.direction)))
    }

    /// How far from `at`, along the planes, the nearest points of the levels below and above one are; nothing
    /// where there are none, or where they are on the same side: the top of a hump has no end above.
    fn to_ends(&self, points: &[Vec3], at: Vec3, level: usize) -> Option<[f64; 2]> {
        self.steps_about(level)?;
        let ((_, low), (_, high)) =
            (self.way_to(level - 1, at, points)?, self.way_to(level + 1, at, points)?);
        (low.dot(high) < 0.0).then(|| [low.norm(), high.norm()])
    }

    /// How far a point of a level is to be moved along the direction.
    fn shift(&self, points: &[Vec3], at: Vec3, level: usize) -> Option<f64> {
        if let Some([low, high]) = self.to_ends(points, at, level) {
            let [below, above] = self.steps_about(level)?;
            return Some(0.5 * (low / (low + high) * (below + above) - below));
        }
        // Only one end is near: from it on the surface goes on as it does beyond it, but no farther than to
        // this level itself.
        let end = |beside: usize| {
            let step = (*self.steps.get(level.min(beside))?)?;
            let (nearest, way) = self.way_to(beside, at, points)?;
            Some((way.norm(), beside, nearest, step))
        };
        let ends = [level.checked_sub(1).and_then(end), end(level + 1)];
        let nearer = ends.into_iter().flatten().min_by(|a, b| a.0.total_cmp(&b.0));
        let (far, beside, nearest, step) = nearer?;
        let [low, high] = self.to_ends(points, points[nearest as usize], beside)?;
        let shift = step * (0.5 - (far / (low + high)).min(0.5));
        Some(if beside < level { -shift } else { shift })
    }

    /// Whether levels are wide enough to show where they end, and other points are on them as its own are:
    /// those of other views are anywhere, the risers of stairs at the ends of treads. `view` says of which
    /// view each point is, `own` which this is.
    fn shows_ends(
        &self,
        points: &[Vec3],
        tree: &Neighbours,
        view: &[u32],
        own: u32,
        ctx: &Context<'_>,
    ) -> Result<bool> {
        let apart = points.len().div_ceil(NOISE.samples).max(1);
        let look = |found: &mut Vec<Neighbour>, i: usize| {
            ctx.check()?;
            let at = points[i];
            let Some(level) = self.nearest_level(at) else { return Ok(None) };
            let Some([low, high]) = self.to_ends(points, at, level) else { return Ok(None) };
            self.trees[level].nearest(at, NOISE.apart_among, found);
            let apart = found.last().map_or(0.0, |f| f.dist2.sqrt());
            tree.nearest(at, NOISE.coplanar_among, found);
            let seen = found.iter().any(|f| view[f.index as usize] == own);
            let (nearest, width) = (low.min(high), low + high);
            Ok(Some(Ends { own: view[i] == own, seen, apart, nearest, width }))
        };
        let sample = (0..points.len()).into_par_iter().step_by(apart);
        let found: Vec<Option<Ends>> = sample.map_init(Vec::new, look).collect::<Result<_>>()?;
        let (of_own, of_others): (Vec<Ends>, Vec<Ends>) = found.into_iter().flatten().partition(|f| f.own);
        if of_own.is_empty() {
            return Ok(false);
        }
        let typical =
            |ends: &[Ends], of: fn(&Ends) -> f64| median(&mut ends.iter().map(of).collect::<Vec<_>>());
        if typical(&of_own, |f| f.width) < NOISE.level_width * typical(&of_own, |f| f.apart) {
            return Ok(false);
        }
        // Where this view saw nothing, others have no place on its levels.
        let beside: Vec<Ends> = of_others.into_iter().filter(|f| f.seen).collect();
        let nearest = typical(&of_own, |f| f.nearest);
        Ok(beside.is_empty() || typical(&beside, |f| f.nearest) >= NOISE.at_ends * nearest)
    }

    /// The level that a place is nearest to.
    fn nearest_level(&self, at: Vec3) -> Option<usize> {
        let up = at.dot(self.direction);
        let above = self.levels.partition_point(|l| l.at < up);
        let off = |k: &usize| (self.levels[*k].at - up).abs();
        let near = above.saturating_sub(1)..(above + 1).min(self.levels.len());
        near.min_by(|a, b| off(a).total_cmp(&off(b)))
    }

    /// How far points are to be moved along the direction.
    fn shifts(&self, points: &[Vec3], ctx: &Context<'_>) -> Result<Vec<(u32, f64)>> {
        let of_level = |k: usize| {
            ctx.check()?;
            let shift = |&p: &u32| Some((p, self.shift(points, points[p as usize], k)?));
            Ok(self.levels[k].points.iter().filter_map(shift).collect())
        };
        let levels = (0..self.levels.len()).into_par_iter();
        Ok(levels.map(of_level).collect::<Result<Vec<Vec<_>>>>()?.concat())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::stack::find;
    use crate::numeric::Rng;
    use crate::run::Run;

    /// The points between their steps, if they are said to have some.
    fn between(points: &[Vec3]) -> Option<Between> {
        let found = Run::default().execute(|ctx| {
            let tree = Neighbours::build(points, ctx)?;
            let Some(found) = find(points, &tree, ctx)? else { return Ok(None) };
            steps(points, &tree, found.levels, ctx)
        });
        found.unwrap()
    }

    /// How far above the sheet a point is.
    fn above(p: Vec3) -> f64 {
        p[2] - 0.5 * p[0] - 0.1 * (5.0 * p[1]).sin()
    }

    fn sheet(rng: &mut Rng) -> Vec3 {
        let [x, y] = [rng.uniform(), rng.uniform()];
        let flat = Vec3([x, y, 0.0]);
        flat - Vec3([0.0, 0.0, above(flat)])
    }

    /// The same points with depth along `axis` rounded to a step of 0.03.
    fn rounded(p: Vec3, axis: Vec3) -> Vec3 {
        let depth = p.dot(axis);
        p + axis * ((depth / 0.03).round() * 0.03 - depth)
    }

    fn rms(points: &[Vec3]) -> f64 {
        (points.iter().map(|p| above(*p).powi(2)).sum::<f64>() / points.len() as f64).sqrt()
    }

    #[test]
    fn points_of_one_view_and_of_two_come_to_half_of_their_error() {
        let views = [Vec3([0.1, -0.2, 1.0]).normalized(), Vec3([0.5, 0.4, 0.8]).normalized()];
        for count in [1, 2] {
            let mut rng = Rng::new(3);
            let points: Vec<Vec3> =
                (0..20_000).map(|i| rounded(sheet(&mut rng), views[i * count / 20_000])).collect();
            let found = between(&points).expect("steps");
            let (before, now) = (rms(&points), rms(&found.points));
            assert!(now < before / 2.0, "{before} before, {now} now, {count} views");
            // Along the normal it is less than upwards.
            assert!((0.6..1.0).contains(&(found.moved / before)), "{} of {before}", found.moved);
        }
    }

    /// Nothing is rounded here, though many points lie on many parallel planes.
    #[test]
    fn stairs_fins_and_grids_stay_as_they_are() {
        let mut rng = Rng::new(4);
        let turn = |p: Vec3| {
            let axis = Vec3([0.3, -0.5, 0.8]).normalized();
            let (u, v) = axis.tangents();
            u * p[0] + v * p[1] + axis * p[2]
        };
        let stairs = |i: usize| {
            let (step, way, y) = ((i % 25) as f64, rng.uniform(), rng.uniform());
            let (x, z) =
                if (i / 25).is_multiple_of(2) { (step + way, step) } else { (step, step - 1.0 + way) };
            turn(Vec3([0.04 * x, y, 0.04 * z]))
        };
        let stairs: Vec<Vec3> = (0..20_000).map(stairs).collect();
        assert!(between(&stairs).is_none(), "stairs");
        let fins = |i: usize| turn(Vec3([(i % 40) as f64 / 40.0, rng.uniform(), rng.uniform()]));
        let fins: Vec<Vec3> = (0..20_000).map(fins).collect();
        assert!(between(&fins).is_none(), "fins");
        let grid = |i: usize| Vec3([(i % 100) as f64 / 100.0, (i / 100) as f64 / 100.0, 0.0]);
        let grid: Vec<Vec3> = (0..10_000).map(grid).map(|p| p - Vec3([0.0, 0.0, above(p)])).collect();
        assert!(between(&grid).is_none(), "a grid");
        let voxel = |p: Vec3| Vec3::from_fn(|k| (p[k] / 0.02).round() * 0.02);
        let mut voxels: Vec<Vec3> = (0..30_000).map(|_| voxel(sheet(&mut rng))).collect();
        voxels.sort_by(|a, b| a.0.partial_cmp(&b.0).unwrap());
        voxels.dedup();
        assert!(between(&voxels).is_none(), "voxels");
    }
}
