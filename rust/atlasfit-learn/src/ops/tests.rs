use super::*;
use atlasfit::numeric::rng::Rng;
use candle_core::Var;

fn random(shape: &[usize], seed: u64) -> Var {
    let mut rng = Rng::new(seed);
    let values: Vec<f32> = (0..shape.iter().product()).map(|_| rng.normal() as f32 + 0.5).collect();
    Var::from_tensor(&Tensor::from_vec(values, shape, &Device::Cpu).unwrap()).unwrap()
}

fn plain(t: &Tensor) -> Vec<f32> {
    t.flatten_all().unwrap().to_vec1().unwrap()
}

fn near(a: &Tensor, b: &Tensor, what: &str) {
    within(1e-4, a, b, what);
}

/// Whether all numbers agree within a share of the largest one.
fn within(share: f32, a: &Tensor, b: &Tensor, what: &str) {
    assert_eq!(a.dims(), b.dims(), "{what}");
    let (a, b) = (plain(a), plain(b));
    let size = b.iter().fold(1.0f32, |size, x| size.max(x.abs()));
    let off = a.iter().zip(&b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(off < share * size, "{what} is {off} off, of {size}");
}

/// Values and gradients of two ways to compute the same from the same variables.
fn same(vars: &[&Var], one: &Tensor, other: &Tensor, what: &str) {
    near(one, other, what);
    let pull = random(one.dims(), 99);
    let back = |y: &Tensor| (y * pull.as_tensor()).unwrap().sum_all().unwrap().backward().unwrap();
    let (a, b) = (back(one), back(other));
    for (i, var) in vars.iter().enumerate() {
        near(a.get(var).unwrap(), b.get(var).unwrap(), &format!("{what}, gradient {i}"));
    }
}

/// Compares the gradients of a function with its changes along random directions.
fn differences(vars: &[&Var], f: impl Fn() -> Tensor, what: &str) {
    let pull = random(f().dims(), 98);
    // Summed in f64, so that rounding spoils only what the operation itself rounds.
    let value =
        || -> f64 { plain(&f()).iter().zip(plain(&pull)).map(|(y, p)| f64::from(*y) * f64::from(p)).sum() };
    let gradients = (f() * pull.as_tensor()).unwrap().sum_all().unwrap().backward().unwrap();
    for (i, var) in vars.iter().enumerate() {
        let (before, along) = (var.as_tensor().copy().unwrap(), random(var.dims(), 97));
        let size = plain(&along).iter().map(|x| x * x).sum::<f32>().sqrt();
        let h = 1e-2 / f64::from(size);
        let at = |h: f64| {
            var.set(&(&before + (along.as_tensor() * h).unwrap()).unwrap()).unwrap();
            value()
        };
        let change = (at(h) - at(-h)) / (2.0 * h);
        var.set(&before).unwrap();
        let slope: f64 = plain(gradients.get(var).unwrap())
            .iter()
            .zip(plain(&along))
            .map(|(g, x)| f64::from(*g) * f64::from(x))
            .sum();
        let scale = plain(gradients.get(var).unwrap()).iter().map(|g| g * g).sum::<f32>().sqrt() * size;
        assert!((change - slope).abs() < 2e-3 * f64::from(scale), "{what}, variable {i}: {change}, {slope}");
    }
}

#[test]
fn gradients_of_fused_operations_are_those_of_finite_differences() {
    let (x, bias) = (random(&[2, 600, 3], 1), random(&[2, 1, 3], 2));
    differences(&[&x, &bias], || bias_tanh(&x, &bias).unwrap(), "bias and tangent");
    let (gain, shift) = (random(&[2, 4], 3), random(&[2, 4], 4));
    let (a, b) = (random(&[2, 3, 4], 1), random(&[2, 5, 4], 2));
    let all = || outer_norm([&a, &b], &gain, &shift, 1.0, None).unwrap().0;
    differences(&[&a, &b, &gain, &shift], all, "norm of outer sums");
    let (x, y) = (random(&[3, 5], 1), random(&[3, 5], 2));
    differences(&[&x, &y], || add_relu(&x, &y).unwrap(), "ReLU of a sum");
    // Several blocks of pictures, two groups, outputs that fill no panel.
    for (window, channels, outputs) in [
        (Window { side: 3, stride: 1 }, 4, 5),
        (Window { side: 3, stride: 2 }, 16, 18),
        (Window { side: 1, stride: 2 }, 3, 20),
    ] {
        let x = random(&[6, 11, 12, channels], 1);
        let w = random(&[2, window.side * window.side * channels, outputs], 2);
        differences(&[&x, &w], || conv(&x, &w, window).unwrap(), &format!("{window:?}"));
    }
}

#[test]
fn convolutions_of_groups_are_products_of_their_windows() {
    for (window, side) in [(Window { side: 3, stride: 1 }, 40), (Window { side: 3, stride: 2 }, 9)] {
        let (x, w) = (random(&[6, side, side + 3, 3], 1), random(&[2, 27, 19], 2));
        let seen = unfold::composed(&x, window).unwrap().reshape((2, (), 27)).unwrap();
        same(&[&x, &w], &conv(&x, &w, window).unwrap(), &seen.matmul(&w).unwrap(), &format!("{window:?}"));
    }
}

#[test]
fn a_convolution_by_unfolding_is_candles() {
    for window in
        [Window { side: 3, stride: 1 }, Window { side: 7, stride: 2 }, Window { side: 1, stride: 2 }]
    {
        let (x, w) = (random(&[2, 10, 8, 3], 1), random(&[window.side * window.side * 3, 5], 2));
        let [rows, columns] = [10, 8].map(|n| window.along(n));
        let ours = conv(&x, &w.unsqueeze(0).unwrap(), window).unwrap();
        let ours = ours.reshape((2, rows, columns, 5)).unwrap();
        let kernel = w.reshape((window.side, window.side, 3, 5)).unwrap().permute((3, 2, 0, 1)).unwrap();
        let picture = x.permute((0, 3, 1, 2)).unwrap().contiguous().unwrap();
        let theirs =
            picture.conv2d(&kernel.contiguous().unwrap(), window.side / 2, window.stride, 1, 1).unwrap();
        same(&[&x, &w], &ours, &theirs.permute((0, 2, 3, 1)).unwrap(), &format!("{window:?}"));
    }
}

#[test]
fn batch_norm_is_candles_and_its_gradients_too() {
    use candle_nn::{BatchNormConfig, ModuleT, VarBuilder, VarMap};
    let (x, gain, shift) = (random(&[1, 700, 5], 1), random(&[1, 5], 2), random(&[1, 5], 3));
    let map = VarMap::new();
    let norm = candle_nn::batch_norm(
        5,
        BatchNormConfig::default(),
        VarBuilder::from_varmap(&map, candle_core::DType::F32, &Device::Cpu),
    )
    .unwrap();
    for (name, var) in map.data().lock().unwrap().iter() {
        match name.as_str() {
            "weight" => var.set(&gain.flatten_all().unwrap()).unwrap(),
            "bias" => var.set(&shift.flatten_all().unwrap()).unwrap(),
            _ => {}
        }
    }
    let theirs = norm.forward_t(&x.squeeze(0).unwrap(), true).unwrap().unsqueeze(0).unwrap();
    let (ours, moments) = norm_activate(&x, &gain, &shift, 1.0, None).unwrap();
    near(&ours, &theirs, "batch norm");
    let mean = x.mean(1).unwrap();
    near(&moments.get(0).unwrap(), &mean, "the mean");
}

#[test]
fn fused_operations_are_those_composed_of_candles() {
    let (x, gain, shift) = (random(&[3, 600, 4], 1), random(&[3, 4], 2), random(&[3, 4], 3));
    for slope in [0.0, 0.2, 1.0] {
        let (fused, _) = norm_activate(&x, &gain, &shift, slope, None).unwrap();
        let (composed, _) = norm::composed(&x, &gain, &shift, slope, None).unwrap();
        same(&[&x, &gain, &shift], &fused, &composed, &format!("norm with slope {slope}"));
    }
    let (a, b) = (random(&[2, 3, 4], 1), random(&[2, 5, 4], 2));
    let composed = a.unsqueeze(2).unwrap().broadcast_add(&b.unsqueeze(1).unwrap()).unwrap();
    same(&[&a, &b], &outer_add(&a, &b).unwrap(), &composed, "the outer sum");
    let (gain, shift) = (random(&[2, 4], 3), random(&[2, 4], 4));
    let sums = composed.reshape((2, 15, 4)).unwrap();
    let given = Tensor::stack(&[gain.as_tensor(), &gain.sqr().unwrap()], 0).unwrap().detach();
    for (slope, given) in [(0.0, None), (0.2, Some(&given))] {
        let (ours, m) = outer_norm([&a, &b], &gain, &shift, slope, given).unwrap();
        let (theirs, n) = norm::composed(&sums, &gain, &shift, slope, given).unwrap();
        same(&[&a, &b, &gain, &shift], &ours, &theirs, &format!("norm of outer sums, slope {slope}"));
        near(&m, &n, "moments of outer sums");
    }
    let (x, bias) = (random(&[2, 600, 3], 1), random(&[2, 1, 3], 2));
    let composed = x.broadcast_add(&bias).unwrap().tanh().unwrap();
    same(&[&x, &bias], &bias_tanh(&x, &bias).unwrap(), &composed, "bias and tangent");
    let (x, y) = (random(&[3, 5], 1), random(&[3, 5], 2));
    let composed = (x.as_tensor() + y.as_tensor()).unwrap().relu().unwrap();
    same(&[&x, &y], &add_relu(&x, &y).unwrap(), &composed, "ReLU of a sum");
    let x = random(&[2, 4, 4, 3], 1);
    same(&[&x], &upsample(&x).unwrap(), &upsample::composed(&x).unwrap(), "upsampling");
    for window in [Window { side: 3, stride: 1 }, Window { side: 3, stride: 2 }] {
        same(&[&x], &unfold(&x, window).unwrap(), &unfold::composed(&x, window).unwrap(), "unfolding");
    }
}

#[test]
fn a_product_with_several_matrices_is_that_with_each() {
    let (x, w) = (random(&[3, 6], 1), random(&[2, 6, 8], 2));
    let each = Tensor::stack(&[x.as_tensor(), x.as_tensor()], 0).unwrap().matmul(&w).unwrap();
    same(&[&w, &x], &shared_product(&x, &w).unwrap(), &each, "the product");
}

/// What a GPU computes against the CPU, values and gradients. Says so where there is no GPU.
#[cfg(feature = "cuda")]
#[test]
fn an_nvidia_gpu_gives_what_the_cpu_gives() {
    type Function<'a> = &'a dyn Fn(&[Var]) -> Tensor;
    let Ok(gpu) = Device::new_cuda(0) else {
        println!("skipped: there is no NVIDIA GPU");
        return;
    };
    let close = |share: f32, shapes: &[&[usize]], f: Function<'_>, what: &str| {
        let pull = random(f(&random_all(shapes, &Device::Cpu)).dims(), 99);
        let [cpu, gpu] = [&Device::Cpu, &gpu].map(|device| {
            let vars = random_all(shapes, device);
            let y = f(&vars);
            let pulled = (&y * pull.to_device(device).unwrap()).unwrap();
            let gradients = pulled.sum_all().unwrap().backward().unwrap();
            let mut all = vec![y];
            all.extend(vars.iter().map(|v| gradients.get(v).unwrap().clone()));
            all.into_iter().map(|t| t.to_device(&Device::Cpu).unwrap()).collect::<Vec<_>>()
        });
        for (i, (a, b)) in gpu.iter().zip(&cpu).enumerate() {
            within(share, a, b, &format!("{what}, value and gradients: {i}"));
        }
    };
    let both = |shapes: &[&[usize]], f: Function<'_>, what: &str| close(1e-4, shapes, f, what);
    let windows =
        [Window { side: 3, stride: 1 }, Window { side: 7, stride: 2 }, Window { side: 1, stride: 2 }];
    for window in windows {
        let taps = window.side * window.side;
        let name = format!("{window:?}");
        both(&[&[2, 10, 8, 3]], &|v| unfold(&v[0], window).unwrap(), &name);
        let name = format!("{window:?}, 8 channels");
        both(&[&[2, 10, 8, 8]], &|v| unfold(&v[0], window).unwrap(), &name);
        // Factors have 10 bits there.
        let shapes: [&[usize]; 2] = [&[4, 10, 8, 3], &[2, taps * 3, 5]];
        close(4e-3, &shapes, &|v| conv(&v[0], &v[1], window).unwrap(), &name);
    }
    for slope in [0.0, 0.2, 1.0] {
        let norm = |v: &[Var]| norm_activate(&v[0], &v[1], &v[2], slope, None).unwrap();
        let shapes: [&[usize]; 3] = [&[3, 700, 40], &[3, 40], &[3, 40]];
        both(&shapes, &|v| norm(v).0, &format!("norm with slope {slope}"));
        let fixed = |v: &[Var]| {
            let moments = (random(&[2, 3, 40], 8).abs().unwrap() + 0.1).unwrap();
            let moments = moments.to_device(v[0].device()).unwrap();
            norm_activate(&v[0], &v[1], &v[2], slope, Some(&moments)).unwrap().0
        };
        both(&shapes, &fixed, &format!("norm with fixed moments, slope {slope}"));
    }
    both(&[&[2, 3, 4], &[2, 5, 4]], &|v| outer_add(&v[0], &v[1]).unwrap(), "the outer sum");
    both(&[&[2, 4, 4, 3]], &|v| upsample(&v[0]).unwrap(), "upsampling");
    both(&[&[3, 6], &[2, 6, 8]], &|v| shared_product(&v[0], &v[1]).unwrap(), "the product");
    let points = random(&[3, 700, 3], 7);
    let chamfer = |v: &[Var]| {
        let points = points.to_device(v[0].device()).unwrap();
        let mut run = atlasfit::run::Run::default();
        run.execute(|ctx| Ok(crate::loss::chamfer(&v[0], &points, ctx).unwrap())).unwrap().reshape(1).unwrap()
    };
    both(&[&[6, 900, 3]], &chamfer, "the Chamfer distance");
    let stepped = |device: &Device| {
        let mut params = crate::params::Params::new(3, device);
        let x = params.uniform("x", (7, 5), 5).unwrap();
        let mut adam = crate::adam::Adam::new(&params).unwrap();
        for _ in 0..3 {
            let loss = x.sqr().unwrap().sum_all().unwrap();
            adam.step(&params, &loss.backward().unwrap(), 0.1).unwrap();
        }
        x.to_device(&Device::Cpu).unwrap()
    };
    near(&stepped(&gpu), &stepped(&Device::Cpu), "three steps of Adam");
}

#[cfg(feature = "cuda")]
fn random_all(shapes: &[&[usize]], device: &Device) -> Vec<Var> {
    let one = |(i, shape): (usize, &&[usize])| {
        Var::from_tensor(&random(shape, i as u64 + 1).to_device(device).unwrap()).unwrap()
    };
    shapes.iter().enumerate().map(one).collect()
}
