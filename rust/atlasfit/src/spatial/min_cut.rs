//! The shortest cut between two sets of vertices: minimum cut by maximum flow (Dinic 1970).
//!
//! In: edges with lengths, and which vertices lie on either side for sure. Out: a side for each vertex, so
//! that edges between the sides are as short as can be in sum.

use crate::error::Result;
use crate::run::Context;

/// What the sum of all lengths counts as: lengths are rounded to whole parts of it, so that flows are exact.
const WHOLE: f64 = (1u64 << 50) as f64;
const NONE: u32 = u32::MAX;

/// Which side a vertex is on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    /// The first side, for sure.
    First,
    /// The second side, for sure.
    Second,
    /// As the cut says.
    Open,
}

/// Edges as arcs of a flow network: arc `2 e` and `2 e + 1` are the two directions of edge `e`.
struct Network {
    /// The first arc of each vertex.
    start: Vec<u32>,
    /// Arcs by the vertex that they leave.
    arcs: Vec<u32>,
    /// Where each arc leads.
    to: Vec<u32>,
    /// What may still flow along it.
    left: Vec<u64>,
}

/// Whether each vertex is on the second side of the shortest cut; among the shortest that one which leaves
/// the first side the fewest. An edge is its two vertices and its length, not negative.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn min_cut(edges: &[(u32, u32, f64)], sides: &[Side], ctx: &Context<'_>) -> Result<Vec<bool>> {
    // Vertices of a sure side are one: 0 and 1.
    let mut open = 1;
    let name: Vec<u32> = (sides.iter())
        .map(|side| match side {
            Side::First => 0,
            Side::Second => 1,
            Side::Open => {
                open += 1;
                open
            }
        })
        .collect();
    let mut flow = Network::new(open as usize + 1, edges, &name, ctx)?;
    loop {
        let level = flow.levels(ctx)?;
        if level[1] == NONE {
            return Ok(name.iter().map(|&v| level[v as usize] == NONE).collect());
        }
        flow.fill(&level, ctx)?;
    }
}

impl Network {
    fn new(vertices: usize, edges: &[(u32, u32, f64)], name: &[u32], ctx: &Context<'_>) -> Result<Self> {
        let sum: f64 = edges.iter().map(|e| e.2).sum();
        let (mut to, mut left) = (Vec::new(), Vec::new());
        for (i, &(a, b, length)) in edges.iter().enumerate() {
            ctx.check_at(i)?;
            let [a, b] = [a, b].map(|v| name[v as usize]);
            if a != b {
                to.extend([b, a]);
                left.extend([(length / sum.max(f64::MIN_POSITIVE) * WHOLE) as u64; 2]);
            }
        }
        let from = |arc: usize| to[arc ^ 1] as usize;
        let mut start = vec![0u32; vertices + 1];
        (0..to.len()).for_each(|arc| start[from(arc) + 1] += 1);
        (0..vertices).for_each(|v| start[v + 1] += start[v]);
        let (mut at, mut arcs) = (start.clone(), vec![0; to.len()]);
        for arc in 0..to.len() {
            ctx.check_at(arc)?;
            let at = &mut at[from(arc)];
            arcs[*at as usize] = arc as u32;
            *at += 1;
        }
        Ok(Self { start, arcs, to, left })
    }

    /// How many arcs each vertex is away from the first side along arcs that are not full; [`NONE`] where
    /// none leads.
    fn levels(&self, ctx: &Context<'_>) -> Result<Vec<u32>> {
        let mut level = vec![NONE; self.start.len() - 1];
        level[0] = 0;
        let mut queue = vec![0u32];
        let mut next = 0;
        while let Some(&v) = queue.get(next) {
            ctx.check_at(next)?;
            next += 1;
            for &arc in self.of(v) {
                let to = self.to[arc as usize];
                if self.left[arc as usize] > 0 && level[to as usize] == NONE {
                    level[to as usize] = level[v as usize] + 1;
                    queue.push(to);
                }
            }
        }
        Ok(level)
    }

    /// Fills every way along which the levels rise.
    fn fill(&mut self, level: &[u32], ctx: &Context<'_>) -> Result<()> {
        let mut tried = self.start.clone();
        let mut way: Vec<u32> = Vec::new();
        let mut steps = 0;
        let mut v = 0u32;
        loop {
            steps += 1;
            ctx.check_at(steps)?;
            if v == 1 {
                let most = way.iter().map(|&arc| self.left[arc as usize]).min().unwrap_or(0);
                let mut full = way.len();
                for (i, &arc) in way.iter().enumerate().rev() {
                    self.left[arc as usize] -= most;
                    self.left[arc as usize ^ 1] += most;
                    if self.left[arc as usize] == 0 {
                        full = i;
                    }
                }
                v = way.get(full).map_or(0, |&arc| self.to[arc as usize ^ 1]);
                way.truncate(full);
                continue;
            }
            let end = self.start[v as usize + 1];
            let at = &mut tried[v as usize];
            let fits = |arc: u32| {
                let to = self.to[arc as usize] as usize;
                self.left[arc as usize] > 0 && level[to] == level[v as usize] + 1
            };
            while *at < end && !fits(self.arcs[*at as usize]) {
                *at += 1;
            }
            if *at < end {
                let arc = self.arcs[*at as usize];
                way.push(arc);
                v = self.to[arc as usize];
            } else if let Some(arc) = way.pop() {
                // A dead end: back, and past the arc that led here.
                v = self.to[arc as usize ^ 1];
                tried[v as usize] += 1;
            } else {
                return Ok(());
            }
        }
    }

    /// The arcs that leave a vertex.
    fn of(&self, v: u32) -> &[u32] {
        &self.arcs[self.start[v as usize] as usize..self.start[v as usize + 1] as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::Run;
    use proptest::prelude::*;

    fn length(edges: &[(u32, u32, f64)], second: &[bool]) -> f64 {
        edges.iter().filter(|e| second[e.0 as usize] != second[e.1 as usize]).map(|e| e.2).sum()
    }

    proptest! {
        #[test]
        fn no_other_cut_of_a_small_graph_is_shorter(
            edges in prop::collection::vec((0u32..8, 0u32..8, 0u32..100), 1..24),
        ) {
            let edges: Vec<_> = edges.into_iter().map(|(a, b, l)| (a, b, f64::from(l))).collect();
            let mut sides = [Side::Open; 8];
            (sides[0], sides[7]) = (Side::First, Side::Second);
            let found = Run::default().execute(|ctx| min_cut(&edges, &sides, ctx)).unwrap();
            prop_assert!(!found[0] && found[7]);
            let all = (0u32..64).map(|bits| {
                let side = |v: u32| v == 7 || v > 0 && bits >> (v - 1) & 1 == 1;
                length(&edges, &(0..8).map(side).collect::<Vec<_>>())
            });
            let least = all.fold(f64::INFINITY, f64::min);
            prop_assert!(length(&edges, &found) <= least + 1e-9, "{} and {least}", length(&edges, &found));
        }
    }
}
