//! What CGAL does, beside what the core does.
#![cfg(feature = "cgal")]

use atlasfit::geometry::{PointCloud, TriMesh};
use atlasfit::measure::{self, DistanceOptions};
use atlasfit::numeric::Rng;
use atlasfit::{CancelToken, Context, DenoiseOptions, Error, Result, Run, Vec3, denoise};
use atlasfit_native::{Cgal, cgal, wrap};

fn library() -> &'static dyn Cgal {
    cgal().expect("built with the feature")
}

fn run<T: Send>(job: impl FnOnce(&Context<'_>) -> Result<T> + Send) -> Result<T> {
    Run::default().execute(job)
}

/// A sphere without its north, of so many rings.
fn bowl(rings: u32) -> TriMesh {
    let sides = 2 * rings;
    let at = |k: u32| {
        let (i, j) = (k / sides, k % sides);
        let (b, a) = (0.1 + 2.2 * f64::from(i) / f64::from(rings), f64::from(j) / f64::from(sides));
        let (sa, ca) = (std::f64::consts::TAU * a).sin_cos();
        [(3.1 - b).sin() * ca, (3.1 - b).sin() * sa, (3.1 - b).cos()]
    };
    let corner = |i: u32, j: u32| i * sides + j % sides;
    let square = |k: u32| {
        let (i, j) = (k / sides, k % sides);
        let [a, b, c, d] = [corner(i, j), corner(i, j + 1), corner(i + 1, j + 1), corner(i + 1, j)];
        [[a, b, c], [a, c, d]]
    };
    TriMesh::new((0..(rings + 1) * sides).map(at).collect(), (0..rings * sides).flat_map(square).collect())
}

#[test]
fn a_shell_is_closed_and_as_far_off_as_asked_for() -> Result<()> {
    let bowl = bowl(16);
    let shell = run(|ctx| library().alpha_wrap(&bowl, 0.3, 0.05, ctx))?;
    let t = run(|ctx| measure::topology(&shell, ctx))?;
    assert!(t.is_closed() && t.non_manifold_edges + t.non_manifold_vertices == 0 && t.orientable);
    assert_eq!(run(|ctx| library().self_intersections(&shell, ctx))?, [[0u32; 2]; 0]);
    let cloud = PointCloud::from_positions(shell.positions.clone());
    let (d, _) = run(|ctx| measure::points_each(&cloud, &bowl, &DistanceOptions::default(), ctx))?;
    assert!((0.04..0.06).contains(&d.accuracy.median) && d.accuracy.max < 0.1, "{:?}", d.accuracy);
    Ok(())
}

#[test]
fn measured_distances_are_the_exact_ones() -> Result<()> {
    let bowl = bowl(6);
    let mut rng = Rng::new(1);
    // Also on the mesh, far off, and far from the origin.
    let mut points: Vec<[f64; 3]> = (0..40).map(|_| Vec3::from_fn(|_| rng.normal()).0).collect();
    points.extend([bowl.positions[3], [1e6, 0.0, 0.0], [0.0; 3]]);
    let exact = run(|ctx| library().exact_distances(&bowl, &points, ctx))?;
    let cloud = PointCloud::from_positions(points);
    let (_, ours) = run(|ctx| measure::points_each(&cloud, &bowl, &DistanceOptions::default(), ctx))?;
    for (a, b) in ours.iter().zip(&exact) {
        assert!((a - b).abs() <= 1e-12 * b.max(1.0), "{a} {b}");
    }
    Ok(())
}

#[test]
fn triangles_that_meet_are_found_and_neighbours_do_not_meet() -> Result<()> {
    let mut mesh = bowl(8);
    assert!(run(|ctx| library().self_intersections(&mesh, ctx))?.is_empty());
    let (n, f) = (mesh.positions.len() as u32, mesh.triangles.len() as u32);
    // Through the bowl beside its small hole at the bottom; then one folded onto its neighbour.
    mesh.positions.extend([[0.4, 0.05, -2.0], [0.45, -0.05, 0.5], [0.35, -0.05, 0.5]]);
    mesh.triangles.push([n, n + 1, n + 2]);
    let [a, b, c] = mesh.triangles[40];
    mesh.triangles.push([b, a, c]);
    let pairs = run(|ctx| library().self_intersections(&mesh, ctx))?;
    assert!(pairs.iter().any(|p| p[1] == f) && pairs.contains(&[40, f + 1]), "{pairs:?}");
    Ok(())
}

#[test]
fn a_denoised_scan_gets_a_shell_with_uvs() -> Result<()> {
    let mut rng = Rng::new(2);
    // Half a ball, with noise.
    let at = (0..3000).map(|_| {
        let p = Vec3::from_fn(|_| rng.normal()).normalized();
        (Vec3([p[0], p[1], p[2].abs()]) * (1.0 + 0.01 * rng.normal())).0
    });
    let scan = PointCloud::from_positions(at.collect());
    let options = DenoiseOptions::default();
    let mut made = denoise(&scan, &options, &mut Run::default())?;
    assert!(made.report.boundary_edges > 0);
    run(|ctx| wrap(&mut made, library(), &options, ctx))?;
    assert_eq!((made.report.boundary_edges, made.report.parts), (0, 1));
    let uv = run(|ctx| measure::uv::uv(&made.surface, ctx))?;
    assert_eq!((uv.flips, uv.charts), (0, made.report.uv_charts));
    Ok(())
}

#[test]
fn bad_input_is_told_and_a_run_that_is_cancelled_stops() {
    let mut mesh = bowl(24);
    let cancel = CancelToken::new();
    cancel.cancel();
    let mut stopped = Run { cancel: Some(cancel), ..Run::default() };
    let outcome = stopped.execute(|ctx| library().alpha_wrap(&mesh, 0.01, 0.001, ctx));
    assert!(matches!(outcome, Err(Error::Cancelled)), "{outcome:?}");
    // Some hundredths of a second of work that takes minutes.
    let mut short = Run { time_limit_s: Some(0.3), ..Run::default() };
    let outcome = short.execute(|ctx| library().alpha_wrap(&mesh, 2e-3, 1e-4, ctx));
    assert!(matches!(outcome, Err(Error::TimedOut { .. })), "{outcome:?}");
    for (alpha, offset) in [(0.0, 1.0), (f64::NAN, 1.0), (1.0, f64::INFINITY)] {
        let outcome = run(|ctx| library().alpha_wrap(&mesh, alpha, offset, ctx));
        assert!(matches!(outcome, Err(Error::InvalidArgument { .. })));
    }
    mesh.positions[5][1] = f64::NAN;
    let outcome = run(|ctx| library().self_intersections(&mesh, ctx));
    assert!(matches!(outcome, Err(Error::InvalidArgument { .. })));
}

#[test]
fn a_remeshed_surface_is_the_same_with_sides_of_the_length_asked_for() -> Result<()> {
    let bowl = bowl(16);
    let new = run(|ctx| library().remesh(&bowl, 0.15, 3, ctx))?;
    let (before, after) =
        (run(|ctx| measure::topology(&bowl, ctx))?, run(|ctx| measure::topology(&new, ctx))?);
    assert_eq!((after.euler, after.boundary_loops), (before.euler, before.boundary_loops));
    assert!(after.non_manifold_edges + after.non_manifold_vertices + after.inconsistent_edges == 0);
    let side = |t: &[u32; 3], k: usize| {
        let [a, b] = [t[k], t[(k + 1) % 3]].map(|v| Vec3(new.positions[v as usize]));
        (b - a).norm()
    };
    let mut sides: Vec<f64> = new.triangles.iter().flat_map(|t| (0..3).map(|k| side(t, k))).collect();
    sides.sort_by(f64::total_cmp);
    let share = |q: f64| sides[(q * sides.len() as f64) as usize];
    let [few, half, most] = [0.05, 0.5, 0.95].map(share);
    // What is longer than 4/3 is split, what is shorter than 4/5 collapsed.
    assert!((0.1..0.2).contains(&half) && few > 0.07 && most < 0.22, "{few} {half} {most}");
    let d = run(|ctx| measure::surface(&new, &bowl, &DistanceOptions::default(), ctx))?;
    // A corner of the boundary may be cut off.
    assert!(
        d.accuracy.p99 < 0.01 && d.completeness.p99 < 0.01 && d.accuracy.max.max(d.completeness.max) < 0.05,
        "{:?} {:?}",
        d.accuracy,
        d.completeness
    );

    let mut short = Run { time_limit_s: Some(0.3), ..Run::default() };
    let outcome = short.execute(|ctx| library().remesh(&bowl, 8e-3, 5, ctx));
    assert!(matches!(outcome, Err(Error::TimedOut { .. })), "{outcome:?}");
    let mut small = Run { memory_limit_bytes: Some(1 << 24), ..Run::default() };
    let outcome = small.execute(|ctx| library().remesh(&bowl, 8e-3, 5, ctx));
    assert!(matches!(outcome, Err(Error::OutOfMemory { .. })), "{outcome:?}");
    let mut folded = bowl.clone();
    folded.triangles.push([bowl.triangles[9][1], bowl.triangles[9][0], bowl.triangles[9][2]]);
    for (mesh, length) in [(&folded, 0.1), (&bowl, 0.0), (&bowl, f64::NAN)] {
        let outcome = run(|ctx| library().remesh(mesh, length, 3, ctx));
        assert!(matches!(outcome, Err(Error::InvalidArgument { .. })), "{outcome:?}");
    }
    Ok(())
}
