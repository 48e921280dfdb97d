//! Decimation to a tenth of the faces, beside meshoptimizer's (crate meshopt).
//!
//!     cargo run --release --manifest-path tests/peers/simplify/Cargo.toml -- MESH...
//!
//! For each mesh: root mean square distance of the decimated mesh from the mesh and back, the larger of both,
//! and the largest distance of all samples, in thousandths of the mesh's extent; UV triangles that turned
//! over; seconds. UVs are the mesh's own, or those of `unwrap`. meshoptimizer gets the mesh without UVs
//! (`bare`), and cut along the seams with the UVs as attributes (`uv`), as its users do.

use anyhow::{Context as _, Result};
use atlasfit::geometry::TriMesh;
use atlasfit::measure::{self, DistanceOptions};
use atlasfit::simplify::{SimplifyOptions, simplify_mesh};
use atlasfit::unwrap::{UnwrapOptions, unwrap};
use atlasfit::{Run, spatial::weld::weld};
use atlasfit_io::{LoadOptions, load};
use std::collections::HashMap;
use std::time::Instant;

fn run<T: Send>(job: impl FnOnce(&atlasfit::Context<'_>) -> atlasfit::Result<T> + Send) -> Result<T> {
    Ok(Run::default().execute(job)?)
}

/// The mesh with one vertex per place, and UVs.
fn read(path: &str) -> Result<TriMesh> {
    let loaded = load(path.as_ref(), &LoadOptions::default())?.into_mesh();
    let first = run(|ctx| weld(atlasfit::numeric::vec3::of(&loaded.positions), 0.0, ctx))?;
    let mut number = HashMap::new();
    let mut positions = Vec::new();
    let triangles: Vec<[u32; 3]> = (loaded.triangles.iter())
        .map(|t| {
            t.map(|v| {
                *number.entry(first[v as usize]).or_insert_with(|| {
                    positions.push(loaded.positions[v as usize]);
                    positions.len() as u32 - 1
                })
            })
        })
        .collect();
    let mut mesh = TriMesh { corner_uv: loaded.corner_uv, ..TriMesh::new(positions, triangles) };
    if mesh.corner_uv.is_none() {
        mesh.corner_uv = Some(run(|ctx| unwrap(&mesh, &UnwrapOptions::default(), ctx))?.corner_uv);
    }
    Ok(mesh)
}

/// One row of the table.
fn row(name: &str, mesh: &TriMesh, light: &TriMesh, seconds: f64) -> Result<f64> {
    let options = DistanceOptions::default();
    let d = run(|ctx| measure::surface(light, mesh, &options, ctx))?;
    let flips = match light.corner_uv {
        Some(_) => run(|ctx| measure::uv::uv(light, ctx))?.flips.to_string(),
        None => "-".into(),
    };
    let extent = (0..3)
        .map(|k| {
            let of = mesh.positions.iter().map(|p| p[k]);
            of.clone().fold(f64::NEG_INFINITY, f64::max) - of.fold(f64::INFINITY, f64::min)
        })
        .fold(0.0, f64::max);
    let rms = d.accuracy.rms.max(d.completeness.rms) / extent * 1e3;
    let max = d.accuracy.max.max(d.completeness.max) / extent * 1e3;
    println!(
        "  {name:<18} {:>8} faces   rms {rms:.4}   max {max:.3}   flips {flips:>4}   {seconds:.2} s",
        light.triangles.len()
    );
    Ok(rms)
}

/// meshoptimizer on the places alone.
fn peer_bare(mesh: &TriMesh, faces: usize) -> TriMesh {
    let indices: Vec<u32> = mesh.triangles.as_flattened().to_vec();
    let at: Vec<[f32; 3]> = mesh.positions.iter().map(|p| p.map(|x| x as f32)).collect();
    let left = meshopt::simplify_decoder(
        &indices,
        &at,
        3 * faces,
        1.0,
        meshopt::SimplifyOptions::None,
        None,
    );
    TriMesh::new(mesh.positions.clone(), left.as_chunks().0.to_vec())
}

/// meshoptimizer with a vertex for each place and UV, and the UVs as attributes.
fn peer_uv(mesh: &TriMesh, faces: usize) -> Result<TriMesh> {
    let uv = mesh.corner_uv.as_ref().context("the mesh has UVs")?;
    let mut number = HashMap::new();
    let (mut at, mut attributes, mut place) = (Vec::<[f32; 3]>::new(), Vec::<f32>::new(), Vec::new());
    let mut indices = Vec::new();
    for (t, uvs) in mesh.triangles.iter().zip(uv) {
        for (&v, uv) in t.iter().zip(uvs) {
            indices.push(*number.entry((v, uv.map(f32::to_bits))).or_insert_with(|| {
                at.push(mesh.positions[v as usize].map(|x| x as f32));
                attributes.extend(uv);
                place.push(v);
                at.len() as u32 - 1
            }));
        }
    }
    let bytes = unsafe { std::slice::from_raw_parts(at.as_ptr().cast::<u8>(), 12 * at.len()) };
    let adapter = meshopt::VertexDataAdapter::new(bytes, 12, 0)?;
    let lock = vec![false; at.len()];
    let left = meshopt::simplify_with_attributes_and_locks(
        &indices,
        &adapter,
        &attributes,
        &[1.0, 1.0],
        8,
        &lock,
        3 * faces,
        1.0,
        meshopt::SimplifyOptions::None,
        None,
    );
    let triangles: Vec<[u32; 3]> = left.as_chunks().0.to_vec();
    let corner = |v: u32| [attributes[2 * v as usize], attributes[2 * v as usize + 1]];
    Ok(TriMesh {
        corner_uv: Some(triangles.iter().map(|t| t.map(corner)).collect()),
        ..TriMesh::new(
            mesh.positions.clone(),
            triangles.iter().map(|t| t.map(|v| place[v as usize])).collect(),
        )
    })
}

fn main() -> Result<()> {
    for path in std::env::args().skip(1) {
        let mesh = read(&path)?;
        let faces = mesh.triangles.len() / 10;
        println!("{path}: {} faces", mesh.triangles.len());
        let bare = TriMesh { corner_uv: None, ..mesh.clone() };
        let options = SimplifyOptions::default().with_faces(Some(faces));
        let timed = |mesh: &TriMesh| -> Result<(TriMesh, f64)> {
            let start = Instant::now();
            let light = run(|ctx| simplify_mesh(mesh, &options, ctx))?.mesh;
            Ok((light, start.elapsed().as_secs_f64()))
        };
        let (light, seconds) = timed(&mesh)?;
        let own = row("atlasfit, uv", &mesh, &light, seconds)?;
        let (light, seconds) = timed(&bare)?;
        row("atlasfit, bare", &mesh, &light, seconds)?;
        let start = Instant::now();
        let peer = peer_uv(&mesh, faces)?;
        let with_uv = row("meshopt, uv", &mesh, &peer, start.elapsed().as_secs_f64())?;
        let start = Instant::now();
        let peer = peer_bare(&mesh, faces);
        let without = row("meshopt, bare", &mesh, &peer, start.elapsed().as_secs_f64())?;
        println!("  ratio to meshopt: {:.2} (uv), {:.2} (bare)", own / with_uv, own / without);
    }
    Ok(())
}
