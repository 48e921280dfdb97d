//! A tile, denoised: the task that takes nearly all of the time.
//!
//! In: the tile's points and those about it. Out: where its own points go; the triangles of the surface that
//! are its own, by their middles; where these end, for the tiles beside it to go on from.

use crate::error::Result;
use crate::folder::Folder;
use crate::plan::Plan;
use crate::store;
use atlasfit::Run;
use atlasfit::geometry::PointCloud;
use atlasfit::pipeline::tile::{NO_PART, TileSurface, denoise_tile};
use rustc_hash::FxHashMap;

/// A place as bits: equal places are one.
pub(crate) type Key = [u64; 3];

/// The bits of a place.
pub(crate) fn key(p: [f64; 3]) -> Key {
    p.map(|x| (x + 0.0).to_bits())
}

/// Denoises a tile and writes what comes of it.
pub(crate) fn run(plan: &Plan, folder: Folder<'_>, tile: usize, run: &mut Run<'_>) -> Result<()> {
    let rows = folder.rows(tile)?;
    let survey = plan.known;
    let cloud = PointCloud::from_positions(rows.iter().map(|r| r.position).collect());
    let names: Vec<u64> = rows.iter().map(|r| r.row).collect();
    let own: Vec<bool> = rows.iter().map(|r| plan.tree.of(r.position) as usize == tile).collect();
    drop(rows);
    let done = denoise_tile(&cloud, &names, &survey, &plan.options.of_core(), run)?;
    drop(cloud);
    store::whole(&folder.moved(tile), |out| {
        let of = || names.iter().zip(&done.points).zip(&own).filter(|(_, own)| **own);
        out.list(&of().map(|((row, _), _)| *row).collect::<Vec<u64>>())?;
        out.column(&of().map(|((_, p), _)| p.position).collect::<Vec<_>>())?;
        out.list(&of().map(|((_, p), _)| u8::from(p.outlier)).collect::<Vec<u8>>())
    })?;
    let part = Part::of(done.surface, |p| plan.tree.of(survey.to_user(p)) as usize == tile);
    part.seam.write(folder, tile)?;
    write_mesh(&part.surface, folder, tile)
}

/// An edge where a tile's triangles end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct End {
    /// Its places, in the order in which the tile's triangle has them.
    pub at: [[f64; 3]; 2],
    /// The tile's part that it is of.
    pub part: u32,
}

/// Sums over a part's own triangles.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Sums {
    pub area: f64,
    /// Six times the volume between the triangles and the origin.
    pub volume: f64,
}

/// Where a tile's surface ends, and what is known of its parts.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Seam {
    /// Edges whose other triangle is another tile's.
    pub cut: Vec<End>,
    /// Edges without another triangle.
    pub border: Vec<End>,
    /// Other edges between two places where it ends: closing triangles must not use them again.
    pub across: Vec<[[f64; 3]; 2]>,
    /// The parts.
    pub parts: Vec<Sums>,
}

/// A tile's own part of the surface.
struct Part {
    surface: TileSurface,
    seam: Seam,
}

/// The middle of a triangle, the same for every order of its corners.
fn middle(mut at: [[f64; 3]; 3]) -> [f64; 3] {
    at.sort_unstable_by(|a, b| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal));
    std::array::from_fn(|k| (at[0][k] + at[1][k] + at[2][k]) / 3.0)
}

