//! The charts that are merged, who owns which face, and which charts are neighbours.

use crate::unwrap::chart::Chart;
use crate::unwrap::surface::{NONE, Surface};

/// Charts and who owns which face.
pub(crate) struct Charts {
    /// Charts by number; `None` where a chart has become part of another.
    pub list: Vec<Option<Chart>>,
    /// Chart per face; [`NONE`] for faces in none.
    pub owner: Vec<u32>,
    /// Place of each face in its chart.
    pub index_of: Vec<u32>,
    /// Charts that are not merged with each other.
    pub kept_apart: Vec<bool>,
}

impl Charts {
    /// Numbers the charts of a surface of `faces` faces, of which they need not cover all.
    pub(crate) fn new(faces: usize, charts: Vec<Chart>) -> Self {
        let (mut owner, mut index_of) = (vec![NONE; faces], vec![NONE; faces]);
        for (id, c) in charts.iter().enumerate() {
            for (i, &f) in c.faces.iter().enumerate() {
                owner[f as usize] = id as u32;
                index_of[f as usize] = i as u32;
            }
        }
        let kept_apart = vec![false; charts.len()];
        Self { list: charts.into_iter().map(Some).collect(), owner, index_of, kept_apart }
    }

    /// Replaces charts `a` and `b` by `merged`; returns its id.
    pub(super) fn replace(&mut self, a: u32, b: u32, merged: Chart) -> u32 {
        let id = self.list.len() as u32;
        self.list[a as usize] = None;
        self.list[b as usize] = None;
        self.list.push(None);
        self.put(id, merged);
        self.kept_apart.push(self.kept_apart[a as usize] || self.kept_apart[b as usize]);
        id
    }

    /// Which of two charts a face belongs to, the second if so, and its place there.
    pub(super) fn place_in(&self, ids: [u32; 2], face: usize) -> Option<(bool, u32)> {
        let which = ids.iter().position(|&id| id == self.owner[face])?;
        Some((which == 1, self.index_of[face]))
    }

    /// Gives a chart this number, and it its faces.
    pub(super) fn put(&mut self, id: u32, chart: Chart) {
        for (i, &f) in chart.faces.iter().enumerate() {
            self.owner[f as usize] = id;
            self.index_of[f as usize] = i as u32;
        }
        self.list[id as usize] = Some(chart);
    }
}

/// A border edge between two charts.
#[derive(Clone, Copy)]
pub(super) struct BorderEdge {
    /// The charts, the smaller number first.
    pub charts: (u32, u32),
    /// Its length on the surface.
    pub length: f64,
    /// What it costs as a seam.
    pub cost: f64,
}

/// The borders of charts.
pub(super) struct Borders {
    /// Every edge between two charts, sorted by these.
    pub edges: Vec<BorderEdge>,
    /// What each chart's border costs as a seam.
    pub cost: Vec<f64>,
}

impl Borders {
    /// Looks for them.
    pub(super) fn find(s: &Surface, charts: &Charts) -> Self {
        let mut edges: Vec<BorderEdge> = Vec::new();
        let mut cost = vec![0f64; charts.list.len()];
        for (id, chart) in charts.list.iter().enumerate() {
            let Some(chart) = chart else { continue };
            cost[id] = chart.seams(s).cost;
            for &(i, k) in &chart.border {
                let f = chart.faces[i as usize] as usize;
                let h = s.twin[f][k as usize];
                if h != NONE {
                    let other = charts.owner[h as usize / 3];
                    if other > id as u32 && other != NONE {
                        let (charts, length) = ((id as u32, other), f64::from(s.length[f][k as usize]));
                        edges.push(BorderEdge { charts, length, cost: s.cost(f, k as usize) });
                    }
                }
            }
        }
        edges.sort_by_key(|e| e.charts);
        Self { edges, cost }
    }

    /// The pairs of charts that share an edge, sorted.
    pub(super) fn pairs(&self) -> Vec<(u32, u32)> {
        let mut pairs: Vec<(u32, u32)> = self.edges.iter().map(|e| e.charts).collect();
        pairs.dedup();
        pairs
    }

    /// Whether two charts share an edge.
    pub(super) fn touch(&self, a: u32, b: u32) -> bool {
        let pair = (a.min(b), a.max(b));
        self.edges.binary_search_by(|e| e.charts.cmp(&pair)).is_ok()
    }
}
