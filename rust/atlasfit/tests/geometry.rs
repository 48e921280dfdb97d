//! Claims about the numerical tools that all stages share: searches against brute force, factorisations
//! against their definition.

use atlasfit::Vec3;
use atlasfit::numeric::dense::{LANES, cholesky, cholesky_solve, eigen3, eliminate};
use atlasfit::spatial::neighbours::{Neighbour, Neighbours};
use atlasfit::{Error, Run};
use proptest::prelude::*;

/// Points in general, with repeats, all equal, on a line, or on a coarse lattice where many distances tie.
fn points() -> impl Strategy<Value = Vec<Vec3>> {
    let general = prop::collection::vec(prop::array::uniform3(-10.0..10.0f64).prop_map(Vec3), 1..120);
    let equal = (prop::array::uniform3(-1e6..1e6f64), 1usize..200).prop_map(|(p, n)| vec![Vec3(p); n]);
    let line = (prop::array::uniform3(-1.0..1.0f64), prop::collection::vec(-50i32..50, 1..150))
        .prop_map(|(d, t)| t.into_iter().map(|t| Vec3(d) * f64::from(t)).collect());
    let lattice = prop::collection::vec(prop::array::uniform3(0i32..4), 1..200)
        .prop_map(|v| v.into_iter().map(|p| Vec3(p.map(f64::from))).collect());
    prop_oneof![general, equal, line, lattice]
}

fn search(points: &[Vec3]) -> atlasfit::Result<Neighbours> {
    Run::default().execute(|ctx| Neighbours::build(points, ctx))
}

