//! The network against the paper's formulas in f64, and its gradients against finite differences.

use super::layers::IN;
use super::*;
use atlasfit::run::Run;

const fn shift(l: usize) -> Range<usize> {
    OFFSETS[l].s..OFFSETS[l].s + FAN[l][1]
}

/// The network as the paper states it, in f64, without folding.
fn plain(params: &[f64], inputs: &[[f32; 3]]) -> Vec<[f64; 3]> {
    let mut h: Vec<Vec<f64>> =
        inputs.iter().map(|x| x.iter().map(|&x| f64::from(x)).chain([0.0]).collect()).collect();
    let n = h.len();
    for l in 0..LAYERS {
        let [inputs, outputs] = FAN[l];
        let (w, b) = (&params[weights(l)], &params[bias(l)]);
        for row in &mut h {
            *row = (0..outputs)
                .map(|k| b[k] + (0..inputs).map(|j| row[j] * w[j * outputs + k]).sum::<f64>())
                .map(|z| if l + 1 < LAYERS { z.max(0.0) } else { z.tanh() })
                .collect();
        }
        if l + 1 == LAYERS {
            break;
        }
        for k in 0..outputs {
            let mean = h.iter().map(|r| r[k]).sum::<f64>() / n as f64;
            let variance = h.iter().map(|r| (r[k] - mean).powi(2)).sum::<f64>() / n as f64;
            for r in &mut h {
                r[k] = (r[k] - mean) / (variance + EPS).sqrt() * params[OFFSETS[l].g + k]
                    + params[OFFSETS[l].s + k];
            }
        }
    }
    h.iter().map(|r| [r[0], r[1], r[2]]).collect()
}

fn samples(net: &Dense) -> Vec<[f32; 3]> {
    match &net.inputs {
        Inputs::Scattered(rows) => rows.chunks_exact(IN).map(|x| [x[0], x[1], x[2]]).collect(),
        Inputs::Grid(grid) => (0..net.inputs.rows()).map(|i| grid.input(i)).collect(),
    }
}

/// The shape of a network and its batch.
#[derive(Debug, Clone)]
struct Case {
    /// One number: scattered samples. Two: the lines of a grid, and samples per line.
    size: Vec<usize>,
    inputs: usize,
    outputs: usize,
}

/// A network that went forward and backward once.
struct Tried {
    net: Dense,
    out: Vec<Sample>,
    /// The gradient with respect to the outputs.
    functional: Vec<Sample>,
}

/// A network away from its start (gains and shifts too), its outputs and its gradients for a random linear
/// functional.
fn tried(case: &Case) -> Tried {
    let mut rng = Rng::new(11);
    let Case { size, inputs: used, outputs } = case.clone();
    let batch = size.iter().product();
    let mut net = Dense::new(used, outputs, &mut rng);
    for l in 0..LAYERS - 1 {
        for i in gain(l).chain(shift(l)) {
            net.params[i] += 0.2 * rng.normal() as f32;
        }
    }
    let mut random = || [0; 3].map(|_| rng.normal() as f32);
    let functional: Vec<Sample> = (0..batch).map(|_| random()).collect();
    if let &[lines, side] = &size[..] {
        let step = [0.9 / lines as f32, 0.8 / side as f32];
        net.set_grid(Grid { size: [lines, side], first: [0.013, 0.027], step });
    } else {
        let inputs: Vec<[f32; 3]> = (0..batch)
            .map(|_| random())
            .map(|x| [0, 1, 2].map(|k| if k < used { x[k] } else { 0.0 }))
            .collect();
        Run::default().execute(|ctx| net.set_inputs(&inputs, ctx)).unwrap();
    }
    let mut out = vec![[0.0; 3]; batch];
    let net = Run::default()
        .execute(|ctx| {
            net.forward(&mut out, ctx)?;
            net.backward(&functional, ctx)?;
            Ok(net)
        })
        .unwrap();
    Tried { net, out, functional }
}

