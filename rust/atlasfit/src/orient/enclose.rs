//! Which way charts face, as far as what they enclose says so.
//!
//! In: charts as sheets in space, how they face each other, a sign per chart. Out: how likely the signs are,
//! and how each chart's place votes on its side.
//!
//! About a point of a closed surface that faces outward, the rest of the surface winds half a time (its
//! generalised winding number, Jacobson et al. 2013; as a test of orientation: Takayama et al. 2014, Xu et
//! al. 2023). Where signs are wrong it winds less. How far this holds is not known beforehand: a sheet
//! encloses nothing, and its winding varies about none instead. So both the winding's variance and the share
//! of contradicted agreement are unknowns of the likelihood, each estimated with the signs.

use super::connected::connected;
use super::constants::ORIENT;
use super::relations::charts_at;
use super::views::{Piece, Views};
use crate::atlas::{FittedChart, Membership, Relation};
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::sets::Sets;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// The scan's points as pieces of the charts that weigh most at them.
pub(crate) struct Sheets<'a> {
    /// Points.
    pub points: &'a [Vec3],
    /// Side of the square of surface that each point stands for.
    pub spacing: &'a [f32],
    /// The charts.
    pub fitted: &'a [FittedChart],
    /// Which charts each point belongs to.
    pub members: &'a Membership,
}

/// The pieces of one chart.
#[derive(Default)]
struct Pieces {
    all: Vec<Piece>,
    /// Their middle, weighted by area.
    center: Vec3,
    /// Sum of their normals times their areas.
    moment: Vec3,
    /// Beyond this distance from the middle they wind as one.
    far: f64,
}

/// A connected part of the atlas, and what it encloses.
pub(super) struct Part {
    /// Its charts, ascending.
    charts: Vec<u32>,
    /// The relations among them.
    relations: Vec<Relation>,
    /// The charts about whose middles its winding is known.
    samples: Vec<u32>,
    /// For each of its charts how often its own side winds about each sample.
    winding: Vec<Vec<f32>>,
    /// Number of samples that tell something of their own.
    independent: f64,
    /// Number of relations that do.
    independent_relations: f64,
    /// Sum of all agreement, whichever way.
    agreement: f64,
    /// For each of its charts which of the relations it is in.
    relations_of: Vec<Vec<u32>>,
    /// The sum of each chart's normals times their areas.
    moments: Vec<Vec3>,
}

/// What the signs of a part say.
pub(super) struct Said {
    /// How often the part winds about each sample.
    winding: Vec<f64>,
    /// Mean square distance of those from one half.
    square: f64,
    /// Agreement that the signs contradict.
    against: f64,
}

/// The parts of an atlas that have enough charts to enclose something, and the surface as pieces.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn parts(
    sheets: &Sheets<'_>,
    relations: &[Relation],
    ctx: &Context<'_>,
) -> Result<(Vec<Part>, Surface)> {
    let charts = sheets.fitted.len();
    let root = connected(charts, relations);
    let mut of_root: Vec<Vec<u32>> = vec![Vec::new(); charts];
    root.iter().zip(0..).for_each(|(&r, chart)| of_root[r as usize].push(chart));
    let mut among: Vec<Vec<Relation>> = vec![Vec::new(); charts];
    for (i, r) in relations.iter().enumerate() {
        ctx.check_at(i)?;
        among[root[r.a as usize] as usize].push(*r);
    }
    let surface = surface(sheets, ctx)?;
    // Charts overlap: as many of them as would cover the points once tell something of their own. Each of the
    // others repeats the relations of one of these.
    let members: usize = sheets.fitted.iter().map(|f| f.members.len()).sum();
    let once = surface.points as f64 / members.max(1) as f64;
    let enough = of_root.into_iter().zip(among).filter(|(charts, _)| charts.len() >= ORIENT.least_part);
    let parts = enough.map(|(charts, relations)| part(charts, relations, &surface.pieces, once, ctx));
    Ok((parts.collect::<Result<_>>()?, surface))
}

/// The surface as pieces.
pub(super) struct Surface {
    /// Those of each chart.
    pieces: Vec<Pieces>,
    /// Points that they stand for.
    points: usize,
}

impl Surface {
    /// What viewers see of each chart.
    ///
    /// # Errors
    /// Cancelled or out of time.
    pub(super) fn views(&self, ctx: &Context<'_>) -> Result<Views> {
        Views::of(&self.pieces.iter().map(|p| &p.all[..]).collect::<Vec<_>>(), ctx)
    }
}

