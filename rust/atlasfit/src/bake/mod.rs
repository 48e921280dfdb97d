//! Bakes colours into a texture.
//!
//! In: a mesh with UVs, and colours of its vertices, of points near it, or of the textures that it had with
//! other UVs. Out: an [`Image`] for those UVs.
//! Every texel whose middle lies on a face gets the colour there, a texel that only holds a corner the
//! corner's; the colours then spread beyond the borders of the charts, so that filtered look-ups find nothing
//! foreign (dilation).

mod dilate;
mod image;
mod owners;
mod page;
mod resample;

use crate::error::{Error, Result};
use crate::geometry::{PointCloud, TriMesh};
use crate::numeric::vec3::Vec3;
use crate::run::{Context, Stage, total_bytes, with_threads};
use crate::setters::setters;
use crate::spatial::neighbours::{Neighbour, Neighbours};
use dilate::dilate;
use image::ColorAt;
pub use image::Image;
use owners::{NO_FACE, ROWS, owners};
pub use page::{TexturePage, texture_padding, texture_page};
use rayon::prelude::*;
use resample::of_textures;
pub use resample::{NO_IMAGE, Textures, density};

/// Points that give a texel its colour.
const POINTS: usize = 4;
/// Their weights are 1 / (squared distance + this times the nearest one's), so that a point at the texel does
/// not outweigh all others. Has no unit.
const SOFTNESS: f64 = 0.1;
/// Added to a squared distance that may be 0, below any other.
const LEAST_DISTANCE2: f64 = 1e-300;
/// Texels for each point of a scan, so that its colours survive. Derived: twice the points' density along
/// each axis.
const TEXELS_PER_POINT: f64 = 4.0;
/// Share of a page that charts cover, for estimates. Measured with `atlasfit bench unwrap`.
const COVERAGE: f64 = 0.7;
/// Texels between two looks at the run: the nearest points of one take up to 5 us.
const TEXELS_PER_CHECK: usize = 512;
/// Bytes for one texel: owner, colour, state and front of the spreading; twice, and encoding the image is
/// covered too. Fitted by hand to peaks of runs; `tests/memory.py` checks that they hold.
const BYTES_PER_TEXEL: u64 = 20;
/// Bytes for one point whose colours are baked: its place in the search tree. Measured as for texels.
const BYTES_PER_POINT: u64 = 110;

/// Where the colours come from.
#[derive(Debug, Clone, Copy)]
pub enum Colors<'a> {
    /// The colours of the mesh's own vertices.
    Vertices,
    /// The colours of points in the mesh's frame, the nearest ones to each texel.
    Points(&'a PointCloud),
    /// The old textures of the mesh, through its old UVs.
    Textures(Textures<'a>),
}

/// How to bake.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct BakeOptions {
    /// Width and height in texels, each 1 to 65536. Default 1024 by 1024.
    pub size: [u32; 2],
    /// How far the colours spread beyond the charts, in texels. Default 16; what is left is of the mean
    /// colour.
    pub dilation: u32,
}

setters! {
    BakeOptions {
        with_size: size: [u32; 2],
        with_dilation: dilation: u32,
    }
}

impl Default for BakeOptions {
    fn default() -> Self {
        Self { size: [1024; 2], dilation: 16 }
    }
}

/// Side in texels of a square texture that keeps the colours of so many points: about four texels per point,
/// a power of two from 512 to 8192.
///
/// ```
/// assert_eq!(atlasfit::bake::side_for(1_000_000), 4096);
/// ```
#[must_use]
pub fn side_for(points: usize) -> u32 {
    let side = (TEXELS_PER_POINT * points as f64 / COVERAGE).sqrt();
    (side.min(8192.0) as u32).next_power_of_two().clamp(512, 8192)
}

