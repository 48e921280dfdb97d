//! Parts of made-up shapes: rings along a line, joined by straight pieces.
//!
//! Each place of a part has coordinates (u, v) in the unit square: u along the rings, v around them. They
//! name the same place on another shape's part, whatever its size: correspondences are known.

use atlasfit::numeric::vec3::Vec3;

/// Corners of a round ring.
const ROUND: usize = 20;

/// A ring: all places centre + cos a + sin b of an ellipse, or of a rectangle about the same axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Ring {
    pub(super) centre: Vec3,
    pub(super) axes: [Vec3; 2],
}

impl Ring {
    fn is_point(&self) -> bool {
        self.axes[0].norm() == 0.0
    }
}

/// Rings of one kind, in order.
#[derive(Debug, Clone, PartialEq)]
pub struct Loft {
    rings: Vec<Ring>,
    /// Rectangles instead of ellipses.
    square: bool,
}

/// The place at `v` of a ring's circumference, in its axes.
fn around(v: f64, square: bool) -> [f64; 2] {
    if !square {
        let a = v * std::f64::consts::TAU;
        return [a.cos(), a.sin()];
    }
    let (side, t) = ((4.0 * v).floor(), 2.0 * (4.0 * v).fract() - 1.0);
    match side as u32 % 4 {
        0 => [1.0, t],
        1 => [-t, 1.0],
        2 => [-1.0, -t],
        _ => [t, -1.0],
    }
}

impl Loft {
    /// Rings with both ends open; it faces away from its line where the rings' first axis, the line and their
    /// second axis are a right-handed frame.
    pub(super) fn open(rings: Vec<Ring>, square: bool) -> Self {
        Self { rings, square }
    }

    /// Rings with both ends closed, flat; it faces outward.
    pub(super) fn closed(mut rings: Vec<Ring>, square: bool) -> Self {
        let along = rings[rings.len() - 1].centre - rings[0].centre;
        if rings[0].axes[0].cross(along).dot(rings[0].axes[1]) < 0.0 {
            rings.iter_mut().for_each(|r| r.axes[1] = r.axes[1] * -1.0);
        }
        let point = |r: &Ring| Ring { centre: r.centre, axes: [Vec3::ZERO; 2] };
        let (first, last) = (point(&rings[0]), point(&rings[rings.len() - 1]));
        rings.insert(0, first);
        rings.push(last);
        Self { rings, square }
    }

    /// A box about a centre, with half sides along the axes of space.
    pub(super) fn block(centre: [f64; 3], half: [f64; 3]) -> Self {
        let ring = |y: f64| Ring {
            centre: Vec3([centre[0], centre[1] + y, centre[2]]),
            axes: [Vec3([half[0], 0.0, 0.0]), Vec3([0.0, 0.0, half[2]])],
        };
        Self::closed(vec![ring(-half[1]), ring(half[1])], true)
    }

    /// Round about a vertical line through (x, z): radii and heights from below.
    pub(super) fn turned([x, z]: [f64; 2], profile: &[[f64; 2]], closed: bool) -> Self {
        let ring = |[r, y]: &[f64; 2]| Ring {
            centre: Vec3([x, *y, z]),
            axes: [Vec3([*r, 0.0, 0.0]), Vec3([0.0, 0.0, *r])],
        };
        let rings = profile.iter().map(ring).collect();
        if closed { Self::closed(rings, false) } else { Self::open(rings, false) }
    }

    /// A bar along a line, round or square, with its radius at each point. Its rings stand across the line
    /// and keep to one direction, so that v means the same along it.
    pub(super) fn bar(line: &[Vec3], radii: &[f64], square: bool) -> Self {
        let along = (line[line.len() - 1] - line[0]).normalized();
        // The axis of space that the line turns least toward.
        let least = (0..3).min_by(|&i, &j| along[i].abs().total_cmp(&along[j].abs())).unwrap_or(0);
        let beside = Vec3::from_fn(|k| if k == least { 1.0 } else { 0.0 });
        let rings = (0..line.len())
            .map(|i| {
                let next = line[(i + 1).min(line.len() - 1)] - line[i.saturating_sub(1)];
                let t = next.normalized();
                let a = beside.cross(t).normalized();
                let b = t.cross(a);
                let r = radii[i.min(radii.len() - 1)];
                Ring { centre: line[i], axes: [a * r, b * r] }
            })
            .collect();
        Self::closed(rings, square)
    }

    /// The same part elsewhere: each point p becomes `scale` p + `shift`.
    pub(super) fn moved(&mut self, scale: f64, shift: Vec3) {
        for ring in &mut self.rings {
            ring.centre = ring.centre * scale + shift;
            ring.axes = ring.axes.map(|a| a * scale);
        }
    }

    /// The place with coordinates (u, v), each in [0, 1].
    #[must_use]
    pub fn place(&self, [u, v]: [f64; 2]) -> Vec3 {
        let at = u.clamp(0.0, 1.0) * (self.rings.len() - 1) as f64;
        let i = (at as usize).min(self.rings.len() - 2);
        let t = at - i as f64;
        let [c, s] = around(v.clamp(0.0, 1.0), self.square);
        let on = |r: &Ring| r.centre + r.axes[0] * c + r.axes[1] * s;
        on(&self.rings[i]) * (1.0 - t) + on(&self.rings[i + 1]) * t
    }

    /// Vertices with their coordinates (v is NaN where a ring is a point), and triangles among them.
    pub(super) fn mesh(&self) -> (Vec<Vec3>, Vec<[f64; 2]>, Vec<[u32; 3]>) {
        let columns = if self.square { 4 } else { ROUND };
        let rows = self.rings.len();
        let (mut points, mut places, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
        // A rectangle's corners are where its sides begin.
        for i in 0..rows {
            for j in 0..=columns {
                let uv = [i as f64 / (rows - 1) as f64, j as f64 / columns as f64];
                points.push(self.place(uv));
                // Around a ring that is a point all directions are one.
                places.push(if self.rings[i].is_point() { [uv[0], f64::NAN] } else { uv });
            }
        }
        let at = |i: usize, j: usize| (i * (columns + 1) + j) as u32;
        for i in 0..rows - 1 {
            for j in 0..columns {
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                if !self.rings[i + 1].is_point() {
                    triangles.push([a, b, c]);
                }
                if !self.rings[i].is_point() {
                    triangles.push([a, c, d]);
                }
            }
        }
        (points, places, triangles)
    }

    /// All centres and corners of the rings' boxes, for the box about the part.
    pub(super) fn extent(&self) -> impl Iterator<Item = Vec3> + '_ {
        let columns = if self.square { 4 } else { ROUND };
        self.rings.iter().flat_map(move |r| {
            (0..columns).map(move |j| {
                let [c, s] = around(j as f64 / columns as f64, self.square);
                r.centre + r.axes[0] * c + r.axes[1] * s
            })
        })
    }
}
