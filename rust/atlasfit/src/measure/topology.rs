//! How a mesh hangs together.
//!
//! In: a mesh. Vertices at one place (within a billionth of the longest side) count as one, so that a mesh
//! whose vertices are split along UV seams is judged as the surface that it shows. Faces that name a place
//! twice are counted and set aside. Out: counts.

use super::memory;
use crate::error::Result;
use crate::geometry::TriMesh;
use crate::numeric::vec3::{self, Vec3};
use crate::run::Context;
use crate::spatial::bvh::Aabb;
use crate::spatial::edges::Edges;
use crate::spatial::sets::Sets;
use crate::spatial::weld::weld;

/// Vertices nearer than this share of the bounding box's longest side are one: far above the rounding of f64
/// in any frame, far below the detail of any scan.
pub const WELD_SHARE: f64 = 1e-9;

/// Counts of a mesh's connectivity.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct Topology {
    /// Vertices in use, after welding.
    pub vertices: usize,
    /// Edges.
    pub edges: usize,
    /// Faces that name three different places.
    pub faces: usize,
    /// Faces that do not; they take no part in the other counts.
    pub degenerate_faces: usize,
    /// Vertices of the input that no face uses.
    pub unused_vertices: usize,
    /// Parts that share no vertex.
    pub parts: usize,
    /// Edges with one face.
    pub boundary_edges: usize,
    /// Closed chains of boundary edges; two that touch at a vertex are two.
    pub boundary_loops: usize,
    /// Edges with three or more faces.
    pub non_manifold_edges: usize,
    /// Vertices whose faces make more than one fan.
    pub non_manifold_vertices: usize,
    /// Edges whose two faces run along them in the same direction.
    pub inconsistent_edges: usize,
    /// Whether the faces could be turned so that no edge is inconsistent.
    pub orientable: bool,
    /// V - E + F.
    pub euler: i64,
    /// Handles, summed over the parts, of the surface with its loops filled and its touching vertices parted;
    /// `None` where an edge is not manifold or the surface is one-sided.
    pub genus: Option<u64>,
}

impl Topology {
    /// Whether the surface has neither boundary nor edges with more than two faces.
    #[must_use]
    pub const fn is_closed(&self) -> bool {
        self.faces > 0 && self.boundary_edges == 0 && self.non_manifold_edges == 0
    }
}

/// Counts a mesh's connectivity. O(n log n) for n faces and vertices.
///
/// # Errors
/// [`crate::Error::IndexOutOfRange`] where a face names no vertex; cancel and time limit.
///
/// ```
/// use atlasfit::{Run, geometry::TriMesh, measure};
/// let corners = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
/// let tetrahedron = TriMesh::new(corners, vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]);
/// let t = Run::default().execute(|ctx| measure::topology(&tetrahedron, ctx))?;
/// assert!(t.is_closed() && t.orientable);
/// assert_eq!((t.parts, t.euler, t.genus), (1, 2, Some(0)));
/// # Ok::<(), atlasfit::Error>(())
/// ```
pub fn topology(mesh: &TriMesh, ctx: &Context<'_>) -> Result<Topology> {
    mesh.validate()?;
    memory::reserve(mesh, ctx)?;
    let triangles = welded(mesh, ctx)?;
    let (n, f) = (mesh.positions.len(), triangles.len());
    let mut named = vec![false; n];
    for (i, t) in mesh.triangles.iter().enumerate() {
        ctx.check_at(i)?;
        t.iter().for_each(|&v| named[v as usize] = true);
    }
    let mut joined = Joined::new(&triangles, ctx)?;
    ctx.check()?;

    let mut fans_at = vec![0u32; n];
    let mut fan_count = 0;
    for corner in 0..3 * f as u32 {
        ctx.check_at(corner as usize)?;
        if joined.fans.find(corner) == corner {
            fan_count += 1;
            fans_at[triangles[corner as usize / 3][corner as usize % 3] as usize] += 1;
        }
    }
    ctx.check()?;
    let mut parts = Sets::new(n);
    for (i, t) in triangles.iter().enumerate() {
        ctx.check_at(i)?;
        parts.join(t[0], t[1]);
        parts.join(t[0], t[2]);
    }
    ctx.check()?;

    let vertices = fans_at.iter().filter(|c| **c > 0).count();
    let boundary_loops = joined.boundary_loops(3 * f);
    ctx.check()?;
    let orientable = (0..f as u32).all(|i| joined.sides.find(2 * i) != joined.sides.find(2 * i + 1));
    let genus = if joined.non_manifold_edges == 0 && orientable {
        let patches = joined.patches.count(0..f as u32) as i64;
        let euler = fan_count - joined.edges as i64 + f as i64;
        u64::try_from((2 * patches - boundary_loops as i64 - euler) / 2).ok()
    } else {
        None
    };
    Ok(Topology {
        vertices,
        edges: joined.edges,
        faces: f,
        degenerate_faces: mesh.triangles.len() - f,
        unused_vertices: named.iter().filter(|u| !**u).count(),
        parts: parts.count(triangles.iter().map(|t| t[0])),
        boundary_edges: joined.boundary.len(),
        boundary_loops,
        non_manifold_edges: joined.non_manifold_edges,
        non_manifold_vertices: fans_at.iter().filter(|c| **c > 1).count(),
        inconsistent_edges: joined.inconsistent_edges,
        orientable,
        euler: vertices as i64 - joined.edges as i64 + f as i64,
        genus,
    })
}