/// Bytes that [`bake`] needs at its peak with so many threads for a mesh of so many vertices and faces, which
/// are included, and the colours of so many points (0 for those of the vertices). A rough upper bound.
///
/// ```
/// use atlasfit::bake::{BakeOptions, memory_needed};
/// let options = BakeOptions::default().with_size([4096; 2]);
/// assert!(memory_needed(50_000, 100_000, 0, &options, 2) > 16 << 24);
/// ```
#[must_use]
pub fn memory_needed(
    vertices: usize,
    faces: usize,
    points: usize,
    options: &BakeOptions,
    threads: usize,
) -> u64 {
    // Positions and colours; corners and their UVs; a cloud of positions and colours.
    let held = [(vertices, 40), (faces, 36), (points, 40 + BYTES_PER_POINT)];
    total_bytes(&held).saturating_add(texel_bytes(options, threads))
}

/// Bytes of the texture and of the threads that fill it.
fn texel_bytes(options: &BakeOptions, threads: usize) -> u64 {
    let [width, height] = options.size.map(|s| s as usize);
    with_threads(total_bytes(&[(width.saturating_mul(height), BYTES_PER_TEXEL)]), threads)
}

/// Bakes colours into a texture for the mesh's UVs; faces or parts outside [0, 1] are left out.
///
/// # Errors
/// [`Error::EmptyInput`] without UVs or colours; [`Error::InvalidArgument`] for a size out of range or
/// columns of wrong length; [`Error::IndexOutOfRange`]; those of [`Context::check`] and [`Context::reserve`].
///
/// ```
/// use atlasfit::{Run, bake::{BakeOptions, Colors, bake}, geometry::TriMesh};
/// let mut mesh = TriMesh::new(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], vec![[0, 1, 2]]);
/// mesh.corner_uv = Some(vec![[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]]);
/// mesh.colors = Some(vec![[1.0, 0.0, 0.0, 1.0]; 3]);
/// let options = BakeOptions::default().with_size([8, 8]);
/// let image = Run::default().execute(|ctx| bake(&mesh, Colors::Vertices, &options, ctx))?;
/// assert_eq!((image.width, image.height, image.rgba[0]), (8, 8, [255, 0, 0, 255]));
/// # Ok::<(), atlasfit::Error>(())
/// ```
pub fn bake(mesh: &TriMesh, colors: Colors<'_>, options: &BakeOptions, ctx: &Context<'_>) -> Result<Image> {
    let [width, height] = options.size.map(|s| s as usize);
    if options.size.iter().any(|s| !(1..=65536).contains(s)) {
        return Err(Error::invalid(format!("the texture is {width} by {height}"), "Give 1 to 65536 texels"));
    }
    mesh.validate()?;
    let source = match colors {
        Colors::Vertices => 0,
        Colors::Points(cloud) => cloud.bytes() + BYTES_PER_POINT * cloud.len() as u64,
        Colors::Textures(old) => old.bytes(),
    };
    ctx.reserve(
        mesh.bytes() + source + texel_bytes(options, ctx.threads()),
        "Raise the limit, or ask for a smaller texture",
    )?;
    ctx.stage(Stage::Bake, height);
    let uv = mesh.corner_uv.as_ref().filter(|uv| !uv.is_empty() && uv.len() == mesh.triangles.len());
    let uv = uv.ok_or_else(|| Error::empty("the mesh has no UVs", "Unwrap it first"))?;
    let color_at: ColorAt<'_> = match colors {
        Colors::Vertices => of_vertices(mesh)?,
        Colors::Points(cloud) => of_points(mesh, cloud, ctx)?,
        Colors::Textures(old) => of_textures(mesh, old)?,
    };
    let mut owner = owners(uv, width, height, ctx)?;
    if let Colors::Textures(old) = colors {
        // A face without an image leaves its texels to the others' colours.
        owner.par_iter_mut().for_each(|f| {
            if *f != NO_FACE && !old.covers(*f as usize) {
                *f = NO_FACE;
            }
        });
    }
    let mut rgba = ctx.filled([0u8; 4], width * height)?;
    rgba.par_chunks_mut(width * ROWS).zip(owner.par_chunks(width * ROWS)).enumerate().try_for_each(
        |(block, (texels, owner))| {
            for (i, (texel, &f)) in texels.iter_mut().zip(owner).enumerate() {
                if i.is_multiple_of(TEXELS_PER_CHECK) {
                    ctx.check()?;
                }
                if f != NO_FACE {
                    let at = block * ROWS * width + i;
                    let weights = barycentric(&uv[f as usize], middle(at, width, height));
                    *texel = color_at(f, weights).map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8);
                }
            }
            ctx.advance(ROWS);
            Ok(())
        },
    )?;
    let mut filled = ctx.filled(false, owner.len())?;
    (filled.par_chunks_mut(width * ROWS).zip(owner.par_chunks(width * ROWS))).try_for_each(
        |(filled, owner)| {
            ctx.check()?;
            filled.iter_mut().zip(owner).for_each(|(filled, &f)| *filled = f != NO_FACE);
            Ok(())
        },
    )?;
    drop(owner);
    dilate(&mut rgba, filled, width, options.dilation, ctx)?;
    Ok(Image { width: options.size[0], height: options.size[1], rgba })
}

