//! Which half-edges are the two sides of one edge.
//!
//! In: a mesh, and where its triangles must not hang together. Out: the twin of each half-edge, one at most.
//! Triangles that share no vertices, but places, hang together too.

use super::constants::SURFACE;
use crate::error::Result;
use crate::geometry::TriMesh;
use crate::numeric::sort::sort;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::edges::Edges;
use crate::spatial::weld::weld;
use crate::unwrap::options::UnwrapOptions;
use rustc_hash::FxHashSet;

/// No half-edge, no chart, no face.
pub(crate) const NONE: u32 = u32::MAX;

/// The half-edges in pairs.
pub(crate) struct Twins {
    /// The triangles, vertices of open edges at one place made one.
    pub tri: Vec<[u32; 3]>,
    /// Twin (`3 * face + slot`) of the edge from corner `slot` of a face to the next; [`NONE`] at borders.
    pub twin: Vec<[u32; 3]>,
    /// Edges cut because more than two faces, or two of clashing orientation, meet there.
    pub non_manifold: usize,
    /// Faces that repeat the three vertices of an earlier one.
    pub duplicate: usize,
    /// Vertices that are taken for another one at the same place.
    pub welded: usize,
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

/// Pairs the half-edges of usable faces: first those between the same vertices, then at places where the mesh
/// is open those between the same positions.
pub(crate) fn pair_edges(
    mesh: &TriMesh,
    usable: &[bool],
    options: &UnwrapOptions,
    ctx: &Context<'_>,
) -> Result<Twins> {
    let given = &mesh.triangles;
    let mut out = Twins {
        tri: given.clone(),
        twin: ctx.filled([NONE; 3], given.len())?,
        non_manifold: 0,
        duplicate: 0,
        welded: 0,
    };
    let seams: FxHashSet<[u32; 2]> =
        options.seam_edges.iter().flatten().map(|e| [e[0].min(e[1]), e[0].max(e[1])]).collect();
    let seam = |h: u32| {
        let (t, k) = (given[h as usize / 3], h as usize % 3);
        let (a, b) = (t[k], t[(k + 1) % 3]);
        seams.contains(&[a.min(b), a.max(b)])
    };
    let group = |h: u32| options.face_group.as_ref().map(|c| c[h as usize / 3]);
    let may_join = |g: u32, h: u32| group(g) == group(h) && !seam(g) && !seam(h);
    out.pair(usable, &may_join, ctx)?;
    out.welded = weld_open(&mut out.tri, &out.twin, usable, &mesh.positions, ctx)?;
    if out.welded > 0 {
        out.pair(usable, &may_join, ctx)?;
    }
    Ok(out)
}

impl Twins {
    /// Pairs the half-edges that have no twin yet, where `may_join` allows it.
    fn pair(
        &mut self,
        usable: &[bool],
        may_join: &impl Fn(u32, u32) -> bool,
        ctx: &Context<'_>,
    ) -> Result<()> {
        let Self { tri, twin, .. } = self;
        let edges = Edges::new(tri, ctx)?;
        // A duplicate face lives on a layer of its own, so that sheets of duplicates stay connected.
        let layer = copies(tri, usable, &edges, ctx)?;
        let mut non_manifold = 0;
        // The half-edges of one edge: layer, whether it runs from the lesser vertex, half-edge.
        let mut sides: Vec<(u32, bool, u32)> = Vec::new();
        for (i, edge) in edges.iter().enumerate() {
            ctx.check_at(i)?;
            let low = edge[0].low();
            sides.clear();
            let own = edge.iter().filter(|h| usable[h.face()] && twin[h.face()][h.side()] == NONE);
            sides.extend(own.map(|h| (layer[h.face()], h.start(tri) == low, h.1)));
            sides.sort_unstable();
            for sides in sides.chunk_by(|a, b| a.0 == b.0) {
                match *sides {
                    [(_, a, g), (_, b, h)] if a != b => {
                        if may_join(g, h) {
                            twin[g as usize / 3][g as usize % 3] = h;
                            twin[h as usize / 3][h as usize % 3] = g;
                        }
                    }
                    [_] => {}
                    _ => non_manifold += 1,
                }
            }
        }
        self.non_manifold = non_manifold;
        self.duplicate = layer.iter().filter(|&&l| l > 0).count();
        Ok(())
    }
}

/// Gives vertices at open edges that lie at one place the number of the first of them; returns how many have
/// another number then. No face that takes part gets one vertex twice.
fn weld_open(
    tri: &mut [[u32; 3]],
    twin: &[[u32; 3]],
    usable: &[bool],
    positions: &[[f64; 3]],
    ctx: &Context<'_>,
) -> Result<usize> {
    let mut open: Vec<u32> = Vec::new();
    for (f, (t, twin)) in tri.iter().zip(twin).enumerate().filter(|(f, _)| usable[*f]) {
        ctx.check_at(f)?;
        let free = (0..3).filter(|&k| twin[k] == NONE);
        open.extend(free.flat_map(|k| [t[k], t[(k + 1) % 3]]));
    }
    sort(&mut open, ctx)?;
    open.dedup();
    let at: Vec<Vec3> = open.iter().map(|&v| Vec3(positions[v as usize])).collect();
    let first = weld(&at, 0.0, ctx)?;
    let mut to: Vec<u32> = (0..positions.len() as u32).collect();
    for (i, (&v, &j)) in open.iter().zip(&first).enumerate() {
        ctx.check_at(i)?;
        to[v as usize] = open[j as usize];
    }
    // A face that would become a line keeps its corners.
    for (f, t) in tri.iter().enumerate().filter(|(f, _)| usable[*f]) {
        ctx.check_at(f)?;
        let [a, b, c] = t.map(|v| to[v as usize]);
        if a == b || b == c || c == a {
            t.iter().for_each(|&v| to[v as usize] = v);
        }
    }
    let welded = to.iter().enumerate().filter(|(v, to)| *v as u32 != **to).count();
    for (f, t) in tri.iter_mut().enumerate().filter(|_| welded > 0) {
        ctx.check_at(f)?;
        *t = t.map(|v| to[v as usize]);
    }
    Ok(welded)
}
