//! Small exact shapes for the tests of this module.

use crate::geometry::TriMesh;

/// A flat sheet [0, side]^2 of n x n squares, facing +z.
pub fn sheet(side: f64, n: u32) -> TriMesh {
    let at = |i: u32, j: u32| i * (n + 1) + j;
    let positions = (0..=n)
        .flat_map(|i| (0..=n).map(move |j| [i, j]))
        .map(|[i, j]| [side * f64::from(i) / f64::from(n), side * f64::from(j) / f64::from(n), 0.0])
        .collect();
    let triangles = (0..n)
        .flat_map(|i| (0..n).map(move |j| [i, j]))
        .flat_map(|[i, j]| {
            [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]
        })
        .collect();
    TriMesh::new(positions, triangles)
}

/// A sphere with n rings, facing outward.
pub fn sphere(radius: f64, n: u32) -> TriMesh {
    let m = 2 * n;
    let mut positions = vec![[0.0, 0.0, radius], [0.0, 0.0, -radius]];
    for i in 1..n {
        let t = std::f64::consts::PI * f64::from(i) / f64::from(n);
        for j in 0..m {
            let a = std::f64::consts::TAU * f64::from(j) / f64::from(m);
            positions.push([radius * t.sin() * a.cos(), radius * t.sin() * a.sin(), radius * t.cos()]);
        }
    }
    let at = |i: u32, j: u32| 2 + (i - 1) * m + j % m;
    let mut triangles = Vec::new();
    for j in 0..m {
        triangles.push([0, at(1, j), at(1, j + 1)]);
        triangles.push([1, at(n - 1, j + 1), at(n - 1, j)]);
        for i in 1..n - 1 {
            triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    TriMesh::new(positions, triangles)
}

/// A torus of n x m quads, facing outward.
pub fn torus(n: u32, m: u32) -> TriMesh {
    let mut positions = Vec::new();
    for i in 0..n {
        let a = std::f64::consts::TAU * f64::from(i) / f64::from(n);
        for j in 0..m {
            let b = std::f64::consts::TAU * f64::from(j) / f64::from(m);
            let r = 1.0 + 0.3 * b.cos();
            positions.push([r * a.cos(), r * a.sin(), 0.3 * b.sin()]);
        }
    }
    let at = |i: u32, j: u32| (i % n) * m + j % m;
    let triangles = (0..n)
        .flat_map(|i| (0..m).map(move |j| [i, j]))
        .flat_map(|[i, j]| {
            [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]
        })
        .collect();
    TriMesh::new(positions, triangles)
}

/// A Moebius band of n squares: one-sided, one boundary loop.
pub fn moebius(n: u32) -> TriMesh {
    let mut positions = Vec::new();
    for i in 0..n {
        let a = std::f64::consts::TAU * f64::from(i) / f64::from(n);
        for w in [-0.4, 0.4] {
            let r = 1.0 + w * (a / 2.0).cos();
            positions.push([r * a.cos(), r * a.sin(), w * (a / 2.0).sin()]);
        }
    }
    let triangles = (0..n)
        .flat_map(|i| {
            // The last square meets the first with its sides exchanged.
            let (a, b) = (2 * i, 2 * i + 1);
            let (c, d) = if i + 1 < n { (a + 2, b + 2) } else { (1, 0) };
            [[a, c, d], [a, d, b]]
        })
        .collect();
    TriMesh::new(positions, triangles)
}
