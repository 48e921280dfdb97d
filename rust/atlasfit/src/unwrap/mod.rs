//! Unwraps a given mesh: charts, low-stretch UVs that neither flip nor overlap, packed on square pages.
//!
//! In: a [`TriMesh`] (any topology; never changed) and [`UnwrapOptions`]. Out: a [`UvLayout`] with a UV per corner
//! of every triangle, in the mesh's own order.
//!
//! Flow: `surface` (adjacency, cuts) → `segment` (small flat patches) → `flatten` + `inject` (positions, exact
//! checks) → `merge` (fewer, larger charts within the stretch bound; `dirichlet` where that bound is loose) → `shorten` (no chart decides the page) → `pack`. Large meshes are merged on a coarse
//! stand-in (`coarse`, `refine`).

// Corners and faces are indexed in several arrays at once; an index says so plainly.
#![allow(clippy::needless_range_loop)]

mod chart;
mod coarse;
mod dirichlet;
mod flatten;
mod inject;
mod merge;
mod pack;
mod refine;
mod segment;
mod shorten;
mod solver;
mod surface;

use crate::error::{Error, Result};
use crate::geometry::TriMesh;
use crate::numeric::vec3::Vec3;
use crate::run::{Context, Stage};
use chart::Chart;
use pack::Packing;
pub use pack::{FlatChart, PagePacker, Pages, Spot};
use rayon::prelude::*;
use rustc_hash::{FxBuildHasher, FxHashMap};
use surface::{NONE, Surface};

/// Meshes with more faces than this have their charts found on a coarse stand-in.
const LARGE: usize = 20_000;
/// Rounds of cutting out what single precision spoils.
const REPAIRS: usize = 5;
/// Faces of the coarse stand-in, about.
const COARSE: usize = 10_000;
/// The coarse surface is rougher than the full one: this much more stretch there means the same here.
const COARSE_SLACK: f64 = 1.3;
/// Bound on 1 - |mean normal| of the first patches for a stretch of 1.1. Finer patches leave merging more choice,
/// coarser ones less work.
const FLATNESS: f64 = 0.06;
/// Factor on the excess stretch while there are too many charts.
const LOOSEN: f64 = 1.6;
/// Most pages.
const MOST_PAGES: u32 = 4096;

/// How charts are put on the page.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Packer {
    /// By their shapes: charts lie in each other's bays and holes. The default.
    #[default]
    Shapes,
    /// By their bounding boxes, in rows: fastest, and wastes most.
    Boxes,
}

/// How to unwrap.
#[derive(Debug, Clone, PartialEq)]
pub struct UnwrapOptions {
    /// Bound on the stretch max(s1, 1/s2) at the 95th percentile by area, at one texel density; more than 1.
    /// Smaller gives more charts. Default 1.10.
    pub max_stretch: f64,
    /// Most charts; `max_stretch` is raised as far as that needs (up to [`STRETCH_LIMIT`]). `None` = any number.
    /// More are still made where the topology or the constraints ask for them.
    pub max_charts: Option<usize>,
    /// Width and height of a page in texels, each 16 to 65536. Default 1024 by 1024.
    pub page_size: [u32; 2],
    /// Free texels between charts and at the page's border, at most an eighth of the page. Default 2.
    pub padding_px: u32,
    /// Texels per user unit of length on the surface, positive; `None` = what fills the pages.
    pub texels_per_unit: Option<f64>,
    /// Most pages, at least 1. `None` = one page, or with `texels_per_unit` as many as that density needs. Where the
    /// density needs more pages than this it is lowered.
    pub pages: Option<u32>,
    /// How charts are put on the page.
    pub packer: Packer,
    /// Groups per triangle (materials, for example): no chart spans two. One entry per triangle.
    pub face_group: Option<Vec<u32>>,
    /// The polygon that each triangle is cut from: triangles of one polygon stay in one chart, whose UVs are then
    /// those of the polygon. One entry per triangle; any numbers.
    pub face_polygon: Option<Vec<u32>>,
    /// Edges that must be seams, as pairs of vertices.
    pub seam_edges: Option<Vec<[u32; 2]>>,
    /// Whether the seams of the UVs that the mesh already has stay seams.
    pub keep_uv_seams: bool,
    /// Edges that are bent by more than this are seams: degrees in [0, 180]. `None` = none are for that reason.
    pub hard_edge_angle: Option<f64>,
}

