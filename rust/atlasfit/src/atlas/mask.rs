//! The trim mask of a chart: which part of its domain carries surface.
//!
//! In: domain coordinates of the points that the chart explains, the point spacing and the noise. Out: a
//! value in [0, 1] anywhere on the domain, one half at the edge of the data. A place is inside when the
//! points about it surround it: their centroid under a compact kernel stays near the centroid of the domain
//! itself. At the straight edge of a half plane it is off by a known amount, in a gap between random samples
//! it is not, so edges are found without mistaking gaps for holes. Noise blurs the edge, and the centroid
//! there is off by less: points beyond the edge are not taken for more of the surface.

/// Nodes along one side of the mask's grid.
pub const SIDE: usize = 9;
/// Radius of the kernel in point spacings: about thirty points, so that chance moves their centroid by a
/// third of what an edge does.
const REACH: f64 = 3.0;
/// Offset of the centroid at the edge of a half plane, in standard deviations of the kernel, without noise:
/// 0.82 for a full disk, 0.87 for a narrow strip.
const EDGE: f64 = 0.85;
/// Variance of the kernel (1 - r^2)^2 along an axis, r up to 1.
const KERNEL_VARIANCE: f64 = 1.0 / 8.0;
/// Half width of the soft transition, relative to the offset at the edge.
const SOFT: f64 = 0.3;
/// Below this share of the expected number of points a place is empty however they lie.
const SPARSE: f64 = 0.15;

/// Squares along one side of the grid in which a mask is trimmed.
pub const SQUARES: usize = 32;

/// Which squares of a grid over [-1, 1]^2 carry no surface: a row for each step along u, a bit for each along
/// v, the lowest first.
pub type Trimmed = [u32; SQUARES];

/// A trim mask.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mask {
    /// Values at the nodes of a square grid over [-1, 1]^2, 0 to 255, row by row along u.
    pub nodes: Box<[u8; SIDE * SIDE]>,
    /// What was trimmed, if anything: where other charts say that there is no surface.
    pub trimmed: Option<Box<Trimmed>>,
}

impl Mask {
    /// A mask that is full everywhere.
    #[must_use]
    pub fn full() -> Self {
        Self::of_nodes([255; SIDE * SIDE])
    }

    /// A mask of these values, with nothing trimmed.
    #[must_use]
    pub fn of_nodes(nodes: [u8; SIDE * SIDE]) -> Self {
        Self { nodes: Box::new(nodes), trimmed: None }
    }

    /// Value at (u, v), in [0, 1]: bilinear, and 0 where the mask is trimmed.
    #[inline]
    #[must_use]
    pub fn value(&self, u: f64, v: f64) -> f64 {
        const CELLS: f64 = (SIDE - 1) as f64;
        let f = |x: f64| ((x + 1.0) * 0.5 * CELLS).clamp(0.0, CELLS - 1e-9);
        let (x, y) = (f(u), f(v));
        let (i, j) = (x as usize, y as usize);
        let (s, t) = (x - i as f64, y - j as f64);
        if let Some(trimmed) = &self.trimmed {
            let square = |x: f64| (((x + 1.0) * 0.5 * SQUARES as f64) as usize).min(SQUARES - 1);
            if (trimmed[square(u)] >> square(v)) & 1 == 1 {
                return 0.0;
            }
        }
        let at = |i: usize, j: usize| f64::from(self.nodes[i * SIDE + j]);
        ((1.0 - s) * ((1.0 - t) * at(i, j) + t * at(i, j + 1))
            + s * ((1.0 - t) * at(i + 1, j) + t * at(i + 1, j + 1)))
            / 255.0
    }

    /// Builds the mask from the domain coordinates of the chart's points. `radii` are the domain's half axes,
    /// `spacing` the point spacing and `sigma` the standard deviation of the noise, in the same unit.
    #[must_use]
    pub fn build(points: &[[f64; 2]], radii: [f64; 2], spacing: f64, sigma: f64) -> Self {
        let reach = (REACH * spacing).max(1e-12);
        // Of a Gaussian kernel of variance s^2, at the edge of a half plane that noise blurs, the centroid is
        // off by s^2 sqrt(2 / pi) / sqrt(s^2 + sigma^2). The compact kernel's variance is a known share of
        // its reach squared.
        let s2 = KERNEL_VARIANCE * reach * reach;
        let edge = EDGE * (s2 / (s2 + sigma * sigma)).sqrt();
        let node = |k: usize| k as f64 * (2.0 / (SIDE - 1) as f64) - 1.0;
        let cell = (2.0 / (SIDE - 1) as f64).powi(2) * radii[0] * radii[1];
        let (a, b) = (radii[0] / reach, radii[1] / reach);
        let kernel = |x: f64, y: f64| {
            let t = 1.0 - x * x - y * y;
            if t > 0.0 { t * t } else { 0.0 }
        };
        let mut out = [0u8; SIDE * SIDE];
        for i in 0..SIDE {
            for j in 0..SIDE {
                let (u, v) = (node(i), node(j));
                if u * u + v * v > 1.35 {
                    continue;
                }
                // The domain seen through the kernel, by the grid's own nodes: area, centroid, covariance.
                let (mut w0, mut wx, mut wy, mut wxx, mut wxy, mut wyy) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
                for k in 0..SIDE {
                    for l in 0..SIDE {
                        let (p, q) = (node(k), node(l));
                        if p * p + q * q > 1.1 {
                            continue;
                        }
                        let (x, y) = ((p - u) * a, (q - v) * b);
                        let w = kernel(x, y);
                        w0 += w;
                        wx += w * x;
                        wy += w * y;
                        wxx += w * x * x;
                        wxy += w * x * y;
                        wyy += w * y * y;
                    }
                }
                let (mut n0, mut nx, mut ny) = (0.0, 0.0, 0.0);
                for &[p, q] in points {
                    let (x, y) = ((p - u) * a, (q - v) * b);
                    let w = kernel(x, y);
                    n0 += w;
                    nx += w * x;
                    ny += w * y;
                }
                if w0 <= 0.0 || n0 * spacing * spacing < SPARSE * w0 * cell {
                    continue;
                }
                let (mx, my) = (wx / w0, wy / w0);
                let (dx, dy) = (nx / n0 - mx, ny / n0 - my);
                // Kernel and grid are coarse against each other in narrow domains: no variance below that of
                // one grid cell.
                let least = 1.0 / 12.0 * (2.0 / (SIDE - 1) as f64).powi(2);
                let cxx = (wxx / w0 - mx * mx).max(least * a * a);
                let cyy = (wyy / w0 - my * my).max(least * b * b);
                let cxy = wxy / w0 - mx * my;
                let det = (cxx * cyy - cxy * cxy).max(1e-3 * cxx * cyy);
                let offset = ((cyy * dx * dx - 2.0 * cxy * dx * dy + cxx * dy * dy) / det).sqrt() / edge;
                let value = ((1.0 + SOFT - offset) / (2.0 * SOFT)).clamp(0.0, 1.0);
                out[i * SIDE + j] = (value * 255.0).round() as u8;
            }
        }
        Self::of_nodes(out)
    }
}
