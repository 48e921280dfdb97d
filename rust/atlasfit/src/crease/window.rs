//! The points about a place of the surface, in a frame of their own.
//!
//! In: the surface, the scan, a vertex. Out: the points of that sheet about it.

use super::constants::CREASE;
use super::piece::Piece;
use crate::atlas::{KnownScan, ProjectedPoint};
use crate::contour::surface::Surface;
use crate::error::Result;
use crate::numeric::dense::{eigen3, second_moments};
use crate::numeric::robust::{self, TUKEY};
use crate::numeric::vec3::{Frame, Vec3};
use crate::run::Context;
use crate::spatial::Neighbours;
use crate::spatial::lists::Lists;
use crate::spatial::neighbours::Neighbour;

/// What windows are cut from.
pub(super) struct Windows<'a> {
    surface: &'a Surface,
    projected: &'a [ProjectedPoint],
    known: &'a KnownScan<'a>,
    /// The places of the points that lie on charts, and which they are.
    tree: Neighbours,
    on_charts: Vec<u32>,
    /// The vertex of the surface that is nearest to each.
    vertex: Vec<u32>,
    /// The neighbours of each vertex.
    neighbours: &'a Lists,
}

/// The points of one sheet about a place.
pub(super) struct Window {
    /// Origin of its frame.
    pub at: Vec3,
    /// Directions: across the bend, along it, and the mean normal.
    pub frame: Frame,
    /// Length of the frame's unit: the spacing of the points.
    pub unit: f64,
    /// Standard deviation of the noise, in the unit.
    pub sigma: f64,
    /// The points.
    pub points: Vec<[f64; 3]>,
    /// What the charts leave of them unexplained, in nats.
    pub misfit: f64,
}

/// Points along a crease.
pub(super) struct Strip {
    /// Standard deviation of the noise, in the unit of the piece.
    pub sigma: f64,
    /// The points in its frame, each with what its chart leaves of it unexplained, in nats.
    pub points: Vec<([f64; 3], f64)>,
}

/// Points about a place.
pub(super) struct Ball {
    /// Standard deviation of the noise.
    pub sigma: f64,
    /// The points, each with what its chart leaves of it unexplained, in nats.
    pub points: Vec<(Vec3, f64)>,
}

/// What finding points reuses.
pub(super) struct Scratch {
    near: Vec<Neighbour>,
    queue: Vec<u32>,
    /// For each vertex the last sheet that it was found on.
    sheet: Vec<u32>,
    /// The name of the sheet.
    name: u32,
    /// The points of the sheet.
    own: Vec<u32>,
}

