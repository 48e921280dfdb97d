//! Quality of a mesh's UVs.
//!
//! In: a mesh with texture coordinates per corner. Out: charts, seams, stretch, flips, overlaps, coverage.
//! Sources: Sander, Snyder, Gortler, Hoppe 2001, "Texture mapping progressive meshes" (stretch norms);
//! singular values of the map from surface to texture after one global scale.

use super::sample::area;
use crate::error::{Error, Result};
use crate::geometry::TriMesh;
use crate::numeric::vec3::{self, Vec3};
use crate::run::{Context, Stage};
use crate::spatial::bvh::{Aabb, Bvh};
use crate::spatial::edges::Edges;
use crate::spatial::sets::Sets;
use crate::spatial::weld::weld;
use rayon::prelude::*;
use robust::{Coord, orient2d};
use std::ops::ControlFlow;

/// Corners with UVs nearer than this are one point of a chart.
const SAME_UV: f64 = 1e-6;
/// A face with less than this share of the surface has no area that could be stretched.
const NO_AREA: f64 = 1e-14;
/// A face whose smaller singular value is below this has collapsed in the texture.
const COLLAPSED: f64 = 1e-9;
/// Side of the texture, in texels, that coverage and overlap are counted on.
pub const TEXELS: usize = 1024;
/// A texel counts only where its centre is inside by this share of the texture's side (times a side's length): neighbours
/// that share a side do not overlap.
const INSIDE: f64 = 1e-7;
/// Rows of texels per task.
const BAND: usize = 32;

/// Quality of UVs. Stretch is after one global scale that makes the summed areas equal: 1 = isometric.
#[derive(Debug, Clone, PartialEq)]
pub struct UvQuality {
    /// Faces.
    pub faces: usize,
    /// Groups of faces joined through edges with equal UVs at both ends.
    pub charts: usize,
    /// Length of the inner edges that are cut in the texture, divided by the square root of the surface's area.
    pub seam: f64,
    /// Sander's L2 stretch of the whole atlas; infinite where every face has collapsed.
    pub stretch_l2: f64,
    /// Sander's L-infinity stretch: the largest stretch from texture to surface of any face, collapsed faces left out.
    pub stretch_linf: f64,
    /// Median by area of max(s1, 1/s2), with s1 >= s2 the singular values of the map from surface to texture.
    pub stretch_median: f64,
    /// 95% of the area is below.
    pub stretch_p95: f64,
    /// Mean by area of s1/s2: 1 = conformal.
    pub conformal: f64,
    /// Faces turned against the majority of their chart.
    pub flips: usize,
    /// Faces with area in space and none in the texture, or with UVs that are not finite.
    pub degenerate: usize,
    /// Texels covered twice or more / texels covered.
    pub overlap: f64,
    /// Faces whose inside meets another face's inside in the texture, by exact predicates.
    pub overlapping_faces: usize,
    /// Texels covered / all texels.
    pub coverage: f64,
    /// Whether all UVs lie in [0, 1].
    pub inside: bool,
    /// Whether all UVs are finite.
    pub finite: bool,
}

/// The pages that UVs lie on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pages<'a> {
    /// Page of each face, below [`MOST_PAGES`]; `None`: all are on one.
    pub of_face: Option<&'a [u32]>,
    /// Width and height of a page, positive, in any unit.
    pub size: [f64; 2],
}

impl Default for Pages<'_> {
    /// One square page.
    fn default() -> Self {
        Self { of_face: None, size: [1.0; 2] }
    }
}

/// More pages than this are garbage.
pub const MOST_PAGES: u32 = 4096;

/// Measures the UVs of a mesh on one square page.
///
/// # Errors
/// [`Error::EmptyInput`] where there are no faces or no UVs; [`Error::InvalidArgument`] where there are not as many as
/// faces; [`Error::IndexOutOfRange`]; cancel and time limit.
pub fn uv(mesh: &TriMesh, ctx: &Context<'_>) -> Result<UvQuality> {
    uv_on(mesh, &Pages::default(), ctx)
}

