//! A scan looked at for the first time: what is in it, and the frame in which everything else works.
//!
//! In: positions in the user's unit. Out: the distinct finite points that are neither copies nor stray, moved
//! to the origin and scaled to size 1, with search tree, spacing and noise; and how many points were left
//! out, for which reason.

pub use super::checks::MIN_POINTS;
use super::constants::PIPELINE;
use super::copies::{self, Places};
pub use super::distinct::{Distinct, distinct};
pub use super::whole::Frame;
use super::whole::Survey;
use super::{checks, lonely, rows, warnings};
use crate::error::{Error, Result};
use crate::noise::quantised::{self, Rounded};
use crate::noise::{Camera, NoiseModel, NoiseSource, check, estimate, places};
use crate::numeric::stats::median;
use crate::numeric::vec3::Vec3;
use crate::run::{Context, Stage};
use crate::spatial::constants::SPATIAL;
use crate::spatial::neighbours::Neighbours;
use crate::spatial::order::along_curve;
use crate::spatial::sets::Sets;
use crate::spatial::spacing::{NAMED, Sampling};
use rayon::prelude::*;

/// A scan ready to work on. Lengths are in the normalised frame: the scan's longest side is 1.
pub struct Scan {
    /// The points.
    pub points: Vec<Vec3>,
    /// Search tree over the points.
    pub tree: Neighbours,
    /// How densely they lie.
    pub sampling: Sampling,
    /// How noisy they are.
    pub noise: NoiseModel,
    /// The noise at each point, as a multiple of the usual; empty where it is the same everywhere.
    pub relative_noise: Vec<f32>,
    /// The frame in the user's.
    pub frame: Frame,
    /// Where the given positions went.
    pub input: InputMap,
    /// Which of the whole scan's places each point is, strays counted, copies not; of a tile, which of the
    /// whole scan's positions: as long as no position repeats another, that is the same.
    pub rows: Vec<u64>,
    /// Points of the whole scan, of which these may be a tile or a sample.
    pub whole: usize,
    /// What a tile was told of the whole; nothing where this is the whole.
    pub told: Option<Survey>,
    /// Depth cameras that saw the points, as far as their rounding tells.
    pub(crate) cameras: Vec<Camera>,
}

/// Where the given positions went.
#[derive(Debug, Clone, PartialEq)]
pub struct InputMap {
    /// For each given position its point; `u32::MAX` where it is not finite or stray.
    pub of_input: Vec<u32>,
    /// Positions with a coordinate that is not finite.
    pub not_finite: usize,
    /// Positions that repeat an earlier one, or are copies of it: far nearer than the next.
    pub duplicates: usize,
    /// Distinct points that stand alone.
    pub stray: usize,
    /// Given positions that were averaged with others of their row.
    pub averaged: Vec<u32>,
    /// How many positions were averaged for each point; empty where none were.
    pub count: Vec<u32>,
    /// The median of that; 1 where none were.
    pub per_point: f64,
    /// How far points were moved along the surface's normal to between the steps that their depth was rounded
    /// to, root mean square in the normalised frame; 0 where none were.
    pub between_steps: f64,
    /// Standard deviation of what rounding to the file's digits does to the positions, in the user's unit.
    pub rounding: f64,
    /// What the user should know.
    pub warnings: Vec<String>,
}

impl InputMap {
    /// The noise of points from that of the given positions: means have less of it.
    pub fn noise_of_points(&self, of_input: f64) -> f64 {
        of_input / self.per_point.sqrt()
    }

    /// The noise of the given positions from that of points, in the normalised frame.
    pub fn noise_of_input(&self, of_points: f64) -> f64 {
        (of_points * self.per_point.sqrt()).hypot(self.between_steps)
    }
}

/// A scan whose noise is not known yet. Lengths are in the normalised frame.
pub(super) struct Sampled {
    /// The points.
    pub points: Vec<Vec3>,
    /// How densely they lie.
    pub sampling: Sampling,
    tree: Neighbours,
    frame: Frame,
    /// Whether these are all of the scan's.
    whole: bool,
    /// A point farther than this from its neighbours is stray, unless it lies on a plane with them.
    pub lonely: f64,
    /// See [`Scan::rows`].
    rows: Vec<u64>,
    input: InputMap,
}

