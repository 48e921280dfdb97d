//! Exact test that a flattened chart covers no point of the plane twice.
//!
//! In: triangles and positions. Out: yes or no. If all triangles are counter-clockwise, no vertex is wound
//! round twice and the border curves neither touch nor cross themselves or each other, the chart is
//! injective: the degree of the map is then 1 inside by the turning numbers of the border (Hopf) and the
//! Euler characteristic. Orientation signs are exact (Shewchuk 1997, crate `robust`).

use crate::error::Result;
use crate::numeric::plane::{corners, twice_area};
use crate::run::Context;
use robust::{Coord, orient2d};
use std::f64::consts::PI;

fn orient(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    let k = |p: [f64; 2]| Coord { x: p[0], y: p[1] };
    orient2d(k(a), k(b), k(c))
}

/// Whether a triangle is counter-clockwise, exactly.
pub(crate) fn positive(p: [[f64; 2]; 3]) -> bool {
    orient(p[0], p[1], p[2]) > 0.0
}

/// Whether closed segments ab and cd share a point, exactly.
pub(super) fn touch(a: [f64; 2], b: [f64; 2], c: [f64; 2], d: [f64; 2]) -> bool {
    for k in 0..2 {
        if a[k].max(b[k]) < c[k].min(d[k]) || c[k].max(d[k]) < a[k].min(b[k]) {
            return false;
        }
    }
    let (o1, o2) = (orient(a, b, c), orient(a, b, d));
    if (o1 > 0.0 && o2 > 0.0) || (o1 < 0.0 && o2 < 0.0) {
        return false;
    }
    let (o3, o4) = (orient(c, d, a), orient(c, d, b));
    !((o3 > 0.0 && o4 > 0.0) || (o3 < 0.0 && o4 < 0.0))
}

/// Whether the chart is injective. `border` lists (triangle, slot) of the free edges.
pub(crate) fn injective(
    tris: &[[u32; 3]],
    uv: &[[f64; 2]],
    border: &[(u32, u8)],
    ctx: &Context<'_>,
) -> Result<bool> {
    Ok(turns_once(tris, uv, &[], ctx)? && !border_touches(tris, uv, border, ctx)?)
}

/// Whether every triangle is counter-clockwise and every vertex is wound round once at most. Vertices marked
/// in `skip` (which may be empty) are not judged: not all their triangles are given.
pub(crate) fn turns_once(
    tris: &[[u32; 3]],
    uv: &[[f64; 2]],
    skip: &[bool],
    ctx: &Context<'_>,
) -> Result<bool> {
    if !tris.iter().all(|t| positive(corners(*t, uv))) {
        return Ok(false);
    }
    let over = overwound(tris, uv, ctx)?;
    Ok(over.iter().enumerate().all(|(v, &o)| !o || skip.get(v).is_some_and(|&s| s)))
}

/// The triangles that are not counter-clockwise, or have a vertex that is wound round more than once.
pub(crate) fn wrong(tris: &[[u32; 3]], uv: &[[f64; 2]], ctx: &Context<'_>) -> Result<Vec<bool>> {
    let over = overwound(tris, uv, ctx)?;
    Ok(tris.iter().map(|t| t.iter().any(|&v| over[v as usize]) || !positive(corners(*t, uv))).collect())
}

/// Per vertex, whether it is wound round more than once.
pub(crate) fn overwound(tris: &[[u32; 3]], uv: &[[f64; 2]], ctx: &Context<'_>) -> Result<Vec<bool>> {
    let mut angle = vec![0f64; uv.len()];
    // Next minus previous neighbour, summed: zero exactly where the triangles close round a vertex.
    let mut open = vec![0i64; uv.len()];
    for (i, t) in tris.iter().enumerate() {
        ctx.check_at(i)?;
        let p = corners(*t, uv);
        for k in 0..3 {
            let (a, b, c) = (p[k], p[(k + 1) % 3], p[(k + 2) % 3]);
            let d = (b[0] - a[0]) * (c[0] - a[0]) + (b[1] - a[1]) * (c[1] - a[1]);
            angle[t[k] as usize] += twice_area(a, b, c).atan2(d);
            open[t[k] as usize] += i64::from(t[(k + 1) % 3]) - i64::from(t[(k + 2) % 3]);
        }
    }
    // Inside, angles sum to 2 pi or to 4 pi and more; at the border a full turn already touches itself.
    let full = |open: i64| if open != 0 { 2.0 * PI - 1e-7 } else { 3.0 * PI };
    Ok(angle.iter().zip(open).map(|(&a, open)| a >= full(open)).collect())
}

