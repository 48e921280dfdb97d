//! Claims about where seams go: where they cost less, and where the outside hardly sees them.

use atlasfit::geometry::TriMesh;
use atlasfit::measure::uv::seams_seen;
use atlasfit::unwrap::{UnwrapOptions, UvLayout, unwrap};
use atlasfit::{Error, Run};
use std::f64::consts::TAU;

const COLUMNS: usize = 48;
const ROWS: usize = 40;

/// A closed body of revolution about z, without its two ends, with `radius` at each height in [0, 1] and
/// angle as a share of a turn.
fn wall(radius: impl Fn(f64, f64) -> f64) -> TriMesh {
    let mut mesh = TriMesh::default();
    for (i, j) in (0..COLUMNS).flat_map(|i| (0..=ROWS).map(move |j| (i, j))) {
        let (turn, height) = (i as f64 / COLUMNS as f64, j as f64 / ROWS as f64);
        let r = radius(height, turn);
        mesh.positions.push([r * (TAU * turn).cos(), r * (TAU * turn).sin(), 4.0 * height]);
    }
    let place = |i: usize, j: usize| ((i % COLUMNS) * (ROWS + 1) + j) as u32;
    for (i, j) in (0..COLUMNS).flat_map(|i| (0..ROWS).map(move |j| (i, j))) {
        mesh.triangles.push([place(i, j), place(i + 1, j), place(i + 1, j + 1)]);
        mesh.triangles.push([place(i, j), place(i + 1, j + 1), place(i, j + 1)]);
    }
    mesh
}

fn laid(mesh: &TriMesh, options: &UnwrapOptions, threads: usize) -> Result<UvLayout, Error> {
    Run { threads, ..Run::default() }.execute(|ctx| unwrap(mesh, options, ctx))
}

/// The share of the seams that is seen.
fn seen(mesh: &TriMesh, options: &UnwrapOptions) -> f64 {
    let layout = laid(mesh, options, 0).unwrap();
    let with = TriMesh { corner_uv: Some(layout.corner_uv), ..mesh.clone() };
    Run::default().execute(|ctx| seams_seen(&with, options.up, ctx)).unwrap()
}

