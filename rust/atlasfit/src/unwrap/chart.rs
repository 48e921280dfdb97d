//! One chart: faces with their own vertex numbering and planar positions.

use super::page_limits::PageLimits;
use super::planar::{hull, thinned};
use super::surface::{NONE, Surface};
use crate::numeric::plane::{corners, twice_area};
use crate::run::Context;

/// A connected piece of the surface, flattened. Units: the surface has area 1.
#[derive(Clone, Debug, Default)]
pub(crate) struct Chart {
    /// Faces of the surface.
    pub faces: Vec<u32>,
    /// Chart-local vertices per face.
    pub tris: Vec<[u32; 3]>,
    /// Planar position per chart-local vertex.
    pub uv: Vec<[f64; 2]>,
    /// Edges not glued inside the chart: (index into `faces`, slot). Surface borders are among them.
    pub border: Vec<(u32, u8)>,
    /// Area on the surface.
    pub area: f64,
    /// Area whose stretch is beyond the bound.
    pub over: f64,
    /// What it wastes of the page: see [`wasted`](Self::wasted).
    pub waste: f64,
    /// Whether its sides lie along the axes of its positions: it is put on the page in quarter turns only.
    pub straight: bool,
}

/// Seams: how long they are, and what that costs.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Seams {
    pub length: f64,
    pub cost: f64,
}

impl Seams {
    /// Both.
    pub(crate) fn with(self, other: Self) -> Self {
        Self { length: self.length + other.length, cost: self.cost + other.cost }
    }

    /// Without some of them.
    pub(crate) fn without(self, other: Self) -> Self {
        Self { length: self.length - other.length, cost: self.cost - other.cost }
    }
}

impl Chart {
    /// Number of chart-local vertices.
    pub(crate) fn vertices(&self) -> usize {
        self.uv.len()
    }

    /// Builds the local mesh of `faces`. `across(i, f, k)` gives the place in `faces` of the face beyond edge
    /// `k` of face `f`, which is at place `i`, if the edge is to be glued. Positions start at zero. `None`
    /// when the run is to stop: the caller checks.
    pub(crate) fn glue(
        s: &Surface,
        faces: Vec<u32>,
        across: impl Fn(usize, usize, usize) -> Option<u32>,
        ctx: &Context<'_>,
    ) -> Option<Self> {
        let mut corner = vec![NONE; faces.len() * 3];
        let mut n = 0;
        for i in 0..faces.len() {
            ctx.check_at(i).ok()?;
            for k in 0..3 {
                if corner[3 * i + k] != NONE {
                    continue;
                }
                // Turn round the vertex through glued edges, both ways, naming every corner met.
                corner[3 * i + k] = n;
                for forward in [true, false] {
                    let (mut f, mut c) = (i, k);
                    loop {
                        let slot = if forward { c } else { (c + 2) % 3 };
                        let Some(g) = across(f, faces[f] as usize, slot) else { break };
                        let h = s.twin[faces[f] as usize][slot] as usize % 3;
                        // The twin runs backwards: our vertex is its end, or its start when turning back.
                        (f, c) = (g as usize, if forward { (h + 1) % 3 } else { h });
                        if corner[3 * f + c] != NONE {
                            break;
                        }
                        corner[3 * f + c] = n;
                    }
                }
                n += 1;
            }
        }
        let tris: Vec<[u32; 3]> = corner.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
        let mut border = Vec::new();
        for (i, &f) in faces.iter().enumerate() {
            ctx.check_at(i).ok()?;
            for k in 0..3 {
                if across(i, f as usize, k).is_none() {
                    border.push((i as u32, k as u8));
                }
            }
        }
        let area = faces.iter().map(|&f| s.area[f as usize]).sum();
        Some(Self {
            faces,
            tris,
            uv: vec![[0.0; 2]; n as usize],
            border,
            area,
            over: 0.0,
            waste: 0.0,
            straight: false,
        })
    }

