//! Claims about meshes whose vertices are denoised: no spike stays where a neighbour knows the surface.

#[path = "denoise_shapes/mod.rs"]
mod shapes;

use atlasfit::pipeline::{Outliers, denoise_vertices};
use atlasfit::{DenoiseOptions, Denoised, Error, Run};
use shapes::*;

/// Vertices along one side of the sheet.
const N: usize = 45;
/// A vertex with a spike of its own, two that share one, and one at the sheet's edge.
const SPIKES: [usize; 4] = [10 * N + 10, 30 * N + 20, 30 * N + 21, 25 * N];

/// A sheet with steps of 1 and noise of 0.05, with spikes, and its triangles.
fn spiky() -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let mut rng = atlasfit::numeric::Rng::new(5);
    let mut at: Vec<Vec3> =
        (0..N * N).map(|i| [(i % N) as f64, (i / N) as f64, 0.05 * rng.normal()]).collect();
    for (k, v) in SPIKES.into_iter().enumerate() {
        at[v][2] = [15.0, 20.0, 32.0, -17.0][k];
    }
    let n = N as u32;
    let corners = (0..(n - 1) * (n - 1)).map(|i| i / (n - 1) * n + i % (n - 1));
    (at, corners.flat_map(|a| [[a, a + 1, a + n + 1], [a, a + n + 1, a + n]]).collect())
}

fn of_mesh(at: &[Vec3], triangles: &[[u32; 3]], options: &DenoiseOptions) -> Result<Denoised, Error> {
    denoise_vertices(&cloud(at), triangles, options, None, &mut Run::default())
}

#[test]
fn spikes_of_a_mesh_follow_their_neighbours_and_are_still_named_as_outliers() {
    let (at, triangles) = spiky();
    let out = of_mesh(&at, &triangles, &plain()).unwrap();
    assert_eq!((out.report.outliers, out.report.followed_outliers), (4, 4));
    for v in SPIKES {
        let p = out.points.positions[v];
        assert!(p[2].abs() < 0.06 && norm(sub([p[0], p[1], 0.0], [at[v][0], at[v][1], 0.0])) < 0.6, "{p:?}");
        assert_eq!(out.point_chart[v], u32::MAX);
        let normal = out.points.normals.as_ref().unwrap()[v];
        assert!(normal[2].abs() > 0.99, "{normal:?}");
    }
    // The spike that stands alone is exactly at the mean of its six neighbours.
    let (v, p) = (SPIKES[0], &out.points.positions);
    let mean = |k: usize| {
        [v - N - 1, v - N, v - 1, v + 1, v + N, v + N + 1].map(|w| p[w][k]).iter().sum::<f64>() / 6.0
    };
    assert!(norm(sub(p[v], [0, 1, 2].map(mean))) < 1e-12);
}

#[test]
fn all_else_is_as_without_faces() {
    let (at, triangles) = spiky();
    let (mesh, bare) = (of_mesh(&at, &triangles, &plain()).unwrap(), of_mesh(&at, &[], &plain()).unwrap());
    assert_eq!((bare.report.outliers, bare.report.followed_outliers), (4, 0));
    assert_eq!(mesh.surface, bare.surface);
    let moved = mesh.points.positions.iter().zip(&bare.points.positions);
    for (v, ((p, q), given)) in moved.zip(&at).enumerate() {
        assert!(if SPIKES.contains(&v) { q == given && p != q } else { p == q }, "{v}");
    }
}

#[test]
fn outliers_go_as_far_as_the_strength_says_and_none_are_left_to_follow_where_they_are_dropped() {
    let (at, triangles) = spiky();
    let with = |o: DenoiseOptions| of_mesh(&at, &triangles, &o).unwrap();
    let none = with(plain().with_strength(0.0));
    assert_eq!((none.points.positions, none.report.followed_outliers), (at.clone(), 0));
    let half = with(plain().with_strength(0.5));
    assert!((half.points.positions[SPIKES[0]][2] - 7.5).abs() < 0.1);
    let dropped = with(plain().with_outliers(Outliers::Drop));
    assert_eq!((dropped.points.len(), dropped.report.followed_outliers), (N * N - 4, 0));
}

#[test]
fn a_triangle_that_names_no_point_is_refused() {
    let (at, _) = spiky();
    let failure = of_mesh(&at, &[[0, 1, 2], [0, 9999, 1]], &plain()).unwrap_err();
    let text = "index out of range: triangle 1 holds 9999 but there are only 2025 points";
    assert_eq!(failure.to_string(), text);
}
