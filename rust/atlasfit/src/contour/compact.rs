//! Unused vertices dropped.
//!
//! In: a surface. Out: the same without vertices that no triangle names; vertex normals are unit and on the
//! triangles' side.

use super::surface::{Surface, corners};
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::triangle::area_vector;

/// Drops unused vertices and turns vertex normals to the triangles' side; vertices without a normal get that
/// of their triangles.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn compact(s: &mut Surface, ctx: &Context<'_>) -> Result<()> {
    let mut sum = vec![Vec3::ZERO; s.positions.len()];
    let mut used = vec![false; s.positions.len()];
    for (i, t) in s.triangles.iter().enumerate() {
        ctx.check_at(i)?;
        let n = area_vector(corners(&s.positions, t));
        for &v in t {
            sum[v as usize] += n;
            used[v as usize] = true;
        }
    }
    let mut map = vec![u32::MAX; s.positions.len()];
    let mut at = 0usize;
    for v in 0..s.positions.len() {
        ctx.check_at(v)?;
        if !used[v] {
            continue;
        }
        map[v] = at as u32;
        s.positions[at] = s.positions[v];
        s.chart[at] = s.chart[v];
        let n = if s.normals[v].dot(sum[v]) < 0.0 { -s.normals[v] } else { s.normals[v] };
        s.normals[at] = if n.norm() > 0.5 { n } else { sum[v].normalized() };
        at += 1;
    }
    s.positions.truncate(at);
    s.chart.truncate(at);
    s.normals.truncate(at);
    for t in &mut s.triangles {
        *t = t.map(|v| map[v as usize]);
    }
    ctx.check()
}