fn no_colours(of: &str) -> Error {
    Error::empty(format!("{of} have no colours"), "Give a coloured mesh or scan")
}

/// The colours of the mesh's vertices, interpolated linearly.
fn of_vertices(mesh: &TriMesh) -> Result<ColorAt<'_>> {
    let own = mesh.colors.as_ref().filter(|c| c.len() == mesh.positions.len());
    let own = own.ok_or_else(|| no_colours("the vertices"))?;
    Ok(Box::new(move |f, w| {
        let corner = mesh.triangles[f as usize].map(|v| own[v as usize]);
        [0, 1, 2, 3].map(|k| (0..3).map(|c| w[c] * f64::from(corner[c][k])).sum())
    }))
}

/// The mean colour of the nearest points, the nearer ones weighted more.
fn of_points<'a>(mesh: &'a TriMesh, cloud: &'a PointCloud, ctx: &Context<'_>) -> Result<ColorAt<'a>> {
    let own = cloud.colors.as_ref().filter(|c| c.len() == cloud.positions.len());
    let own = own.ok_or_else(|| no_colours("the points"))?;
    let finite = |i: &u32| cloud.positions[*i as usize].iter().all(|x| x.is_finite());
    let index: Vec<u32> = (0..cloud.positions.len() as u32).filter(finite).collect();
    if index.is_empty() {
        return Err(Error::empty("no point is finite", "Give a coloured scan near the mesh"));
    }
    let at: Vec<Vec3> = index.iter().map(|&i| Vec3(cloud.positions[i as usize])).collect();
    let tree = Neighbours::build(&at, ctx)?;
    Ok(Box::new(move |f, w| {
        let corner = mesh.triangles[f as usize].map(|v| mesh.positions[v as usize]);
        let p = (0..3).fold(Vec3::ZERO, |p, k| p + Vec3(corner[k]) * w[k]);
        let mut near: Vec<Neighbour> = Vec::new();
        tree.nearest(p, POINTS, &mut near);
        let soft = near.first().map_or(0.0, |n| n.dist2) * SOFTNESS + LEAST_DISTANCE2;
        let (mut sum, mut total) = ([0.0; 4], 0.0);
        for n in &near {
            let weight = 1.0 / (n.dist2 + soft);
            let c = own[index[n.index as usize] as usize];
            (0..4).for_each(|k| sum[k] += weight * f64::from(c[k]));
            total += weight;
        }
        sum.map(|s| s / total)
    }))
}

/// The middle of a texel in UVs; rows run from the top.
fn middle(at: usize, width: usize, height: usize) -> [f64; 2] {
    [((at % width) as f64 + 0.5) / width as f64, 1.0 - ((at / width) as f64 + 0.5) / height as f64]
}