/// The length of the seams, and the part of it on edges between vertices that `holds` is true of.
fn seams(mesh: &TriMesh, layout: &UvLayout, holds: impl Fn(u32) -> bool) -> [f64; 2] {
    let mut of_edge = std::collections::BTreeMap::new();
    for (t, uv) in mesh.triangles.iter().zip(&layout.corner_uv) {
        for k in 0..3 {
            let ends = [(t[k], uv[k]), (t[(k + 1) % 3], uv[(k + 1) % 3])];
            let [a, b] = if ends[0].0 < ends[1].0 { ends } else { [ends[1], ends[0]] };
            of_edge.entry([a.0, b.0]).or_insert_with(Vec::new).push([a.1, b.1]);
        }
    }
    let mut sums = [0.0; 2];
    for ([a, b], _) in of_edge.into_iter().filter(|(_, uv)| uv.len() == 2 && uv[0] != uv[1]) {
        let [p, q] = [a, b].map(|v| mesh.positions[v as usize]);
        let length = (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt();
        sums[0] += length;
        sums[1] += if holds(a) && holds(b) { length } else { 0.0 };
    }
    sums
}

#[test]
fn seams_go_where_they_are_cheap() {
    // A waist: neither one chart nor two halves fit.
    let mesh = wall(|height, _| 1.0 + 0.35 * (TAU * height).cos());
    let cheap = |v: u32| (v as usize / (ROWS + 1)) % COLUMNS < COLUMNS / 3;
    let price: Vec<f32> =
        (0..mesh.positions.len() as u32).map(|v| if cheap(v) { 0.1 } else { 1.0 }).collect();
    let share = |options: &UnwrapOptions| {
        let [all, inside] = seams(&mesh, &laid(&mesh, options, 0).unwrap(), cheap);
        assert!(all > 0.0);
        inside / all
    };
    let usual = UnwrapOptions::default();
    let priced = |price: &Vec<f32>| usual.clone().with_seam_price(Some(price.clone()));
    let [before, after] = [share(&usual), share(&priced(&price))];
    assert!(after > before + 0.15, "{before} {after}");
    // Only ratios count.
    let small: Vec<f32> = price.iter().map(|p| p / 1024.0).collect();
    let [large, small] = [&price, &small].map(|p| laid(&mesh, &priced(p), 0).unwrap().corner_uv);
    assert!(large == small);
}

#[test]
fn a_common_factor_of_the_prices_changes_nothing() {
    let mesh = wall(|height, turn| 1.0 + 0.3 * (TAU * height).cos() + 0.1 * (3.0 * TAU * turn).sin());
    let usual = laid(&mesh, &UnwrapOptions::default(), 0).unwrap();
    for price in [0.0, 0.003, 1.0, 8.0] {
        let options = UnwrapOptions::default().with_seam_price(Some(vec![price; mesh.positions.len()]));
        assert_eq!(laid(&mesh, &options, 0).unwrap().corner_uv, usual.corner_uv, "{price}");
    }
}

#[test]
fn hidden_seams_are_seen_less() {
    // Six deep flutes, whose grounds hardly see the outside; straight ones, and about a waist that no chart
    // spans.
    for waist in [0.0, 0.3] {
        let radius = |height: f64, turn: f64| {
            (1.0 + waist * (TAU * height).sin()) * (1.0 + 0.25 * (6.0 * TAU * turn).cos())
        };
        let mesh = wall(radius);
        let usual = UnwrapOptions::default();
        let [before, after] = [seen(&mesh, &usual), seen(&mesh, &usual.clone().with_seams_hidden(1.0))];
        assert!(after < before - 0.05, "{waist}: {before} {after}");
    }
}

#[test]
fn from_above_what_lies_below_is_hidden() {
    let waists = [0.2, 0.3, 0.4, 0.5];
    let mut less = 0.0;
    for waist in waists {
        let mut mesh = wall(|height, _| 1.0 + waist * (TAU * height).cos());
        // It lies on its side: y is up.
        mesh.positions.iter_mut().for_each(|p| p[1] += 2.0);
        let up = UnwrapOptions::default().with_up(Some([0.0, 1.0, 0.0]));
        let [before, after] = [seen(&mesh, &up), seen(&mesh, &up.clone().with_seams_hidden(1.0))];
        assert!(after < before, "{waist}: {before} {after}");
        less += before - after;
    }
    // What the plain layout happens to show differs from one to the next.
    assert!(less > 0.05 * waists.len() as f64, "{less}");
}

#[test]
fn hidden_seams_do_not_depend_on_threads() {
    let mesh = wall(|height, turn| 1.0 + 0.3 * (TAU * height).cos() + 0.1 * (3.0 * TAU * turn).sin());
    let options = UnwrapOptions::default().with_seams_hidden(0.7);
    let [one, three] = [1, 3].map(|threads| laid(&mesh, &options, threads).unwrap());
    assert_eq!(one.corner_uv, three.corner_uv);
}

#[test]
fn wrong_prices_are_refused_with_what_and_where() {
    let mesh = wall(|_, _| 1.0);
    let vertices = mesh.positions.len();
    let wrong = |options: UnwrapOptions| laid(&mesh, &options, 0).unwrap_err().to_string();
    let usual = UnwrapOptions::default;
    assert!(wrong(usual().with_seams_hidden(1.5)).contains("seams_hidden is 1.5"));
    assert!(wrong(usual().with_seams_hidden(f64::NAN)).contains("seams_hidden"));
    assert!(wrong(usual().with_up(Some([0.0; 3]))).contains("up is (0, 0, 0)"));
    assert!(wrong(usual().with_seam_price(Some(vec![1.0; 3]))).contains("3 entries"));
    let mut price = vec![1.0; vertices];
    price[7] = -1.0;
    assert!(wrong(usual().with_seam_price(Some(price))).contains("vertex 7 is -1"));
}
