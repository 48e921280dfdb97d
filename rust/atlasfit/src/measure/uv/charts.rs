//! How UVs cut a mesh into charts.
//!
//! In: a mesh with texture coordinates per corner. Out: the chart of each face, the charts' outlines, the
//! length of the cuts.

use super::layout::{FaceUv, Pages, SAME_UV, laid_out};
use crate::error::Result;
use crate::geometry::TriMesh;
use crate::numeric::vec3::{self, Vec3};
use crate::run::Context;
use crate::spatial::edges::Edges;
use crate::spatial::sets::Sets;
use crate::spatial::weld::weld;

/// How the UVs cut a mesh into charts.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Charts {
    /// Chart of each face, numbered from 0 in the order of their first faces.
    pub of_face: Vec<u32>,
    /// Number of charts.
    pub count: usize,
    /// Half-edges where a chart ends, `3 * face + corner`: both sides of every cut, and the mesh's boundary.
    pub outline: Vec<u32>,
    /// The inner edges that are cut, by the half-edge of one side.
    pub cuts: Vec<u32>,
    /// Length of the inner edges that are cut, in the unit of the mesh.
    pub seam_length: f64,
}

/// Finds the charts: faces joined through edges with equal UVs at both ends. Where an edge has more than two
/// faces, each is compared with the next one in the order of their numbers.
///
/// # Errors
/// As [`uv`](super::uv).
///
/// ```
/// use atlasfit::{Run, geometry::TriMesh, measure};
/// let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
/// let mut square = TriMesh::new(corners.map(|[x, y]| [x, y, 0.0]).to_vec(), vec![[0, 1, 2], [0, 2, 3]]);
/// let uv = |v: u32| corners[v as usize].map(|x| x as f32);
/// square.corner_uv = Some(square.triangles.iter().map(|t| t.map(uv)).collect());
/// let charts = Run::default().execute(|ctx| measure::charts(&square, ctx))?;
/// assert_eq!((charts.count, charts.outline.len()), (1, 4));
/// # Ok::<(), atlasfit::Error>(())
/// ```
pub fn charts(mesh: &TriMesh, ctx: &Context<'_>) -> Result<Charts> {
    charts_of(mesh, &laid_out(mesh, &Pages::default())?.uvs, ctx)
}

/// [`charts`] of UVs that are laid out already.
pub(super) fn charts_of(mesh: &TriMesh, uvs: &[FaceUv], ctx: &Context<'_>) -> Result<Charts> {
    // Files that hold one vertex per corner (glTF) split vertices along seams: such a vertex is one place.
    let place = weld(vec3::of(&mesh.positions), 0.0, ctx)?;
    let triangles: Vec<[u32; 3]> = mesh.triangles.iter().map(|t| t.map(|v| place[v as usize])).collect();
    let edges = Edges::new(&triangles, ctx)?;
    let mut sets = Sets::new(triangles.len());
    let mut seam_length = 0.0;
    let (mut outline, mut cuts) = (Vec::new(), Vec::new());
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
                // An end that is not finite has no length.
                seam_length += Some((a - b).norm()).filter(|l| l.is_finite()).unwrap_or(0.0);
                outline.extend([pair[0].1, pair[1].1]);
                cuts.push(pair[0].1);
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
    Ok(Charts { of_face, count: count as usize, outline, cuts, seam_length })
}
