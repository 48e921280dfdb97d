//! The covariance between pixels of the paper's convolutional networks as their channels grow many.
//!
//! In: blocks of upsampling and convolution over white noise. Out: the covariance of the last picture's
//! pixels, over noise and weights. Sources: *Deep Manifold Prior*, supplement A; Cheng et al. 2019, "A
//! Bayesian perspective on the deep image prior".
//!
//! Each block doubles the picture's side bilinearly (half-pixel centres, clamped at the border), sums 3 x 3
//! pixels with independent weights of total variance 1 (zeros outside), and takes the leaky ReLU; the last
//! block ends with the sums.

use crate::kernel::{Activation, Pair};
use atlasfit::numeric::rng::Rng;
use rayon::prelude::*;

/// Taps of a convolution.
const TAPS: usize = 9;

/// Covariances between the pixels of a square picture, row-major.
#[derive(Debug, Clone)]
pub struct Pixels {
    /// Pixels along a side.
    pub side: usize,
    /// side^2 x side^2.
    pub covariance: Vec<f64>,
}

impl Pixels {
    /// Covariance of the pixels at two places (line, column).
    #[must_use]
    pub fn at(&self, [i, j]: [usize; 2], [k, l]: [usize; 2]) -> f64 {
        let s = self.side;
        self.covariance[(i * s + j) * s * s + k * s + l]
    }

    /// Correlation of the same.
    #[must_use]
    pub fn correlation(&self, a: [usize; 2], b: [usize; 2]) -> f64 {
        self.at(a, b) / (self.at(a, a) * self.at(b, b)).sqrt()
    }

    /// How far from stationary: of pixels at least `margin` from the border, the largest difference of the
    /// correlations of two pairs of neighbours `apart` pixels apart along a line.
    #[must_use]
    pub fn unevenness(&self, apart: usize, margin: usize) -> f64 {
        let inside = margin..self.side.saturating_sub(margin);
        let pairs = inside.clone().flat_map(|i| inside.clone().map(move |j| [i, j]));
        let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
        for [i, j] in pairs.filter(|p| p[1] + apart < inside.end) {
            let c = self.correlation([i, j], [i, j + apart]);
            least = least.min(c);
            most = most.max(c);
        }
        most - least
    }
}

/// The limit's covariance after `blocks` blocks, from white noise of `side` x `side` pixels.
#[must_use]
pub fn limit(side: usize, blocks: usize) -> Pixels {
    let n = side * side;
    let mut noise = vec![0.0; n * n];
    noise.iter_mut().step_by(n + 1).for_each(|x| *x = 1.0);
    (0..blocks).fold(Pixels { side, covariance: noise }, |before, block| {
        let sums = summed(&upsampled(&before));
        if block + 1 < blocks { activated(sums) } else { sums }
    })
}

/// The two source lines of line `i` after upsampling, each with its weight.
fn sources(i: usize, side: usize) -> [(usize, f64); 2] {
    let near = i / 2;
    let far = if i.is_multiple_of(2) { near.saturating_sub(1) } else { (near + 1).min(side - 1) };
    [(near, 0.75), (far, 0.25)]
}

/// The four source pixels of a pixel after upsampling, each with its weight.
fn source_pixels(pixel: usize, side: usize) -> [(usize, f64); 4] {
    let [a, b] = [pixel / (2 * side), pixel % (2 * side)].map(|i| sources(i, side));
    std::array::from_fn(|k| {
        let ((i, wi), (j, wj)) = (a[k / 2], b[k % 2]);
        (i * side + j, wi * wj)
    })
}

fn upsampled(of: &Pixels) -> Pixels {
    let (side, n, all) = (of.side, of.side * of.side, 4 * of.side * of.side);
    let mut covariance = vec![0.0; all * all];
    covariance.par_chunks_mut(all).enumerate().for_each(|(p, row)| {
        // The pixel's sources first, so that the work is 4 + 4 and not 16 products.
        let mut mixed = vec![0.0; n];
        for (a, w) in source_pixels(p, side) {
            mixed.iter_mut().zip(&of.covariance[a * n..]).for_each(|(m, c)| *m += w * c);
        }
        for (q, x) in row.iter_mut().enumerate() {
            *x = source_pixels(q, side).iter().map(|(b, w)| w * mixed[*b]).sum();
        }
    });
    Pixels { side: 2 * side, covariance }
}

