//! A short piece of a crease with the two sides that meet there, as data.

use super::constants::CREASE;
use super::model::Model;
use crate::numeric::vec3::{Frame, Vec3};
use crate::spatial::bvh::Aabb;

/// A piece of a crease.
#[derive(Debug, Clone)]
pub(super) struct Piece {
    /// Origin of its frame.
    pub at: Vec3,
    /// Directions: across the crease, along it, and the one that both sides rise over.
    pub frame: Frame,
    /// Length of the frame's unit: the spacing of the points.
    pub unit: f64,
    /// How far from the crease it is believed, in its unit.
    pub across: f64,
    /// And how far along it, from its middle backwards and forwards.
    pub along: [f64; 2],
    /// The surface as a height over the frame, in its unit.
    pub model: Model,
}

impl Piece {
    /// A position in the frame.
    pub fn local(&self, p: Vec3) -> [f64; 3] {
        let d = (p - self.at) * (1.0 / self.unit);
        self.frame.map(|axis| axis.dot(d))
    }
    /// A position of the frame in space.
    pub fn place(&self, [x, y, z]: [f64; 3]) -> Vec3 {
        self.at + (self.frame[0] * x + self.frame[1] * y + self.frame[2] * z) * self.unit
    }
    /// How far a place of the frame is from the middle, as a share of how far the piece is believed.
    pub fn far2(&self, x: f64, y: f64) -> f64 {
        ((x - self.model.line(y)) / self.across).powi(2) + (y / self.along[usize::from(y > 0.0)]).powi(2)
    }
    /// Where it is believed.
    pub fn bounds(&self) -> Aabb {
        let [back, forth] = self.along;
        let ys = [-back, -0.5 * back, 0.0, 0.5 * forth, forth];
        let xs = [-self.across, 0.0, self.across];
        let places = ys.into_iter().flat_map(|y| xs.map(|x| [self.model.line(y) + x, y]));
        let corners: Vec<Vec3> = places.map(|[x, y]| self.place([x, y, self.model.height(x, y)])).collect();
        let Aabb { min, max } = Aabb::of(&corners);
        let margin = Vec3([CREASE.deepest * self.unit; 3]);
        Aabb { min: min - margin, max: max + margin }
    }
    /// The greater of its reaches along the crease.
    pub fn longest(&self) -> f64 {
        self.along[0].max(self.along[1])
    }
    /// The point on the crease at `y` along it.
    pub fn on_line(&self, y: f64) -> Vec3 {
        let x = self.model.line(y);
        self.place([x, y, self.model.height(x, y)])
    }
    /// The middle of the piece.
    pub fn middle(&self) -> Vec3 {
        self.on_line(0.0)
    }
    /// The unit normal of the side that a place of the frame lies on.
    pub fn normal(&self, x: f64, y: f64) -> Vec3 {
        let [hx, hy] = self.model.slopes(x, y);
        (self.frame[2] - self.frame[0] * hx - self.frame[1] * hy).normalized()
    }
    /// Unit normals of the two sides where they meet.
    pub fn sides(&self, y: f64) -> [Vec3; 2] {
        let line = self.model.line(y);
        [line - CREASE.beside, line + CREASE.beside].map(|x| self.normal(x, y))
    }
    /// Direction of the crease at its middle.
    pub fn direction(&self) -> Vec3 {
        (self.frame[1] + self.frame[0] * self.model.skew).normalized()
    }
    /// The same piece seen along the crease from its other end: its sides are exchanged.
    pub fn turned(mut self) -> Self {
        let [x, y, z] = self.frame;
        self.frame = [-x, -y, z];
        self.model = self.model.turned();
        self.along.reverse();
        self
    }
}
