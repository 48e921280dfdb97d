use super::*;
use crate::loss::{chamfer, stretch};
use crate::recipe::Encoder;
use atlasfit::numeric::rng::Rng;
use atlasfit::run::Run;

fn recipe(encoder: Encoder, decoder: Decoder) -> ModelRecipe {
    ModelRecipe {
        encoder,
        decoder,
        charts: 2,
        code: 6,
        point_units: vec![8, 12],
        image_side: 16,
        image_width: 2,
        hidden: vec![8, 5],
        side: 4,
        channels: 8,
    }
}

fn random(shape: &[usize], seed: u64) -> Tensor {
    let mut rng = Rng::new(seed);
    let values: Vec<f32> = (0..shape.iter().product()).map(|_| 0.3 * rng.normal() as f32).collect();
    Tensor::from_vec(values, shape, &Device::Cpu).unwrap()
}

/// The whole loss of a small batch: both encoders where the model has them, Chamfer distance and stretch.
fn loss(model: &Model, target: &Tensor) -> Tensor {
    let mut codes = Vec::new();
    codes.extend(model.encode_points(&random(&[6, 20, 3], 1), Mode::Train).unwrap());
    codes.extend(model.encode_pictures(&random(&[6, 64, 64, CHANNELS], 2), Mode::Train).unwrap());
    let codes = Tensor::cat(&codes, 0).unwrap();
    let samples = model.decode(&codes, Mode::Train).unwrap();
    let (shapes, charts, n, _) = samples.dims4().unwrap();
    let flat = samples.reshape((shapes, charts * n, 3)).unwrap();
    let chamfer = Run::default().execute(|ctx| Ok(chamfer(&flat, target, ctx).unwrap())).unwrap();
    (chamfer + (stretch(&samples, model.side()).unwrap() * 0.1).unwrap()).unwrap()
}

#[test]
fn gradients_of_both_models_are_those_of_finite_differences() {
    let target = random(&[6, 25, 3], 3);
    for (encoder, decoder) in [(Encoder::Both, Decoder::AtlasNet), (Encoder::Points, Decoder::ConvAtlas)] {
        let model = Model::new(&recipe(encoder, decoder), 7, &Device::Cpu).unwrap();
        let gradients = loss(&model, &target).backward().unwrap();
        for (name, var) in &model.params.vars {
            let gradient = gradients.get(var.as_tensor()).unwrap_or_else(|| panic!("{name} has no gradient"));
            let size = gradient.sqr().unwrap().sum_all().unwrap().sqrt().unwrap().to_scalar::<f32>().unwrap();
            // Along the gradient itself the derivative is its length.
            let direction = (gradient / f64::from(size.max(1e-9))).unwrap();
            let before = var.as_tensor().copy().unwrap();
            // Kinks of ReLU and of nearest points lie everywhere, and spoil large steps; rounding spoils small
            // ones, and differs between processors. The best step counts.
            let off = [4e-4, 2e-4, 1e-4, 4e-5].map(|change| {
                let h = change / f64::from(size.max(1.0));
                let at = |h: f64| {
                    var.set(&(&before + (&direction * h).unwrap()).unwrap()).unwrap();
                    f64::from(loss(&model, &target).to_scalar::<f32>().unwrap())
                };
                ((at(h) - at(-h)) / (2.0 * h) - f64::from(size)).abs()
            });
            var.set(&before).unwrap();
            let best = off.into_iter().fold(f64::INFINITY, f64::min);
            assert!(best < 0.03 * f64::from(size) + 4e-3, "{name}: {off:?} off from {size}");
        }
    }
}

#[test]
fn an_answer_depends_on_its_own_input_only_once_training_is_over() {
    let model = Model::new(&recipe(Encoder::Both, Decoder::ConvAtlas), 7, &Device::Cpu).unwrap();
    let points = random(&[4, 20, 3], 1);
    let all = model.encode_points(&points, Mode::Use).unwrap().unwrap();
    let one = model.encode_points(&points.narrow(0, 2, 1).unwrap(), Mode::Use).unwrap().unwrap();
    assert_eq!(all.narrow(0, 2, 1).unwrap().to_vec2::<f32>().unwrap(), one.to_vec2::<f32>().unwrap());
    let samples = model.decode(&all, Mode::Use).unwrap();
    assert_eq!(samples.dims(), [4, 2, 32 * 32, 3]);
}