/// `max_charts` raises the stretch bound no further than this.
pub const STRETCH_LIMIT: f64 = 8.0;

impl Default for UnwrapOptions {
    fn default() -> Self {
        Self {
            max_stretch: 1.10,
            max_charts: None,
            page_size: [1024; 2],
            padding_px: 2,
            texels_per_unit: None,
            pages: None,
            packer: Packer::Shapes,
            face_group: None,
            face_polygon: None,
            seam_edges: None,
            keep_uv_seams: false,
            hard_edge_angle: None,
        }
    }
}

impl UnwrapOptions {
    fn validate(&self, mesh: &TriMesh) -> Result<()> {
        let faces = mesh.triangles.len();
        if !(self.max_stretch > 1.0 && self.max_stretch.is_finite()) {
            return Err(Error::invalid(
                format!("max_stretch is {}", self.max_stretch),
                "Give a finite number above 1, for example 1.1",
            ));
        }
        if self.max_charts == Some(0) {
            return Err(Error::invalid("max_charts is 0", "Give at least 1, or none"));
        }
        let [width, height] = self.page_size;
        if self.page_size.iter().any(|s| !(16..=65536).contains(s)) {
            return Err(Error::invalid(
                format!("page_size is {width} by {height}"),
                "Give 16 to 65536 texels",
            ));
        }
        if self.padding_px > width.min(height) / 8 {
            return Err(Error::invalid(
                format!("padding_px is {} on a page of {width} by {height}", self.padding_px),
                "Give at most an eighth of the page",
            ));
        }
        if let Some(t) = self.texels_per_unit
            && !(t > 0.0 && t.is_finite())
        {
            return Err(Error::invalid(format!("texels_per_unit is {t}"), "Give a positive number, or none"));
        }
        if let Some(n) = self.pages
            && !(1..=MOST_PAGES).contains(&n)
        {
            return Err(Error::invalid(format!("pages is {n}"), format!("Give 1 to {MOST_PAGES}, or none")));
        }
        if let Some(a) = self.hard_edge_angle
            && !(0.0..=180.0).contains(&a)
        {
            return Err(Error::invalid(format!("hard_edge_angle is {a}"), "Give 0 to 180 degrees, or none"));
        }
        for (name, column) in [("face_group", &self.face_group), ("face_polygon", &self.face_polygon)] {
            if let Some(c) = column
                && c.len() != faces
            {
                return Err(Error::invalid(
                    format!("{name} has {} entries for {faces} triangles", c.len()),
                    "Give one entry per triangle",
                ));
            }
        }
        if self.keep_uv_seams && mesh.corner_uv.as_ref().is_some_and(|uv| uv.len() != faces) {
            return Err(Error::invalid(
                "corner_uv of the mesh has another length than its triangles",
                "Give UVs for every triangle, or do not ask for their seams to be kept",
            ));
        }
        Ok(())
    }
}

/// UVs of a mesh.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct UvLayout {
    /// UV per corner of every triangle, in [0, 1], v up.
    pub corner_uv: Vec<[[f32; 2]; 3]>,
    /// Chart per triangle.
    pub face_chart: Vec<u32>,
    /// Page per triangle.
    pub face_page: Vec<u32>,
    /// Number of charts.
    pub charts: usize,
    /// Number of pages.
    pub pages: usize,
    /// Width of a page in texels.
    pub width: u32,
    /// Height of a page in texels.
    pub height: u32,
    /// Texels per user unit of length on the surface.
    pub texels_per_unit: f64,
    /// The stretch bound that was held: `max_stretch`, or more where `max_charts` asked for it.
    pub stretch_bound: f64,
    /// Share of the area stretched beyond the bound.
    pub over_stretched: f64,
    /// Triangles of zero area or with repeated or non-finite vertices; they got small valid UV triangles.
    pub degenerate_faces: usize,
    /// Triangles that repeat the corners of an earlier one; they got UVs of their own.
    pub duplicate_faces: usize,
    /// Edges cut because more than two triangles, or two of clashing orientation, meet there.
    pub non_manifold_edges: usize,
    /// Charts that had to be cut further to stay free of flips and overlaps.
    pub repaired_charts: usize,
    /// Polygons that could not stay in one piece because they do not lie flat.
    pub split_polygons: usize,
}

