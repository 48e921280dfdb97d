//! Figures of the laws: kernels and what batch norm does to them, pixels of convolutions, curvature,
//! convergence with width, spectra.

use crate::plot::{Axis, Figure, Legend, Mark, Panel};
use atlasfit::numeric::rng::Rng;
use atlasfit::prior::precisions;
use atlasfit_gp::batch_norm;
use atlasfit_gp::convolution::{Pixels, limit};
use atlasfit_gp::curvature::{Plane, arc_length_deviation, arc_length_draws, normal, plane_draws};
use atlasfit_gp::disk::{Expansion, Resolution};
use atlasfit_gp::kernel::{Kernel, products};
use atlasfit_gp::network::convergence;
use atlasfit_gp::sample::interval;

const DEPTHS: [usize; 4] = [1, 2, 4, 8];
/// Units that batch norm's covariance is averaged over: entries within 2 %.
const UNITS: usize = 3000;
/// Inputs of a batch.
const BATCH: usize = 61;
/// Widths of finite networks, and networks of each.
pub const WIDTHS: [usize; 6] = [8, 16, 32, 64, 128, 256];
pub const NETWORKS: usize = 120;
/// The two inputs whose covariance is followed.
pub const INPUTS: [[f64; 2]; 2] = [[0.6, -0.2], [-0.3, 0.9]];
/// Curvatures of finite networks: how many, how wide, and the curve's parameter.
pub const CURVES: usize = 3000;
pub const WIDTH: usize = 128;
pub const PARAMETER: f64 = 0.4;

/// A covariance of a network's outputs at two inputs.
type Covariance = dyn Fn(&Kernel, &[f64], &[f64]) -> f64;

/// Kernels of the untrained network, of its training, and with batch norm, on an interval.
pub fn kernels(seed: u64) -> Figure {
    const FROM: f64 = 0.25;
    let line = interval(161);
    let panel = |title: &str, of: &Covariance| {
        let marks = (DEPTHS.iter().enumerate())
            .map(|(color, &depth)| {
                let kernel = Kernel::relu(depth).with_bias(0.1);
                let own = |t: &[f64]| of(&kernel, t, t);
                let points = (line.iter())
                    .map(|t| [t[0], of(&kernel, &[FROM], t) / (own(&[FROM]) * own(t)).sqrt()])
                    .collect();
                Mark::line(format!("depth {depth}"), color, points)
            })
            .collect();
        let axes = [Axis::linear("t", [-1.0, 1.0]), Axis::linear("correlation", [-0.1, 1.05])];
        Panel { title: title.into(), axes: Some(axes), legend: Legend::LowerRight, marks }
    };
    let untrained = panel("untrained, with f(0.25)", &|k, x, y| k.at(x, y));
    let tangent = panel("tangent kernel: training", &|k, x, y| k.tangent(products(x, y)));
    let mut rng = Rng::stream(seed, 4);
    let mut marks = Vec::new();
    for (batch, even) in [("even", true), ("uneven", false)] {
        let inputs: Vec<Vec<f64>> = (0..BATCH)
            .map(|i| i as f64 / (BATCH - 1) as f64)
            .map(|t| vec![2.0 * if even { t } else { t * t * t } - 1.0])
            .collect();
        let middle = inputs.partition_point(|x| x[0] < FROM);
        for depth in [1, 3] {
            let kernel = Kernel::relu(depth).with_bias(0.1);
            let k = batch_norm::covariance(&kernel, &inputs, UNITS, &mut rng);
            let points = (0..BATCH)
                .map(|i| [inputs[i][0], k[(i, middle)] / (k[(i, i)] * k[(middle, middle)]).sqrt()])
                .collect();
            let mark = if even { Mark::line } else { Mark::dashed };
            marks.push(mark(format!("{batch} samples, depth {depth}"), depth / 2, points));
        }
    }
    let axes = [Axis::linear("t", [-1.0, 1.0]), Axis::linear("correlation", [-1.05, 1.05])];
    let normed = Panel {
        title: "batch norm: the samples decide".into(),
        axes: Some(axes),
        legend: Legend::LowerRight,
        marks,
    };
    let title = "Covariance of wide ReLU networks from one input on an interval (biases of variance 0.1)";
    Figure { title, rows: vec![vec![untrained, tangent, normed]], row: [1360, 430] }
}