/// Measures the UVs of a mesh that lie on several pages, or on one that is not square.
///
/// # Errors
/// As [`uv`], also for pages out of range.
pub fn uv_on(mesh: &TriMesh, pages: &Pages<'_>, ctx: &Context<'_>) -> Result<UvQuality> {
    let (uvs, share) = laid_out(mesh, pages)?;
    let m = uvs.len();
    ctx.stage(Stage::Measure, 4);
    let finite: Vec<bool> = uvs.iter().map(|c| c.iter().flatten().all(|x| x.is_finite())).collect();

    let charts = charts_of(mesh, &uvs, ctx)?;
    ctx.advance(1);
    ctx.check()?;

    let areas = Areas::new(mesh, &uvs);
    let singular: Vec<(f64, f64)> =
        (0..m).into_par_iter().map(|i| singular_values(mesh, i, &uvs[i], areas.to_space)).collect();
    let stretch = stretch(&singular, &areas);
    ctx.advance(1);
    ctx.check()?;

    let mut majority = vec![0.0; charts.count];
    for (chart, area) in charts.of_face.iter().zip(&areas.texture) {
        majority[*chart as usize] += area;
    }
    let turned = |i: usize| {
        let sign: f64 = majority[charts.of_face[i] as usize];
        areas.some(i) && sign != 0.0 && areas.texture[i] * sign.signum() < 0.0
    };
    let flips = (0..m).filter(|&i| turned(i)).count();

    let (covered, twice) = texels(&uvs, &finite, ctx)?;
    ctx.advance(1);
    let overlapping_faces = overlapping(&uvs, &finite, ctx)?;
    ctx.advance(1);
    let mut all = corners(mesh)?.as_flattened().as_flattened().iter();
    Ok(UvQuality {
        faces: m,
        charts: charts.count,
        seam: charts.seam_length / areas.total.sqrt(),
        stretch_l2: stretch.l2,
        stretch_linf: stretch.linf,
        stretch_median: stretch.median,
        stretch_p95: stretch.p95,
        conformal: stretch.conformal,
        flips,
        degenerate: stretch.collapsed,
        overlap: twice as f64 / covered.max(1) as f64,
        overlapping_faces,
        coverage: covered as f64 / (TEXELS * TEXELS) as f64 / share,
        inside: all.all(|&x| (-SAME_UV..=1.0 + SAME_UV).contains(&f64::from(x))),
        finite: finite.iter().all(|f| *f),
    })
}

/// Stretch max(s1, 1/s2) of every face at the one scale of [`uv_on`]: 1 = isometric, infinite where it has collapsed, 1 where it has no area
/// in space.
///
/// # Errors
/// As [`uv_on`].
pub fn face_stretch(mesh: &TriMesh, pages: &Pages<'_>, ctx: &Context<'_>) -> Result<Vec<f32>> {
    let (uvs, _) = laid_out(mesh, pages)?;
    let areas = Areas::new(mesh, &uvs);
    ctx.check()?;
    Ok((0..uvs.len())
        .into_par_iter()
        .map(|i| {
            if !areas.some(i) {
                return 1.0;
            }
            let (s1, s2) = singular_values(mesh, i, &uvs[i], areas.to_space);
            let value = if s2 > COLLAPSED { s1.max(s2.recip()) } else { f64::INFINITY };
            if value.is_nan() { f32::INFINITY } else { value as f32 }
        })
        .collect())
}

/// How the UVs cut a mesh into charts.
#[derive(Debug, Clone, PartialEq)]
pub struct Charts {
    /// Chart of each face, numbered from 0 in the order of their first faces.
    pub of_face: Vec<u32>,
    /// Number of charts.
    pub count: usize,
    /// Half-edges where a chart ends, `3 * face + corner`: both sides of every cut, and the mesh's boundary.
    pub outline: Vec<u32>,
    /// Length of the inner edges that are cut.
    pub seam_length: f64,
}

