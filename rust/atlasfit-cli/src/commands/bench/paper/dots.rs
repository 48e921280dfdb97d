//! A dotted drawing, as in the paper: a curve through the dots, beside a network that is fitted to the
//! picture.

use super::cells::Bench;
use super::pictures::draw_points;
use anyhow::Result;
use atlasfit::Context;
use atlasfit::numeric::rng::Rng;
use atlasfit::numeric::vec3::Vec3;
use atlasfit_net::explicit;
use atlasfit_net::net;
use serde_json::json;

impl Bench<'_> {
    /// Fits a curve to the dots and, beside it, a convolutional network to their picture: the idea of the
    /// deep image prior.
    pub fn dots(&mut self) -> Result<()> {
        let args = self.args;
        let how = self.options("C1R").with_flat(true);
        self.cell("dots", |ctx| {
            let line: Vec<Vec3> = (0..2000).map(|i| heart(f64::from(i) / 2000.0)).collect();
            let dots: Vec<Vec3> = line.iter().copied().step_by(50).collect();
            // Each dot is a little disc of pixels, as in a drawing.
            let mut rng = Rng::stream(ctx.seed, 9);
            let scan: Vec<Vec3> = dots
                .iter()
                .flat_map(|d| {
                    (0..12)
                        .map(|_| Vec3([d[0] + 0.004 * rng.normal(), d[1] + 0.004 * rng.normal(), 0.0]))
                        .collect::<Vec<_>>()
                })
                .collect();
            let atlas = explicit::fit(&scan, &how, ctx)?;
            let gap = |curve: &[Vec3]| -> f64 {
                let far =
                    |p: &Vec3| curve.iter().map(|q| (*p).dist2(*q)).fold(f64::INFINITY, f64::min).sqrt();
                line.iter().map(far).sum::<f64>() / line.len() as f64
            };
            let ink = image_prior(&dots, if args.quick { 3 } else { 300 }, ctx)?;
            draw_points(args, "dots-given", &scan, ctx)?;
            draw_points(args, "dots-curve", &atlas.samples, ctx)?;
            draw_points(args, "dots-image-prior", &ink, ctx)?;
            Ok(json!({
                "curve": gap(&atlas.samples), "dots": gap(&dots),
                "image": if ink.is_empty() { f64::NAN } else { gap(&ink) },
            }))
        })
    }
}

/// A curve to be dotted.
fn heart(t: f64) -> Vec3 {
    let a = std::f64::consts::TAU * t;
    let x = 16.0 * a.sin().powi(3);
    let y = 13.0 * a.cos() - 5.0 * (2.0 * a).cos() - 2.0 * (3.0 * a).cos() - (4.0 * a).cos();
    Vec3([x / 36.0, y / 36.0, 0.0])
}

/// Fits a convolutional network to the picture of the dots. Gives the centres of the dark pixels of its own
/// picture.
fn image_prior(dots: &[Vec3], steps: usize, ctx: &Context<'_>) -> Result<Vec<Vec3>> {
    let [lines, side] = net::conv::GRID;
    let centre = |i: usize| {
        let at = |k: usize, n: usize| (k as f64 + 0.5) / n as f64 - 0.5;
        [at(i % side, side), at(i / side, lines), 0.0]
    };
    let ink: Vec<f32> = (0..lines * side)
        .map(|i| {
            let near = dots.iter().any(|d| (0..2).all(|k| (d[k] - centre(i)[k]).abs() <= 0.5 / side as f64));
            if near { 0.9 } else { -0.9 }
        })
        .collect();
    let mut net = net::Conv::new(&mut Rng::stream(ctx.seed, 13));
    let mut out = vec![[0f32; 3]; ink.len()];
    for _ in 0..steps {
        net.forward(&mut out, ctx)?;
        let gradient: Vec<[f32; 3]> =
            out.iter().zip(&ink).map(|(y, ink)| [2.0 * (y[0] - ink), 0.0, 0.0]).collect();
        net.backward(&gradient, ctx)?;
        net.step(1e-3, ctx)?;
    }
    net.forward(&mut out, ctx)?;
    Ok((0..ink.len()).filter(|&i| out[i][0] > 0.0).map(|i| Vec3(centre(i))).collect())
}