/// Correlations of the pixels of convolutional networks.
pub fn convolution(_seed: u64) -> Figure {
    let pictures: Vec<Pixels> = (1..=3).map(|blocks| limit(4, blocks)).collect();
    let line = |picture: &Pixels, from: usize| {
        let m = picture.side / 2;
        (0..picture.side).map(|j| [j as f64 - from as f64, picture.correlation([m, from], [m, j])]).collect()
    };
    let by_blocks = (pictures.iter().enumerate())
        .map(|(color, p)| {
            Mark::line(format!("{} blocks, {1} x {1}", color + 1, p.side), color, line(p, p.side / 2))
        })
        .collect();
    let last = &pictures[2];
    let by_place = [(0, 2), (1, 9), (2, 16), (3, 17)]
        .map(|(color, from)| Mark::line(format!("from column {from}"), color, line(last, from)))
        .into();
    let panel = |title: &str, reach: f64, marks| {
        let axes =
            [Axis::linear("columns apart", [-reach, reach]), Axis::linear("correlation", [-0.05, 1.05])];
        Panel { title: title.into(), axes: Some(axes), legend: Legend::UpperRight, marks }
    };
    let rows = vec![vec![
        panel("from the middle, by blocks", 16.0, by_blocks),
        panel("three blocks, from several columns: nearly the same", 16.0, by_place),
    ]];
    let title = "Convolutional networks of many channels on white noise: correlation along the middle line";
    Figure { title, rows, row: [1360, 430] }
}

/// Curvature by arc length and by coordinates.
pub fn curvature(seed: u64) -> Figure {
    let mut rng = Rng::stream(seed, 5);
    let kernel = Kernel::erf(2);
    let deviation = arc_length_deviation(&kernel, PARAMETER);
    let draws = arc_length_draws(kernel, PARAMETER, WIDTH, CURVES, &mut rng);
    let cut = 4.0 * deviation;
    let bins = 32;
    let width = 2.0 * cut / f64::from(bins);
    let density = |at: f64| {
        let inside = draws.iter().filter(|k| (**k - at).abs() < 0.5 * width).count();
        inside as f64 / (width * CURVES as f64)
    };
    let histogram = (0..bins).map(|i| -cut + (f64::from(i) + 0.5) * width).map(|k| [k, density(k)]).collect();
    let gauss = (0..=200)
        .map(|i| cut * (f64::from(i) / 100.0 - 1.0))
        .map(|k| [k, (normal(deviation, k + 1e-4) - normal(deviation, k - 1e-4)) / 2e-4])
        .collect();
    let axes = [Axis::linear("curvature", [-cut, cut]), Axis::linear("density", [0.0, 0.55 / deviation])];
    let marks = vec![
        Mark::dots(format!("{CURVES} networks of {WIDTH} units"), 1, histogram),
        Mark::line("limit: normal", 0, gauss),
    ];
    let arc =
        Panel { title: "arc length: Gaussian".into(), axes: Some(axes), legend: Legend::UpperRight, marks };
    let mut marks = Vec::new();
    if let Some(plane) = Plane::new(&kernel, PARAMETER) {
        let exact = (0..=120).map(|i| -2.0 + f64::from(i) / 24.0).map(|x| {
            let k = 10f64.powf(x);
            [x, plane.exceeds(k * plane.scale).log10()]
        });
        marks.push(Mark::line("limit: 1 - exp(q^2) erfc(q)", 0, exact.collect()));
        let mut sizes: Vec<f64> = plane_draws(kernel, PARAMETER, WIDTH, CURVES, &mut rng)
            .iter()
            .map(|k| (k.abs() / plane.scale).log10())
            .collect();
        sizes.sort_by(|a, b| b.total_cmp(a));
        let dots = (1..40).map(|i| (CURVES as f64).powf(f64::from(i) / 40.0) as usize);
        let dots = dots.map(|rank| [sizes[rank], ((rank + 1) as f64 / CURVES as f64).log10()]);
        marks.push(Mark::dots(format!("{CURVES} networks of {WIDTH} units"), 1, dots.collect()));
        marks.push(Mark::dashed("1 / k", 6, vec![[0.5, -0.6], [3.0, -3.1]]));
    }
    let axes = [
        Axis::logarithmic("curvature k over its scale", [-2.0, 3.0]),
        Axis::logarithmic("chance of more than k", [-3.5, 0.1]),
    ];
    let plane = Panel {
        title: "coordinates: a tail of 1 / k, no mean".into(),
        axes: Some(axes),
        legend: Legend::UpperRight,
        marks,
    };
    let title = "Curvature of random curves (error function, two hidden layers)";
    Figure { title, rows: vec![vec![arc, plane]], row: [1360, 450] }
}