/// Prepares a scan. `given_noise`, in the user's unit, replaces the estimate.
///
/// # Errors
/// [`Error::EmptyInput`] without a finite point; [`Error::Degenerate`] where the points are no surface: too
/// few, all in one place or on a line, beyond what numbers can hold; [`Error::InvalidArgument`] for noise as
/// large as the scan; cancelled or out of time.
pub fn prepare(distinct: Distinct, given_noise: Option<f64>, ctx: &Context<'_>) -> Result<Scan> {
    with_noise(sampled(distinct, given_noise, None, ctx)?, given_noise, None, ctx)
}

/// The first half of [`prepare`]: all but the noise, which takes most of the time. A tile is `told` of the
/// whole scan, which then decides instead of its own points.
pub(super) fn sampled(
    distinct: Distinct,
    given_noise: Option<f64>,
    told: Option<&Survey>,
    ctx: &Context<'_>,
) -> Result<Sampled> {
    sampled_in(distinct, given_noise, told.map(Survey::frame), told, ctx)
}

/// The same in a frame that is given.
pub(super) fn sampled_in(
    distinct: Distinct,
    given_noise: Option<f64>,
    given_frame: Option<Frame>,
    told: Option<&Survey>,
    ctx: &Context<'_>,
) -> Result<Sampled> {
    let Distinct { mut points, mut of_input, not_finite, duplicates } = distinct;
    checks::any(&points, of_input.len(), not_finite)?;
    // Rows are averaged from their ends on, which a part of a scan may not have.
    let whole = given_frame.is_none();
    let frame = match given_frame {
        Some(frame) => frame,
        None => frame(&points, of_input.len() - not_finite, ctx)?,
    };
    let rounding = warnings::rounding(&points);
    checks::given_noise(given_noise, frame.scale)?;
    points.par_iter_mut().for_each(|p| *p = frame.of_user(*p));
    ctx.stage(Stage::Analyse, 2 * points.len());
    ctx.check()?;
    let far: Vec<bool> = points.iter().map(|p| !p.iter().all(|x| x.abs() < PIPELINE.far)).collect();
    if far.contains(&true) {
        keep(&mut points, &mut of_input, &far);
    }
    checks::surface(&points)?;
    let distinct = points.len();
    let order = along_curve(&points, ctx)?;
    reorder(&mut points, &mut of_input, &order);
    let mut places = copies::join(points, told.is_none(), ctx)?;
    let copies = distinct - places.points.len();
    let mut count = if whole { rows::average(&mut places, ctx)? } else { vec![1; places.points.len()] };
    places.rename(&mut of_input);
    let mut rows = rows(&order, &places);
    drop(order);
    let Places { mut points, mut tree, spacing, nearest, .. } = places;
    if copies > 0 {
        checks::surface(&points)?;
    }
    // A stray beside a surface is no reason for a patch wider than the surface asks for: what a point's
    // neighbours have is its spacing.
    let mut around = spacing_around(&nearest, &spacing, ctx)?;
    // Stray points are taken out once; the rest is then a scan of its own.
    let lonely = told.map_or_else(|| lonely::farthest(&spacing), |told| told.lonely);
    let near = lonely::Near { points: &points, nearest: &nearest, spacing: &spacing, around: &around };
    let strays = lonely::stray(near, lonely, ctx)?;
    drop((spacing, nearest));
    let is_far = far.iter().filter(|far| **far).count();
    let alone = strays.iter().zip(&count).filter(|s| *s.0).map(|s| *s.1 as usize).sum::<usize>();
    if strays.contains(&true) {
        drop(tree);
        keep(&mut points, &mut of_input, &strays);
        retain(&mut around, &strays);
        retain(&mut rows, &strays);
        retain(&mut count, &strays);
        checks::surface(&points)?;
        tree = Neighbours::build(&points, ctx)?;
    }
    let mut sampling = Sampling::new(around);
    sampling.median = told.map_or(sampling.median, |told| told.spacing);
    checks::spacing(sampling.median)?;
    let averaged = |p: &u32| count.get(*p as usize).is_some_and(|&count| count > 1);
    let input = InputMap {
        averaged: (0..).zip(&of_input).filter(|(_, p)| averaged(p)).map(|(i, _)| i).collect(),
        between_steps: 0.0,
        per_point: median(&mut count.iter().map(|&c| f64::from(c)).collect::<Vec<_>>()),
        count: if count.iter().any(|&c| c > 1) { count } else { Vec::new() },
        of_input,
        not_finite,
        duplicates: duplicates + copies,
        stray: is_far + alone,
        rounding,
        warnings: Vec::new(),
    };
    Ok(Sampled { points, tree, sampling, frame, whole, lonely, rows, input })
}

