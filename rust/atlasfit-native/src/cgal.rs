//! CGAL: watertight shells, isotropic remeshing, self-intersections, exact distances.
//!
//! In: meshes of the core. Out: meshes, pairs of triangles, distances. Input is checked here first; C++
//! exceptions are errors. A call stops within about 100 ms of being asked, but for the tree that wrapping
//! builds over the triangles and what it cleans up at its end: about a second per million triangles each.
//!
//! Unsafe code is cxx's bridge, whose signatures are checked against cgal.hpp.
#![allow(unsafe_code)]

use crate::checks::{checked, checked_surface, refused};
use crate::interface::Cgal;
use atlasfit::geometry::TriMesh;
use atlasfit::{Context, Error, Result, Vec3};

/// The run that a call belongs to, as C++ sees it.
pub struct Stop<'a>(&'a (dyn Fn() -> bool + 'a));

impl Stop<'_> {
    /// Whether to stop. It is called from C++: nothing may unwind into it.
    fn asked(&self) -> bool {
        std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| (self.0)())).unwrap_or(true)
    }
}

#[cxx::bridge(namespace = "atlasfit_native")]
mod bridge {
    extern "Rust" {
        type Stop<'a>;
        fn asked(&self) -> bool;
    }
    unsafe extern "C++" {
        include!("atlasfit-native/src/cgal.hpp");
        fn alpha_wrap(
            xyz: &[f64],
            triangles: &[u32],
            alpha: f64,
            offset: f64,
            stop: &Stop,
            shell_xyz: &mut Vec<f64>,
            shell_triangles: &mut Vec<u32>,
        ) -> Result<()>;
        fn self_intersections(
            xyz: &[f64],
            triangles: &[u32],
            stop: &Stop,
            pairs: &mut Vec<u32>,
        ) -> Result<()>;
        fn exact_distances(
            xyz: &[f64],
            triangles: &[u32],
            points: &[f64],
            stop: &Stop,
            distances: &mut Vec<f64>,
        ) -> Result<()>;
        fn remesh(
            xyz: &[f64],
            triangles: &[u32],
            length: f64,
            iterations: u32,
            stop: &Stop,
            new_xyz: &mut Vec<f64>,
            new_triangles: &mut Vec<u32>,
        ) -> Result<bool>;
    }
}

/// CGAL, built in.
pub(crate) struct Library;

impl Cgal for Library {
    fn alpha_wrap(&self, surface: &TriMesh, alpha: f64, offset: f64, ctx: &Context<'_>) -> Result<TriMesh> {
        alpha_wrap(surface, alpha, offset, ctx)
    }
    fn self_intersections(&self, mesh: &TriMesh, ctx: &Context<'_>) -> Result<Vec<[u32; 2]>> {
        self_intersections(mesh, ctx)
    }
    fn exact_distances(&self, mesh: &TriMesh, points: &[[f64; 3]], ctx: &Context<'_>) -> Result<Vec<f64>> {
        exact_distances(mesh, points, ctx)
    }
    fn remesh(&self, mesh: &TriMesh, length: f64, iterations: u32, ctx: &Context<'_>) -> Result<TriMesh> {
        remesh(mesh, length, iterations, ctx)
    }
}

