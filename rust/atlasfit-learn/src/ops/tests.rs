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
    assert_eq!(a.dims(), b.dims(), "{what}");
    let (a, b) = (plain(a), plain(b));
    let size = b.iter().fold(1.0f32, |size, x| size.max(x.abs()));
    let off = a.iter().zip(&b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(off < 1e-4 * size, "{what} is {off} off, of {size}");
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

#[test]
fn a_convolution_by_unfolding_is_candles() {
    for window in
        [Window { side: 3, stride: 1 }, Window { side: 7, stride: 2 }, Window { side: 1, stride: 2 }]
    {
        let (x, w) = (random(&[2, 10, 8, 3], 1), random(&[window.side * window.side * 3, 5], 2));
        let seen = unfold(&x, window).unwrap();
        let (n, rows, columns, inputs) = seen.dims4().unwrap();
        let ours = seen.reshape((n * rows * columns, inputs)).unwrap().matmul(&w).unwrap();
        let ours = ours.reshape((n, rows, columns, 5)).unwrap();
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
    near(&Tensor::from_vec(moments.mean, (1, 5), &Device::Cpu).unwrap(), &mean, "the mean");
}

#[test]
fn fused_operations_are_those_composed_of_candles() {
    let (x, gain, shift) = (random(&[3, 600, 4], 1), random(&[3, 4], 2), random(&[3, 4], 3));
    for slope in [0.0, 0.2, 1.0] {
        let (fused, _) = norm_activate(&x, &gain, &shift, slope, None).unwrap();
        let composed = norm::composed(&x, &gain, &shift, slope, &std::sync::OnceLock::new()).unwrap();
        same(&[&x, &gain, &shift], &fused, &composed, &format!("norm with slope {slope}"));
    }
    let (a, b) = (random(&[2, 3, 4], 1), random(&[2, 5, 4], 2));
    let composed = a.unsqueeze(2).unwrap().broadcast_add(&b.unsqueeze(1).unwrap()).unwrap();
    same(&[&a, &b], &outer_add(&a, &b).unwrap(), &composed, "the outer sum");
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
