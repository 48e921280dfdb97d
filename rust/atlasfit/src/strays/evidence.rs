//! How much likelier the points about a place are on a sheet than as strays.
//!
//! In: points, their search tree, a chart or a place. Out: the logarithm of the ratio of the two marginal
//! likelihoods, in nats. Strays know no direction: across the sheet they spread as far as along it.

use super::constants::STRAYS;
use crate::atlas::Monge;
use crate::numeric::dense::principal;
use crate::numeric::mixture;
use crate::numeric::robust::TUKEY;
use crate::numeric::stats::weighted_median;
use crate::numeric::vec3::Vec3;
use crate::partition::constants::PARTITION;
use crate::spatial::Neighbours;
use crate::spatial::neighbours::Neighbour;
use std::f64::consts::TAU;

/// Noise so small that no length can be divided by it.
const LEAST_SIGMA: f64 = 1e-12;
/// Coefficients of a quadric: it goes through as many points or fewer.
const QUADRIC: usize = 6;
/// Points that a chart can follow. Source: chosen, twice the coefficients of a quadric.
const FOLLOWS: f64 = 2.0 * QUADRIC as f64;
/// Rounds in which it is found how far the sheet's points go.
const EXTENT_ROUNDS: usize = 3;

/// A chart as it is looked at.
#[derive(Clone, Copy)]
pub(super) struct Sheet<'a> {
    /// Its map.
    pub map: &'a Monge,
    /// Its noise.
    pub sigma: f64,
    /// The scan's noise there.
    pub usual: f64,
    /// Spacing of its points.
    pub spacing: f64,
}

impl Sheet<'_> {
    /// The least radius in which it is looked at.
    fn narrowest(&self) -> f64 {
        (STRAYS.window * self.sigma.max(LEAST_SIGMA)).max(STRAYS.window_spacings * self.spacing)
    }
}

/// The evidence for a sheet: the heights over it of the points that `counts` are a mixture of its noise and
/// of strays.
pub(super) fn of_sheet(
    points: &[Vec3],
    tree: &Neighbours,
    sheet: &Sheet<'_>,
    counts: impl Fn(u32) -> bool,
    found: &mut Vec<Neighbour>,
) -> f64 {
    in_window(points, tree, sheet, sheet.narrowest(), counts, found).evidence
}

/// The same in wider windows, each twice as wide as the last, as a narrow one has too few points where they
/// lie in lines. The one that says most counts, less what the choice costs. Charts that are thicker than the
/// noise, or empty in their middle, have none.
pub(super) fn of_wide_sheet(
    points: &[Vec3],
    tree: &Neighbours,
    sheet: &Sheet<'_>,
    counts: impl Fn(u32) -> bool,
    found: &mut Vec<Neighbour>,
) -> f64 {
    let mut look = |window: f64| in_window(points, tree, sheet, window, &counts, found);
    let narrowest = sheet.narrowest();
    if sheet.sigma > sheet.usual * STRAYS.noise_varies.exp() || look(narrowest).points < QUADRIC {
        return f64::NEG_INFINITY;
    }
    let wider = (1..STRAYS.windows).map(|k| look(narrowest * 2f64.powi(k)).evidence);
    wider.fold(f64::NEG_INFINITY, f64::max) - f64::from(STRAYS.windows).ln()
}

/// What a window says.
struct Window {
    /// The evidence for a sheet, in nats.
    evidence: f64,
    /// Points over or under the sheet there.
    points: usize,
}

