//! Denoising: points in, one handle with everything that came out, getters for its arrays.

use crate::faces::Faces;
use crate::handle;
use crate::log;
use crate::points::{self, atlasfit_points};
use crate::result::{DenoiseResult, atlasfit_result};
use crate::run::{atlasfit_run, core_run, number_out};
use crate::sized::{self, Sized};
use crate::status::{ATLASFIT_NOT_AVAILABLE, Failure, Outcome, atlasfit_status, guard};
use atlasfit::geometry::Polygons;
use atlasfit::pipeline::{DenoiseOptions, Outliers, denoise_vertices, memory_needed};
use atlasfit_net::Prior;
use atlasfit_net::explicit::{Network, NetworkOptions, Recipe};
use atlasfit_net::level_set::LevelSetOptions;
use std::ffi::c_char;
use std::sync::Arc;

/// atlasfit_denoise_options.prior: a Gaussian process as smooth as the limit of the paper's networks.
pub const ATLASFIT_PRIOR_GP: u32 = 0;
/// atlasfit_denoise_options.prior: the paper's fully connected networks, trained on the scan first; many
/// times slower.
pub const ATLASFIT_PRIOR_MLP: u32 = 1;
/// atlasfit_denoise_options.prior: the paper's convolutional networks.
pub const ATLASFIT_PRIOR_CONV: u32 = 2;
/// atlasfit_denoise_options.prior: the paper's level set: closed surfaces only.
pub const ATLASFIT_PRIOR_LEVEL_SET: u32 = 3;
/// atlasfit_denoise_options.recipe: training from coarse to fine, with falling learning rates.
pub const ATLASFIT_RECIPE_FAST: u32 = 0;
/// atlasfit_denoise_options.recipe: training as in the paper, with all samples at every step.
pub const ATLASFIT_RECIPE_PAPER: u32 = 1;
/// atlasfit_denoise_options.outliers: outliers stay among the denoised points, where
/// they were (those of a mesh between their neighbours: see triangles of atlasfit_points). There are as many
/// points as were given, in the same order.
pub const ATLASFIT_OUTLIERS_KEEP: u32 = 0;
/// atlasfit_denoise_options.outliers: outliers are left out of the denoised points, and so are the points of
/// parts of the surface that were left out (min_part, largest).
pub const ATLASFIT_OUTLIERS_DROP: u32 = 1;

/// atlasfit_denoise_options.surface: none; points and atlas only, in about half the time. Points beside an
/// edge of the part stay on its rounded charts, and what is asked of the surface (watertight, faces,
/// max_error, min_part, largest, fill_holes) is refused.
pub const ATLASFIT_SURFACE_NONE: u32 = 0;
/// atlasfit_denoise_options.surface: as the charts have it, open where the data end.
pub const ATLASFIT_SURFACE_SMOOTH: u32 = 1;
/// atlasfit_denoise_options.surface: a watertight shell around that, by CGAL's alpha wrap, as far off as the
/// noise or a tenth of the spacing. It has no colours and attributes. #ATLASFIT_NOT_AVAILABLE where the
/// library was built without CGAL: see atlasfit_features().
pub const ATLASFIT_SURFACE_WRAP: u32 = 2;

