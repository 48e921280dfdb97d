//! Sweeps of a scan that do not quite fit each other, moved together: a small rigid motion for each.
//!
//! In: points, and for each the number of its sweep. Out: a [`Motion`] for each sweep, and how far sweeps
//! were apart before and are after.
//!
//! All sweeps move at once. A point of one and the quadric through the nearest points of all others are a
//! pair; the motions minimise the distances of all pairs along the quadrics' normals (point-to-plane, Chen
//! and Medioni 1992) with residuals of Student's t, and are matched anew. Motions are as likely beforehand
//! as normal ones of the size of the reach: what no pair tells, such as a slide along a plane, stays as it
//! was. Where the pairs do not ask for motions, all sweeps stay.

mod constants;
mod scan;
mod solve;

use crate::error::{Error, Result};
use crate::geometry::Motion;
use crate::numeric::sort::sort;
use crate::numeric::stats::median;
use crate::numeric::vec3::Vec3;
use crate::run::{Context, Stage};
use constants::REGISTER;
use scan::Scan;
use solve::{Equations, Pair};

/// How a sweep was moved.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct SweepMotion {
    /// The sweep, by its number as given.
    pub sweep: u32,
    /// Its points that are finite.
    pub points: usize,
    /// Where its points go, in the frame and unit of the points.
    pub motion: Motion,
    /// How far it moves them: root mean square, in the points' unit.
    pub moved: f64,
    /// Its points that were seen on other sweeps, of those that were looked at. 0: it is where it was.
    pub pairs: usize,
}

/// Sweeps that were moved together.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Registration {
    /// One entry for each sweep, by their numbers.
    pub sweeps: Vec<SweepMotion>,
    /// Standard deviation of the distances of sweeps from each other along the normal (1.48 times the median
    /// of their sizes), in the points' unit, as they were: noise and misfit together.
    pub apart_before: f64,
    /// The same after they were moved.
    pub apart_after: f64,
}

/// Motions that make the sweeps of a scan fit each other.
///
/// `sweep_of[i]` is the number of the sweep that point `i` is of. `toward[i]` is the side that it faces, zero
/// where that is not known; empty where none is known: then the two sides of a wall thinner than a fiftieth
/// of the scan can be taken for one surface where no sweep saw both.
///
/// ```
/// use atlasfit::{Run, Vec3, register::register};
/// // A bowl, seen twice; the second time a hundredth too high.
/// let at = |i: u32| [f64::from(i % 40) / 40.0 - 0.5, f64::from(i / 40) / 40.0 - 0.5];
/// let points: Vec<Vec3> = (0..3200)
///     .map(|i| (at(i % 1600), if i < 1600 { 0.0 } else { 0.01 }))
///     .map(|([x, y], off)| Vec3([x, y, x * x + y * y + off]))
///     .collect();
/// let sweeps: Vec<u32> = (0..3200).map(|i| i / 1600).collect();
/// let found = Run::default().execute(|ctx| register(&points, &sweeps, &[], ctx))?;
/// assert!(found.apart_before > 0.009 && found.apart_after < 0.001);
/// # Ok::<(), atlasfit::Error>(())
/// ```
///
/// # Errors
/// [`Error::InvalidArgument`] where all points are of one sweep, for more than 100 sweeps, or columns of
/// other lengths; [`Error::Degenerate`] where no sweeps overlap; cancelled or out of time.
pub fn register(
    points: &[Vec3],
    sweep_of: &[u32],
    toward: &[Vec3],
    ctx: &Context<'_>,
) -> Result<Registration> {
    check_columns(points.len(), sweep_of.len(), toward.len())?;
    let numbers = numbers(points, sweep_of, ctx)?;
    let frame = Frame::of(points, ctx)?;
    let (scan, of) = chosen(points, sweep_of, toward, &numbers, &frame, ctx)?;
    let mut motions = vec![Motion::NONE; of.len()];
    let mut pairs = first(&scan, &motions, numbers.len(), ctx)?;
    let mut before = 0.0;
    ctx.stage(Stage::Prepare, REGISTER.passes * REGISTER.rounds);
    for _ in 0..REGISTER.passes {
        // Sweeps that fit better are flat in smaller neighbourhoods.
        let k = scan::surround(&scan, &motions, ctx)?;
        before = apart(&scan::matched(&scan, &vec![Motion::NONE; of.len()], k, ctx)?);
        for _ in 0..REGISTER.rounds {
            pairs = scan::matched(&scan, &motions, k, ctx)?;
            let size = apart(&pairs).max(f64::MIN_POSITIVE);
            let step = Equations::of(&pairs, motions.len(), size).solve(&motions);
            motions.iter_mut().zip(&step).for_each(|(motion, step)| *motion = motion.then(step));
            ctx.advance(1);
            let farthest = step.iter().map(|m| m.angle().max(m.shift.norm())).fold(0.0, f64::max);
            if farthest < REGISTER.done * size {
                break;
            }
        }
    }
    let mut after = apart(&pairs);
    if !asked_for(before, after, pairs.len(), motions.len()) {
        motions.fill(Motion::NONE);
        after = before;
    }
    let mut sums = vec![(0, 0.0, 0); of.len()];
    pairs.iter().for_each(|p| sums[p.sweep as usize].0 += 1);
    for (p, &s) in scan.points.iter().zip(&scan.sweep_of) {
        let (_, squares, count) = &mut sums[s as usize];
        *squares += motions[s as usize].of(*p).dist2(*p);
        *count += 1;
    }
    let mut told: Vec<SweepMotion> = (numbers.iter())
        .map(|&(sweep, points)| SweepMotion { sweep, points, motion: Motion::NONE, moved: 0.0, pairs: 0 })
        .collect();
    for ((place, motion), (pairs, squares, count)) in of.into_iter().zip(&motions).zip(sums) {
        let moved = frame.scale * (squares / f64::from(count.max(1))).sqrt();
        told[place] = SweepMotion { motion: frame.to_user(motion), moved, pairs, ..told[place].clone() };
    }
    let [apart_before, apart_after] = [before, after].map(|s| s * frame.scale);
    Ok(Registration { sweeps: told, apart_before, apart_after })
}

