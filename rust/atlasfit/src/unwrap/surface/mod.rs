//! The mesh as the unwrapper sees it: normalised positions, face frames, and which faces hang together.
//!
//! In: the user's triangle mesh and constraints. Out: a [`Surface`] in which every edge joins at most two
//! consistently oriented faces. Non-manifold edges, edges with clashing orientation, group borders and user
//! seams are cut here, so that nothing later has to know about them; the user's mesh itself is never changed.

mod cells;
mod constants;
mod twins;
mod walk;

use super::options::UnwrapOptions;
use super::page_limits::PageLimits;
use crate::error::{Error, Result};
use crate::geometry::TriMesh;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::sets::Sets;
pub(crate) use cells::Cells;
use constants::SURFACE;
use std::sync::Arc;
pub(crate) use twins::NONE;
use twins::{Twins, pair_edges};

/// The surface, scaled to total area 1.
pub(crate) struct Surface {
    /// Vertices per face, as given; those of open edges at one place are one.
    pub tri: Vec<[u32; 3]>,
    /// Opposite half-edge (`3 * face + slot`) of the edge from corner `slot` to the next; [`NONE`] at
    /// borders.
    pub twin: Vec<[u32; 3]>,
    /// Unit normals.
    pub normal: Vec<Vec3>,
    /// Areas; they sum to 1.
    pub area: Vec<f64>,
    /// Isometric planar triangle `[l, x, y]`: corners (0,0), (l,0), (x,y); thickened where degenerate.
    pub rest: Vec<[f64; 3]>,
    /// Edge lengths by slot.
    pub length: Vec<[f32; 3]>,
    /// What each edge costs as a seam per unit of its length, by slot; `None` where all cost 1. Found by
    /// `prices`.
    pub price: Option<Vec<[f32; 3]>>,
    /// What counts of the page while charts are made.
    pub page: PageLimits,
    /// Positions.
    pub pos: Arc<Vec<Vec3>>,
    /// Faces that take part; the others repeat a vertex or have a non-finite one.
    pub usable: Vec<bool>,
    /// Connected faces of one polygon, which stay together where possible; `None` if every face stands alone.
    pub cells: Option<Cells>,
    /// User units per unit of this frame.
    pub unit: f64,
    /// Faces of zero area (mapped to a small valid triangle) plus unusable faces.
    pub degenerate: usize,
    /// Faces that repeat the three vertices of an earlier one (mapped on their own).
    pub duplicate: usize,
    /// Edges cut because more than two faces, or two clashing ones, meet there.
    pub non_manifold: usize,
    /// Vertices that are taken for another one at the same place.
    pub welded: usize,
}

impl Surface {
    /// Prepares a mesh.
    pub(crate) fn new(mesh: &TriMesh, options: &UnwrapOptions, ctx: &Context<'_>) -> Result<Self> {
        Self::without(mesh, &[], options, ctx)
    }

