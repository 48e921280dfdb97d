//! Claims about charts that are laid straight: what a person would straighten lies along the page's sides,
//! and nothing else changes.

use atlasfit::geometry::TriMesh;
use atlasfit::measure::uv::{Pages, UvQuality, uv_on};
use atlasfit::unwrap::{Packer, Straighten, UnwrapOptions, UvLayout, unwrap};
use atlasfit::{Error, Run};
use std::f64::consts::TAU;

/// A grid of n by m quads, each two triangles; closed in its first direction if asked for.
fn grid(n: usize, m: usize, closed: bool, mut at: impl FnMut(f64, f64) -> [f64; 3]) -> TriMesh {
    let columns = if closed { n } else { n + 1 };
    let share = |i: usize, of: usize| i as f64 / of as f64;
    let positions =
        (0..columns).flat_map(|i| (0..=m).map(move |j| (i, j))).map(|(i, j)| at(share(i, n), share(j, m)));
    let place = |i: usize, j: usize| ((i % columns) * (m + 1) + j) as u32;
    let mut triangles = Vec::new();
    for (i, j) in (0..n).flat_map(|i| (0..m).map(move |j| (i, j))) {
        triangles.push([place(i, j), place(i + 1, j), place(i + 1, j + 1)]);
        triangles.push([place(i, j), place(i + 1, j + 1), place(i, j + 1)]);
    }
    TriMesh::new(positions.collect(), triangles)
}

fn around(radius: f64, u: f64, z: f64) -> [f64; 3] {
    [radius * (TAU * u).cos(), radius * (TAU * u).sin(), z]
}

/// A can without its ends, open along one line.
fn wall() -> TriMesh {
    grid(48, 36, false, |u, v| around(1.0, u, 5.0 * v))
}

/// A band of a plane's ring: a third of it, its vertices a little off.
fn strip() -> TriMesh {
    let mut k = 0_u32;
    grid(40, 6, false, |u, v| {
        k += 1;
        let off = |c: f64| 0.0006 * (f64::from(k) * c).sin();
        let [x, y, z] = around(1.0 + 0.12 * v, u / 3.0, 0.1 * u * u);
        [x + off(12.9898), y + off(78.233), z + off(37.719)]
    })
}

/// A flat rim, thin enough to be unrolled within the default bound.
fn rim() -> TriMesh {
    grid(60, 3, true, |u, v| around(1.0 + 0.1 * v, u, 0.0))
}

fn disc() -> TriMesh {
    grid(32, 8, true, |u, v| around(0.05 + 0.95 * v, u, 0.0))
}

fn laid(mesh: &TriMesh, options: &UnwrapOptions, threads: usize) -> Result<(UvLayout, UvQuality), Error> {
    Run { threads, ..Run::default() }.execute(|ctx| {
        let layout = unwrap(mesh, options, ctx)?;
        let with = TriMesh { corner_uv: Some(layout.corner_uv.clone()), ..mesh.clone() };
        let size = [layout.width, layout.height].map(f64::from);
        let quality = uv_on(&with, &Pages { of_face: Some(&layout.face_page), size }, ctx)?;
        Ok((layout, quality))
    })
}

fn auto() -> UnwrapOptions {
    UnwrapOptions::default().with_straighten(Straighten::Auto)
}

/// The layout, with what every layout must hold.
fn straightened(mesh: &TriMesh, options: &UnwrapOptions) -> (UvLayout, UvQuality) {
    let (layout, quality) = laid(mesh, options, 1).unwrap();
    assert_eq!((quality.flips, quality.overlapping_faces, quality.degenerate), (0, 0, 0));
    assert!(quality.stretch_p95 <= layout.stretch_bound, "{}", quality.stretch_p95);
    assert!(quality.stretch_l2 <= layout.stretch_bound, "{}", quality.stretch_l2);
    (layout, quality)
}

#[test]
fn walls_strips_and_rims_become_rectangles_along_the_page_within_the_bound() {
    for (name, mesh) in [("wall", wall()), ("strip", strip()), ("rim", rim())] {
        let (layout, quality) = straightened(&mesh, &auto());
        assert_eq!(layout.straightened_charts, layout.charts, "{name}");
        assert_eq!(quality.straightness, 1.0, "{name}");
    }
}

#[test]
fn straight_charts_stay_along_the_page_with_either_packer_at_a_density_and_on_a_wide_page() {
    let boxes = auto().with_packer(Packer::Boxes);
    let pages = auto().with_texels_per_unit(Some(30.0)).with_page_size([256; 2]);
    for options in [boxes, pages, auto().with_page_size([1024, 512])] {
        assert_eq!(straightened(&wall(), &options).1.straightness, 1.0);
    }
}

#[test]
fn a_disc_stays_as_it_is() {
    let (layout, quality) = straightened(&disc(), &auto());
    let off = laid(&disc(), &UnwrapOptions::default(), 1).unwrap().0;
    assert_eq!(layout, off);
    assert_eq!(layout.straightened_charts, 0);
    assert!(quality.stretch_p95 < 1.001);
}

#[test]
fn a_torus_keeps_the_bound_with_and_without() {
    let at = |u: f64, v: f64| around(2.0 + 0.7 * (TAU * v).cos(), u, 0.7 * (TAU * v).sin());
    straightened(&grid(36, 24, true, at), &auto());
}

#[test]
fn nothing_is_straightened_unless_it_is_asked_for() {
    let layout = laid(&strip(), &UnwrapOptions::default(), 1).unwrap().0;
    assert_eq!(layout.straightened_charts, 0);
}

#[test]
fn charts_that_are_kept_are_not_straightened_which_is_said() {
    let uvs = laid(&strip(), &UnwrapOptions::default(), 1).unwrap().0.corner_uv;
    let mesh = TriMesh { corner_uv: Some(uvs), ..strip() };
    let error = laid(&mesh, &auto().with_keep_uvs(true), 1).unwrap_err();
    assert!(error.to_string().contains("straighten is asked for with keep_uvs"), "{error}");
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    for mesh in [wall(), strip(), rim()] {
        assert_eq!(laid(&mesh, &auto(), 1).unwrap().0, laid(&mesh, &auto(), 4).unwrap().0);
    }
}

#[test]
fn a_model_that_is_turned_is_straightened_as_well() {
    for mesh in [wall(), strip(), rim()] {
        let (c, s) = (0.8, 0.6);
        let turned = |[x, y, z]: [f64; 3]| [c * x - s * z, y, s * x + c * z];
        let other =
            TriMesh { positions: mesh.positions.iter().map(|&p| turned(p)).collect(), ..mesh.clone() };
        let (one, two) = (straightened(&mesh, &auto()), straightened(&other, &auto()));
        assert_eq!(one.0.straightened_charts, two.0.straightened_charts);
        assert!((one.1.stretch_l2 - two.1.stretch_l2).abs() < 1e-3);
        assert_eq!(two.1.straightness, 1.0);
    }
}
