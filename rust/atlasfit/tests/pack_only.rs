//! Claims about UVs that are only packed: charts keep their shapes, and lie on one page without overlaps.

use atlasfit::geometry::TriMesh;
use atlasfit::measure::uv::{UvQuality, face_stretch, uv};
use atlasfit::unwrap::{UnwrapOptions, unwrap};
use atlasfit::{Error, Result, Run};

/// So many flat sheets of 2 x n x n triangles apart from each other, each with UVs over all of the page.
fn sheets(sizes: &[f64], n: u32) -> TriMesh {
    let mut mesh = TriMesh::default();
    let mut uvs = Vec::new();
    for (i, size) in sizes.iter().enumerate() {
        let first = mesh.positions.len() as u32;
        let at = |k: u32| [f64::from(k % (n + 1)) / f64::from(n), f64::from(k / (n + 1)) / f64::from(n)];
        mesh.positions.extend((0..(n + 1).pow(2)).map(|k| [size * at(k)[0], size * at(k)[1], i as f64]));
        for k in 0..n * n {
            let a = k / n * (n + 1) + k % n;
            for t in [[a, a + 1, a + n + 2], [a, a + n + 2, a + n + 1]] {
                mesh.triangles.push(t.map(|v| first + v));
                // Every second sheet is mirrored, and twice as wide as high.
                let side = if i % 2 == 0 { 1.0 } else { -2.0 };
                uvs.push(t.map(|v| [side as f32 * at(v)[0] as f32, at(v)[1] as f32]));
            }
        }
    }
    mesh.corner_uv = Some(uvs);
    mesh
}

fn quality(mesh: &TriMesh) -> Result<UvQuality> {
    Run::default().execute(|ctx| uv(mesh, ctx))
}

#[test]
fn charts_keep_their_shapes_and_get_one_density() -> Result<()> {
    let mut mesh = sheets(&[1.0, 2.0, 0.5, 1.0], 6);
    let before = quality(&mesh)?;
    assert!(before.overlapping_faces > 0, "all sheets lie over each other");
    let options = UnwrapOptions::default().with_keep_uvs(true);
    let layout = Run::default().execute(|ctx| unwrap(&mesh, &options, ctx))?;
    assert_eq!((layout.charts, layout.pages, layout.repaired_charts), (4, 1, 0));
    mesh.corner_uv = Some(layout.corner_uv);
    let after = quality(&mesh)?;
    assert_eq!((after.flips, after.overlapping_faces, after.charts), (0, 0, 4));
    assert!(after.inside && after.coverage > 0.5, "{}", after.coverage);
    // Squares stay squares, and the stretched sheet stays stretched, by the root of two.
    let pages = atlasfit::measure::uv::Pages { of_face: None, size: [1.0; 2] };
    let stretch = Run::default().execute(|ctx| face_stretch(&mesh, &pages, ctx))?;
    for (f, s) in stretch.iter().enumerate() {
        let expected = if f / 72 % 2 == 0 { 1.0 } else { 2f32.sqrt() };
        assert!((s - expected).abs() < 2e-3, "face {f}: {s}");
    }
    Ok(())
}

#[test]
fn what_turns_over_in_a_chart_is_cut_out() -> Result<()> {
    let mut mesh = sheets(&[1.0], 6);
    // One corner of the grid pulled far across its neighbours.
    let at = mesh.triangles[30][0];
    for (t, uv) in mesh.triangles.iter().zip(mesh.corner_uv.iter_mut().flatten()) {
        for (v, uv) in t.iter().zip(uv) {
            if *v == at {
                *uv = [0.9, 0.9];
            }
        }
    }
    let options = UnwrapOptions::default().with_keep_uvs(true);
    let layout = Run::default().execute(|ctx| unwrap(&mesh, &options, ctx))?;
    assert!(layout.charts > 1 && layout.repaired_charts > 0);
    mesh.corner_uv = Some(layout.corner_uv);
    let after = quality(&mesh)?;
    assert_eq!((after.flips, after.overlapping_faces), (0, 0));
    Ok(())
}

#[test]
fn a_mesh_without_uvs_has_nothing_to_keep() {
    let mut mesh = sheets(&[1.0], 2);
    mesh.corner_uv = None;
    let options = UnwrapOptions::default().with_keep_uvs(true);
    let refused = Run::default().execute(|ctx| unwrap(&mesh, &options, ctx));
    assert!(matches!(refused, Err(Error::InvalidArgument { .. })));
}