    /// The same without the faces that are marked, which count for nothing.
    pub(crate) fn without(
        mesh: &TriMesh,
        left_out: &[bool],
        options: &UnwrapOptions,
        ctx: &Context<'_>,
    ) -> Result<Self> {
        mesh.validate()?;
        ctx.check()?;
        let m = mesh.triangles.len();
        if m as u64 * 3 >= u64::from(NONE) {
            return Err(Error::invalid(format!("{m} triangles"), "Split the mesh: half-edges are 32-bit"));
        }
        let finite = |v: u32| mesh.positions[v as usize].iter().all(|x| x.is_finite());
        let mut usable: Vec<bool> = (mesh.triangles.iter())
            .map(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0] && t.iter().all(|&v| finite(v)))
            .collect();
        usable.iter_mut().zip(left_out).for_each(|(u, left_out)| *u &= !left_out);
        ctx.check()?;
        let (pos, unit) = normalised(mesh, &usable, ctx)?;
        let Twins { tri, twin, non_manifold, duplicate, welded } = pair_edges(mesh, &usable, options, ctx)?;
        ctx.check()?;
        let mut out = Self::from_parts(Arc::new(pos), tri, twin, ctx)?;
        ctx.check()?;
        if (options.keep_uv_seams || options.keep_uvs)
            && let Some(uv) = &mesh.corner_uv
        {
            out.cut(|f, k, g, l| uv[f][k] != uv[g][(l + 1) % 3] || uv[f][(k + 1) % 3] != uv[g][l], options);
        }
        if let Some(angle) = options.hard_edge_angle {
            let least = angle.to_radians().cos();
            let normal = std::mem::take(&mut out.normal);
            let bent = |f: usize, g: usize| {
                let (a, b) = (normal[f], normal[g]);
                a != Vec3::ZERO && b != Vec3::ZERO && a.dot(b) < least
            };
            out.cut(|f, _, g, _| bent(f, g), options);
            out.normal = normal;
        }
        ctx.check()?;
        out.cells = options.face_polygon.as_ref().map(|p| Cells::new(p, &out.twin));
        for f in (0..m).filter(|&f| !usable[f]) {
            out.normal[f] = Vec3::ZERO;
            out.area[f] = 0.0;
        }
        let counts = |f: usize| left_out.get(f) != Some(&true);
        let shapeless = |f: usize| !usable[f] || out.normal[f] == Vec3::ZERO;
        out.degenerate = (0..m).filter(|&f| counts(f) && shapeless(f)).count();
        out.page = PageLimits::of(options);
        Ok(Self { usable, unit, duplicate, non_manifold, welded, ..out })
    }

    /// Measures the faces of a mesh with known adjacency; all count as usable.
    ///
    /// # Errors
    /// Cancelled or out of time.
    pub(crate) fn from_parts(
        pos: Arc<Vec<Vec3>>,
        tri: Vec<[u32; 3]>,
        twin: Vec<[u32; 3]>,
        ctx: &Context<'_>,
    ) -> Result<Self> {
        let m = tri.len();
        let mut normal = ctx.filled(Vec3::ZERO, m)?;
        let mut area = ctx.filled(0.0, m)?;
        let mut rest = ctx.filled([SURFACE.min_edge, 0.0, SURFACE.min_edge], m)?;
        let mut length = ctx.filled([0f32; 3], m)?;
        for f in 0..m {
            ctx.check_at(f)?;
            let [a, b, c] = tri[f].map(|v| pos[v as usize]);
            let (ab, ac) = (b - a, c - a);
            let n = ab.cross(ac);
            let twice = n.norm();
            length[f] = [ab.norm() as f32, (c - b).norm() as f32, ac.norm() as f32];
            area[f] = twice * 0.5;
            let longest = f64::from(length[f].iter().fold(0f32, |x, &y| x.max(y)));
            if twice > 1e-12 * longest * longest && twice > 0.0 {
                normal[f] = n * (1.0 / twice);
            }
            let l = ab.norm().max(SURFACE.min_edge).max(SURFACE.min_height * longest);
            // Thickening one side leaves the height over it as it is.
            let [x, y] = if ab.norm() > 0.0 { [ab.dot(ac), twice].map(|d| d / ab.norm()) } else { [0.0; 2] };
            let y = y.max(SURFACE.min_height * longest).max(SURFACE.min_edge);
            rest[f] = [l, x, y];
        }
        let usable = vec![true; m];
        let cells = None;
        let (unit, degenerate, duplicate, non_manifold, welded) = (1.0, 0, 0, 0, 0);
        Ok(Self {
            tri,
            twin,
            normal,
            area,
            rest,
            length,
            price: None,
            page: PageLimits::default(),
            pos,
            usable,
            cells,
            unit,
            degenerate,
            duplicate,
            non_manifold,
            welded,
        })
    }

    /// Cuts edges between different polygons where `seam(face, slot, face beyond, its slot)` says so.
    fn cut(&mut self, seam: impl Fn(usize, usize, usize, usize) -> bool, options: &UnwrapOptions) {
        let polygon = |f: usize| options.face_polygon.as_ref().map_or(f as u32, |p| p[f]);
        for f in 0..self.faces() {
            for k in 0..3 {
                let h = self.twin[f][k];
                if h == NONE || h / 3 < f as u32 {
                    continue;
                }
                let (g, l) = (h as usize / 3, h as usize % 3);
                if polygon(f) != polygon(g) && seam(f, k, g, l) {
                    self.twin[f][k] = NONE;
                    self.twin[g][l] = NONE;
                }
            }
        }
    }

    /// The cell of a face: faces of one cell stay together where possible.
    pub(crate) fn cell(&self, f: u32) -> u32 {
        self.cells.as_ref().map_or(f, |c| c.of_face[f as usize])
    }

    /// The usable faces in connected parts, by their least face; faces ascend.
    ///
    /// # Errors
    /// Cancelled or out of time.
    pub(crate) fn parts(&self, ctx: &Context<'_>) -> Result<Vec<Vec<u32>>> {
        let mut sets = Sets::new(self.faces());
        for (f, twins) in self.twin.iter().enumerate() {
            ctx.check_at(f)?;
            twins.iter().filter(|&&h| h != NONE).for_each(|&h| sets.join(f as u32, h / 3));
        }
        let mut number = vec![NONE; self.faces()];
        let mut parts: Vec<Vec<u32>> = Vec::new();
        for f in (0..self.faces() as u32).filter(|&f| self.usable[f as usize]) {
            ctx.check_at(f as usize)?;
            let own = &mut number[sets.find(f) as usize];
            if *own == NONE {
                *own = parts.len() as u32;
                parts.push(Vec::new());
            }
            parts[*own as usize].push(f);
        }
        Ok(parts)
    }

    /// What the edge from corner `k` of a face to the next costs as a seam: its length, times its price.
    pub(crate) fn cost(&self, f: usize, k: usize) -> f64 {
        let length = f64::from(self.length[f][k]);
        self.price.as_ref().map_or(length, |price| length * f64::from(price[f][k]))
    }

    /// Number of faces, unusable ones included.
    pub(crate) fn faces(&self) -> usize {
        self.tri.len()
    }
}

