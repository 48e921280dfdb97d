//! How far a point's say reaches: the partition-of-unity weight that a denoised point gives its charts, and
//! the blocks where that weight is not zero.
//!
//! In: a [`BlendSite`]. Out: a weight for a squared distance; blocks.

use super::constants::{BLEND, BLOCK};
use crate::atlas::BlendSite;
use crate::numeric::vec3::Vec3;

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

/// Which blocks of a size a point influences: those that its reach touches near its tangent plane.
pub(super) struct Reach<'a> {
    site: &'a BlendSite,
    /// Side of a block.
    size: f64,
    /// The lowest and the highest block on each axis.
    range: [[i32; 2]; 3],
    /// Side of a voxel.
    h: f64,
    /// How far from the tangent plane the middle of a block may lie whose corners touch the surface.
    slab: f64,
    /// How far from the point.
    far: f64,
}

impl<'a> Reach<'a> {
    /// For blocks of voxels of side `h`.
    pub(super) fn new(site: &'a BlendSite, h: f64) -> Self {
        let size = h * f64::from(BLOCK);
        let reach = BLEND.reach * site.spacing;
        let slab = BLEND.half_diagonal * size + BLEND.curved * reach;
        let range = site.position.0.map(|x| [x - reach, x + reach].map(|x| (x / size).floor() as i32));
        Self { site, size, range, h, slab, far: reach + BLEND.half_diagonal * size }
    }
    /// From the point to the middle of a block, on an axis.
    fn to_middle(&self, b: i32, axis: usize) -> f64 {
        (f64::from(b) + 0.5) * self.size - self.site.position[axis]
    }
    /// Whether a block is one of them, if its corners matter up to so many voxels from the surface.
    pub(super) fn holds(&self, b: [i32; 3], band: f64) -> bool {
        let within = |k: usize| (self.range[k][0]..=self.range[k][1]).contains(&b[k]);
        let d = Vec3::from_fn(|k| self.to_middle(b[k], k));
        (0..3).all(within)
            && d.norm2() <= self.far * self.far
            && d.dot(self.site.normal).abs() <= self.slab + band * self.h
    }
}

/// Names them all, where corners matter up to `BLEND.band` voxels from the surface.
pub(super) fn visit_blocks(reach: &Reach<'_>, mut visit: impl FnMut([i32; 3])) {
    let &Reach { site, size, h, far, .. } = reach;
    let slab = reach.slab + BLEND.band * h;
    // Columns of blocks along the axis that the point faces most.
    let n = site.normal;
    let k = (0..3).fold(0, |k, i| if n[i].abs() > n[k].abs() { i } else { k });
    let (i, j) = ((k + 1) % 3, (k + 2) % 3);
    let [[x0, x1], [y0, y1], [z0, z1]] = [i, j, k].map(|axis| reach.range[axis]);
    for x in x0..=x1 {
        for y in y0..=y1 {
            let (dx, dy) = (reach.to_middle(x, i), reach.to_middle(y, j));
            let ball = far * far - dx * dx - dy * dy;
            if ball < 0.0 {
                continue;
            }
            let middle = -(n[i] * dx + n[j] * dy) / n[k];
            let (half, ball) = ((slab / n[k]).abs(), ball.sqrt());
            let from = (site.position[k] + (middle - half).max(-ball)) / size - 0.5;
            let to = (site.position[k] + (middle + half).min(ball)) / size - 0.5;
            for z in (from.ceil() as i32).max(z0)..=(to.floor() as i32).min(z1) {
                let mut b = [0; 3];
                (b[i], b[j], b[k]) = (x, y, z);
                visit(b);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::atlas::SITE_CHARTS;

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
        let (reach, mut blocks) = (Reach::new(&site, 1.0), Vec::new());
        visit_blocks(&reach, |b| blocks.push(b));
        let height = blocks.iter().map(|b| b[2].abs()).max().unwrap();
        let width = blocks.iter().map(|b| b[0].abs()).max().unwrap();
        assert!(blocks.contains(&[0, 0, 0]) && width >= 5 && height < width, "{width} by {height}");
        let around = -20..20;
        for b in
            around.clone().flat_map(|x| around.clone().flat_map(move |y| (-20..20).map(move |z| [x, y, z])))
        {
            assert_eq!(reach.holds(b, BLEND.band), blocks.contains(&b), "{b:?}");
        }
    }
}
