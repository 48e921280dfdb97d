//! Claims about one chart: its prior, the fit to a patch, foot points and curvature.

use crate::atlas::Patch;
use crate::atlas::mask::Mask;
use crate::atlas::monge::BaseCoordinates;
use crate::atlas::monge::HeightNormal;
use crate::atlas::{Map, Monge, Smoothness};
use crate::numeric::dense::{cholesky, cholesky_solve};
use crate::numeric::rng::Rng;
use crate::numeric::spline;
use crate::numeric::spline::{COEFFS, Hessian, Slope};
use crate::prior::basis::{BASIS, WIDTH};
use crate::prior::constants::{BENDS, MODES};
use crate::prior::evidence::{Problem, Work};
use crate::prior::gp::{self, Fit};
use crate::prior::normal_equations::NormalEquations;
use crate::prior::normal_equations::Observation;
use crate::prior::{basis, precisions};
use crate::{Run, Vec3};
use proptest::prelude::*;

fn rms(values: impl IntoIterator<Item = f64>) -> f64 {
    let (sum, n) = values.into_iter().fold((0.0, 0.0), |(s, n), x| (s + x * x, n + 1.0));
    f64::sqrt(sum / n)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// The vector kernels against plain sums over the splines of the eigenfunctions.
    #[test]
    fn normal_equations_are_sums_over_the_observations(seed in any::<u64>(), n in 1usize..40) {
        let mut rng = Rng::new(seed);
        let mut random = || 2.0 * rng.uniform() - 1.0;
        let observations: Vec<Observation> = (0..n)
            .map(|_| Observation {
                at: [random(), random()],
                height: random(),
                weight: random().abs(),
                count: 0.5,
            })
            .collect();
        let mut data = NormalEquations::default();
        // In two goes: sums go on.
        data.observe(&BASIS, &observations[..n / 2]);
        data.observe(&BASIS, &observations[n / 2..]);
        prop_assert_eq!(data.count, 0.5 * n as f64);
        let splines: Vec<[f32; COEFFS]> = (0..MODES)
            .map(|m| {
                let one = std::array::from_fn::<f64, MODES, _>(|k| f64::from(u8::from(k == m)));
                basis::spline_coefficients(&BASIS, &one)
            })
            .collect();
        let column = |k: usize, o: &Observation| {
            if k < MODES { spline::value(&splines[k], o.at[0], o.at[1]) } else { o.height }
        };
        for i in 0..=MODES {
            for j in i..=MODES {
                let sum: f64 = observations.iter().map(|o| o.weight * column(i, o) * column(j, o)).sum();
                let size: f64 =
                    observations.iter().map(|o| o.weight * (column(i, o) * column(j, o)).abs()).sum();
                let got = data.matrix[i * WIDTH + j];
                prop_assert!((got - sum).abs() < 1e-5 * (1.0 + size), "{} {}: {} {}", i, j, got, sum);
            }
        }
    }
}

#[test]
fn only_the_affine_functions_are_free() {
    assert!(BASIS.precision[..3].iter().all(|p| *p == 0.0));
    assert!(BASIS.precision[3] > 0.0);
    assert!(BASIS.precision[3..].windows(2).all(|w| w[0] <= w[1]), "smooth functions come first");
    // The three free functions have no bending anywhere on the disk, and none is made of the others.
    for m in 0..3 {
        let mut one = [0.0; MODES];
        one[m] = 1.0;
        let c = basis::spline_coefficients(&BASIS, &one);
        for (u, v) in [(0.0, 0.0), (0.6, 0.3), (-0.5, 0.7), (0.1, -0.9)] {
            let Hessian { uu, uv, vv } = spline::hessian(&c, u, v);
            let Slope { value: h, du: hu, dv: hv } = spline::value_gradient(&c, u, v);
            assert!(
                uu.abs().max(uv.abs()).max(vv.abs()) < 1e-3 * (h.abs() + hu.abs() + hv.abs()),
                "{m}: {uu} {uv} {vv}"
            );
        }
    }
}

