//! A boundary as a curve: nodes at even distances, in spacings of the points beside it.
//!
//! In: a ring of vertices. Out: a closed curve with, at each node, the unit of length, the way out of the
//! surface and the surface's normal; where each vertex of the ring belongs on it.

use super::constants::RIM;
use crate::numeric::vec3::Vec3;
use std::ops::{Add, Mul};

/// A boundary.
pub(super) struct Curve {
    /// The nodes, in order round the boundary.
    pub nodes: Vec<Node>,
    /// Where each vertex of the ring lies along the curve, in nodes.
    place: Vec<f64>,
}

/// A place on a boundary.
#[derive(Clone, Copy)]
pub(super) struct Node {
    pub position: Vec3,
    /// Spacing of the points beside it.
    pub spacing: f64,
    /// Unit vector along the surface, out of it and across the boundary.
    pub out: Vec3,
    /// Unit normal of the surface, on one of its sides.
    pub normal: Vec3,
    /// How far beyond the boundary the surface may go on, in spacings.
    pub slack: f64,
    /// Which way the surface lies.
    inward: Vec3,
}

/// Where the data end.
pub(super) struct Ends {
    /// How far out at each node, in spacings.
    pub offsets: Vec<f64>,
    /// How dense the points are just within it, as a share of those farther within: at most 1.
    pub thinned: Vec<f64>,
}

impl Curve {
    /// The curve of a ring of vertices; `inward` says for each vertex of the mesh which way the surface lies,
    /// `spacing` for each of the ring the spacing of the points there.
    pub fn new(ring: &[u32], positions: &[Vec3], inward: &[Vec3], spacing: &[f64]) -> Self {
        let m = ring.len();
        let at = |j: usize| positions[ring[j % m] as usize];
        // Lengths in spacings.
        let mut along = vec![0.0; m + 1];
        for j in 0..m {
            let unit = 0.5 * (spacing[j] + spacing[(j + 1) % m]);
            along[j + 1] = along[j] + (at(j + 1) - at(j)).norm() / unit;
        }
        let n = ((along[m] / RIM.step) as usize).max(RIM.least_nodes);
        let per_node = if along[m] > 0.0 { n as f64 / along[m] } else { 0.0 };
        let place: Vec<f64> = along[..m].iter().map(|t| t * per_node).collect();
        let mut j = 0;
        let nodes = (0..n).map(|k| {
            let t = k as f64;
            while j + 1 < m && place[j + 1] <= t {
                j += 1;
            }
            let next = if j + 1 < m { place[j + 1] } else { n as f64 };
            let share = if next > place[j] { (t - place[j]) / (next - place[j]) } else { 0.0 };
            let between = |a: Vec3, b: Vec3| a + (b - a) * share;
            let [a, b] = [j, (j + 1) % m].map(|j| inward[ring[j] as usize]);
            Node {
                position: between(at(j), at(j + 1)),
                spacing: spacing[j] + (spacing[(j + 1) % m] - spacing[j]) * share,
                inward: between(a, b),
                slack: 0.0,
                out: Vec3::ZERO,
                normal: Vec3::ZERO,
            }
        });
        Self { nodes: nodes.collect(), place }
    }
    /// Smooths the curve, and finds the way out of the surface.
    pub fn smooth(&mut self) {
        let mut positions: Vec<Vec3> = self.nodes.iter().map(|n| n.position).collect();
        smooth(&mut positions, RIM.smoothings);
        let n = positions.len();
        let along = |k: usize| (positions[(k + 1) % n] - positions[(k + n - 1) % n]).normalized();
        let across = |v: Vec3, k: usize| v - along(k) * v.dot(along(k));
        let mut out: Vec<Vec3> = (0..n).map(|k| -across(self.nodes[k].inward, k).normalized()).collect();
        smooth(&mut out, RIM.smoothings);
        for (k, node) in self.nodes.iter_mut().enumerate() {
            node.position = positions[k];
            node.out = across(out[k], k).normalized();
            node.normal = along(k).cross(node.out);
        }
    }
    /// How much the curve bends outward along the surface at each node, by its second differences in
    /// spacings, more than in the mean.
    pub fn bends(&self) -> Vec<f64> {
        let n = self.nodes.len();
        let at = |k: usize| self.nodes[k % n].position;
        let bend = |(k, node): (usize, &Node)| {
            let second = at(k + n - 1) + at(k + 1) - node.position * 2.0;
            second.dot(node.out) / node.spacing
        };
        let bends: Vec<f64> = self.nodes.iter().enumerate().map(bend).collect();
        let mean = bends.iter().sum::<f64>() / n as f64;
        bends.iter().map(|b| b - mean).collect()
    }
    /// Moves the curve to where the data end.
    pub fn settle(&mut self, ends: &Ends) {
        let [thin, full] = RIM.thin;
        for (node, (offset, thinned)) in self.nodes.iter_mut().zip(ends.offsets.iter().zip(&ends.thinned)) {
            node.position += node.out * (offset * node.spacing);
            node.slack = RIM.slack * ((full - thinned) / (full - thin)).clamp(0.0, 1.0);
        }
    }
    /// Where each vertex of the ring belongs, if that is farther out than the vertex: `at` says where it is.
    pub fn farther_out(&self, at: &[Vec3]) -> Vec<Option<Vec3>> {
        let n = self.nodes.len();
        let target = |(&t, &at): (&f64, &Vec3)| {
            let k = (t as usize).min(n - 1);
            let [a, b] = [k, (k + 1) % n].map(|k| self.nodes[k]);
            let to = a.position + (b.position - a.position) * (t - k as f64);
            ((to - at).dot(a.out) > 0.0).then_some(to)
        };
        self.place.iter().zip(at).map(target).collect()
    }
}

/// Smooths values along a ring by (1, 2, 1) / 4, so many times.
pub(super) fn smooth<T: Copy + Add<Output = T> + Mul<f64, Output = T>>(values: &mut Vec<T>, times: usize) {
    let n = values.len();
    for _ in 0..times {
        let mean = |k: usize| (values[(k + n - 1) % n] + values[k] * 2.0 + values[(k + 1) % n]) * 0.25;
        *values = (0..n).map(mean).collect();
    }
}