/// The evidence from the points nearer to the sheet's centre than `window`.
fn in_window(
    points: &[Vec3],
    tree: &Neighbours,
    sheet: &Sheet<'_>,
    window: f64,
    counts: impl Fn(u32) -> bool,
    found: &mut Vec<Neighbour>,
) -> Window {
    let map = sheet.map;
    let sigma = sheet.sigma.max(LEAST_SIGMA);
    let radii = map.radii.map(|r| r.min(window));
    let narrow = radii[0].min(radii[1]);
    let reach = narrow.max(TUKEY * sigma);
    tree.within(map.center, radii[0].max(radii[1]).hypot(reach), found);
    let step = found.len().div_ceil(STRAYS.most).max(1);
    keep_each(found, step);
    found.retain(|f| counts(f.index));
    let mut over: Vec<[f64; 3]> = found
        .iter()
        .filter_map(|f| {
            let l = map.local(points[f.index as usize]);
            let (x, y) = (l.u * map.radii[0], l.v * map.radii[1]);
            if (x / radii[0]).powi(2) + (y / radii[1]).powi(2) > 1.0 {
                return None;
            }
            let surface = map.height_normal(l.u, l.v);
            let height = (l.z - surface.height) * surface.cos;
            (height.abs() <= reach).then_some([x, y, height])
        })
        .collect();
    let points = over.len();
    let mut half = reach.min(as_far_as_along(&over, |_| 1.0));
    over.retain(|p| p[2].abs() <= half);
    let mut mixture = Mixture::new(&over, half, sigma);
    for _ in 1..EXTENT_ROUNDS {
        half = half.min(as_far_as_along(&over, |k| mixture.on_sheet(k)));
        over.retain(|p| p[2].abs() <= half);
        mixture = Mixture::new(&over, half, sigma);
    }
    // A chart may follow a few points: those of a sheet are no nearer to it, on average, than its noise.
    let (square, on) = over.iter().enumerate().fold((0.0, 0.0), |(square, on), (k, p)| {
        let w = mixture.on_sheet(k);
        (square + w * p[2] * p[2], on + w)
    });
    if square < on * sigma * sigma {
        // Where there is less noise than usual, that is no more than as many coefficients can follow. More
        // noise than usual is known from these points alone.
        let most = if sigma > sheet.usual { f64::INFINITY } else { on / (on - FOLLOWS).max(1.0) };
        let followed = (sigma / (square / on).sqrt().max(LEAST_SIGMA)).min(most.sqrt());
        over.iter_mut().for_each(|p| p[2] *= followed);
        mixture = Mixture::new(&over, half, sigma);
    }
    let Mixture { ratio, stray } = mixture;
    let data: f64 = ratio.iter().map(|r| (stray + (1.0 - stray) * r).ln()).sum();
    let on = ratio.len() as f64 * (1.0 - stray);
    let cost = cost_of_a_quadric(on, half / sigma, PARTITION.curved * narrow / sigma);
    Window { evidence: (data - cost) * step as f64, points }
}

/// Keeps one in so many of the points that were found.
fn keep_each(found: &mut Vec<Neighbour>, step: usize) {
    let mut k = 0;
    found.retain(|_| {
        k += 1;
        (k - 1) % step == 0
    });
}

/// Points of a sheet among strays.
struct Mixture {
    /// For each point the ratio of its densities on the sheet and as a stray.
    ratio: Vec<f64>,
    /// The share of strays.
    stray: f64,
}

impl Mixture {
    /// Of points up to `half` over the sheet.
    fn new(over: &[[f64; 3]], half: f64, sigma: f64) -> Self {
        let peak = 2.0 * half / (TAU.sqrt() * sigma);
        let ratio: Vec<f64> = over.iter().map(|p| peak * (-0.5 * (p[2] / sigma).powi(2)).exp()).collect();
        let stray = mixture::share_of_strays(&ratio);
        Self { ratio, stray }
    }
    /// The probability that a point is the sheet's.
    fn on_sheet(&self, k: usize) -> f64 {
        1.0 - mixture::stray(self.stray, self.ratio[k])
    }
}