/// Finds the charts: faces joined through edges with equal UVs at both ends. Edges with more than two faces join them
/// in the order of their numbers.
///
/// # Errors
/// As [`uv`].
pub fn charts(mesh: &TriMesh, ctx: &Context<'_>) -> Result<Charts> {
    charts_of(mesh, &laid_out(mesh, &Pages::default())?.0, ctx)
}

fn charts_of(mesh: &TriMesh, uvs: &[[[f64; 2]; 3]], ctx: &Context<'_>) -> Result<Charts> {
    // Files that hold one vertex per corner (glTF) split vertices along seams: such a vertex is one place.
    let place = weld(vec3::of(&mesh.positions), 0.0, ctx)?;
    let triangles: Vec<[u32; 3]> = mesh.triangles.iter().map(|t| t.map(|v| place[v as usize])).collect();
    let edges = Edges::new(&triangles, ctx)?;
    let mut sets = Sets::new(triangles.len());
    let mut seam_length = 0.0;
    let mut outline = Vec::new();
    // UVs at the edge's smaller and larger vertex.
    let ends = |h: u32| {
        let (f, k) = (h as usize / 3, h as usize % 3);
        let (a, b) = (uvs[f][k], uvs[f][(k + 1) % 3]);
        if triangles[f][k] <= triangles[f][(k + 1) % 3] { [a, b] } else { [b, a] }
    };
    for (i, edge) in edges.iter().enumerate() {
        ctx.check_at(i)?;
        if let [one] = edge {
            outline.push(one.1);
        }
        for pair in edge.windows(2) {
            let (g, h) = (ends(pair[0].1), ends(pair[1].1));
            let same = g.iter().flatten().zip(h.iter().flatten()).all(|(x, y)| (x - y).abs() < SAME_UV);
            if same {
                sets.join(pair[0].1 / 3, pair[1].1 / 3);
            } else {
                let (f, k) = (pair[0].1 as usize / 3, pair[0].1 as usize % 3);
                let [a, b] =
                    [triangles[f][k], triangles[f][(k + 1) % 3]].map(|v| Vec3(mesh.positions[v as usize]));
                seam_length += (a - b).norm();
                outline.extend([pair[0].1, pair[1].1]);
            }
        }
    }
    // A set's root is its first face, so that roots come up in the order of the numbers.
    let (mut of_face, mut count) = (vec![0; triangles.len()], 0);
    for f in 0..triangles.len() {
        let root = sets.find(f as u32) as usize;
        if root == f {
            of_face[f] = count;
            count += 1;
        } else {
            of_face[f] = of_face[root];
        }
    }
    Ok(Charts { of_face, count: count as usize, outline, seam_length })
}

/// Share of the pages that lies under faces, by their areas: what [`UvQuality::coverage`] counts in texels, where no faces overlap.
#[must_use]
pub fn coverage(corner_uv: &[[[f32; 2]; 3]], pages: usize) -> f64 {
    let area = |c: &[[f32; 2]; 3]| signed_area(&c.map(|p| p.map(f64::from))).abs();
    corner_uv.iter().map(area).sum::<f64>() / pages.max(1) as f64
}