/// The pixel that a tap looks at, if it is in the picture.
fn tap(pixel: usize, tap: usize, side: usize) -> Option<usize> {
    let (i, j) = ((pixel / side + tap / 3).wrapping_sub(1), (pixel % side + tap % 3).wrapping_sub(1));
    (i < side && j < side).then(|| i * side + j)
}

fn summed(of: &Pixels) -> Pixels {
    let (side, n) = (of.side, of.side * of.side);
    let mut covariance = vec![0.0; n * n];
    covariance.par_chunks_mut(n).enumerate().for_each(|(p, row)| {
        for (t, from) in (0..TAPS).filter_map(|t| Some((t, tap(p, t, side)?))) {
            let line = &of.covariance[from * n..][..n];
            for (q, x) in row.iter_mut().enumerate() {
                if let Some(other) = tap(q, t, side) {
                    *x += line[other] / TAPS as f64;
                }
            }
        }
    });
    Pixels { side, covariance }
}

fn activated(of: Pixels) -> Pixels {
    let n = of.side * of.side;
    let own: Vec<f64> = of.covariance.iter().step_by(n + 1).copied().collect();
    let mut covariance = of.covariance;
    covariance.par_chunks_mut(n).enumerate().for_each(|(p, row)| {
        for (x, bb) in row.iter_mut().zip(&own) {
            *x = Activation::LeakyRelu.second_moment(Pair { aa: own[p], ab: *x, bb: *bb });
        }
    });
    Pixels { side: of.side, covariance }
}

/// A picture of one channel by a random network with `channels` channels of noise, and in every block.
#[must_use]
pub fn draw(side: usize, blocks: usize, channels: usize, rng: &mut Rng) -> Vec<f64> {
    let mut picture: Vec<Vec<f64>> =
        (0..channels).map(|_| (0..side * side).map(|_| rng.normal()).collect()).collect();
    let mut side = side;
    for block in 0..blocks {
        let pixels = 4 * side * side;
        for channel in &mut picture {
            *channel = (0..pixels)
                .map(|p| source_pixels(p, side).iter().map(|(a, w)| w * channel[*a]).sum())
                .collect();
        }
        side *= 2;
        let last = block + 1 == blocks;
        let deviation = (1.0 / (TAPS * channels) as f64).sqrt();
        picture = (0..if last { 1 } else { channels })
            .map(|_| {
                let mut sums = vec![0.0; pixels];
                for channel in &picture {
                    for t in 0..TAPS {
                        let w = deviation * rng.normal();
                        for (p, x) in sums.iter_mut().enumerate() {
                            if let Some(from) = tap(p, t, side) {
                                *x += w * channel[from];
                            }
                        }
                    }
                }
                if !last {
                    sums.iter_mut().for_each(|x| *x = Activation::LeakyRelu.at(*x));
                }
                sums
            })
            .collect();
    }
    picture.swap_remove(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn random_networks_have_the_limits_covariance() {
        let limit = limit(2, 2);
        let (n, draws) = (64, 2000);
        let mut rng = Rng::new(6);
        let mut sums = vec![0.0; n];
        for _ in 0..draws {
            let picture = draw(2, 2, 32, &mut rng);
            // With the pixel at (3, 3).
            sums.iter_mut().zip(&picture).for_each(|(s, x)| *s += x * picture[27] / f64::from(draws));
        }
        // Beside the pixel's own variance: the size of a network's picture varies most.
        let off = |q: usize| sums[q] / sums[27] - limit.at([3, 3], [q / 8, q % 8]) / limit.at([3, 3], [3, 3]);
        for q in 0..n {
            assert!(off(q).abs() < 0.08, "{q}: {}", off(q));
        }
        let mean = (0..n).map(off).sum::<f64>() / n as f64;
        assert!(mean.abs() < 0.03, "{mean}");
    }

    #[test]
    fn the_covariance_is_symmetric_and_near_stationary_inside() {
        let pixels = limit(4, 3);
        for (a, b) in [([3, 9], [30, 2]), ([16, 16], [16, 20])] {
            assert!((pixels.at(a, b) - pixels.at(b, a)).abs() < 1e-12);
        }
        assert!(pixels.correlation([16, 12], [16, 12]) > 0.999_999);
        // White noise upsampled is stationary over its own pixels only.
        assert!(pixels.unevenness(1, 8) > 0.0);
    }
}