fn normal_equations(at: &[[f64; 2]], heights: &[f64]) -> NormalEquations {
    let mut data = NormalEquations::default();
    let observations: Vec<Observation> = at
        .iter()
        .zip(heights)
        .map(|(p, z)| Observation { at: *p, height: *z, weight: 1.0, count: 1.0 })
        .collect();
    data.observe(&BASIS, &observations);
    data
}

/// Fits heights over the disk; `noise` is told to the fit as what to expect.
fn fit_heights(at: &[[f64; 2]], heights: &[f64], noise: f64, strength: f64) -> (Fit, [f32; COEFFS]) {
    let data = normal_equations(at, heights);
    let fit = gp::fit(&BASIS, &data, (noise, strength), None, &mut Work::default()).unwrap();
    let coeffs = basis::spline_coefficients(&BASIS, &fit.weights);
    (fit, coeffs)
}

fn disk(n: usize, seed: u64) -> Vec<[f64; 2]> {
    let mut rng = Rng::new(seed);
    let mut out = Vec::new();
    while out.len() < n {
        let p = [2.0 * rng.uniform() - 1.0, 2.0 * rng.uniform() - 1.0];
        if p[0].hypot(p[1]) < 1.0 {
            out.push(p);
        }
    }
    out
}

#[test]
fn a_plane_is_reproduced_however_tilted() {
    let at = disk(100, 1);
    for (c, a, b) in [(0.0, 0.0, 0.0), (3.0, 0.0, 0.0), (0.1, 0.5, -0.7), (-2.0, 1.0, 2.0)] {
        let z: Vec<f64> = at.iter().map(|p| c + a * p[0] + b * p[1]).collect();
        let (_, coeffs) = fit_heights(&at, &z, 0.01, 40.0);
        let size = c.abs() + a.abs() + b.abs();
        for p in &at {
            let e = spline::value(&coeffs, p[0], p[1]) - (c + a * p[0] + b * p[1]);
            assert!(e.abs() <= 1e-6 * size, "{e} at {p:?}");
        }
    }
}

#[test]
fn the_noise_of_a_smooth_patch_is_recovered() {
    let height = |p: &[f64; 2]| 0.3 * p[0] * p[0] - 0.2 * p[0] * p[1] + 0.1 * (2.0 * p[1]).sin();
    for noise in [0.003, 0.01, 0.03] {
        let mut ratios = 0.0;
        for seed in 0..8 {
            let at = disk(150, seed);
            let mut rng = Rng::new(seed + 100);
            let z: Vec<f64> = at.iter().map(|p| height(p) + noise * rng.normal()).collect();
            // A wrong expectation worth a few points only.
            let (fit, coeffs) = fit_heights(&at, &z, 2.0 * noise, 2.0);
            let ratio = fit.sigma / noise;
            assert!((0.75..1.25).contains(&ratio), "noise {noise}, seed {seed}: {ratio}");
            ratios += ratio / 8.0;
            let error = rms(at.iter().map(|p| spline::value(&coeffs, p[0], p[1]) - height(p)));
            assert!(error < 0.8 * noise, "noise {noise}, seed {seed}: error {error}");
        }
        assert!((0.88..1.12).contains(&ratios), "noise {noise}: {ratios} on average");
    }
}

/// A bowl without ripples: its chart bends freely, and is nearer to it than with the spectrum's bends.
#[test]
fn a_bowl_is_fitted_with_freer_bends() {
    let (noise, expected) = (0.02, (0.02, 40.0));
    let bowl = |p: &[f64; 2]| 0.3 * (p[0] * p[0] + p[1] * p[1]);
    let (mut freer, mut spectral) = (0.0, 0.0);
    for seed in 0..20 {
        let (at, mut rng) = (disk(120, seed), Rng::new(seed + 50));
        let z: Vec<f64> = at.iter().map(|p| bowl(p) + noise * rng.normal()).collect();
        let data = normal_equations(&at, &z);
        let error = |fit: &Fit| {
            let coeffs = basis::spline_coefficients(&BASIS, &fit.weights);
            rms(at.iter().map(|p| spline::value(&coeffs, p[0], p[1]) - bowl(p)))
        };
        let fit = gp::fit(&BASIS, &data, expected, None, &mut Work::default()).unwrap();
        assert!(fit.smoothness.bends < 1.0, "seed {seed}");
        freer += error(&fit);
        let bends = Smoothness { bends: 1.0, ..fit.smoothness };
        spectral += error(&gp::fit_at(&BASIS, &data, expected, bends, &mut Work::default()).unwrap());
    }
    assert!(freer < spectral, "{freer} {spectral}");
}

