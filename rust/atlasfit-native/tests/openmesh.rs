//! What OpenMesh does, beside what is known of subdivision.
#![cfg(feature = "openmesh")]

use atlasfit::geometry::TriMesh;
use atlasfit::measure;
use atlasfit::{CancelToken, Context, Error, Result, Run, Vec3};
use atlasfit_native::{OpenMesh, Subdivision, openmesh};

fn library() -> &'static dyn OpenMesh {
    openmesh().expect("built with the feature")
}

fn run<T: Send>(job: impl FnOnce(&Context<'_>) -> Result<T> + Send) -> Result<T> {
    Run::default().execute(job)
}

/// Eight triangles about the origin, and a vertex that none names.
fn octahedron() -> TriMesh {
    let x = [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]];
    let positions = x.into_iter().chain([[0.0, 0.0, -1.0], [9.0; 3]]).collect();
    let upper = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4]];
    let lower = upper.map(|[a, b, _]| [b, a, 5]);
    TriMesh::new(positions, [upper, lower].concat())
}

/// A square of two triangles.
fn square() -> TriMesh {
    let corners = vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    TriMesh::new(corners, vec![[0, 1, 2], [0, 2, 3]])
}

#[test]
fn each_step_makes_four_or_three_of_a_triangle_and_the_surface_stays_closed() -> Result<()> {
    for (how, each) in [(Subdivision::Loop, 4), (Subdivision::Sqrt3, 3)] {
        let fine = run(|ctx| library().subdivide(&octahedron(), how, 3, ctx))?;
        assert_eq!(fine.triangles.len(), 8 * each * each * each);
        let t = run(|ctx| measure::topology(&fine, ctx))?;
        assert!(t.is_closed() && t.euler == 2 && t.inconsistent_edges + t.unused_vertices == 0, "{t:?}");
        // Round: all vertices are about as far from the middle.
        let far = fine.positions.iter().map(|&p| Vec3(p).norm());
        let (least, most) = far.fold((9.0, 0.0), |(a, b): (f64, f64), r| (a.min(r), b.max(r)));
        assert!(least > 0.3 && most < 1.25 * least, "{how:?}: {least} {most}");
    }
    Ok(())
}

#[test]
fn a_loop_step_has_the_published_weights() -> Result<()> {
    let fine = run(|ctx| library().subdivide(&octahedron(), Subdivision::Loop, 1, ctx))?;
    // Valence 4: (40 - (3 + 2 cos(90 degrees))^2) / 64 = 31 / 64 goes to the neighbours, whose sum is 0.
    assert!((Vec3(fine.positions[0]) - Vec3([33.0 / 64.0, 0.0, 0.0])).norm() < 1e-12);
    // An edge: 3/8 of both ends, 1/8 of both corners beside it, which lie opposite each other.
    let edge = Vec3([0.375, 0.375, 0.0]);
    assert!(fine.positions.iter().any(|&p| (Vec3(p) - edge).norm() < 1e-12));
    Ok(())
}

#[test]
fn a_boundary_stays_one_and_none_or_no_step_changes_nothing_else() -> Result<()> {
    for (how, sides) in [(Subdivision::Loop, 16), (Subdivision::Sqrt3, 12)] {
        let fine = run(|ctx| library().subdivide(&square(), how, 2, ctx))?;
        let t = run(|ctx| measure::topology(&fine, ctx))?;
        assert_eq!((t.boundary_edges, t.boundary_loops, t.euler), (sides, 1, 1), "{how:?}");
        assert!(fine.positions.iter().all(|p| p[2].abs() < 1e-12), "flat stays flat");
        assert_eq!(run(|ctx| library().subdivide(&square(), how, 0, ctx))?, square());
    }
    Ok(())
}

#[test]
fn what_is_no_surface_is_told_before_openmesh_sees_it() {
    let mut three = square();
    three.positions.push([0.5, 0.5, 1.0]);
    three.triangles.push([2, 0, 4]);
    let mut turned = square();
    turned.triangles[1] = [0, 3, 2];
    let mut sheets = square();
    sheets.positions.extend([[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]);
    sheets.triangles.push([0, 4, 5]);
    let mut twice = square();
    twice.triangles.push([1, 1, 2]);
    let mut nan = square();
    nan.positions[2][0] = f64::NAN;
    for (mesh, what) in [
        (three, "no surface"),
        (turned, "no surface"),
        (sheets, "vertex 0 holds two sheets"),
        (twice, "names vertex 1 twice"),
        (nan, "vertex 2 is not finite"),
    ] {
        let said = run(|ctx| library().subdivide(&mesh, Subdivision::Loop, 1, ctx)).unwrap_err();
        assert!(matches!(said, Error::InvalidArgument { .. }) && said.to_string().contains(what), "{said}");
    }
    let empty = run(|ctx| library().subdivide(&TriMesh::default(), Subdivision::Loop, 1, ctx));
    assert!(matches!(empty, Err(Error::Degenerate { .. })));
    let beyond = run(|ctx| library().subdivide(&square(), Subdivision::Loop, 40, ctx));
    assert!(matches!(beyond, Err(Error::InvalidArgument { .. })), "{beyond:?}");
}

#[test]
fn a_run_that_is_cancelled_or_has_no_memory_stops() {
    let cancel = CancelToken::new();
    cancel.cancel();
    let mut stopped = Run { cancel: Some(cancel), ..Run::default() };
    let outcome = stopped.execute(|ctx| library().subdivide(&octahedron(), Subdivision::Sqrt3, 2, ctx));
    assert!(matches!(outcome, Err(Error::Cancelled)), "{outcome:?}");
    let mut small = Run { memory_limit_bytes: Some(1 << 20), ..Run::default() };
    let outcome = small.execute(|ctx| library().subdivide(&octahedron(), Subdivision::Loop, 6, ctx));
    assert!(matches!(outcome, Err(Error::OutOfMemory { .. })), "{outcome:?}");
}

#[test]
fn vertices_of_many_triangles_are_smoothed_too() -> Result<()> {
    // A fan of 80 about its middle, closed below: beyond the tables of weights.
    let n = 80u32;
    let at = |k: u32| {
        let (s, c) = (std::f64::consts::TAU * f64::from(k) / f64::from(n)).sin_cos();
        [c, s, 0.0]
    };
    let mut positions: Vec<[f64; 3]> = (0..n).map(at).collect();
    positions.extend([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]);
    let triangles = (0..n).flat_map(|k| [[k, (k + 1) % n, n], [(k + 1) % n, k, n + 1]]).collect();
    let fan = TriMesh::new(positions, triangles);
    for how in [Subdivision::Loop, Subdivision::Sqrt3] {
        let fine = run(|ctx| library().subdivide(&fan, how, 2, ctx))?;
        assert!(fine.positions.iter().all(|p| Vec3(*p).norm() < 1.01), "{how:?}");
    }
    Ok(())
}