/// Half the height up to which points spread evenly are as widely scattered as half of the sheet's points are
/// along it. A clump of strays is then no sheet, however wide what else is there. `on_sheet` says how much
/// each point is the sheet's.
fn as_far_as_along(over: &[[f64; 3]], on_sheet: impl Fn(usize) -> f64) -> f64 {
    let middle = |of: &dyn Fn(&[f64; 3]) -> f64| -> f64 {
        let mut all: Vec<(f64, f64)> = over.iter().enumerate().map(|(k, p)| (of(p), on_sheet(k))).collect();
        weighted_median(&mut all)
    };
    let [x, y] = [middle(&|p| p[0]), middle(&|p| p[1])];
    // On a disk of radius r half of the points are within r / sqrt 2, and the variance is r^2 / 4 either way.
    (1.5 * middle(&|p| (p[0] - x).powi(2) + (p[1] - y).powi(2))).sqrt()
}

/// What a quadric fitted to `n` points costs: each coefficient half the logarithm of how much the points
/// narrow it down (the Occam factor; MacKay 1992). Offset and slopes may be anything within `half`, curvature
/// within `curved`, both in standard deviations of the noise; the mean squares of the terms are those on a
/// disk.
pub(super) fn cost_of_a_quadric(n: f64, half: f64, curved: f64) -> f64 {
    let cost = |width: f64, mean_square: f64| 0.5 * (n * mean_square * width * width).ln_1p();
    let even = half / 3f64.sqrt();
    cost(even, 1.0) + 2.0 * cost(even, 0.25) + 3.0 * cost(curved, 1.0 / 12.0)
}

/// What it costs, in nats, that the noise is `sigma` here and `usual` elsewhere in the scan. Less noise costs
/// nothing.
pub(super) fn cost_of_noise(sigma: f64, usual: f64) -> f64 {
    0.5 * ((sigma / usual.max(LEAST_SIGMA)).ln().max(0.0) / STRAYS.noise_varies).powi(2)
}

