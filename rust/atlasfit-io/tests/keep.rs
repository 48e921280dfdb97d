//! glTF files whose UVs are replaced while all else stays: what comes back, and what damaged files give.

mod common;

use atlasfit::geometry::TriMesh;
use atlasfit_io::{Asset, Error, Format, LoadOptions, SaveMesh, load, load_asset};
use common::{Folder, cube, saved_mesh};
use std::path::Path;

/// Reads a file, and gives its mesh other UVs: every triangle its own.
fn opened(path: &Path, options: &LoadOptions) -> Result<(TriMesh, Option<Asset>), Error> {
    let (loaded, asset) = load_asset(path, Format::Gltf, options)?;
    let mut mesh = loaded.into_mesh();
    let uv = |t: usize| [0.0, 0.5, 0.75].map(|c| [c, t as f32 / 64.0]);
    mesh.corner_uv = Some((0..mesh.triangles.len()).map(uv).collect());
    Ok((mesh, asset))
}

#[test]
fn a_glb_comes_back_with_its_new_uvs() {
    let folder = Folder::new();
    let (before, after) = (folder.join("a.glb"), folder.join("b.gltf"));
    std::fs::write(&before, saved_mesh("a.glb", &cube(), &SaveMesh::default())).unwrap();
    let (mesh, asset) = opened(&before, &LoadOptions::default()).unwrap();
    let saved = asset.unwrap().save(&after, &mesh, &[], &SaveMesh::default()).unwrap();
    assert_eq!(saved.files, [after.clone(), folder.join("b.bin")]);
    assert!(saved.lost.is_empty(), "{:?}", saved.lost);
    let back = load(&after, &LoadOptions::default()).unwrap().into_mesh();
    assert_eq!((&back.positions, &back.triangles), (&mesh.positions, &mesh.triangles));
    assert_eq!((&back.normals, &back.colors), (&mesh.normals, &mesh.colors));
    assert_eq!(back.attributes, mesh.attributes);
    assert_eq!(back.corner_uv, mesh.corner_uv);
}

#[test]
fn only_a_gltf_output_keeps_a_gltf_file() {
    let folder = Folder::new();
    let path = folder.join("a.glb");
    std::fs::write(&path, saved_mesh("a.glb", &cube(), &SaveMesh::default())).unwrap();
    for format in [Format::Ply, Format::Obj] {
        assert!(load_asset(&path, format, &LoadOptions::default()).unwrap().1.is_none());
    }
}

#[test]
fn damaged_files_give_an_error_or_can_be_written() {
    let folder = Folder::new();
    let (path, output) = (folder.join("a.glb"), folder.join("b.glb"));
    let whole = saved_mesh("a.glb", &cube(), &SaveMesh::default());
    let options = LoadOptions::default().with_max_memory_bytes(Some(64 << 20));
    let mut random = 1u64;
    let mut next = |n: usize| {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (random >> 33) as usize % n
    };
    let mut written = 0;
    for round in 0..1500 {
        let mut data = whole.clone();
        for _ in 0..=next(3) {
            let at = next(data.len());
            // Digits for digits: the JSON stays JSON, its numbers do not.
            data[at] = if data[at].is_ascii_digit() { b'0' + next(10) as u8 } else { next(256) as u8 };
        }
        if round % 5 == 0 {
            data.truncate(next(whole.len()));
        }
        std::fs::write(&path, &data).unwrap();
        let Ok((mesh, Some(asset))) = opened(&path, &options) else { continue };
        if asset.save(&output, &mesh, &[], &SaveMesh::default()).is_ok() {
            load(&output, &options).unwrap();
            written += 1;
        }
    }
    assert!(written > 100, "{written}");
}

#[test]
fn columns_that_share_their_bytes_do_not_fill_the_memory() {
    let folder = Folder::new();
    let (n, columns) = (30_000, 4000);
    std::fs::write(folder.join("a.bin"), vec![0; 12 * n]).unwrap();
    let accessor = format!("{{\"bufferView\":0,\"componentType\":5126,\"count\":{n},\"type\":\"VEC3\"}}");
    let accessors = vec![accessor; columns].join(",");
    let names: String = (1..columns).map(|i| format!(",\"TEXCOORD_{i}\":{i}")).collect();
    let json = format!(
        "{{\"asset\":{{\"version\":\"2.0\"}},\"meshes\":[{{\"primitives\":[{{\"attributes\":{{\"POSITION\":0\
         {names}}}}}]}}],\"accessors\":[{accessors}],\"bufferViews\":[{{\"buffer\":0,\"byteLength\":{}}}],\
         \"buffers\":[{{\"uri\":\"a.bin\",\"byteLength\":{}}}]}}",
        12 * n,
        12 * n
    );
    let path = folder.join("a.gltf");
    std::fs::write(&path, json).unwrap();
    let options = LoadOptions::default().with_max_memory_bytes(Some(256 << 20));
    assert!(load(&path, &options).is_ok(), "read as one mesh it is small");
    let found = opened(&path, &options).map(|_| ());
    assert!(matches!(found, Err(Error::OutOfMemory { .. })), "{found:?}");
}
