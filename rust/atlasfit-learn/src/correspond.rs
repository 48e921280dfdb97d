//! Correspondence: the same place of the same chart on two answers.
//!
//! In: answers to two shapes. Out: for points of the one their counterparts on the other; how far these are
//! from the known ones of made-up shapes. Source: *Deep Manifold Prior*, supplement A ("Shape
//! correspondence").

use crate::data::{Dataset, Split};
use crate::error::{Error, Result};
use crate::eval::{Answer, Answers, Input, answers};
use crate::model::Model;
use crate::shapes::{Family, Shape};
use atlasfit::numeric::vec3::Vec3;
use atlasfit::run::Context;
use atlasfit::spatial::Neighbours;
use rayon::prelude::*;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Points of a shape whose counterparts are looked for.
const POINTS: usize = 300;
/// Points of the graph that distances along a shape are measured on, and neighbours of each.
const GRAPH: usize = 3000;
const LINKS: usize = 8;

/// Mean errors, lengths of the normalised frame.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Errors {
    /// The family.
    pub family: String,
    /// Pairs of shapes.
    pub pairs: usize,
    /// From the model's counterpart to the known one, straight.
    pub euclidean: f64,
    /// The same along the other shape, from the place on it that is nearest to the counterpart; infinite ways
    /// are left out.
    pub geodesic: f64,
    /// Straight, where the counterpart is simply the nearest place of the other shape: no model.
    pub nearest: f64,
}

/// For each point the sample of `b` that has the place on its chart of the sample of `a` nearest to the
/// point.
///
/// # Errors
/// [`atlasfit::Error::InvalidArgument`] for answers of different models; cancelled or out of time.
pub fn carry(points: &[Vec3], a: &Answer, b: &Answer, ctx: &Context<'_>) -> atlasfit::Result<Vec<Vec3>> {
    if (a.charts, a.side) != (b.charts, b.side) {
        return Err(atlasfit::Error::invalid("answers of different sizes", "Take both from one model"));
    }
    let tree = Neighbours::build(&a.samples, ctx)?;
    Ok(points.iter().map(|p| b.samples[tree.nearest_one(*p).index as usize]).collect())
}

/// Errors on pairs of neighbouring shapes of a made-up collection's test split, family by family.
///
/// # Errors
/// [`Error::BadFile`] for a collection that was not made by the generator; cancelled or out of time.
pub fn errors(
    model: &Model,
    data: &Dataset,
    input: Input,
    pairs: usize,
    side: usize,
    ctx: &Context<'_>,
) -> Result<Vec<Errors>> {
    if data.manifest.source != "generator" {
        let what = "its shapes have no known correspondences";
        return Err(Error::bad_file(&data.folder, what, "Give a collection that the generator made"));
    }
    let all = Answers::read(data, Split::Test)?;
    let mut out = Vec::new();
    for (number, family) in Family::ALL.into_iter().enumerate() {
        let of: Vec<usize> =
            (0..all.shapes.len()).filter(|&i| usize::from(all.shapes.family[i]) == number).collect();
        let found: Vec<[f64; 4]> = of
            .windows(2)
            .take(pairs)
            .collect::<Vec<_>>()
            .into_par_iter()
            .map(|pair| {
                let both = [pair[0], pair[1]].map(|i| -> Result<Answer> {
                    let flat: Vec<f32> = match input {
                        Input::Points => all.shapes.points_of(i).to_vec(),
                        Input::Image => crate::data::pixels(all.shapes.picture_of(i, 0)).collect(),
                    };
                    let mut one = answers(model, input, &flat, 1, side)?;
                    Ok(one.swap_remove(0))
                });
                let [a, b] = both;
                let ids = [pair[0], pair[1]].map(|i| Shape::new(family, all.shapes.id[i]));
                Ok(of_pair(&ids, [&a?, &b?], ctx)?)
            })
            .collect::<Result<_>>()?;
        let n: f64 = found.iter().map(|f| f[3]).sum();
        let mean = |k: usize| found.iter().map(|f| f[k]).sum::<f64>() / n.max(1.0);
        out.push(Errors {
            family: family.name().into(),
            pairs: found.len(),
            euclidean: mean(0),
            geodesic: mean(1),
            nearest: mean(2),
        });
    }
    Ok(out)
}

/// Summed errors over the points of a pair that both shapes have, and their number.
fn of_pair([a, b]: &[Shape; 2], [of_a, of_b]: [&Answer; 2], ctx: &Context<'_>) -> atlasfit::Result<[f64; 4]> {
    let points = a.sample(POINTS, 11, ctx)?;
    let known: Vec<(Vec3, Vec3)> =
        points.into_iter().filter_map(|(p, place)| Some((p, b.find(place)?))).collect();
    let on_b: Vec<Vec3> = b.sample(GRAPH, 12, ctx)?.into_iter().map(|s| s.0).collect();
    let tree = Neighbours::build(&on_b, ctx)?;
    let ways = Ways::new(&on_b, &tree);
    let from: Vec<Vec3> = known.iter().map(|k| k.0).collect();
    let carried = carry(&from, of_a, of_b, ctx)?;
    let mut sums = [0.0; 4];
    for ((p, truth), c) in known.iter().zip(&carried) {
        ctx.check()?;
        let near = |q: Vec3| tree.nearest_one(q);
        let along = ways.length(near(*c).index, near(*truth).index);
        sums[0] += c.dist2(*truth).sqrt();
        sums[1] += if along.is_finite() { along } else { c.dist2(*truth).sqrt() };
        sums[2] += on_b[near(*p).index as usize].dist2(*truth).sqrt();
        sums[3] += 1.0;
    }
    Ok(sums)
}

/// Ways along a shape, from point to point.
struct Ways {
    links: Vec<Vec<(u32, f64)>>,
}

impl Ways {
    fn new(points: &[Vec3], tree: &Neighbours) -> Self {
        let mut links = vec![Vec::new(); points.len()];
        let mut found = Vec::new();
        for (i, p) in points.iter().enumerate() {
            tree.nearest(*p, LINKS + 1, &mut found);
            for f in found.iter().filter(|f| f.index as usize != i) {
                links[i].push((f.index, f.dist2.sqrt()));
                links[f.index as usize].push((i as u32, f.dist2.sqrt()));
            }
        }
        Self { links }
    }

    /// Length of the shortest way; infinite where there is none (Dijkstra 1959).
    fn length(&self, from: u32, to: u32) -> f64 {
        let mut best = vec![f64::INFINITY; self.links.len()];
        best[from as usize] = 0.0;
        // Lengths of 0 and more are ordered as their bits are.
        let mut open = BinaryHeap::from([Reverse((0u64, from))]);
        while let Some(Reverse((bits, at))) = open.pop() {
            let so_far = f64::from_bits(bits);
            if at == to {
                return so_far;
            }
            if so_far > best[at as usize] {
                continue;
            }
            for &(next, length) in &self.links[at as usize] {
                if so_far + length < best[next as usize] {
                    best[next as usize] = so_far + length;
                    open.push(Reverse(((so_far + length).to_bits(), next)));
                }
            }
        }
        f64::INFINITY
    }
}