/// Unwraps `mesh`. Deterministic for any number of threads.
///
/// # Errors
/// [`Error::InvalidArgument`] for options out of range, [`Error::IndexOutOfRange`] for a bad triangle,
/// [`Error::Degenerate`] for a mesh without any area, and those of [`Context::check`].
pub fn unwrap(mesh: &TriMesh, options: &UnwrapOptions, ctx: &Context<'_>) -> Result<UvLayout> {
    packed_by(mesh, options, Packing::Own(options.packer), ctx)
}

/// Unwraps `mesh` as [`unwrap`] does, but another packer than the library's own puts the charts on their pages;
/// `options.packer` is not used.
///
/// # Errors
/// Those of [`unwrap`] and of the packer; [`Error::Internal`] where it puts a chart off its page.
pub fn unwrap_with(
    mesh: &TriMesh,
    options: &UnwrapOptions,
    packer: &dyn PagePacker,
    ctx: &Context<'_>,
) -> Result<UvLayout> {
    packed_by(mesh, options, Packing::Outside(packer), ctx)
}

fn packed_by(
    mesh: &TriMesh,
    options: &UnwrapOptions,
    packing: Packing<'_>,
    ctx: &Context<'_>,
) -> Result<UvLayout> {
    options.validate(mesh)?;
    ctx.stage(Stage::Segment, mesh.triangles.len());
    let s = Surface::new(mesh, options, ctx)?;
    ctx.check()?;
    let mut bound = options.max_stretch;
    let list = loop {
        let list = charts_within(&s, bound, ctx)?;
        if bound >= STRETCH_LIMIT || options.max_charts.is_none_or(|most| list.len() <= most) {
            break list;
        }
        bound = (1.0 + (bound - 1.0) * LOOSEN).min(STRETCH_LIMIT);
    };
    ctx.stage(Stage::Pack, list.len());
    ctx.check()?;
    let fills_one_page = options.texels_per_unit.is_none() && options.pages.unwrap_or(1) == 1;
    let list = if fills_one_page && options.max_charts.is_none() {
        shorten::shorten(&s, list, options.page_size, bound, ctx)?
    } else {
        list
    };
    let (list, places, density, repaired_charts) = settle(&s, list, options, packing, ctx)?;
    let [width, height] = options.page_size;
    let known = UvLayout {
        width,
        height,
        texels_per_unit: density / s.unit,
        stretch_bound: bound,
        repaired_charts,
        ..UvLayout::default()
    };
    Ok(layout(&s, &list, &places, options.face_polygon.as_deref(), known))
}

/// The surface in charts that are stretched by `bound` at most.
fn charts_within(s: &Surface, bound: f64, ctx: &Context<'_>) -> Result<Vec<Chart>> {
    let flatness = FLATNESS * ((bound - 1.0) / 0.1).clamp(0.25, 2.0);
    let (label, count) = segment::patches(s, flatness, ctx)?;
    ctx.stage(Stage::Parametrize, count);
    if s.faces() <= LARGE {
        let mut charts = merge::Charts::new(s.faces(), first_charts(s, &label, count, Some(bound), ctx)?);
        merge::merge(s, &mut charts, bound, ctx)?;
        merge::spend(s, &mut charts, bound, ctx)?;
        Ok(charts.list.into_iter().flatten().collect())
    } else {
        let pieces = first_charts(s, &label, count, None, ctx)?;
        let merge::Charts { list, owner: label, .. } = merge::Charts::new(s.faces(), pieces);
        let patches = refine::Patches::new(s, label, list.len());
        drop(list);
        let coarse = coarse::coarsen(s, &patches, COARSE, ctx)?;
        let loose = 1.0 + (bound - 1.0) * COARSE_SLACK;
        let coarse::Level { surface, label, .. } = coarse.last();
        let first = first_charts(surface, label, patches.count, Some(loose), ctx)?;
        let mut charts = merge::Charts::new(surface.faces(), first);
        merge::merge(surface, &mut charts, loose, ctx)?;
        refine::refine(s, &patches, &coarse, &charts, bound, ctx)
    }
}