/// The mesh's UVs with the pages side by side on one square, so that shapes and neighbours are what they are, and the share of it that is page.
fn laid_out(mesh: &TriMesh, pages: &Pages<'_>) -> Result<(Vec<[[f64; 2]; 3]>, f64)> {
    let corners = corners(mesh)?;
    let [width, height] = pages.size;
    if !pages.size.iter().all(|x| *x > 0.0 && x.is_finite()) {
        return Err(Error::invalid(format!("a page is {width} by {height}"), "Give a positive size"));
    }
    if pages.of_face.is_some_and(|p| p.len() != corners.len()) {
        return Err(Error::invalid("there is not one page per face", "Give the page of each face"));
    }
    let page = |f: usize| pages.of_face.map_or(0, |p| p[f]);
    let last = (0..corners.len()).map(page).max().unwrap_or(0);
    if last >= MOST_PAGES {
        return Err(Error::IndexOutOfRange {
            what: "the page of a face".into(),
            value: u64::from(last),
            limit: u64::from(MOST_PAGES),
            of: "pages",
        });
    }
    let count = last + 1;
    let columns = (1..=count).find(|c| c * c >= count).unwrap_or(1);
    let side = (f64::from(columns) * width).max(f64::from(count.div_ceil(columns)) * height);
    let (wide, high) = (width / side, height / side);
    let place = |(f, uv): (usize, &[[f32; 2]; 3])| {
        let at = [page(f) % columns, page(f) / columns].map(f64::from);
        uv.map(|p| [(at[0] + f64::from(p[0])) * wide, (at[1] + f64::from(p[1])) * high])
    };
    Ok((corners.iter().enumerate().map(place).collect(), f64::from(count) * wide * high))
}

/// The mesh's UVs, checked.
fn corners(mesh: &TriMesh) -> Result<&[[[f32; 2]; 3]]> {
    mesh.validate()?;
    let m = mesh.triangles.len();
    match &mesh.corner_uv {
        Some(uv) if uv.len() == m && m > 0 => Ok(uv),
        Some(uv) if m > 0 => Err(Error::invalid(
            format!("{} corner UVs for {m} faces", uv.len()),
            "Give three UVs for each face",
        )),
        _ => Err(Error::empty(
            format!("a mesh of {m} faces without texture coordinates"),
            "Unwrap the mesh first",
        )),
    }
}

/// Areas of the faces.
struct Areas {
    space: Vec<f64>,
    /// Their sum.
    total: f64,
    /// Signed; 0 where UVs are not finite.
    texture: Vec<f64>,
    /// The scale of the texture that makes the summed areas equal, faces without area in space left out.
    to_space: f64,
}

impl Areas {
    fn new(mesh: &TriMesh, uvs: &[[[f64; 2]; 3]]) -> Self {
        let space: Vec<f64> = (0..uvs.len()).map(|i| area(mesh, i)).collect();
        let total = space.iter().sum();
        let finite = |c: &[[f64; 2]; 3]| c.iter().flatten().all(|x| x.is_finite());
        let texture = uvs.iter().map(|c| if finite(c) { signed_area(c) } else { 0.0 }).collect();
        let mut out = Self { space, total, texture, to_space: 0.0 };
        let (mut in_space, mut in_texture) = (0.0, 0.0);
        for i in (0..uvs.len()).filter(|&i| out.some(i)) {
            in_space += out.space[i];
            in_texture += out.texture[i].abs();
        }
        out.to_space = (in_space / in_texture.max(1e-300)).sqrt();
        out
    }

    /// Whether a face has area in space.
    fn some(&self, i: usize) -> bool {
        self.space[i] > NO_AREA * self.total
    }
}

/// Singular values, larger first, of the map from a face in space to the scaled texture.
fn singular_values(mesh: &TriMesh, i: usize, uv: &[[f64; 2]; 3], to_space: f64) -> (f64, f64) {
    let [p, q, r] = mesh.triangles[i].map(|v| Vec3(mesh.positions[v as usize]));
    let (a, b) = (q - p, r - p);
    let la = a.norm();
    // The face in its plane: (0, 0), (la, 0), (x, y).
    let (x, y) = (a.dot(b) / la, 2.0 * area(mesh, i) / la);
    let d = |k: usize| [0, 1].map(|c| (uv[k][c] - uv[0][c]) * to_space);
    let (d1, d2) = (d(1), d(2));
    let du = d1.map(|v| v / la);
    let dv = [(d2[0] - du[0] * x) / y, (d2[1] - du[1] * x) / y];
    let (e, g) = (du[0] * du[0] + du[1] * du[1], dv[0] * dv[0] + dv[1] * dv[1]);
    let f = du[0] * dv[0] + du[1] * dv[1];
    let root = (0.25 * (e - g) * (e - g) + f * f).sqrt();
    let larger = (0.5 * (e + g) + root).sqrt();
    // Their product is the determinant: the difference of squares would leave nothing of a small one.
    (larger, (du[0] * dv[1] - du[1] * dv[0]).abs() / larger.max(f64::MIN_POSITIVE))
}

