//! Stretch of charts that are sampled on regular grids.
//!
//! In: the samples of one chart. Out: the mean over the samples of the summed squared distances to their grid
//! neighbours, and its gradient. It is the quadratic form of the grid's graph Laplacian: it pulls
//! neighbouring samples together and evens out their spacing. Source: *Deep Manifold Prior*, equation 3
//! (section 3, "Stretch regularization").

use crate::sample::Sample;

/// Stretch of one chart times `weight`, a squared length. Its gradient is added to `gradient`.
///
/// `samples` lie on a grid of `grid[0]` lines of `grid[1]` samples, line after line; a curve is one line.
///
/// # Panics
/// When the lengths of `samples` and `gradient` are not the grid's.
///
/// ```
/// // Two edges of length 1, each counted from both ends, over three samples.
/// let samples = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]];
/// let value = atlasfit_net::loss::stretch(&samples, [1, 3], 1.0, &mut [[0.0; 3]; 3]);
/// assert!((value - 4.0 / 3.0).abs() < 1e-6);
/// ```
pub fn stretch(samples: &[Sample], grid: [usize; 2], weight: f32, gradient: &mut [Sample]) -> f64 {
    let [lines, side] = grid;
    assert!(samples.len() == lines * side && gradient.len() == samples.len(), "samples are not on the grid");
    // Every edge counts twice, once from each end.
    let factor = 2.0 * weight / samples.len() as f32;
    let mut total = 0.0;
    let edge = |i: usize, j: usize, gradient: &mut [Sample]| {
        let d: Sample = std::array::from_fn(|k| samples[j][k] - samples[i][k]);
        for k in 0..3 {
            let g = 2.0 * factor * d[k];
            gradient[i][k] -= g;
            gradient[j][k] += g;
        }
        d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
    };
    for line in 0..lines {
        let mut sum = 0.0;
        for i in line * side..(line + 1) * side {
            if i + 1 < (line + 1) * side {
                sum += edge(i, i + 1, gradient);
            }
            if line + 1 < lines {
                sum += edge(i, i + side, gradient);
            }
        }
        total += f64::from(sum);
    }
    total * f64::from(factor)
}

#[cfg(test)]
mod tests {
    use super::*;
    use atlasfit::numeric::rng::Rng;

    fn plane(lines: usize, side: usize, step: f32) -> Vec<Sample> {
        (0..lines * side).map(|i| [(i / side) as f32 * step, (i % side) as f32 * step, 0.0]).collect()
    }

    #[test]
    fn a_square_lattice_has_the_stretch_of_its_edges() {
        // 4 x 3 samples a quarter apart: 3*3 + 4*2 = 17 edges of squared length 1/16, each counted from both
        // ends, over 12 samples.
        let samples = plane(4, 3, 0.25);
        let mut gradient = vec![[0.0; 3]; 12];
        let value = stretch(&samples, [4, 3], 1.0, &mut gradient);
        assert!((value - 2.0 * 17.0 / 16.0 / 12.0).abs() < 1e-7);
        // Inside, the pulls of opposite neighbours cancel.
        assert!(gradient[4][0].abs() < 1e-7 && gradient[4][1].abs() < 1e-7);
        assert!((stretch(&samples, [4, 3], 3.0, &mut gradient) - 3.0 * value).abs() < 1e-6);
    }

    #[test]
    fn a_contour_is_one_line_and_a_single_sample_has_no_stretch() {
        let mut gradient = vec![[0.0; 3]; 5];
        let value = stretch(&plane(1, 5, 1.0), [1, 5], 1.0, &mut gradient);
        assert!((value - 2.0 * 4.0 / 5.0).abs() < 1e-7);
        assert_eq!(stretch(&[[1.0; 3]], [1, 1], 1.0, &mut gradient[..1]), 0.0);
    }

    #[test]
    fn the_gradient_is_the_derivative() {
        let mut rng = Rng::new(3);
        let samples: Vec<Sample> = (0..20).map(|_| [0; 3].map(|_| rng.normal() as f32)).collect();
        let mut gradient = vec![[0.0; 3]; 20];
        stretch(&samples, [4, 5], 0.7, &mut gradient);
        // The value is quadratic, so a central difference is exact up to rounding.
        let h = 0.25;
        for i in 0..20 {
            for k in 0..3 {
                let at = |d: f32| {
                    let mut moved = samples.clone();
                    moved[i][k] += d;
                    stretch(&moved, [4, 5], 0.7, &mut vec![[0.0; 3]; 20])
                };
                let difference = (at(h) - at(-h)) / (2.0 * f64::from(h));
                assert!((difference - f64::from(gradient[i][k])).abs() < 1e-5);
            }
        }
    }
}