impl Part {
    /// The triangles whose middles `owns` says are the tile's.
    fn of(mut s: TileSurface, owns: impl Fn([f64; 3]) -> bool) -> Self {
        let at = |v: u32| s.positions[v as usize];
        let own: Vec<bool> = s.triangles.iter().map(|t| owns(middle(t.map(at)))).collect();
        // For each edge how many triangles it has, and how many of these are the tile's.
        let mut edges: FxHashMap<[u32; 2], [u8; 2]> = FxHashMap::default();
        for (t, &own) in s.triangles.iter().zip(&own) {
            for k in 0..3 {
                let count = edges.entry(ends([t[k], t[(k + 1) % 3]])).or_default();
                count[0] += 1;
                count[1] += u8::from(own);
            }
        }
        let mut seam = Seam::default();
        let parts = s.part.iter().max().map_or(0, |&p| p as usize + 1);
        seam.parts = vec![Sums::default(); parts];
        for (t, _) in s.triangles.iter().zip(&own).filter(|(_, own)| **own) {
            let part = s.part[t[0] as usize];
            let sums = &mut seam.parts[part as usize];
            let [a, b, c] = t.map(at);
            let n = cross(sub(b, a), sub(c, a));
            sums.area += 0.5 * dot(n, n).sqrt();
            sums.volume += dot(a, cross(b, c));
            for k in 0..3 {
                let edge = [t[k], t[(k + 1) % 3]];
                let [all, own] = edges[&ends(edge)];
                let end = End { at: edge.map(at), part };
                match (all, own) {
                    (1, _) => seam.border.push(end),
                    (2, 1) => seam.cut.push(end),
                    _ => {}
                }
            }
        }
        let mut at_end = vec![false; s.positions.len()];
        for (edge, count) in &edges {
            if *count == [2, 1] {
                edge.iter().for_each(|&v| at_end[v as usize] = true);
            }
        }
        let is_across = |edge: &[u32; 2], [all, own]: [u8; 2]| {
            own > 0 && [all, own] != [2, 1] && edge.iter().all(|&v| at_end[v as usize])
        };
        let across = edges.iter().filter(|(edge, count)| is_across(edge, **count));
        seam.across = across.map(|(edge, _)| edge.map(|v| s.positions[v as usize])).collect();
        seam.across.sort_unstable_by_key(|e| e.map(key));
        let mut of_triangle = own.iter();
        s.triangles.retain(|_| *of_triangle.next().unwrap_or(&false));
        Self { surface: compact(s), seam }
    }
}

/// An edge without its direction.
pub(crate) fn ends([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

pub(crate) fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}
pub(crate) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
pub(crate) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The surface without vertices that no triangle names.
pub(crate) fn compact(s: TileSurface) -> TileSurface {
    let mut number = vec![NO_PART; s.positions.len()];
    s.triangles.iter().flatten().for_each(|&v| number[v as usize] = 0);
    let kept: Vec<usize> = (0..number.len()).filter(|&v| number[v] == 0).collect();
    (0..).zip(&kept).for_each(|(k, &v)| number[v] = k);
    TileSurface {
        positions: kept.iter().map(|&v| s.positions[v]).collect(),
        normals: kept.iter().map(|&v| s.normals[v]).collect(),
        part: kept.iter().map(|&v| s.part[v]).collect(),
        error: kept.iter().map(|&v| s.error[v]).collect(),
        longest: kept.iter().map(|&v| s.longest[v]).collect(),
        between: s.between,
        triangles: s.triangles.iter().map(|t| t.map(|v| number[v as usize])).collect(),
    }
}

fn write_mesh(s: &TileSurface, folder: Folder<'_>, tile: usize) -> Result<()> {
    store::whole(&folder.mesh(tile), |out| {
        out.column(&s.positions)?;
        out.column(&s.normals)?;
        out.list(&s.part)?;
        out.list(&s.error)?;
        out.list(&s.longest)?;
        out.list(&[u8::from(s.between)])?;
        out.column(&s.triangles)
    })
}

/// A tile's own triangles.
pub(crate) fn read_mesh(folder: Folder<'_>, tile: usize) -> Result<TileSurface> {
    let mut from = store::Reader::open(&folder.mesh(tile))?;
    Ok(TileSurface {
        positions: from.column()?,
        normals: from.column()?,
        part: from.list()?,
        error: from.list()?,
        longest: from.list()?,
        between: from.list::<u8>()? == [1],
        triangles: from.column()?,
    })
}

impl Seam {
    fn write(&self, folder: Folder<'_>, tile: usize) -> Result<()> {
        store::whole(&folder.seam(tile), |out| {
            for list in [&self.cut, &self.border] {
                out.column(&list.iter().flat_map(|e| e.at).collect::<Vec<_>>())?;
                out.list(&list.iter().map(|e| e.part).collect::<Vec<_>>())?;
            }
            out.column(self.across.as_flattened())?;
            out.column(&self.parts.iter().map(|s| [s.area, s.volume]).collect::<Vec<_>>())
        })
    }

    pub fn read(folder: Folder<'_>, tile: usize) -> Result<Self> {
        let mut from = store::Reader::open(&folder.seam(tile))?;
        let mut list = || -> Result<Vec<End>> {
            let (at, part) = (from.column()?, from.list()?);
            Ok(at.as_chunks::<2>().0.iter().zip(part).map(|(&at, part)| End { at, part }).collect())
        };
        let (cut, border) = (list()?, list()?);
        let across = from.column()?.as_chunks::<2>().0.to_vec();
        let parts = from.column()?.into_iter().map(|[area, volume]| Sums { area, volume }).collect();
        Ok(Self { cut, border, across, parts })
    }
}