/// The surface as pieces, one for each point that stands for any.
fn surface(sheets: &Sheets<'_>, ctx: &Context<'_>) -> Result<Surface> {
    let Sheets { points, spacing, fitted, members } = *sheets;
    let of_point = |i: usize| {
        let (row, stands_for) = members.compared(i);
        let strongest = charts_at(points[i], row, fitted).into_iter().next()?;
        let position = points[i] - strongest.offset;
        let side = f64::from(spacing[i]) * f64::from(stands_for).sqrt();
        Some((strongest.chart, stands_for, Piece { position, normal: strongest.normal, side }))
    };
    let chunks: Vec<Vec<(u32, u16, Piece)>> = (0..points.len().div_ceil(1024))
        .into_par_iter()
        .map(|k| {
            ctx.check()?;
            Ok((k * 1024..points.len().min((k + 1) * 1024)).filter_map(of_point).collect())
        })
        .collect::<Result<_>>()?;
    let mut out: Vec<Vec<Piece>> = (0..fitted.len()).map(|_| Vec::new()).collect();
    let mut points = 0;
    for (chart, stands_for, piece) in chunks.into_iter().flatten() {
        out[chart as usize].push(piece);
        points += usize::from(stands_for);
    }
    Ok(Surface { pieces: out.into_par_iter().map(Pieces::new).collect(), points })
}

fn part(
    charts: Vec<u32>,
    relations: Vec<Relation>,
    pieces: &[Pieces],
    once: f64,
    ctx: &Context<'_>,
) -> Result<Part> {
    let most = ORIENT.winding_samples.min(ORIENT.windings / charts.len()).max(1);
    let step = charts.len().div_ceil(most);
    let with_pieces = charts.iter().copied().filter(|&c| !pieces[c as usize].all.is_empty());
    let samples: Vec<u32> = with_pieces.step_by(step).collect();
    let middle = |&c: &u32| &pieces[c as usize].all[pieces[c as usize].all.len() / 2];
    let middles: Vec<&Piece> = samples.iter().map(middle).collect();
    let winding = charts
        .par_iter()
        .map(|&c| {
            ctx.check()?;
            Ok(middles.iter().map(|m| pieces[c as usize].winds(m) as f32).collect())
        })
        .collect::<Result<_>>()?;
    // Of many charts the winding is known about fewer.
    let independent = (once * charts.len() as f64).min(samples.len() as f64);
    let independent_relations = once * relations.len() as f64;
    let moments = charts.iter().map(|&c| pieces[c as usize].moment).collect();
    let agreement = relations.iter().map(|r| r.agreement.abs()).sum();
    let mut relations_of = vec![Vec::new(); charts.len()];
    for (r, i) in relations.iter().zip(0..) {
        ctx.check_at(i as usize)?;
        for c in [r.a, r.b] {
            relations_of[place(&charts, c)].push(i);
        }
    }
    Ok(Part {
        charts,
        relations,
        samples,
        winding,
        independent,
        independent_relations,
        agreement,
        relations_of,
        moments,
    })
}

impl Pieces {
    fn new(all: Vec<Piece>) -> Self {
        let (mut area, mut center, mut moment) = (0.0, Vec3::ZERO, Vec3::ZERO);
        for x in &all {
            let of = x.side * x.side;
            area += of;
            center += x.position * of;
            moment += x.normal * of;
        }
        center = center * (1.0 / f64::max(area, f64::MIN_POSITIVE));
        let radius = all.iter().map(|x| (x.position - center).norm()).fold(0.0, f64::max);
        Self { all, center, moment, far: ORIENT.winding_far * radius }
    }
    /// How often they wind about a piece: far away as one dipole (Barill et al. 2018).
    fn winds(&self, about: &Piece) -> f64 {
        let d = self.center - about.position;
        if d.dot(d) > self.far * self.far {
            return dipole(self.moment, d, about.side);
        }
        let of = |x: &Piece| dipole(x.normal * (x.side * x.side), x.position - about.position, about.side);
        self.all.iter().map(of).sum()
    }
}

/// How often a small piece winds about a point `-d` away; `moment` is its normal times its area. Regularised
/// within the spacing.
pub(crate) fn dipole(moment: Vec3, d: Vec3, spacing: f64) -> f64 {
    let r2 = d.dot(d) + spacing * spacing;
    moment.dot(d) / (4.0 * PI * r2 * r2.sqrt())
}

/// Which of a part's charts this one is.
fn place(charts: &[u32], chart: u32) -> usize {
    charts.partition_point(|&c| c < chart)
}

/// Whether signs contradict a relation.
fn contradicts(r: &Relation, signs: &[f64]) -> bool {
    r.agreement * signs[r.a as usize] * signs[r.b as usize] < 0.0
}

/// Mean square distance of windings from one half, and what is never known of them.
fn square(winding: &[f64]) -> f64 {
    let sum: f64 = winding.iter().map(|w| (w - 0.5).powi(2)).sum();
    sum / winding.len().max(1) as f64 + ORIENT.winding_error.powi(2)
}

