//! Claims about meshes with fewer triangles: near the given one, whole, with UVs that do not turn over.

use atlasfit::geometry::TriMesh;
use atlasfit::measure::{self, DistanceOptions};
use atlasfit::simplify::{SimplifiedMesh, SimplifyOptions, simplify_mesh};
use atlasfit::unwrap::{UnwrapOptions, unwrap};
use atlasfit::{Error, Result, Run};
use proptest::prelude::*;

/// A bumpy torus of so many rings and sides.
fn torus(rings: u32, sides: u32) -> TriMesh {
    let at = |k: u32| {
        let turn = |x: u32, of: u32| (std::f64::consts::TAU * f64::from(x) / f64::from(of)).sin_cos();
        let ((sa, ca), (sb, cb)) = (turn(k / sides, rings), turn(k % sides, sides));
        let r = 0.4 + 0.02 * (5.0 * sa * cb).sin();
        [(1.0 + r * cb) * ca, (1.0 + r * cb) * sa, r * sb]
    };
    let corner = |i: u32, j: u32| i % rings * sides + j % sides;
    let square = |k: u32| {
        let (i, j) = (k / sides, k % sides);
        let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
        [[a, b, c], [a, c, d]]
    };
    TriMesh::new((0..rings * sides).map(at).collect(), (0..rings * sides).flat_map(square).collect())
}

fn simplified(mesh: &TriMesh, options: &SimplifyOptions) -> Result<SimplifiedMesh> {
    Run::default().execute(|ctx| simplify_mesh(mesh, options, ctx))
}

fn to_faces(mesh: &TriMesh, faces: usize) -> SimplifiedMesh {
    simplified(mesh, &SimplifyOptions::default().with_faces(Some(faces))).expect("it is simplified")
}

/// The same mesh with UVs.
fn unwrapped(mut mesh: TriMesh) -> TriMesh {
    let layout = Run::default().execute(|ctx| unwrap(&mesh, &UnwrapOptions::default(), ctx));
    let layout = layout.expect("it is unwrapped");
    (mesh.corner_uv, mesh.face_chart) = (Some(layout.corner_uv), Some(layout.face_chart));
    mesh
}

/// What a mesh's topology is: parts, boundary edges, edges that are not manifold, Euler's number.
fn topology(mesh: &TriMesh) -> (usize, usize, usize, i64) {
    let t = Run::default().execute(|ctx| measure::topology(mesh, ctx)).expect("it is measured");
    (t.parts, t.boundary_edges, t.non_manifold_edges + t.non_manifold_vertices, t.euler)
}

/// Root mean square distance from the one to the other.
fn off(mesh: &TriMesh, truth: &TriMesh) -> f64 {
    let options = DistanceOptions::default();
    let d = Run::default().execute(|ctx| measure::surface(mesh, truth, &options, ctx));
    let d = d.expect("it is measured");
    d.accuracy.rms.max(d.completeness.rms)
}

#[test]
fn a_tenth_of_the_triangles_with_uvs_is_whole_near_and_turns_nothing_over() {
    for (rings, sides) in [(160, 80), (120, 100), (180, 60)] {
        is_whole_near_and_turns_nothing_over(&torus(rings, sides));
    }
}

fn is_whole_near_and_turns_nothing_over(mesh: &TriMesh) {
    let bare = to_faces(mesh, mesh.triangles.len() / 10);
    let mesh = unwrapped(mesh.clone());
    let light = to_faces(&mesh, mesh.triangles.len() / 10);
    assert!(light.mesh.triangles.len() <= mesh.triangles.len() / 10, "{:?}", light.warnings);
    assert_eq!(topology(&light.mesh), (1, 0, 0, 0));
    assert_eq!(topology(&bare.mesh), (1, 0, 0, 0));
    let [with_uv, without] = [&light, &bare].map(|l| off(&l.mesh, &mesh));
    // Mean sides are 0.08, and a bulge of that length is 0.002 high.
    assert!(without < 2e-3 && with_uv < 1.25 * without, "{with_uv} {without}");
    let [before, after] = [&mesh, &light.mesh]
        .map(|m| Run::default().execute(|ctx| measure::uv::uv(m, ctx)).expect("it has UVs"));
    assert_eq!((after.flips, after.degenerate, after.charts), (0, 0, before.charts));
    // A texture stays where it was: UVs at vertices are those of the same places.
    assert!(after.stretch_l2 < 1.1 * before.stretch_l2, "{} {}", after.stretch_l2, before.stretch_l2);
    let charts = light.mesh.face_chart.expect("each triangle has a chart");
    assert_eq!(charts.iter().max().map(|&c| c as usize + 1), Some(before.charts));
}

#[test]
fn an_error_bound_holds_and_the_boundary_stays() {
    // A wavy sheet.
    let at = |i: u32| {
        let (x, y) = (f64::from(i % 61) / 60.0, f64::from(i / 61) / 60.0);
        [100.0 + x, y, 0.05 * (6.0 * x).sin()]
    };
    let corners = (0..3600).map(|i| i / 60 * 61 + i % 60);
    let triangles = corners.flat_map(|a| [[a, a + 1, a + 62], [a, a + 62, a + 61]]).collect();
    let mesh = TriMesh::new((0..61 * 61).map(at).collect(), triangles);
    let error = 0.002;
    let light =
        simplified(&mesh, &SimplifyOptions::default().with_max_error(Some(error))).expect("simplified");
    assert!(light.mesh.triangles.len() < 700, "{}", light.mesh.triangles.len());
    let options = DistanceOptions::default();
    let d =
        Run::default().execute(|ctx| measure::surface(&mesh, &light.mesh, &options, ctx)).expect("measured");
    assert!(d.accuracy.max <= 1.5 * error, "{}", d.accuracy.max);
    assert_eq!(topology(&light.mesh).3, 1);
}

