//! Which half-edges are the two sides of one edge.
//!
//! In: triangles, and where they must not hang together. Out: the twin of each half-edge, one at most.

use super::constants::SURFACE;
use crate::error::Result;
use crate::run::Context;
use crate::spatial::edges::Edges;
use crate::unwrap::options::UnwrapOptions;
use rustc_hash::FxHashSet;

/// No half-edge, no chart, no face.
pub(crate) const NONE: u32 = u32::MAX;

/// The half-edges in pairs.
pub(crate) struct Twins {
    /// Twin (`3 * face + slot`) of the edge from corner `slot` of a face to the next; [`NONE`] at borders.
    pub twin: Vec<[u32; 3]>,
    /// Edges cut because more than two faces, or two of clashing orientation, meet there.
    pub non_manifold: usize,
    /// Faces that repeat the three vertices of an earlier one.
    pub duplicate: usize,
}

/// For each face how many earlier ones have the same vertices.
fn copies(tri: &[[u32; 3]], usable: &[bool], edges: &Edges, ctx: &Context<'_>) -> Result<Vec<u32>> {
    let most = tri.iter().flatten().max().map_or(0, |&v| v as usize + 1);
    let mut at_vertex = vec![0u32; most];
    for (i, edge) in edges.iter().enumerate() {
        ctx.check_at(i)?;
        at_vertex[edge[0].low() as usize] += edge.iter().filter(|h| usable[h.face()]).count() as u32;
    }
    let mut copies = vec![0u32; tri.len()];
    // The third vertex of each face that has this edge between its two lesser ones.
    let mut thirds: Vec<u32> = Vec::new();
    for (i, edge) in edges.iter().enumerate() {
        ctx.check_at(i)?;
        if edge.len() < 2 || at_vertex[edge[0].low() as usize] > SURFACE.most_at_vertex {
            continue;
        }
        thirds.clear();
        for h in edge.iter().filter(|h| usable[h.face()]) {
            let (f, k) = (h.face(), h.1 as usize % 3);
            let third = tri[f][(k + 2) % 3];
            if third > h.high() {
                copies[f] = thirds.iter().filter(|&&t| t == third).count() as u32;
                thirds.push(third);
            }
        }
    }
    Ok(copies)
}

/// Pairs the half-edges of usable faces.
pub(crate) fn pair_edges(
    tri: &[[u32; 3]],
    usable: &[bool],
    options: &UnwrapOptions,
    ctx: &Context<'_>,
) -> Result<Twins> {
    let edges = Edges::new(tri, ctx)?;
    // A duplicate face lives on a layer of its own, so that sheets of duplicates stay connected.
    let layer = copies(tri, usable, &edges, ctx)?;
    let seams: FxHashSet<(u32, u32)> =
        options.seam_edges.iter().flatten().map(|e| (e[0].min(e[1]), e[0].max(e[1]))).collect();
    let mut twin = vec![[NONE; 3]; tri.len()];
    let mut non_manifold = 0;
    // The half-edges of one edge: layer, whether it runs from the lesser vertex, half-edge.
    let mut sides: Vec<(u32, bool, u32)> = Vec::new();
    for (i, edge) in edges.iter().enumerate() {
        ctx.check_at(i)?;
        let [low, high] = edge[0].ends();
        sides.clear();
        let own = edge.iter().filter(|h| usable[h.face()]);
        sides.extend(own.map(|h| (layer[h.face()], h.start(tri) == low, h.1)));
        sides.sort_unstable();
        for sides in sides.chunk_by(|a, b| a.0 == b.0) {
            match *sides {
                [(_, a, g), (_, b, h)] if a != b => {
                    let (g, h) = (g as usize, h as usize);
                    let same_group = options.face_group.as_ref().is_none_or(|c| c[g / 3] == c[h / 3]);
                    if same_group && !seams.contains(&(low, high)) {
                        twin[g / 3][g % 3] = h as u32;
                        twin[h / 3][h % 3] = g as u32;
                    }
                }
                [_] => {}
                _ => non_manifold += 1,
            }
        }
    }
    let duplicate = layer.iter().filter(|&&l| l > 0).count();
    Ok(Twins { twin, non_manifold, duplicate })
}