/// Every column has an entry per point, or, where it may, none.
fn check_columns(points: usize, sweep_of: usize, toward: usize) -> Result<()> {
    for (name, have) in [("sweep_of", sweep_of), ("toward", toward)] {
        if have != points && (name == "sweep_of" || have > 0) {
            return Err(Error::invalid(
                format!("{name}: {have} values for {points} points"),
                format!("Give {points} values"),
            ));
        }
    }
    Ok(())
}

/// The numbers of the sweeps, ascending, with their finite points.
///
/// # Errors
/// [`Error::InvalidArgument`] where they are too few or too many to be registered; cancelled or out of time.
pub(crate) fn numbers(points: &[Vec3], sweep_of: &[u32], ctx: &Context<'_>) -> Result<Vec<(u32, usize)>> {
    let mut all: Vec<u32> = points.iter().zip(sweep_of).filter(|(p, _)| finite(p)).map(|(_, &s)| s).collect();
    sort(&mut all, ctx)?;
    let numbers: Vec<(u32, usize)> = all.chunk_by(|a, b| a == b).map(|c| (c[0], c.len())).collect();
    match numbers.len() {
        0 | 1 => Err(Error::invalid(
            format!("all points are of {} sweep", numbers.len()),
            "Give the column that tells sweeps apart, or none",
        )),
        n if n > REGISTER.most_sweeps => Err(Error::invalid(
            format!("{n} sweeps"),
            format!(
                "Give at most {}: a column that numbers sweeps, not lines or points",
                REGISTER.most_sweeps
            ),
        )),
        _ => Ok(numbers),
    }
}

fn finite(p: &Vec3) -> bool {
    p.iter().all(|x| x.is_finite())
}

/// The frame in which lengths are shares of the scan's longest side, from its middle.
struct Frame {
    origin: Vec3,
    scale: f64,
}