struct Stretch {
    l2: f64,
    linf: f64,
    median: f64,
    p95: f64,
    conformal: f64,
    collapsed: usize,
}

fn stretch(singular: &[(f64, f64)], areas: &Areas) -> Stretch {
    let (mut weight, mut squares, mut ratio, mut linf, mut collapsed) = (0.0, 0.0, 0.0, 0.0f64, 0);
    let mut worst: Vec<(f64, f64)> = Vec::new();
    for i in (0..singular.len()).filter(|&i| areas.some(i)) {
        let (s1, s2) = singular[i];
        if s2 > COLLAPSED {
            weight += areas.space[i];
            squares += areas.space[i] * 0.5 * ((s1 * s1).recip() + (s2 * s2).recip());
            ratio += areas.space[i] * s1 / s2;
            linf = linf.max(s2.recip());
        } else {
            collapsed += 1;
        }
        // A value that is no number counts as the worst stretch there is.
        let value = if s2 > COLLAPSED { s1.max(s2.recip()) } else { s1.max(COLLAPSED.recip()) };
        worst.push((if value.is_nan() { f64::INFINITY } else { value }, areas.space[i]));
    }
    worst.par_sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let all: f64 = worst.iter().map(|w| w.1).sum();
    let quantile = |q: f64| {
        let mut below = 0.0;
        let reached = worst.iter().find(|w| {
            below += w.1;
            below >= q * all
        });
        reached.or(worst.last()).map_or(f64::INFINITY, |w| w.0)
    };
    let or_infinite = |x: f64| if weight > 0.0 { x } else { f64::INFINITY };
    Stretch {
        l2: or_infinite((squares / weight).sqrt()),
        linf: or_infinite(linf),
        median: quantile(0.5),
        p95: quantile(0.95),
        conformal: or_infinite(ratio / weight),
        collapsed,
    }
}

fn signed_area(c: &[[f64; 2]; 3]) -> f64 {
    0.5 * ((c[1][0] - c[0][0]) * (c[2][1] - c[0][1]) - (c[1][1] - c[0][1]) * (c[2][0] - c[0][0]))
}

/// Texels covered, and texels covered twice or more.
fn texels(uvs: &[[[f64; 2]; 3]], finite: &[bool], ctx: &Context<'_>) -> Result<(usize, usize)> {
    let size = TEXELS as f64;
    // Rows that a face can reach.
    let rows = |c: &[[f64; 2]; 3]| {
        let (lo, hi) =
            c.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(p[1]), h.max(p[1])));
        ((lo * size).floor().max(0.0) as usize, (hi * size).ceil().clamp(0.0, size) as usize)
    };
    let mut bands: Vec<Vec<u32>> = vec![Vec::new(); TEXELS.div_ceil(BAND)];
    for (i, c) in uvs.iter().enumerate().filter(|(i, _)| finite[*i]) {
        let (lo, hi) = rows(c);
        for band in bands.iter_mut().take(hi.div_ceil(BAND)).skip(lo / BAND) {
            band.push(i as u32);
        }
    }
    let counts = bands
        .par_iter()
        .enumerate()
        .map(|(band, faces)| {
            let mut count = vec![0u8; BAND * TEXELS];
            for (n, &i) in faces.iter().enumerate() {
                if n % 256 == 0 {
                    ctx.check()?;
                }
                cover(&uvs[i as usize], band * BAND, &mut count);
            }
            Ok((count.iter().filter(|c| **c > 0).count(), count.iter().filter(|c| **c > 1).count()))
        })
        .collect::<Result<Vec<_>>>()?;
    Ok(counts.iter().fold((0, 0), |s, c| (s.0 + c.0, s.1 + c.1)))
}

