//! Figures of what the prior looks like: covariance, curves and surfaces by depth; the same from finite
//! networks; level sets.

use crate::plot::{Axis, Figure, Legend, Mark, Panel, Shape};
use atlasfit::numeric::rng::Rng;
use atlasfit_gp::kernel::Kernel;
use atlasfit_gp::network::Network;
use atlasfit_gp::sample::{Draws, arc_length_curve, curve, interval, square, surface};

/// Hidden layers that are drawn.
const DEPTHS: [usize; 4] = [1, 2, 4, 8];
/// Places along a curve, and along a surface's side.
const PLACES: [usize; 2] = [241, 31];
/// Variance of the biases of curves and surfaces: places and directions then both count.
const BIAS: f64 = 0.1;
/// The angle of a curve by arc length is drawn with this factor, so that curves turn.
const TURNS: f64 = 3.0;

/// The paper's figure of the prior.
pub fn prior(seed: u64) -> Figure {
    let mut rng = Rng::stream(seed, 1);
    let mut rows = vec![vec![correlation(0.01, true), correlation(0.01, false)]];
    let line = interval(PLACES[0]);
    let grid = square(PLACES[1]);
    let [mut curves, mut lengths, mut surfaces] = [vec![], vec![], vec![]];
    for depth in DEPTHS {
        let kernel = Kernel::relu(depth).with_bias(BIAS);
        let draws = Draws::of(&kernel, &line);
        curves.push(bundle(format!("coordinates, depth {depth}"), || curve(&draws, &mut rng)));
        let turning: Vec<Vec<f64>> = line.iter().map(|t| vec![TURNS * t[0]]).collect();
        let draws = Draws::of(&kernel, &turning);
        lengths.push(bundle(format!("arc length, depth {depth}"), || arc_length_curve(&draws, &mut rng)));
        let points = surface(&Draws::of(&kernel, &grid), &mut rng);
        surfaces.push(sheet(format!("surface, depth {depth}"), &points));
    }
    rows.extend([curves, lengths, surfaces]);
    let title =
        "The limit of ReLU networks without batch norm: covariance, random curves and surfaces by depth";
    Figure { title, rows, row: [1360, 330] }
}

/// Correlation of f(0) and f(t) by depth; or, about each function's own mean, of f(0) and f(t).
fn correlation(bias: f64, plain: bool) -> Panel {
    let line = interval(201);
    let marks = (DEPTHS.iter().enumerate())
        .map(|(color, &depth)| {
            let kernel = Kernel::relu(depth).with_bias(bias * bias);
            let points = if plain {
                line.iter().map(|t| [t[0], kernel.correlation(&[0.0], t)]).collect()
            } else {
                centred(&kernel, &line)
            };
            Mark::line(format!("depth {depth}"), color, points)
        })
        .collect();
    let (title, label) = if plain {
        ("correlation of f(0) and f(t), biases 0.01: slower with depth", "cos psi(0, t)")
    } else {
        ("the same of f less its mean over the interval", "correlation")
    };
    let least = if plain { -0.05 } else { -1.05 };
    let axes = Some([Axis::linear("t", [-1.0, 1.0]), Axis::linear(label, [least, 1.05])]);
    Panel { title: title.into(), axes, legend: Legend::UpperRight, marks }
}

/// Correlation with the middle of draws less their mean.
fn centred(kernel: &Kernel, line: &[Vec<f64>]) -> Vec<[f64; 2]> {
    let k = atlasfit_gp::sample::matrix(kernel, line);
    let n = line.len();
    let rows: Vec<f64> = (0..n).map(|i| k.row(i).mean()).collect();
    let all = rows.iter().sum::<f64>() / n as f64;
    let of = |i: usize, j: usize| k[(i, j)] - rows[i] - rows[j] + all;
    let m = n / 2;
    (0..n).map(|i| [line[i][0], of(i, m) / (of(i, i) * of(m, m)).sqrt()]).collect()
}

/// Three curves in a panel.
fn bundle(title: String, mut draw: impl FnMut() -> Vec<[f64; 2]>) -> Panel {
    let marks = (0..3)
        .map(|color| {
            let points = draw();
            // About the middle of its ends, so that three lie in one panel.
            let middle = points[points.len() / 2];
            let moved = points.iter().map(|p| [p[0] - middle[0], p[1] - middle[1]]).collect();
            Mark::line("", color, moved)
        })
        .collect();
    Panel { title, axes: None, legend: Legend::UpperRight, marks }
}

/// A surface over a square grid, lit from the viewer, seen along its own least direction turned a little.
fn sheet(title: String, points: &[[f64; 3]]) -> Panel {
    let side = points.len().isqrt();
    let view = |p: &[f64; 3]| {
        let [c, s] = [0.8, 0.6];
        let [x, y, z] = [p[0], c * p[1] - s * p[2], s * p[1] + c * p[2]];
        [0.8 * x + 0.6 * z, y, 0.8 * z - 0.6 * x]
    };
    let seen: Vec<[f64; 3]> = points.iter().map(view).collect();
    let mut faces: Vec<(f64, [[f64; 2]; 4], f64)> = (0..side - 1)
        .flat_map(|i| (0..side - 1).map(move |j| (i, j)))
        .map(|(i, j)| {
            let corners = [i * side + j, i * side + j + 1, (i + 1) * side + j + 1, (i + 1) * side + j];
            let [a, b, c, d] = corners.map(|k| seen[k]);
            let u: [f64; 3] = std::array::from_fn(|k| c[k] - a[k]);
            let v: [f64; 3] = std::array::from_fn(|k| d[k] - b[k]);
            let n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
            let length = n.iter().map(|x| x * x).sum::<f64>().sqrt().max(1e-12);
            let light = (n[2] / length).abs().mul_add(0.9, 0.45 * (n[1] / length).abs());
            let depth = (a[2] + b[2] + c[2] + d[2]) / 4.0;
            (depth, [a, b, c, d].map(|p| [p[0], p[1]]), 0.35 + light)
        })
        .collect();
    faces.sort_by(|a, b| a.0.total_cmp(&b.0));
    let shape = Shape::Faces(faces.into_iter().map(|(_, corners, bright)| (corners, bright)).collect());
    Panel {
        title,
        axes: None,
        legend: Legend::UpperRight,
        marks: vec![Mark { label: String::new(), color: 5, shape }],
    }
}