/// Packs, and checks the charts once more as they leave: in single precision, in place. What rounding spoils (faces
/// far below a texel) is cut out, and everything packed again. Gives the charts, their places, the density in texels
/// per unit of the surface's frame, and how many charts were cut.
fn settle(
    s: &Surface,
    mut list: Vec<Chart>,
    options: &UnwrapOptions,
    packing: Packing<'_>,
    ctx: &Context<'_>,
) -> Result<(Vec<Chart>, Vec<pack::Place>, f64, usize)> {
    let goal = pack::Goal {
        page: options.page_size,
        padding: options.padding_px,
        density: options.texels_per_unit.map(|t| t * s.unit),
        pages: options.pages.unwrap_or(if options.texels_per_unit.is_some() { MOST_PAGES } else { 1 }),
        packer: packing,
        seed: ctx.seed,
    };
    let mut repaired = 0;
    for round in 0.. {
        let (places, density) = pack::pack(&list, &goal, ctx)?;
        let spoiled: Vec<Option<Vec<bool>>> =
            list.par_iter().zip(&places).map(|(c, p)| spoiled(s, c, &p.positions(&c.uv), round)).collect();
        if round == REPAIRS || spoiled.iter().all(Option::is_none) {
            return Ok((list, places, density, repaired));
        }
        let mut next = Vec::with_capacity(list.len());
        for (c, spoiled) in list.into_iter().zip(spoiled) {
            let Some(side) = spoiled else {
                next.push(c);
                continue;
            };
            repaired += 1;
            if round + 1 == REPAIRS {
                next.extend(c.faces.iter().map(|&f| single(s, f)));
                continue;
            }
            next.extend(cut(s, &c, &side, ctx).into_iter().map(|piece| match piece.faces[..] {
                [f] => single(s, f),
                _ => piece,
            }));
        }
        list = next;
    }
    Err(Error::internal("charts did not settle"))
}

/// The faces of a chart to be cut out of it because rounding flipped them; where its border touches itself, half of
/// it. `None` if all is well.
fn spoiled(s: &Surface, c: &Chart, at: &[[f32; 2]], round: usize) -> Option<Vec<bool>> {
    let at: Vec<[f64; 2]> = at.iter().map(|p| p.map(f64::from)).collect();
    let bad: Vec<bool> = c.tris.iter().map(|t| !inject::positive(flatten::corners(*t, &at))).collect();
    if c.faces.len() == 1 {
        return None;
    }
    if bad.iter().any(|&b| b) {
        return Some(whole_cells(s, &c.faces, bad));
    }
    inject::border_touches(&c.tris, &at, &c.border)
        .then(|| halves(s, &c.faces, |i| c.tris[i].iter().map(|&v| at[v as usize][round % 2]).sum::<f64>()))
}

/// Widens `side` so that it cuts no cell, if a cut is left then; a `side` that holds all faces becomes every other one.
fn whole_cells(s: &Surface, faces: &[u32], side: Vec<bool>) -> Vec<bool> {
    let mut marked: Vec<u32> = faces.iter().zip(&side).filter(|f| *f.1).map(|f| s.cell(*f.0)).collect();
    marked.sort_unstable();
    let wide: Vec<bool> = faces.iter().map(|&f| marked.binary_search(&s.cell(f)).is_ok()).collect();
    let cuts = |side: &[bool]| side.iter().any(|&b| b) && !side.iter().all(|&b| b);
    if cuts(&wide) {
        wide
    } else if cuts(&side) {
        side
    } else {
        (0..side.len()).map(|i| i % 2 == 0).collect()
    }
}