/// The evidence that points about a place lie in a flat slab, several times as thick as the noise `sigma`:
/// two sheets close together that cannot be told apart. The thickness that says most counts, less what the
/// choice costs.
pub(super) fn of_slab(
    points: &[Vec3],
    tree: &Neighbours,
    place: Vec3,
    sigma: f64,
    found: &mut Vec<Neighbour>,
) -> f64 {
    let sigma = sigma.max(LEAST_SIGMA);
    let mut best = f64::NEG_INFINITY;
    for k in 1..=STRAYS.slabs {
        tree.within(place, STRAYS.window * sigma * STRAYS.thicker.powi(k), found);
        if found.len() < PARTITION.min_members {
            continue;
        }
        keep_each(found, found.len().div_ceil(STRAYS.most).max(1));
        let few = found.iter().map(|f| (points[f.index as usize], 1.0));
        let Some(spread) = principal(few.clone()) else { continue };
        let n = few.count() as f64;
        // Strays may spread along one direction more than along the others.
        let [across, along, _] = spread.variances;
        let thick = across.max(0.0).sqrt().max(sigma);
        let half = (3.0 * along).sqrt();
        let data = n * ((2.0 * half / (TAU.sqrt() * thick)).ln() - 0.5);
        let cost = 1.5 * (n * (half / thick).powi(2) / 3.0).ln_1p();
        // A clump of strays may look as flat, by chance or where the window cuts it.
        let flat = (along.max(0.0).sqrt() / thick).max(1.0).ln();
        let no_clump = 0.5 * (flat / STRAYS.clumps_vary).powi(2);
        best = best.max((data - cost).min(no_clump) - cost_of_noise(thick, sigma));
    }
    best - f64::from(STRAYS.slabs).ln()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::Rng;
    use crate::run::Run;

    fn flat(radius: f64) -> Monge {
        Monge {
            center: Vec3::ZERO,
            axes: [Vec3([1.0, 0.0, 0.0]), Vec3([0.0, 1.0, 0.0]), Vec3([0.0, 0.0, 1.0])],
            radii: [radius; 2],
            coeffs: Box::new([0.0; crate::numeric::spline::COEFFS]),
            mask: crate::atlas::mask::Mask::build(&[], [radius; 2], 1.0, 0.0),
        }
    }
    fn for_sheet(points: &[Vec3], sigma: f64, radius: f64) -> f64 {
        let tree = Run::default().execute(|ctx| Neighbours::build(points, ctx)).unwrap();
        let sheet = Sheet { map: &flat(radius), sigma, usual: sigma, spacing: radius / 6.0 };
        of_sheet(points, &tree, &sheet, |_| true, &mut Vec::new())
    }
    /// Points scattered by these standard deviations along x, y and z.
    fn cloud(n: usize, spread: [f64; 3]) -> Vec<Vec3> {
        let mut rng = Rng::new(3);
        (0..n).map(|_| Vec3(spread.map(|s| s * rng.normal()))).collect()
    }

    #[test]
    fn a_sheet_has_evidence_that_grows_with_its_points_and_a_clump_has_none() {
        let few = for_sheet(&cloud(30, [0.5, 0.5, 0.05]), 0.05, 1.0);
        let many = for_sheet(&cloud(300, [0.5, 0.5, 0.05]), 0.05, 1.0);
        assert!(few > 0.0 && many > 5.0 * few, "{few} {many}");
        for sigma in [0.05, 0.2, 0.5] {
            let clump = for_sheet(&cloud(300, [0.5; 3]), sigma, 1.0);
            assert!(clump < 0.0, "{sigma}: {clump}");
        }
    }
    #[test]
    fn a_clump_amid_strays_that_are_spread_wide_is_no_sheet() {
        let mut points = cloud(200, [0.05; 3]);
        points.extend(cloud(60, [0.5; 3]));
        let clump = for_sheet(&points, 0.05, 1.0);
        assert!(clump < 0.0, "{clump}");
    }
    #[test]
    fn a_sheet_that_is_seen_in_lines_is_known_in_a_wider_window_only() {
        // Lines six spacings apart: the narrow window sees one of them.
        let mut rng = Rng::new(3);
        let mut points = Vec::new();
        for line in -2..=2 {
            for k in -12..=12 {
                points.push(Vec3([f64::from(k), 6.0 * f64::from(line), 0.05 * rng.normal()]));
            }
        }
        let tree = Run::default().execute(|ctx| Neighbours::build(&points, ctx)).unwrap();
        let sheet = Sheet { map: &flat(12.0), sigma: 0.05, usual: 0.05, spacing: 1.0 };
        let narrow = of_sheet(&points, &tree, &sheet, |_| true, &mut Vec::new());
        let wide = of_wide_sheet(&points, &tree, &sheet, |_| true, &mut Vec::new());
        assert!(narrow < 10.0 && wide > 2.0 * narrow && wide > 10.0, "{narrow} {wide}");
    }
    #[test]
    fn a_handful_of_points_is_no_evidence_as_a_quadric_goes_through_any() {
        let few = for_sheet(&cloud(7, [0.5, 0.5, 0.001]), 0.05, 1.0);
        assert!(few < 5.0, "{few}");
    }
    #[test]
    fn a_slab_of_two_sheets_is_known_and_a_ball_is_not() {
        let slab: Vec<Vec3> = cloud(600, [0.5, 0.5, 0.02])
            .into_iter()
            .enumerate()
            .map(|(i, p)| p + Vec3([0.0, 0.0, if i % 2 == 0 { 0.03 } else { -0.03 }]))
            .collect();
        let ball = cloud(600, [0.1; 3]);
        let slab_and_ball = [slab, ball].map(|points| {
            let tree = Run::default().execute(|ctx| Neighbours::build(&points, ctx)).unwrap();
            of_slab(&points, &tree, Vec3::ZERO, 0.02, &mut Vec::new())
        });
        assert!(slab_and_ball[0] > 20.0 && slab_and_ball[1] < 0.0, "{slab_and_ball:?}");
    }
}
