//! The split form of a mesh with UVs: one vertex per pair of vertex and UV.
//!
//! In: triangles and a UV per corner. Out: the same triangles over new vertices.

use crate::error::Result;
use crate::run::Context;
use std::collections::HashMap;

/// A mesh with one vertex per pair of vertex and UV: what graphics cards draw. Vertices are numbered in the
/// order of their first corners.
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub struct SplitMesh {
    /// Three new vertices per triangle.
    pub triangles: Vec<[u32; 3]>,
    /// The mesh's vertex that each new vertex came from.
    pub source: Vec<u32>,
    /// The UV of each new vertex.
    pub uv: Vec<[f32; 2]>,
}

/// The same for faces of any number of corners.
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub struct SplitCorners {
    /// The new vertex of each corner.
    pub corners: Vec<u32>,
    /// The mesh's vertex that each new vertex came from.
    pub source: Vec<u32>,
    /// The UV of each new vertex.
    pub uv: Vec<[f32; 2]>,
}

impl SplitMesh {
    /// Splits triangles over so many vertices; `corner_uv` has three UVs for each.
    pub(super) fn new(
        vertices: usize,
        triangles: &[[u32; 3]],
        corner_uv: &[[[f32; 2]; 3]],
        ctx: &Context<'_>,
    ) -> Result<Self> {
        let split = split_corners(vertices, triangles.as_flattened(), corner_uv.as_flattened(), ctx)?;
        let SplitCorners { corners, source, uv } = split;
        Ok(Self { triangles: corners.as_chunks().0.to_vec(), source, uv })
    }
}

impl From<SplitMesh> for SplitCorners {
    fn from(SplitMesh { triangles, source, uv }: SplitMesh) -> Self {
        Self { corners: triangles.into_flattened(), source, uv }
    }
}

/// New vertices of one vertex that are searched one after the other; beyond them a map finds the UV.
const CHAIN: usize = 8;
/// No vertex.
const NONE: u32 = u32::MAX;

/// Splits corners, each with its vertex, one of so many, and its UV.
pub(super) fn split_corners(
    vertices: usize,
    corners: &[u32],
    corner_uv: &[[f32; 2]],
    ctx: &Context<'_>,
) -> Result<SplitCorners> {
    let mut out =
        SplitCorners { corners: Vec::with_capacity(corners.len()), source: Vec::new(), uv: Vec::new() };
    // The new vertices of each vertex as a linked list: the last one, and for each new one the one before it.
    let (mut last, mut before) = (vec![NONE; vertices], Vec::<u32>::new());
    let mut more: HashMap<(u32, [u32; 2]), u32> = HashMap::new();
    for (c, (&v, uv)) in corners.iter().zip(corner_uv).enumerate() {
        ctx.check_at(c)?;
        let bits = uv.map(f32::to_bits);
        let mut at = last[v as usize];
        let mut searched = 0;
        while at != NONE && searched < CHAIN && out.uv[at as usize].map(f32::to_bits) != bits {
            at = before[at as usize];
            searched += 1;
        }
        if searched == CHAIN {
            at = more.get(&(v, bits)).copied().unwrap_or(NONE);
        }
        if at == NONE {
            at = out.source.len() as u32;
            out.source.push(v);
            out.uv.push(*uv);
            if searched == CHAIN {
                more.insert((v, bits), at);
                before.push(NONE);
            } else {
                before.push(std::mem::replace(&mut last[v as usize], at));
            }
        }
        out.corners.push(at);
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::Run;
    use std::collections::HashSet;

    #[test]
    fn the_split_form_has_one_vertex_per_vertex_and_uv_however_many_meet() {
        // A fan round vertex 0: seven of eight triangles have a UV of their own there.
        let triangles: Vec<[u32; 3]> = (0..40).map(|i| [0, 1 + i, 2 + i]).collect();
        let at = |i: u32, v: u32| {
            [if i.is_multiple_of(8) { 0.0 } else { f32::from(i as u16) }, f32::from(v as u16)]
        };
        let corner_uv: Vec<[[f32; 2]; 3]> = triangles
            .iter()
            .map(|t| [at(t[1] - 1, 0), [0.5, f32::from(t[1] as u16)], [0.5, f32::from(t[2] as u16)]])
            .collect();
        let split = Run::default()
            .execute(|ctx| SplitMesh::new(42, &triangles, &corner_uv, ctx))
            .expect("nothing cancels");
        let corners = || triangles.iter().flatten().zip(corner_uv.iter().flatten());
        for ((&v, uv), &i) in corners().zip(split.triangles.iter().flatten()) {
            assert_eq!((split.source[i as usize], &split.uv[i as usize]), (v, uv));
        }
        let distinct: HashSet<(u32, [u32; 2])> =
            corners().map(|(&v, uv)| (v, uv.map(f32::to_bits))).collect();
        assert_eq!(split.source.len(), distinct.len());
        // In the order of their first corners.
        let mut met = 0;
        for &i in split.triangles.iter().flatten() {
            assert!(i <= met);
            met = met.max(i + 1);
        }
    }
}