/// Half of the faces, those of least `x` (of a place among them), without cutting a cell where there are several.
fn halves(s: &Surface, faces: &[u32], x: impl Fn(usize) -> f64) -> Vec<bool> {
    // A cell lies where its first face lies.
    let mut first: Vec<(u32, f64)> = faces.iter().enumerate().map(|(i, &f)| (s.cell(f), x(i))).collect();
    first.sort_by_key(|c| c.0);
    first.dedup_by_key(|c| c.0);
    let one = first.len() == 1;
    let key = |i: usize| match first.binary_search_by_key(&s.cell(faces[i]), |c| c.0) {
        Ok(c) if !one => (first[c].1, first[c].0),
        _ => (x(i), faces[i]),
    };
    let mut order: Vec<usize> = (0..faces.len()).collect();
    order.sort_by(|&i, &j| {
        let (a, b) = (key(i), key(j));
        a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)).then(i.cmp(&j))
    });
    // The first place at or behind the middle, or else before it, where another cell begins.
    let begins = |k: &usize| one || key(order[*k]).1 != key(order[*k - 1]).1;
    let half = (order.len() / 2).max(1);
    let at = (half..order.len()).find(begins).or_else(|| (1..half).rev().find(begins)).unwrap_or(half);
    let mut side = vec![false; order.len()];
    order[..at].iter().for_each(|&i| side[i] = true);
    side
}

/// Flattens the first patches; one that cannot be laid out flat is cut further. Without a stretch bound they are only
/// projected, which is enough to see whether they lie flat.
fn first_charts(
    s: &Surface,
    label: &[u32],
    count: usize,
    bound: Option<f64>,
    ctx: &Context<'_>,
) -> Result<Vec<Chart>> {
    let mut faces: Vec<Vec<u32>> = vec![Vec::new(); count];
    let mut index_of = vec![NONE; label.len()];
    for (f, &l) in label.iter().enumerate() {
        if l != NONE {
            index_of[f] = faces[l as usize].len() as u32;
            faces[l as usize].push(f as u32);
        }
    }
    let built: Vec<Vec<Chart>> = faces
        .into_par_iter()
        .enumerate()
        .map(|(id, faces)| {
            if ctx.check().is_err() || faces.is_empty() {
                return Vec::new();
            }
            let across = |_, f: usize, k: usize| {
                let h = s.twin[f][k];
                (h != NONE && label[h as usize / 3] == id as u32).then(|| index_of[h as usize / 3])
            };
            let chart = Chart::glue(s, faces, across, ctx);
            chart.map_or_else(Vec::new, |c| flatten_first(s, c, bound, ctx))
        })
        .collect();
    ctx.check()?;
    Ok(built.into_iter().flatten().collect())
}

/// Charts of the patches among some faces.
fn patch_charts(s: &Surface, faces: &[u32], label: &[u32], bound: f64, ctx: &Context<'_>) -> Vec<Chart> {
    let mut sorted: Vec<(u32, u32)> = faces.iter().map(|&f| (label[f as usize], f)).collect();
    sorted.sort_unstable();
    sorted
        .chunk_by(|a, b| a.0 == b.0)
        .flat_map(|group| {
            let own: Vec<u32> = group.iter().map(|g| g.1).collect();
            let across = |_, f: usize, k: usize| {
                let h = s.twin[f][k];
                if h == NONE { None } else { own.binary_search(&(h / 3)).ok().map(|i| i as u32) }
            };
            let chart = Chart::glue(s, own.clone(), across, ctx);
            chart.map_or_else(Vec::new, |c| flatten_first(s, c, Some(bound), ctx))
        })
        .collect()
}

