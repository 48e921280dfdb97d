//! Merging in rounds until nothing fits any more.
//!
//! Each round matches neighbours by how much of the smaller one's border a merge removes, flattens the merged
//! pairs in parallel, and keeps those that stretch little enough and are injective.

use super::charts::{Borders, Charts};
use super::constants::MERGE;
use super::join::join;
use super::limits::MergeLimits;
use crate::error::Result;
use crate::run::Context;
use crate::unwrap::chart::Chart;
use crate::unwrap::constants::UNWRAP;
use crate::unwrap::surface::Surface;
use rayon::prelude::*;
use rustc_hash::FxHashSet;

/// A merge that may be tried.
struct Candidate {
    /// The higher, the sooner it is tried.
    score: f64,
    charts: (u32, u32),
}

/// Merges until nothing fits any more.
pub(crate) fn merge(s: &Surface, charts: &mut Charts, bound: f64, ctx: &Context<'_>) -> Result<()> {
    merge_in(MERGE.passes, s, charts, bound, ctx)
}

/// Merges what fits since borders have moved.
pub(super) fn merge_again(s: &Surface, charts: &mut Charts, bound: f64, ctx: &Context<'_>) -> Result<()> {
    merge_in(1, s, charts, bound, ctx)
}

/// Merges until nothing fits any more, in so many passes.
fn merge_in(passes: usize, s: &Surface, charts: &mut Charts, bound: f64, ctx: &Context<'_>) -> Result<()> {
    // Partners that each chart was refused with.
    let mut refused: Vec<Vec<u32>> = vec![Vec::new(); charts.list.len()];
    // Pairs that were refused as they are.
    let mut tried: FxHashSet<(u32, u32)> = FxHashSet::default();
    let mut left = passes - 1;
    loop {
        ctx.check()?;
        let borders = Borders::find(s, charts);
        ctx.check()?;
        let candidates = candidates(charts, &borders, &refused);
        ctx.check()?;
        if candidates.is_empty() {
            // Refusals were handed down while charts grew; with all grown, each is tried afresh once.
            if left == 0 {
                return Ok(());
            }
            left -= 1;
            refused.iter_mut().for_each(Vec::clear);
            continue;
        }
        let chosen = matching(candidates, charts.list.len());
        // Once nothing else fits, darts may stay open; where stretch is allowed, all is tried hard.
        let last = left == 0;
        let hard = last && bound > MERGE.loose;
        let limits = |pair| MergeLimits {
            bound,
            mismatch: MERGE.mismatch,
            over: if hard { UNWRAP.beyond } else { MERGE.over * UNWRAP.beyond },
            hard,
            whole: hard || !tried.contains(&pair),
            darts: last,
        };
        let results: Vec<Option<Chart>> = chosen
            .par_iter()
            .map(|&(a, b)| {
                if ctx.check().is_err() {
                    return None;
                }
                join(s, charts, (a, b), limits((a, b)), ctx)
            })
            .collect();
        ctx.check()?;
        for (&(a, b), result) in chosen.iter().zip(results) {
            ctx.check()?;
            match result {
                Some(merged) => {
                    let id = charts.replace(a, b, merged);
                    hand_down(&mut refused, &borders, (a, b), id);
                }
                None => {
                    refused[a as usize].push(b);
                    refused[b as usize].push(a);
                    tried.insert((a, b));
                }
            }
        }
    }
}

/// The merges that were not refused, best first.
fn candidates(charts: &Charts, borders: &Borders, refused: &[Vec<u32>]) -> Vec<Candidate> {
    let mut out = Vec::new();
    let area = |c: u32| charts.list[c as usize].as_ref().map_or(0.0, |c| c.area);
    let apart = |c: u32| charts.kept_apart[c as usize];
    for edges in borders.edges.chunk_by(|x, y| x.charts == y.charts) {
        let (a, b) = edges[0].charts;
        if refused[a as usize].contains(&b) || apart(a) && apart(b) {
            continue;
        }
        let shared: f64 = edges.iter().map(|e| e.cost).sum();
        let border = borders.cost[a as usize].min(borders.cost[b as usize]);
        // Half way between the share of the smaller one's border and what it costs against its size.
        let score = shared / (border * area(a).min(area(b)).sqrt()).max(1e-300).sqrt();
        out.push(Candidate { score, charts: (a, b) });
    }
    out.sort_by(|x, y| y.score.total_cmp(&x.score).then(x.charts.cmp(&y.charts)));
    out
}

/// The pairs to try in this round: near-best ones only, as the next round sees what they leave; no chart
/// twice.
fn matching(candidates: Vec<Candidate>, charts: usize) -> Vec<(u32, u32)> {
    let floor = candidates[0].score * MERGE.floor;
    let mut busy = vec![false; charts];
    let mut chosen = Vec::new();
    for Candidate { score, charts: (a, b) } in candidates {
        if score < floor {
            break;
        }
        if !busy[a as usize] && !busy[b as usize] {
            busy[a as usize] = true;
            busy[b as usize] = true;
            chosen.push((a, b));
        }
    }
    chosen
}

/// Gives chart `id`, made of two, their refusals: a neighbour that did not fit one half, and does not touch
/// the other or does not fit it either, will not fit the whole.
fn hand_down(refused: &mut Vec<Vec<u32>>, borders: &Borders, (a, b): (u32, u32), id: u32) {
    let mut both = std::mem::take(&mut refused[a as usize]);
    let other = std::mem::take(&mut refused[b as usize]);
    both.retain(|&p| other.contains(&p) || !borders.touch(p, b));
    both.extend(other.into_iter().filter(|&p| !borders.touch(p, a)));
    both.sort_unstable();
    both.dedup();
    for &p in &both {
        refused[p as usize].push(id);
    }
    refused.push(both);
}