#[test]
fn the_papers_sizes_are_met() {
    let of = |name: &str| {
        let text = crate::recipe::BUILT_IN.iter().find(|r| r.0 == name).unwrap().1;
        let recipe = crate::Recipe::read(text).unwrap();
        Model::new(&recipe.model, 1, &Device::Cpu).unwrap().counts()
    };
    // ResNet-18 has 11.18 million without its classifier; ours has a picture of 2 channels and one more
    // shortcut.
    let conv = of("convatlas");
    assert!((11.1e6..11.6e6).contains(&(conv.image as f64)), "{conv:?}");
    // The paper says 14.5 million, but not where the code enters.
    assert!((14.0e6..16.0e6).contains(&((conv.image + conv.decoder) as f64)), "{conv:?}");
    // 25 charts of 1026, 513, 256 units: the paper's 42.6 million are the decoder's alone.
    let dense = of("atlasnet");
    assert!((42.0e6..43.5e6).contains(&(dense.decoder as f64)), "{dense:?}");
}

/// The decoder of one chart against the exact gradients of `atlasfit-net`: the same weights, the same
/// picture.
#[test]
fn a_convolutional_chart_has_the_value_and_the_gradients_of_the_exact_network() {
    use atlasfit_net::net::Conv;
    let mut exact = Conv::new(&mut Rng::new(5));
    let gradient: Vec<[f32; 3]> = {
        let mut rng = Rng::new(6);
        (0..conv_atlas::SIDE * conv_atlas::SIDE).map(|_| [0; 3].map(|_| rng.normal() as f32)).collect()
    };
    let mut out = vec![[0.0; 3]; gradient.len()];
    Run::default()
        .execute(|ctx| {
            exact.forward(&mut out, ctx)?;
            exact.backward(&gradient, ctx)
        })
        .unwrap();
    let blocks: Vec<_> = exact.blocks().collect();
    let channels = blocks[0].channels;
    let mut params = Params::new(1, &Device::Cpu);
    let net = ConvAtlas::new(&mut params, 1, 3, channels).unwrap();
    let var = |name: &str| params.vars.iter().find(|v| v.0 == name).unwrap().1.clone();
    let set = |name: &str, values: &[f32]| {
        let var = var(name);
        var.set(&Tensor::from_slice(values, var.shape(), &Device::Cpu).unwrap()).unwrap();
    };
    // Ours are tap after tap of channels; theirs are channels of taps.
    let turned = |values: &[f32], channels: usize, outputs: usize, width: usize| -> Vec<f32> {
        (0..9 * channels * outputs)
            .map(|i| {
                let (tap, rest) = (i / (channels * outputs), i % (channels * outputs));
                values[rest / outputs * width + tap * outputs + rest % outputs]
            })
            .collect()
    };
    for (i, b) in blocks.iter().enumerate() {
        set(&format!("decoder.{i}.weight"), &turned(b.weights, b.channels, b.outputs, b.width));
    }
    set("decoder.last.bias", blocks[2].affine);
    let picture = Tensor::from_slice(exact.noise(), (1, 8, 8, channels), &Device::Cpu).unwrap();
    let samples = net.decode_doubled(&picture, Mode::Train).unwrap();
    let ours: Vec<f32> = samples.flatten_all().unwrap().to_vec1().unwrap();
    let off = ours.iter().zip(out.as_flattened()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(off < 1e-4, "values are {off} off");
    let pull = Tensor::from_slice(gradient.as_flattened(), samples.shape(), &Device::Cpu).unwrap();
    let gradients = (samples * pull).unwrap().sum_all().unwrap().backward().unwrap();
    let compare = |name: &str, exact: &[f32]| {
        let ours = gradients.get(var(name).as_tensor()).unwrap().flatten_all().unwrap();
        let ours: Vec<f32> = ours.to_vec1().unwrap();
        let size = exact.iter().fold(0.0f32, |a, x| a.max(x.abs()));
        let off = ours.iter().zip(exact).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(ours.len() == exact.len() && off < 1e-3 * size, "{name}: {off} off of {size}");
    };
    for (i, b) in blocks.iter().enumerate() {
        compare(&format!("decoder.{i}.weight"), &turned(b.d_weights, b.channels, b.outputs, b.width));
        if i < 2 {
            let (gain, shift) = b.d_affine.split_at(b.outputs);
            compare(&format!("decoder.{i}.gain"), gain);
            compare(&format!("decoder.{i}.shift"), shift);
        }
    }
    compare("decoder.last.bias", blocks[2].d_affine);
}