/// Lays a patch flat; one that flips or overlaps is cut in two until it does not.
fn flatten_first(s: &Surface, mut c: Chart, bound: Option<f64>, ctx: &Context<'_>) -> Vec<Chart> {
    if ctx.check().is_err() {
        return Vec::new();
    }
    if c.faces.len() == 1 {
        return vec![single(s, c.faces[0])];
    }
    let n = flatten::mean_normal(s, &c.faces);
    flatten::project(s, &mut c, n);
    let stopped = || ctx.check().is_err();
    if flatten::all_positive(&c.tris, &c.uv) {
        if bound.is_some() && !stopped() {
            let arap = flatten::Arap::new(&c.tris, c.rest(s), &c.uv, &[], ctx);
            let (mut rhs, mut work) = (Vec::new(), Vec::new());
            let mut uv = c.uv.clone();
            for _ in 0..5 {
                arap.step(&c.tris, &mut uv, &[], &mut rhs, &mut work);
            }
            flatten::blend_without_flips(&c.tris, &mut c.uv, &uv);
        }
        if stopped() {
            return Vec::new();
        }
        if inject::injective(&c.tris, &c.uv, &c.border) {
            if let Some(bound) = bound {
                c.over = flatten::over_area(s, &c, bound);
                c.waste = merge::waste(&c);
            }
            return vec![c];
        }
    }
    if stopped() {
        return Vec::new();
    }
    // Faces that look away from the rest are cut off first; else the longer side of the box is halved.
    let facing = |f: u32| s.normal[f as usize].dot(n) > 0.2;
    let away = c.faces.iter().filter(|&&f| !facing(f)).count();
    let side: Vec<bool> = if away > 0 && away < c.faces.len() {
        whole_cells(s, &c.faces, c.faces.iter().map(|&f| !facing(f)).collect())
    } else {
        let centre = |f: u32| s.tri[f as usize].iter().fold(Vec3::ZERO, |a, &v| a + s.pos[v as usize]);
        let axis = (0..3)
            .map(|k| {
                let x = c.faces.iter().map(|&f| centre(f)[k]);
                (x.clone().fold(f64::NEG_INFINITY, f64::max) - x.fold(f64::INFINITY, f64::min), k)
            })
            .fold((-1.0, 0), |a, b| if b.0 > a.0 { b } else { a })
            .1;
        halves(s, &c.faces, |i| centre(c.faces[i])[axis])
    };
    pieces(s, &c, &side, ctx).into_iter().flat_map(|(piece, _)| flatten_first(s, piece, bound, ctx)).collect()
}

/// For each edge of a chart's faces, the place in the chart of the face beyond it; [`NONE`] at its border.
fn beyond(s: &Surface, c: &Chart, ctx: &Context<'_>) -> Result<Vec<[u32; 3]>> {
    let n = c.faces.len();
    let mut place = FxHashMap::with_capacity_and_hasher(n, FxBuildHasher);
    for (i, &f) in c.faces.iter().enumerate() {
        ctx.check_at(i)?;
        place.insert(f, i as u32);
    }
    let mut out = vec![[0; 3]; n];
    c.border.iter().for_each(|&(i, k)| out[i as usize][k as usize] = NONE);
    for (i, (&f, out)) in c.faces.iter().zip(&mut out).enumerate() {
        ctx.check_at(i)?;
        for (b, h) in out.iter_mut().zip(s.twin[f as usize]) {
            if *b != NONE {
                *b = place[&(h / 3)];
            }
        }
    }
    Ok(out)
}

/// The connected parts of a chart's faces of equal `side`, each with its faces' places in the chart. Unfinished when the run is to stop: the caller
/// checks.
fn pieces(s: &Surface, c: &Chart, side: &[bool], ctx: &Context<'_>) -> Vec<(Chart, Vec<u32>)> {
    let n = c.faces.len();
    let stop = |i: usize| ctx.check_at(i).is_err();
    let Ok(beyond) = beyond(s, c, ctx) else { return Vec::new() };
    let (mut part, mut rank) = (vec![NONE; n], vec![0; n]);
    let mut groups: Vec<Vec<u32>> = Vec::new();
    for i in 0..n {
        if part[i] != NONE {
            continue;
        }
        part[i] = groups.len() as u32;
        let mut group = vec![i as u32];
        let mut next = 0;
        while next < group.len() {
            if stop(next) {
                return Vec::new();
            }
            let i = group[next] as usize;
            rank[i] = next as u32;
            next += 1;
            for j in beyond[i].into_iter().filter(|&j| j != NONE) {
                if part[j as usize] == NONE && side[j as usize] == side[i] {
                    part[j as usize] = groups.len() as u32;
                    group.push(j);
                }
            }
        }
        groups.push(group);
    }
    groups
        .into_iter()
        .filter_map(|g| {
            let faces: Vec<u32> = g.iter().map(|&i| c.faces[i as usize]).collect();
            let across = |i: usize, _, k: usize| {
                let i = g[i] as usize;
                let j = beyond[i][k];
                (j != NONE && part[j as usize] == part[i]).then(|| rank[j as usize])
            };
            Chart::glue(s, faces, across, ctx).map(|piece| (piece, g))
        })
        .collect()
}

