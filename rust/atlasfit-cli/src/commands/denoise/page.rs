//! The page of `denoise --report`: the scan beside the denoised points and the surface.
//!
//! In: the scan and what became of it. Out: the bytes of an HTML file.

use crate::console::Console;
use crate::number::{count, counted, short};
use crate::page::Page;
use crate::page::bars::Bars;
use crate::page::scene::{Cloud, Rgb8, Scene, Show, What, eight_bits, light_mesh, light_points, show_uvs};
use crate::render::scale::{Scale, paint};
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
    let scene = scene(scan, outcome, ctx)?;
    let [notes, warnings] = console.told();
    let moved = moved(scan, outcome);
    let on: Vec<f64> = moved.iter().copied().filter(|m| !m.is_nan()).collect();
    let reach = DEVIATIONS * outcome.report.noise.max(f64::MIN_POSITIVE);
    let words = format!(
        "How far {} were moved along the surface's normal, in the scan's unit; outliers left out. The noise \
         is {}.",
        counted(on.len(), "point"),
        short(outcome.report.noise)
    );
    let mut bars = vec![Bars::of_stages(&outcome.report.seconds)];
    if !on.is_empty() {
        bars.insert(0, Bars::histogram("Noise", words, &on, [-reach, reach]));
    }
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
fn scene(scan: &PointCloud, outcome: &Denoised, ctx: &Context<'_>) -> Result<Scene> {
    let mut scene = Scene::default();
    show_points(&mut scene, scan, outcome, ctx.seed);
    ctx.check()?;
    if !outcome.surface.triangles.is_empty() {
        let first = scene.shows.len();
        show_surface(&mut scene, &outcome.surface, ctx)?;
        scene.start = [0, first];
    }
    Ok(scene)
}

fn show_points(scene: &mut Scene, scan: &PointCloud, outcome: &Denoised, seed: u64) {
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
    let all = moved(scan, outcome);
    let values: Vec<f64> = at.iter().map(|&i| all[i]).collect();
    let scale = Scale::over("moved", &values);
    scene.shows.push(Show::new("How far points were moved", What::Cloud(1)).with_values(&values, scale));
    for (name, column) in
        [("Uncertainty of points", UNCERTAINTY), ("Probability of outliers", OUTLIER_PROBABILITY)]
    {
        if let Some(column) = Attribute::named(&outcome.points.attributes, column) {
            let values: Vec<f64> = at.iter().map(|&i| column.values[i]).collect();
            let scale = Scale::over(name, &values);
            scene.shows.push(Show::new(name, What::Cloud(1)).with_values(&values, scale));
        }
    }
    scene.start = [0, 1];
}

/// The surface, plain and in colours; its charts, checker and stretch where it has UVs.
fn show_surface(scene: &mut Scene, surface: &TriMesh, ctx: &Context<'_>) -> Result<()> {
    let mut mesh = light_mesh(surface, ctx)?.into_owned();
    scene.shows.push(Show::new("Surface", What::Vertices));
    if let Some(colors) = &mesh.colors {
        let colors = colors.iter().map(|c| eight_bits([c[0], c[1], c[2]])).collect();
        scene.shows.push(Show::new("Surface in its colours", What::Vertices).with_colors(colors));
    }
    if mesh.corner_uv.is_some() {
        show_uvs(scene, &mesh, &Pages::default(), ctx)?;
    }
    if Attribute::named(&mesh.attributes, UNCERTAINTY).is_some() {
        let own = mesh.colors.take();
        let scale = paint(&mut mesh, UNCERTAINTY)?;
        let painted = std::mem::replace(&mut mesh.colors, own).unwrap_or_default();
        let colors = painted.iter().map(|c| eight_bits([c[0], c[1], c[2]])).collect();
        let mut show = Show::new("Uncertainty of the surface", What::Vertices).with_colors(colors);
        show.legend = Some(scale);
        scene.shows.push(show);
    }
    scene.mesh = Some(mesh);
    Ok(())
}

/// What the page is called: the name of the scan's first file, and what was done.
pub fn title(points: usize, scans: &[PathBuf]) -> String {
    format!("{}: {} points denoised", crate::files::name(&scans[0]), count(points))
}