/// The second half of [`prepare`]: the noise.
pub(super) fn with_noise(
    scan: Sampled,
    given_noise: Option<f64>,
    told: Option<(Survey, &[u64])>,
    ctx: &Context<'_>,
) -> Result<Scan> {
    let Sampled { mut points, mut tree, mut sampling, frame, rows, mut input, whole, .. } = scan;
    if let Some((told, names)) = told {
        sampling.widest = SPATIAL.widest * sampling.median;
        let rows = first_rows(&input.of_input, points.len()).into_iter().map(|i| names[i]).collect();
        let noise = NoiseModel::new(told.tube_noise, NoiseSource::Given, sampling.median);
        let relative_noise = Vec::new();
        let (whole, told) = (told.points, Some(told));
        let cameras = Vec::new();
        let scan =
            Scan { points, tree, sampling, noise, relative_noise, frame, input, rows, whole, told, cameras };
        return Ok(scan);
    }
    let (mut stepped, mut cameras) = (None, Vec::new());
    if given_noise.is_none() {
        match quantised::look(&points, &tree, &sampling.spacing, whole, ctx)? {
            Rounded::No => {}
            Rounded::Noisy(noise) => stepped = Some(noise),
            Rounded::Between(between) => {
                (points, input.between_steps) = (between.points, between.moved);
                cameras = between.cameras;
                tree = Neighbours::build(&points, ctx)?;
            }
        }
    }
    let looked = estimate::look(&points, &tree, ctx)?;
    let local = estimate::noise(&points, &tree, &looked, ctx)?;
    input.warnings.extend(warnings::volume(&local));
    let mut relative_noise = Vec::new();
    let noise = match given_noise {
        None => match stepped {
            None => {
                relative_noise = places::relative(&looked, &points, &local, sampling.median, ctx)?;
                check::by_patches(&points, &tree, &sampling, local.sigma, &relative_noise, ctx)?
            }
            Some(stepped) => {
                let usual = median(&mut stepped.iter().map(|&s| f64::from(s)).collect::<Vec<_>>());
                relative_noise = stepped.iter().map(|&s| s / usual as f32).collect();
                NoiseModel::new(usual, NoiseSource::Rounding, sampling.median)
            }
        },
        Some(given) => {
            let given = input.noise_of_points(given / frame.scale);
            let unit = frame.scale * input.noise_of_input(1.0);
            input.warnings.extend(warnings::too_little_noise(given, local.sigma, &sampling, unit));
            NoiseModel::new(given, NoiseSource::Given, sampling.median)
        }
    };
    let whole = points.len();
    let told = None;
    Ok(Scan { points, tree, sampling, noise, relative_noise, frame, input, rows, whole, told, cameras })
}

/// For each of so many points the first given position that it is.
fn first_rows(of_input: &[u32], points: usize) -> Vec<usize> {
    let mut rows = vec![0; points];
    for (row, &p) in of_input.iter().enumerate().rev() {
        if let Some(first) = rows.get_mut(p as usize) {
            *first = row;
        }
    }
    rows
}