/// Counts the texels of one band of rows whose centres a face covers.
fn cover(c: &[[f64; 2]; 3], first_row: usize, count: &mut [u8]) {
    let size = TEXELS as f64;
    let mut p = c.map(|q| q.map(|x| x * size));
    let twice = (p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) - (p[2][0] - p[0][0]) * (p[1][1] - p[0][1]);
    if twice < 0.0 {
        p.swap(1, 2);
    } else if twice == 0.0 {
        return;
    }
    let range = |k: usize, from: f64, to: f64| {
        let lo = p.iter().fold(f64::INFINITY, |m, q| m.min(q[k])).floor().max(from);
        let hi = p.iter().fold(f64::NEG_INFINITY, |m, q| m.max(q[k])).ceil().min(to);
        (lo as usize)..(hi.max(0.0) as usize)
    };
    let margin = INSIDE * size;
    let row0 = first_row as f64;
    for y in range(1, row0, row0 + BAND as f64) {
        for x in range(0, 0.0, size) {
            let (px, py) = (x as f64 + 0.5, y as f64 + 0.5);
            let inside =
                |a: [f64; 2], b: [f64; 2]| (b[0] - a[0]) * (py - a[1]) - (b[1] - a[1]) * (px - a[0]) > margin;
            if inside(p[0], p[1]) && inside(p[1], p[2]) && inside(p[2], p[0]) {
                let texel = &mut count[(y - first_row) * TEXELS + x];
                *texel = texel.saturating_add(1);
            }
        }
    }
}

/// Faces whose inside meets the inside of another: exact, whatever the size of the overlap.
fn overlapping(uvs: &[[[f64; 2]; 3]], finite: &[bool], ctx: &Context<'_>) -> Result<usize> {
    let orient = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| {
        let [a, b, c] = [a, b, c].map(|p| Coord { x: p[0], y: p[1] });
        orient2d(a, b, c)
    };
    // Counter-clockwise faces with area; the others cover nothing.
    let solid: Vec<[[f64; 2]; 3]> = uvs
        .iter()
        .zip(finite)
        .filter(|(_, f)| **f)
        .filter_map(|(c, _)| match orient(c[0], c[1], c[2]) {
            s if s > 0.0 => Some(*c),
            s if s < 0.0 => Some([c[0], c[2], c[1]]),
            _ => None,
        })
        .collect();
    let boxes: Vec<Aabb> = solid.iter().map(|c| Aabb::of(&c.map(|p| Vec3([p[0], p[1], 0.0])))).collect();
    let tree = Bvh::build(&boxes, ctx)?;
    // Convex shapes have disjoint insides exactly where a side of one has all of the other on its far side or on it.
    let parted = |a: &[[f64; 2]; 3], b: &[[f64; 2]; 3]| {
        (0..3).any(|k| b.iter().all(|p| orient(a[k], a[(k + 1) % 3], *p) <= 0.0))
    };
    let blocks = (0..solid.len())
        .collect::<Vec<_>>()
        .par_chunks(256)
        .map(|block| {
            let mut found = 0;
            for &i in block {
                ctx.check()?;
                let (a, region) = (&solid[i], &boxes[i]);
                let hit = tree.meeting(region, |j| {
                    let (b, other) = (&solid[j as usize], &boxes[j as usize]);
                    // Boxes that only touch cannot share an inside.
                    let apart =
                        (0..2).any(|k| region.min[k] >= other.max[k] || other.min[k] >= region.max[k]);
                    if j as usize == i || apart || parted(a, b) || parted(b, a) {
                        ControlFlow::Continue(())
                    } else {
                        ControlFlow::Break(())
                    }
                });
                found += usize::from(hit.is_break());
            }
            Ok(found)
        })
        .collect::<Result<Vec<usize>>>()?;
    Ok(blocks.iter().sum())
}

#[cfg(test)]
mod tests {
    use super::super::shapes::sheet;
    use super::*;
    use crate::run::Run;
    use proptest::prelude::*;

