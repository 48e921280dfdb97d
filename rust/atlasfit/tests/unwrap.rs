//! What every UV layout must satisfy, on small meshes made here.

use atlasfit::geometry::TriMesh;
use atlasfit::unwrap::{Packer, Preset, UnwrapOptions, UvLayout, unwrap};
use atlasfit::{CancelToken, Error, Run, measure};
use proptest::prelude::*;

fn run(mesh: &TriMesh, options: &UnwrapOptions, threads: usize) -> Result<UvLayout, Error> {
    Run { threads, ..Run::default() }.execute(|ctx| unwrap(mesh, options, ctx))
}

/// A sphere of `n` by `2n` quads, pinched at the poles, radii (1, b, c).
fn ellipsoid(n: usize, b: f64, c: f64) -> TriMesh {
    let point = |i: usize, j: usize| {
        let (t, p) = (std::f64::consts::PI * i as f64 / n as f64, std::f64::consts::PI * j as f64 / n as f64);
        [t.sin() * p.cos(), b * t.sin() * p.sin(), c * t.cos()]
    };
    let mut positions = vec![point(0, 0)];
    for i in 1..n {
        positions.extend((0..2 * n).map(|j| point(i, j)));
    }
    positions.push(point(n, 0));
    let south = positions.len() as u32 - 1;
    let at = |i: usize, j: usize| (1 + (i - 1) * 2 * n + j % (2 * n)) as u32;
    let mut triangles = Vec::new();
    for j in 0..2 * n {
        triangles.push([0, at(1, j), at(1, j + 1)]);
        triangles.push([south, at(n - 1, j + 1), at(n - 1, j)]);
        for i in 1..n - 1 {
            triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    TriMesh::new(positions, triangles)
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

fn cube() -> TriMesh {
    let positions = (0..8).map(|k| [f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2)]).collect();
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    TriMesh::new(positions, quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect())
}

fn twice(t: &[[f32; 2]; 3]) -> f64 {
    let [a, b, c] = t.map(|p| p.map(f64::from));
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Largest share of a page's sample points that more than one face covers, and the worst flip.
fn check(mesh: &TriMesh, uv: &UvLayout) {
    assert_eq!(uv.corner_uv.len(), mesh.triangles.len());
    assert_eq!(uv.face_chart.len(), mesh.triangles.len());
    assert!(uv.face_chart.iter().all(|&c| (c as usize) < uv.charts));
    assert!(uv.corner_uv.iter().flatten().flatten().all(|x| (0.0..=1.0).contains(x)));
    const R: usize = 512;
    let mut count = vec![0u8; R * R * uv.pages];
    for (f, t) in uv.corner_uv.iter().enumerate() {
        if twice(t) == 0.0 {
            continue;
        }
        assert!(twice(t) > 0.0, "face {f} is flipped");
        let p = t.map(|p| p.map(|x| f64::from(x) * R as f64));
        let range = |k: usize| {
            let x = p.map(|q| q[k]);
            (
                x.iter().fold(f64::MAX, |a, &b| a.min(b)) as usize,
                x.iter().fold(0f64, |a, &b| a.max(b)) as usize,
            )
        };
        let ((x0, x1), (y0, y1)) = (range(0), range(1));
        for y in y0..=y1.min(R - 1) {
            for x in x0..=x1.min(R - 1) {
                let q = [x as f64 + 0.5, y as f64 + 0.5];
                let side =
                    |a: [f64; 2], b: [f64; 2]| (b[0] - a[0]) * (q[1] - a[1]) - (b[1] - a[1]) * (q[0] - a[0]);
                if (0..3).all(|k| side(p[k], p[(k + 1) % 3]) > 1e-3) {
                    count[(uv.face_page[f] as usize * R + y) * R + x] += 1;
                }
            }
        }
    }
    assert!(count.iter().all(|&c| c <= 1), "faces overlap");
}

#[test]
fn closed_surfaces_of_any_genus_unwrap_without_flips_or_overlaps_and_within_the_bound() {
    for (mesh, most) in
        [(ellipsoid(24, 1.0, 1.0), 16), (ellipsoid(20, 0.4, 2.0), 14), (torus(40), 20), (cube(), 6)]
    {
        let uv = run(&mesh, &UnwrapOptions::default(), 0).unwrap();
        check(&mesh, &uv);
        assert!(uv.over_stretched <= 0.05, "{}", uv.over_stretched);
        assert!(uv.charts <= most, "{} charts", uv.charts);
    }
}

#[test]
fn a_looser_bound_never_needs_many_more_charts() {
    let mesh = torus(48);
    let charts = |s: f64| run(&mesh, &UnwrapOptions::default().with_max_stretch(s), 0).unwrap().charts;
    assert!(charts(1.5) <= charts(1.05));
}

#[test]
fn presets_are_ordered_from_few_charts_to_little_stretch_and_the_default_is_the_middle_one() {
    let mesh = torus(48);
    let of = |p: Preset| run(&mesh, &UnwrapOptions::default().with_preset(p), 0).unwrap();
    let [few, balanced, low] = Preset::ALL.map(of);
    assert!(few.charts < balanced.charts && balanced.charts < low.charts);
    assert!(few.stretch_bound > balanced.stretch_bound && balanced.stretch_bound > low.stretch_bound);
    assert_eq!(UnwrapOptions::default().with_preset(Preset::default()), UnwrapOptions::default());
    assert!(Preset::ALL.into_iter().all(|p| Preset::from_name(p.name()) == Some(p)));
    assert_eq!(Preset::from_name("Balanced"), None);
}

#[test]
fn where_much_stretch_is_allowed_a_ball_is_two_charts_and_a_torus_hardly_more() {
    for (mesh, most) in [(ellipsoid(24, 1.0, 1.0), 2), (torus(32), 3)] {
        let uv = run(&mesh, &UnwrapOptions::default().with_max_stretch(1.5), 0).unwrap();
        check(&mesh, &uv);
        assert!(uv.charts <= most, "{} charts", uv.charts);
        assert!(uv.over_stretched <= 0.05, "{}", uv.over_stretched);
    }
}

#[test]
fn large_meshes_take_the_coarse_way_and_keep_the_promises() {
    let mesh = torus(140);
    assert!(mesh.triangles.len() > 30_000);
    let uv = run(&mesh, &UnwrapOptions::default(), 0).unwrap();
    check(&mesh, &uv);
    assert!(uv.over_stretched <= 0.05 && uv.charts <= 30, "{} {}", uv.over_stretched, uv.charts);
}

#[test]
fn the_result_does_not_depend_on_the_number_of_threads() {
    for mesh in [torus(40), torus(110)] {
        let one = run(&mesh, &UnwrapOptions::default(), 1).unwrap();
        assert_eq!(one, run(&mesh, &UnwrapOptions::default(), 4).unwrap());
    }
}

#[test]
fn groups_and_seam_edges_are_borders() {
    let mesh = cube();
    let group = (0..12).collect();
    let uv = run(&mesh, &UnwrapOptions::default().with_face_group(Some(group)), 0).unwrap();
    assert_eq!(uv.charts, 12);
    let flat = TriMesh::new(
        vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
        vec![[0, 1, 2], [0, 2, 3]],
    );
    assert_eq!(run(&flat, &UnwrapOptions::default(), 0).unwrap().charts, 1);
    let cut = UnwrapOptions::default().with_seam_edges(Some(vec![[2, 0]]));
    assert_eq!(run(&flat, &cut, 0).unwrap().charts, 2);
}

#[test]
fn polygons_stay_in_one_piece() {
    let mesh = torus(24);
    let polygon: Vec<u32> = (0..mesh.triangles.len() as u32).map(|f| f / 2).collect();
    let options = UnwrapOptions::default().with_face_polygon(Some(polygon));
    for options in [options.clone(), options.with_max_energy(Some(4.1))] {
        let uv = run(&mesh, &options, 0).unwrap();
        check(&mesh, &uv);
        assert_eq!(uv.split_polygons, 0);
        for (t, pair) in uv.face_chart.chunks_exact(2).enumerate() {
            assert_eq!(pair[0], pair[1], "quad {t}");
            // The two triangles share corners 0 and 1 or 2 of the quad.
            assert_eq!(uv.corner_uv[2 * t][0], uv.corner_uv[2 * t + 1][0]);
            assert_eq!(uv.corner_uv[2 * t][2], uv.corner_uv[2 * t + 1][1]);
        }
    }
}

#[test]
fn pages_have_the_size_and_the_density_asked_for() {
    let mesh = cube();
    let area = |uv: &UvLayout| -> f64 {
        let texels = f64::from(uv.width) * f64::from(uv.height);
        uv.corner_uv.iter().map(twice).sum::<f64>() * 0.5 * texels
    };
    let wide = UnwrapOptions::default().with_page_size([512, 128]);
    let uv = run(&mesh, &wide, 0).unwrap();
    check(&mesh, &uv);
    assert!((area(&uv) / (6.0 * uv.texels_per_unit.powi(2)) - 1.0).abs() < 1e-3);
    let dense = UnwrapOptions::default().with_page_size([256; 2]).with_texels_per_unit(Some(100.0));
    for packer in [Packer::Shapes, Packer::Boxes] {
        // The whole cube needs 60,000 texels of 65,536 at this density: more than one page.
        let options = dense.clone().with_packer(packer).with_hard_edge_angle(Some(60.0));
        let uv = run(&mesh, &options, 0).unwrap();
        check(&mesh, &uv);
        assert_eq!((uv.charts, uv.texels_per_unit.round()), (6, 100.0));
        assert!(uv.pages == 2, "{} pages", uv.pages);
        // One page only: the density gives way.
        let uv = run(&mesh, &options.with_pages(Some(1)), 0).unwrap();
        check(&mesh, &uv);
        assert!(uv.pages == 1 && uv.texels_per_unit < 99.0);
    }
}

/// A flat sheet of two triangles for each unit square.
fn sheet(width: u32, height: u32) -> TriMesh {
    let mut mesh = TriMesh::default();
    for k in 0..(width + 1) * (height + 1) {
        mesh.positions.push([f64::from(k % (width + 1)), f64::from(k / (width + 1)), 0.0]);
    }
    for k in 0..width * height {
        let a = k / width * (width + 1) + k % width;
        let b = a + width + 1;
        mesh.triangles.extend([[a, a + 1, b + 1], [a, b + 1, b]]);
    }
    mesh
}

#[test]
fn a_chart_larger_than_a_page_is_cut_so_that_the_density_is_kept() {
    for (width, height) in [(80, 10), (40, 40)] {
        let mesh = sheet(width, height);
        for packer in [Packer::Shapes, Packer::Boxes] {
            // Pages of 25.6 units.
            let dense = UnwrapOptions::default().with_page_size([256; 2]).with_texels_per_unit(Some(10.0));
            let options = dense.with_packer(packer);
            let uv = run(&mesh, &options, 0).unwrap();
            check(&mesh, &uv);
            assert!((uv.texels_per_unit - 10.0).abs() < 1e-6 && uv.warnings.is_empty(), "{:?}", uv.warnings);
            assert!(uv.pages > 1 && uv.charts > 1, "{} charts on {} pages", uv.charts, uv.pages);
            // On one page the density gives way, and nothing is cut for a page that is not there.
            let one = run(&mesh, &options.clone().with_pages(Some(1)), 0).unwrap();
            check(&mesh, &one);
            assert!(one.pages == 1 && one.texels_per_unit < 10.0, "{}", one.texels_per_unit);
            assert!(if width == height { one.charts == 1 } else { one.charts <= uv.charts });
            // Who allows no more charts gets none.
            let whole = run(&mesh, &options.with_max_charts(Some(1)), 0).unwrap();
            assert!(whole.charts == 1 && whole.texels_per_unit < 10.0);
        }
    }
}

#[test]
fn what_could_not_be_kept_is_reported() {
    let plain = run(&cube(), &UnwrapOptions::default(), 0).unwrap();
    assert_eq!((plain.padding_px, plain.warnings.len()), (2, 0), "{:?}", plain.warnings);
    // Two hundred triangles far apart: seven by seven is all that a page holds with this padding.
    let mut soup = TriMesh::default();
    for i in 0..200u32 {
        let [x, y] = [f64::from(i % 20), f64::from(i / 20)];
        soup.positions.extend([[x, y, 0.0], [x + 0.9, y, 0.0], [x, y + 0.9, 0.0]]);
        soup.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    for packer in [Packer::Shapes, Packer::Boxes] {
        let options = UnwrapOptions::default().with_packer(packer).with_padding_px(128);
        let uv = run(&soup, &options, 0).unwrap();
        check(&soup, &uv);
        assert!(uv.corner_uv.iter().all(|t| twice(t) * 1024.0 * 1024.0 > 1.0), "a face has collapsed");
        assert!((16..128).contains(&uv.padding_px), "{}", uv.padding_px);
        assert!(matches!(&uv.warnings[..], [w] if w.contains("padding")), "{:?}", uv.warnings);
        // A density that one page cannot hold.
        let options = options.with_padding_px(2).with_texels_per_unit(Some(1000.0)).with_pages(Some(1));
        let uv = run(&soup, &options, 0).unwrap();
        assert!(matches!(&uv.warnings[..], [w] if w.contains("density")), "{:?}", uv.warnings);
        // A page with hardly a texel for each.
        let tiny = UnwrapOptions::default().with_packer(packer).with_page_size([16; 2]);
        let uv = run(&soup, &tiny, 0).unwrap();
        check(&soup, &uv);
        assert!(uv.warnings.iter().any(|w| w.contains("texels each")), "{:?}", uv.warnings);
    }
}

#[test]
fn seams_of_the_old_uvs_and_fewer_charts_are_kept_when_asked_for() {
    let mut mesh = torus(24);
    let free = run(&mesh, &UnwrapOptions::default(), 0).unwrap();
    let few = run(&mesh, &UnwrapOptions::default().with_max_charts(Some(4)), 0).unwrap();
    check(&mesh, &few);
    // What the page alone asked for goes first, for no stretch.
    assert!(few.charts <= 4 && few.charts < free.charts && few.stretch_bound == free.stretch_bound);
    // Then stretch goes up.
    let ball = ellipsoid(24, 1.0, 1.0);
    let tight = UnwrapOptions::default().with_max_stretch(1.01);
    let [many, one] =
        [None, Some(1)].map(|most| run(&ball, &tight.clone().with_max_charts(most), 0).unwrap());
    check(&ball, &one);
    assert!(
        one.charts < many.charts && one.stretch_bound > many.stretch_bound,
        "{} {}",
        one.charts,
        many.charts
    );
    // Every triangle an island: every triangle a chart.
    let n = mesh.triangles.len();
    mesh.corner_uv =
        Some((0..n).map(|f| [[f as f32, 0.0], [f as f32 + 0.5, 0.0], [f as f32, 1.0]]).collect());
    let kept = run(&mesh, &UnwrapOptions::default().with_keep_uv_seams(true), 0).unwrap();
    assert_eq!(kept.charts, n);
}

#[test]
fn seams_that_are_no_edges_are_said() {
    let mesh = cube();
    let [a, b, _] = mesh.triangles[0];
    let far = (0..8).find(|&v| v != a && mesh.triangles.iter().all(|t| !(t.contains(&a) && t.contains(&v))));
    let seams = vec![[a, b], [a, far.expect("a corner across the cube")]];
    let uv = run(&mesh, &UnwrapOptions::default().with_seam_edges(Some(seams)), 0).unwrap();
    assert!(uv.warnings.iter().any(|w| w.starts_with("1 of 2 seam edges")), "{:?}", uv.warnings);
}

#[test]
fn broken_faces_are_counted_and_mapped() {
    let mut mesh = cube();
    mesh.positions.push([f64::NAN; 3]);
    mesh.positions.push([0.5, 0.0, 0.0]);
    mesh.triangles.push([0, 0, 1]);
    mesh.triangles.push([0, 1, 8]);
    mesh.triangles.push([0, 9, 1]);
    mesh.triangles.push(mesh.triangles[3]);
    let uv = run(&mesh, &UnwrapOptions::default(), 0).unwrap();
    check(&mesh, &uv);
    assert_eq!((uv.degenerate_faces, uv.duplicate_faces), (3, 1));
}

#[test]
fn a_mesh_without_shared_vertices_is_laid_out_as_one_with_them() {
    let whole = ellipsoid(12, 0.8, 0.6);
    let mut soup = TriMesh::default();
    for t in &whole.triangles {
        let first = soup.positions.len() as u32;
        soup.positions.extend(t.map(|v| whole.positions[v as usize]));
        soup.triangles.push([first, first + 1, first + 2]);
    }
    let [a, b] = [&whole, &soup].map(|mesh| run(mesh, &UnwrapOptions::default(), 0).unwrap());
    check(&soup, &b);
    assert_eq!((a.charts, a.welded_vertices), (b.charts, 0));
    assert_eq!(b.welded_vertices, soup.positions.len() - whole.positions.len());
    // A seam that is asked for between two of its faces stays one.
    let seams = Some((0..soup.positions.len() as u32 / 3).map(|f| [3 * f, 3 * f + 1]).collect());
    let cut = run(&soup, &UnwrapOptions::default().with_seam_edges(seams), 0).unwrap();
    check(&soup, &cut);
    assert!(cut.charts > b.charts, "{} {}", cut.charts, b.charts);
}

#[test]
fn repeated_faces_get_charts_of_their_own_and_the_rest_stays_whole() {
    let mut mesh = ellipsoid(12, 0.8, 0.6);
    let charts = run(&mesh, &UnwrapOptions::default(), 0).unwrap().charts;
    mesh.triangles.extend((0..20).map(|i| mesh.triangles[23 * i]).collect::<Vec<_>>());
    let uv = run(&mesh, &UnwrapOptions::default(), 0).unwrap();
    check(&mesh, &uv);
    assert_eq!(uv.duplicate_faces, 20);
    assert!(uv.charts <= charts + 20, "{} instead of {charts}", uv.charts);
}

#[test]
fn more_stretch_than_helps_is_not_spent_on_fewer_charts() {
    let mut mesh = ellipsoid(12, 0.8, 0.6);
    for i in 0..5u32 {
        let first = mesh.positions.len() as u32;
        let x = 3.0 + f64::from(i);
        mesh.positions.extend([[x, 0.0, 0.0], [x + 0.5, 0.0, 0.0], [x, 0.5, 0.0]]);
        mesh.triangles.push([first, first + 1, first + 2]);
    }
    let one = run(&mesh, &UnwrapOptions::default().with_max_charts(Some(1)), 0).unwrap();
    check(&mesh, &one);
    assert!(one.charts <= 7 && one.stretch_bound < 3.0, "{} {}", one.charts, one.stretch_bound);
}

/// A cone of so many sectors and rings, open below, the radius of its rim 1.
fn cone(sectors: u32, rings: u32, height: f64) -> TriMesh {
    let mut positions = vec![[0.0, 0.0, height]];
    for r in 1..=rings {
        let out = f64::from(r) / f64::from(rings);
        positions.extend((0..sectors).map(|i| {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(i) / f64::from(sectors)).sin_cos();
            [out * cos, out * sin, height * (1.0 - out)]
        }));
    }
    let at = |r: u32, i: u32| 1 + (r - 1) * sectors + i % sectors;
    let mut triangles = Vec::new();
    for i in 0..sectors {
        triangles.push([0, at(1, i), at(1, i + 1)]);
        for r in 1..rings {
            triangles.push([at(r, i), at(r + 1, i), at(r + 1, i + 1)]);
            triangles.push([at(r, i), at(r + 1, i + 1), at(r, i + 1)]);
        }
    }
    TriMesh::new(positions, triangles)
}

#[test]
fn a_cone_is_one_chart_cut_open_once_to_its_tip() {
    let height = 0.3;
    let mesh = cone(48, 8, height);
    let uv = run(&mesh, &UnwrapOptions::default().with_max_stretch(1.01), 0).unwrap();
    check(&mesh, &uv);
    let mut laid = mesh.clone();
    laid.corner_uv = Some(uv.corner_uv);
    let quality = Run::default().execute(|ctx| measure::uv(&laid, ctx)).unwrap();
    let slant = f64::hypot(1.0, height);
    let least = slant / (std::f64::consts::PI * slant).sqrt();
    assert_eq!(uv.charts, 1);
    assert!((0.99..1.2).contains(&(quality.seam / least)), "{} for {least}", quality.seam);
    assert!(quality.stretch_p95 < 1.01, "{}", quality.stretch_p95);
}

#[test]
fn a_bound_holds_at_the_density_of_the_whole_layout() {
    for (name, mesh) in [("ellipsoid", ellipsoid(16, 0.7, 0.4)), ("torus", torus(24)), ("cube", cube())] {
        for bound in [1.05, 1.1, 1.3, 1.5, 2.0, 4.0] {
            let uv = run(&mesh, &UnwrapOptions::default().with_max_stretch(bound), 0).unwrap();
            let mut laid = mesh.clone();
            laid.corner_uv = Some(uv.corner_uv);
            let quality = Run::default().execute(|ctx| measure::uv(&laid, ctx)).unwrap();
            assert!(quality.stretch_p95 <= bound + 1e-3, "{name} at {bound}: {}", quality.stretch_p95);
        }
    }
}

/// Mean symmetric Dirichlet energy by area, at the scale of least energy.
fn energy(mesh: &TriMesh, uv: &UvLayout) -> f64 {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    let (mut forth, mut back, mut all) = (0.0, 0.0, 0.0);
    for (t, at) in mesh.triangles.iter().zip(&uv.corner_uv) {
        let [p, q, r] = t.map(|v| mesh.positions[v as usize]);
        let [a, b] = [q, r].map(|x| [0, 1, 2].map(|k| x[k] - p[k]));
        let [d, e] = [1, 2].map(|i| [0, 1].map(|k| f64::from(at[i][k]) - f64::from(at[0][k])));
        let area = 0.5 * (dot(&a, &a) * dot(&b, &b) - dot(&a, &b).powi(2)).sqrt();
        let det = 0.5 * (d[0] * e[1] - d[1] * e[0]) / area;
        let crossed = 2.0 * dot(&d, &e) * dot(&a, &b);
        let squares = (dot(&d, &d) * dot(&b, &b) + dot(&e, &e) * dot(&a, &a) - crossed) / (4.0 * area * area);
        forth += area * squares;
        back += area * squares / (det * det);
        all += area;
    }
    2.0 * (forth * back).sqrt() / all
}

/// Length of the seams by the square root of the area.
fn seam(mesh: &TriMesh, uv: &UvLayout) -> f64 {
    let mut laid = mesh.clone();
    laid.corner_uv = Some(uv.corner_uv.clone());
    Run::default().execute(|ctx| measure::uv(&laid, ctx)).unwrap().seam
}

#[test]
fn a_bound_on_the_energy_is_held_in_one_chart_with_short_seams() {
    let plain = UnwrapOptions::default();
    for (name, mesh) in [("ellipsoid", ellipsoid(12, 0.7, 0.4)), ("torus", torus(20)), ("cube", cube())] {
        let free = run(&mesh, &plain, 0).unwrap();
        let loose = run(&mesh, &plain.clone().with_max_energy(Some(4.2)), 0).unwrap();
        let tight = run(&mesh, &plain.clone().with_max_energy(Some(4.05)), 0).unwrap();
        for (uv, bound) in [(&loose, 4.2), (&tight, 4.05)] {
            check(&mesh, uv);
            assert_eq!(uv.charts, 1, "{name} at {bound}");
            assert!(energy(&mesh, uv) <= bound + 1e-4, "{name}: {} for {bound}", energy(&mesh, uv));
        }
        let lengths = [&loose, &tight, &free].map(|uv| seam(&mesh, uv));
        assert!(lengths[0] <= lengths[1] + 1e-9 && lengths[1] <= lengths[2] + 1e-9, "{name}: {lengths:?}");
    }
    let none = run(&cube(), &plain.with_max_energy(Some(4.0)), 0);
    assert!(matches!(none, Err(Error::InvalidArgument { .. })), "4 is isometry");
}

#[test]
fn seams_for_a_bound_on_the_energy_do_not_depend_on_the_number_of_threads() {
    let options = UnwrapOptions::default().with_max_energy(Some(4.1));
    let mesh = ellipsoid(14, 0.6, 0.5);
    assert_eq!(run(&mesh, &options, 1).unwrap(), run(&mesh, &options, 3).unwrap());
}

#[test]
fn a_long_strip_is_cut_across_unless_charts_or_pages_are_given() {
    let mut strip = TriMesh::default();
    for i in 0..=80u32 {
        strip.positions.extend((0..=8).map(|j| [f64::from(i), f64::from(j), 0.0]));
    }
    for i in 0..80 {
        for j in 0..8 {
            let [a, b, c, d] = [9 * i + j, 9 * i + j + 9, 9 * i + j + 10, 9 * i + j + 1];
            strip.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    let whole = UnwrapOptions::default().with_max_charts(Some(1));
    let whole = run(&strip, &whole, 0).unwrap();
    let cut = run(&strip, &UnwrapOptions::default(), 0).unwrap();
    check(&strip, &cut);
    assert_eq!((whole.charts, cut.charts), (1, 2));
    assert!(cut.texels_per_unit > 1.5 * whole.texels_per_unit);
    let dense = UnwrapOptions::default().with_texels_per_unit(Some(1.0));
    assert_eq!(run(&strip, &dense, 0).unwrap().charts, 1);
}

#[test]
fn needles_keep_their_length_whichever_side_comes_first() {
    const THIN: f64 = 1e-7;
    let long = |t: &[[f32; 2]; 3]| {
        (0..3).map(|k| (t[k][0] - t[(k + 1) % 3][0]).hypot(t[k][1] - t[(k + 1) % 3][1])).fold(0.0, f32::max)
    };
    for turn in 0..3 {
        let mut mesh = TriMesh::default();
        for i in 0..20u32 {
            let y = f64::from(i) * THIN;
            mesh.positions.extend([[0.0, y, 0.0], [1.0, y, 0.0]]);
            let [a, b, c, d] = [2 * i, 2 * i + 1, 2 * i + 2, 2 * i + 3];
            let pair = [[a, b, d], [a, d, c]];
            mesh.triangles.extend(pair.map(|t| [0, 1, 2].map(|k| t[(k + turn) % 3])));
        }
        mesh.triangles.truncate(38);
        let uv = run(&mesh, &UnwrapOptions::default(), 0).unwrap();
        check(&mesh, &uv);
        let lengths: Vec<f32> = uv.corner_uv.iter().map(long).collect();
        let (least, most) = lengths.iter().fold((f32::MAX, 0f32), |(a, b), &l| (a.min(l), b.max(l)));
        assert!(most < 1.1 * least && least > 0.1, "{least} to {most}");
    }
}

#[test]
fn what_cannot_be_unwrapped_is_a_clear_error() {
    let line = TriMesh::new(vec![[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]], vec![[0, 1, 2]]);
    assert!(matches!(run(&line, &UnwrapOptions::default(), 0), Err(Error::Degenerate { .. })));
    assert!(matches!(run(&TriMesh::default(), &UnwrapOptions::default(), 0), Err(Error::Degenerate { .. })));
    let bad = TriMesh::new(vec![[0.0; 3]], vec![[0, 1, 2]]);
    assert!(matches!(run(&bad, &UnwrapOptions::default(), 0), Err(Error::IndexOutOfRange { .. })));
    let seam = UnwrapOptions::default().with_seam_edges(Some(vec![[0, 1], [7, 8]]));
    let error = run(&cube(), &seam, 0);
    assert!(
        matches!(&error, Err(Error::IndexOutOfRange { what, value: 8, .. }) if what == "seam edge 1"),
        "{error:?}"
    );
    for max_stretch in [1.0, f64::NAN, f64::INFINITY] {
        let options = UnwrapOptions::default().with_max_stretch(max_stretch);
        assert!(matches!(run(&cube(), &options, 0), Err(Error::InvalidArgument { .. })));
    }
    let token = CancelToken::new();
    token.cancel();
    let mut cancelled = Run { cancel: Some(token), ..Run::default() };
    assert_eq!(
        cancelled.execute(|ctx| unwrap(&torus(60), &UnwrapOptions::default(), ctx)),
        Err(Error::Cancelled)
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn any_soup_of_triangles_keeps_the_promises(
        points in prop::collection::vec(prop::array::uniform3(-1.0..1.0f64), 4..14),
        picks in prop::collection::vec(prop::array::uniform3(0usize..1000), 1..40),
    ) {
        let n = points.len();
        let triangles = picks.iter().map(|t| t.map(|k| (k % n) as u32)).collect();
        let mesh = TriMesh::new(points, triangles);
        match run(&mesh, &UnwrapOptions::default(), 1) {
            Ok(uv) => check(&mesh, &uv),
            Err(e) => prop_assert!(matches!(e, Error::Degenerate { .. }), "{e}"),
        }
    }

    #[test]
    fn scale_and_position_do_not_matter(scale in 1e-3..1e3f64, shift in prop::array::uniform3(-1e3..1e3f64)) {
        let mesh = cube();
        let mut moved = mesh.clone();
        for p in &mut moved.positions {
            *p = [0, 1, 2].map(|k| p[k] * scale + shift[k]);
        }
        let [a, b] = [&mesh, &moved].map(|m| run(m, &UnwrapOptions::default(), 1).unwrap());
        prop_assert_eq!(a.charts, b.charts);
        prop_assert!((a.texels_per_unit - b.texels_per_unit * scale).abs() < 1e-3 * a.texels_per_unit);
    }
}
