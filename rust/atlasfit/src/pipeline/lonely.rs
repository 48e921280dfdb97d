//! Points that lie too far from all others to belong to a surface.
//!
//! In: points with their spacing and their nearest others. Out: which of them are strays. Points far from the
//! dense ones are none where they lie on a plane with those about them: a surface that was scanned sparsely.

use super::constants::PIPELINE;
use crate::error::Result;
use crate::numeric::dense::principal;
use crate::numeric::stats::median;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::constants::SPATIAL;
use crate::spatial::spacing::NAMED;
use rayon::prelude::*;

/// Points and what is about them.
#[derive(Clone, Copy)]
pub(super) struct Near<'a> {
    pub points: &'a [Vec3],
    /// The nearest others of each; `u32::MAX` where there are no more.
    pub nearest: &'a [[u32; NAMED]],
    /// The spacing of each.
    pub spacing: &'a [f32],
    /// The median spacing of the nearest others of each.
    pub around: &'a [f32],
}

/// How far from its neighbours no point of this scan is that belongs to a surface, but a sparse plane: strays
/// near each other vouch for each other, so they are measured against the sparsest tenth of the scan too.
pub(super) fn farthest(spacing: &[f32]) -> f64 {
    let mut all = spacing.to_vec();
    let at = all.len() * 9 / 10;
    SPATIAL.widest * f64::from(*all.select_nth_unstable_by(at, f32::total_cmp).1)
}

/// Points that are much lonelier than the points around them, or farther from them than `farthest` and on no
/// plane with them.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn stray(near: Near<'_>, farthest: f64, ctx: &Context<'_>) -> Result<Vec<bool>> {
    let lone = |i: usize| {
        let [own, around] = [near.spacing, near.around].map(|s| f64::from(s[i]));
        own > PIPELINE.stray * around || own > farthest && !on_a_plane(near, i)
    };
    let chunks = (0..near.points.len().div_ceil(1024)).into_par_iter().map(|chunk| {
        ctx.check()?;
        Ok((chunk * 1024..near.points.len().min((chunk + 1) * 1024)).map(lone).collect::<Vec<_>>())
    });
    chunks.collect::<Result<Vec<_>>>().map(|v| v.concat())
}

/// Whether a point and those about it lie on a plane with their own nearest others, in the median.
fn on_a_plane(Near { points, nearest, .. }: Near<'_>, point: usize) -> bool {
    let with_nearest = |i: usize| {
        let others = nearest[i].iter().filter_map(|&j| points.get(j as usize));
        principal(others.chain([&points[i]]).map(|&p| (p, 1.0)))
    };
    let share = |i: usize| {
        let variances = with_nearest(i).map_or([1.0; 3], |found| found.variances);
        variances[0] / variances.iter().sum::<f64>().max(f64::MIN_POSITIVE)
    };
    let others = nearest[point].iter().map(|&j| j as usize).filter(|&j| j < points.len());
    let mut shares: Vec<f64> = others.chain([point]).map(share).collect();
    median(&mut shares) < PIPELINE.flat
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Run;
    use crate::numeric::rng::Rng;
    use crate::spatial::neighbours::Neighbours;

    /// The share of points, all too far from each other to be near dense ones, that are strays.
    fn share(points: &[Vec3]) -> f64 {
        let tree = Run::default().execute(|ctx| Neighbours::build(points, ctx)).unwrap();
        let nearest: Vec<[u32; NAMED]> = points
            .iter()
            .map(|&p| {
                let mut found = Vec::new();
                tree.nearest(p, NAMED + 1, &mut found);
                std::array::from_fn(|k| found[k + 1].index)
            })
            .collect();
        let spacing = vec![1.0; points.len()];
        let near = Near { points, nearest: &nearest, spacing: &spacing, around: &spacing };
        let found = Run::default().execute(|ctx| stray(near, 0.1, ctx)).unwrap();
        found.iter().filter(|s| **s).count() as f64 / points.len() as f64
    }

    #[test]
    fn far_points_are_strays_in_space_and_none_on_a_curved_sheet() {
        let mut rng = Rng::new(3);
        let cloud: Vec<Vec3> = (0..1000).map(|_| Vec3::from_fn(|_| rng.uniform())).collect();
        assert!(share(&cloud) > 0.9, "{}", share(&cloud));
        // A sphere with seven spacings to its radius.
        let sheet: Vec<Vec3> = (0..600).map(|_| Vec3::from_fn(|_| rng.normal()).normalized()).collect();
        assert!(share(&sheet) < 0.02, "{}", share(&sheet));
    }
}