/// How fast finite networks' covariance nears the limit's.
pub fn width(seed: u64) -> Figure {
    let mut rng = Rng::stream(seed, 6);
    let mut marks = Vec::new();
    for (color, depth) in [1, 2, 4].into_iter().enumerate() {
        let found =
            convergence(Kernel::relu(depth), INPUTS.each_ref().map(|x| &x[..]), &WIDTHS, NETWORKS, &mut rng);
        let points = found.iter().map(|c| [(c.width as f64).log10(), c.spread.log10()]).collect();
        marks.push(Mark::line(format!("depth {depth}"), color, points));
    }
    marks.push(Mark::dashed("1 / sqrt(width)", 6, vec![[0.9, -0.3], [2.5, -1.1]]));
    let axes = [
        Axis::logarithmic("units per hidden layer", [0.8, 2.6]),
        Axis::logarithmic("relative error of the covariance", [-1.6, 0.4]),
    ];
    let panel = Panel {
        title: "root mean square over random networks".into(),
        axes: Some(axes),
        legend: Legend::UpperRight,
        marks,
    };
    let title = "Covariance of one network's outputs, hidden layers given";
    Figure { title, rows: vec![vec![panel]], row: [760, 480] }
}

/// Eigenvalues on the disk by depth, the tangent kernel's and the default prior's.
pub fn spectrum(_seed: u64) -> Figure {
    let mut marks = Vec::new();
    let curve = |values: &[f64]| {
        (1..=300)
            .filter(|n| *n <= values.len())
            .map(|n| [(n as f64).log10(), (values[n - 1] / values[0]).log10()])
            .collect::<Vec<_>>()
    };
    for (color, depth) in [1, 2, 3].into_iter().enumerate() {
        let kernel = Kernel::relu(depth);
        let values = Expansion::new(|p| kernel.covariance(p).ab, Resolution::default()).values();
        marks.push(Mark::line(format!("untrained, depth {depth}"), color, curve(&values)));
    }
    let kernel = Kernel::relu(2);
    let values = Expansion::new(|p| kernel.tangent(p), Resolution::default()).values();
    marks.push(Mark::line("tangent kernel, depth 2", 3, curve(&values)));
    let first = precisions().iter().position(|p| *p > 0.0).unwrap_or(0);
    let ours: Vec<[f64; 2]> = (precisions().iter().enumerate().skip(first))
        .map(|(n, p)| [((n + 1) as f64).log10(), (1e-3 * precisions()[first] / p).log10()])
        .collect();
    marks.push(Mark::dots("default prior (its scale is chosen by the data)", 4, ours));
    marks.push(Mark::dashed("n^-5/2", 6, vec![[1.2, -3.6], [2.4, -6.6]]));
    marks.push(Mark::dashed("n^-3/2", 3, vec![[1.2, -1.9], [2.4, -3.7]]));
    let axes = [
        Axis::logarithmic("number of the eigenvalue", [0.0, 2.6]),
        Axis::logarithmic("over the first", [-8.0, 0.3]),
    ];
    let panel = Panel {
        title: "order 5/2 at every depth; 3/2 where trained".into(),
        axes: Some(axes),
        legend: Legend::UpperRight,
        marks,
    };
    let title = "Eigenvalues of ReLU kernels on the unit disk";
    Figure { title, rows: vec![vec![panel]], row: [860, 560] }
}
