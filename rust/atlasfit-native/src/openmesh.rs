//! OpenMesh: Loop and sqrt(3) subdivision.
//!
//! In: meshes of the core. Out: meshes with more triangles. Input is checked here first; C++ exceptions are
//! errors. OpenMesh cannot be asked to stop within a step, so that each step is a call.
//!
//! Unsafe code is cxx's bridge, whose signatures are checked against openmesh.hpp.
#![allow(unsafe_code)]

use crate::checks::{checked_surface, refused};
use crate::interface::{OpenMesh, Subdivision};
use atlasfit::geometry::TriMesh;
use atlasfit::{Context, Error, Result};

#[cxx::bridge(namespace = "atlasfit_native")]
mod bridge {
    unsafe extern "C++" {
        include!("atlasfit-native/src/openmesh.hpp");
        type Subdivider;
        fn subdivider(xyz: &[f64], triangles: &[u32], sqrt3: bool) -> Result<UniquePtr<Subdivider>>;
        fn step(self: Pin<&mut Subdivider>) -> Result<()>;
        fn copy(&self, xyz: &mut Vec<f64>, triangles: &mut Vec<u32>) -> Result<()>;
    }
}

/// Bytes for a triangle of the result. Source: `cargo run -p atlasfit-native --features cgal,openmesh
/// --example bounds -- 100` measured 135 and 195; more, as vectors double when they grow.
const BYTES: u64 = 500;
/// Triangles that fit the library's indices.
const MOST: u64 = (u32::MAX / 3) as u64;

/// OpenMesh, built in.
pub(crate) struct Library;

impl OpenMesh for Library {
    fn subdivide(&self, mesh: &TriMesh, how: Subdivision, times: u32, ctx: &Context<'_>) -> Result<TriMesh> {
        checked_surface(mesh, ctx)?;
        let each = if how == Subdivision::Loop { 4u64 } else { 3 };
        let after = each.saturating_pow(times).saturating_mul(mesh.triangles.len() as u64);
        if after > MOST {
            let what = format!("{times} steps make {after} triangles of {}", mesh.triangles.len());
            return Err(Error::invalid(what, format!("Make at most {MOST}")));
        }
        ctx.reserve(after.saturating_mul(BYTES), "Raise the limit, or subdivide less often")?;
        let (at, faces) = (mesh.positions.as_flattened(), mesh.triangles.as_flattened());
        let mut work = bridge::subdivider(at, faces, how == Subdivision::Sqrt3).map_err(failed)?;
        if work.is_null() {
            return Err(refused("OpenMesh"));
        }
        for _ in 0..times {
            ctx.check()?;
            work.pin_mut().step().map_err(failed)?;
        }
        ctx.check()?;
        let (mut xyz, mut triangles) = (Vec::new(), Vec::new());
        work.copy(&mut xyz, &mut triangles).map_err(failed)?;
        Ok(TriMesh::new(xyz.as_chunks().0.to_vec(), triangles.as_chunks().0.to_vec()))
    }
}

fn failed(e: cxx::Exception) -> Error {
    Error::internal(format!("OpenMesh: {}", e.what()))
}