/// The positions moved and scaled so that the usable faces have area 1, and the user's units per unit then.
/// Positions that are not finite become zero.
fn normalised(mesh: &TriMesh, usable: &[bool], ctx: &Context<'_>) -> Result<(Vec<Vec3>, f64)> {
    let tri = &mesh.triangles;
    // A first scale by the box keeps squares inside the floating-point range, a second one makes the area 1.
    let (mut lo, mut hi) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for (f, (t, _)) in tri.iter().zip(usable).filter(|(_, u)| **u).enumerate() {
        ctx.check_at(f)?;
        for &v in t {
            for k in 0..3 {
                lo[k] = lo[k].min(mesh.positions[v as usize][k]);
                hi[k] = hi[k].max(mesh.positions[v as usize][k]);
            }
        }
    }
    ctx.check()?;
    let extent = (0..3).map(|k| hi[k] * 0.5 - lo[k] * 0.5).fold(0.0, f64::max) * 2.0;
    if !(extent > 0.0 && extent.is_finite()) {
        return Err(Error::degenerate(
            "the mesh has no triangle with three distinct finite corners of positive extent",
            "Give a mesh with at least one proper triangle",
        ));
    }
    let mut pos: Vec<Vec3> = Vec::with_capacity(mesh.positions.len());
    for (i, p) in mesh.positions.iter().enumerate() {
        ctx.check_at(i)?;
        pos.push(Vec3::from_fn(|k| (p[k] * 0.5 - (lo[k] * 0.25 + hi[k] * 0.25) * 1.0) * 2.0 / extent));
    }
    let raw_area = |pos: &[Vec3], t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| pos[v as usize]);
        (b - a).cross(c - a).norm() * 0.5
    };
    let mut total = 0.0;
    for (f, (t, _)) in tri.iter().zip(usable).filter(|(_, u)| **u).enumerate() {
        ctx.check_at(f)?;
        total += raw_area(&pos, t);
    }
    if total.is_nan() || total <= 0.0 {
        return Err(Error::degenerate(
            "every triangle of the mesh has zero area",
            "Give a mesh with at least one triangle of positive area",
        ));
    }
    ctx.check()?;
    let s = 1.0 / total.sqrt();
    for p in &mut pos {
        *p = if p.iter().all(|x| x.is_finite()) { *p * s } else { Vec3::ZERO };
    }
    Ok((pos, extent / s))
}