    fn of(mesh: &TriMesh) -> UvQuality {
        Run::default().execute(|ctx| uv(mesh, ctx)).unwrap()
    }

    /// A sheet with UVs by a function of its positions.
    fn mapped(n: u32, f: impl Fn([f64; 2]) -> [f64; 2]) -> TriMesh {
        let mut mesh = sheet(1.0, n);
        mesh.corner_uv = Some(
            mesh.triangles
                .iter()
                .map(|t| {
                    t.map(|v| {
                        let p = mesh.positions[v as usize];
                        f([p[0], p[1]]).map(|x| x as f32)
                    })
                })
                .collect(),
        );
        mesh
    }

    fn near(a: f64, b: f64, tolerance: f64) {
        assert!((a - b).abs() < tolerance, "{a} is not {b}");
    }

    #[test]
    fn an_isometric_map_is_perfect_at_any_scale() {
        for s in [1.0, 0.5, 0.125] {
            let q = of(&mapped(4, |p| [s * p[0], s * p[1]]));
            assert_eq!((q.charts, q.flips, q.degenerate, q.overlapping_faces), (1, 0, 0, 0));
            for v in [q.stretch_l2, q.stretch_linf, q.stretch_median, q.stretch_p95, q.conformal] {
                near(v, 1.0, 1e-6);
            }
            assert_eq!((q.seam, q.overlap, q.inside, q.finite), (0.0, 0.0, true, true));
            // The texels on the diagonals have their centres on a side and count for neither face.
            near(q.coverage, s * s, 5e-3);
        }
    }

    #[test]
    fn a_sheet_pulled_to_twice_its_width_has_the_known_stretch() {
        // Singular values 1 and 1/2, times sqrt 2 for equal areas.
        let q = of(&mapped(4, |p| [p[0], 0.5 * p[1]]));
        let (s1, s2) = (2f64.sqrt(), 0.5f64.sqrt());
        near(q.stretch_l2, (0.5 * (s1.powi(-2) + s2.powi(-2))).sqrt(), 1e-6);
        near(q.stretch_linf, 1.0 / s2, 1e-6);
        near(q.stretch_p95, s1, 1e-6);
        near(q.conformal, 2.0, 1e-6);
    }