/// Whether the border curves touch or cross themselves or each other.
pub(crate) fn border_touches(
    tris: &[[u32; 3]],
    uv: &[[f64; 2]],
    border: &[(u32, u8)],
    ctx: &Context<'_>,
) -> Result<bool> {
    Ok(touching(tris, uv, border, ctx)?.is_some())
}

/// Two triangles whose border edges touch, if any do.
pub(crate) fn touching(
    tris: &[[u32; 3]],
    uv: &[[f64; 2]],
    border: &[(u32, u8)],
    ctx: &Context<'_>,
) -> Result<Option<[u32; 2]>> {
    let segments: Vec<[u32; 2]> = border
        .iter()
        .map(|&(t, k)| [tris[t as usize][k as usize], tris[t as usize][(k as usize + 1) % 3]])
        .collect();
    Ok(segments_touch(&segments, uv, ctx)?.map(|pair| pair.map(|i| border[i as usize].0)))
}

/// Two segments that touch without sharing a vertex, if there are any.
pub(crate) fn segments_touch(
    segments: &[[u32; 2]],
    uv: &[[f64; 2]],
    ctx: &Context<'_>,
) -> Result<Option<[u32; 2]>> {
    let n = segments.len();
    let (mut lo, mut hi) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    let mut total = 0.0;
    for s in segments {
        let (a, b) = (uv[s[0] as usize], uv[s[1] as usize]);
        for p in [a, b] {
            for k in 0..2 {
                lo[k] = lo[k].min(p[k]);
                hi[k] = hi[k].max(p[k]);
            }
        }
        total += (a[0] - b[0]).abs() + (a[1] - b[1]).abs();
    }
    if n < 4 {
        return Ok(None);
    }
    let size = [hi[0] - lo[0], hi[1] - lo[1]];
    // Cells about one mean segment wide, but never many more cells than segments.
    let cell = (total / n as f64).max((size[0] * size[1] / (4.0 * n as f64)).sqrt()).max(1e-300);
    let dims = [0, 1].map(|k| ((size[k] / cell) as usize + 1).min(8 * n));
    let at = |x: f64, k: usize| (((x - lo[k]) / cell) as usize).min(dims[k] - 1);
    let range = |s: &[u32; 2]| {
        let (a, b) = (uv[s[0] as usize], uv[s[1] as usize]);
        [0, 1].map(|k| (at(a[k].min(b[k]), k), at(a[k].max(b[k]), k)))
    };
    let mut start = vec![0u32; dims[0] * dims[1] + 1];
    for (q, s) in segments.iter().enumerate() {
        ctx.check_at(q)?;
        let [x, y] = range(s);
        for j in y.0..=y.1 {
            for i in x.0..=x.1 {
                start[j * dims[0] + i + 1] += 1;
            }
        }
    }
    for c in 0..dims[0] * dims[1] {
        start[c + 1] += start[c];
    }
    let mut fill = start.clone();
    let mut item = vec![0u32; start[dims[0] * dims[1]] as usize];
    for (q, s) in segments.iter().enumerate() {
        ctx.check_at(q)?;
        let [x, y] = range(s);
        for j in y.0..=y.1 {
            for i in x.0..=x.1 {
                let f = &mut fill[j * dims[0] + i];
                item[*f as usize] = q as u32;
                *f += 1;
            }
        }
    }
    for c in 0..dims[0] * dims[1] {
        ctx.check_at(c)?;
        let own = &item[start[c] as usize..start[c + 1] as usize];
        for (i, &p) in own.iter().enumerate() {
            for &q in &own[i + 1..] {
                let (s, t) = (segments[p as usize], segments[q as usize]);
                if s[0] == t[0] || s[0] == t[1] || s[1] == t[0] || s[1] == t[1] {
                    continue;
                }
                let [a, b, c, d] = [s[0], s[1], t[0], t[1]].map(|v| uv[v as usize]);
                if touch(a, b, c, d) {
                    return Ok(Some([p, q]));
                }
            }
        }
    }
    Ok(None)
}
