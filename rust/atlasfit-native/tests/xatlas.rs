//! xatlas as a packer keeps what every layout promises. Without the feature: there is none.

#[cfg(not(feature = "xatlas"))]
#[test]
fn without_the_feature_there_is_no_packer() {
    assert!(atlasfit_native::xatlas().is_none());
}

#[cfg(feature = "xatlas")]
mod with {
    use atlasfit::geometry::TriMesh;
    use atlasfit::unwrap::{UnwrapOptions, UvLayout, unwrap, unwrap_with};
    use atlasfit::{CancelToken, Error, Run};

    fn run(mesh: &TriMesh, options: &UnwrapOptions, threads: usize) -> Result<UvLayout, Error> {
        let packer = atlasfit_native::xatlas().unwrap();
        Run { threads, ..Run::default() }.execute(|ctx| unwrap_with(mesh, options, packer, ctx))
    }

    fn cube() -> TriMesh {
        let positions =
            (0..8).map(|k| [f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2)]).collect();
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        TriMesh::new(positions, quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect())
    }

    fn torus(n: usize) -> TriMesh {
        let tau = std::f64::consts::TAU;
        let positions = (0..n * n)
            .map(|k| {
                let (u, v) = (tau * (k / n) as f64 / n as f64, tau * (k % n) as f64 / n as f64);
                [(2.0 + v.cos()) * u.cos(), (2.0 + v.cos()) * u.sin(), v.sin()]
            })
            .collect();
        let at = |i: usize, j: usize| ((i % n) * n + j % n) as u32;
        let triangles = (0..n * n)
            .flat_map(|k| {
                let (i, j) = (k / n, k % n);
                [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]
            })
            .collect();
        TriMesh::new(positions, triangles)
    }

    /// Triangles that touch nowhere, from a millionth of a unit to a unit long, every seventh a needle.
    fn splinters(n: u32) -> TriMesh {
        let mut state = 1u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f64 / (1u64 << 24) as f64
        };
        let mut positions = Vec::new();
        for k in 0..n {
            let size = 10f64.powf(-6.0 * random().powi(3));
            let thin = if k % 7 == 0 { 1e-5 } else { 0.2 + 0.8 * random() };
            let [x, y, z] = [3.0 * random(), 3.0 * random(), f64::from(k)];
            positions.push([x, y, z]);
            positions.push([x + size, y, z]);
            positions.push([x + size * random(), y + size * thin, z]);
        }
        TriMesh::new(positions, (0..n).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect())
    }

    fn cross(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    }

    fn to_segment(p: [f64; 2], a: [f64; 2], b: [f64; 2]) -> f64 {
        let d = [b[0] - a[0], b[1] - a[1]];
        let t = ((p[0] - a[0]) * d[0] + (p[1] - a[1]) * d[1]) / (d[0] * d[0] + d[1] * d[1]).max(1e-300);
        let t = t.clamp(0.0, 1.0);
        (a[0] + t * d[0] - p[0]).hypot(a[1] + t * d[1] - p[1])
    }

    /// Distance of two triangles in the plane; 0 if they overlap.
    fn distance(s: [[f64; 2]; 3], t: [[f64; 2]; 3]) -> f64 {
        let mut least = f64::INFINITY;
        for (one, other) in [(s, t), (t, s)] {
            for p in one {
                if (0..3).all(|k| cross(other[k], other[(k + 1) % 3], p) > 0.0) {
                    return 0.0;
                }
                (0..3).for_each(|k| least = least.min(to_segment(p, other[k], other[(k + 1) % 3])));
            }
        }
        let crossing = (0..9).any(|k| {
            let (a, b, c, d) = (s[k / 3], s[(k / 3 + 1) % 3], t[k % 3], t[(k % 3 + 1) % 3]);
            cross(a, b, c) * cross(a, b, d) < 0.0 && cross(c, d, a) * cross(c, d, b) < 0.0
        });
        if crossing { 0.0 } else { least }
    }

    /// No flips, no overlaps, and the padding free round every chart and at the border, to a hundredth of a
    /// texel.
    fn check(mesh: &TriMesh, uv: &UvLayout, padding: u32) {
        assert_eq!(uv.corner_uv.len(), mesh.triangles.len());
        let size = [f64::from(uv.width), f64::from(uv.height)];
        let texels: Vec<[[f64; 2]; 3]> =
            uv.corner_uv.iter().map(|t| t.map(|p| [0, 1].map(|k| f64::from(p[k]) * size[k]))).collect();
        let padding = f64::from(padding) - 0.01;
        for (f, t) in texels.iter().enumerate() {
            assert!(cross(t[0], t[1], t[2]) > 0.0, "face {f} is flipped");
            assert!((0..2).all(|k| t.iter().all(|p| p[k] >= padding && p[k] <= size[k] - padding)));
        }
        for f in 0..texels.len() {
            for g in 0..f {
                if uv.face_page[f] == uv.face_page[g] && uv.face_chart[f] != uv.face_chart[g] {
                    let d = distance(texels[f], texels[g]);
                    assert!(d > 0.0 && d >= padding, "faces {f} and {g}: {d} texels apart");
                }
            }
        }
    }

    #[test]
    fn charts_stay_apart_whatever_their_sizes() {
        for mesh in [cube(), torus(20), splinters(300)] {
            for padding_px in [0, 1, 2, 5] {
                let options = UnwrapOptions::default().with_padding_px(padding_px).with_page_size([256; 2]);
                let uv = run(&mesh, &options, 0).unwrap();
                check(&mesh, &uv, padding_px);
                assert_eq!(uv.pages, 1);
                assert_eq!(uv, run(&mesh, &options, 1).unwrap());
            }
        }
    }

    #[test]
    fn the_charts_are_those_of_the_own_packer() {
        let mesh = torus(20);
        let own = Run::default().execute(|ctx| unwrap(&mesh, &UnwrapOptions::default(), ctx)).unwrap();
        let xatlas = run(&mesh, &UnwrapOptions::default(), 0).unwrap();
        assert_eq!(own.face_chart, xatlas.face_chart);
        assert!(xatlas.texels_per_unit > 0.6 * own.texels_per_unit);
    }

    #[test]
    fn a_given_density_takes_the_pages_it_needs() {
        let mesh = cube();
        let options = UnwrapOptions::default()
            .with_page_size([256; 2])
            .with_texels_per_unit(Some(100.0))
            .with_hard_edge_angle(Some(60.0));
        let uv = run(&mesh, &options, 0).unwrap();
        check(&mesh, &uv, options.padding_px);
        assert_eq!((uv.charts, uv.texels_per_unit.round(), uv.pages), (6, 100.0, 2));
        let uv = run(&mesh, &options.with_pages(Some(1)), 0).unwrap();
        check(&mesh, &uv, 2);
        assert!(uv.pages == 1 && uv.texels_per_unit < 99.0);
    }

    #[test]
    fn what_it_cannot_do_is_a_clear_error_and_it_stops_when_cancelled() {
        let wide = UnwrapOptions::default().with_page_size([512, 128]);
        assert!(matches!(run(&cube(), &wide, 0), Err(Error::InvalidArgument { .. })));
        let token = CancelToken::new();
        token.cancel();
        let packer = atlasfit_native::xatlas().unwrap();
        let cancelled = Run { cancel: Some(token), ..Run::default() }
            .execute(|ctx| unwrap_with(&cube(), &UnwrapOptions::default(), packer, ctx));
        assert_eq!(cancelled, Err(Error::Cancelled));
    }
}