/// How to denoise. Fill it with atlasfit_denoise_options_init(); a NULL pointer to one means the defaults,
/// which suit an ordinary scan.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct atlasfit_denoise_options {
    /// sizeof(atlasfit_denoise_options).
    pub struct_size: usize,
    /// Standard deviation of the noise along the normal, in the points' unit; 0 = estimate it, for each chart
    /// anew. Given, it decides how closely charts follow the points. Default 0.
    pub noise: f64,
    /// Fineness of the surface, 0.1 to 10: 1 = what the data supports, 0.5 = voxels twice as large. Default
    /// 1.
    pub detail: f64,
    /// Holes whose boundary is shorter than this are filled, in the points' unit; 0 = only gaps of the
    /// sampling are, and places about which the points thin out, as they do where a surface turns away from
    /// every scanner. Default 0.
    pub fill_holes: f64,
    /// Number of charts to aim for; 0 = as many as the shape needs. Default 0.
    pub charts: u32,
    /// #ATLASFIT_PRIOR_GP to #ATLASFIT_PRIOR_LEVEL_SET. Default #ATLASFIT_PRIOR_GP.
    pub prior: u32,
    /// #ATLASFIT_OUTLIERS_KEEP or #ATLASFIT_OUTLIERS_DROP. Default #ATLASFIT_OUTLIERS_KEEP.
    pub outliers: u32,
    /// Whether to lay out UVs: 0 = no, 1 = yes. Default 1.
    pub uv: u32,
    /// Side of the texture page in texels, 16 to 65536; the padding between UV charts is made for it. Default
    /// 1024.
    pub texture_size: u32,
    /// #ATLASFIT_PRIOR_MLP and #ATLASFIT_PRIOR_CONV: number of charts that are trained, 1 or more. Default 8.
    pub network_charts: u32,
    /// With #ATLASFIT_RECIPE_PAPER: steps of training, at most. Default 1000.
    pub network_iterations: u32,
    /// How #ATLASFIT_PRIOR_MLP and #ATLASFIT_PRIOR_CONV are trained: #ATLASFIT_RECIPE_FAST or
    /// #ATLASFIT_RECIPE_PAPER. Default #ATLASFIT_RECIPE_FAST.
    pub recipe: u32,
    /// #ATLASFIT_PRIOR_MLP and #ATLASFIT_PRIOR_CONV: weight of the stretch term, beside a Chamfer distance of
    /// weight 1; 0 or more. Default 1.
    pub network_stretch_weight: f64,
    /// With #ATLASFIT_RECIPE_PAPER: learning rate of Adam, more than 0. Default 0.001.
    pub network_learning_rate: f64,
    /// With has_viewpoint: where the scanner stood, x, y, z in the points' unit. The surface faces it,
    /// whatever the points' normals say. Where more than a quarter of the points is hidden from there,
    /// connected parts face it as wholes.
    pub viewpoint: [f64; 3],
    /// 1 if viewpoint counts, else 0. Default 0.
    pub has_viewpoint: u32,
    /// 1 makes the surface that of a solid, for printing: closed, two-manifold, without self-intersections.
    /// #ATLASFIT_SURFACE_EXTRAPOLATED tells where vertices were invented. 0 leaves the surface open where the
    /// data end. Default 0.
    pub watertight: u32,
    /// Connected parts of the surface that have less than this share of its area are left out, 0 to 1; 0
    /// keeps all. #ATLASFIT_INVALID_ARGUMENT where no part is that large. Their points stay among the
    /// denoised points, unless outliers are dropped, and their charts in the atlas. Default 0.
    pub min_part: f64,
    /// 1 keeps only the largest part of the surface by area; the others are left out as with min_part.
    /// Default 0.
    pub largest: u32,
    /// Triangles that the surface should have at the most; 0 = about as many as there are points, fewer where
    /// it is flat. Where they cannot be had within max_error, a warning says so. Default 0.
    pub faces: u32,
    /// How far the surface may be from the contoured one to have fewer triangles, in the points' unit; 0 =
    /// all triangles that it is contoured with. Less than 0 = as far as faces asks for; without that a
    /// quarter of the noise or a twentieth of the spacing. A watertight surface keeps all its triangles.
    /// Default -1.
    pub max_error: f64,
    /// How strongly to denoise, 0 or more: 1 = as much as the scan asks for, 2 = smoother. Detail below so
    /// many times the usual length is smoothed away, from a quarter to 4 times, and the surface follows.
    /// Below 1 the points besides go only this share of the way to the surface: 0 leaves them where they are.
    /// Default 1.
    pub strength: f64,
    /// What the surface is: #ATLASFIT_SURFACE_NONE to #ATLASFIT_SURFACE_WRAP. Default
    /// #ATLASFIT_SURFACE_SMOOTH.
    pub surface: u32,
    /// 1 says how sure the result is: #ATLASFIT_POINT_UNCERTAINTY to #ATLASFIT_SURFACE_EXTRAPOLATED, and
    /// uncertainty_factor of the report. All else stays the same, byte for byte. Default 0.
    pub uncertainty: u32,
    /// The name of an attribute of the points, of width 1, that tells apart the sweeps of which the scan was
    /// merged: whole numbers, 0 or more. They are moved together first, each by a small rigid motion; the
    /// result is where the moved ones say, and atlasfit_result_sweep() tells the motions. NULL moves none.
    /// Default NULL.
    pub sweeps: *const c_char,
}