/// Heights that the prior's spectrum makes, with bends a third of what it lets them be.
#[test]
fn ripples_are_fitted_with_the_spectrums_bends() {
    let mut freer = 0;
    for seed in 0..20 {
        let (at, mut rng) = (disk(120, seed), Rng::new(seed + 50));
        let weights: Vec<f64> = (precisions().iter().enumerate())
            .map(|(m, p)| match p {
                0.0 => 0.0,
                _ if m < BENDS => 0.3 / p.sqrt(),
                _ => rng.normal() / p.sqrt(),
            })
            .collect();
        let ripples = basis::spline_coefficients(&BASIS, &weights);
        let height = |p: &[f64; 2]| spline::value(&ripples, p[0], p[1]);
        let z: Vec<f64> = at.iter().map(|p| height(p) + 0.003 * rng.normal()).collect();
        freer += usize::from(fit_heights(&at, &z, 0.003, 40.0).0.smoothness.bends < 1.0);
    }
    assert!(freer < 5, "{freer}");
}

#[test]
fn the_weights_of_a_fit_count() {
    // Half of the points are nonsense of no weight.
    let at = disk(200, 3);
    let mut data = NormalEquations::default();
    let observations: Vec<Observation> = at
        .iter()
        .enumerate()
        .map(|(i, p)| {
            let (height, weight) = if i % 2 == 0 { (0.2 * p[0], 1.0) } else { (9.0, 0.0) };
            Observation { at: *p, height, weight, count: weight }
        })
        .collect();
    data.observe(&BASIS, &observations);
    assert_eq!(data.count, 100.0);
    let fit = gp::fit(&BASIS, &data, (0.01, 40.0), None, &mut Work::default()).unwrap();
    let c = basis::spline_coefficients(&BASIS, &fit.weights);
    assert!((spline::value(&c, 0.5, 0.5) - 0.1).abs() < 1e-6);
    data.clear();
    assert!(data.count == 0.0 && data.matrix.iter().all(|x| *x == 0.0));
}

