//! Patches with shorter borders, each in one piece.
//!
//! In: a patch per face. Out: the same.

use super::cluster::Cluster;
use super::constants::SEGMENT;
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::unwrap::surface::{Cells, NONE, Surface};

/// Moves border cells to the neighbouring patch where that shortens the border.
pub(super) fn smooth(s: &Surface, label: &mut [u32], clusters: &[Cluster], ctx: &Context<'_>) -> Result<()> {
    let axis: Vec<Vec3> =
        clusters.iter().map(|c| if c.stamp == NONE { Vec3::ZERO } else { c.sum.normalized() }).collect();
    // Patches beyond each edge of the cell, and how long the border with each is.
    let mut near: Vec<(u32, f64)> = Vec::new();
    for _ in 0..SEGMENT.smooth_passes {
        ctx.check()?;
        let mut moved = 0;
        for c in 0..s.cells.as_ref().map_or(label.len(), Cells::count) as u32 {
            ctx.check_at(c as usize)?;
            let own = [c];
            let faces = s.cells.as_ref().map_or(&own[..], |cells| cells.faces(c));
            let first = faces[0] as usize;
            if label[first] == NONE {
                continue;
            }
            near.clear();
            let mut here = 0.0;
            for &f in faces {
                for k in 0..3 {
                    let h = s.twin[f as usize][k];
                    if h == NONE || s.cells.is_some() && s.cell(h / 3) == c {
                        continue;
                    }
                    let (l, length) = (label[h as usize / 3], s.cost(f as usize, k));
                    if l == label[first] {
                        here += length;
                    } else if l != NONE {
                        match near.iter_mut().find(|n| n.0 == l) {
                            Some(n) => n.1 += length,
                            None => near.push((l, length)),
                        }
                    }
                }
            }
            let mut best = (0.0, label[first]);
            for &(l, share) in &near {
                let to = axis[l as usize];
                if faces.iter().any(|&f| s.normal[f as usize].dot(to) < SEGMENT.cone_cos) {
                    continue;
                }
                // A cell that is much flatter against the other patch goes there even at equal length.
                let normal = s.normal[first];
                let turn = normal.dot(to) - normal.dot(axis[label[first] as usize]);
                let gain = share - here + SEGMENT.flatter * turn * share.max(here);
                if gain > best.0 + SEGMENT.least_gain {
                    best = (gain, l);
                }
            }
            if best.1 != label[first] {
                faces.iter().for_each(|&f| label[f as usize] = best.1);
                moved += 1;
            }
        }
        if moved == 0 {
            break;
        }
    }
    Ok(())
}

/// Numbers the connected pieces of equal label.
pub(super) fn split_components(s: &Surface, label: &[u32], ctx: &Context<'_>) -> Result<(Vec<u32>, usize)> {
    let mut out = vec![NONE; label.len()];
    let mut count = 0;
    let mut stack = Vec::new();
    let mut seen = 0;
    for f in 0..label.len() {
        ctx.check_at(f)?;
        if out[f] != NONE || label[f] == NONE {
            continue;
        }
        out[f] = count;
        stack.push(f as u32);
        while let Some(f) = stack.pop() {
            seen += 1;
            ctx.check_at(seen)?;
            for &h in &s.twin[f as usize] {
                if h != NONE {
                    let g = h as usize / 3;
                    if out[g] == NONE && label[g] == label[f as usize] {
                        out[g] = count;
                        stack.push(g as u32);
                    }
                }
            }
        }
        count += 1;
    }
    Ok((out, count as usize))
}
