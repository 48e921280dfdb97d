//! Old textures drawn anew for new UVs: colours stay, seams do not bleed, normal maps turn with the UVs.

use atlasfit::Run;
use atlasfit::bake::{BakeOptions, Colors, Image, Textures, bake, density};
use atlasfit::geometry::TriMesh;
use atlasfit::measure::charts;
use atlasfit::unwrap::{Packer, UnwrapOptions, unwrap};

/// Padding that keeps charts apart at mip 3: bilinear look-ups reach 12 texels, from both sides.
const PADDING: u32 = 24;

/// A bumpy sphere of `n` by `2n` quads without poles.
fn bumpy(n: usize) -> TriMesh {
    let pi = std::f64::consts::PI;
    let (mut mesh, columns) = (TriMesh::default(), 2 * n);
    for i in 0..=n {
        for j in 0..columns {
            let (t, p) = (0.2 + (pi - 0.4) * i as f64 / n as f64, pi * j as f64 / n as f64);
            let r = 1.0 + 0.15 * (3.0 * t).sin() * (2.0 * p).cos();
            mesh.positions.push([r * t.sin() * p.cos(), r * t.sin() * p.sin(), r * t.cos()]);
        }
    }
    for i in 0..n {
        for j in 0..columns {
            let at = |i: usize, j: usize| (i * columns + j % columns) as u32;
            mesh.triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            mesh.triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    mesh
}

fn with_uv(mesh: &TriMesh, options: &UnwrapOptions) -> TriMesh {
    let layout = Run::default().execute(|ctx| unwrap(mesh, options, ctx)).unwrap();
    TriMesh { corner_uv: Some(layout.corner_uv), ..mesh.clone() }
}

/// The old UVs: other charts, elsewhere.
fn old() -> TriMesh {
    let options = UnwrapOptions::default().with_max_stretch(1.4).with_packer(Packer::Boxes);
    with_uv(&bumpy(24), &options.with_page_size([512; 2]))
}

fn sample(image: &Image, uv: [f64; 2]) -> [f64; 4] {
    let (w, h) = (image.width as usize, image.height as usize);
    let [x, y] = [uv[0] * w as f64 - 0.5, (1.0 - uv[1]) * h as f64 - 0.5];
    let at = |x: f64, y: f64| {
        let (x, y) = (x.clamp(0.0, (w - 1) as f64) as usize, y.clamp(0.0, (h - 1) as f64) as usize);
        image.rgba[y * w + x].map(f64::from)
    };
    let (s, t) = (x - x.floor(), y - y.floor());
    let c = [at(x.floor(), y.floor()), at(x.floor() + 1.0, y.floor())];
    let d = [at(x.floor(), y.floor() + 1.0), at(x.floor() + 1.0, y.floor() + 1.0)];
    let row = |c: [[f64; 4]; 2], k: usize| c[0][k] + s * (c[1][k] - c[0][k]);
    [0, 1, 2, 3].map(|k| row(c, k) + t * (row(d, k) - row(c, k)))
}

/// The image at half the size, so many times.
fn mip(image: &Image, level: u32) -> Image {
    let side = 1 << level;
    let (width, height) = (image.width / side, image.height / side);
    let texel = |i: u32| {
        let (x, y) = (i % width * side, i / width * side);
        let mut sum = [0u32; 4];
        for at in (0..side * side).map(|k| (y + k / side) * image.width + x + k % side) {
            (0..4).for_each(|c| sum[c] += u32::from(image.rgba[at as usize][c]));
        }
        sum.map(|s| ((s + side * side / 2) / (side * side)) as u8)
    };
    Image { width, height, rgba: (0..width * height).map(texel).collect() }
}

fn at(uv: &[[f32; 2]; 3], w: [f64; 3]) -> [f64; 2] {
    [0, 1].map(|k| (0..3).map(|c| w[c] * f64::from(uv[c][k])).sum())
}

fn difference(a: [f64; 4], b: [f64; 4]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).abs()).sum::<f64>() / 3.0
}

/// New UVs at no lower density than the old texture has, and the texture for them.
fn renewed(old: &TriMesh, source: &Image, normals: bool) -> (TriMesh, Image) {
    let textures = Textures {
        images: std::slice::from_ref(source),
        corner_uv: old.corner_uv.as_ref().unwrap(),
        face_image: None,
        normals,
    };
    Run::default()
        .execute(|ctx| {
            let wanted = density(old, &textures, 0.95, ctx)?;
            for side in [512, 1024, 2048] {
                let options = UnwrapOptions::default().with_page_size([side; 2]).with_padding_px(PADDING);
                let layout = unwrap(old, &options, ctx)?;
                if layout.texels_per_unit >= wanted {
                    let mesh = TriMesh { corner_uv: Some(layout.corner_uv), ..old.clone() };
                    let how = BakeOptions::default().with_size([side; 2]);
                    let image = bake(&mesh, Colors::Textures(textures), &how, ctx)?;
                    return Ok((mesh, image));
                }
            }
            panic!("2048 texels are not enough for {wanted} texels per unit")
        })
        .unwrap()
}

