//! A tile of a scan, computed as it would be within the whole.
//!
//! In: a tile's points with those about it, and what is known of the whole ([`Survey`]). Out: where its
//! points go, and the surface with all triangles, in the frame of the whole: where two tiles have the same
//! points, they give the same bytes. Which way parts face, and which are wanted, is for the whole to say.

use super::options::{self, DenoiseOptions};
use super::surface::{self, Built};
use super::survey::Survey;
use super::{facing, finish, fit_atlas, memory, prepare, sheets, strength};
use crate::contour::holes;
use crate::contour::surface::Surface;
use crate::error::{Error, Result};
use crate::geometry::PointCloud;
use crate::numeric::vec3::{self, Vec3};
use crate::run::{Context, Run};
use crate::simplify::{Dense, Goal, Role, Seams, simplify};
use crate::spatial::sets::Sets;

/// Stands for no part.
pub const NO_PART: u32 = u32::MAX;

/// A point of a tile, denoised.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TilePoint {
    /// Where it is now, in the user's frame.
    pub position: [f64; 3],
    /// Unit normal; zero of an outlier.
    pub normal: [f32; 3],
    /// The part of the tile's surface that it faces with; [`NO_PART`] where there is none.
    pub part: u32,
    /// Whether no chart claims it.
    pub outlier: bool,
}

/// A tile's surface. Lengths are in the normalised frame of the whole.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TileSurface {
    /// Vertex positions.
    pub positions: Vec<[f64; 3]>,
    /// Unit normals.
    pub normals: Vec<[f32; 3]>,
    /// The connected part of each vertex.
    pub part: Vec<u32>,
    /// How far the surface may move about each vertex to have fewer triangles.
    pub error: Vec<f32>,
    /// How long edges about each vertex may get.
    pub longest: Vec<f32>,
    /// Whether the middles of edges move no farther either.
    pub between: bool,
    /// Triangles.
    pub triangles: Vec<[u32; 3]>,
}

/// A tile, denoised.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct DenoisedTile {
    /// One for each given point.
    pub points: Vec<TilePoint>,
    /// The surface.
    pub surface: TileSurface,
    /// Why there is none, where the points make none.
    pub nothing: Option<String>,
}

/// Denoises a tile. `rows` says which of the whole scan's points each is: they ascend.
/// Of the options, those of the surface's parts and UVs are left to the whole. Points that
/// make no surface stay where they are, as outliers.
///
/// # Errors
/// As [`super::denoise`], but not for points that are no surface.
pub fn denoise_tile(
    cloud: &PointCloud,
    rows: &[u64],
    survey: &Survey,
    options: &DenoiseOptions,
    run: &mut Run<'_>,
) -> Result<DenoisedTile> {
    options::validate(options)?;
    options::check_columns(cloud)?;
    if rows.len() != cloud.len() {
        let what = format!("{} rows for {} points", rows.len(), cloud.len());
        return Err(Error::invalid(what, "Give one for each"));
    }
    let options = options.clone().with_uv(false).with_min_part(0.0).with_largest(false);
    match run.execute(|ctx| denoised(cloud, rows, survey, &options, ctx)) {
        Err(none @ (Error::Degenerate { .. } | Error::EmptyInput { .. })) => {
            let outlier =
                |&position: &[f64; 3]| TilePoint { position, normal: [0.0; 3], part: NO_PART, outlier: true };
            let points = cloud.positions.iter().map(outlier).collect();
            Ok(DenoisedTile { points, surface: TileSurface::default(), nothing: Some(none.to_string()) })
        }
        done => done,
    }
}

fn denoised(
    cloud: &PointCloud,
    rows: &[u64],
    survey: &Survey,
    options: &DenoiseOptions,
    ctx: &Context<'_>,
) -> Result<DenoisedTile> {
    ctx.plan(&super::plan(false, options));
    let columns = cloud.bytes() - 24 * cloud.len() as u64;
    memory::reserve(cloud.len(), columns, options, ctx)?;
    let distinct = prepare::distinct(vec3::of(&cloud.positions), ctx)?;
    let sampled = prepare::sampled(distinct, options.noise, Some(survey), ctx)?;
    memory::reserve_sampled(&sampled, Some(survey), columns, options, ctx)?;
    let mut scan = prepare::with_noise(sampled, options.noise, Some((*survey, rows)), ctx)?;
    let known = facing::given(cloud, options, &scan, ctx)?;
    let first = fit_atlas::fit_atlas(&mut scan, options.charts, ctx)?;
    let mut atlas = sheets::separate(&scan, first, known.as_ref(), ctx)?;
    strength::apply(&scan, &mut atlas, options, false, ctx)?;
    let built = surface::build(scan, atlas, options, ctx)?;
    let (surface, part_of_chart) = surface_of(&built, ctx)?;
    let to_user =
        |from: [f64; 3], p: Vec3| finish::share_of_way(from, built.frame.to_user(p).0, options.strength);
    let moved = finish::move_points(cloud, &built.input, &built.projected, to_user, ctx)?;
    let normals = moved.points.normals.unwrap_or_default();
    let points = (moved.points.positions.into_iter().zip(normals).zip(moved.outlier).zip(&moved.chart))
        .map(|(((position, normal), outlier), &chart)| TilePoint {
            position,
            normal: if outlier { [0.0; 3] } else { normal },
            part: part_of_chart.get(chart as usize).copied().unwrap_or(NO_PART),
            outlier,
        })
        .collect();
    Ok(DenoisedTile { points, surface, nothing: None })
}