/// The score that [`Problem::solve`] climbs, by plain elimination: for each kappa the penalised sum of
/// squares and the determinant.
#[test]
fn the_most_likely_smoothness_is_found() {
    let unknowns = 12;
    let width = Problem::width(unknowns);
    for seed in 0..20 {
        let mut rng = Rng::new(seed);
        let rows: Vec<Vec<f64>> = (0..60).map(|_| (0..unknowns).map(|_| rng.normal()).collect()).collect();
        let truth: Vec<f64> = (0..unknowns).map(|k| rng.normal() * 0.5f64.powi(k as i32)).collect();
        let y: Vec<f64> = rows
            .iter()
            .map(|r| r.iter().zip(&truth).map(|(a, b)| a * b).sum::<f64>() + 0.3 * rng.normal())
            .collect();
        let precision: Vec<f64> =
            (0..unknowns).map(|k| if k < 2 { 0.0 } else { 2f64.powi(k as i32) }).collect();
        let problem = Problem { unknowns, free: 2, count: 60.0, expected: (0.3, 5.0), range: (-20.0, 10.0) };
        let columns: Vec<Vec<f64>> = rows.iter().zip(&y).map(|(r, y)| [&r[..], &[*y]].concat()).collect();
        let fit = problem
            .solve(0.0, &mut Work::default(), |kappa, system| {
                for i in 0..=unknowns {
                    for j in i..=unknowns {
                        system[i * width + j] = columns.iter().map(|c| c[i] * c[j]).sum();
                    }
                    if i < unknowns {
                        system[i * width + i] += kappa * precision[i];
                    }
                }
            })
            .unwrap();
        let score = |log_kappa: f64| {
            let mut a = vec![0.0; unknowns * unknowns];
            let mut x = vec![0.0; unknowns];
            for i in 0..unknowns {
                for j in i..unknowns {
                    a[i * unknowns + j] = columns.iter().map(|c| c[i] * c[j]).sum();
                }
                a[i * unknowns + i] += log_kappa.exp() * precision[i];
                x[i] = columns.iter().map(|c| c[i] * c[unknowns]).sum();
            }
            let b = x.clone();
            assert!(cholesky(&mut a, unknowns));
            cholesky_solve(&a, unknowns, &mut x);
            let left =
                y.iter().map(|y| y * y).sum::<f64>() - x.iter().zip(&b).map(|(x, b)| x * b).sum::<f64>();
            let dof = 60.0 - 2.0 + 5.0;
            let sigma2 = (left + 5.0 * 0.09) / dof;
            let log_det: f64 = 2.0 * (0..unknowns).map(|i| a[i * unknowns + i].ln()).sum::<f64>();
            (dof * sigma2.ln() + log_det - 10.0 * log_kappa, sigma2.sqrt(), x)
        };
        let (best, sigma, x) = score(fit.log_kappa);
        assert!((sigma - fit.sigma).abs() < 1e-9, "seed {seed}: {sigma} {}", fit.sigma);
        assert!(x.iter().zip(&fit.weights).all(|(a, b)| (a - b).abs() < 1e-9), "seed {seed}");
        for k in -9..=4 {
            let at = 2.1 * f64::from(k);
            assert!(score(at).0 >= best - 1e-9, "seed {seed}: {at} beats {}", fit.log_kappa);
        }
        // The parabola's peak is next to the likelihood's: a tenth in twice the log likelihood is nothing.
        for k in -40..=40 {
            let at = fit.log_kappa + 0.05 * f64::from(k);
            assert!(score(at).0 >= best - 0.1, "seed {seed}: {at} beats {}", fit.log_kappa);
        }
    }
}

/// A patch of points over a tilted frame, heights `z(x, y)`, domain half axes `radii`.
fn patch(
    n: usize,
    radii: [f64; 2],
    noise: f64,
    seed: u64,
    z: impl Fn(f64, f64) -> f64,
) -> (Vec<Vec3>, Patch) {
    let normal = Vec3([0.36, 0.48, 0.8]);
    let axes = Monge::frame(normal, Vec3([1.0, 0.0, 0.0]));
    let center = Vec3([5.0, -3.0, 2.0]);
    let mut rng = Rng::stream(seed, 1);
    let points: Vec<Vec3> = disk(n, seed)
        .iter()
        .map(|p| {
            let (x, y) = (p[0] * radii[0], p[1] * radii[1]);
            let h = z(x, y) + noise * rng.normal();
            center + axes[0] * x + axes[1] * y + axes[2] * h
        })
        .collect();
    let spacing = (std::f64::consts::PI * radii[0] * radii[1] / n as f64).sqrt();
    let members = (0..n as u32).collect();
    let patch = Patch {
        center,
        axes,
        radii,
        quadric: [0.0; 6],
        members,
        residual: noise,
        spacing,
        sigma: noise,
        of_two: false,
        accepted: true,
    };
    (points, patch)
}

fn fit_chart(points: &[Vec3], patch: &Patch, sigma: f64) -> Vec<Monge> {
    let patch = Patch { sigma, ..patch.clone() };
    let fitted = Run::default().execute(|ctx| crate::fit::fit(points, &[patch], ctx)).unwrap();
    fitted
        .into_iter()
        .map(|f| match f.chart.map {
            Map::Monge(m) => m,
            Map::Tube(_) => panic!("a patch gives a patch"),
        })
        .collect()
}