impl<'a> Windows<'a> {
    /// Prepares to cut windows; none where no point lies on a chart.
    pub fn new(
        surface: &'a Surface,
        neighbours: &'a Lists,
        projected: &'a [ProjectedPoint],
        known: &'a KnownScan<'a>,
        ctx: &Context<'_>,
    ) -> Result<Option<Self>> {
        let on_charts: Vec<u32> =
            (0..projected.len() as u32).filter(|&i| projected[i as usize].chart != u32::MAX).collect();
        if on_charts.is_empty() {
            return Ok(None);
        }
        let places: Vec<Vec3> = on_charts.iter().map(|&i| projected[i as usize].position).collect();
        let tree = Neighbours::build(&places, ctx)?;
        let vertices = Neighbours::build(&surface.positions, ctx)?;
        let vertex = vertices.nearest_of(&places, ctx)?;
        Ok(Some(Self { surface, projected, known, tree, on_charts, vertex, neighbours }))
    }
    /// What finding points reuses.
    pub fn scratch(&self, ctx: &Context<'_>) -> Result<Scratch> {
        let sheet = ctx.filled(0, self.surface.positions.len())?;
        Ok(Scratch { near: Vec::new(), queue: Vec::new(), sheet, name: 0, own: Vec::new() })
    }
    /// The spacing of the points at a vertex; none where there are no points.
    pub fn unit(&self, vertex: u32) -> Option<f64> {
        let point = self.nearest(vertex)?;
        Some(f64::from(self.known.spacing[point as usize]).max(f64::MIN_POSITIVE))
    }
    /// The point that lies nearest to a vertex.
    fn nearest(&self, vertex: u32) -> Option<u32> {
        let found = self.tree.nearest_one(self.surface.positions[vertex as usize]);
        self.on_charts.get(found.index as usize).copied()
    }
    /// The window about a vertex with radii across and along the bend, in spacings; none where the sheet is
    /// no height over a plane there, or has too few points.
    pub fn about(&self, vertex: u32, [across, along]: [f64; 2], scratch: &mut Scratch) -> Option<Window> {
        let at = self.surface.positions[vertex as usize];
        let point = self.nearest(vertex)?;
        let unit = self.unit(vertex)?;
        let sigma = self.known.noise_at(point) / unit;
        self.own(vertex, along * unit, scratch);
        let own = &mut scratch.own;
        let places = |i: u32| self.projected[i as usize].position;
        let normals = |i: u32| self.projected[i as usize].normal;
        let inner = own.iter().copied().filter(|&i| places(i).dist2(at) <= (across * unit).powi(2));
        let frame = frame(inner.map(normals))?;
        own.retain(|&i| {
            let d = (places(i) - at) * (1.0 / unit);
            (frame[0].dot(d) / across).powi(2) + (frame[1].dot(d) / along).powi(2) <= 1.0
        });
        let steep = own.iter().filter(|&&i| normals(i).dot(frame[2]) < CREASE.steep).count();
        let few = own.len() < CREASE.least_points;
        if few || steep as f64 > (1.0 - CREASE.on_sides) * own.len() as f64 {
            return None;
        }
        let step = own.len().div_ceil(CREASE.most_points).max(1);
        let own: Vec<u32> = own.iter().copied().step_by(step).collect();
        let points = own.iter().map(|&i| {
            let d = (self.known.points[i as usize] - at) * (1.0 / unit);
            frame.map(|axis| axis.dot(d))
        });
        let misfit = self.misfits(&own, sigma * unit).iter().sum();
        Some(Window { at, frame, unit, sigma, points: points.collect(), misfit })
    }
    /// What the charts leave of each point unexplained, in nats. A chart follows the points that it is fitted
    /// to: in the mean they are as far off as the noise that the charts found, which allows for that.
    fn misfits(&self, own: &[u32], sigma: f64) -> Vec<f64> {
        let off = |i: u32| {
            let p = &self.projected[i as usize];
            let found = self.known.charts.get(p.chart as usize).map_or(sigma, |chart| chart.sigma);
            ((self.known.points[i as usize] - p.position).norm(), found)
        };
        let (mut followed, mut meant) = (0.0, 0.0);
        for (off, found) in own.iter().map(|&i| off(i)).filter(|(off, found)| *off < TUKEY * found) {
            followed += off * off;
            meant += found * found;
        }
        let farther = if followed > 0.0 { (meant / followed).sqrt().max(1.0) } else { 1.0 };
        own.iter().map(|&i| robust::cost(farther * off(i).0 / sigma)).collect()
    }
    /// The points of the sheet about a vertex that lie beside a piece's crease, up to so far along it.
    pub fn strip(&self, vertex: u32, piece: &Piece, longest: f64, scratch: &mut Scratch) -> Strip {
        let sigma = self.nearest(vertex).map_or(1.0, |i| self.known.noise_at(i)) / piece.unit;
        self.own(vertex, longest.hypot(piece.across) * piece.unit, scratch);
        let local = |i: u32| piece.local(self.known.points[i as usize]);
        let beside = |p: [f64; 3]| (p[0] - piece.model.line(p[1])).abs() <= piece.across;
        scratch.own.retain(|&i| beside(local(i)));
        let misfits = self.misfits(&scratch.own, sigma * piece.unit);
        let points = scratch.own.iter().map(|&i| local(i)).zip(misfits);
        Strip { sigma, points: points.collect() }
    }
    /// The points of the sheet next to a place, up to so far from it: where they are, and what their charts
    /// leave of each unexplained, in nats.
    pub fn ball(&self, at: Vec3, radius: f64, scratch: &mut Scratch) -> Ball {
        let nearest = self.tree.nearest_one(at).index as usize;
        let sigma = self.on_charts.get(nearest).map_or(1.0, |&i| self.known.noise_at(i));
        self.own(self.vertex[nearest], radius, scratch);
        let place = |i: u32| self.known.points[i as usize];
        let misfits = self.misfits(&scratch.own, sigma);
        let points = scratch.own.iter().map(|&i| place(i)).zip(misfits);
        Ball { sigma, points: points.collect() }
    }
    /// Finds the points of the sheet about a vertex: those next to vertices that hang together with it.
    fn own(&self, vertex: u32, radius: f64, scratch: &mut Scratch) {
        let Scratch { near, queue, sheet, name, own } = scratch;
        let positions = &self.surface.positions;
        let at = positions[vertex as usize];
        *name += 1;
        sheet[vertex as usize] = *name;
        queue.clear();
        queue.push(vertex);
        while let Some(v) = queue.pop() {
            for &w in self.neighbours.of(v) {
                let seen = &mut sheet[w as usize];
                if *seen != *name && positions[w as usize].dist2(at) < radius * radius {
                    *seen = *name;
                    queue.push(w);
                }
            }
        }
        self.tree.within(at, radius, near);
        let on_sheet = |n: &&Neighbour| sheet[self.vertex[n.index as usize] as usize] == *name;
        own.clear();
        own.extend(near.iter().filter(on_sheet).map(|n| self.on_charts[n.index as usize]));
    }
}

/// The frame of normals: across the direction in which they vary least, along it, and their mean.
fn frame(normals: impl Iterator<Item = Vec3> + Clone) -> Option<Frame> {
    let mean = normals.clone().fold(Vec3::ZERO, |sum, n| sum + n);
    let up = mean.normalized();
    let (_, axes) = eigen3(second_moments(normals.map(|n| (n, 1.0))));
    let along = axes[0] - up * up.dot(axes[0]);
    if !(mean.norm() > 0.0 && along.norm() > 0.1) {
        return None;
    }
    let along = along.normalized();
    Some([along.cross(up), along, up])
}