impl Part {
    /// What these signs, one per chart of the atlas, say; they are turned if most of the part faces inward.
    pub(super) fn said(&self, signs: &mut [f64]) -> Said {
        let mut winding = vec![0.0; self.samples.len()];
        for (&c, of) in self.charts.iter().zip(&self.winding) {
            winding.iter_mut().zip(of).for_each(|(sum, &w)| *sum += signs[c as usize] * f64::from(w));
        }
        if winding.iter().sum::<f64>() < 0.0 {
            self.charts.iter().for_each(|&c| signs[c as usize] = -signs[c as usize]);
            winding.iter_mut().for_each(|w| *w = -*w);
        }
        let against =
            self.relations.iter().filter(|r| contradicts(r, signs)).map(|r| r.agreement.abs()).sum();
        Said { square: square(&winding), winding, against }
    }

    /// Turns a set of the part's charts if that is likelier than what is said.
    pub(super) fn turn(&self, set: &[u32], signs: &mut [f64], said: &mut Said) {
        let mut winding = said.winding.clone();
        let mut across = 0.0;
        for &c in set {
            let k = place(&self.charts, c);
            let twice = 2.0 * signs[c as usize];
            winding.iter_mut().zip(&self.winding[k]).for_each(|(sum, &w)| *sum -= twice * f64::from(w));
            for r in self.relations_of[k].iter().map(|&r| &self.relations[r as usize]) {
                let other = if r.a == c { r.b } else { r.a };
                if set.binary_search(&other).is_err() {
                    across += r.agreement * signs[r.a as usize] * signs[r.b as usize];
                }
            }
        }
        let inward = winding.iter().sum::<f64>() < 0.0;
        if inward {
            winding.iter_mut().for_each(|w| *w = -*w);
        }
        let then = Said { square: square(&winding), winding, against: said.against + across };
        if self.likelihood(&then) <= self.likelihood(said) {
            return;
        }
        *said = then;
        set.iter().for_each(|&c| signs[c as usize] = -signs[c as usize]);
        if inward {
            self.charts.iter().for_each(|&c| signs[c as usize] = -signs[c as usize]);
        }
    }

    /// Share of the agreement that is contradicted when so much is `against` the signs.
    fn contradicted(&self, against: f64) -> f64 {
        // One relation more of each kind, as none is certain beforehand (Laplace).
        let n = self.independent_relations;
        (against.max(0.0) / self.agreement.max(f64::MIN_POSITIVE) * n + 1.0) / (n + 2.0)
    }

    /// What it takes to tell which relations are contradicted, in nats a relation.
    fn entropy(&self, against: f64) -> f64 {
        let p = self.contradicted(against);
        -p * p.ln() - (1.0 - p) * (1.0 - p).ln()
    }

    /// Logarithm of the likelihood of what is said, in nats.
    pub(super) fn likelihood(&self, said: &Said) -> f64 {
        let related = self.independent_relations * self.entropy(said.against);
        -0.5 * self.independent * said.square.ln() - related
    }

    /// The same, if the part is a sheet: about its places it winds not at all, but for an error of a size
    /// that is not known either.
    pub(super) fn likelihood_of_sheet(&self, said: &Said) -> f64 {
        let square = said.winding.iter().map(|w| w * w).sum::<f64>() / said.winding.len().max(1) as f64;
        self.likelihood(&Said {
            winding: Vec::new(),
            square: square + ORIENT.winding_error.powi(2),
            against: said.against,
        })
    }

    /// How the winding votes on the sides of the charts that it is known about: in agreement, as the
    /// relations. Where all about a place is turned, its winding changes its sign.
    pub(super) fn votes(&self, said: &Said, signs: &[f64]) -> Vec<(u32, f64)> {
        let p = self.contradicted(said.against);
        let nats = self.independent_relations / self.agreement.max(f64::MIN_POSITIVE) * ((1.0 - p) / p).ln();
        let weight = self.independent / self.samples.len().max(1) as f64 / (said.square * nats);
        self.samples.iter().zip(&said.winding).map(|(&c, w)| (c, weight * w * signs[c as usize])).collect()
    }

    /// Whether a set of its charts faces against the rest: a scan sees a sheet from one side, so that all of
    /// it faces about the same way.
    pub(super) fn faces_back(&self, set: &[u32], signs: &[f64]) -> bool {
        let sum = |of_set: bool| -> Vec3 {
            let some = self.charts.iter().zip(&self.moments);
            let some = some.filter(|(c, _)| set.binary_search(c).is_ok() == of_set);
            some.map(|(&c, &moment)| moment * signs[c as usize]).fold(Vec3::ZERO, |a, b| a + b)
        };
        sum(true).dot(sum(false)) < 0.0
    }

