//! How wide the voxels are that a scan is contoured with.
//!
//! In: the spacing of its points, its noise. Out: sides of voxels, in the unit of the spacing. Voxels of a
//! whole scan follow the spacing from place to place ([`graded`]); tiles must agree on theirs, so that they
//! are of one size ([`even`]).

use super::constants::PIPELINE;
use super::whole::Survey;
use crate::blend::levels::Voxels;
use crate::spatial::constants::SPATIAL;
use crate::spatial::spacing::Sampling;

/// The voxels of a whole scan, or of a tile of what is `told`.
pub(super) fn of(sampling: &Sampling, sigma: f64, detail: f64, told: Option<&Survey>) -> Voxels {
    told.map_or_else(|| graded(sampling, sigma, detail), |told| of_side(told.voxel / detail))
}

/// Voxels that follow the spacing where it is wider than the median; `sigma` is the noise that charts are cut
/// with.
pub(super) fn graded(sampling: &Sampling, sigma: f64, detail: f64) -> Voxels {
    let finest = (PIPELINE.voxel * sampling.median).max(PIPELINE.voxel_noise * sigma);
    Voxels { finest: finest / detail, per_spacing: PIPELINE.voxel / detail }
}

/// Voxels of one size.
fn of_side(side: f64) -> Voxels {
    Voxels { finest: side, per_spacing: 0.0 }
}

/// Side of voxels that are all of one size, for a detail of 1; `sigma` is the noise that charts are cut with.
pub(super) fn even(sampling: &Sampling, sigma: f64) -> f64 {
    let squares = sampling.spacing.iter().map(|&s| covered(sampling, f64::from(s)).powi(2));
    let spread = (squares.sum::<f64>() / sampling.spacing.len() as f64).sqrt();
    let by_spread = (PIPELINE.voxel_uneven * spread).min(sampling.median).max(PIPELINE.voxel_spread * spread);
    (PIPELINE.voxel * sampling.median).max(by_spread).max(PIPELINE.voxel_noise * sigma)
}

/// How many squares of a voxel's side the surface has, about: that of the points' own squares.
pub(super) fn squares(sampling: &Sampling, voxels: Voxels) -> f64 {
    let of = |&s: &f32| (covered(sampling, f64::from(s)) / voxels.side(f64::from(s))).powi(2);
    sampling.spacing.iter().map(of).sum()
}

/// Side of the square that a point stands for at the most.
fn covered(sampling: &Sampling, spacing: f64) -> f64 {
    spacing.min(PIPELINE.alone * SPATIAL.widest * sampling.median)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sparse_part_adds_as_many_voxels_as_its_points_ask_for() {
        let dense = Sampling::new(vec![1.0; 1000]);
        let both = Sampling::new((0..1100).map(|i| if i < 1000 { 1.0 } else { 16.0 }).collect());
        let count = |s: &Sampling| squares(s, graded(s, 0.0, 1.0));
        let added = count(&both) - count(&dense);
        // Voxels of a level are up to twice as fine as asked.
        assert!((0.1..0.41).contains(&(added / count(&dense))), "{added}");
        let of_one_size = squares(&both, of_side(even(&dense, 0.0))) - count(&dense);
        assert!(of_one_size > 20.0 * added, "{of_one_size}");
    }

    #[test]
    fn noise_wider_than_the_spacing_makes_voxels_wide() {
        let sampling = Sampling::new(vec![1.0; 10]);
        let [fine, wide] = [0.1, 5.0].map(|sigma| graded(&sampling, sigma, 1.0).finest);
        assert_eq!((fine, wide), (PIPELINE.voxel, 5.0 * PIPELINE.voxel));
        assert_eq!(graded(&sampling, 0.1, 2.0).finest, 0.5 * PIPELINE.voxel);
    }
}