    #[test]
    fn a_cut_makes_two_charts_and_a_seam_of_its_length() {
        let mut mesh = mapped(4, |p| [0.4 * p[0], 0.4 * p[1]]);
        let left: Vec<bool> =
            mesh.triangles.iter().map(|t| t.iter().all(|&v| mesh.positions[v as usize][0] <= 0.5)).collect();
        for (c, left) in mesh.corner_uv.as_mut().unwrap().iter_mut().zip(left) {
            if left {
                c.iter_mut().for_each(|p| p[1] += 0.5);
            }
        }
        let q = of(&mesh);
        assert_eq!((q.charts, q.overlapping_faces), (2, 0));
        near(q.seam, 1.0, 1e-12);
        // The same surface with a vertex per corner, as in glTF files, has the same seam.
        let split = TriMesh {
            positions: mesh.triangles.iter().flatten().map(|&v| mesh.positions[v as usize]).collect(),
            triangles: (0..mesh.triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
            ..mesh.clone()
        };
        assert_eq!(of(&split), q);
    }

    #[test]
    fn folds_flip_and_overlap() {
        // Folded at x = 3/4: a quarter of the sheet lies turned on its neighbour.
        let q = of(&mapped(4, |p| [if p[0] > 0.75 { 1.5 - p[0] } else { p[0] }, p[1]]));
        assert_eq!((q.flips, q.charts), (8, 1));
        assert_eq!(q.overlapping_faces, 16);
        near(q.overlap, 1.0 / 3.0, 0.01);
        // A mirrored chart as a whole is not flipped.
        assert_eq!(of(&mapped(4, |p| [1.0 - p[0], p[1]])).flips, 0);
    }

    #[test]
    fn the_smallest_overlap_is_found_and_touching_is_none() {
        let pair = |dx: f32| {
            let mut mesh = TriMesh::new(
                vec![
                    [0.0; 3],
                    [1.0, 0.0, 0.0],
                    [0.0, 1.0, 0.0],
                    [5.0, 0.0, 0.0],
                    [6.0, 0.0, 0.0],
                    [5.0, 1.0, 0.0],
                ],
                vec![[0, 1, 2], [3, 4, 5]],
            );
            let a = [[0.0, 0.0], [0.5, 0.0], [0.0, 0.5]];
            let b = [[0.5 + dx, 0.0], [1.0, 0.0], [0.5 + dx, 0.5]];
            mesh.corner_uv = Some(vec![a, b]);
            of(&mesh).overlapping_faces
        };
        assert_eq!((pair(0.0), pair(1e-7), pair(-1e-7)), (0, 0, 2));
    }

    #[test]
    fn collapsed_outside_and_undefined_uvs_are_told_apart() {
        let q = of(&mapped(2, |p| [p[0], 0.0]));
        assert_eq!((q.degenerate, q.coverage), (8, 0.0));
        assert!(q.stretch_l2.is_infinite());
        let q = of(&mapped(2, |p| [p[0] + 0.5, p[1]]));
        assert!(!q.inside && q.finite);
        let mut mesh = mapped(2, |p| p);
        mesh.corner_uv.as_mut().unwrap()[0][0][0] = f32::NAN;
        let q = of(&mesh);
        assert!(!q.finite && !q.inside);
        assert_eq!(q.degenerate, 1);
        near(q.stretch_median, 1.0, 0.1);
    }

    #[test]
    fn the_smaller_stretch_of_a_needle_is_exact_however_large_the_other_is() {
        // 1 by 1e-9 in space, sheared far sideways in the texture at the same area: s1 is 1e9, s2 its inverse.
        let mesh = TriMesh::new(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1e-9, 0.0]], vec![[0, 1, 2]]);
        let (s1, s2) = singular_values(&mesh, 0, &[[0.0, 0.0], [1.0, 0.0], [1.0, 1e-9]], 1.0);
        assert!((s1 / 1e9 - 1.0).abs() < 1e-9 && (s2 / 1e-9 - 1.0).abs() < 1e-9, "{s1} {s2}");
    }

    #[test]
    fn meshes_without_uvs_are_errors() {
        let run = |m: &TriMesh| Run::default().execute(|ctx| uv(m, ctx));
        assert!(matches!(run(&sheet(1.0, 2)), Err(Error::EmptyInput { .. })));
        assert!(matches!(run(&TriMesh::default()), Err(Error::EmptyInput { .. })));
        let short = TriMesh { corner_uv: Some(vec![[[0.0; 2]; 3]]), ..sheet(1.0, 2) };
        assert!(matches!(run(&short), Err(Error::InvalidArgument { .. })));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]
        #[test]
        fn stretch_ignores_rotation_and_scale_on_both_sides(angle in 0.0f64..6.3, s in 0.1f64..0.6, big in 1e-3f64..1e3) {
            let shear = |p: [f64; 2]| [p[0] + 0.3 * p[1], 0.7 * p[1]];
            let turn = |p: [f64; 2]| {
                let (c, d) = (angle.cos(), angle.sin());
                [0.5 + s * (c * p[0] - d * p[1]), 0.5 + s * (d * p[0] + c * p[1])]
            };
            let one = of(&mapped(3, shear));
            let mut turned = mapped(3, |p| turn(shear(p)));
            for p in &mut turned.positions {
                *p = p.map(|x| big * x);
            }
            let two = of(&turned);
            for (a, b) in [(one.stretch_l2, two.stretch_l2), (one.stretch_p95, two.stretch_p95), (one.conformal, two.conformal)] {
                prop_assert!((a / b - 1.0).abs() < 1e-4, "{a} {b}");
            }
            prop_assert_eq!((one.charts, one.flips, one.overlapping_faces), (two.charts, two.flips, two.overlapping_faces));
        }
    }
}