/// Calls C++ with what asks whether to stop.
fn call<T>(
    ctx: &Context<'_>,
    work: impl FnOnce(&Stop<'_>, &mut T) -> std::result::Result<(), cxx::Exception>,
) -> Result<T>
where
    T: Default,
{
    let asked = || ctx.check().is_err();
    let mut out = T::default();
    let done = work(&Stop(&asked), &mut out);
    // Whoever asked says why.
    ctx.check()?;
    done.map_err(|e| Error::internal(format!("CGAL: {}", e.what())))?;
    Ok(out)
}

/// Bytes of remeshing for a triangle of the mesh, and of the result. Source: chosen, far above the 260 for
/// either that `cargo run -p atlasfit-native --features cgal,openmesh --example bounds -- 100` measured.
const REMESH_BYTES: [u64; 2] = [1500, 1000];

fn remesh(mesh: &TriMesh, length: f64, iterations: u32, ctx: &Context<'_>) -> Result<TriMesh> {
    checked_surface(mesh, ctx)?;
    if !(length > 0.0 && length.is_finite()) {
        return Err(Error::invalid(format!("the length is {length}"), "Give a positive length"));
    }
    // Equal sides of that length cover the area; some more lie between.
    let area: f64 = mesh.triangles.iter().map(|t| area(mesh, t)).sum();
    let expected = (1.5 * area / (0.25 * 3f64.sqrt() * length * length)).min(1e15) as u64;
    let given = mesh.triangles.len() as u64;
    let bytes =
        given.saturating_mul(REMESH_BYTES[0]).saturating_add(expected.saturating_mul(REMESH_BYTES[1]));
    ctx.reserve(bytes, "Raise the limit, or give a larger length")?;
    let (is_surface, xyz, triangles) = call(ctx, |stop, (is_surface, xyz, triangles)| {
        let (at, faces) = (mesh.positions.as_flattened(), mesh.triangles.as_flattened());
        *is_surface = bridge::remesh(at, faces, length, iterations, stop, xyz, triangles)?;
        Ok(())
    })?;
    let (is_surface, xyz, triangles): (bool, Vec<f64>, Vec<u32>) = (is_surface, xyz, triangles);
    if !is_surface {
        return Err(refused("CGAL"));
    }
    Ok(TriMesh::new(xyz.as_chunks().0.to_vec(), triangles.as_chunks().0.to_vec()))
}

fn area(mesh: &TriMesh, t: &[u32; 3]) -> f64 {
    let [a, b, c] = t.map(|v| Vec3(mesh.positions[v as usize]));
    0.5 * (b - a).cross(c - a).norm()
}

fn alpha_wrap(surface: &TriMesh, alpha: f64, offset: f64, ctx: &Context<'_>) -> Result<TriMesh> {
    checked(surface)?;
    for (name, length) in [("alpha", alpha), ("offset", offset)] {
        if !(length > 0.0 && length.is_finite()) {
            return Err(Error::invalid(format!("{name} is {length}"), "Give a positive length"));
        }
    }
    if surface.triangles.is_empty() {
        return Err(Error::degenerate("there is no triangle to wrap", "Give a mesh with faces"));
    }
    let (xyz, triangles): (Vec<f64>, Vec<u32>) = call(ctx, |stop, (xyz, triangles)| {
        let (at, faces) = (surface.positions.as_flattened(), surface.triangles.as_flattened());
        bridge::alpha_wrap(at, faces, alpha, offset, stop, xyz, triangles)
    })?;
    Ok(TriMesh::new(xyz.as_chunks().0.to_vec(), triangles.as_chunks().0.to_vec()))
}

fn self_intersections(mesh: &TriMesh, ctx: &Context<'_>) -> Result<Vec<[u32; 2]>> {
    checked(mesh)?;
    let pairs: Vec<u32> = call(ctx, |stop, pairs| {
        let (at, faces) = (mesh.positions.as_flattened(), mesh.triangles.as_flattened());
        bridge::self_intersections(at, faces, stop, pairs)
    })?;
    Ok(pairs.as_chunks().0.to_vec())
}

fn exact_distances(mesh: &TriMesh, points: &[[f64; 3]], ctx: &Context<'_>) -> Result<Vec<f64>> {
    checked(mesh)?;
    if let Some(p) = points.iter().position(|p| !p.iter().all(|x| x.is_finite())) {
        return Err(Error::invalid(format!("point {p} is not finite"), "Leave it out"));
    }
    if mesh.triangles.is_empty() {
        return Err(Error::degenerate("there is no triangle to measure to", "Give a mesh with faces"));
    }
    call(ctx, |stop, distances| {
        let (at, faces) = (mesh.positions.as_flattened(), mesh.triangles.as_flattened());
        bridge::exact_distances(at, faces, points.as_flattened(), stop, distances)
    })
}