fn brute(points: &[Vec3], q: Vec3) -> Vec<Neighbour> {
    let mut all: Vec<Neighbour> =
        points.iter().enumerate().map(|(i, p)| Neighbour { dist2: (*p).dist2(q), index: i as u32 }).collect();
    all.sort_by(|a, b| a.dist2.total_cmp(&b.dist2).then(a.index.cmp(&b.index)));
    all
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-12 * (1.0 + a.abs())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn the_nearest_are_those_of_a_full_search(
        points in points(), q in prop::array::uniform3(-12.0..12.0f64), k in 0usize..50,
        own in any::<prop::sample::Index>()
    ) {
        let tree = search(&points).unwrap();
        for q in [Vec3(q), points[own.index(points.len())]] {
            let all = brute(&points, q);
            let mut found = Vec::new();
            tree.nearest(q, k, &mut found);
            prop_assert_eq!(found.len(), k.min(points.len()));
            for (f, b) in found.iter().zip(&all) {
                // Which of several equally near points are given is open, how near they are is not.
                prop_assert!(close(f.dist2, b.dist2), "{:?} {:?}", f, b);
                prop_assert!(close(f.dist2, points[f.index as usize].dist2(q)));
            }
            prop_assert!(found.windows(2).all(|w| (w[0].dist2, w[0].index) < (w[1].dist2, w[1].index)));
            prop_assert!(close(tree.nearest_one(q).dist2, all[0].dist2));
        }
    }

    #[test]
    fn those_within_are_those_of_a_full_search(
        points in points(), q in prop::array::uniform3(-12.0..12.0f64), radius in 0.0..20.0f64
    ) {
        let (q, tree) = (Vec3(q), search(&points).unwrap());
        let mut found = Vec::new();
        tree.within(q, radius, &mut found);
        let all = brute(&points, q);
        // A point whose distance is the radius to rounding may be in or out.
        let slack = 1e-12 * (1.0 + radius * radius);
        let sure = all.iter().filter(|n| n.dist2 < radius * radius - slack).count();
        let most = all.iter().filter(|n| n.dist2 <= radius * radius + slack).count();
        prop_assert!((sure..=most).contains(&found.len()), "{} not in {}..={}", found.len(), sure, most);
        for f in &found {
            prop_assert!(f.dist2 <= radius * radius + slack);
            prop_assert!(close(f.dist2, points[f.index as usize].dist2(q)));
        }
        let mut indices: Vec<u32> = found.iter().map(|f| f.index).collect();
        indices.sort_unstable();
        indices.dedup();
        prop_assert_eq!(indices.len(), found.len());
        prop_assert!(found.windows(2).all(|w| (w[0].dist2, w[0].index) < (w[1].dist2, w[1].index)));
    }

    #[test]
    fn a_cholesky_factor_solves_its_system(n in 1usize..24, seed in any::<u64>()) {
        let mut rng = atlasfit::numeric::rng::Rng::new(seed);
        let b: Vec<f64> = (0..n * n).map(|_| rng.normal()).collect();
        // BᵀB + I is positive definite.
        let full: Vec<f64> = (0..n * n)
            .map(|ij| {
                let (i, j) = (ij / n, ij % n);
                (0..n).map(|k| b[k * n + i] * b[k * n + j]).sum::<f64>() + f64::from(u8::from(i == j))
            })
            .collect();
        let x: Vec<f64> = (0..n).map(|_| rng.normal()).collect();
        let mut rhs: Vec<f64> = (0..n).map(|i| (0..n).map(|j| full[i * n + j] * x[j]).sum()).collect();
        let mut u = full.clone();
        // The lower triangle is never read.
        for i in 0..n { for j in 0..i { u[i * n + j] = f64::NAN; } }
        prop_assert!(cholesky(&mut u, n));
        cholesky_solve(&u, n, &mut rhs);
        for (a, b) in rhs.iter().zip(&x) {
            prop_assert!((a - b).abs() < 1e-8 * (1.0 + b.abs()), "{} {}", a, b);
        }
        // The determinant by elimination.
        let (mut m, mut log_det) = (full, 0.0);
        for k in 0..n {
            log_det += m[k * n + k].ln();
            for i in k + 1..n {
                let f = m[i * n + k] / m[k * n + k];
                for j in k..n { m[i * n + j] -= f * m[k * n + j]; }
            }
        }
        let of_factor: f64 = 2.0 * (0..n).map(|i| u[i * n + i].ln()).sum::<f64>();
        prop_assert!((of_factor - log_det).abs() < 1e-8 * (1.0 + log_det.abs()));
    }

    /// The kernel for vectors against the plain one, and the rest against what is left when the pivots are
    /// known.
    #[test]
    fn elimination_factors_the_pivots_and_leaves_the_rest(n in 1usize..40, seed in any::<u64>()) {
        let width = n.next_multiple_of(LANES);
        let pivots = seed as usize % (n + 1);
        let mut rng = atlasfit::numeric::rng::Rng::new(seed);
        let b: Vec<f64> = (0..n * n).map(|_| rng.normal()).collect();
        let full = |i: usize, j: usize| {
            (0..n).map(|k| b[k * n + i] * b[k * n + j]).sum::<f64>() + f64::from(u8::from(i == j))
        };
        let mut a = vec![f64::NAN; width * width];
        let mut u = vec![f64::NAN; pivots * pivots];
        for i in 0..n {
            for j in i..n {
                a[i * width + j] = full(i, j);
                if j < pivots { u[i * pivots + j] = full(i, j); }
            }
        }
        prop_assert!(eliminate(&mut a, width, pivots));
        prop_assert!(pivots == 0 || cholesky(&mut u, pivots));
        let close = |x: f64, y: f64| (x - y).abs() < 1e-8 * (1.0 + y.abs());
        for i in 0..n {
            for j in i..n {
                let got = a[i * width + j];
                if j < pivots {
                    prop_assert!(close(got, u[i * pivots + j]), "{} {}", i, j);
                } else if i < pivots {
                    // Uᵀ times the rows of U is what was there.
                    let sum: f64 = (0..=i).map(|k| a[k * width + i] * a[k * width + j]).sum();
                    prop_assert!(close(sum, full(i, j)), "{} {}", i, j);
                } else {
                    let gone: f64 = (0..pivots).map(|k| a[k * width + i] * a[k * width + j]).sum();
                    prop_assert!(close(got, full(i, j) - gone), "{} {}", i, j);
                }
            }
        }
    }

    #[test]
    fn eigenvectors_rebuild_the_matrix(
        m in prop_oneof![
            prop::array::uniform6(-10.0..10.0f64),
            prop::array::uniform6(-2i32..3).prop_map(|m| m.map(f64::from)),
            prop::array::uniform3(-3.0..3.0f64).prop_map(|v| {
                [v[0] * v[0], v[0] * v[1], v[0] * v[2], v[1] * v[1], v[1] * v[2], v[2] * v[2]]
            }),
            (-5.0..5.0f64).prop_map(|x| [x, 0.0, 0.0, x, 0.0, x]),
        ],
        exponent in -12i32..13,
    ) {
        let unit = 10f64.powi(exponent);
        let m = m.map(|x| x * unit);
        let (values, vectors) = eigen3(m);
        prop_assert!(values[0] <= values[1] && values[1] <= values[2]);
        let size = m.iter().map(|x| x.abs()).fold(0.0, f64::max);
        for (k, (i, j)) in [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].into_iter().enumerate() {
            let built: f64 = (0..3).map(|e| values[e] * vectors[e][i] * vectors[e][j]).sum();
            prop_assert!((built - m[k]).abs() <= 1e-13 * size, "{} is not {}", built, m[k]);
        }
        for i in 0..3 {
            for j in 0..3 {
                prop_assert!((vectors[i].dot(vectors[j]) - f64::from(u8::from(i == j))).abs() < 1e-13);
            }
        }
    }

    #[test]
    fn tangents_complete_a_right_handed_frame(v in prop::array::uniform3(-1.0..1.0f64)) {
        let v = Vec3(v);
        prop_assume!(v.norm() > 1e-6);
        let n = v.map(|x| x / v.norm());
        let (a, b) = n.tangents();
        prop_assert!((a.cross(b) - n).norm() < 1e-12);
        prop_assert!(a.dot(n).abs() < 1e-12 && (a.norm() - 1.0).abs() < 1e-12);
    }
}

#[test]
fn tangents_are_right_at_the_poles() {
    for n in [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [0.0, -0.0, -1.0]].map(Vec3) {
        let (a, b) = n.tangents();
        assert_eq!(a.cross(b), n);
    }
}

#[test]
fn a_matrix_that_is_not_positive_definite_is_refused() {
    for mut m in [[1.0, 2.0, 0.0, 1.0], [0.0; 4], [f64::NAN, 0.0, 0.0, 1.0], [f64::INFINITY, 0.0, 0.0, 1.0]] {
        assert!(!cholesky(&mut m, 2), "{m:?}");
    }
    assert!(cholesky(&mut [], 0));
}

#[test]
fn no_points_make_no_tree() {
    assert!(matches!(search(&[]), Err(Error::EmptyInput { .. })));
}