/// The same curves and surfaces by finite networks.
pub fn networks(seed: u64) -> Figure {
    const DEPTH: usize = 3;
    let mut rng = Rng::stream(seed, 2);
    let kernel = Kernel::relu(DEPTH).with_bias(BIAS);
    let (line, grid) = (interval(PLACES[0]), square(PLACES[1]));
    let [mut curves, mut surfaces] = [vec![], vec![]];
    for width in [8, 32, 128] {
        curves.push(bundle(format!("curves, {width} units a layer"), || {
            let net = Network::draw(kernel, 1, width, 2, &mut rng);
            line.iter().map(|t| net.at(t)).map(|y| [y[0], y[1]]).collect()
        }));
        let net = Network::draw(kernel, 2, width, 3, &mut rng);
        let points: Vec<[f64; 3]> = grid.iter().map(|t| net.at(t)).map(|y| [y[0], y[1], y[2]]).collect();
        surfaces.push(sheet(format!("surface, {width} units a layer"), &points));
    }
    let draws = Draws::of(&kernel, &line);
    curves.push(bundle("curves, the limit".into(), || curve(&draws, &mut rng)));
    surfaces.push(sheet("surface, the limit".into(), &surface(&Draws::of(&kernel, &grid), &mut rng)));
    let title = "Random ReLU networks of three hidden layers beside their limit";
    Figure { title, rows: vec![curves, surfaces], row: [1360, 340] }
}

/// Zero sets of random fields on a plane through space, and how far their normals agree.
pub fn level_sets(seed: u64) -> Figure {
    const SIDE: usize = 33;
    let mut rng = Rng::stream(seed, 3);
    let plane: Vec<Vec<f64>> = square(SIDE).into_iter().map(|p| vec![p[0], p[1], 0.0]).collect();
    let place = |steps: f64| 2.0 * steps / (SIDE - 1) as f64 - 1.0;
    let mut panels: Vec<Panel> = [1, 4]
        .map(|depth| {
            let field = Draws::of(&Kernel::relu(depth).with_bias(BIAS), &plane).draw(&mut rng);
            let (mean, spread) = (field.mean(), field.variance().sqrt());
            let mut marks = Vec::new();
            for (color, level) in [(0, 0.0), (5, 0.4), (5, -0.4)] {
                let value = |i: usize, j: usize| field[i * SIDE + j] - mean - level * spread;
                for [a, b] in contour(SIDE, value) {
                    marks.push(Mark::line("", color, [a, b].map(|p| p.map(place)).to_vec()));
                }
            }
            let axes = Some([Axis::linear("x", [-1.0, 1.0]), Axis::linear("y", [-1.0, 1.0])]);
            Panel {
                title: format!("levels about the mean, depth {depth}"),
                axes,
                legend: Legend::UpperRight,
                marks,
            }
        })
        .into();
    let marks = (DEPTHS.iter().enumerate())
        .map(|(color, &depth)| {
            let kernel = Kernel::relu(depth).with_bias(BIAS);
            let x = [0.0, 0.0, 0.0];
            let at = |d: f64| kernel.gradient(&x, &[0.0, 1.0, 0.0], &[d, 0.0, 0.0], &[0.0, 1.0, 0.0]);
            let points = (0..120).map(|i| f64::from(i) / 80.0).map(|d| [d, at(d) / at(0.0)]).collect();
            Mark::line(format!("depth {depth}"), color, points)
        })
        .collect();
    let axes =
        Some([Axis::linear("distance", [0.0, 1.5]), Axis::linear("correlation of slopes", [0.0, 1.05])]);
    panels.push(Panel {
        title: "the gradient field, beside the step".into(),
        axes,
        legend: Legend::UpperRight,
        marks,
    });
    let title = "Level sets f(x) = c of random ReLU networks in space, and their normals";
    Figure { title, rows: vec![panels], row: [1360, 430] }
}

/// The pieces of a zero set between the places of a square grid (marching squares), in steps of the grid.
fn contour(side: usize, value: impl Fn(usize, usize) -> f64) -> Vec<[[f64; 2]; 2]> {
    let mut pieces = Vec::new();
    for i in 0..side - 1 {
        for j in 0..side - 1 {
            // Two triangles, each crossed by one piece at most.
            let [a, b, c, d] = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
            for corners in [[a, b, c], [a, c, d]] {
                let crossed: Vec<[f64; 2]> = (0..3)
                    .filter_map(|k| {
                        let (p, q) = (corners[k], corners[(k + 1) % 3]);
                        let (f, g) = (value(p.0, p.1), value(q.0, q.1));
                        let t = f / (f - g);
                        ((f < 0.0) != (g < 0.0)).then(|| {
                            let between = |p: usize, q: usize| p as f64 + t * (q as f64 - p as f64);
                            [between(p.0, q.0), between(p.1, q.1)]
                        })
                    })
                    .collect();
                if let [p, q] = crossed[..] {
                    pieces.push([p, q]);
                }
            }
        }
    }
    pieces
}