/// Batches of less than a block, of several with a last one that is not full, and of several bands; curves,
/// surfaces, fields.
fn cases() -> Vec<Case> {
    [
        (vec![42], 2, 3),
        (vec![30], 1, 2),
        (vec![306], 3, 1),
        (vec![6, 7], 2, 3),
        (vec![17, 18], 2, 3),
        (vec![1, 600], 1, 2),
        (vec![2304], 2, 3),
        (vec![43, 61], 2, 3),
        (vec![1, 4500], 1, 3),
    ]
    .map(|(size, inputs, outputs)| Case { size, inputs, outputs })
    .to_vec()
}

#[test]
fn the_folded_network_is_the_plain_one() {
    for shape in cases() {
        let Tried { net, out, .. } = tried(&shape);
        let params: Vec<f64> = net.params.iter().map(|&x| f64::from(x)).collect();
        let inputs = samples(&net);
        let alone = Run::default().execute(|ctx| net.evaluate(&inputs, ctx)).unwrap();
        for ((a, b), c) in out.iter().zip(plain(&params, &inputs)).zip(alone) {
            for k in 0..3 {
                assert!((f64::from(a[k]) - b[k]).abs() < 1e-4, "{shape:?} {a:?} {b:?}");
                assert!((a[k] - c[k]).abs() < 1e-4);
                assert!(k < shape.outputs || a[k] == 0.0);
            }
        }
    }
}

#[test]
fn gradients_are_finite_differences_of_the_plain_network() {
    for shape in &cases()[..6] {
        let Tried { net, functional, .. } = tried(shape);
        let params: Vec<f64> = net.params.iter().map(|&x| f64::from(x)).collect();
        let value = |params: &[f64]| -> f64 {
            plain(params, &samples(&net))
                .iter()
                .zip(&functional)
                .map(|(y, c)| (0..shape.outputs).map(|k| y[k] * f64::from(c[k])).sum::<f64>())
                .sum()
        };
        let mut rng = Rng::new(2);
        let tensors = (0..LAYERS).flat_map(|l| {
            [weights(l), bias(l)]
                .into_iter()
                .chain((l + 1 < LAYERS).then(|| [gain(l), shift(l)]).into_iter().flatten())
        });
        for range in tensors {
            // A random direction of the whole tensor. Biases before ReLU and batch norm included.
            let direction: Vec<f64> = range.clone().map(|_| rng.normal()).collect();
            let at = |h: f64| {
                let mut moved = params.clone();
                for (x, d) in moved[range.clone()].iter_mut().zip(&direction) {
                    *x += h * d;
                }
                value(&moved)
            };
            let h = 1e-8; // no unit of ReLU may change sides
            let expected = (at(h) - at(-h)) / (2.0 * h);
            let got: f64 =
                net.grads[range.clone()].iter().zip(&direction).map(|(g, d)| f64::from(*g) * d).sum();
            let size: f64 =
                net.grads[range.clone()].iter().map(|g| f64::from(*g).powi(2)).sum::<f64>().sqrt();
            assert!(
                (got - expected).abs() < 2e-3 * size + 1e-4,
                "{shape:?} {range:?}: {got} {expected} {size}"
            );
        }
    }
}

#[test]
fn padding_stays_zero_and_adam_goes_downhill() {
    let Tried { mut net, functional, .. } = tried(&Case { size: vec![42], inputs: 1, outputs: 2 });
    let value = |out: &[Sample]| -> f32 {
        out.iter().zip(&functional).flat_map(|(y, c)| (0..2).map(|k| y[k] * c[k])).sum()
    };
    let mut out = vec![[0.0; 3]; 42];
    let values: Vec<f32> = Run::default()
        .execute(|ctx| {
            (0..5)
                .map(|_| {
                    net.forward(&mut out, ctx)?;
                    net.backward(&functional, ctx)?;
                    net.step(1e-3, ctx)?;
                    Ok(value(&out))
                })
                .collect()
        })
        .unwrap();
    assert!(values.windows(2).all(|v| v[1] < v[0]), "{values:?}");
    assert!(net.params[weights(LAYERS - 1)].chunks(OUT).all(|row| row[2..].iter().all(|x| *x == 0.0)));
    assert!(net.params[weights(0)][FAN[0][1]..].iter().all(|x| *x == 0.0));
}
