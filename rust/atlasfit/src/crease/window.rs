//! The points about a place of the surface, in a frame of their own.
//!
//! In: the surface, the scan, a vertex. Out: the points of that sheet about it.

use super::constants::CREASE;
use super::piece::Piece;
use super::sides;
use crate::atlas::{KnownScan, Map, ProjectedPoint};
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
    /// Points that lie on other sides which face the same way, and what the charts leave of each.
    pub others: Vec<([f64; 3], f64)>,
    /// Where across the bend a crease is tried first, in the unit.
    pub starts: Vec<f64>,
}

/// Where windows are cut.
struct Place {
    at: Vec3,
    /// The spacing of the points there.
    unit: f64,
    /// The standard deviation of their noise.
    noise: f64,
    /// Radii across and along the bend, in spacings.
    radii: [f64; 2],
}

impl Place {
    /// Whether a point is within the radii.
    fn holds(&self, frame: &Frame, p: &ProjectedPoint) -> bool {
        let d = (p.position - self.at) * (1.0 / self.unit);
        let [across, along] = self.radii;
        (frame[0].dot(d) / across).powi(2) + (frame[1].dot(d) / along).powi(2) <= 1.0
    }
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
        Some(self.spacing(self.nearest(vertex)?))
    }
    /// The spacing at a point.
    fn spacing(&self, point: u32) -> f64 {
        f64::from(self.known.spacing[point as usize]).max(f64::MIN_POSITIVE)
    }
    /// The point that lies nearest to a vertex.
    fn nearest(&self, vertex: u32) -> Option<u32> {
        let found = self.tree.nearest_one(self.surface.positions[vertex as usize]);
        self.on_charts.get(found.index as usize).copied()
    }
    /// The windows about a vertex with radii across and along the bend, in spacings: one of the whole sheet,
    /// where that is a height over a plane, and one for each two of its sides that meet there.
    pub fn about(&self, vertex: u32, radii: [f64; 2], scratch: &mut Scratch) -> Vec<Window> {
        let Some(point) = self.nearest(vertex) else { return Vec::new() };
        let unit = self.spacing(point);
        let at = self.surface.positions[vertex as usize];
        let place = Place { at, unit, noise: self.known.noise_at(point), radii };
        self.own(vertex, radii[1] * unit, scratch);
        let whole = self.whole(&place, &scratch.own);
        let sides =
            if self.is_tube(point) { Vec::new() } else { self.pairs(&place, &scratch.own, whole.is_some()) };
        whole.into_iter().chain(sides).collect()
    }
    /// Whether a point lies on a tube, which has no sides: it was found likelier than some patches.
    fn is_tube(&self, point: u32) -> bool {
        let chart = self.known.charts.get(self.projected[point as usize].chart as usize);
        chart.is_some_and(|chart| matches!(chart.map, Map::Tube(_)))
    }
    /// The window of all points of the sheet; none where they are no height over a plane.
    fn whole(&self, place: &Place, own: &[u32]) -> Option<Window> {
        let projected = |i: u32| &self.projected[i as usize];
        let inner = (place.radii[0] * place.unit).powi(2);
        let inner = own.iter().map(|&i| projected(i)).filter(|p| p.position.dist2(place.at) <= inner);
        let frame = frame(inner.map(|p| p.normal))?;
        let own: Vec<u32> = own.iter().copied().filter(|&i| place.holds(&frame, projected(i))).collect();
        let steep = own.iter().filter(|&&i| projected(i).normal.dot(frame[2]) < CREASE.steep).count();
        let few = own.len() < CREASE.least_points;
        if few || steep as f64 > (1.0 - CREASE.on_sides) * own.len() as f64 {
            return None;
        }
        Some(self.window(place, frame, &thinned(&own), &[], &CREASE.starts))
    }
    /// The windows of two sides that meet about the place. Two sides alone are what the whole shows, if there
    /// is one.
    fn pairs(&self, place: &Place, own: &[u32], is_whole: bool) -> Vec<Window> {
        let own = thinned(own);
        let points: Vec<sides::Point> =
            own.iter().map(|&i| (self.known.points[i as usize], self.projected[i as usize].normal)).collect();
        let few = if is_whole { 2 } else { 1 };
        let Some((sides, label)) = sides::split(&points, place.noise, few) else { return Vec::new() };
        let pairs = (0..sides.len()).flat_map(|i| (i + 1..sides.len()).map(move |j| [i, j]));
        let meeting = |[i, j]: [usize; 2]| {
            let (frame, start) = sides::meeting([sides[i], sides[j]], place.at)?;
            Some(([i, j], frame, start / place.unit))
        };
        let mut lines: Vec<_> = pairs.filter_map(meeting).collect();
        lines.retain(|line| line.2.abs() <= CREASE.reach * place.radii[0]);
        lines.sort_by(|a, b| a.2.abs().total_cmp(&b.2.abs()));
        let window = |(pair, frame, start): ([usize; 2], Frame, f64)| {
            let (mut on, mut others) = (Vec::new(), Vec::new());
            for (&o, l) in own.iter().zip(&label) {
                if !place.holds(&frame, &self.projected[o as usize]) {
                    continue;
                }
                if pair.contains(l) {
                    on.push(o);
                } else if sides[*l].normal.dot(frame[2]) >= CREASE.steep {
                    others.push(o);
                }
            }
            (on.len() >= CREASE.least_points).then(|| self.window(place, frame, &on, &others, &[start]))
        };
        lines.into_iter().filter_map(window).take(CREASE.most_pairs).collect()
    }
    /// A window of these points.
    fn window(&self, place: &Place, frame: Frame, on: &[u32], others: &[u32], starts: &[f64]) -> Window {
        let &Place { at, unit, noise, .. } = place;
        let local = |i: &u32| {
            let d = (self.known.points[*i as usize] - at) * (1.0 / unit);
            frame.map(|axis| axis.dot(d))
        };
        Window {
            at,
            frame,
            unit,
            sigma: noise / unit,
            points: on.iter().map(local).collect(),
            misfit: self.misfits(on, noise).iter().sum(),
            others: others.iter().map(local).zip(self.misfits(others, noise)).collect(),
            starts: starts.to_vec(),
        }
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
        let faces = |i: u32| self.projected[i as usize].normal.dot(piece.frame[2]) >= CREASE.steep;
        scratch.own.retain(|&i| beside(local(i)) && faces(i));
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

/// Some of the points, where they are more than a window needs.
fn thinned(own: &[u32]) -> Vec<u32> {
    own.iter().copied().step_by(own.len().div_ceil(CREASE.most_points).max(1)).collect()
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