#[test]
fn a_chart_of_a_sphere_has_the_spheres_curvature_and_normals() {
    let r = 2.0;
    let cap = |x: f64, y: f64| (r * r - x * x - y * y).sqrt() - r;
    // A loose noise figure, as the first weights are about the quadric, which is flat here.
    let (points, mut p) = patch(300, [0.8, 0.6], 1e-5, 1, cap);
    p.quadric = [0.0, 0.0, 0.0, -0.5 * 0.64 / r, 0.0, -0.5 * 0.36 / r];
    let charts = fit_chart(&points, &p, 2e-3);
    assert_eq!(charts.len(), 1);
    let chart = &charts[0];
    // Bends away from the third axis: negative, twice 1 / r. Fifty eigenfunctions ripple about it.
    let k: Vec<f64> = disk(200, 9).iter().map(|p| chart.curvature_sum(0.8 * p[0], 0.8 * p[1])).collect();
    let mean = k.iter().sum::<f64>() / 200.0;
    assert!((mean + 2.0 / r).abs() < 0.08 * 2.0 / r, "curvature sum {mean} on average");
    assert!(k.iter().all(|k| (k + 2.0 / r).abs() < 0.35 * 2.0 / r), "{k:?}");
    let ball = p.center - p.axes[2] * r;
    for (u, v) in [(0.0, 0.0), (0.4, 0.0), (0.0, -0.5), (0.35, 0.35), (-0.3, 0.4)] {
        let HeightNormal { height: h, cos, normal: n } = chart.height_normal(u, v);
        let radial = chart.lift(u, v, h) - ball;
        assert!((radial.norm() - r).abs() < 1e-3, "{}", radial.norm());
        assert!((0..3).map(|k| radial[k] / r * n[k]).sum::<f64>() > 0.999);
        assert!((cos - (0..3).map(|k| n[k] * chart.axes[2][k]).sum::<f64>()).abs() < 1e-9);
        assert!((chart.point(u, v) - chart.lift(u, v, h)).norm() < 1e-12);
        let l = chart.local(chart.lift(u, v, h));
        assert!((l.u - u).abs() < 1e-9 && (l.v - v).abs() < 1e-9 && (l.z - h).abs() < 1e-9);
    }
}

#[test]
fn foot_points_are_the_nearest_points() {
    let wave = |x: f64, y: f64| 0.15 * x * x - 0.1 * y * y + 0.05 * x * y + 0.1 * x;
    let (points, p) = patch(300, [1.0, 0.7], 1e-6, 2, wave);
    let mut rng = Rng::new(5);
    // The first weights are about a zero quadric: all points must stand within four deviations of it.
    let chart = &fit_chart(&points, &p, 0.2)[0];
    for _ in 0..40 {
        let (a, b) = (1.4 * (rng.uniform() - 0.5), 1.4 * (rng.uniform() - 0.5));
        // Off the surface by up to a tenth of the domain.
        let q = BaseCoordinates {
            u: a,
            v: b,
            z: spline::value(&chart.coeffs, a, b) + 0.2 * (rng.uniform() - 0.5),
        };
        let at = chart.lift(q.u, q.v, q.z);
        let (u, v) = chart.foot(q);
        let found = (chart.point(u, v) - at).norm();
        // Brute force on a fine grid about the point.
        let mut least = f64::MAX;
        for i in -100..=100 {
            for j in -100..=100 {
                let (s, t) = (a + f64::from(i) * 0.002, b + f64::from(j) * 0.002);
                least = least.min((chart.point(s, t) - at).norm());
            }
        }
        assert!(found < least * 1.002 + 1e-6, "{found} but {least} is possible");
    }
}

