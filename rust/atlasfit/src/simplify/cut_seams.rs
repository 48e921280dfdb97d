//! Any mesh, cut along its seams and with what is no surface pinned.
//!
//! In: positions, triangles, UVs. Out: one vertex per pair of place and UV, and how each may move. Vertices
//! at one place are joined first, so that a mesh whose vertices were split for its normals is whole.

use super::data::{Role, Seams};
use crate::error::Result;
use crate::numeric::sort::sort;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::edges::Edges;
use crate::spatial::lists::Lists;
use crate::spatial::sets::Sets;
use crate::spatial::weld::weld;

/// A mesh that is cut along its seams.
pub(super) struct Cut {
    pub(super) positions: Vec<Vec3>,
    /// Triangles that have an area to speak of: three places.
    pub(super) triangles: Vec<[u32; 3]>,
    /// The triangle of the whole mesh that each was.
    pub(super) triangle_of: Vec<u32>,
    /// A vertex of the whole mesh that each was.
    pub(super) source: Vec<u32>,
    pub(super) seams: Seams,
}

/// Cuts a mesh; `corner_uv` has three UVs for each triangle. Triangles with a place that is not finite, or
/// with fewer than three places, are left out.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn cut(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    corner_uv: Option<&[[[f32; 2]; 3]]>,
    ctx: &Context<'_>,
) -> Result<Cut> {
    let first = weld(positions, 0.0, ctx)?;
    let finite = |v: &u32| positions[*v as usize].iter().all(|x| x.is_finite());
    let whole = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| first[v as usize]);
        a != b && b != c && c != a && t.iter().all(finite)
    };
    let triangle_of: Vec<u32> =
        (0..triangles.len() as u32).filter(|&t| whole(&triangles[t as usize])).collect();
    // The corners at each place.
    let place_of = |&t: &u32| triangles[t as usize].map(|v| [first[v as usize]]);
    let place: Vec<[u32; 1]> = triangle_of.iter().flat_map(place_of).collect();
    let at = Lists::new(positions.len(), &place, ctx)?;
    drop(place);
    let mut out = Cut {
        positions: Vec::new(),
        triangles: vec![[0; 3]; triangle_of.len()],
        triangle_of,
        source: Vec::new(),
        seams: Seams::default(),
    };
    let mut corners: Vec<([u32; 2], u32)> = Vec::new();
    for place in 0..positions.len() as u32 {
        ctx.check_at(place as usize)?;
        let uv_of = |c: u32, uv: &[[[f32; 2]; 3]]| {
            uv[out.triangle_of[c as usize / 3] as usize][c as usize % 3].map(|x| (x + 0.0).to_bits())
        };
        corners.clear();
        corners.extend(at.of(place).iter().map(|&c| (corner_uv.map_or([0; 2], |uv| uv_of(c, uv)), c)));
        if corner_uv.is_some() {
            sort(&mut corners, ctx)?;
        }
        // Corners that agree in their UVs too are one vertex.
        for same in corners.chunk_by(|a, b| a.0 == b.0) {
            let v = out.positions.len() as u32;
            let (uv, corner) = same[0];
            let given = triangles[out.triangle_of[corner as usize / 3] as usize][corner as usize % 3];
            out.positions.push(positions[given as usize]);
            out.source.push(given);
            out.seams.place.push(place);
            if corner_uv.is_some() {
                out.seams.uv.push(uv.map(|bits| f64::from(f32::from_bits(bits))));
            }
            same.iter().for_each(|&(_, c)| out.triangles[c as usize / 3][c as usize % 3] = v);
        }
    }
    out.seams.role = roles(&out.triangles, &out.seams.place, ctx)?;
    Ok(out)
}

/// How each vertex may move. `place` ascends.
fn roles(triangles: &[[u32; 3]], place: &[u32], ctx: &Context<'_>) -> Result<Vec<Role>> {
    let n = place.len();
    // Places from 0 on: the number of each, and where its vertices begin.
    let mut number = Vec::with_capacity(n);
    let mut start: Vec<u32> = Vec::new();
    for v in 0..n {
        if v == 0 || place[v] != place[v - 1] {
            start.push(v as u32);
        }
        number.push(start.len() as u32 - 1);
    }
    start.push(n as u32);
    let welded: Vec<[u32; 3]> = triangles.iter().map(|t| t.map(|v| number[v as usize])).collect();
    let mut seams = ctx.filled(0u32, start.len())?;
    let (mut border, mut pinned) = (ctx.filled(false, start.len())?, ctx.filled(false, start.len())?);
    let mut fans = Sets::new(3 * triangles.len());
    for (i, edge) in Edges::new(&welded, ctx)?.iter().enumerate() {
        ctx.check_at(i)?;
        let ends = edge[0].ends().map(|p| p as usize);
        match edge {
            [_] => ends.iter().for_each(|&p| border[p] = true),
            [one, other] => {
                // The corners of both triangles at each end of the edge.
                let at = ends.map(|p| {
                    [one, other].map(|h| {
                        let f = h.face();
                        let k = (0..3).find(|&k| welded[f][k] as usize == p).unwrap_or(0);
                        (3 * f + k) as u32
                    })
                });
                let vertex = |c: u32| triangles[c as usize / 3][c as usize % 3];
                if at.iter().all(|[a, b]| vertex(*a) == vertex(*b)) {
                    at.iter().for_each(|[a, b]| fans.join(*a, *b));
                } else {
                    ends.iter().for_each(|&p| seams[p] += 1);
                }
            }
            _ => ends.iter().for_each(|&p| pinned[p] = true),
        }
    }
    // A vertex with two fans holds two sheets together.
    let mut fan = ctx.filled(u32::MAX, n)?;
    for (c, &v) in triangles.as_flattened().iter().enumerate() {
        ctx.check_at(c)?;
        let root = fans.find(c as u32);
        let known = &mut fan[v as usize];
        pinned[number[v as usize] as usize] |= *known != u32::MAX && *known != root;
        *known = root;
    }
    let role = |v: usize| {
        let p = number[v] as usize;
        let (from, end) = (start[p], start[p + 1]);
        match (end - from, seams[p]) {
            _ if pinned[p] => Role::Pinned,
            (1, 0) => Role::Free,
            (2, 2) if !border[p] => Role::Seam(from + end - 1 - v as u32),
            (copies, _) => Role::Corner(copies),
        }
    };
    Ok((0..n).map(role).collect())
}