#[test]
fn ten_thousand_points_keep_the_colours_of_the_old_texture() {
    let old = old();
    let texel = |i: u32| {
        let (x, y) = (f64::from(i % 512), f64::from(i / 512));
        let smooth = |x: f64, y: f64| (127.0 + 100.0 * (x / 40.0).sin() * (y / 55.0).cos()) as u8;
        let checker = 60 + 120 * ((i % 512 / 64 + i / 512 / 64) % 2) as u8;
        [smooth(x, y), smooth(y, x), checker, 255]
    };
    let source = Image { width: 512, height: 512, rgba: (0..512 * 512).map(texel).collect() };
    let (new, image) = renewed(&old, &source, false);
    let (from, to) = (old.corner_uv.unwrap(), new.corner_uv.unwrap());
    let mut sum = 0.0;
    for k in 0..10_000usize {
        let f = k * 7919 % from.len();
        let [a, b] = [0.754_877, 0.569_84].map(|step: f64| (step * k as f64).fract());
        let w = if a + b > 1.0 { [1.0 - a, 1.0 - b, a + b - 1.0] } else { [a, b, 1.0 - a - b] };
        sum += difference(sample(&source, at(&from[f], w)), sample(&image, at(&to[f], w)));
    }
    let mean = sum / 10_000.0;
    println!("mean colour error at 10,000 points: {mean:.2} of 255");
    assert!(mean <= 2.0, "the mean error is {mean:.2} of 255");
}

#[test]
fn seams_do_not_bleed_at_mip_3() {
    // Colours that change slowly on the surface, so that what is foreign at a seam stands out.
    let mut old = old();
    let tint = |p: &[f64; 3]| [0, 1, 2].map(|k| (0.5 + 0.4 * p[k]) as f32);
    old.colors = Some(old.positions.iter().map(tint).map(|[r, g, b]| [r, g, b, 1.0]).collect());
    let how = BakeOptions::default().with_size([512; 2]);
    let source = Run::default().execute(|ctx| bake(&old, Colors::Vertices, &how, ctx)).unwrap();
    let (new, image) = renewed(&old, &source, false);
    let small = mip(&image, 3);
    let seams = Run::default().execute(|ctx| charts(&new, ctx)).unwrap().outline;
    let (uv, colors) = (new.corner_uv.as_ref().unwrap(), new.colors.as_ref().unwrap());
    let (mut sum, mut worst, mut count) = (0.0, 0.0f64, 0.0);
    for h in seams {
        let (f, k) = (h as usize / 3, h as usize % 3);
        for s in [0.1, 0.3, 0.5, 0.7, 0.9] {
            let mut w = [0.0; 3];
            (w[k], w[(k + 1) % 3]) = (1.0 - s, s);
            let color = |c: usize| -> f64 {
                let of = |j: usize| w[j] * f64::from(colors[new.triangles[f][j] as usize][c]);
                255.0 * (0..3).map(of).sum::<f64>()
            };
            let error = difference([color(0), color(1), color(2), 0.0], sample(&small, at(&uv[f], w)));
            (sum, worst, count) = (sum + error, worst.max(error), count + 1.0);
        }
    }
    let mean = sum / count;
    println!("colour error along the seams at mip 3: mean {mean:.2}, worst {worst:.2} of 255");
    assert!(mean <= 2.0 && worst <= 10.0, "mean {mean:.2}, worst {worst:.2} of 255");
}

#[test]
fn directions_of_a_normal_map_stay_on_the_surface() {
    // One square whose new UVs are turned by a quarter: what pointed along u now points along v.
    let corners = [[0.0f32, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let positions = corners.map(|[x, y]| [f64::from(x), f64::from(y), 0.0]).to_vec();
    let mut mesh = TriMesh::new(positions, vec![[0, 1, 2], [0, 2, 3]]);
    let uv = |turn: usize| -> Vec<_> {
        mesh.triangles.iter().map(|t| t.map(|v| corners[(v as usize + turn) % 4])).collect()
    };
    let (from, to) = (uv(0), uv(1));
    mesh.corner_uv = Some(to);
    let source = Image { width: 1, height: 1, rgba: vec![[230, 128, 200, 255]] };
    let images = std::slice::from_ref(&source);
    let textures = Textures { images, corner_uv: &from, face_image: None, normals: true };
    let how = BakeOptions::default().with_size([8; 2]);
    let image = Run::default().execute(|c| bake(&mesh, Colors::Textures(textures), &how, c)).unwrap();
    let close = |a: u8, b: u8| a.abs_diff(b) <= 1;
    let [x, y, z, _] = image.rgba[20];
    assert!(close(x, 128) && close(y, 230) && close(z, 200), "{x} {y} {z}");
}