/// Weights of the corners at a point, brought into the face.
fn barycentric(uv: &[[f32; 2]; 3], p: [f64; 2]) -> [f64; 3] {
    let [a, b, c] = uv.map(|q| q.map(f64::from));
    let area =
        |a: [f64; 2], b: [f64; 2], c: [f64; 2]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    let w = [area(b, c, p), area(c, a, p), area(a, b, p)];
    let total = area(a, b, c);
    if total == 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let w = w.map(|w| (w / total).max(0.0));
    let sum: f64 = w.iter().sum();
    w.map(|w| w / sum)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::Run;

    /// A unit square with a red, a green, a blue and a white corner, mapped to the lower left quarter of the
    /// page.
    fn square() -> TriMesh {
        let corner = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let triangles = vec![[0u32, 1, 2], [0, 2, 3]];
        let uv = |v: u32| corner[v as usize].map(|x: f64| (x * 0.5) as f32);
        TriMesh {
            positions: corner.iter().map(|c| [c[0], c[1], 0.0]).collect(),
            corner_uv: Some(triangles.iter().map(|t| t.map(uv)).collect()),
            triangles,
            colors: Some(vec![
                [1.0, 0.0, 0.0, 1.0],
                [0.0, 1.0, 0.0, 1.0],
                [0.0, 0.0, 1.0, 1.0],
                [1.0, 1.0, 1.0, 1.0],
            ]),
            ..TriMesh::default()
        }
    }

    #[test]
    fn texels_get_the_colour_of_their_place_and_colours_spread_beyond_the_chart() {
        let options = BakeOptions::default().with_size([64, 64]).with_dilation(4);
        let bake =
            |mesh: &TriMesh, colors: Colors<'_>| Run::default().execute(|c| bake(mesh, colors, &options, c));
        let mesh = square();
        let image = bake(&mesh, Colors::Vertices).unwrap();
        let at = |image: &Image, x: usize, y: usize| image.rgba[(63 - y) * 64 + x];
        let near = |a: [u8; 4], b: [u8; 4]| a.iter().zip(&b).all(|(a, b)| a.abs_diff(*b) < 16);
        assert!(near(at(&image, 0, 0), [255, 0, 0, 255]), "{:?}", at(&image, 0, 0));
        assert!(near(at(&image, 31, 0), [0, 255, 0, 255]) && near(at(&image, 31, 31), [0, 0, 255, 255]));
        // Beside the chart the same colours, far away the mean.
        assert!(near(at(&image, 34, 0), at(&image, 31, 0)));
        assert_eq!(at(&image, 60, 60), at(&image, 50, 5));
        // Points in place of the vertices give the corners the same colours.
        let cloud = PointCloud {
            positions: mesh.positions.clone(),
            colors: mesh.colors.clone(),
            ..PointCloud::default()
        };
        assert!(near(at(&bake(&mesh, Colors::Points(&cloud)).unwrap(), 0, 0), [255, 0, 0, 255]));
        let bare = TriMesh { colors: None, ..mesh.clone() };
        assert!(matches!(bake(&bare, Colors::Vertices), Err(Error::EmptyInput { .. })));
        let flat = TriMesh { corner_uv: None, ..mesh };
        assert!(matches!(bake(&flat, Colors::Vertices), Err(Error::EmptyInput { .. })));
    }

    #[test]
    fn a_chart_thinner_than_a_texel_is_seen() {
        let thin = |v: f32| [[0.51, v], [0.511, v], [0.51, v + 0.001]];
        // Nearest to the texels' middles: the first face's red corner, the second one's white corner.
        let [a, b, c] = thin(0.26);
        let mesh = TriMesh { corner_uv: Some(vec![thin(0.51), [b, c, a]]), ..square() };
        let options = BakeOptions::default().with_size([64, 64]).with_dilation(0);
        let image = Run::default().execute(|c| bake(&mesh, Colors::Vertices, &options, c)).unwrap();
        let colors = image.rgba.iter().filter(|c| **c != image.rgba[0]).count();
        assert_eq!(colors, 2, "all other texels have the mean colour");
    }
}