    /// Takes border edges off the border whose two sides have the same end points: they are inside.
    /// `place(f)` gives the place of face `f` if it belongs to the chart.
    pub(crate) fn zip(&mut self, s: &Surface, place: impl Fn(usize) -> Option<u32>) {
        let (faces, tris) = (&self.faces, &self.tris);
        self.border.retain(|&(i, k)| {
            let h = s.twin[faces[i as usize] as usize][k as usize];
            if h == NONE {
                return true;
            }
            let Some(j) = place(h as usize / 3) else { return true };
            let (t, u) = (tris[i as usize], tris[j as usize]);
            let (k, l) = (k as usize, h as usize % 3);
            t[k] != u[(l + 1) % 3] || t[(k + 1) % 3] != u[l]
        });
    }

    /// The two end points of every border edge, one after the other. All of the chart's convex hull is among
    /// them.
    pub(crate) fn outline(&self) -> Vec<[f64; 2]> {
        let ends = |&(i, k): &(u32, u8)| {
            let (t, k) = (self.tris[i as usize], usize::from(k));
            [t[k], t[(k + 1) % 3]].map(|v| self.uv[v as usize])
        };
        self.border.iter().flat_map(ends).collect()
    }

    /// Its border, as seams on the surface.
    pub(crate) fn seams(&self, s: &Surface) -> Seams {
        let mut out = Seams::default();
        for &(i, k) in &self.border {
            let (f, k) = (self.faces[i as usize] as usize, usize::from(k));
            out.length += f64::from(s.length[f][k]);
            out.cost += s.cost(f, k);
        }
        out
    }

    /// Rest triangles of the faces.
    pub(crate) fn rest(&self, s: &Surface) -> Vec<[f64; 3]> {
        self.faces.iter().map(|&f| s.rest[f as usize]).collect()
    }

    /// Its area in the plane; negative for one that is mirrored.
    pub(crate) fn flat_area(&self) -> f64 {
        let area = |t: &[u32; 3]| {
            let [a, b, c] = corners(*t, &self.uv);
            0.5 * twice_area(a, b, c)
        };
        self.tris.iter().map(area).sum()
    }

    /// Scales it to the area that it has on the surface, and turns one that is mirrored over.
    pub(crate) fn take_own_area(&mut self) {
        let flat = self.flat_area();
        let size = if flat == 0.0 { 1.0 } else { (self.area / flat.abs()).sqrt() };
        let side = size * if flat < 0.0 { -1.0 } else { 1.0 };
        self.uv.iter_mut().for_each(|[u, v]| (*u, *v) = (*u * side, *v * size));
    }

    /// The chart of one face.
    pub(crate) fn single(s: &Surface, f: u32) -> Self {
        let [l, x, y] = s.rest[f as usize];
        Self {
            faces: vec![f],
            tris: vec![[0, 1, 2]],
            uv: vec![[0.0, 0.0], [l, 0.0], [x, y]],
            border: vec![(0, 0), (0, 1), (0, 2)],
            area: s.area[f as usize],
            over: 0.0,
            waste: 0.0,
            straight: false,
        }
    }

    /// What a chart wastes when packed, roughly: the area of its convex hull that it leaves empty, and what
    /// it makes the page larger by being longer than the page.
    pub(crate) fn wasted(&self, page: PageLimits) -> f64 {
        wasted(&self.outline(), self.area, page)
    }
}

/// What a chart of this area and outline wastes, see [`Chart::wasted`].
pub(crate) fn wasted(outline: &[[f64; 2]], area: f64, page: PageLimits) -> f64 {
    if !page.counts {
        return 0.0;
    }
    let hull = hull(outline);
    let of_hull: f64 =
        (0..hull.len()).map(|i| twice_area(hull[0], hull[i], hull[(i + 1) % hull.len()])).sum::<f64>() * 0.5;
    let few = thinned(&hull);
    let longest = (few.iter())
        .flat_map(|p| few.iter().map(|q| (p[0] - q[0]).powi(2) + (p[1] - q[1]).powi(2)))
        .fold(0.0, f64::max);
    (of_hull - area).max(0.0) + (longest / page.length2 - 1.0).max(0.0)
}
