//! The end of the main job: UVs, the way back to the user's frame, the report.
//!
//! In: what was built, the mesh with the scan's attributes. Out: [`Denoised`].

use super::attributes;
use super::constants::PIPELINE;
use super::follow::{Membrane, Role};
use super::options::{DenoiseOptions, Outliers};
use super::prepare::InputMap;
use super::report::{Denoised, Report};
use super::surface::Built;
use super::warnings;
use crate::atlas::ProjectedPoint;
use crate::error::Result;
use crate::geometry::{Attribute, PointCloud, Scanners, TriMesh};
use crate::measure;
use crate::noise::NoiseModel;
use crate::numeric::vec3::{self, Vec3};
use crate::run::Context;
use crate::uncertainty::PointUncertainty;
use crate::unwrap::{self, UnwrapOptions};

/// The noise that the report tells: of the scan as the charts know it; after a guide, which leaves little of
/// it, as it was before.
pub(super) fn reported_noise(scan: NoiseModel, charts: NoiseModel, guided: bool) -> f64 {
    let before = scan.sigma.max(charts.rounding);
    match charts.for_charts() {
        _ if guided => before,
        sigma if sigma > charts.floor => sigma,
        _ => before.min(charts.floor),
    }
}

/// What the user gave.
#[derive(Clone, Copy)]
pub(super) struct Given<'a> {
    pub cloud: &'a PointCloud,
    /// Triangles between the points where these are a mesh's vertices; else none.
    pub triangles: &'a [[u32; 3]],
}

/// What is known of how exact the scan and the result are.
pub(super) struct Told {
    /// The scan's noise.
    pub noise: f64,
    /// How sure the points are, where that was asked for.
    pub sure: Option<PointUncertainty>,
    /// Where positions lie on the charts that were averaged with others.
    pub feet: Vec<(u32, Vec3)>,
}

/// Lays out UVs if they are wanted, and gives everything back in the user's frame.
pub(super) fn finish(
    given: Given<'_>,
    built: Built,
    mut mesh: TriMesh,
    told: Told,
    options: &DenoiseOptions,
    ctx: &Context<'_>,
) -> Result<Denoised> {
    let Given { cloud, triangles } = given;
    let Told { noise, sure, feet } = told;
    let Built { charts, projected, frame, input, .. } = built;
    let noise = input.noise_of_input(noise);
    let uv_charts = if options.lays_out_uv() { lay_out(&mut mesh, options, ctx)? } else { 0 };
    let topology = measure::topology(&mesh, ctx)?;
    for (i, p) in mesh.positions.iter_mut().enumerate() {
        ctx.check_at(i)?;
        *p = frame.to_user(Vec3(*p)).0;
    }
    let to_user = |from: [f64; 3], p: Vec3| share_of_way(from, frame.to_user(p).0, options.strength);
    let mut moved = move_points(cloud, &input, &projected, to_user, ctx)?;
    for &(i, foot) in &feet {
        let position = &mut moved.points.positions[i as usize];
        *position = to_user(cloud.positions[i as usize], foot);
    }
    let followed_outliers = match options.outliers {
        Outliers::Keep if options.strength > 0.0 => moved.follow(cloud, triangles, options.strength, ctx)?,
        _ => 0,
    };
    if let Some(sure) = &sure {
        let columns = attributes::of_points(
            vec3::of(&moved.points.positions),
            &input,
            &projected,
            sure,
            options,
            frame,
            ctx,
        )?;
        attributes::put(&mut moved.points.attributes, columns);
    }
    let outliers = moved.outlier.iter().filter(|o| **o).count();
    let left_out: Vec<bool> = (input.of_input.iter())
        .map(|&p| built.left_out.points.get(p as usize).is_some_and(|on| *on))
        .collect();
    if options.outliers == Outliers::Drop {
        moved.drop(&left_out);
    }
    let mut warnings = input.warnings;
    if options.noise.is_none() {
        warnings.extend(warnings::no_noise(noise * frame.scale, input.rounding));
    }
    warnings.extend(warnings::not_calibrated(sure.as_ref()));
    let report = Report {
        points: cloud.len(),
        not_finite: input.not_finite,
        duplicates: input.duplicates,
        outliers,
        followed_outliers,
        spacing: built.sampling.median * frame.scale,
        noise: noise * frame.scale,
        charts: charts.len(),
        one_sided: built.one_sided,
        voxel: built.voxel * frame.scale,
        parts: topology.parts,
        dropped_parts: built.left_out.parts,
        dropped_points: left_out.iter().filter(|l| **l).count(),
        filled_holes: built.filled_holes,
        boundary_loops: topology.boundary_loops,
        boundary_edges: topology.boundary_edges,
        uv_charts,
        uncertainty_factor: sure.and_then(|s| s.factor),
        registration: None,
        warnings,
        seconds: ctx.stage_seconds(),
    };
    Ok(Denoised {
        points: moved.points,
        point_source: moved.source,
        point_chart: moved.chart,
        surface: mesh,
        charts,
        origin: frame.origin,
        scale: frame.scale,
        report,
    })
}

/// How the UVs of a denoised surface are laid out.
#[must_use]
pub fn uv_options(options: &DenoiseOptions) -> UnwrapOptions {
    UnwrapOptions::default().with_max_stretch(PIPELINE.uv_stretch).with_page_size([options.texture_size; 2])
}