#[test]
fn what_is_no_surface_stays_and_nothing_else_is_lost() {
    // Three sheets along one edge, a fan that touches them in a vertex, a triangle without area, one that is
    // not finite.
    let mut mesh = torus(40, 20);
    let n = mesh.positions.len() as u32;
    mesh.positions.extend([[3.0, 0.0, 0.0], [3.0, 1.0, 0.0], [f64::NAN; 3]]);
    let [a, b] = [mesh.triangles[7][0], mesh.triangles[7][1]];
    mesh.triangles.extend([[a, b, n], [0, n, n + 1], [3, 3, 4], [5, 6, n + 2]]);
    let light = to_faces(&mesh, 200);
    assert!(light.mesh.triangles.len() <= 210 && light.warnings.len() == 1, "{:?}", light.warnings);
    let has = |p: [f64; 3]| light.mesh.positions.contains(&p);
    let pinned = [a, b, n, 0, n + 1].map(|v| mesh.positions[v as usize]);
    assert!(pinned.into_iter().all(has));
}

#[test]
fn columns_are_those_of_vertices_near_by_and_split_vertices_are_one_again() {
    let whole = torus(40, 20);
    // Every triangle with vertices of its own.
    let mut mesh = TriMesh::new(
        whole.triangles.iter().flatten().map(|&v| whole.positions[v as usize]).collect(),
        (0..whole.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
    );
    mesh.colors = Some(mesh.positions.iter().map(|p| [p[0] as f32, p[1] as f32, p[2] as f32, 1.0]).collect());
    let light = to_faces(&mesh, 400);
    assert_eq!(topology(&light.mesh), (1, 0, 0, 0));
    let colors = light.mesh.colors.as_ref().expect("colours stay");
    for (p, c) in light.mesh.positions.iter().zip(colors) {
        let far = (0..3).map(|k| (p[k] - f64::from(c[k])).powi(2)).sum::<f64>().sqrt();
        assert!(far < 0.4, "{p:?} {c:?}");
    }
    assert_eq!(light.source.len(), light.mesh.positions.len());
}

#[test]
fn wrong_options_and_empty_meshes_are_refused() {
    let mesh = torus(8, 6);
    for options in [
        SimplifyOptions::default(),
        SimplifyOptions::default().with_faces(Some(0)),
        SimplifyOptions::default().with_max_error(Some(0.0)),
        SimplifyOptions::default().with_max_error(Some(f64::NAN)),
    ] {
        assert!(matches!(simplified(&mesh, &options), Err(Error::InvalidArgument { .. })), "{options:?}");
    }
    let options = SimplifyOptions::default().with_faces(Some(10));
    let flat = TriMesh::new(vec![[0.0; 3]; 3], vec![[0, 1, 2]]);
    assert!(matches!(simplified(&flat, &options), Err(Error::Degenerate { .. })));
    let bad = TriMesh::new(vec![[0.0; 3]; 3], vec![[0, 1, 3]]);
    assert!(matches!(simplified(&bad, &options), Err(Error::IndexOutOfRange { .. })));
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let mesh = unwrapped(torus(60, 40));
    let options = SimplifyOptions::default().with_faces(Some(500));
    let with = |threads| {
        let mut run = Run { threads, ..Run::default() };
        run.execute(|ctx| simplify_mesh(&mesh, &options, ctx)).expect("it is simplified")
    };
    assert_eq!(with(1), with(3));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Whatever triangles there are, what comes out is a valid mesh, and no UV triangle turns over.
    #[test]
    fn any_soup_comes_out_valid(
        places in prop::collection::vec(prop::array::uniform3(0i8..4), 4..40),
        corners in prop::collection::vec(prop::array::uniform3(0usize..40), 1..120),
        faces in 1usize..60,
    ) {
        let n = places.len();
        let positions = places.iter().map(|p| p.map(f64::from)).collect();
        let triangles: Vec<[u32; 3]> = corners.iter().map(|t| t.map(|v| (v % n) as u32)).collect();
        let mut mesh = TriMesh::new(positions, triangles);
        mesh.corner_uv = Some(mesh.triangles.iter().map(|t| t.map(|v| {
            let p = places[v as usize];
            [f32::from(p[0]), f32::from(p[1]) + 0.5 * f32::from(p[2])]
        })).collect());
        let options = SimplifyOptions::default().with_faces(Some(faces));
        match simplified(&mesh, &options) {
            Ok(light) => {
                prop_assert!(light.mesh.validate().is_ok());
                prop_assert!(light.mesh.triangles.len() <= mesh.triangles.len());
                prop_assert!(light.mesh.positions.iter().flatten().all(|x| x.is_finite()));
            }
            Err(error) => prop_assert!(matches!(error, Error::Degenerate { .. }), "{error}"),
        }
    }
}