// SAFETY: numbers and a pointer, size first.
unsafe impl Sized for atlasfit_denoise_options {
    const NAME: &str = "atlasfit_denoise_options";
    const FIRST: usize = std::mem::offset_of!(Self, viewpoint);
    fn defaults() -> Self {
        let (d, network) = (DenoiseOptions::default(), NetworkOptions::default());
        Self {
            struct_size: size_of::<Self>(),
            noise: d.noise.unwrap_or(0.0),
            detail: d.detail,
            fill_holes: d.fill_holes,
            charts: d.charts.map_or(0, |n| n as u32),
            prior: ATLASFIT_PRIOR_GP,
            outliers: match d.outliers {
                Outliers::Keep => ATLASFIT_OUTLIERS_KEEP,
                Outliers::Drop => ATLASFIT_OUTLIERS_DROP,
            },
            uv: u32::from(d.uv),
            texture_size: d.texture_size,
            network_charts: network.charts as u32,
            network_iterations: network.iterations as u32,
            recipe: match network.recipe {
                Recipe::Fast => ATLASFIT_RECIPE_FAST,
                Recipe::Paper => ATLASFIT_RECIPE_PAPER,
            },
            network_stretch_weight: network.stretch_weight,
            network_learning_rate: network.learning_rate,
            viewpoint: d.viewpoint.unwrap_or_default(),
            has_viewpoint: u32::from(d.viewpoint.is_some()),
            watertight: u32::from(d.watertight),
            min_part: d.min_part,
            largest: u32::from(d.largest),
            faces: d.faces.map_or(0, |n| n as u32),
            max_error: d.max_error.unwrap_or(-1.0),
            strength: d.strength,
            surface: ATLASFIT_SURFACE_SMOOTH,
            uncertainty: u32::from(d.uncertainty),
            sweeps: std::ptr::null(),
        }
    }
}

impl atlasfit_denoise_options {
    /// What makes the shell, where one is asked for.
    fn cgal(&self) -> Outcome<Option<&'static dyn atlasfit_native::Cgal>> {
        if self.surface != ATLASFIT_SURFACE_WRAP {
            return Ok(None);
        }
        if self.watertight != 0 {
            return Err(Failure::invalid("a shell is watertight. Leave out watertight"));
        }
        atlasfit_native::cgal().map(Some).ok_or_else(|| {
            Failure::new(
                ATLASFIT_NOT_AVAILABLE,
                "this library was built without CGAL, which makes shells. Use watertight, or build it with \
                 the feature cgal (it is under the GPL then)",
            )
        })
    }

    /// The core's options. Values that the C types cannot name are refused here, all others by the core.
    unsafe fn core(&self) -> Outcome<(DenoiseOptions, Prior)> {
        let unknown = |name: &str, value: u32, advice: &str| {
            Err(Failure::invalid(format!("{name} is {value}. Give {advice}")))
        };
        let recipe = match self.recipe {
            ATLASFIT_RECIPE_FAST => Recipe::Fast,
            ATLASFIT_RECIPE_PAPER => Recipe::Paper,
            other => return unknown("recipe", other, "ATLASFIT_RECIPE_FAST or ATLASFIT_RECIPE_PAPER"),
        };
        let network = |network| {
            Prior::Network(
                NetworkOptions::default()
                    .with_network(network)
                    .with_recipe(recipe)
                    .with_charts(self.network_charts as usize)
                    .with_iterations(self.network_iterations as usize)
                    .with_stretch_weight(self.network_stretch_weight)
                    .with_learning_rate(self.network_learning_rate),
            )
        };
        let prior = match self.prior {
            ATLASFIT_PRIOR_GP => Prior::Gp,
            ATLASFIT_PRIOR_MLP => network(Network::Dense),
            ATLASFIT_PRIOR_CONV => network(Network::Conv),
            ATLASFIT_PRIOR_LEVEL_SET => Prior::LevelSet(LevelSetOptions::default()),
            other => return unknown("prior", other, "ATLASFIT_PRIOR_GP to ATLASFIT_PRIOR_LEVEL_SET"),
        };
        let outliers = match self.outliers {
            ATLASFIT_OUTLIERS_KEEP => Outliers::Keep,
            ATLASFIT_OUTLIERS_DROP => Outliers::Drop,
            other => return unknown("outliers", other, "ATLASFIT_OUTLIERS_KEEP or ATLASFIT_OUTLIERS_DROP"),
        };
        let uv = sized::flag(self.uv, "uv")?;
        let has_viewpoint = sized::flag(self.has_viewpoint, "has_viewpoint")?;
        let watertight = sized::flag(self.watertight, "watertight")?;
        let largest = sized::flag(self.largest, "largest")?;
        if self.surface > ATLASFIT_SURFACE_WRAP {
            return unknown("surface", self.surface, "ATLASFIT_SURFACE_NONE to ATLASFIT_SURFACE_WRAP");
        }
        let uncertainty = sized::flag(self.uncertainty, "uncertainty")?;
        let sweeps = if self.sweeps.is_null() {
            None
        } else {
            // SAFETY: the caller's name ends in a zero.
            Some(unsafe { points::name(self.sweeps, "sweeps") }?)
        };
        let options = DenoiseOptions::default()
            // 0 asks for an estimate.
            .with_noise((self.noise != 0.0).then_some(self.noise))
            .with_strength(self.strength)
            .with_detail(self.detail)
            .with_charts((self.charts > 0).then_some(self.charts as usize))
            .with_fill_holes(self.fill_holes)
            .with_min_part(self.min_part)
            .with_largest(largest)
            .with_faces((self.faces > 0).then_some(self.faces as usize))
            // Less than 0 asks for the usual; what is no number is refused.
            .with_max_error(Some(self.max_error).filter(|e| *e >= 0.0 || e.is_nan()))
            .with_watertight(watertight)
            .with_texture_size(self.texture_size)
            .with_outliers(outliers)
            .with_viewpoint(has_viewpoint.then_some(self.viewpoint))
            .with_surface(self.surface != ATLASFIT_SURFACE_NONE)
            .with_uncertainty(uncertainty)
            .with_sweeps(sweeps)
            .with_uv(uv);
        Ok((options, prior))
    }
}

