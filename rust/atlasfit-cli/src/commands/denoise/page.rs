//! The page of `denoise --report`: the scan beside the denoised points and the surface.
//!
//! In: the scan and what became of it. Out: the bytes of an HTML file.

use crate::console::Console;
use crate::number::{count, counted, short};
use crate::page::Page;
use crate::page::bars::Bars;
use crate::page::scene::{Cloud, Scene, Show, What, light_mesh, light_points, show_mesh, show_uvs};
use crate::render::color::{Rgb8, eight_bits};
use crate::render::scale::{Scale, painted};
use atlasfit::geometry::{Attribute, PointCloud, TriMesh};
use atlasfit::measure::uv::Pages;
use atlasfit::pipeline::{Denoised, OUTLIER_PROBABILITY, UNCERTAINTY};
use atlasfit::{Context, Result};
use std::path::PathBuf;

/// Colour of an outlier.
const OUTLIER: Rgb8 = [213, 30, 20];
/// Colour of a point without one of its own.
const POINT: Rgb8 = [120, 135, 150];
/// The histogram of how far points were moved reaches so many standard deviations of the noise.
const DEVIATIONS: f64 = 4.0;

/// Makes the page. `facts` is the command's report as text.
pub fn page(
    scan: &PointCloud,
    outcome: &Denoised,
    facts: &str,
    title: String,
    console: &Console,
    ctx: &Context<'_>,
) -> Result<Vec<u8>> {
    let moved = moved(scan, outcome);
    let scene = scene(scan, outcome, &moved, ctx)?;
    let [notes, warnings] = console.told();
    let on: Vec<f64> = moved.iter().copied().filter(|m| !m.is_nan()).collect();
    let reach = DEVIATIONS * outcome.report.noise.max(f64::MIN_POSITIVE);
    let words = format!(
        "How far {} were moved along the surface's normal, in the scan's unit; outliers left out. The noise \
         is {}.",
        counted(on.len(), "point"),
        short(outcome.report.noise)
    );
    let mut bars = Vec::new();
    if !on.is_empty() {
        bars.push(Bars::histogram("Noise", words, &on, [-reach, reach]));
    }
    bars.push(Bars::of_stages(&outcome.report.seconds));
    let page = Page { title, facts, warnings: &warnings, notes: &notes, scene: &scene, bars: &bars };
    Ok(page.html().into_bytes())
}

/// How far each denoised point was moved along its normal; no number for outliers.
fn moved(scan: &PointCloud, outcome: &Denoised) -> Vec<f64> {
    let normals = outcome.points.normals.as_deref().unwrap_or_default();
    (outcome.points.positions.iter().enumerate())
        .map(|(i, p)| {
            let from = scan.positions[outcome.point_source[i] as usize];
            let along = normals.get(i).map_or([f64::NAN; 3], |n| n.map(f64::from));
            let on_chart = outcome.point_chart[i] != u32::MAX;
            let sum = (0..3).map(|k| (p[k] - from[k]) * along[k]).sum();
            if on_chart { sum } else { f64::NAN }
        })
        .collect()
}

/// Points before and after, and the surface in its colourings.
fn scene(scan: &PointCloud, outcome: &Denoised, moved: &[f64], ctx: &Context<'_>) -> Result<Scene> {
    let mut scene = Scene::default();
    show_points(&mut scene, scan, outcome, moved, ctx.seed);
    ctx.check()?;
    if !outcome.surface.triangles.is_empty() {
        let first = scene.shows.len();
        show_surface(&mut scene, &outcome.surface, ctx)?;
        scene.start = [0, first];
    }
    Ok(scene)
}

/// The scan, the denoised points, and their numbers as colours.
fn show_points(scene: &mut Scene, scan: &PointCloud, outcome: &Denoised, moved: &[f64], seed: u64) {
    let mut after_of = vec![u32::MAX; scan.len()];
    for (i, &source) in outcome.point_source.iter().enumerate() {
        after_of[source as usize] = i as u32;
    }
    let some = light_points(scan.len(), seed);
    // The normal of the denoised point, for both; of outliers none.
    let normal = |i: &u32| {
        let after = after_of[*i as usize] as usize;
        let on_chart = outcome.point_chart.get(after).is_some_and(|c| *c != u32::MAX);
        let normals = outcome.points.normals.as_ref().filter(|_| on_chart);
        normals.map_or([0.0; 3], |n| n[after])
    };
    let before = Cloud {
        positions: some.iter().map(|&i| scan.positions[i as usize]).collect(),
        normals: some.iter().map(normal).collect(),
    };
    let is_outlier = |i: u32| match after_of[i as usize] {
        u32::MAX => true,
        after => outcome.point_chart[after as usize] == u32::MAX,
    };
    let own = |i: u32| {
        let color = scan.colors.as_ref().map(|c| c[i as usize]);
        color.map_or(POINT, |[r, g, b, _]| eight_bits([r, g, b]))
    };
    let marked = |&i: &u32| if is_outlier(i) { OUTLIER } else { own(i) };
    let scanned = Show::new("The scan (outliers red)", What::Cloud(0));
    scene.shows.push(scanned.with_colors(some.iter().map(marked).collect()));
    let kept: Vec<u32> = some.into_iter().filter(|&i| after_of[i as usize] != u32::MAX).collect();
    let at: Vec<usize> = kept.iter().map(|&i| after_of[i as usize] as usize).collect();
    let after = Cloud {
        positions: at.iter().map(|&i| outcome.points.positions[i]).collect(),
        normals: kept.iter().map(normal).collect(),
    };
    scene.clouds = vec![before, after];
    let denoised = Show::new("Denoised points", What::Cloud(1));
    scene.shows.push(denoised.with_colors(kept.iter().map(marked).collect()));
    let column = |name| Attribute::named(&outcome.points.attributes, name).map(|c| c.values.as_slice());
    for (name, values) in [
        ("How far points were moved", Some(moved)),
        ("Uncertainty of points", column(UNCERTAINTY)),
        ("Probability of outliers", column(OUTLIER_PROBABILITY)),
    ] {
        let Some(values) = values else { continue };
        let shown: Vec<f64> = at.iter().map(|&i| values[i]).collect();
        let scale = Scale::over(name, &shown);
        scene.shows.push(Show::new(name, What::Cloud(1)).with_values(&shown, scale));
    }
    scene.start = [0, 1];
}

/// The surface, plain and in colours; its charts, checker and stretch where it has UVs.
fn show_surface(scene: &mut Scene, surface: &TriMesh, ctx: &Context<'_>) -> Result<()> {
    let mesh = light_mesh(surface, ctx)?;
    show_mesh(scene, ["Surface", "Surface in its colours"], &mesh);
    if mesh.corner_uv.is_some() {
        show_uvs(scene, &mesh, &Pages::default(), ctx)?;
    }
    if Attribute::named(&mesh.attributes, UNCERTAINTY).is_some() {
        let (colors, scale) = painted(&mesh, UNCERTAINTY)?;
        let show = Show::new("Uncertainty of the surface", What::Vertices).with_vertex_colors(&colors);
        scene.shows.push(Show { legend: Some(scale), ..show });
    }
    scene.mesh = Some(mesh);
    Ok(())
}

/// What the page is called: the name of the scan's first file, and what was done.
pub fn title(points: usize, scans: &[PathBuf]) -> String {
    format!("{}: {} points denoised", crate::files::name(&scans[0]), count(points))
}