#[test]
fn foot_points_stay_about_the_domain_wherever_the_point_is() {
    let (points, p) = patch(200, [1.0, 0.7], 1e-3, 3, |x, y| 0.1 * x * y);
    let chart = &fit_chart(&points, &p, 0.05)[0];
    for z in [0.0, 1e3, -1e12] {
        for (u, v) in [(0.0, 0.0), (1e3, -1e3), (1e15, 0.0)] {
            let (u, v) = chart.foot(BaseCoordinates { u, v, z });
            assert!(u.hypot(v) <= 1.2 + 1e-9, "{u} {v}");
        }
    }
}

#[test]
fn two_sheets_in_one_patch_give_two_charts_and_one_sheet_one() {
    let noise = 0.01;
    let mut rng = Rng::new(8);
    let side: Vec<f64> = (0..240).map(|_| if rng.uniform() < 0.5 { 0.04 } else { -0.04 }).collect();
    let (mut points, p) = patch(240, [0.5; 2], noise, 4, |x, _| 0.1 * x * x);
    let single = fit_chart(&points, &p, 2.0 * noise);
    assert_eq!(single.len(), 1);
    for (q, s) in points.iter_mut().zip(&side) {
        *q += p.axes[2] * *s;
    }
    let pair = fit_chart(&points, &p, 2.0 * noise);
    assert_eq!(pair.len(), 2);
    let mut heights = [0, 1].map(|k| spline::value(&pair[k].coeffs, 0.0, 0.0));
    heights.sort_by(f64::total_cmp);
    assert!((heights[0] + 0.04).abs() < 0.01 && (heights[1] - 0.04).abs() < 0.01, "{heights:?}");
}

#[test]
fn a_mask_is_full_inside_and_empty_beyond_the_edge_of_the_data() {
    let all = disk(400, 6);
    let half: Vec<[f64; 2]> = all.iter().copied().filter(|p| p[0] < 0.0).collect();
    let spacing = (std::f64::consts::PI / 400.0f64).sqrt();
    let (full, cut) = (Mask::build(&all, [1.0; 2], spacing, 0.0), Mask::build(&half, [1.0; 2], spacing, 0.0));
    for (u, v) in [(0.0, 0.0), (0.5, 0.2), (-0.4, -0.5)] {
        assert!(full.value(u, v) > 0.9, "{}", full.value(u, v));
    }
    assert!(cut.value(-0.5, 0.0) > 0.9 && cut.value(0.5, 0.0) < 0.1);
    let edge = (-6..=6).map(|i| cut.value(0.0, f64::from(i) * 0.1)).sum::<f64>() / 13.0;
    assert!((0.2..0.8).contains(&edge), "{edge} along the edge");
    assert!((0..=20).all(|i| (0.0..=1.0).contains(&full.value(f64::from(i) * 0.3 - 3.0, 0.3))));
    assert!(Mask::build(&[], [1.0; 2], spacing, 0.0).nodes.iter().all(|m| *m == 0), "no data, no surface");
}

#[test]
fn a_mask_ends_at_the_edge_of_a_surface_whose_points_noise_puts_beyond_it() {
    let (n, sigma) = (1600, 0.1);
    let spacing = (std::f64::consts::PI / f64::from(n)).sqrt();
    let masks: Vec<Mask> = (0..8)
        .map(|seed| {
            let mut rng = Rng::new(seed);
            let half = disk(n as usize, seed).into_iter().filter(|p| p[0] < 0.0);
            let noisy: Vec<[f64; 2]> = half.map(|p| p.map(|x| x + sigma * rng.normal())).collect();
            Mask::build(&noisy, [1.0; 2], spacing, sigma)
        })
        .collect();
    let at = |u: f64| {
        let along = (-5..=5).map(|j| masks.iter().map(|m| m.value(u, 0.1 * f64::from(j))).sum::<f64>());
        along.sum::<f64>() / (11 * masks.len()) as f64
    };
    assert!((0.3..0.7).contains(&at(0.0)), "{} at the edge", at(0.0));
    assert!(at(-2.5 * sigma) > 0.9, "{} inside", at(-2.5 * sigma));
    assert!(at(2.5 * sigma) < 0.1, "{} beyond", at(2.5 * sigma));
}