/// The surface, and for each chart the part that has most of its vertices.
fn surface_of(built: &Built, ctx: &Context<'_>) -> Result<(TileSurface, Vec<u32>)> {
    let Surface { positions, normals, chart, triangles } = &built.surface;
    let mut sets = Sets::of_triangles(positions.len(), triangles, ctx)?;
    let mut number = vec![NO_PART; positions.len()];
    let mut parts = 0;
    let mut part = Vec::with_capacity(positions.len());
    for v in 0..positions.len() {
        ctx.check_at(v)?;
        let root = sets.find(v as u32) as usize;
        if number[root] == NO_PART {
            number[root] = parts;
            parts += 1;
        }
        part.push(number[root]);
    }
    let mut of_chart: Vec<(u32, u32)> = chart.iter().copied().zip(part.iter().copied()).collect();
    ctx.check()?;
    of_chart.sort_unstable();
    let mut most = vec![(0, NO_PART); built.charts.len()];
    for same in of_chart.chunk_by(|a, b| a == b) {
        if let Some(best) = most.get_mut(same[0].0 as usize)
            && same.len() > best.0
        {
            *best = (same.len(), same[0].1);
        }
    }
    let goal = built.goal.clone().unwrap_or_default();
    let surface = TileSurface {
        positions: vec3::plain(positions.clone()),
        normals: normals.iter().map(|n| n.to_f32()).collect(),
        part,
        error: goal.error,
        longest: goal.longest,
        between: goal.between,
        triangles: triangles.clone(),
    };
    Ok((surface, most.into_iter().map(|m| m.1).collect()))
}

/// Gives a tile's surface larger triangles where it is flat, `share` times as far as it may at most. Vertices
/// that are `pinned` stay, and all triangles between them.
///
/// # Errors
/// Cancelled or out of time.
pub fn simplify_tile(
    surface: &TileSurface,
    pinned: &[bool],
    share: f32,
    ctx: &Context<'_>,
) -> Result<TileSurface> {
    let n = surface.positions.len();
    if surface.triangles.is_empty() {
        return Ok(surface.clone());
    }
    let positions = vec3::of(&surface.positions);
    let normals: Vec<Vec3> = surface.normals.iter().map(|n| Vec3(n.map(f64::from))).collect();
    let role = pinned.iter().map(|&p| if p { Role::Pinned } else { Role::Free }).collect();
    let seams = Seams { uv: Vec::new(), place: (0..n as u32).collect(), role };
    let dense = Dense { positions, normals: &normals, triangles: &surface.triangles, seams: Some(&seams) };
    let times = |of: &[f32]| of.iter().map(|x| x * share).collect();
    let (error, longest) = (times(&surface.error), times(&surface.longest));
    let goal = Goal { faces: 0, error, longest, between: surface.between };
    let light = simplify(&dense, &goal, ctx)?;
    let of = |column: &[f32]| light.from.iter().map(|&v| column[v as usize]).collect();
    Ok(TileSurface {
        part: light.from.iter().map(|&v| surface.part[v as usize]).collect(),
        error: of(&surface.error),
        longest: of(&surface.longest),
        between: surface.between,
        positions: vec3::plain(light.positions),
        normals: light.normals.iter().map(|n| n.to_f32()).collect(),
        triangles: light.triangles,
    })
}

/// Triangles that close a ring of places, by their numbers in it, with the least area; none where it is too
/// long, or cannot be closed without the edges `taken` between two of them. They run along the ring as it is
/// given.
///
/// # Errors
/// Cancelled or out of time.
pub fn close_ring(ring: &[[f64; 3]], taken: &[[u32; 2]], ctx: &Context<'_>) -> Result<Option<Vec<[u32; 3]>>> {
    holes::ring(vec3::of(ring), taken, ctx)
}