/// Cuts a chart in two or more by `side`; everything stays where it lies. Unfinished when the run is to stop: the caller checks.
fn cut(s: &Surface, c: &Chart, side: &[bool], ctx: &Context<'_>) -> Vec<Chart> {
    let mut parts = pieces(s, c, side, ctx);
    for (piece, members) in &mut parts {
        for (t, &i) in piece.tris.iter().zip(members.iter()) {
            for k in 0..3 {
                piece.uv[t[k] as usize] = c.uv[c.tris[i as usize][k] as usize];
            }
        }
    }
    parts.into_iter().map(|p| p.0).collect()
}

/// The chart of one face.
fn single(s: &Surface, f: u32) -> Chart {
    let [l, x, y] = s.rest[f as usize];
    Chart {
        faces: vec![f],
        tris: vec![[0, 1, 2]],
        uv: vec![[0.0, 0.0], [l, 0.0], [x, y]],
        border: vec![(0, 0), (0, 1), (0, 2)],
        area: s.area[f as usize],
        over: 0.0,
        waste: 0.0,
    }
}

/// Gives the faces of a polygon that have no shape the UVs of the others' corners. Returns whether all its faces then lie
/// in one chart and agree on the UVs of its corners.
fn rejoin(
    s: &Surface,
    faces: std::ops::Range<usize>,
    uv: &mut [[[f32; 2]; 3]],
    chart: &mut [u32],
    page: &mut [u32],
) -> bool {
    let Some(home) = faces.clone().find(|&f| s.usable[f]) else { return true };
    let corner = |uv: &[[[f32; 2]; 3]], v: u32| {
        (faces.clone().filter(|&f| s.usable[f] && chart[f] == chart[home]))
            .find_map(|f| (0..3).find(|&k| s.tri[f][k] == v).map(|k| uv[f][k]))
    };
    let mut known = Vec::new();
    for f in faces.clone() {
        let at = s.tri[f].map(|v| corner(uv, v));
        match at {
            [Some(a), Some(b), Some(c)] => known.push([a, b, c]),
            _ => return false,
        }
    }
    for (f, at) in faces.clone().zip(known) {
        if s.usable[f] && (chart[f] != chart[home] || uv[f] != at) {
            return false;
        }
        uv[f] = at;
    }
    faces.for_each(|f| (chart[f], page[f]) = (chart[home], page[home]));
    true
}

/// The layout of charts in their places; `known` holds what was decided before.
fn layout(
    s: &Surface,
    list: &[Chart],
    places: &[pack::Place],
    polygon: Option<&[u32]>,
    known: UvLayout,
) -> UvLayout {
    let m = s.faces();
    let mut corner_uv = vec![[[0f32; 2]; 3]; m];
    let mut face_chart = vec![NONE; m];
    let mut face_page = vec![0; m];
    for (id, (c, p)) in list.iter().zip(places).enumerate() {
        let at = p.positions(&c.uv);
        for (&f, t) in c.faces.iter().zip(&c.tris) {
            face_chart[f as usize] = id as u32;
            face_page[f as usize] = p.page;
            corner_uv[f as usize] = t.map(|v| at[v as usize]);
        }
    }
    // Faces without a shape share a point inside the first chart's first face.
    for f in 0..m {
        if face_chart[f] == NONE {
            let home = list.first().map_or(0, |c| c.faces[0] as usize);
            face_chart[f] = face_chart[home];
            face_page[f] = face_page[home];
            corner_uv[f] = [corner_uv[home][0]; 3];
        }
    }
    let mut split_polygons = 0;
    let mut first = 0;
    for run in polygon.unwrap_or_default().chunk_by(|a, b| a == b) {
        let own = first..first + run.len();
        first = own.end;
        split_polygons +=
            usize::from(run.len() > 1 && !rejoin(s, own, &mut corner_uv, &mut face_chart, &mut face_page));
    }
    UvLayout {
        corner_uv,
        face_chart,
        charts: list.len(),
        pages: face_page.iter().map(|&p| p as usize + 1).max().unwrap_or(1),
        face_page,
        over_stretched: list.iter().map(|c| c.over).sum::<f64>(),
        degenerate_faces: s.degenerate,
        duplicate_faces: s.duplicate,
        non_manifold_edges: s.non_manifold,
        split_polygons,
        ..known
    }
}
