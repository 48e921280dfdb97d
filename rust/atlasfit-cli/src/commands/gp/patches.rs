//! The bridge between the exact process and the default prior: patches, and its figure.

use crate::plot::{Axis, Figure, Legend, Mark, Panel, Shape};
use anyhow::Result;
use atlasfit::numeric::rng::Rng;
use atlasfit::spatial::neighbours::Neighbours;
use atlasfit::{Context, Vec3};
use atlasfit_gp::bridge::{Belief, Patch, Search, alignment, posterior};
use atlasfit_gp::disk::{Expansion, Resolution};
use atlasfit_gp::kernel::Kernel;

/// Points of a patch: those of a typical chart.
pub const POINTS: usize = 120;
/// Length over width of the patches that ask whether the domain's shape matters.
pub const ASPECT: f64 = 2.0;
/// Eigenfunctions that are compared.
pub const FUNCTIONS: usize = 25;

/// A made-up patch: waves with noise.
pub fn made(rng: &mut Rng) -> Patch {
    let at: Vec<[f64; 2]> = std::iter::repeat_with(|| [0; 2].map(|_| 2.0 * rng.uniform() - 1.0))
        .filter(|p| p[0].hypot(p[1]) < 1.0)
        .take(POINTS)
        .collect();
    let [a, b, c] = [0; 3].map(|_| 1.0 + 2.0 * rng.uniform());
    let heights =
        (at.iter()).map(|p| 0.1 * (a * p[0] + c).sin() * (b * p[1]).cos() + 0.015 * rng.normal()).collect();
    Patch { at, heights }
}

/// The same patch as round and in the coordinates of an elliptic domain, which is mapped to the disk.
pub fn elliptic(patch: &Patch, aspect: f64) -> Patch {
    let stretched: Vec<[f64; 2]> = patch.at.iter().map(|p| [p[0], p[1] * aspect]).collect();
    let size = stretched.iter().map(|p| p[0].hypot(p[1])).fold(1e-12, f64::max);
    Patch {
        at: stretched.iter().map(|p| p.map(|x| x / size)).collect(),
        heights: patch.heights.iter().map(|h| h / size).collect(),
    }
}

/// Patches of a scan about places spread over its points.
pub fn of_scan(points: &[Vec3], count: usize, aspect: f64, ctx: &Context<'_>) -> Result<Vec<Patch>> {
    let tree = Neighbours::build(points, ctx)?;
    let order = atlasfit::numeric::rng::shuffled(points.len(), ctx.seed);
    let mut patches = Vec::new();
    for &i in order.iter().take(count) {
        ctx.check()?;
        patches.extend(Patch::around(points, &tree, i as usize, POINTS, aspect));
    }
    Ok(patches)
}

/// The figure of the bridge.
pub fn bridge(seed: u64) -> Figure {
    let mut panels = Vec::new();
    let mut marks = Vec::new();
    for (color, depth) in [1, 2, 3].into_iter().enumerate() {
        let kernel = Kernel::relu(depth);
        let exact = Expansion::new(|p| kernel.covariance(p).ab, Resolution::default());
        let held = alignment(&exact, 40).held;
        let points = held.iter().enumerate().map(|(i, h)| [(i + 1) as f64, *h]).collect();
        marks.push(Mark::line(format!("depth {depth}"), color, points));
    }
    let axes = [
        Axis::linear("number of the exact eigenfunction", [1.0, 40.0]),
        Axis::linear("share held", [0.5, 1.02]),
    ];
    panels.push(Panel {
        title: "what 50 functions of the default prior hold".into(),
        axes: Some(axes),
        legend: Legend::LowerRight,
        marks,
    });

    let patch = made(&mut Rng::stream(seed, 7));
    let line: Vec<[f64; 2]> = (0..=80).map(|i| [f64::from(i) / 40.0 - 1.0, 0.0]).collect();
    let mut marks = Vec::new();
    let near = patch.at.iter().zip(&patch.heights).filter(|(p, _)| p[1].abs() < 0.12);
    let dots: Vec<[f64; 2]> = near.map(|(p, h)| [p[0], *h]).collect();
    if let Some(p) = posterior(Belief::Exact(Kernel::relu(1)), &patch, &line, Search::FINE) {
        let band = (0..line.len())
            .map(|i| [line[i][0], p.mean[i] - 2.0 * p.deviation[i], p.mean[i] + 2.0 * p.deviation[i]])
            .collect();
        marks.push(Mark { label: "exact, 2 deviations".into(), color: 0, shape: Shape::Band(band) });
        let mean = (0..line.len()).map(|i| [line[i][0], p.mean[i]]).collect();
        marks.push(Mark::line("exact process", 0, mean));
    }
    if let Some(p) = posterior(Belief::Default, &patch, &line, Search::COARSE) {
        let mean = (0..line.len()).map(|i| [line[i][0], p.mean[i]]).collect();
        marks.push(Mark::dashed("default prior", 1, mean));
    }
    marks.push(Mark::dots("points within 0.12 of the line", 6, dots));
    let axes = [Axis::linear("along the patch", [-1.0, 1.0]), Axis::linear("height", [-0.2, 0.25])];
    panels.push(Panel {
        title: "a made-up patch of 120 points, cut".into(),
        axes: Some(axes),
        legend: Legend::UpperRight,
        marks,
    });
    let title = "The exact process of a wide ReLU network and the default prior, over the unit disk";
    Figure { title, rows: vec![panels], row: [1360, 450] }
}