/// Fills options with their defaults.
///
/// @param options     The struct to fill.
/// @param struct_size sizeof(atlasfit_denoise_options).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_denoise_options_init(
    options: *mut atlasfit_denoise_options,
    struct_size: usize,
) -> atlasfit_status {
    guard("atlasfit_denoise_options_init", || unsafe { sized::init(options, struct_size) })
}

/// Tells how many bytes atlasfit_denoise() needs at its peak for an evenly sampled scan, its points included:
/// an upper bound that is up to twice too large. The points need not be there. A scan whose spacing varies,
/// and the network priors, need more.
///
/// @param points  How many points.
/// @param options How to denoise; NULL = the defaults.
/// @param run     How long work is run, of which the threads count; NULL = the defaults.
/// @param bytes   Set to the bytes; 0 on failure.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_denoise_memory_needed(
    points: usize,
    options: *const atlasfit_denoise_options,
    run: *const atlasfit_run,
    bytes: *mut u64,
) -> atlasfit_status {
    guard("atlasfit_denoise_memory_needed", || unsafe {
        let bytes = number_out(bytes)?;
        let (options, _) = sized::read_or_default(options)?.core()?;
        *bytes = memory_needed(points, &options, core_run(run)?.thread_count()?);
        Ok(())
    })
}

/// Denoises a scan: denoised points, one connected surface with UVs, and the fitted atlas.
///
/// @param points  The scan, at least a few hundred points on a surface.
/// @param options How to denoise; NULL = the defaults.
/// @param run     How long work is run; NULL = the defaults.
/// @param out     Where the result is put; NULL on failure. Free it with atlasfit_result_free().
/// @return #ATLASFIT_OK, #ATLASFIT_INVALID_ARGUMENT, #ATLASFIT_ABI_MISMATCH, #ATLASFIT_INDEX_OUT_OF_RANGE (a
///         triangle names no point), #ATLASFIT_EMPTY_INPUT (no finite point), #ATLASFIT_DEGENERATE (the
///         points are no surface), #ATLASFIT_DIVERGED, #ATLASFIT_CANCELLED, #ATLASFIT_TIMED_OUT,
///         #ATLASFIT_OUT_OF_MEMORY, #ATLASFIT_RESOURCE_EXHAUSTED (no more threads).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_denoise(
    points: *const atlasfit_points,
    options: *const atlasfit_denoise_options,
    run: *const atlasfit_run,
    out: *mut *mut atlasfit_result,
) -> atlasfit_status {
    guard("atlasfit_denoise", || unsafe {
        handle::checked_out(out)?;
        let wanted = sized::read_or_default(options)?;
        let cgal = wanted.cgal()?;
        let (options, prior) = wanted.core()?;
        let mut run = core_run(run)?;
        let cloud = points::cloud(points)?;
        let (mut triangles, faces) = points::faces(points)?;
        if let Some(Faces { corners, offsets }) = faces {
            triangles =
                run.execute(|ctx| Polygons::new(&cloud.positions, corners, offsets, None, ctx))?.triangles;
        }
        let mut denoised = denoise_vertices(&cloud, &triangles, &options, prior.guide(), &mut run)?;
        if let Some(cgal) = cgal {
            run.execute(|ctx| atlasfit_native::wrap(&mut denoised, cgal, &options, ctx))?;
        }
        drop((cloud, triangles));
        log::warn(&denoised.report.warnings);
        handle::give(Arc::new(DenoiseResult::new(denoised, &options)?), out);
        Ok(())
    })
}