    /// Turns a set of its charts if more is won by what viewers see than lost by relations; or the rest,
    /// which may be what faces wrongly. Returns whether it did.
    pub(super) fn turn_if_seen(&self, set: &[u32], views: &Views, signs: &mut [f64]) -> bool {
        let before = self.signs(signs);
        let was = self.seen_either_way(views, signs) + self.related(signs);
        set.iter().for_each(|&c| signs[c as usize] = -signs[c as usize]);
        let turned = self.seen_either_way(views, signs) + self.related(signs) > was;
        if !turned {
            self.put(&before, signs);
        }
        turned
    }

    /// Whether a set of its charts by itself encloses a body: about most of its places it winds nearer to
    /// half a time, one way or the other, than to none.
    pub(super) fn is_body(&self, set: &[u32], signs: &[f64]) -> bool {
        let inside: Vec<usize> =
            (0..self.samples.len()).filter(|&i| set.binary_search(&self.samples[i]).is_ok()).collect();
        let winds = |&i: &usize| -> f64 {
            set.iter().map(|&c| signs[c as usize] * f64::from(self.winding[place(&self.charts, c)][i])).sum()
        };
        let winding: Vec<f64> = inside.iter().map(winds).collect();
        let side = winding.iter().sum::<f64>().signum();
        2 * winding.iter().filter(|w| **w * side > 0.25).count() > winding.len()
    }

    /// Logarithm of the likelihood of what viewers see, in nats, of these signs or all of the opposite ones:
    /// of those that it returns with.
    fn seen_either_way(&self, views: &Views, signs: &mut [f64]) -> f64 {
        let mut turned = signs.to_vec();
        self.charts.iter().for_each(|&c| turned[c as usize] = -signs[c as usize]);
        let of = |signs: &[f64]| views.likelihood(&self.charts, signs);
        let (one, other) = rayon::join(|| of(signs), || of(&turned));
        if one < other {
            self.take(&turned, signs);
        }
        // A chart's points were seen one by one, and do not repeat its neighbours'.
        one.max(other) * self.charts.len() as f64
    }

    /// Logarithm of the likelihood of the relations, in nats.
    fn related(&self, signs: &[f64]) -> f64 {
        let against =
            self.relations.iter().filter(|r| contradicts(r, signs)).map(|r| r.agreement.abs()).sum();
        -self.independent_relations * self.entropy(against)
    }

    /// The connected sets of its charts that face against the part as a whole, each ascending; the largest
    /// first, no more than are tried.
    pub(super) fn facing_back(&self, signs: &[f64]) -> Vec<Vec<u32>> {
        let faces = |k: usize| self.moments[k] * signs[self.charts[k] as usize];
        let all = (0..self.charts.len()).map(faces).fold(Vec3::ZERO, |a, b| a + b);
        let back: Vec<bool> = (0..self.charts.len()).map(|k| faces(k).dot(all) < 0.0).collect();
        let mut sets = Sets::new(self.charts.len());
        for r in &self.relations {
            let [a, b] = [r.a, r.b].map(|c| place(&self.charts, c));
            if back[a] && back[b] {
                sets.join(a as u32, b as u32);
            }
        }
        let mut out: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for k in (0..self.charts.len()).filter(|&k| back[k]) {
            out.entry(sets.find(k as u32)).or_default().push(self.charts[k]);
        }
        let mut out: Vec<Vec<u32>> = out.into_values().filter(|s| s.len() >= ORIENT.least_part).collect();
        out.sort_by_key(|set| std::cmp::Reverse(set.len()));
        out.truncate(ORIENT.turned_sets);
        out
    }

    /// Whether the part encloses a body, so that it has two sides: about most places it winds nearer to half
    /// a time than to none.
    pub(super) fn encloses(&self, said: &Said) -> bool {
        2 * said.winding.iter().filter(|w| **w > 0.25).count() > said.winding.len()
    }

    /// Its charts, ascending.
    pub(super) fn charts(&self) -> &[u32] {
        &self.charts
    }

    /// The signs of its charts, in their order.
    pub(super) fn signs(&self, all: &[f64]) -> Vec<f64> {
        self.charts.iter().map(|&c| all[c as usize]).collect()
    }

    /// Gives its charts these signs, one each in their order.
    pub(super) fn put(&self, signs: &[f64], all: &mut [f64]) {
        self.charts.iter().zip(signs).for_each(|(&c, &sign)| all[c as usize] = sign);
    }

    /// Takes the signs of its charts.
    pub(super) fn take(&self, from: &[f64], to: &mut [f64]) {
        self.charts.iter().for_each(|&c| to[c as usize] = from[c as usize]);
    }
}