/// The mesh's faces with vertices at one place joined; without those that name a place twice.
pub(super) fn welded(mesh: &TriMesh, ctx: &Context<'_>) -> Result<Vec<[u32; 3]>> {
    let mut finite = Aabb::EMPTY;
    for (i, p) in mesh.positions.iter().enumerate() {
        ctx.check_at(i)?;
        if p.iter().all(|x| x.is_finite()) {
            finite = finite.join(&Aabb { min: Vec3(*p), max: Vec3(*p) });
        }
    }
    let to = weld(vec3::of(&mesh.positions), WELD_SHARE * finite.longest_side(), ctx)?;
    let mut out = Vec::with_capacity(mesh.triangles.len());
    for (i, t) in mesh.triangles.iter().enumerate() {
        ctx.check_at(i)?;
        let [a, b, c] = t.map(|v| to[v as usize]);
        if a != b && b != c && c != a {
            out.push([a, b, c]);
        }
    }
    Ok(out)
}

/// What is joined through the edges of a mesh. A half-edge is `3 * face + corner`, at the corner where it
/// starts.
struct Joined {
    /// Corners of one vertex that are joined through edges make a fan.
    fans: Sets,
    /// Faces that are joined through edges make a patch.
    patches: Sets,
    /// Each face twice, once for each of its orientations: in a one-sided patch the two are joined.
    sides: Sets,
    /// Half-edges of the edges with one face.
    boundary: Vec<u32>,
    edges: usize,
    non_manifold_edges: usize,
    inconsistent_edges: usize,
}

impl Joined {
    fn new(triangles: &[[u32; 3]], ctx: &Context<'_>) -> Result<Self> {
        let f = triangles.len();
        let mut out = Self {
            fans: Sets::new(3 * f),
            patches: Sets::new(f),
            sides: Sets::new(2 * f),
            boundary: Vec::new(),
            edges: 0,
            non_manifold_edges: 0,
            inconsistent_edges: 0,
        };
        let start = |h: u32| triangles[h as usize / 3][h as usize % 3];
        for (i, edge) in Edges::new(triangles, ctx)?.iter().enumerate() {
            ctx.check_at(i)?;
            out.edges += 1;
            match edge {
                [one] => out.boundary.push(one.1),
                [_, _] => {}
                _ => out.non_manifold_edges += 1,
            }
            for pair in edge.windows(2) {
                let (h, g) = (pair[0].1, pair[1].1);
                out.join(h, g, start(h) == start(g), edge.len() == 2);
            }
        }
        Ok(out)
    }

    /// Joins what meets at an edge with the half-edges `h` and `g`. `same`: both run in one direction;
    /// `manifold`: the edge has no other half-edges.
    fn join(&mut self, h: u32, g: u32, same: bool, manifold: bool) {
        let (hf, gf) = (h / 3, g / 3);
        let (g_start, g_end) = if same { (g, next(g)) } else { (next(g), g) };
        self.fans.join(h, g_start);
        self.fans.join(next(h), g_end);
        self.patches.join(hf, gf);
        if manifold {
            self.inconsistent_edges += usize::from(same);
            let flip = u32::from(same);
            self.sides.join(2 * hf, 2 * gf + flip);
            self.sides.join(2 * hf + 1, 2 * gf + 1 - flip);
        }
    }