/// Lays out the mesh's UVs; returns how many charts they have.
fn lay_out(mesh: &mut TriMesh, options: &DenoiseOptions, ctx: &Context<'_>) -> Result<usize> {
    let layout = unwrap::unwrap(mesh, &uv_options(options), ctx)?;
    mesh.corner_uv = Some(layout.corner_uv);
    mesh.face_chart = Some(layout.face_chart);
    Ok(layout.charts)
}

/// The user's points, moved: in input order.
pub(super) struct Moved {
    pub points: PointCloud,
    /// The input point that each came from.
    source: Vec<u32>,
    /// The chart that weighs most at each; `u32::MAX` for none.
    pub chart: Vec<u32>,
    /// Whether the input point is finite and on no chart.
    pub outlier: Vec<bool>,
}

/// Where a point goes on its way to the surface: all of it for a strength of 1 and more, none for 0.
pub(super) fn share_of_way(from: [f64; 3], to: [f64; 3], strength: f64) -> [f64; 3] {
    // Not by the formula: these two are exact.
    if strength >= 1.0 {
        to
    } else if strength <= 0.0 {
        from
    } else {
        std::array::from_fn(|k| from[k] + strength * (to[k] - from[k]))
    }
}

/// Moves the points of `cloud` to where the charts say the surface is; `to_user` says where that is, from the
/// point as given and its place in the normalised frame.
/// Outliers and points that are not finite stay where they are, for now.
pub(super) fn move_points(
    cloud: &PointCloud,
    input: &InputMap,
    projected: &[ProjectedPoint],
    to_user: impl Fn([f64; 3], Vec3) -> [f64; 3],
    ctx: &Context<'_>,
) -> Result<Moved> {
    let n = cloud.len();
    let mut points = cloud.clone();
    let mut normals = vec![[0f32; 3]; n];
    let (mut chart, mut outlier) = (vec![u32::MAX; n], vec![false; n]);
    for (i, &p) in input.of_input.iter().enumerate() {
        ctx.check_at(i)?;
        if !cloud.positions[i].iter().all(|x| x.is_finite()) {
            continue;
        }
        match projected.get(p as usize) {
            Some(q) if q.chart != u32::MAX => {
                points.positions[i] = to_user(points.positions[i], q.position);
                normals[i] = q.normal.to_f32();
                chart[i] = q.chart;
            }
            _ => {
                outlier[i] = true;
                if let Some(n) = &cloud.normals {
                    normals[i] = n[i];
                }
            }
        }
    }
    points.normals = Some(normals);
    Ok(Moved { points, source: (0..n as u32).collect(), chart, outlier })
}

impl Moved {
    /// Moves the outliers of a mesh to between their neighbours, as far as the strength says; returns how
    /// many.
    fn follow(
        &mut self,
        cloud: &PointCloud,
        triangles: &[[u32; 3]],
        strength: f64,
        ctx: &Context<'_>,
    ) -> Result<usize> {
        let role: Vec<Role> = (self.outlier.iter().zip(&self.chart))
            .map(|(&outlier, &chart)| match chart {
                _ if outlier => Role::Follows,
                u32::MAX => Role::Neither,
                _ => Role::Holds,
            })
            .collect();
        let membrane = Membrane::new(vec3::of(&cloud.positions), triangles, &role, ctx)?;
        let at = membrane.solve(|v| Vec3(self.points.positions[v as usize]), ctx)?;
        let mut count = 0;
        for (v, p) in self.points.positions.iter_mut().enumerate() {
            ctx.check_at(v)?;
            if let Some(place) = membrane.place(v) {
                *p = share_of_way(*p, at[place].0, strength);
                count += 1;
            }
        }
        if let Some(normals) = &mut self.points.normals {
            let facing = membrane.solve(|v| Vec3(normals[v as usize].map(f64::from)), ctx)?;
            for (v, n) in normals.iter_mut().enumerate() {
                ctx.check_at(v)?;
                if let Some(place) = membrane.place(v) {
                    *n = facing[place].normalized().to_f32();
                }
            }
        }
        Ok(count)
    }

    /// Drops the outliers, and the points that were `left_out` with their part of the surface.
    fn drop(&mut self, left_out: &[bool]) {
        self.source.retain(|&i| !self.outlier[i as usize] && !left_out[i as usize]);
        self.chart = self.source.iter().map(|&i| self.chart[i as usize]).collect();
        self.points = pick(&self.points, &self.source);
    }
}

/// The points of `cloud` at `at`, with all their columns.
fn pick(cloud: &PointCloud, at: &[u32]) -> PointCloud {
    let take = |i: &u32| *i as usize;
    PointCloud {
        positions: at.iter().map(|i| cloud.positions[take(i)]).collect(),
        normals: cloud.normals.as_ref().map(|n| at.iter().map(|i| n[take(i)]).collect()),
        colors: cloud.colors.as_ref().map(|c| at.iter().map(|i| c[take(i)]).collect()),
        scanners: cloud.scanners.as_ref().map(|s| Scanners {
            positions: s.positions.clone(),
            of_point: at.iter().map(|i| s.of_point[take(i)]).collect(),
        }),
        attributes: cloud
            .attributes
            .iter()
            .map(|a| Attribute {
                values: at
                    .iter()
                    .flat_map(|i| a.values[take(i) * a.width..(take(i) + 1) * a.width].iter().copied())
                    .collect(),
                ..a.clone()
            })
            .collect(),
    }
}
