//! What a mesh must be before C++ sees it.
//!
//! In: a mesh. Out: nothing, or what is wrong with it.

use atlasfit::geometry::TriMesh;
use atlasfit::{Context, Error, Result};

/// Fails unless all coordinates are finite and all indices are vertices: CGAL takes both without a word.
pub(crate) fn checked(mesh: &TriMesh) -> Result<()> {
    mesh.validate()?;
    match mesh.positions.iter().position(|p| !p.iter().all(|x| x.is_finite())) {
        Some(v) => {
            Err(Error::invalid(format!("vertex {v} is not finite"), "Leave out what is not finite first"))
        }
        None => Ok(()),
    }
}

/// Fails unless halfedges can hold the mesh: each edge has one triangle on each side at the most, each vertex
/// one fan. OpenMesh prints where it cannot.
pub(crate) fn checked_surface(mesh: &TriMesh, ctx: &Context<'_>) -> Result<()> {
    checked(mesh)?;
    if mesh.triangles.is_empty() {
        return Err(Error::degenerate("there is no triangle", "Give a mesh with faces"));
    }
    // At each corner its vertex, and from which neighbour to which its triangle turns.
    let mut corners = Vec::with_capacity(3 * mesh.triangles.len());
    for (f, t) in mesh.triangles.iter().enumerate() {
        ctx.check_at(f)?;
        for k in 0..3 {
            let [v, from, to] = [t[k], t[(k + 1) % 3], t[(k + 2) % 3]];
            if v == from {
                return Err(no_surface(format!("triangle {f} names vertex {v} twice")));
            }
            corners.push((v, from, to));
        }
    }
    corners.sort_unstable();
    ctx.check()?;
    for (i, fan) in corners.chunk_by(|a, b| a.0 == b.0).enumerate() {
        ctx.check_at(i)?;
        let v = fan[0].0;
        if let Some(w) = fan.windows(2).find(|w| w[0].1 == w[1].1) {
            let what = format!("the edge of vertices {v} and {} has two triangles on one side", w[0].1);
            return Err(no_surface(what));
        }
        if turns(fan) < fan.len() {
            return Err(no_surface(format!("vertex {v} holds two sheets together")));
        }
    }
    Ok(())
}

/// How many corners of a vertex follow on each other, from the boundary on if there is one.
fn turns(fan: &[(u32, u32, u32)]) -> usize {
    let at = |from: u32| fan.binary_search_by_key(&from, |c| c.1).ok();
    let mut entered = vec![false; fan.len()];
    fan.iter().filter_map(|c| at(c.2)).for_each(|k| entered[k] = true);
    let first = entered.iter().position(|e| !e).unwrap_or(0);
    let (mut k, mut count) = (first, 1);
    while let Some(next) = at(fan[k].2).filter(|&next| next != first && count < fan.len()) {
        (k, count) = (next, count + 1);
    }
    count
}

/// The error of a mesh that halfedges cannot hold.
fn no_surface(what: String) -> Error {
    Error::invalid(format!("the mesh is no surface: {what}"), "Weld, orient and clean the mesh first")
}

/// The error of a mesh that passed all checks and that the library does not take all the same.
pub(crate) fn refused(library: &str) -> Error {
    Error::internal(format!("{library} does not take the mesh as a surface"))
}