/// Origin and size of the frame.
pub(super) fn frame(points: &[Vec3], count: usize, ctx: &Context<'_>) -> Result<Frame> {
    let beyond = (points.len() as f64 * PIPELINE.beyond) as usize;
    let range = |axis: usize| -> Result<(f64, f64)> {
        ctx.check()?;
        let mut v: Vec<f64> = points.iter().map(|p| p[axis]).collect();
        let low = *v.select_nth_unstable_by(beyond, f64::total_cmp).1;
        let high = *v.select_nth_unstable_by(points.len() - 1 - beyond, f64::total_cmp).1;
        Ok((low, high))
    };
    let range = [range(0)?, range(1)?, range(2)?];
    let origin = Vec3(range.map(|(a, b)| a * 0.5 + b * 0.5));
    let scale = range.iter().map(|(a, b)| b - a).fold(0.0, f64::max);
    if scale == 0.0 {
        return Err(Error::degenerate(
            format!("all {count} points lie in one place"),
            "Give points that lie on a surface",
        ));
    }
    let largest = origin.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    if !(PIPELINE.size.0..PIPELINE.size.1).contains(&scale) || largest > PIPELINE.size.1 {
        return Err(Error::degenerate(
            format!(
                "the points are {scale:e} apart, {largest:e} from the origin: beyond what can be computed \
                 with"
            ),
            "Give them in another unit",
        ));
    }
    Ok(Frame { origin, scale })
}

/// Puts the points into an order, given by their numbers.
fn reorder(points: &mut Vec<Vec3>, of_input: &mut [u32], order: &[u32]) {
    let mut place = vec![0; points.len()];
    order.iter().enumerate().for_each(|(k, &i)| place[i as usize] = k as u32);
    *points = order.iter().map(|&i| points[i as usize]).collect();
    copies::rename(of_input, &place);
}

/// For each place which of all places it is in the order of their first points, before those were put into
/// `order`.
fn rows(order: &[u32], places: &Places) -> Vec<u64> {
    let mut of_point = vec![u32::MAX; order.len()];
    order.iter().zip(&places.of_given).for_each(|(&i, &place)| of_point[i as usize] = place);
    let mut rows = vec![u64::MAX; places.points.len()];
    let mut next = 0;
    for place in of_point {
        let row = &mut rows[place as usize];
        if *row == u64::MAX {
            *row = next;
            next += 1;
        }
    }
    rows
}

/// Leaves out the points marked in `out`.
fn keep(points: &mut Vec<Vec3>, of_input: &mut [u32], out: &[bool]) {
    let mut place = vec![u32::MAX; points.len()];
    let mut n = 0;
    for i in 0..points.len() {
        if !out[i] {
            points[n] = points[i];
            place[i] = n as u32;
            n += 1;
        }
    }
    points.truncate(n);
    copies::rename(of_input, &place);
}

/// Leaves out the values of points marked in `out`.
fn retain<T>(of_points: &mut Vec<T>, out: &[bool]) {
    let mut out = out.iter();
    of_points.retain(|_| !out.next().unwrap_or(&false));
}

/// For each point the median spacing of its nearest others.
fn spacing_around(nearest: &[[u32; NAMED]], spacing: &[f32], ctx: &Context<'_>) -> Result<Vec<f32>> {
    let around = |near: &[u32; NAMED]| {
        let mut others = [0.0; NAMED];
        let mut count = 0;
        for s in near.iter().filter_map(|&i| spacing.get(i as usize)) {
            others[count] = f64::from(*s);
            count += 1;
        }
        median(&mut others[..count]) as f32
    };
    let chunks = nearest.par_chunks(1024).map(|chunk| {
        ctx.check()?;
        Ok(chunk.iter().map(around).collect::<Vec<_>>())
    });
    chunks.collect::<Result<Vec<_>>>().map(|v| v.concat())
}

/// How many parts hang together, and how many points are in none.
///
/// # Errors
/// Cancelled or out of time.
pub fn parts(scan: &Scan, ctx: &Context<'_>) -> Result<(usize, usize)> {
    let n = scan.points.len();
    let link2 = (PIPELINE.link * scan.sampling.median).powi(2);
    let mut sets = Sets::new(n);
    let mut found = Vec::new();
    for (i, p) in scan.points.iter().enumerate() {
        if i % 256 == 0 {
            ctx.check()?;
        }
        scan.tree.nearest(*p, PIPELINE.links + 1, &mut found);
        for f in found.iter().take_while(|f| f.dist2 <= link2) {
            sets.join(i as u32, f.index);
        }
    }
    let mut size = vec![0usize; n];
    (0..n as u32).for_each(|i| size[sets.find(i) as usize] += 1);
    let none = size.iter().filter(|&&s| s < PIPELINE.part).sum();
    Ok((size.iter().filter(|&&s| s >= PIPELINE.part).count(), none))
}
