//! Where the picture is taken from.
//!
//! In: a view (a name or two angles), the box of what is shown, the picture's size. Out: an orthographic
//! projection to pixels and depth. Orthographic, because people compare results by laying pictures over each
//! other.

use atlasfit::numeric::vec3::Vec3;
use std::str::FromStr;

/// The share of the picture that is left free on every side.
const MARGIN: f64 = 0.04;

/// A direction to look from, in degrees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Round the vertical axis: 0 = front, 90 = from the object's left hand side (+x), 180 = back.
    pub azimuth: f64,
    /// Above the horizon.
    pub elevation: f64,
}

impl FromStr for View {
    type Err = String;
    fn from_str(s: &str) -> Result<Self, String> {
        let (azimuth, elevation) = match s {
            "front" => (0.0, 0.0),
            "right" => (90.0, 0.0),
            "back" => (180.0, 0.0),
            "left" => (270.0, 0.0),
            "top" => (0.0, 90.0),
            "bottom" => (0.0, -90.0),
            angles => {
                let parse = |t: &str| t.trim().parse::<f64>().ok().filter(|x| x.is_finite());
                match angles.split_once(',').and_then(|(a, e)| parse(a).zip(parse(e))) {
                    Some(pair) if pair.1.abs() <= 90.0 => pair,
                    _ => {
                        return Err(
                            "give front, back, left, right, top, bottom, or AZIMUTH,ELEVATION in degrees"
                                .into(),
                        );
                    }
                }
            }
        };
        Ok(Self { azimuth, elevation })
    }
}

/// The vertical axis of the scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Up {
    /// +y up, front is +z: most object scans.
    Y,
    /// +z up, front is -y: most terrain and building scans.
    Z,
}

/// An orthographic projection.
#[derive(Debug, Clone, Copy)]
pub struct Camera {
    right: Vec3,
    up: Vec3,
    /// Towards the viewer.
    pub back: Vec3,
    centre: Vec3,
    /// Pixels per unit of length.
    pub scale: f64,
    half: [f64; 2],
    depth: f64,
}

impl Camera {
    /// A camera that fits all points into a picture of `size` pixels. Points must be finite.
    pub fn fit(points: &[Vec3], view: View, up: Up, size: [usize; 2]) -> Self {
        let (a, e) = (view.azimuth.to_radians(), view.elevation.to_radians());
        // In a frame with y up and the front at +z.
        let back = Vec3([a.sin() * e.cos(), e.sin(), a.cos() * e.cos()]);
        let right = Vec3([a.cos(), 0.0, -a.sin()]);
        let turn = |v: Vec3| match up {
            Up::Y => v,
            Up::Z => Vec3([v[0], -v[2], v[1]]),
        };
        let (back, right) = (turn(back), turn(right));
        let above = back.cross(right);
        let axes = [right, above, back];
        let (mut lo, mut hi) = (Vec3([f64::INFINITY; 3]), Vec3([f64::NEG_INFINITY; 3]));
        for p in points {
            for k in 0..3 {
                let x = (*p).dot(axes[k]);
                lo[k] = lo[k].min(x);
                hi[k] = hi[k].max(x);
            }
        }
        if points.is_empty() {
            (lo, hi) = (Vec3([-1.0; 3]), Vec3([1.0; 3]));
        }
        let mid = lo * 0.5 + hi * 0.5;
        let centre = axes[0] * mid[0] + axes[1] * mid[1] + axes[2] * mid[2];
        let free = 1.0 - 2.0 * MARGIN;
        let fit = |k: usize| size[k] as f64 * free / (hi[k] - lo[k]).max(1e-300);
        // A single point has no size to fit.
        let pixels = fit(0).min(fit(1)).min(1e290);
        let depth = (hi - lo).norm().max(1e-300);
        Self { right, up: above, back, centre, scale: pixels, half: size.map(|s| 0.5 * s as f64), depth }
    }

    /// Pixel coordinates (x right, y down) and depth (smaller = nearer, about -1 to 1).
    pub fn project(&self, p: Vec3) -> [f32; 3] {
        let d = p - self.centre;
        [
            (self.half[0] + d.dot(self.right) * self.scale) as f32,
            (self.half[1] - d.dot(self.up) * self.scale) as f32,
            (-d.dot(self.back) / self.depth) as f32,
        ]
    }
    /// A direction as seen: x right, y up, z towards the viewer.
    pub fn turn(&self, v: Vec3) -> Vec3 {
        Vec3([v.dot(self.right), v.dot(self.up), v.dot(self.back)])
    }
    /// Depth units per pixel across.
    pub fn depth_per_pixel(&self) -> f32 {
        (1.0 / (self.scale * self.depth)) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_front_is_seen_from_plus_z_and_the_top_from_plus_y() {
        let box_ = [Vec3([-1.0; 3]), Vec3([1.0; 3])];
        let at =
            |view: &str, up, p| Camera::fit(&box_, view.parse().unwrap(), up, [100, 100]).project(Vec3(p));
        let [x, y, z] = at("front", Up::Y, [1.0, 1.0, 1.0]);
        assert!(x > 90.0 && y < 10.0 && z < 0.0);
        assert!(at("back", Up::Y, [1.0, 0.0, 0.0])[0] < 10.0);
        assert!(at("right", Up::Y, [1.0, 0.0, 0.0])[2] < 0.0);
        assert!(at("top", Up::Y, [0.0, 1.0, 0.0])[2] < 0.0);
        assert!(at("front", Up::Z, [0.0, -1.0, 0.0])[2] < 0.0);
        assert!(at("front", Up::Z, [0.0, 0.0, 1.0])[1] < 10.0);
        assert!("sideways".parse::<View>().is_err() && "30,100".parse::<View>().is_err());
        assert_eq!("30,-20".parse(), Ok(View { azimuth: 30.0, elevation: -20.0 }));
    }
}