    /// Closed chains of boundary edges. Such an edge runs from fan to fan, and a fan with boundary has two
    /// such edges, so that the fans that they join are the chains. `corners` is the number of corners of all
    /// faces.
    fn boundary_loops(&mut self, corners: usize) -> usize {
        let mut chains = Sets::new(corners);
        for &h in &self.boundary {
            let (a, b) = (self.fans.find(h), self.fans.find(next(h)));
            chains.join(a, b);
        }
        let starts: Vec<u32> = self.boundary.iter().map(|&h| self.fans.find(h)).collect();
        chains.count(starts.into_iter())
    }
}

/// The next half-edge of the same face.
const fn next(h: u32) -> u32 {
    if h % 3 == 2 { h - 2 } else { h + 1 }
}

#[cfg(test)]
mod tests {
    use super::super::shapes::{moebius, sheet, sphere, torus};
    use super::*;
    use crate::run::Run;
    use proptest::prelude::*;

    fn of(mesh: &TriMesh) -> Topology {
        Run::default().execute(|ctx| topology(mesh, ctx)).unwrap()
    }

    fn joined(a: &TriMesh, b: &TriMesh) -> TriMesh {
        let n = a.positions.len() as u32;
        let mut out = a.clone();
        out.positions.extend(&b.positions);
        out.triangles.extend(b.triangles.iter().map(|t| t.map(|v| v + n)));
        out
    }

    #[test]
    fn known_surfaces_have_their_known_counts() {
        let t = of(&sphere(1.0, 8));
        assert_eq!((t.parts, t.euler, t.genus, t.is_closed(), t.orientable), (1, 2, Some(0), true, true));
        let t = of(&torus(12, 7));
        assert_eq!((t.parts, t.euler, t.genus, t.is_closed()), (1, 0, Some(1), true));
        let t = of(&sheet(1.0, 4));
        assert_eq!((t.boundary_edges, t.boundary_loops, t.euler, t.genus), (16, 1, 1, Some(0)));
        let t = of(&moebius(9));
        assert_eq!((t.boundary_loops, t.euler, t.genus, t.orientable), (1, 0, None, false));
        assert_eq!(t.non_manifold_edges, 0);
        let two = joined(&torus(12, 7), &sphere(9.0, 8));
        let t = of(&two);
        assert_eq!((t.parts, t.euler, t.genus), (2, 2, Some(1)));
        assert_eq!(
            of(&TriMesh::default()),
            Topology { orientable: true, genus: Some(0), ..Topology::default() }
        );
    }

    #[test]
    fn defects_are_counted() {
        // Three faces on one edge.
        let fin = TriMesh::new(
            vec![[0.0; 3], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [-1.0, 1.0, 0.0], [-1.0, -1.0, 0.0]],
            vec![[0, 1, 2], [0, 1, 3], [1, 0, 4]],
        );
        let t = of(&fin);
        assert_eq!((t.non_manifold_edges, t.boundary_edges, t.genus), (1, 6, None));
        // Two triangles that touch at a vertex: two loops, one vertex with two fans.
        let bow = TriMesh::new(
            vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [-1.0, -1.0, 0.0]],
            vec![[0, 1, 2], [0, 3, 4]],
        );
        let t = of(&bow);
        assert_eq!((t.parts, t.non_manifold_vertices, t.boundary_loops, t.genus), (1, 1, 2, Some(0)));
        // A turned face.
        let mut turned = sheet(1.0, 2);
        turned.triangles[0].swap(1, 2);
        let t = of(&turned);
        assert!(t.inconsistent_edges > 0 && t.orientable);
        // Faces that name one place twice, vertices that nothing uses.
        let bad = TriMesh::new(
            vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0; 3], [9.0; 3]],
            vec![[0, 1, 2], [0, 1, 1], [0, 3, 1]],
        );
        let t = of(&bad);
        assert_eq!((t.faces, t.degenerate_faces, t.unused_vertices, t.vertices), (1, 2, 1, 3));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]
        #[test]
        fn counts_survive_splitting_vertices_and_moving_far_away(which in 0usize..4, far in -1e6f64..1e6) {
            let mesh = [sphere(1.0, 6), torus(8, 5), sheet(1.0, 3), moebius(7)][which].clone();
            let soup = TriMesh::new(
                (mesh.triangles.iter().flatten())
                    .map(|&v| mesh.positions[v as usize].map(|x| x + far))
                    .collect(),
                (0..mesh.triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
            );
            prop_assert_eq!(of(&soup), of(&mesh));
        }
    }
}
