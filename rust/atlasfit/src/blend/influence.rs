//! How far a point's say reaches: the partition-of-unity weight that a denoised point gives its charts, and
//! the blocks where that weight is not zero.
//!
//! In: a [`BlendSite`]. Out: a weight for a squared distance; the keys of blocks.

use super::blocks::block_key;
use super::constants::{BLEND, BLOCK};
use crate::atlas::BlendSite;

/// Influence of a point at squared distance `q`, in units of its spacing: the nearest points decide,
/// smoothly.
#[inline]
pub(super) fn influence(q: f64) -> f64 {
    let t = 1.0 - q * (1.0 / (BLEND.reach * BLEND.reach));
    if t <= 0.0 {
        return 0.0;
    }
    let e = q + BLEND.softening;
    t * t / (e * e)
}

/// Names the blocks of voxels of size `h` that a point influences: those that its reach touches near its
/// tangent plane.
pub(super) fn visit_blocks(site: &BlendSite, h: f64, mut visit: impl FnMut(u64)) {
    let size = h * f64::from(BLOCK);
    let reach = BLEND.reach * site.spacing;
    let lo = site.position.0.map(|x| ((x - reach) / size).floor() as i32);
    let hi = site.position.0.map(|x| ((x + reach) / size).floor() as i32);
    let slab = BLEND.half_diagonal * size + BLEND.band * h + BLEND.curved * reach;
    let far = reach + BLEND.half_diagonal * size;
    // Columns of blocks along the axis that the point faces most.
    let n = site.normal;
    let k = (0..3).fold(0, |k, i| if n[i].abs() > n[k].abs() { i } else { k });
    let (i, j) = ((k + 1) % 3, (k + 2) % 3);
    let centre = |b: i32, axis: usize| (f64::from(b) + 0.5) * size - site.position[axis];
    for x in lo[i]..=hi[i] {
        for y in lo[j]..=hi[j] {
            let (dx, dy) = (centre(x, i), centre(y, j));
            let ball = far * far - dx * dx - dy * dy;
            if ball < 0.0 {
                continue;
            }
            let middle = -(n[i] * dx + n[j] * dy) / n[k];
            let (half, ball) = ((slab / n[k]).abs(), ball.sqrt());
            let from = (site.position[k] + (middle - half).max(-ball)) / size - 0.5;
            let to = (site.position[k] + (middle + half).min(ball)) / size - 0.5;
            for z in (from.ceil() as i32).max(lo[k])..=(to.floor() as i32).min(hi[k]) {
                let mut b = [0; 3];
                (b[i], b[j], b[k]) = (x, y, z);
                visit(block_key(b));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::atlas::SITE_CHARTS;
    use crate::numeric::vec3::Vec3;

    #[test]
    fn influence_falls_with_distance_to_zero_at_the_reach() {
        let at = |d: f64| influence(d * d);
        assert!((0..24).all(|k| at(0.1 * f64::from(k)) > at(0.1 * f64::from(k + 1))));
        assert!(at(BLEND.reach).abs() < 1e-12);
    }

    #[test]
    fn a_point_reaches_blocks_along_its_tangent_plane_only() {
        let site = BlendSite {
            position: Vec3([0.1, 0.2, 0.3]),
            normal: Vec3([0.0, 0.0, 1.0]),
            spacing: 10.0,
            charts: [(0, 1.0); SITE_CHARTS],
        };
        let mut keys = Vec::new();
        visit_blocks(&site, 1.0, |key| keys.push(super::super::blocks::block_of_key(key)));
        let height = keys.iter().map(|b| b[2].abs()).max().unwrap();
        let width = keys.iter().map(|b| b[0].abs()).max().unwrap();
        assert!(keys.contains(&[0, 0, 0]) && width >= 5 && height < width, "{width} by {height}");
    }
}