impl Frame {
    /// The frame of the finite points, of which there is one at least; a few that lie far off do not count.
    fn of(points: &[Vec3], ctx: &Context<'_>) -> Result<Self> {
        let range = |axis: usize| -> Result<(f64, f64)> {
            ctx.check()?;
            let mut all: Vec<f64> = points.iter().filter(|p| finite(p)).map(|p| p[axis]).collect();
            let beyond = (all.len() as f64 * REGISTER.beyond) as usize;
            let last = all.len() - 1 - beyond;
            let low = *all.select_nth_unstable_by(beyond, f64::total_cmp).1;
            Ok((low, *all.select_nth_unstable_by(last, f64::total_cmp).1))
        };
        let ranges = [range(0)?, range(1)?, range(2)?];
        let scale = ranges.iter().map(|(low, high)| high - low).fold(0.0, f64::max);
        let origin = Vec3(ranges.map(|(low, high)| low * 0.5 + high * 0.5));
        Ok(Self { origin, scale: if scale > 0.0 { scale } else { 1.0 } })
    }

    fn inside(&self, p: Vec3) -> Vec3 {
        (p - self.origin) * (1.0 / self.scale)
    }

    /// A motion of this frame in the user's.
    fn to_user(&self, m: &Motion) -> Motion {
        let shift = m.shift * self.scale + self.origin - m.turned(self.origin);
        Motion { rotation: m.rotation, shift }
    }
}

/// The sweeps that have enough points, as one scan of which no more than [`REGISTER`] says are looked at, and
/// the place of each among all.
fn chosen(
    points: &[Vec3],
    sweep_of: &[u32],
    toward: &[Vec3],
    numbers: &[(u32, usize)],
    frame: &Frame,
    ctx: &Context<'_>,
) -> Result<(Scan, Vec<usize>)> {
    let of: Vec<usize> = (0..numbers.len()).filter(|&n| numbers[n].1 >= REGISTER.least_points).collect();
    let step = points.len().div_ceil(REGISTER.most_points).max(1);
    let samples = (REGISTER.samples / of.len().max(1)).max(REGISTER.least_samples);
    let mut scan = Scan { points: Vec::new(), sweep_of: Vec::new(), toward: Vec::new(), samples: Vec::new() };
    let mut seen = vec![0usize; of.len()];
    for (i, p) in points.iter().enumerate() {
        ctx.check_at(i)?;
        let place = numbers.binary_search_by_key(&sweep_of[i], |n| n.0).ok();
        let Some(sweep) = place.and_then(|place| of.binary_search(&place).ok()) else { continue };
        if !finite(p) {
            continue;
        }
        // Every `step`th point of each sweep, and of those enough that are matched, in the order of the scan.
        seen[sweep] += 1;
        if !seen[sweep].is_multiple_of(step) {
            continue;
        }
        let kept = numbers[of[sweep]].1.div_ceil(step);
        if (seen[sweep] / step).is_multiple_of(kept.div_ceil(samples).max(1)) {
            scan.samples.push(scan.points.len() as u32);
        }
        scan.points.push(frame.inside(*p));
        scan.sweep_of.push(sweep as u32);
        scan.toward.extend(toward.get(i));
    }
    Ok((scan, of))
}

/// Pairs of the sweeps as they are.
fn first(scan: &Scan, still: &[Motion], sweeps: usize, ctx: &Context<'_>) -> Result<Vec<Pair>> {
    let pairs = match scan.points.len() {
        0 => Vec::new(),
        _ => scan::matched(scan, still, scan::surround(scan, still, ctx)?, ctx)?,
    };
    if pairs.is_empty() {
        return Err(Error::degenerate(
            format!("none of the {sweeps} sweeps lies on another"),
            "Give sweeps that overlap and fit to within a fiftieth of the scan, or leave sweeps out",
        ));
    }
    Ok(pairs)
}

/// Whether so many pairs ask for motions that bring their distances from one size to another: likelihood,
/// less what six numbers a sweep cost (Schwarz 1978).
fn asked_for(before: f64, after: f64, pairs: usize, sweeps: usize) -> bool {
    let pairs = pairs as f64;
    let numbers = 6.0 * (sweeps as f64 - 1.0);
    pairs * (before / after).ln() > 0.5 * numbers * pairs.ln()
}

/// Standard deviation of the pairs' distances, by their median.
fn apart(pairs: &[Pair]) -> f64 {
    1.4826 * median(&mut pairs.iter().map(|p| p.residual.abs()).collect::<Vec<_>>())
}

#[cfg(test)]
mod tests;
